"""Pictures of groups and embeddings: the same surface from the same side, a panel a method."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import isovary as iv
from isovary.geometry import Floats
from isovary.view._camera import Camera
from isovary.view._opengl import opengl_problem
from isovary.view._scene import Scene
from isovary.view._tessellate import at_pieces, tessellate

DARK, GREY = "#1d1d1f", "#555555"
TOWARDS = np.array([0.5, 0.22, 0.84])
SPLIT = 4


@dataclass(frozen=True, eq=False)
class Panel:
    """A surface with a colour (n, 3) at each node, words above it, and circles around its tips."""

    surface: iv.Surface
    colors: Floats
    title: str
    detail: str
    tips: Floats
    region: float

    def marked(self, detail: str) -> Panel:
        """With more to say, before the rest."""
        return replace(self, detail=f"{detail}, {self.detail}")


def draw_panels(
    panels: Sequence[Panel],
    title: str,
    said: str,
    path: Path,
    *,
    columns: int,
    width: float = 12.8,
) -> None:
    """Rows of panels under a title and a line that says what is seen."""
    wide = 0.98 / columns
    side = width * (wide - 0.014)
    rows = -(-len(panels) // columns)
    high = side + 0.46
    height = 0.88 + rows * high + 0.05
    figure = Figure(figsize=(width, height), dpi=130, facecolor="white")
    figure.text(0.015, 1 - 0.4 / height, title, size=16, weight="bold", color=DARK)
    figure.text(0.015, 1 - 0.66 / height, said, size=9.5, color=GREY)
    for place, panel in enumerate(panels):
        row, column = divmod(place, columns)
        left = 0.015 + column * wide
        top = 1 - (0.88 + row * high) / height
        figure.text(left, top - 0.08 / height, panel.title, size=10, weight="bold", color=DARK)
        figure.text(left, top - 0.26 / height, panel.detail, size=9.5, color=GREY)
        bottom = top - (0.33 + side) / height
        axes = figure.add_axes((left, bottom, wide - 0.014, side / height))
        draw_surface(axes, panel)
    figure.savefig(path)


def camera_for(points: Floats) -> Camera:
    """From obliquely above, z up."""
    towards = TOWARDS / np.linalg.norm(TOWARDS)
    right = np.cross([0.0, 0.0, 1.0], towards)
    right /= np.linalg.norm(right)
    axes = np.array([right, np.cross(towards, right), towards])
    inside = points @ axes.T
    return Camera(axes, inside.min(axis=0), inside.max(axis=0))


def draw_surface(axes: Axes, panel: Panel) -> None:
    axes.set_axis_off()
    surface = panel.surface
    camera = camera_for(surface.points)
    width, height = axes.get_figure().get_size_inches()
    box = axes.get_position()
    left, right, bottom, top = camera.window(box.width * width / (box.height * height), 0.02)
    axes.set_xlim(left, right)
    axes.set_ylim(bottom, top)
    if opengl_problem() is None:
        from isovary.view._render_vtk import draw
    else:
        from isovary.view._render_matplotlib import draw
    colors = np.clip(at_pieces(surface, SPLIT, panel.colors), 0, 1)
    draw(axes, Scene(tessellate(surface, SPLIT), colors), camera)
    for tip in panel.tips:
        draw_circle(axes, camera, tip, panel.region)


def draw_circle(axes: Axes, camera: Camera, tip: Floats, angle: float) -> None:
    """The part of a circle on the sphere around a tip that faces the viewer."""
    across = np.cross(tip, [1.0, 0.3, 0.2])
    across /= np.linalg.norm(across)
    turn = np.linspace(0, 2 * np.pi, 181)[:, None]
    around = np.cos(turn) * across + np.sin(turn) * np.cross(tip, across)
    circle = camera.project(np.cos(angle) * tip + np.sin(angle) * around)
    circle[circle[:, 2] < 0] = np.nan
    axes.plot(circle[:, 0], circle[:, 1], color="black", lw=0.9)
