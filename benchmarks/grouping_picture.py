"""Pictures of groups and embeddings: the same surface from the same side, a panel a method."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import isovary as iv
from isovary.geometry import Floats, edges_of, linear_triangles
from isovary.row_distances import distances
from isovary.view._camera import Camera
from isovary.view._opengl import opengl_problem
from isovary.view._scene import Scene
from isovary.view._tessellate import at_pieces, tessellate

DARK, GREY = "#1d1d1f", "#555555"
TOWARDS = np.array([0.5, 0.22, 0.84])
SPLIT = 8


AGREE = 0.995  # of the rows nearest to their own group's center: it was by centers
ROUNDS = 3


@dataclass(frozen=True, eq=False)
class Panel:
    """A surface with a colour (n, 3) at each node, words above it, and circles around its tips.

    With ``scores`` (n, k), the smallest of which tells the group, and the groups' ``palette``
    (k, 3), borders run where interpolated scores cross; without, colours are interpolated.
    """

    surface: iv.Surface
    colors: Floats
    title: str
    detail: str
    tips: Floats
    region: float
    scores: Floats | None = None
    palette: Floats | None = None

    @property
    def piece_colors(self) -> Floats:
        """Colours of the pieces that the surface is drawn in."""
        if self.scores is None or self.palette is None:
            return np.clip(at_pieces(self.surface, SPLIT, self.colors), 0, 1)
        return self.palette[at_pieces(self.surface, SPLIT, self.scores).argmin(axis=1)]

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
    draw(axes, Scene(tessellate(surface, SPLIT), panel.piece_colors), camera)
    for tip in panel.tips:
        draw_circle(axes, camera, tip, panel.region)


def group_scores(rows: Floats, groups: iv.Clusters, surface: iv.Surface) -> Floats:
    """Scores (n, k) of a grouping of all nodes; the smallest tells the group.

    Distances of the rows to the centers, if these made the groups, exchanged where another label
    is nearer. For other methods, such as bins of norms, minus the groups' indicators, averaged
    over neighbours three times: the border runs smoothly, within an edge of the labels' own.
    """
    labels, centers = groups.labels, groups.centers
    tables = [distances(rows, centers, metric) for metric in ("l1", "l2")]
    scores = max(tables, key=lambda table: (table.argmin(axis=1) == labels).mean())
    first = scores.argmin(axis=1)
    if (first == labels).mean() < AGREE:
        return -averaged((labels[:, None] == np.arange(len(centers))) * 1.0, surface)
    every = np.arange(len(rows))
    scores[every, labels], scores[every, first] = scores[every, first], scores[every, labels]
    return scores


def averaged(values: Floats, surface: iv.Surface) -> Floats:
    """Values (n, k) after a few rounds of the mean of a node and the mean of its neighbours."""
    i, j = edges_of(linear_triangles(surface.triangles))[0].T
    count = np.bincount(np.concatenate([i, j]))[:, None]
    for _ in range(ROUNDS):
        total = np.zeros_like(values)
        np.add.at(total, i, values[j])
        np.add.at(total, j, values[i])
        values = (values + total / count) / 2
    return values


def draw_circle(axes: Axes, camera: Camera, tip: Floats, angle: float) -> None:
    """The part of a circle on the sphere around a tip that faces the viewer."""
    across = np.cross(tip, [1.0, 0.3, 0.2])
    across /= np.linalg.norm(across)
    turn = np.linspace(0, 2 * np.pi, 181)[:, None]
    around = np.cos(turn) * across + np.sin(turn) * np.cross(tip, across)
    circle = camera.project(np.cos(angle) * tip + np.sin(angle) * around)
    circle[circle[:, 2] < 0] = np.nan
    axes.plot(circle[:, 0], circle[:, 1], color="black", lw=0.9)
