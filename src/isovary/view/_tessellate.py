r"""Curved triangles cut into small flat pieces, fine enough to look smooth.

::

    split = 3:      2
                    | \
                    o---o
                    | \ | \
                    o---o---o
                    | \ | \ | \
                    0---o---o---1
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry import EDGES, Floats, Ints, edges_of, node_places, rim_nodes, shape_functions
from ..records import Surface


@dataclass(frozen=True, eq=False)
class Pieces:
    """Small flat triangles on a surface.

    ``points`` (p, 3) and unit ``normals`` (p, 3) at their corners, ``triangles``
    (q, 3), ``areas`` (q,), unit ``facing`` (q, 3) and ``middles`` (q, 3) of the
    pieces. Piece j lies in element j // split^2.
    """

    points: Floats
    normals: Floats
    triangles: Ints
    middles: Floats
    facing: Floats
    areas: Floats


def lattice(split: int) -> tuple[Floats, Ints]:
    """Regular division of a triangle into split^2 small ones.

    Returns
    -------
    barycentric : array (p, 3)
        With p = (split + 1) (split + 2) / 2.
    triangles : array (split^2, 3)
        Turning the same way as the whole.

    Examples
    --------
    >>> barycentric, triangles = lattice(2)
    >>> len(barycentric), triangles.tolist()
    (6, [[0, 1, 3], [1, 4, 3], [1, 2, 4], [3, 4, 5]])
    """
    rows = [(i, j) for j in range(split + 1) for i in range(split + 1 - j)]
    number = {place: k for k, place in enumerate(rows)}
    triangles = []
    for i, j in rows:
        if i + j < split:
            triangles.append((number[i, j], number[i + 1, j], number[i, j + 1]))
        if i + j < split - 1:
            triangles.append((number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]))
    b = np.array(rows, dtype=float) / split
    return np.column_stack([1 - b.sum(axis=1), b]), np.array(triangles, dtype=np.int64)


def tessellate(surface: Surface, split: int) -> Pieces:
    """Each element cut into split^2 flat pieces with corners on the curved element.

    Parameters
    ----------
    surface : Surface
    split : int
        Pieces along an element's edge.

    Returns
    -------
    Pieces
        The area converges to the surface's own with the square of 1 / split.
    """
    barycentric, small = lattice(split)
    shape = shape_functions(barycentric, surface.order)
    points = np.einsum("pi,mid->mpd", shape, surface.points[surface.triangles]).reshape(-1, 3)
    normals = np.einsum("pi,mid->mpd", shape, surface.normals[surface.triangles]).reshape(-1, 3)
    first = len(barycentric) * np.arange(len(surface.triangles))
    triangles = (first[:, None, None] + small).reshape(-1, 3)
    a, b, c = (points[triangles[:, i]] for i in range(3))
    cross = np.cross(b - a, c - a)
    double = np.linalg.norm(cross, axis=1)
    middles, facing = (a + b + c) / 3, _unit(cross)
    if outside(surface) < 0:
        normals, facing, triangles = -normals, -facing, triangles[:, ::-1]
    return Pieces(points, _unit(normals), triangles, middles, facing, double / 2)


def outside(surface: Surface) -> float:
    """-1 for a closed surface whose normals point inward, as those of a distance do; else 1.

    Pictures show surfaces from outside, where the field may be the greater.
    """
    if len(rim_nodes(surface.triangles)):
        return 1.0
    a, b, c = surface.points[surface.corners].transpose(1, 0, 2)
    return -1.0 if (a * np.cross(b, c)).sum() < 0 else 1.0


def at_pieces(surface: Surface, split: int, values: Floats) -> Floats:
    """Node values at the middle of each piece, by the elements' shape functions.

    Nodes without a value (NaN) take the mean of their element's other nodes; an
    element without any value stays NaN.

    Parameters
    ----------
    surface : Surface
        With n nodes and m elements.
    split : int
    values : array (n,) or (n, k)

    Returns
    -------
    array (m split^2,) or (m split^2, k)
    """
    barycentric, small = lattice(split)
    shape = shape_functions(barycentric[small].mean(axis=1), surface.order)
    columns = values.reshape(len(values), -1)[surface.triangles]
    known = np.isfinite(columns)
    count = known.sum(axis=1, keepdims=True)
    total = np.where(known, columns, 0.0).sum(axis=1, keepdims=True)
    mean = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    filled = np.where(known, columns, mean)
    result: Floats = np.einsum("pi,mik->mpk", shape, filled, optimize=True)
    inside: Floats = result.reshape(len(result) * len(small), *values.shape[1:])
    return inside


def nearest_nodes(surface: Surface, split: int) -> Ints:
    """The node of its own element that is nearest to each piece (m split^2,), by place in it."""
    barycentric, small = lattice(split)
    middle = barycentric[small].mean(axis=1)
    away = np.linalg.norm(middle[:, None] - node_places(surface.order), axis=2)
    nearest: Ints = surface.triangles[:, away.argmin(axis=1)].ravel()
    return nearest


def edge_lines(surface: Surface, split: int) -> tuple[Floats, Floats]:
    """The elements' edges as polylines on the curved surface, each edge once.

    Returns
    -------
    points : array (e, split + 1, 3)
    normals : array (e, split + 1, 3)
        Unit, outward.
    """
    _, of_triangle, _ = edges_of(surface.corners)
    _, first = np.unique(of_triangle, return_index=True)
    element, local = np.divmod(first, 3)
    step = np.linspace(0.0, 1.0, split + 1)
    places = np.zeros((3, split + 1, 3))
    for k, (i, j) in enumerate(EDGES):
        places[k, :, i], places[k, :, j] = 1 - step, step
    shape = shape_functions(places, surface.order)[local]
    nodes = surface.triangles[element]
    points = np.einsum("epi,eid->epd", shape, surface.points[nodes])
    normals = outside(surface) * np.einsum("epi,eid->epd", shape, surface.normals[nodes])
    return points, _unit(normals)


def _unit(vectors: Floats) -> Floats:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    unit: Floats = vectors / np.where(length > 0, length, 1.0)
    return unit
