"""The picture of a surface whose nodes were moved: how far, on the surface as it is now."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..geometry import Floats
from ..records import Surface
from ._camera import Camera, choose_camera, in_sight
from ._marks import INK, SOFT, Box, color_bar, diamond, fit_line, paragraphs, scale_bar, tripod
from ._opengl import opengl_problem
from ._paint import MOVE_MAP, mapped
from ._scene import Scene, mesh_lines
from ._tessellate import Pieces, at_pieces, tessellate

_SIZE, _DPI = (12.8, 7.2), 160
_PIECES, _PIECES_WITHOUT_OPENGL = 200_000, 60_000
_FRONT: Box = (0.02, 0.17, 0.47, 0.66)
_SIDE: Box = (0.51, 0.17, 0.47, 0.66)
_LIFT = 3e-3  # of the size


def displacement_figure(
    original: Surface, moved: Surface, title: str | None = None, mesh: bool = True
) -> Figure:
    """One figure of a moved surface: from above what moved most, and from its side.

    Parameters
    ----------
    original, moved : Surface
        With the same triangles.
    title : str, optional
        What was moved, for the line below the heading; the heading says how far.
    mesh : bool
        Draw the edges of the elements, which show the shape.

    Returns
    -------
    matplotlib.figure.Figure
        12.8 x 7.2 inches at 160 dots per inch; belongs to no window.

    Notes
    -----
    The colour is the displacement's part along the original's outward normal: red outward, blue
    inward. The node that moved most is marked.

    Cost: 2 s.
    """
    way = moved.points - original.points
    along, size = (way * original.normals).sum(axis=1), np.linalg.norm(way, axis=1)
    most, limit = int(size.argmax()), float(np.abs(along).max())
    problem = opengl_problem()
    wanted = _PIECES if problem is None else _PIECES_WITHOUT_OPENGL
    split = int(np.clip(round((wanted / len(moved.triangles)) ** 0.5), 1, 16))
    pieces = tessellate(moved, split)
    share = np.full(len(along), 0.5) if limit == 0 else along / (2 * limit) + 0.5
    colors = at_pieces(moved, split, mapped(MOVE_MAP, share))
    figure = Figure(figsize=_SIZE, dpi=_DPI, facecolor="white")
    _heading(figure, original, size, along[most], title)
    for box, camera in zip((_FRONT, _SIDE), _cameras(original, moved, pieces, most), strict=True):
        axes = _draw(figure, box, camera, moved, pieces, colors, mesh)
        if limit > 0 and _seen(moved, most, pieces, camera):
            diamond(axes, camera.project(moved.points[most]))
        tripod(figure, (box[0] + box[2] - 0.05, 0.11, 0.045, 0.08), camera)
        if box is _FRONT:
            scale_bar(axes)
    if limit > 0:
        words = "displacement along the original's normal (length): blue inward, red outward"
        color_bar(figure, (0.33, 0.095, 0.34, 0.018), MOVE_MAP, (-limit, limit), words)
    if problem is not None:
        paragraphs(figure, (0.02, 0.035), [problem], width=0.5, color=SOFT)
    return figure


def _heading(
    figure: Figure, original: Surface, size: Floats, along: float, title: str | None
) -> None:
    extent = float(np.ptp(original.points, axis=0).max())
    count, most = int((size > 0).sum()), float(size.max())
    where = "inward" if along < 0 else "outward"
    said = f"Moved {where} by {most:.3g} at most, {most / extent:.2g} of the size"
    words = said if count else "Nothing moved"
    fit_line(figure, 0.02, 0.975, words, 0.96, size=15, weight="bold", color=INK)
    parts = [title, f"{count} of {len(size)} nodes moved", f"size {extent:.3g} (largest extent)"]
    line = "   ·   ".join(part for part in [*parts, "◇ moved most" if count else None] if part)
    fit_line(figure, 0.02, 0.92, line, 0.96, size=10, color=SOFT)


def _cameras(original: Surface, moved: Surface, pieces: Pieces, most: int) -> tuple[Camera, Camera]:
    """Obliquely from above the place that moved most, and from its side."""
    normal = original.normals[most]
    if not np.linalg.norm(moved.points[most] - original.points[most]) > 0:
        camera = choose_camera(pieces.middles, pieces.facing, pieces.areas, None)
        return camera, camera
    across = np.cross(np.eye(3)[int(np.abs(normal).argmin())], normal)
    across /= np.linalg.norm(across)
    up = normal
    return _camera(0.77 * normal - 0.64 * across, up, moved), _camera(-across, up, moved)


def _camera(towards: Floats, up: Floats, surface: Surface) -> Camera:
    towards = towards / np.linalg.norm(towards)
    right = np.cross(up, towards)
    right /= np.linalg.norm(right)
    axes = np.array([right, np.cross(towards, right), towards])
    inside = surface.points @ axes.T
    return Camera(axes, inside.min(axis=0), inside.max(axis=0))


def _draw(
    figure: Figure,
    box: Box,
    camera: Camera,
    surface: Surface,
    pieces: Pieces,
    colors: Floats,
    mesh: bool,
) -> Axes:
    if opengl_problem() is None:
        from ._render_vtk import draw
    else:
        from ._render_matplotlib import draw
    axes = figure.add_axes(box)
    axes.set_axis_off()
    width, height = figure.get_size_inches()
    left, right, bottom, top = camera.window(box[2] * width / (box[3] * height))
    axes.set_xlim(left, right)
    axes.set_ylim(bottom, top)
    lift = _LIFT * float(np.ptp(surface.points, axis=0).max())
    lines = mesh_lines(surface, camera, lift) if mesh else None
    draw(axes, Scene(pieces, np.clip(colors, 0, 1), lines), camera)
    return axes


def _seen(surface: Surface, node: int, pieces: Pieces, camera: Camera) -> bool:
    toward = camera.axes[2]
    facing = surface.normals[node] @ toward > 0
    return bool(facing and in_sight(surface.points[node][None], pieces.middles, toward)[0])
