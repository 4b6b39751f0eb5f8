"""One style for the figures of all experiments."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec

from ..geometry import Floats
from ..records import Surface
from ..view._camera import Camera, choose_camera
from ..view._curves import calm, round_ticks
from ..view._marks import INK, SOFT, fit_line
from ..view._opengl import opengl_problem
from ..view._scene import Scene, mesh_lines
from ..view._tessellate import at_pieces, tessellate
from ._records import headed

WIDTH, DPI = 12.8, 100
COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#1a1a1a")
"""Of curves: Okabe and Ito's, told apart by all."""

_HEAD = 1.05  # inches above the panels
_PIECES = 30_000


def new_figure(number: str, title: str, message: str, height: float = 5.2) -> Figure:
    """An empty figure under its title and what it shows, in one sentence."""
    figure = Figure(figsize=(WIDTH, height), dpi=DPI, facecolor="white")
    top = 1 - 0.18 / height
    fit_line(
        figure, 0.02, top, f"{headed(number)}   {title}", 0.96, size=15, weight="bold", color=INK
    )
    fit_line(figure, 0.02, top - 0.34 / height, message, 0.96, size=10.5, color=SOFT)
    return figure


def grid(
    figure: Figure, rows: int, columns: int, below: float = 0.6, **spaces: Any
) -> list[SubplotSpec]:
    """Cells below the title, row by row; ``below`` inches are left under them.

    ``spaces`` are those of a GridSpec: left, right, wspace, hspace, width_ratios...
    """
    height = figure.get_size_inches()[1]
    inside = {"left": 0.06, "right": 0.98, "top": 1 - _HEAD / height, "bottom": below / height}
    cells = figure.add_gridspec(rows, columns, **{**inside, **spaces})
    return [cells[k] for k in range(rows * columns)]


def curve_axes(figure: Figure, cell: SubplotSpec, caption: str, x: str, y: str) -> Axes:
    """Axes with a caption and named axes with units."""
    axes = figure.add_subplot(cell)
    axes.set_title(caption, loc="left", size=10.5, color=INK)
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    calm(axes)
    return axes


def logarithmic(axes: Axes, *, x: bool = True, y: bool = True) -> None:
    """Logarithmic axes with round ticks."""
    if x:
        axes.set_xscale("log")
        round_ticks(axes.xaxis)
    if y:
        axes.set_yscale("log")
        round_ticks(axes.yaxis)


def draw_surface(
    figure: Figure,
    cell: SubplotSpec,
    surface: Surface,
    colors: Floats,
    caption: str = "",
    *,
    towards: Floats | None = None,
    mesh: bool = False,
) -> Axes:
    """A surface in parallel projection with a colour (n, 3) at each node.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    cell : SubplotSpec
    surface : Surface
    colors : array (n, 3)
        sRGB.
    caption : str
    towards : array (3,), optional
        Direction to the viewer. By default one that shows much of it.
    mesh : bool
        Draw the elements' edges, too.
    """
    axes = figure.add_subplot(cell)
    axes.set_axis_off()
    axes.set_title(caption, loc="left", size=10.5, color=INK)
    split = int(np.clip((_PIECES / len(surface.triangles)) ** 0.5, 1, 8))
    pieces = tessellate(surface, split)
    if towards is None:
        camera = choose_camera(pieces.middles, pieces.facing, pieces.areas, None)
    else:
        camera = _camera(np.asarray(towards, dtype=float), surface.points)
    width, height = figure.get_size_inches()
    box = axes.get_position()
    window = camera.window(box.width * width / (box.height * height), 0.03)
    axes.set_xlim(window[:2])
    axes.set_ylim(window[2:])
    if opengl_problem() is None:
        from ..view._render_vtk import draw
    else:
        from ..view._render_matplotlib import draw
    lift = 0.002 * float(np.ptp(surface.points, axis=0).max())
    lines = mesh_lines(surface, camera, lift) if mesh else None
    shown = np.clip(at_pieces(surface, split, colors), 0, 1)
    draw(axes, Scene(pieces, shown, lines), camera)
    return axes


def draw_line(axes: Axes, points: Floats, towards: Floats, color: str = "black") -> None:
    """A dashed line through points (k, 3) over a surface drawn ``towards`` a viewer."""
    x, y, _ = _camera(np.asarray(towards, dtype=float), points).project(points).T
    limits = axes.get_xlim(), axes.get_ylim()
    axes.plot(x, y, color="white", lw=2.4)
    axes.plot(x, y, color=color, lw=1.3, ls=(0, (4, 2)))
    axes.set_xlim(limits[0])
    axes.set_ylim(limits[1])


def _camera(towards: Floats, points: Floats) -> Camera:
    """Upright, z up as far as that allows."""
    towards = towards / np.linalg.norm(towards)
    up = np.eye(3)[2] if abs(towards[2]) < 0.95 else np.eye(3)[1]
    right = np.cross(up, towards)
    right /= np.linalg.norm(right)
    axes = np.array([right, np.cross(towards, right), towards])
    inside = points @ axes.T
    return Camera(axes, inside.min(axis=0), inside.max(axis=0))
