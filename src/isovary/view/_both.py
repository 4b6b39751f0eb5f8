"""Both surfaces: side by side from one side and at one scale, and one over the other."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from ..comparison import Comparison
from ..geometry import Floats, Ints, rim_nodes
from . import _paint as paint
from ._camera import Camera, in_sight
from ._marks import (
    INK,
    SOFT,
    Box,
    caption,
    color_bar,
    diamond,
    fit_line,
    legend,
    paragraphs,
    scale_bar,
    tripod,
)
from ._overview import prepare
from ._panels import View, change_legend, draw_change, draw_surface, mark_peak, surface_axes
from ._rim_band import at_corners
from ._scene import Scene
from ._tessellate import Pieces, outside, tessellate
from ._words import UNITS, percent, title

_SIZE, _DPI = (12.8, 6.4), 160
_LEFT, _BELOW, _WIDTH, _HEIGHT = (0.02, 0.345, 0.67), 0.245, 0.31, 0.585
_SEEN = 0.005  # of the size: a smaller displacement is two points of the picture
_APART = 0.001  # of the size: what is nearer counts as in one place
_BASE, _BEFORE, _BEHIND = "#c9d4dc", "#d55e00", "#0072b2"
_OPACITY = 0.5
_BACK = 10.0  # displacements: far enough that only its outline is seen around the base
_NEAREST = 3
_SAME = 1e-9  # of the size: nearer than this is in one place


def both(result: Comparison) -> Figure:
    """One figure of the base and the perturbed surface: side by side, and in one place.

    Parameters
    ----------
    result : Comparison

    Returns
    -------
    matplotlib.figure.Figure
        12.8 x 6.4 inches at 160 dots per inch; belongs to no window.

    Notes
    -----
    All three panels have the camera of :func:`overview` and one scale: a length in one is the
    same length in the others. The first two show the change; a node of a carried mesh has its
    base node's colour, a place of a mesh of its own that of the nearest partners, by inverse
    distance. In the third the base is orange, as seen through a film, where the perturbed
    surface lies in front of it, along the normal and by more than 1/1000 of the size as seen;
    where that lies behind, blue; and its outline stands out where it is larger.
    The heading compares the largest displacement along the normal with the size, the base's
    largest extent along an axis; below 1/200 of it, it says that nothing can be seen.

    Cost: 3 s.
    """
    base = prepare(result)
    pieces = tessellate(result.perturbed, base.split)
    camera = _around(base.camera, base.pieces, pieces)
    base = replace(base, camera=camera)
    perturbed = replace(base, pieces=pieces, samples=samples_there(base))
    figure = Figure(figsize=_SIZE, dpi=_DPI, facecolor="white")
    _heading(figure, base)
    _change_panels(figure, base, perturbed)
    _overlay_panel(figure, base, pieces)
    _footer(figure, base)
    return figure


def _footer(figure: Figure, view: View) -> None:
    words = [view.problem] if view.problem else []
    if not is_carried(view.result):
        words.append("b: a mesh of its own; each place has the colour of the nearest partners.")
    paragraphs(figure, (0.02, 0.045), [" ".join([*words, UNITS])], width=0.96, color=SOFT)


def size_of(result: Comparison) -> float:
    """Largest extent of the base along an axis; length."""
    return float(np.ptp(result.base.points, axis=0).max())


def is_carried(result: Comparison) -> bool:
    """Whether every node of the perturbed mesh is the partner of a node of the base."""
    return bool((partner_nodes(result, 1)[1] < _SAME * size_of(result)).all())


def partner_nodes(result: Comparison, count: int) -> tuple[Ints, Floats]:
    """The base's nodes whose partners are nearest to each perturbed node, and how far these are.

    Two arrays (m, count), the nearest first; only nodes whose change is known count.
    """
    from scipy.spatial import cKDTree

    use = np.flatnonzero(paint.node_samples(result).known > 0)
    nearest = np.arange(1, 1 + min(count, len(use)))
    away, near = cKDTree(result.partners[use]).query(result.perturbed.points, k=nearest)
    return use[near], away


def reach(result: Comparison) -> float:
    """Two node distances: a node without a partner within that is unknown."""
    return float(2 * (result.base.area / len(result.base.points)) ** 0.5)


def heading(result: Comparison) -> str:
    """The largest displacement in words, and whether it can be seen."""
    limit = paint.move_limit(result)
    share = limit / size_of(result)
    if limit == 0:
        return "Nothing moved: the two isosurfaces are identical"
    if share < _SEEN:
        return f"Too small to see: largest displacement {percent(share)} of the size"
    return f"Largest displacement {limit:.2g} ({percent(share)} of the size)"


def _heading(figure: Figure, view: View) -> None:
    result = view.result
    fit_line(figure, 0.02, 0.975, heading(result), 0.96, size=15, weight="bold", color=INK)
    parts = [
        f"Isosurface {title(result)}, base against perturbed",
        "same camera, same scale",
        f"size {size_of(result):.3g} (largest extent)",
    ]
    if result.choices["alignment"] == "rigid" and paint.move_limit(result) > 0:
        parts.append("rigid motion taken out")
    if view.peak is not None:
        parts.append("○ changed most")
    if paint.move_limit(result) > 0:
        parts.append("◇ moved most")
    fit_line(figure, 0.02, 0.92, "   ·   ".join(parts), 0.96, size=10, color=SOFT)


def _change_panels(figure: Figure, base: View, perturbed: View) -> None:
    """The change on either surface, with the colour bar and the only scale bar."""
    limit = paint.norm_limit(base.result)
    names = "Base: where it changed", "Perturbed: the same change"
    for place, (view, name) in enumerate(zip((base, perturbed), names, strict=True)):
        axes = _panel(figure, place, "ab"[place], name, view)
        draw_change(axes, replace(view, band=base.band if place == 0 else None), limit)
        if place == 0:
            scale_bar(axes)
            if limit > 0:
                mark_peak(axes, view)
    middle, top = (_LEFT[0] + _LEFT[1] + _WIDTH) / 2, 0.19
    if limit > 0:
        kind = base.result.methods.kind
        words = f"mean change of the {kind.title}, % of its mean"
        box = (middle - 0.15, 0.17, 0.30, 0.018)
        color_bar(figure, box, paint.NORM_MAP, (0, 100 * limit), words)
        top = 0.085
    legend(figure, change_legend(base), (middle, top))
    tripod(figure, (_LEFT[1] + _WIDTH - 0.05, 0.12, 0.05, 0.1), base.camera)


def _panel(figure: Figure, place: int, letter: str, name: str, view: View) -> Axes:
    caption(figure, _LEFT[place], 0.872, letter, name)
    box: Box = (_LEFT[place], _BELOW, _WIDTH, _HEIGHT)
    return surface_axes(figure, box, view)


def _overlay_panel(figure: Figure, view: View, pieces: Pieces) -> None:
    """The base, coloured by where the perturbed surface lies, and that behind it."""
    axes = _panel(figure, 2, "c", "In one place: the perturbed over the base", view)
    limit, away = paint.move_limit(view.result), _APART * size_of(view.result)
    outline = _outline(pieces, view.camera, _BACK * limit + away)
    moved = replace(view, samples=view.samples.moved)
    draw_surface(axes, moved, overlay_colors(view, away), second=outline)
    middle = _LEFT[2] + _WIDTH / 2
    if limit == 0:
        legend(figure, [Patch(color=_BASE, label="both surfaces coincide")], (middle, 0.19))
        return
    _mark_moved(axes, view)
    entries = [
        Patch(color=_BASE, label="base"),
        Patch(color=tuple(_mixed(_BASE, _BEFORE)), label="perturbed in front"),
        Patch(color=tuple(_mixed(_BASE, _BEHIND)), label="perturbed behind"),
    ]
    words = f"coloured where more than {percent(_APART)} of the size apart"
    legend(figure, entries, (middle, 0.19))
    figure.text(middle, 0.125, words, size=8, color=SOFT, ha="center")


def _outline(pieces: Pieces, camera: Camera, distance: float) -> Scene:
    """The pieces so far behind, without shade: seen where they reach beyond what is before."""
    toward = camera.axes[2]
    points = pieces.points - distance * toward
    normals, facing = np.tile(toward, (len(points), 1)), np.tile(toward, (len(pieces.facing), 1))
    colors = np.tile(_mixed("#ffffff", _BEFORE), (len(facing), 1))
    return Scene(replace(pieces, points=points, normals=normals, facing=facing), colors)


def overlay_colors(view: View, away: float) -> Floats:
    """The base's colour, mixed with another where the perturbed is before or behind it (q, 3).

    A piece that a border crosses has its share of both.
    """
    slant = (view.pieces.facing @ view.camera.axes[2])[:, None]
    distance = np.nan_to_num(view.result.correspondence.distance)
    ahead = outside(view.result.base) * at_corners(view.result.base, view.split, distance)
    gap, least = np.sign(slant) * ahead[view.pieces.triangles], away * np.abs(slant)
    before, behind = _share(gap - least), _share(-gap - least)
    parts = np.column_stack([1 - before - behind, before, behind])
    colors: Floats = parts @ [to_rgb(_BASE), _mixed(_BASE, _BEFORE), _mixed(_BASE, _BEHIND)]
    colors[view.samples.found == 0] = paint.NO_PARTNER
    return colors


def _share(values: Floats) -> Floats:
    """How much (q,) of the values (q, 3) at a piece's corners is positive."""
    size = np.abs(values).sum(axis=1)
    share: Floats = np.maximum(values, 0).sum(axis=1) / np.where(size > 0, size, 1.0)
    return share


def _mixed(below: str, above: str) -> Floats:
    """A colour seen through a film."""
    mixed: Floats = np.array([1 - _OPACITY, _OPACITY]) @ [to_rgb(below), to_rgb(above)]
    return mixed


def _mark_moved(axes: Axes, view: View) -> None:
    """A diamond at the node that moved most along the normal, if it can be seen."""
    result, camera = view.result, view.camera
    if paint.move_limit(result) == 0:
        return
    node = int(np.nanargmax(np.abs(result.correspondence.distance)))
    point, normal = result.base.points[node], outside(result.base) * result.base.normals[node]
    toward = camera.axes[2]
    hidden = len(rim_nodes(result.base.triangles)) == 0 and normal @ toward < 0
    if not hidden and in_sight(point[None], view.pieces.middles, toward)[0]:
        diamond(axes, camera.project(point))


def _around(camera: Camera, *surfaces: Pieces) -> Camera:
    """The same direction, with room for all surfaces."""
    inside = camera.project(np.concatenate([pieces.points for pieces in surfaces]))
    return Camera(camera.axes, inside.min(axis=0), inside.max(axis=0))


def samples_there(view: View) -> paint.Samples:
    """What is known at the pieces of the perturbed surface.

    A carried mesh has the base's own. A node of another has the mean over the three nearest
    partners, weighted by inverse distance; without one within two node distances it is unknown.
    """
    result, nodes = view.result, paint.node_samples(view.result)
    near, away = partner_nodes(result, 1 if is_carried(result) else _NEAREST)
    weights = 1 / np.maximum(away, 1e-12 * size_of(result))
    weights /= weights.sum(axis=1, keepdims=True)
    there = {
        f.name: np.einsum("nk,nk...->n...", weights, getattr(nodes, f.name)[near])
        for f in fields(nodes)
    }
    there["known"] = there["found"] = (away[:, 0] < reach(result)).astype(float)
    return paint.spread(paint.Samples(**there), result.perturbed, view.split)
