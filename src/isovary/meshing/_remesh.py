"""A mesh brought to given edge lengths: edges split and collapsed, flipped, vertices moved."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..geometry import Floats, triangle_quality
from ..scalar_field import ScalarField
from ._draft import Draft, held_between, moved, settled
from ._edits import Edges, collapse, edges_with_sides, flip, split
from ._sizing_field import SizingField

Move = Callable[[Draft, Floats], Floats]
"""Draft, wanted edge lengths (n,) at its vertices -> steps (n, 3) that would even them out."""

Progress = Callable[[str, float], None]

_LONG, _SHORT = 1.4, 0.75  # of the wanted length: split, collapse
_ROUGH = 8  # rounds by length alone; then by the number of vertices
_SWAPS = 20  # until this round vertices also go from crowded to sparse regions
_SHARE, _UNEVEN = 0.02, 0.03  # of the vertices at a time; deviation of a region's lengths
_AVERAGES = 6  # over neighbours, that make a region
_WINDOW, _GAIN = 10, 5e-4  # rounds in which the mean quality must rise by so much


def remesh(
    draft: Draft,
    sizes: SizingField,
    field: ScalarField,
    isovalue: float,
    move: Move,
    rounds: int,
    still: float,
    progress: Progress | None = None,
) -> Draft:
    """Rounds of splits, collapses, flips and moves until little moves or the quality rests.

    Parameters
    ----------
    draft : Draft
        Of the right topology, with edges of any length.
    sizes : SizingField
        Edge lengths, and the number of vertices.
    field : ScalarField
    isovalue : float
    move : callable
        The relaxation.
    rounds : int
        At most.
    still : float
        Stops when no vertex moves by more than this part of its edge length.
    progress : callable, optional
        Called with a name and the part done.

    Returns
    -------
    Draft
    """
    qualities: list[float] = []
    for count in range(rounds):
        if progress:
            progress("remeshing", count / rounds)
        if count < _ROUGH:
            draft, changed = _fitted(draft, sizes, field, isovalue)
        else:
            draft, changed = _numbered(draft, sizes, field, isovalue, swap=count < _SWAPS)
        triangles, flips = flip(draft.points, draft.triangles, draft.normals)
        draft = replace(draft, triangles=triangles)
        lengths = sizes.at(draft.points)
        before = draft.points
        draft = moved(draft, move(draft, lengths), field, isovalue)
        way = np.linalg.norm(draft.points - before, axis=1) / lengths
        qualities.append(float(triangle_quality(draft.points, draft.triangles).mean()))
        resting = len(qualities) > _WINDOW and qualities[-1] - qualities[-_WINDOW - 1] < _GAIN
        if count > _SWAPS and not changed and (resting or (not flips and way.max() < still)):
            break
    return draft


def _fitted(
    draft: Draft, sizes: SizingField, field: ScalarField, isovalue: float
) -> tuple[Draft, int]:
    """Too long edges split and too short ones collapsed; and how many."""
    before = len(draft.points)
    edges, ratio, _ = _ratios(draft, sizes)
    draft = split_edges(draft, ratio - _LONG, edges, before)
    more = len(draft.points)
    edges, ratio, lengths = _ratios(draft, sizes)
    draft = _collapsed(draft, _SHORT - ratio, edges, lengths, more)
    changed = 2 * more - before - len(draft.points)
    return (settled(draft, field, isovalue) if changed else draft), changed


def _numbered(
    draft: Draft, sizes: SizingField, field: ScalarField, isovalue: float, swap: bool
) -> tuple[Draft, int]:
    """The wanted number of vertices, nearly; ``swap`` moves some to where there are too few."""
    before = len(draft.points)
    edges, sparse, regions, lengths = _sparseness(draft, sizes)
    some = 0
    if swap:
        some = min((regions > 1 + _UNEVEN).sum(), (regions < 1 - _UNEVEN).sum(), _SHARE * before)
    few, some = sizes.vertices - before, int(some)
    if few > 0 or some:
        draft = split_edges(draft, sparse, edges, max(few, 0) + some)
        edges, sparse, _, lengths = _sparseness(draft, sizes)
    more = len(draft.points)
    if few < 0 or some:
        draft = _collapsed(draft, 1 / sparse, edges, lengths, max(-few, 0) + some)
    changed = 2 * more - before - len(draft.points)
    return (settled(draft, field, isovalue) if changed else draft), changed


def _collapsed(draft: Draft, lack: Floats, edges: Edges, lengths: Floats, most: int) -> Draft:
    """At most ``most`` edges of positive ``lack`` (e,) collapsed; none becomes too long."""
    longest = _LONG * lengths
    points, triangles, old = collapse(
        draft.points, draft.triangles, draft.normals, lack, edges, draft.rank, longest, most
    )
    return Draft(points, triangles, draft.held[old], draft.normals[old])


def _sparseness(draft: Draft, sizes: SizingField) -> tuple[Edges, Floats, Floats, Floats]:
    """The edges, how much each begs to be split (e,), the mean ratio around it, wanted lengths.

    The edge's length over the wanted one, times the square of the mean of that ratio in the
    region; both divided by the mean over all.
    """
    edges, ratio, lengths = _ratios(draft, sizes)
    ratio = ratio / ratio.mean()
    i, j = edges.ends.T
    count = len(draft.points)
    degree = np.bincount(edges.ends.ravel(), minlength=count)
    mean = np.bincount(edges.ends.ravel(), np.repeat(ratio, 2), count) / degree
    for _ in range(_AVERAGES):
        around = np.bincount(i, mean[j], count) + np.bincount(j, mean[i], count)
        mean = (mean + around / degree) / 2
    regions = (mean[i] + mean[j]) / 2
    return edges, ratio * regions**2, regions, lengths


def _ratios(draft: Draft, sizes: SizingField) -> tuple[Edges, Floats, Floats]:
    """The edges, their lengths over the wanted ones (e,), and the wanted ones (n,)."""
    edges = edges_with_sides(draft.triangles)
    lengths = sizes.at(draft.points)
    i, j = edges.ends.T
    distance = np.linalg.norm(draft.points[i] - draft.points[j], axis=1)
    return edges, 2 * distance / (lengths[i] + lengths[j]), lengths


def split_edges(draft: Draft, excess: Floats, edges: Edges, most: int) -> Draft:
    """At most ``most`` edges of positive ``excess`` (e,) halved; rims stay on their faces."""
    points, triangles, halved = split(draft.points, draft.triangles, excess, edges, most)
    i, j = edges.ends[halved].T
    held = held_between(draft.points, draft.held, i, j) & edges.on_rim[halved, None]
    middle = draft.normals[i] + draft.normals[j]
    return Draft(
        points,
        triangles,
        np.concatenate([draft.held, held]),
        np.concatenate([draft.normals, middle / np.linalg.norm(middle, axis=1, keepdims=True)]),
    )
