"""Surfaces and fields whose answers are known."""

from __future__ import annotations

import numpy as np

from .errors import ArgumentError
from .geometry import Floats, Ints, edges_of, linear_triangles
from .records import Surface


def icosphere(subdivisions: int, *, order: int = 2) -> Surface:
    """Unit sphere: a subdivided icosahedron with every node on the sphere.

    Parameters
    ----------
    subdivisions : int
        0 to 8; the mesh has 10 * 4^subdivisions + 2 vertices.
    order : int
        2 for curved six-node triangles (four times the nodes), 1 for flat ones.

    Returns
    -------
    Surface

    Raises
    ------
    ArgumentError
        A02 for an order other than 1 and 2, or subdivisions outside 0 to 8.

    Examples
    --------
    >>> sphere = icosphere(3)
    >>> len(sphere.points), round(sphere.area / (4 * np.pi), 4)
    (2562, 1.0)
    """
    if order not in (1, 2):
        raise ArgumentError("A02", f"order: expected 1 or 2, got {order}")
    if not 0 <= subdivisions <= 8:
        raise ArgumentError("A02", f"subdivisions: expected 0 to 8, got {subdivisions}")
    points, triangles = _icosahedron()
    for _ in range(subdivisions):
        points, six = _with_midpoints(points, triangles)
        triangles = linear_triangles(six)
    if order == 2:
        points, triangles = _with_midpoints(points, triangles)
    return Surface(points, triangles, normals=points)


def _icosahedron() -> tuple[Floats, Ints]:
    golden = (1 + 5**0.5) / 2
    flat = np.array([(s, t * golden, 0.0) for s in (-1.0, 1.0) for t in (-1.0, 1.0)])
    points = np.concatenate([np.roll(flat, shift, axis=1) for shift in range(3)])
    from scipy.spatial import ConvexHull

    hull = ConvexHull(points)
    triangles = hull.simplices.astype(np.int64)
    normals = np.cross(
        points[triangles[:, 1]] - points[triangles[:, 0]],
        points[triangles[:, 2]] - points[triangles[:, 0]],
    )
    inward = (normals * points[triangles].mean(axis=1)).sum(axis=1) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    return points / np.linalg.norm(points[0]), triangles


def _with_midpoints(points: Floats, triangles: Ints) -> tuple[Floats, Ints]:
    """Six-node triangles with the edge midpoints pushed onto the unit sphere."""
    edges, of_triangle, _ = edges_of(triangles)
    middle = points[edges].mean(axis=1)
    middle /= np.linalg.norm(middle, axis=1, keepdims=True)
    return np.concatenate([points, middle]), np.hstack([triangles, of_triangle + len(points)])
