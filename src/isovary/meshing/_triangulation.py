"""Points on a fine triangle mesh joined to triangles: the dual of their cells on the surface.

Every fine vertex belongs to the point to which its way along the fine edges is shortest. These
cells are connected, so points on two sheets that lie close together are never joined. A fine
triangle with corners in three cells makes a triangle of their points. Flips make it Delaunay.
"""

from __future__ import annotations

import numpy as np

from ..geometry import Bools, Floats, Ints, edges_of, topology
from ..scalar_field import ScalarField
from ._draft import Draft, settled
from ._edits import edges_with_sides, flip

_PASSES = 12  # of refinement; each halves the longest edges
_FLIPS = 60


def refined(
    fine: Draft, lengths: Floats, longest: float, most: int, field: ScalarField, isovalue: float
) -> tuple[Draft, Floats]:
    """Edges halved until none is longer than ``longest`` times the length wanted there.

    Or there are ``most`` vertices: edges between points that do not find the surface never end.

    Returns the mesh, and the wanted lengths (n,) at its vertices, linear along the old edges.
    """
    for _ in range(_PASSES):
        ends, of_triangle, counts = edges_of(fine.triangles)
        i, j = ends.T
        way = np.linalg.norm(fine.points[i] - fine.points[j], axis=1)
        halved = np.flatnonzero(way > longest * (lengths[i] + lengths[j]) / 2)
        if len(halved) == 0 or len(fine.points) > most:
            break
        middle = np.full(len(ends), -1)
        middle[halved] = len(fine.points) + np.arange(len(halved))
        i, j = ends[halved].T
        same = fine.points[i] == fine.points[j]  # not two faces that lie opposite
        held = fine.held[i] & fine.held[j] & same & (counts[halved] == 1)[:, None]
        points = (fine.points[i] + fine.points[j]) / 2
        new = settled(Draft(points, fine.triangles, held, points), field, isovalue)
        points = np.concatenate([fine.points, new.points])
        fine = Draft(
            points,
            _pieces(points, fine.triangles, middle[of_triangle]),
            np.concatenate([fine.held, held]),
            np.concatenate([fine.normals, new.normals]),
        )
        lengths = np.concatenate([lengths, (lengths[i] + lengths[j]) / 2])
    return fine, lengths


def triangulated(points: Floats, normals: Floats, seeds: Ints, fine: Draft) -> Ints:
    """Delaunay triangles (m, 3) of points whose nearest fine vertices are ``seeds``.

    On a rim the seeds that lie on it are joined to one another, as rim edges. None if a seed is
    negative: there is no vertex for it.
    """
    if (seeds < 0).any():
        return np.empty((0, 3), dtype=np.int64)
    triangles = dual(fine.triangles, cells(fine, seeds))
    if is_sound(triangles, len(points)):
        for _ in range(_FLIPS):
            triangles, flips = flip(points, triangles, normals)
            if not flips:
                break
    return triangles


def cells(fine: Draft, seeds: Ints) -> Ints:
    """For each fine vertex the number of the seed (n,) that is nearest along the edges.

    Ways to a vertex on a rim keep to the rim, so that rims belong to the seeds on them.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import dijkstra

    ends, _, counts = edges_of(fine.triangles)
    count = len(fine.points)
    way = np.linalg.norm(fine.points[ends[:, 0]] - fine.points[ends[:, 1]], axis=1)
    along = counts == 1
    on_rim = np.zeros(count, dtype=bool)
    on_rim[ends[along]] = True
    start, stop = np.concatenate([ends, ends[:, ::-1]]).T
    open_ = np.tile(along, 2) | ~on_rim[stop]
    links = (np.tile(way, 2)[open_], (start[open_], stop[open_]))
    graph = coo_array(links, shape=(count, count)).tocsr()
    _, _, nearest = dijkstra(graph, indices=seeds, min_only=True, return_predecessors=True)
    owner = np.full(count + 1, -1)
    owner[seeds] = np.arange(len(seeds))
    labels: Ints = owner[np.where(nearest < 0, count, nearest)]
    return labels


def dual(triangles: Ints, labels: Ints) -> Ints:
    """Each triangle (m, 3) of cells that meet in a fine triangle, once, turned the same way."""
    corners = labels[triangles]
    a, b, c = corners.T
    met = corners[(a != b) & (b != c) & (c != a) & (corners >= 0).all(axis=1)]
    turn = met.argmin(axis=1)[:, None]
    met = np.take_along_axis(met, (turn + np.arange(3)) % 3, axis=1)
    unique: Ints = np.unique(met, axis=0)
    return unique


def is_sound(triangles: Ints, count: int) -> bool:
    """Whether all ``count`` points have triangles, and every edge two that face the same way.

    Or one, on a rim. And the triangles at a point are one fan.
    """
    if len(triangles) == 0 or len(np.unique(triangles)) < count:
        return False
    start, stop = triangles.T.ravel(), triangles[:, [1, 2, 0]].T.ravel()
    if len(np.unique(start * count + stop)) < len(start):
        return False
    return _fans(triangles) == count


def fault(triangles: Ints, count: int) -> str:
    """What is wrong with a triangulation, for a message; the topology if it is sound."""
    sound = is_sound(triangles, count)
    return str(topology(triangles)) if sound else "cells that do not fit together"


def _fans(triangles: Ints) -> int:
    """Number of fans: triangle corners at the same point, joined across the edges there."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    edges = edges_with_sides(triangles)
    inner = ~edges.on_rim
    links = []
    for end in edges.ends[inner].T:
        first, second = (
            3 * side + (triangles[side] == end[:, None]).argmax(axis=1)
            for side in edges.triangles[inner].T
        )
        links.append(np.stack([first, second]))
    row, column = np.concatenate(links, axis=1)
    graph = coo_array((np.ones(len(row)), (row, column)), shape=(triangles.size,) * 2)
    return int(connected_components(graph, directed=False)[0])


def _pieces(points: Floats, triangles: Ints, middles: Ints) -> Ints:
    """Triangles cut at the middles (m, 3) of their edges 01, 12, 20; -1 for edges kept whole."""
    cut = (middles >= 0).sum(axis=1)
    one, two, three = (_turned(triangles, middles, cut == k) for k in (1, 2, 3))
    a, b, c, m, *_ = one
    pieces = [triangles[cut == 0], _rows(a, m, c), _rows(m, b, c)]
    a, b, c, m, n, _ = two
    short = np.linalg.norm(points[a] - points[n], axis=1)
    short = short < np.linalg.norm(points[m] - points[c], axis=1)
    pieces += [_rows(m, b, n), _rows(a, m, np.where(short, n, c))]
    pieces.append(_rows(np.where(short, a, m), n, c))
    a, b, c, m, n, o = three
    pieces += [_rows(a, m, o), _rows(m, b, n), _rows(o, n, c), _rows(m, n, o)]
    return np.concatenate(pieces)


def _turned(triangles: Ints, middles: Ints, chosen: Bools) -> Ints:
    """Corners and middles (6, k) of some triangles, turned: edge 01 is cut, and not 20 if any."""
    triangles, middles = triangles[chosen], middles[chosen]
    cut = middles >= 0
    first = (cut & ~np.roll(cut, 1, axis=1)).argmax(axis=1)[:, None]
    order = (first + np.arange(3)) % 3
    parts = [np.take_along_axis(part, order, axis=1).T for part in (triangles, middles)]
    turned: Ints = np.concatenate(parts)
    return turned


def _rows(a: Ints, b: Ints, c: Ints) -> Ints:
    return np.stack([a, b, c], axis=1)
