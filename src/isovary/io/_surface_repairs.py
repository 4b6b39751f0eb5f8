"""What is mended in a mesh from a file, and what is said about it: nothing is mended silently."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..errors import MeshError
from ..geometry import EDGES, Bools, Floats, Ints, edges_of, linear_triangles, triangle_areas

#: Points of open edges are one point if they are nearer than NEAR times the box's diagonal (a
#: coordinate in single precision is off by up to 6e-8 of it) and SHORT times the edges there.
NEAR, SHORT = 1e-6, 0.1
#: Squared areas must not overflow.
_LARGEST = 1e60


class Mended(NamedTuple):
    """Points and triangles that a Surface takes, and a sentence for each kind of repair."""

    points: Floats
    triangles: Ints
    notes: list[str]


def mend(points: Floats, triangles: Ints) -> Mended:
    """Merge, drop and turn until the mesh is a surface; MeshError I01 or M03 if it cannot be."""
    notes: list[str] = []
    points, triangles, unused = _drop_unused(points, triangles)
    _check_points(points)
    total = len(triangles)
    triangles = triangles[~_without_area(points, triangles)]
    points, triangles, merged = _merge(points, triangles)
    if merged:
        triangles = triangles[~_repeats(triangles)]
        triangles = triangles[~_without_area(points, triangles)]
    if len(triangles) == 0:
        raise MeshError(
            "M03",
            f"triangles: expected some with an area, got {total} without; "
            "the file is damaged, or its points coincide",
        )
    flat = total - len(triangles)
    triangles, doubled = _drop_doubled(triangles)
    points, triangles, left = _drop_unused(points, triangles)
    if merged:
        notes.append(f"{merged} points that coincide with another on an open edge merged [M01]")
    if unused or left:
        notes.append(f"{unused + left} points on no triangle dropped [M02]")
    if flat:
        notes.append(f"{flat} of {total} triangles without area dropped [M03]")
    if doubled:
        notes.append(f"{doubled} triangles that are there twice dropped [M04]")
    triangles = _orient(points, triangles, notes)
    return Mended(points, triangles, notes)


def _check_points(points: Floats) -> None:
    bad = ~(np.abs(points) < _LARGEST).all(axis=1)
    if bad.any():
        first = np.flatnonzero(bad)[:5].tolist()
        raise MeshError(
            "I01",
            f"points: expected finite numbers below {_LARGEST:g}, got {int(bad.sum())} others, "
            f"first {first} of those on triangles; find out where they come from",
        )


def _drop_unused(points: Floats, triangles: Ints) -> tuple[Floats, Ints, int]:
    used = np.zeros(len(points), dtype=bool)
    used[triangles] = True
    index = np.cumsum(used) - 1
    return points[used], index[triangles], int((~used).sum())


def _without_area(points: Floats, triangles: Ints) -> Bools:
    """Triangles whose height is within the rounding of their coordinates."""
    if len(triangles) == 0:
        return np.zeros(0, dtype=bool)
    corners = points[triangles[:, :3]]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    rounding = 8 * np.finfo(float).eps * np.abs(corners).max(axis=(1, 2))
    if triangles.shape[1] == 3:  # six times faster than by quadrature
        sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        areas = np.linalg.norm(sides, axis=1) / 2
    else:
        areas = triangle_areas(points, triangles)
    flat: Bools = areas <= longest * rounding
    return flat


def _repeats(triangles: Ints) -> Bools:
    ordered = np.sort(triangles, axis=1)
    repeated: Bools = (ordered[:, 1:] == ordered[:, :-1]).any(axis=1)
    return repeated


def _drop_doubled(triangles: Ints) -> tuple[Ints, int]:
    first = np.unique(np.sort(triangles, axis=1), axis=0, return_index=True)[1]
    return triangles[np.sort(first)], len(triangles) - len(first)


def _merge(points: Floats, triangles: Ints) -> tuple[Floats, Ints, int]:
    """Points of open edges that coincide become the first of them.

    Closed sheets that touch have no open edges and so stay apart; corners merge with
    corners only, midpoints with midpoints.
    """
    edges, _, counts = edges_of(linear_triangles(triangles))
    nodes = np.unique(edges[counts == 1])
    if len(nodes) == 0:
        return points, triangles, 0
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    corner = np.zeros(len(points), dtype=bool)
    corner[triangles[:, :3]] = True
    places = np.column_stack([points[nodes] - points.min(axis=0), corner[nodes] * diagonal])
    unique, inverse = _distinct(places)
    limits = np.full(len(unique), NEAR * diagonal)
    np.minimum.at(limits, inverse, SHORT * _shortest_edges(points, triangles)[nodes])
    labels = _clusters(unique, limits)[inverse]
    first = np.full(labels.max() + 1, len(points))
    np.minimum.at(first, labels, nodes)
    target = np.arange(len(points))
    target[nodes] = first[labels]
    kept = target == np.arange(len(points))
    index = np.cumsum(kept) - 1
    return points[kept], index[target[triangles]], int((~kept).sum())


def _distinct(rows: Floats) -> tuple[Floats, Ints]:
    """Distinct rows, and which of them each row is; as np.unique with axis=0, but faster."""
    order = np.lexsort(rows.T)
    ordered = rows[order]
    new = np.ones(len(rows), dtype=bool)
    new[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    inverse = np.empty(len(rows), dtype=np.int64)
    inverse[order] = np.cumsum(new) - 1
    return ordered[new], inverse


def _shortest_edges(points: Floats, triangles: Ints) -> Floats:
    """Length of the shortest edge at each node, as seen from the pieces of its triangles."""
    shortest = np.full(len(points), np.inf)
    pieces = linear_triangles(triangles)
    for i, j in EDGES:
        length = np.linalg.norm(points[pieces[:, j]] - points[pieces[:, i]], axis=1)
        np.minimum.at(shortest, pieces[:, i], length)
        np.minimum.at(shortest, pieces[:, j], length)
    return shortest


def _clusters(places: Floats, limits: Floats) -> Ints:
    """Number of the group of each place; neighbours within both their limits share one."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    count = len(places)
    distances, near = cKDTree(places).query(places, k=8, distance_upper_bound=limits.max() * 2)
    rows, columns = np.repeat(np.arange(count), 8), near.ravel()
    found = columns < count
    found[found] = (
        distances.ravel()[found] <= np.minimum(limits[rows], limits[columns % count])[found]
    )
    links = coo_array((np.ones(found.sum()), (rows[found], columns[found])), shape=(count, count))
    labels: Ints = connected_components(links, directed=False)[1].astype(np.int64)
    return labels


def _orient(points: Floats, triangles: Ints, notes: list[str]) -> Ints:
    """Turn triangles so that neighbours agree and closed parts face outward."""
    edges, of_triangle, counts = edges_of(triangles)
    several = edges[counts > 2]
    parts, turned, one_sided = _agree(triangles, of_triangle, counts)
    whole = np.ones(parts.max() + 1, dtype=bool)
    whole[parts[(counts[of_triangle] != 2).any(axis=1) | one_sided]] = False
    turned ^= _inside_out(points, _turn(triangles, turned), parts, whole)[parts]
    if turned.any():
        notes.append(
            f"{int(turned.sum())} of {len(turned)} triangles turned over, so that neighbours agree "
            "and closed parts face outward [M06]"
        )
    if one_sided.any():
        notes.append(
            f"{int(one_sided.sum())} triangles form a part with one side only (a Moebius strip): "
            "it has no outside, its normals mean nothing [M07]"
        )
    if len(several):
        notes.append(
            f"{len(several)} edges with three or more triangles kept, "
            f"first {several[:3].tolist()} [M05]"
        )
    return _turn(triangles, turned)


def _turn(triangles: Ints, turned: Bools) -> Ints:
    """The mesh with some triangles' orientation reversed."""
    reverse = [0, 2, 1] if triangles.shape[1] == 3 else [0, 2, 1, 5, 4, 3]
    return np.where(turned[:, None], triangles[:, reverse], triangles)


def _agree(triangles: Ints, of_triangle: Ints, counts: Ints) -> tuple[Ints, Bools, Bools]:
    """Part of each triangle, whether to turn it, and whether its part has one side only.

    Each triangle t has two sides, t and t + m. Sides that lie on the same side of the
    surface across an edge with two triangles are linked: a part with two sides falls into
    two groups, one with a single side is one. The fewer triangles are turned.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    m = len(triangles)
    slots = np.argsort(of_triangle, axis=None, kind="stable")
    start = (np.cumsum(counts) - counts)[counts == 2]
    a, b = slots[start], slots[start + 1]
    forward = np.stack([triangles[:, i] < triangles[:, j] for i, j in EDGES], axis=1).ravel()
    clash = (forward[a] == forward[b]) * m
    rows = np.concatenate([a // 3, a // 3 + m])
    columns = np.concatenate([b // 3 + clash, b // 3 + m - clash])
    links = coo_array((np.ones(len(rows)), (rows, columns)), shape=(2 * m, 2 * m))
    sides = connected_components(links, directed=False)[1]
    up, down = sides[:m], sides[m:]
    parts = np.unique(np.minimum(up, down), return_inverse=True)[1].astype(np.int64)
    turned = up > down
    most = np.bincount(parts, turned) > 0.5 * np.bincount(parts)
    return parts, np.asarray(turned ^ most[parts]) & (up != down), np.asarray(up == down)


def _inside_out(points: Floats, triangles: Ints, parts: Ints, whole: Bools) -> Bools:
    """Closed parts to turn: a part, and with it those in its box, whose volume is negative.

    A closed part in the box of another may be a cavity, whose outside is its inside: it
    keeps its orientation relative to the outermost part around it.
    """
    pieces = linear_triangles(triangles)
    owner = np.repeat(parts, len(pieces) // len(triangles))
    count = len(whole)
    origin = np.zeros((count, 3))
    origin[parts] = points[triangles[:, 0]]
    a, b, c = np.moveaxis(points[pieces] - origin[owner][:, None], 1, 0)
    volume = np.bincount(owner, (a * np.cross(b, c)).sum(axis=1), count)
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, owner, points[pieces].min(axis=1))
    np.maximum.at(high, owner, points[pieces].max(axis=1))
    return _with_outermost(low, high, whole, volume < 0)


def _with_outermost(low: Floats, high: Floats, whole: Bools, negative: Bools) -> Bools:
    """For each closed part, ``negative`` of the largest closed part whose box holds its box."""
    result = np.zeros(len(whole), dtype=bool)
    size = np.where(whole, np.linalg.norm(np.where(whole[:, None], high - low, 0), axis=1), -1)
    roots: list[int] = []
    for part in np.argsort(-size, kind="stable")[: int(whole.sum())].tolist():
        holds = (low[roots] <= low[part]).all(axis=1) & (high[roots] >= high[part]).all(axis=1)
        root = roots[int(np.argmax(holds))] if holds.any() else part
        if root == part:
            roots.append(part)
        result[part] = negative[root]
    return result
