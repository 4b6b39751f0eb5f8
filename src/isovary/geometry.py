r"""Geometry of triangle meshes: shape functions, areas, normals, topology, quality.

Everything here takes plain arrays: ``points`` (n, 3) and ``triangles`` (m, 3)
for flat triangles or (m, 6) for six-node triangles in VTK order (three corners,
then the midpoints of edges 01, 12 and 20).

::

        2                2
        | \              | \
        |   \            5   4
        |     \          |     \
        0-------1        0---3---1
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

EDGES = ((0, 1), (1, 2), (2, 0))
"""Corner pairs of a triangle's edges, in the order of the midpoint nodes 3, 4, 5."""

LINEAR_PIECES = ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5))
"""The four flat triangles into which a six-node triangle is split for drawing and searching."""


def frozen(array: ArrayLike, dtype: type = np.float64) -> NDArray[Any]:
    """A read-only copy of an array, in the order of C."""
    copy: NDArray[Any] = np.array(array, dtype=dtype, order="C", copy=True)
    copy.setflags(write=False)
    return copy


def quadrature() -> tuple[Floats, Floats]:
    """Symmetric quadrature on a triangle, exact for polynomials up to degree 6.

    Returns
    -------
    barycentric : array (12, 3)
        Quadrature points.
    weights : array (12,)
        Positive weights with sum 1: multiply by the triangle's area.

    References
    ----------
    D. A. Dunavant, *High degree efficient symmetrical Gaussian quadrature rules
    for the triangle*, Int. J. Numer. Meth. Eng. 21 (1985) 1129-1148.

    Examples
    --------
    The mean of one squared barycentric coordinate over a triangle is 1/6:

    >>> barycentric, weights = quadrature()
    >>> round(float(weights @ barycentric[:, 0] ** 2), 12)
    0.166666666667
    """
    orbits = (
        ((0.873821971016996, 0.063089014491502, 0.063089014491502), 0.050844906370207),
        ((0.501426509658179, 0.249286745170910, 0.249286745170910), 0.116786275726379),
        ((0.636502499121399, 0.310352451033784, 0.053145049844817), 0.082851075618374),
    )
    points, weights = [], []
    for (a, b, c), weight in orbits:
        images = sorted({(a, b, c), (b, c, a), (c, a, b), (b, a, c), (a, c, b), (c, b, a)})
        points += images
        weights += [weight] * len(images)
    total = np.array(weights)
    return np.array(points), total / total.sum()


def shape_functions(barycentric: ArrayLike, order: int) -> Floats:
    """Values of the Lagrange shape functions of a triangle.

    Order 1: N_i = b_i. Order 2: N_i = b_i (2 b_i - 1) at corners, 4 b_i b_j at midpoints.

    Parameters
    ----------
    barycentric : array (..., 3)
        Barycentric coordinates.
    order : int
        1 (three nodes) or 2 (six nodes).

    Returns
    -------
    array (..., 3 or 6)

    Examples
    --------
    At the midpoint of edge 01 only node 3 counts:

    >>> shape_functions([0.5, 0.5, 0.0], order=2).round().astype(int).tolist()
    [0, 0, 0, 1, 0, 0]
    """
    b = np.asarray(barycentric, dtype=float)
    if order == 1:
        return b.copy()
    middle = [4 * b[..., i] * b[..., j] for i, j in EDGES]
    return np.stack([b[..., i] * (2 * b[..., i] - 1) for i in range(3)] + middle, axis=-1)


def node_places(order: int) -> Floats:
    """Barycentric coordinates (3 or 6, 3) of a triangle's own nodes."""
    corners = np.eye(3)
    if order == 1:
        return corners
    return np.vstack([corners, [(corners[i] + corners[j]) / 2 for i, j in EDGES]])


def own_places(triangles: Ints) -> tuple[Ints, Floats]:
    """For each node a triangle that holds it (n,), and its barycentric coordinates there (n, 3)."""
    width = triangles.shape[1]
    count = int(triangles.max()) + 1
    triangle, local = np.empty(count, dtype=np.int64), np.empty(count, dtype=np.int64)
    triangle[triangles.ravel()] = np.repeat(np.arange(len(triangles)), width)
    local[triangles.ravel()] = np.tile(np.arange(width), len(triangles))
    return triangle, node_places(1 if width == 3 else 2)[local]


def shape_gradients(barycentric: ArrayLike, order: int) -> Floats:
    """Derivatives of the shape functions by the local coordinates (b1, b2), with b0 = 1 - b1 - b2.

    Parameters
    ----------
    barycentric : array (..., 3)
        Barycentric coordinates.
    order : int
        1 or 2.

    Returns
    -------
    array (..., 3 or 6, 2)

    Examples
    --------
    >>> shape_gradients([1 / 3, 1 / 3, 1 / 3], order=1).tolist()
    [[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]]
    """
    b = np.asarray(barycentric, dtype=float)
    by_barycentric = np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])
    if order == 1:
        return np.broadcast_to(by_barycentric, (*b.shape[:-1], 3, 2)).copy()
    corners = [(4 * b[..., i, None] - 1) * by_barycentric[i] for i in range(3)]
    middle = [
        4 * (b[..., i, None] * by_barycentric[j] + b[..., j, None] * by_barycentric[i])
        for i, j in EDGES
    ]
    return np.stack(corners + middle, axis=-2)


def tangents(points: Floats, triangles: Ints, barycentric: ArrayLike) -> Floats:
    """Tangent vectors dx/db1 and dx/db2 of each triangle at the same local points.

    Parameters
    ----------
    points : array (n, 3)
    triangles : array (m, 3 or 6)
    barycentric : array (q, 3)
        Local points, the same in every triangle.

    Returns
    -------
    array (m, q, 3, 2)
        Columns are the two tangents; length unit of ``points``.
    """
    gradients = shape_gradients(barycentric, 1 if triangles.shape[1] == 3 else 2)
    columns: Floats = np.einsum("mid,qik->mqdk", points[triangles], gradients)
    return columns


def triangle_areas(points: Floats, triangles: Ints) -> Floats:
    """Area of each (curved) triangle by quadrature.

    Returns
    -------
    array (m,)
        Squared length unit of ``points``.

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> round(float(triangle_areas(corners, np.array([[0, 1, 2]]))[0]), 12)
    0.5
    """
    barycentric, weights = quadrature()
    jacobian = tangents(points, triangles, barycentric)
    normals = np.cross(jacobian[..., 0], jacobian[..., 1])
    areas: Floats = np.linalg.norm(normals, axis=-1) @ weights / 2
    return areas


def node_areas(points: Floats, triangles: Ints) -> Floats:
    """Area that belongs to each node: a third of each flat triangle at it.

    Six-node triangles count as the four flat pieces over their nodes.

    Returns
    -------
    array (n,)
        Squared length unit of ``points``; the sum is the area of the flat triangles.

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> (6 * node_areas(corners, np.array([[0, 1, 2]]))).round(12).tolist()
    [1.0, 1.0, 1.0]
    """
    flat = linear_triangles(triangles)
    thirds = np.repeat(triangle_areas(points, flat) / 3, 3)
    return np.bincount(flat.ravel(), thirds, len(points)).astype(np.float64)


def node_normals(points: Floats, triangles: Ints) -> Floats:
    """Unit normals at the nodes: element normals evaluated at each node, averaged by area.

    Second-order accurate at best; a Surface made from a field carries the
    field's exact normals instead.

    Returns
    -------
    array (n, 3)
        NaN-free for nodes on at least one triangle of positive area.
    """
    jacobian = tangents(points, triangles, node_places(1 if triangles.shape[1] == 3 else 2))
    element_normals = np.cross(jacobian[..., 0], jacobian[..., 1])
    total = np.zeros_like(points)
    np.add.at(total, triangles, element_normals)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    unit: Floats = total / np.where(length > 0, length, 1.0)
    return unit


def edges_of(triangles: Ints) -> tuple[Ints, Ints, Ints]:
    """Unique corner edges of a mesh.

    Returns
    -------
    edges : array (e, 2)
        Corner indices, the smaller first.
    of_triangle : array (m, 3)
        Edge index of the edges 01, 12, 20 of each triangle.
    counts : array (e,)
        Number of triangles at each edge: 1 on a boundary, 2 inside.
    """
    pairs = np.sort(np.concatenate([triangles[:, [i, j]] for i, j in EDGES]), axis=1)
    size = int(triangles.max(initial=-1)) + 1  # one number for each edge is sorted faster than two
    keys, inverse, counts = np.unique(
        pairs[:, 0].astype(np.int64) * size + pairs[:, 1], return_inverse=True, return_counts=True
    )
    edges = np.stack([keys // size, keys % size], axis=1)
    of_triangle = np.ascontiguousarray(inverse.reshape(3, -1).T)
    return edges, of_triangle.astype(np.int64), counts.astype(np.int64)


def edge_length(points: Floats, triangles: Ints) -> float:
    """Median distance of the ends of a mesh's corner edges; length.

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [3, 0, 0], [0, 4, 0]])
    >>> edge_length(corners, np.array([[0, 1, 2]]))
    4.0
    """
    i, j = edges_of(triangles)[0].T
    return float(np.median(np.linalg.norm(points[i] - points[j], axis=1)))


def with_midpoints(points: Floats, triangles: Ints) -> tuple[Floats, Ints]:
    """Six-node triangles over the same flat ones: the middle of each edge becomes a node.

    Parameters
    ----------
    points : array (n, 3)
    triangles : array (m, 3)

    Returns
    -------
    points : array (n + e, 3)
        The given ones, then one for each edge.
    triangles : array (m, 6)
    """
    edges, of_triangle, _ = edges_of(triangles)
    nodes = np.concatenate([points, points[edges].mean(axis=1)])
    return nodes, np.hstack([triangles, of_triangle + len(points)])


def rim_nodes(triangles: Ints) -> Ints:
    """Nodes on the rims of an open mesh, edge midpoints included; none for a closed one.

    Parameters
    ----------
    triangles : array (m, 3 or 6)

    Returns
    -------
    array (r,)
        Ascending.

    Examples
    --------
    Two six-node triangles that share the edge 0-2, whose midpoint is node 5:

    >>> rim_nodes(np.array([[0, 1, 2, 4, 6, 5], [0, 2, 3, 5, 7, 8]]))
    array([0, 1, 2, 3, 4, 6, 7, 8])
    """
    _, of_triangle, counts = edges_of(triangles)
    outer = counts[of_triangle] == 1
    local = [(*pair, 3 + k)[: 2 if triangles.shape[1] == 3 else 3] for k, pair in enumerate(EDGES)]
    nodes = [triangles[outer[:, k]][:, list(local[k])].ravel() for k in range(3)]
    rim: Ints = np.unique(np.concatenate(nodes))
    return rim


@dataclass(frozen=True)
class Topology:
    """Topology of a surface: what two surfaces must share to be compared.

    ``components`` counts connected pieces, ``boundary_loops`` closed rims,
    ``euler`` is V - E + F, ``genus`` the number of handles (summed over pieces,
    for orientable surfaces).
    """

    components: int
    boundary_loops: int
    euler: int
    genus: int

    def __str__(self) -> str:
        return (
            f"{self.components} component(s), {self.boundary_loops} boundary loop(s), "
            f"genus {self.genus}, Euler characteristic {self.euler}"
        )


def components(triangles: Ints) -> Ints:
    """Number of the connected component of each triangle, numbered from 0.

    Returns
    -------
    array (m,)
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    corners, inverse = np.unique(triangles[:, :3], return_inverse=True)
    local = inverse.reshape(-1, 3)
    links = np.concatenate([local[:, [0, 1]], local[:, [1, 2]]])
    graph = coo_array((np.ones(len(links)), (links[:, 0], links[:, 1])), shape=(len(corners),) * 2)
    labels: Ints = connected_components(graph, directed=False)[1].astype(np.int64)
    return labels[local[:, 0]]


def node_components(triangles: Ints) -> Ints:
    """Number of the connected component of each node, numbered from 0.

    Returns
    -------
    array (n,)
    """
    parts = np.empty(int(triangles.max()) + 1, dtype=np.int64)
    parts[triangles] = components(triangles)[:, None]
    return parts


def topology(triangles: Ints) -> Topology:
    """Components, boundary loops, Euler characteristic and genus of a mesh.

    Parameters
    ----------
    triangles : array (m, 3 or 6)
        Only the corners count.

    Returns
    -------
    Topology

    Examples
    --------
    A tetrahedron is a sphere:

    >>> print(topology(np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])))
    1 component(s), 0 boundary loop(s), genus 0, Euler characteristic 2
    """
    edges, _, counts = edges_of(triangles)
    vertices = len(np.unique(triangles[:, :3]))
    euler = vertices - len(edges) + len(triangles)
    pieces = int(components(triangles).max()) + 1
    rim = edges[counts == 1]
    loops = _loop_count(rim)
    genus = (2 * pieces - loops - euler) // 2
    return Topology(components=pieces, boundary_loops=loops, euler=euler, genus=genus)


def _loop_count(rim: Ints) -> int:
    if len(rim) == 0:
        return 0
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    nodes, inverse = np.unique(rim, return_inverse=True)
    local = inverse.reshape(-1, 2)
    graph = coo_array((np.ones(len(local)), (local[:, 0], local[:, 1])), shape=(len(nodes),) * 2)
    return int(connected_components(graph, directed=False)[0])


def triangle_quality(points: Floats, triangles: Ints) -> Floats:
    """Shape quality of each flat triangle: 2 inradius / circumradius.

    1 for equilateral, 0 for a sliver;
    q = (b + c - a)(c + a - b)(a + b - c) / (a b c) for side lengths a, b, c.

    Returns
    -------
    array (m,)

    Examples
    --------
    >>> corners = np.array([[0, 0, 0], [1, 0, 0], [0.5, 3**0.5 / 2, 0]])
    >>> round(float(triangle_quality(corners, np.array([[0, 1, 2]]))[0]), 12)
    1.0
    """
    c, a, b = (
        np.linalg.norm(points[triangles[:, j]] - points[triangles[:, i]], axis=1) for i, j in EDGES
    )
    product = a * b * c
    numerator = (b + c - a) * (c + a - b) * (a + b - c)
    quality: Floats = numerator / np.where(product > 0, product, 1.0)
    return quality


def jacobian_ratios(points: Floats, triangles: Ints) -> Floats:
    """How evenly each triangle is mapped: its smallest Jacobian over its largest.

    The Jacobian is the area element along the triangle's mean normal, at the quadrature points
    and the nodes. 1 for a flat triangle with straight edges; zero or less where it is folded.

    Returns
    -------
    array (m,)

    Examples
    --------
    A midpoint at a quarter of its edge, where the map begins to fold at the corner:

    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> points, triangles = with_midpoints(corners, np.array([[0, 1, 2]]))
    >>> points[triangles[0, 3]] = [0.25, 0, 0]
    >>> (jacobian_ratios(points, triangles) + 0).round(12).tolist()
    [0.0]
    """
    if triangles.shape[1] == 3:
        return np.ones(len(triangles))
    places = np.concatenate([quadrature()[0], node_places(2)])
    columns = tangents(points, triangles, places)
    normals = np.cross(columns[..., 0], columns[..., 1])
    mean = normals.mean(axis=1, keepdims=True)
    along = (normals * mean).sum(axis=2) / np.linalg.norm(mean, axis=2)
    ratios: Floats = along.min(axis=1) / along.max(axis=1)
    return ratios


def linear_triangles(triangles: Ints) -> Ints:
    """Flat triangles over the same nodes: unchanged for order 1, four pieces each for order 2.

    Returns
    -------
    array (m, 3) or (4 m, 3)
        Piece p of triangle i is row 4 i + p, in the order of ``LINEAR_PIECES``.
    """
    if triangles.shape[1] == 3:
        return triangles.copy()
    return np.ascontiguousarray(triangles[:, np.array(LINEAR_PIECES)].reshape(-1, 3))
