"""A mesh brought to given edge lengths: edges split and collapsed, flipped, vertices moved."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..geometry import Floats, triangle_quality
from ..scalar_field import ScalarField
from ._draft import Draft, moved, settled
from ._edits import Edges, collapse, edges_with_sides, flip, split
from ._sizing_field import SizingField

Move = Callable[[Draft, Floats], Floats]
"""Draft, wanted edge lengths (n,) at its vertices -> steps (n, 3) that would even them out."""

Progress = Callable[[str, float], None]

_LONG, _SHORT = 1.4, 0.75  # of the wanted length: split, collapse
_ROUGH = 8  # rounds by length alone; then by the number of vertices
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
        few = sizes.vertices - len(draft.points)
        draft, changed = _edited(draft, sizes, field, isovalue, few if count >= _ROUGH else None)
        triangles, flips = flip(draft.points, draft.triangles, draft.normals)
        draft = replace(draft, triangles=triangles)
        lengths = sizes.at(draft.points)
        before = draft.points
        draft = moved(draft, move(draft, lengths), field, isovalue)
        way = np.linalg.norm(draft.points - before, axis=1) / lengths
        qualities.append(float(triangle_quality(draft.points, draft.triangles).mean()))
        resting = len(qualities) > _WINDOW and qualities[-1] - qualities[-_WINDOW - 1] < _GAIN
        if count > _ROUGH and not changed and (resting or (not flips and way.max() < still)):
            break
    return draft


def _edited(
    draft: Draft, sizes: SizingField, field: ScalarField, isovalue: float, few: int | None
) -> tuple[Draft, int]:
    """Too long edges split and too short ones collapsed; or ``few`` vertices more, or less."""
    before, changes = len(draft.points), 0
    edges, ratio = _ratios(draft, sizes)
    if few is None or few > 0:
        excess = ratio - (_LONG if few is None else 0.0)
        draft = split_edges(draft, excess, edges, before if few is None else few)
        changes += len(draft.points) - before
        edges, ratio = _ratios(draft, sizes)
    if few is None or few < 0:
        lack = (_SHORT if few is None else ratio.max() + 1) - ratio
        most = _LONG * sizes.at(draft.points)
        points, triangles, old = collapse(
            draft.points,
            draft.triangles,
            lack,
            edges,
            draft.rank,
            most,
            before if few is None else -few,
        )
        changes += len(draft.points) - len(points)
        draft = Draft(points, triangles, draft.held[old], draft.normals[old])
    return (settled(draft, field, isovalue) if changes else draft), changes


def _ratios(draft: Draft, sizes: SizingField) -> tuple[Edges, Floats]:
    """The edges, and their lengths over the wanted ones."""
    edges = edges_with_sides(draft.triangles)
    lengths = sizes.at(draft.points)
    i, j = edges.ends.T
    distance = np.linalg.norm(draft.points[i] - draft.points[j], axis=1)
    return edges, 2 * distance / (lengths[i] + lengths[j])


def split_edges(draft: Draft, excess: Floats, edges: Edges, most: int) -> Draft:
    points, triangles, halved = split(draft.points, draft.triangles, excess, edges, most)
    i, j = edges.ends[halved].T
    held = draft.held[i] & draft.held[j] & edges.on_rim[halved, None]
    middle = draft.normals[i] + draft.normals[j]
    return Draft(
        points,
        triangles,
        np.concatenate([draft.held, held]),
        np.concatenate([draft.normals, middle / np.linalg.norm(middle, axis=1, keepdims=True)]),
    )
