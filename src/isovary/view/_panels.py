"""The panels of the overview."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ..color import group_colors
from ..comparison import Comparison
from ..geometry import Floats
from . import _paint as paint
from ._camera import Camera, in_sight
from ._curves import curves_at, draw_signatures
from ._curves import draw_change as draw_curve
from ._marks import (
    INK,
    SOFT,
    Box,
    apart,
    caption,
    color_bar,
    legend,
    number,
    ring,
    scale_bar,
    tripod,
)
from ._rim_band import RimBand
from ._scene import Scene, Strokes, mesh_lines
from ._tessellate import Pieces
from ._words import percent, unknown


@dataclass(frozen=True, eq=False)
class View:
    """What all panels share: the surface in pieces, what is known there, and the camera.

    ``peak`` is the node that changed most, None without change; ``problem`` says
    why OpenGL cannot be used, None if it can; ``split`` parts each edge into the pieces;
    ``band`` is how far the rims reach, None without rims.
    """

    result: Comparison
    pieces: Pieces
    samples: paint.Samples
    camera: Camera
    peak: int | None
    problem: str | None
    split: int
    band: RimBand | None

    @property
    def significant_share(self) -> float:
        """Part of the area where the change is significant."""
        areas = self.pieces.areas
        return float(areas @ ((self.samples.margin > 0) & (self.samples.known > 0)) / areas.sum())

    @property
    def half_share(self) -> float:
        """Smallest part of the area that holds half of the significant change."""
        shown = (self.samples.margin > 0) & (self.samples.known > 0)
        norm = np.where(shown, np.nan_to_num(self.samples.norm), 0.0)
        order = np.argsort(-norm)
        held = np.cumsum((norm * self.pieces.areas)[order])
        count = int(np.searchsorted(held, 0.5 * held[-1])) + 1
        return float(self.pieces.areas[order[:count]].sum() / self.pieces.areas.sum())

    @property
    def mark(self) -> Floats | None:
        """The marked point in the picture (2,)."""
        if self.peak is None:
            return None
        return self.camera.project(self.result.base.points[self.peak])[:2]


def change_panel(figure: Figure, view: View) -> None:
    """Change norm on the base."""
    axes = surface_axes(figure, (0.02, 0.28, 0.37, 0.555), view)
    caption(figure, 0.02, 0.872, "a", "Where the intrinsic shape changed")
    limit = paint.norm_limit(view.result)
    draw_change(axes, view, limit)
    scale_bar(axes)
    tripod(figure, (0.348, 0.175, 0.045, 0.08), view.camera)
    entries = change_legend(view)
    if limit > 0:
        mark_peak(axes, view)
        words = f"mean change of the {view.result.methods.kind.title}, % of its mean"
        color_bar(figure, (0.03, 0.224, 0.30, 0.016), paint.NORM_MAP, (0, 100 * limit), words)
        legend(figure, entries, (0.205, 0.148))
    else:
        words = "no change" if view.peak is None else "no significant\nchange"
        axes.text(0.5, 0.5, words, transform=axes.transAxes, size=20, color=INK, ha="center")
        legend(figure, entries, (0.205, 0.225))


def displacement_panel(figure: Figure, view: View) -> None:
    """Displacement on the base, and the perturbed mesh over it."""
    axes = surface_axes(figure, (0.41, 0.575, 0.255, 0.255), view)
    caption(figure, 0.41, 0.872, "b", "What moved: perturbed mesh over the base")
    limit = paint.move_limit(view.result)
    size = float(np.ptp(view.result.base.points, axis=0).max())
    lines = mesh_lines(view.result.perturbed, view.camera, limit + 0.005 * size)
    moved = replace(view, samples=view.samples.moved)
    draw_surface(axes, moved, paint.paint_displacement(view.samples, limit), lines)
    if limit > 0:
        words = "normal displacement, + towards lower values (length)"
        color_bar(figure, (0.44, 0.552, 0.195, 0.012), paint.MOVE_MAP, (-limit, limit), words)
    else:
        figure.text(0.5375, 0.55, "no displacement", size=8.5, color=SOFT, ha="center")


def groups_panel(figure: Figure, view: View) -> None:
    """Groups on the base, each numbered."""
    axes = surface_axes(figure, (0.41, 0.205, 0.255, 0.24), view)
    soft = view.samples.memberships.shape[1] > 0
    words = "Groups: colours mixed by membership" if soft else "Groups of nodes that changed alike"
    caption(figure, 0.41, 0.475, "c", words)
    draw_surface(axes, view, paint.paint_groups(view.samples))
    samples, count = view.samples, len(view.result.clusters.centers)
    colors = group_colors(count)
    entries: list[Artist] = [
        Patch(
            color=tuple(colors[group.number]),
            label=f"{group.number}: {percent(group.area_share)}, {percent(group.mean_change)}",
        )
        for group in sorted(view.result.group_table, key=lambda group: group.number)
    ]
    if (samples.groups[samples.known > 0] < 0).any():
        entries.append(Patch(color=paint.NEUTRAL, label="no group"))
    title = "group: part of the area, mean change" if count else None
    legend(figure, entries + _no_partner(view), (0.5375, 0.195), title)
    mark_peak(axes, view)
    _number_groups(axes, view, count)


def curves_panel(figure: Figure, view: View) -> None:
    """Signatures and change over the time."""
    curves = curves_at(view.result, view.peak)
    where = "at the marked point" if view.peak is not None else "median over the nodes"
    kind = view.result.methods.kind
    across = "At which scale" if kind.per_time else f"By {kind.axis.split(' (')[0]}"
    caption(figure, 0.69, 0.872, "d", f"{across}: {where}")
    upper = figure.add_axes((0.745, 0.505, 0.235, 0.285))
    lower = figure.add_axes((0.745, 0.205, 0.235, 0.265), sharex=upper)
    draw_signatures(upper, view.result, curves)
    draw_curve(lower, view.result, curves)
    for axes in (upper, lower, *upper.child_axes):
        axes.tick_params(labelsize=8)
        axes.xaxis.label.set_fontsize(8.5)
        axes.yaxis.label.set_fontsize(8.5)
    figure.align_ylabels([upper, lower])


def surface_axes(figure: Figure, box: Box, view: View) -> Axes:
    """Axes in which a length is a length of the surface, seen by the view's camera."""
    axes = figure.add_axes(box)
    axes.set_axis_off()
    width, height = figure.get_size_inches()
    left, right, bottom, top = view.camera.window(box[2] * width / (box[3] * height))
    axes.set_xlim(left, right)
    axes.set_ylim(bottom, top)
    return axes


def draw_change(axes: Axes, view: View, limit: float) -> None:
    """Change norm up to a limit, and the band of the rims."""
    colors = paint.paint_norm(view.samples, limit)
    band = None if view.band is None else view.band.strokes(view.camera)
    draw_surface(axes, view, colors, band=band)


def change_legend(view: View) -> list[Artist]:
    """What else than a change's size is seen where the change is drawn."""
    samples, entries = view.samples, _no_partner(view)
    if (samples.margin[samples.known > 0] <= 0).any():
        entries.insert(0, Patch(color=paint.NEUTRAL, label=_unchanged(view)))
    return [*entries, *rim_legend(view)]


def rim_legend(view: View) -> list[Artist]:
    """What the band of the rims is, if there is one."""
    if view.band is None:
        return []
    style = {"ls": (0, (2.4, 1.6)), "lw": 1.2} if len(view.band.lines) else {"ls": "none"}
    return [Line2D([], [], color=INK, label=view.band.words, **style)]


def draw_surface(
    axes: Axes,
    view: View,
    colors: Floats,
    lines: Floats | None = None,
    *,
    band: Strokes | None = None,
    second: Scene | None = None,
) -> None:
    """The pieces in their colours, hatched where unknown, and perhaps what is seen with them."""
    if view.problem is None:
        from ._render_vtk import draw
    else:
        from ._render_matplotlib import draw
    shown = paint.hatched(colors, view.samples, view.pieces.middles)
    draw(axes, Scene(view.pieces, shown, lines, band, second), view.camera)


def _no_partner(view: View) -> list[Artist]:
    if (view.samples.known > 0).all():
        return []
    inner, stripes = paint.NO_PARTNER, paint.NO_PARTNER_2
    words = unknown(view.result)
    return [Patch(facecolor=inner, edgecolor=stripes, hatch="////", label=words)]


def _unchanged(view: View) -> str:
    return "no change" if view.peak is None else "no significant change"


def mark_peak(axes: Axes, view: View) -> None:
    """A ring around the point that changed most."""
    if view.mark is not None:
        ring(axes, view.mark)


def _number_groups(axes: Axes, view: View, count: int) -> None:
    """Each group's number on it, at the visible place farthest from other groups and outlines."""
    pieces, direction = view.pieces, view.camera.axes[2]
    slant = pieces.facing @ direction
    front, outline = np.flatnonzero(slant > 0.4), np.flatnonzero(np.abs(slant) <= 0.4)
    taken = [] if view.mark is None else [view.mark]
    free = 0.08 * float(np.diff(axes.get_xlim())[0])
    groups = view.samples.groups[front]
    for group in range(count):
        inside = front[groups == group]
        if len(inside) == 0:
            continue
        inside = inside[:: max(1, len(inside) // 400)]
        places = pieces.middles[inside]
        flat = view.camera.project(places)[:, :2]
        good = in_sight(places, pieces.middles, direction) & apart(flat, taken, free)
        if good.any():
            others = np.concatenate([front[groups != group], outline])
            around = view.camera.project(pieces.middles[others])[:, :2]
            place = flat[np.where(good, _depth(flat, around), -np.inf).argmax()]
            number(axes, place, str(group))
            taken.append(place)


def _depth(places: Floats, others: Floats) -> Floats:
    """How far places (k, 2) are from the others; without others, how near to their middle."""
    from scipy.spatial import cKDTree

    if len(others):
        away: Floats = cKDTree(others).query(places)[0]
        return away
    middle: Floats = -np.linalg.norm(places - places.mean(axis=0), axis=1)
    return middle
