"""Surfaces whose answers are known: areas, curvatures, eigenvalues, heat kernels.

Each function returns a :class:`isovary.Surface` whose nodes, edge midpoints included, lie
on the true surface and carry its exact normals. They point outward: away from the centre
or the axis, along +z where the surface is flat. Order 2 has four times the nodes of order 1.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from .errors import ArgumentError
from .geometry import Floats, Ints, edges_of, linear_triangles, with_midpoints
from .records import Surface


def icosphere(subdivisions: int, *, order: int = 2) -> Surface:
    """Unit sphere: a subdivided icosahedron with every node on the sphere.

    Eigenvalues l (l + 1), each 2 l + 1 times; curvature 1.

    Parameters
    ----------
    subdivisions : int
        0 to 8; the mesh has 10 * 4^subdivisions + 2 vertices.
    order : int
        2 for curved six-node triangles, 1 for flat ones.

    Returns
    -------
    Surface

    Raises
    ------
    ArgumentError
        A02 for an order or subdivisions out of range.

    Examples
    --------
    >>> sphere = icosphere(3)
    >>> len(sphere.points), round(sphere.area / (4 * np.pi), 4)
    (2562, 1.0)
    """
    points, triangles = _sphere_mesh(subdivisions, order)
    return Surface(points, triangles, normals=points)


def ellipsoid(axes: ArrayLike, subdivisions: int, *, order: int = 2) -> Surface:
    """Ellipsoid: an icosphere stretched along x, y and z.

    The triangles are stretched, too. The eigenvalues of a spheroid (two equal axes) follow
    by separation of variables.

    Parameters
    ----------
    axes : array (3,)
        Semi-axes along x, y, z; length.
    subdivisions : int
        0 to 8; the mesh has 10 * 4^subdivisions + 2 vertices.
    order : int
        2 for curved six-node triangles, 1 for flat ones.

    Returns
    -------
    Surface

    Raises
    ------
    ArgumentError
        A02 for an argument out of range, A03 for other than three axes.

    Examples
    --------
    The area with semi-axes a, a, c is 2 pi a^2 (1 + c / (a e) arcsin e), e^2 = 1 - a^2 / c^2:

    >>> e = 0.75**0.5
    >>> exact = 2 * np.pi * (1 + 2 / e * np.arcsin(e))
    >>> round(float(ellipsoid([1, 1, 2], 3).area / exact), 4)
    1.0
    """
    stretch = _positive("axes", axes, 3)
    sphere, triangles = _sphere_mesh(subdivisions, order)
    return Surface(sphere * stretch, triangles, normals=_unit(sphere / stretch))


def torus(ring: float, tube: float, counts: Sequence[int], *, order: int = 2) -> Surface:
    """Torus around the z axis, with cells of the same aspect everywhere.

    Angles a around the tube follow tan(a / 2) = sqrt((ring + tube) / (ring - tube)) tan(v / 2)
    in equal steps of v, which is conformal: cells are larger outside, but squares everywhere
    for counts in the proportion sqrt(ring^2 - tube^2) : tube. Gaussian curvature
    cos(a) / (tube (ring + tube cos(a))).

    Parameters
    ----------
    ring : float
        Distance of the tube's middle from the axis; length.
    tube : float
        Radius of the tube, below ``ring``; length.
    counts : (int, int)
        Vertices around the axis and around the tube, each at least 3.
    order : int
        2 for curved six-node triangles, 1 for flat ones.

    Returns
    -------
    Surface

    Raises
    ------
    ArgumentError
        A02 for an argument out of range.

    Examples
    --------
    The area is 4 pi^2 ring tube:

    >>> round(torus(1.0, 0.4, (60, 26)).area / (4 * np.pi**2 * 0.4), 4)
    1.0
    """
    ring, tube = _positive("ring, tube", (ring, tube), 2)
    if not tube < ring:
        raise ArgumentError("A02", f"tube: expected below the ring's {ring:g}, got {tube:g}")
    u, v, triangles = _grid_mesh(counts, order, (True, True))
    turn = np.sqrt((ring + tube) / (ring - tube))
    around = 2 * np.arctan2(turn * np.sin(np.pi * v), np.cos(np.pi * v))
    normals = _around_axis(np.cos(around), 2 * np.pi * u, np.sin(around))
    middle = _around_axis(np.full_like(u, ring), 2 * np.pi * u, np.zeros_like(u))
    return Surface(middle + tube * normals, triangles, normals=normals)


def cylinder(radius: float, height: float, counts: Sequence[int], *, order: int = 2) -> Surface:
    """Cylinder around the z axis from z = 0 to ``height``, open at both ends: two rims.

    Eigenvalues (m / radius)^2 + (pi l / height)^2, for m = 1, 2, ... twice; l from 0 with the
    natural boundary, from 1 with a Dirichlet boundary. Gaussian curvature 0.

    Parameters
    ----------
    radius, height : float
        Length.
    counts : (int, int)
        Cells around the axis, at least 3, and along it, at least 1.
    order : int
        2 for curved six-node triangles, 1 for flat ones.

    Returns
    -------
    Surface

    Raises
    ------
    ArgumentError
        A02 for an argument out of range.

    Examples
    --------
    The area is 2 pi radius height:

    >>> round(cylinder(0.5, 2.0, (24, 15)).area / (2 * np.pi), 4)
    1.0
    """
    radius, height = _positive("radius, height", (radius, height), 2)
    u, v, triangles = _grid_mesh(counts, order, (True, False))
    points = _around_axis(np.full_like(u, radius), 2 * np.pi * u, height * v)
    normals = _around_axis(np.ones_like(u), 2 * np.pi * u, np.zeros_like(u))
    return Surface(points, triangles, normals=normals)


def disk(radius: float, rings: int, *, order: int = 2) -> Surface:
    """Disk in the plane z = 0 with its centre at the origin; one rim.

    Ring i has 6 i vertices. With order 2 the triangles at the rim have one curved edge.
    Eigenvalues (j / radius)^2, each twice for m > 0, j the positive zeros of the Bessel
    function J_m with a Dirichlet boundary; of its derivative, and 0, with the natural one.

    Parameters
    ----------
    radius : float
        Length.
    rings : int
        At least 1; the mesh has 1 + 3 rings (rings + 1) vertices.
    order : int
        2 for six-node triangles (four times the nodes), 1 for flat ones.

    Returns
    -------
    Surface

    Raises
    ------
    ArgumentError
        A02 for an argument out of range.

    Examples
    --------
    >>> flat = disk(2.0, 8)
    >>> round(flat.area / (4 * np.pi), 4)
    1.0
    """
    (radius,) = _positive("radius", (radius,), 1)
    distance, angle, triangles = _ring_mesh(rings, order)
    points = _around_axis(radius * distance, angle, np.zeros_like(angle))
    return Surface(points, triangles, normals=np.broadcast_to([0.0, 0.0, 1.0], points.shape))


def hemisphere(rings: int, *, order: int = 2) -> Surface:
    """Upper half of the unit sphere; its one rim is the equator, exactly at z = 0.

    Distances in :func:`disk` become angles from the pole. The heat kernel is the sphere's plus
    (natural boundary) or minus (Dirichlet) that from the mirror image below the equator:
    eigenvalues l (l + 1), l + 1 or l times.

    Parameters
    ----------
    rings : int
        At least 1; the mesh has 1 + 3 rings (rings + 1) vertices.
    order : int
        2 for curved six-node triangles, 1 for flat ones.

    Returns
    -------
    Surface

    Raises
    ------
    ArgumentError
        A02 for an argument out of range.

    Examples
    --------
    >>> half = hemisphere(12)
    >>> round(half.area / (2 * np.pi), 4), float(half.points[:, 2].min())
    (1.0, 0.0)
    """
    distance, angle, triangles = _ring_mesh(rings, order)
    height = np.sin(np.pi / 2 * (1 - distance))  # the cosine, but exactly 0 on the rim
    points = _around_axis(np.sin(np.pi / 2 * distance), angle, height)
    return Surface(points, triangles, normals=points)


def sheet(
    width: float, height: float, counts: Sequence[int], *, bend: float = 0.0, order: int = 2
) -> Surface:
    """Rectangle, flat or rolled without stretching to a piece of a cylinder.

    Its middle stays on the y axis, which it follows from 0 to ``height``. Rolling is an
    isometry: eigenvalues (pi k / width)^2 + (pi l / height)^2 with the natural boundary
    (k, l from 0) and curvature 0, whatever the bend.

    Parameters
    ----------
    width, height : float
        Length along x (before rolling) and y.
    counts : (int, int)
        Cells along x and y, each at least 1.
    bend : float
        1 / radius of the cylinder, whose axis is below: 0, flat, to 2 pi / width, closed.
    order : int
        2 for curved six-node triangles, 1 for flat ones.

    Returns
    -------
    Surface

    Raises
    ------
    ArgumentError
        A02 for an argument out of range.

    Examples
    --------
    Rolled to a half-cylinder of radius 1, its sides are 2 apart:

    >>> rolled = sheet(np.pi, 1.0, (12, 4), bend=1.0)
    >>> round(float(np.ptp(rolled.points[:, 0])), 12), round(rolled.area / np.pi, 4)
    (2.0, 1.0)
    """
    width, height = _positive("width, height", (width, height), 2)
    if not 0 <= bend * width <= 2 * np.pi * (1 + 1e-12):  # a full turn, rounded
        raise ArgumentError("A02", f"bend: expected 0 to {2 * np.pi / width:g}, got {bend:g}")
    u, v, triangles = _grid_mesh(counts, order, (False, False))
    along, angle = width * (u - 0.5), bend * width * (u - 0.5)
    # sin(angle) / bend and (cos(angle) - 1) / bend, for bend = 0 as well
    x = along * np.sinc(angle / np.pi)
    z = -along * angle / 2 * np.sinc(angle / (2 * np.pi)) ** 2
    normals = np.stack([np.sin(angle), np.zeros_like(u), np.cos(angle)], axis=1)
    return Surface(np.stack([x, height * v, z], axis=1), triangles, normals=normals)


def _positive(name: str, values: ArrayLike, count: int) -> Floats:
    """Return the values as an array (count,); raise unless they are positive and finite."""
    found = np.asarray(values, dtype=float)
    if found.shape != (count,):
        raise ArgumentError("A03", f"{name}: expected {count} numbers, got shape {found.shape}")
    if not (np.isfinite(found) & (found > 0)).all():
        raise ArgumentError("A02", f"{name}: expected positive and finite, got {found.tolist()}")
    return found


def _check_order(order: int) -> None:
    if order not in (1, 2):
        raise ArgumentError("A02", f"order: expected 1 or 2, got {order}")


def _unit(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


def _around_axis(distance: Floats, angle: Floats, height: Floats) -> Floats:
    """Points (n, 3) from cylindrical coordinates around the z axis."""
    return np.stack([distance * np.cos(angle), distance * np.sin(angle), height], axis=1)


def _sphere_mesh(subdivisions: int, order: int) -> tuple[Floats, Ints]:
    """Nodes on the unit sphere and triangles of a subdivided icosahedron."""
    _check_order(order)
    if not 0 <= subdivisions <= 8:
        raise ArgumentError("A02", f"subdivisions: expected 0 to 8, got {subdivisions}")
    points, triangles = _icosahedron()
    for _ in range(subdivisions):
        points, six = with_midpoints(points, triangles)
        points, triangles = _unit(points), linear_triangles(six)
    if order == 2:
        points, triangles = with_midpoints(points, triangles)
    return _unit(points), triangles


def _icosahedron() -> tuple[Floats, Ints]:
    golden = (1 + 5**0.5) / 2
    flat = np.array([(s, t * golden, 0.0) for s in (-1.0, 1.0) for t in (-1.0, 1.0)])
    points = np.concatenate([np.roll(flat, shift, axis=1) for shift in range(3)])
    from scipy.spatial import ConvexHull

    triangles = ConvexHull(points).simplices.astype(np.int64)
    inward = np.linalg.det(points[triangles]) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    return _unit(points), triangles


def _grid_mesh(
    counts: Sequence[int], order: int, periodic: tuple[bool, bool]
) -> tuple[Floats, Floats, Ints]:
    """Parameters u and v in [0, 1] of the nodes, and the triangles, two to a cell.

    With order 2 the midpoints are the nodes between, of a grid twice as fine. A periodic
    parameter has no node at 1: the last cell leads back to 0.
    """
    _check_order(order)
    lowest = tuple(3 if wraps else 1 for wraps in periodic)
    if len(counts) != 2 or any(n < low for n, low in zip(counts, lowest, strict=True)):
        raise ArgumentError("A02", f"counts: expected at least {lowest}, got {tuple(counts)}")
    cells = [order * n for n in counts]
    rows, columns = (n + (not wraps) for n, wraps in zip(cells, periodic, strict=True))
    i, j = order * np.indices(counts).reshape(2, -1)  # the corner of each cell

    def node(right: float, up: float) -> Ints:
        across = (i + int(order * right)) % rows
        return np.asarray(across * columns + (j + int(order * up)) % columns)

    lower = [(0, 0), (1, 0), (1, 1), (0.5, 0), (1, 0.5), (0.5, 0.5)][: 3 * order]
    upper = [(0, 0), (1, 1), (0, 1), (0.5, 0.5), (0.5, 1), (0, 0.5)][: 3 * order]
    halves = [np.stack([node(*place) for place in half], axis=1) for half in (lower, upper)]
    u, v = np.divmod(np.arange(rows * columns), columns)
    return u / cells[0], v / cells[1], np.concatenate(halves)


def _ring_mesh(rings: int, order: int) -> tuple[Floats, Floats, Ints]:
    """Distance and angle from the centre of the nodes of a unit disk, and the triangles.

    Edges are straight but at the rim, whose distance is exactly 1.
    """
    _check_order(order)
    if rings < 1:
        raise ArgumentError("A02", f"rings: expected at least 1, got {rings}")
    ring = np.repeat(np.arange(rings + 1), [1, *range(6, 6 * rings + 1, 6)])
    place = np.arange(len(ring)) - _first_of(ring)
    distance, angle = ring / rings, np.pi / 3 * place / np.maximum(ring, 1)
    triangles = np.concatenate([_between_rings(i) for i in range(1, rings + 1)])
    if order == 1:
        return distance, angle, triangles
    edges, of_triangle, counts = edges_of(triangles)
    plane = (distance * np.exp(1j * angle))[edges].mean(axis=1)
    middle = np.where(counts == 1, 1.0, np.abs(plane))
    triangles = np.hstack([triangles, of_triangle + len(ring)])
    return np.append(distance, middle), np.append(angle, np.angle(plane)), triangles


def _first_of(ring: Ints) -> Ints:
    """Index of the first vertex of a ring; the centre is ring 0."""
    return np.where(ring == 0, 0, 1 + 3 * ring * (ring - 1))


def _between_rings(ring: int) -> Ints:
    """Triangles between a ring and the next inner one, which has one vertex less per sector."""
    k = np.arange(6 * ring)  # vertices of the outer ring
    first_inner, first_outer = _first_of(np.array([ring - 1, ring]))
    beside = k - k // ring  # vertex of the inner ring
    inner, before = (first_inner + j % max(6 * ring - 6, 1) for j in (beside, beside - 1))
    outer, after = (first_outer + j % (6 * ring) for j in (k, k + 1))
    between = k % ring > 0  # at the sectors' borders there is none to point outward
    outward = np.stack([before, outer, inner], axis=1)[between]
    return np.concatenate([np.stack([inner, outer, after], axis=1), outward])
