"""Local changes of a triangle mesh, many at a time: edges flipped, split and collapsed.

Every pass looks at all edges, keeps those whose change helps, and carries out as many of these
as do not touch one another. A mesh that is a manifold stays one, with the same topology: edges
that are there already are not made again, and only edges whose two ends share no neighbours but
the opposite corners are collapsed (the link condition). Rims change along themselves only.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..geometry import Bools, Floats, Ints

if TYPE_CHECKING:
    from scipy.sparse import csr_array

_FACING = 0.2  # smallest cosine between a new triangle and the ones that it replaces
_FIRST = 1e9  # gain of a flip that turns a triangle outward
_SWEEPS, _TRIES, _WAITING = 3, 6, 20


@dataclass(frozen=True, eq=False)
class Edges:
    """The edges of a triangle mesh.

    ``ends`` (e, 2) the smaller index first; ``triangles`` (e, 2) on both sides, -1 beyond a rim;
    ``opposite`` (e, 2) the third corner of each, -1 likewise. In the first triangle the edge
    runs from ``ends[:, 0]`` to ``ends[:, 1]`` if ``forward``.
    """

    ends: Ints
    triangles: Ints
    opposite: Ints
    forward: Bools

    @property
    def on_rim(self) -> Bools:
        """Mask (e,) of the edges with one triangle."""
        return self.triangles[:, 1] < 0


def edges_with_sides(triangles: Ints) -> Edges:
    """The edges, in the order of their ends, and what lies on their two sides."""
    count = len(triangles)
    start, stop = triangles.T.ravel(), triangles[:, [1, 2, 0]].T.ravel()
    opposite = triangles[:, [2, 0, 1]].T.ravel()
    low, high = np.minimum(start, stop), np.maximum(start, stop)
    order = np.argsort(low * (int(triangles.max()) + 1) + high, kind="stable")
    low, high = low[order], high[order]
    first = np.flatnonzero(np.append(True, (low[1:] != low[:-1]) | (high[1:] != high[:-1])))
    counts = np.diff(np.append(first, len(order)))
    second = np.where(counts > 1, first + 1, -1)
    sides = np.stack([order[first], np.where(second < 0, -1, order[second])], axis=1)
    return Edges(
        np.stack([low[first], high[first]], axis=1),
        np.where(sides < 0, -1, sides % count),
        np.where(sides < 0, -1, opposite[sides]),
        start[sides[:, 0]] == low[first],
    )


def flip(points: Floats, triangles: Ints, normals: Floats) -> tuple[Ints, int]:
    """Edges turned where the angles opposite sum to more than pi; the triangles and the number.

    Or where one of the two triangles faces inward, and the new ones do so less.
    """
    edges = edges_with_sides(triangles)
    inner = np.flatnonzero(~edges.on_rim)
    ends, forward = edges.ends[inner], edges.forward[inner, None]
    a, b = np.where(forward, ends, ends[:, ::-1]).T
    c, d = edges.opposite[inner].T
    gain = -_cotangent(points, c, a, b) - _cotangent(points, d, a, b)
    first, second = np.stack([a, d, c], axis=1), np.stack([d, b, c], axis=1)
    up = normals[a] + normals[b]
    before = _worst_cosine(points, (np.stack([a, b, c], axis=1), np.stack([b, a, d], axis=1)), up)
    after = _worst_cosine(points, (first, second), up)
    turned = before <= 0
    good = ((gain > 1e-9) | turned) & ~_there(edges.ends, c, d)
    good &= after > np.where(turned, before, _FACING)
    gain = np.where(turned, _FIRST, gain)
    chosen = np.flatnonzero(good)
    chosen = chosen[_best_of_both(gain[chosen], edges.triangles[inner[chosen]], len(triangles))]
    _, once = np.unique(_keys(c[chosen], d[chosen]), return_index=True)
    chosen = chosen[once]
    flipped = triangles.copy()
    flipped[edges.triangles[inner[chosen], 0]] = first[chosen]
    flipped[edges.triangles[inner[chosen], 1]] = second[chosen]
    return flipped, len(chosen)


def split(
    points: Floats, triangles: Ints, excess: Floats, edges: Edges, most: int
) -> tuple[Floats, Ints, Ints]:
    """At most ``most`` edges halved where ``excess`` (e,), the greater the sooner, is positive.

    Returns the points with the middles of the edges behind the old ones, the triangles, and the
    number of the edge (k,) that each new point halves.
    """
    chosen = np.flatnonzero(excess > 0)
    chosen = chosen[_best_of_both(excess[chosen], edges.triangles[chosen], len(triangles))]
    chosen = chosen[np.argsort(-excess[chosen], kind="stable")[:most]]
    middle = len(points) + np.arange(len(chosen))
    replaced, added = triangles.copy(), []
    for side in (0, 1):
        there = edges.triangles[chosen, side] >= 0
        triangle, m = edges.triangles[chosen[there], side], middle[there]
        c = edges.opposite[chosen[there], side]
        a, b = np.where(
            (edges.forward[chosen[there]] == (side == 0))[:, None],
            edges.ends[chosen[there]],
            edges.ends[chosen[there], ::-1],
        ).T
        replaced[triangle] = np.stack([a, m, c], axis=1)
        added.append(np.stack([m, b, c], axis=1))
    middles = points[edges.ends[chosen]].mean(axis=1)
    return np.concatenate([points, middles]), np.concatenate([replaced, *added]), chosen


def collapse(
    points: Floats,
    triangles: Ints,
    normals: Floats,
    lack: Floats,
    edges: Edges,
    rank: Ints,
    longest: Floats,
    most: int,
) -> tuple[Floats, Ints, Ints]:
    """At most ``most`` edges shrunk to a point where ``lack`` (e,) is positive, greatest first.

    Of two ends with different ``rank`` (n,) (0 inside, 1 on a rim, 2 fixed) the higher stays
    where it is; equal ones meet in the middle, fixed ones never. No edge longer than ``longest``
    (n,) at its ends is made, and no triangle is turned over. Returns points, triangles, and for
    each new point the old one (k,) that it was.
    """
    lack = np.where(_collapsible(triangles, edges, rank), lack, -np.inf)
    banned = np.zeros(len(lack), dtype=bool)
    for _ in range(_TRIES):  # those that fail stand back for their neighbours
        chosen = _apart(np.where(banned, -np.inf, lack), edges, len(points), most)
        low, high = edges.ends[chosen].T
        keep = np.where(rank[low] >= rank[high], low, high)
        drop = low + high - keep
        equal = (rank[low] == rank[high])[:, None]
        place = np.where(equal, (points[low] + points[high]) / 2, points[keep])
        good = _collapse_is_sound(points, triangles, normals, keep, drop, place, longest)
        banned[chosen[~good]] = True
        if good.all():
            break
    keep, drop, place = keep[good], drop[good], place[good]
    merged, moved = np.arange(len(points)), points.copy()
    merged[drop], moved[keep] = keep, place
    return compact(moved, merged[triangles])


def compact(points: Floats, triangles: Ints) -> tuple[Floats, Ints, Ints]:
    """Without triangles that name a point twice and points on none; and the old number of each."""
    a, b, c = triangles.T
    kept = triangles[(a != b) & (b != c) & (c != a)]
    old, inverse = np.unique(kept, return_inverse=True)
    return points[old], inverse.reshape(-1, 3).astype(np.int64), old.astype(np.int64)


def _collapsible(triangles: Ints, edges: Edges, rank: Ints) -> Bools:
    """The link condition, and rims that shrink along themselves only.

    A triangle or tetrahedron by itself, whose corners have no other neighbours, stays.
    """
    graph = _graph(edges, int(triangles.max()) + 1)
    shared = np.asarray((graph @ graph)[edges.ends[:, 0], edges.ends[:, 1]]).ravel()
    low, high = rank[edges.ends].T
    along_rim = (low == 0) | (high == 0) | edges.on_rim
    opposite = np.where(edges.on_rim, 1, 2)
    more = np.diff(graph.indptr)[edges.ends].max(axis=1) > opposite + 1
    sound: Bools = (shared == opposite) & more & along_rim & (low + high < 4)
    return sound


def _collapse_is_sound(
    points: Floats,
    triangles: Ints,
    normals: Floats,
    keep: Ints,
    drop: Ints,
    place: Floats,
    longest: Floats,
) -> Bools:
    """Mask of the collapses that turn no triangle over and leave no edge too long."""
    which = np.full(len(points), -1)
    which[keep] = which[drop] = np.arange(len(keep))
    target, moved = np.arange(len(points)), points.copy()
    target[drop], moved[keep] = keep, place
    touched = np.flatnonzero((which[triangles] >= 0).any(axis=1))
    before, after = triangles[touched], target[triangles[touched]]
    left = (after != np.roll(after, 1, axis=1)).all(axis=1)
    before, after = before[left], after[left]
    owner = which[before].max(axis=1)
    old, new = _facing(points, before), _facing(moved, after)
    bad = _cosine(old, new) < _FACING
    bad |= _cosine(new, normals[after].sum(axis=1)) < np.minimum(
        _FACING, _cosine(old, normals[before].sum(axis=1))
    )
    for i, j in ((0, 1), (1, 2), (2, 0)):
        length = np.linalg.norm(moved[after[:, i]] - moved[after[:, j]], axis=1)
        bad |= length > np.minimum(longest[after[:, i]], longest[after[:, j]])
    good = np.ones(len(keep), dtype=bool)
    good[owner[bad]] = False
    return good


def _apart(lack: Floats, edges: Edges, count: int, most: int) -> Ints:
    """At most ``most`` edges of positive lack, no end of one beside an end of another."""
    waiting = np.flatnonzero(lack > 0)
    waiting = waiting[np.argsort(-lack[waiting], kind="stable")][: _WAITING * most]
    chosen = []
    for _ in range(_SWEEPS):
        place = np.arange(len(waiting))
        first = np.full(count, len(waiting))
        np.minimum.at(first, edges.ends[waiting], place[:, None])
        first = _least_around(first, edges)
        wins = (first[edges.ends[waiting]] == place[:, None]).all(axis=1)
        chosen.append(waiting[wins])
        taken = np.ones(count, dtype=np.int64)
        taken[edges.ends[chosen[-1]]] = 0
        taken = _least_around(taken, edges)
        waiting = waiting[(taken[edges.ends[waiting]] > 0).all(axis=1)]
    found = np.concatenate(chosen)
    apart: Ints = found[np.argsort(-lack[found], kind="stable")][:most]
    return apart


def _least_around(values: Ints, edges: Edges) -> Ints:
    """Smallest value (n,) at each vertex and its neighbours."""
    least = values.copy()
    np.minimum.at(least, edges.ends[:, 0], values[edges.ends[:, 1]])
    np.minimum.at(least, edges.ends[:, 1], values[edges.ends[:, 0]])
    return least


def _best_of_both(gain: Floats, sides: Ints, triangles: int) -> Bools:
    """Mask of the edges that gain most in each of their triangles; sides (e, 2), -1 for none."""
    best = np.full(triangles + 1, -1)
    order = np.argsort(gain, kind="stable")
    for side in (0, 1):
        better = sides[order, side]
        known = best[better]
        ahead = (known < 0) | (gain[order] > gain[known])
        best[better[ahead]] = order[ahead]
    best[-1] = -1
    mine = np.arange(len(gain))
    result: Bools = (best[sides[:, 0]] == mine) & ((sides[:, 1] < 0) | (best[sides[:, 1]] == mine))
    return result


def _graph(edges: Edges, count: int) -> csr_array:
    from scipy.sparse import csr_array

    low, high = edges.ends.T
    ones = np.ones(2 * len(low), dtype=np.int32)
    return csr_array((ones, (np.append(low, high), np.append(high, low))), shape=(count, count))


def _keys(i: Ints, j: Ints) -> Ints:
    """One number for each pair of indices, whatever their order."""
    return np.minimum(i, j) * np.int64(2**31) + np.maximum(i, j)


def _there(ends: Ints, i: Ints, j: Ints) -> Bools:
    """Whether the edges i j are among the ends (e, 2), which are in order."""
    keys, wanted = _keys(*ends.T), _keys(i, j)
    place = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
    return np.asarray(keys[place] == wanted)


def _cotangent(points: Floats, tip: Ints, left: Ints, right: Ints) -> Floats:
    u, v = points[left] - points[tip], points[right] - points[tip]
    cross = np.linalg.norm(np.cross(u, v), axis=1)
    dot: Floats = np.einsum("nd,nd->n", u, v) / np.maximum(cross, np.finfo(float).tiny)
    return dot


def _facing(points: Floats, triangles: Ints) -> Floats:
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def _worst_cosine(points: Floats, pair: tuple[Ints, Ints], up: Floats) -> Floats:
    """Smaller cosine between the two triangles' normals and ``up``."""
    return np.minimum(*(_cosine(_facing(points, corners), up) for corners in pair))


def _cosine(u: Floats, v: Floats) -> Floats:
    size = np.linalg.norm(u, axis=1) * np.linalg.norm(v, axis=1)
    cosine: Floats = np.einsum("nd,nd->n", u, v) / np.maximum(size, np.finfo(float).tiny)
    return cosine
