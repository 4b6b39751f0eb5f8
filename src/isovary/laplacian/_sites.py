"""The nodes of a surface, or bare points, with the area that each stands for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ArgumentError, MeshError
from ..geometry import Floats, Ints, edges_of, linear_triangles, node_areas, node_components
from ..records import Surface

_FEWEST = 8  # bare points: six around one, and another
NEIGHBOURS = 20
"""Neighbours for the tangent plane of a bare point.

On random points of the unit sphere the areas then sum to 1 % less than 4 pi (12 neighbours: 9 %
less, since they do not surround every point), on a 1:1:0.3 ellipsoid of 472 points to 2.7 % less
(30 neighbours: 3.8 %, since they reach round the rim). Even clouds need no more than 8.
"""


@dataclass(frozen=True)
class Sites:
    """Nodes, as the operators that do not integrate over triangles see them.

    Parameters
    ----------
    points : array (n, 3)
        About their mean.
    areas : array (n,)
        Thirds of the incident flat triangles, or cells of a cloud; length^2.
    area : float
        Of the (curved) surface, or the sum of a cloud's cells; length^2.
    grain : array (n,)
        Proportional to the area per node around each, without regard to rims: mean area of
        the incident triangles, or squared reach of the neighbours; length^2.
    spacing : float
        Mean edge length, or that of a triangular lattice of the cloud's density; length.
    parts : array (n,)
        Number of the component that a node belongs to; all 0 for a cloud.
    """

    points: Floats
    areas: Floats
    area: float
    grain: Floats
    spacing: float
    parts: Ints


def sites_of(surface: Surface | ArrayLike) -> Sites:
    """The sites of a surface, or of bare points (n, 3)."""
    if isinstance(surface, Surface):
        return _surface_sites(surface)
    points = _checked(surface)
    if len(points) < _FEWEST:
        raise ArgumentError(
            "A02",
            f"points: expected at least {_FEWEST} to estimate their area, got {len(points)}; give "
            "a Surface",
        )
    return cloud_sites(points, min(NEIGHBOURS, len(points) - 1))


def cloud_sites(cloud: Surface | ArrayLike, neighbours: int = NEIGHBOURS) -> Sites:
    """The sites of bare points (n, 3), or of a surface's nodes without its triangles."""
    from scipy.spatial import cKDTree

    points = _checked(cloud.points if isinstance(cloud, Surface) else cloud)
    areas = cloud_areas(points, neighbours)
    grain = cKDTree(points).query(points, neighbours + 1)[0][:, -1] ** 2
    spacing = float(np.sqrt(2 / 3**0.5 * areas.mean()))
    parts = (
        node_components(cloud.triangles)
        if isinstance(cloud, Surface)
        else np.zeros(len(points), dtype=np.int64)
    )
    return Sites(points - points.mean(axis=0), areas, float(areas.sum()), grain, spacing, parts)


def _surface_sites(surface: Surface) -> Sites:
    points = surface.points - surface.points.mean(axis=0)
    flat = linear_triangles(surface.triangles)
    areas = node_areas(points, surface.triangles)
    grain = areas / np.bincount(flat.ravel(), minlength=len(points))
    edges = edges_of(flat)[0]
    spacing = np.linalg.norm(points[edges[:, 1]] - points[edges[:, 0]], axis=1).mean()
    return Sites(
        points, areas, surface.area, grain, float(spacing), node_components(surface.triangles)
    )


def _checked(cloud: ArrayLike) -> Floats:
    points = np.array(cloud, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise ArgumentError(
            "A03", f"points: expected a Surface or an array (n, 3), got shape {points.shape}"
        )
    bad = ~np.asarray(np.isfinite(points).all(axis=1))
    if bad.any():
        raise MeshError("I01", f"points: expected finite, got {bad.sum()} with NaN or inf")
    return points


def check_neighbours(name: str, neighbours: int, size: int, least: int = 1) -> None:
    """Raise ArgumentError A02 unless there are that many other points."""
    if not (least <= neighbours < size and neighbours == int(neighbours)):
        raise ArgumentError(
            "A02",
            f"{name}: expected {least} to {size - 1} for {size} points, got {neighbours}; "
            "choose another number, or take more points",
        )


def check_positive(name: str, value: float) -> None:
    """Raise ArgumentError A02 unless the value is positive and finite."""
    if not 0 < value < np.inf:
        raise ArgumentError("A02", f"{name}: expected a positive number, got {value}")


def cloud_areas(points: Floats, neighbours: int = NEIGHBOURS) -> Floats:
    """Area that each of some bare points stands for: its Voronoi cell in its tangent plane.

    The plane is spanned by the principal components of the point's nearest
    neighbours, weighted down to 0 for the farthest; their projections are
    triangulated by Delaunay there, and the triangles at the point give its cell.
    Where these do not close round the point, or one has a circumcircle that leaves
    the neighbourhood, the cell may be unbounded; there each triangle gives the mixed
    area of Meyer et al.

    Parameters
    ----------
    points : array (n, 3)
    neighbours : int
        At least 6; they must surround each point.

    Returns
    -------
    array (n,)
        length^2.

    Raises
    ------
    ArgumentError
        A02 for fewer than 6 neighbours, or more than there are.
    MeshError
        M03 for coincident points, or neighbours on a line.
    """
    from scipy.spatial import cKDTree

    check_neighbours("neighbours", neighbours, len(points), least=6)
    distance, nearest = cKDTree(points).query(points, neighbours + 1)
    twice = np.flatnonzero(distance[:, 1] == 0)
    if len(twice):
        raise MeshError(
            "M03",
            f"points: expected distinct ones, got {len(twice)} that coincide with another, "
            f"first {twice[:5].tolist()}; remove the copies",
        )
    reach = distance[:, -1]
    patch = (points[nearest] - points[:, None]) / reach[:, None, None]
    weight = 1 - (distance / reach[:, None]) ** 2  # 0 for the last, which may be a matter of ties
    centred = patch - np.einsum("nk,nkd->nd", weight / weight.sum(1, keepdims=True), patch)[:, None]
    spread = np.einsum("nk,nki,nkj->nij", weight, centred, centred)
    axes = np.linalg.eigh(spread)[1]  # ascending: the normal first
    cells = np.array([_cell(plane) for plane in patch @ axes[:, :, 1:]])
    flat = np.flatnonzero(~(cells > 0))
    if len(flat):
        raise MeshError(
            "M03",
            f"points: expected the neighbours of each to span a plane, got {len(flat)} where they "
            f"lie on a line, first {flat[:5].tolist()}; use more neighbours, or another cloud",
        )
    areas: Floats = cells * reach**2
    return areas


def _cell(plane: Floats) -> float:
    """Area of the Voronoi cell of the first of some points (k, 2) in the unit disk."""
    from scipy.spatial import Delaunay, QhullError

    try:
        triangles = Delaunay(plane).simplices
    except QhullError:
        return 0.0
    star = triangles[(triangles == 0).any(axis=1)]
    others = star[star != 0].reshape(-1, 2)
    q, r = plane[others[:, 0]] - plane[0], plane[others[:, 1]] - plane[0]
    double = np.abs(q[:, 0] * r[:, 1] - q[:, 1] * r[:, 0])
    proper = double > 1e-9  # Qhull may close a straight rim with slivers
    q, r, double, others = q[proper], r[proper], double[proper], others[proper]
    qq, rr, qr = (q * q).sum(axis=1), (r * r).sum(axis=1), (q * r).sum(axis=1)
    across = np.sqrt(qq * rr * (qq + rr - 2 * qr)) / double  # diameters of the circumcircles
    closed = len(np.unique(others)) == len(others)
    if closed and (across <= 1).all():  # no point farther away lies in these circles
        return float(((rr * (qq - qr) + qq * (rr - qr)) / double).sum() / 8)
    part = (rr * (qq - qr) + qq * (rr - qr)) / 8
    part = np.where((qr > qq) | (qr > rr), double**2 / 8, part)
    part = np.where(qr < 0, double**2 / 4, part)
    return float((part / double).sum())
