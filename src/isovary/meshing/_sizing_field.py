"""A sizing function made fit for meshing: known everywhere, gentle, resolving, of a given total."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from dataclasses import field as dataclass_field
from typing import TYPE_CHECKING

import numpy as np

from ..errors import ArgumentError
from ..geometry import Floats, edges_of, frozen, node_areas, node_components, topology
from ..scalar_field import ScalarField
from ._curvature import principal_curvatures, section_curvatures
from ._draft import Draft
from ._sizing import Sizing

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

GROWTH = 0.3
"""Largest difference of two edge lengths over the distance between them."""

_NEIGHBOURS = 3
_CALIBRATIONS = 40
_CLOSE = 0.01


@dataclass(frozen=True, eq=False)
class SizingField:
    """Wanted edge lengths at the vertices of a fine mesh, and between them.

    Parameters
    ----------
    points : array (n, 3)
        Vertices of the fine mesh.
    lengths : array (n,)
        Edge length wanted at each.
    vertices : int
        Number of vertices of a mesh with these edges.
    """

    points: Floats
    lengths: Floats
    vertices: int
    _tree: cKDTree = dataclass_field(init=False, repr=False)

    def __post_init__(self) -> None:
        from scipy.spatial import cKDTree

        object.__setattr__(self, "points", frozen(self.points))
        object.__setattr__(self, "lengths", frozen(self.lengths))
        object.__setattr__(self, "_tree", cKDTree(self.points))

    def at(self, points: Floats) -> Floats:
        """Edge lengths (m,) at points (m, 3) near the surface, from the nearest vertices."""
        count = min(_NEIGHBOURS, len(self.points))
        distance, nearest = self._tree.query(points, count)
        floor = 1e-9 * float(self.lengths.min())
        weight = 1 / np.maximum(distance.reshape(-1, count), floor) ** 2
        lengths = self.lengths[nearest.reshape(-1, count)]
        result: Floats = (weight * lengths).sum(axis=1) / weight.sum(axis=1)
        return result


def sizing_field(
    fine: Draft,
    field: ScalarField,
    isovalue: float,
    sizing: Sizing,
    vertices: int | None,
    growth: float,
) -> SizingField:
    """The lengths of a sizing function at the vertices of a fine mesh of the isosurface.

    Three things are done to them. With ``vertices`` they are multiplied by the one factor that
    gives so many vertices: the sum over areas of 2 / (sqrt(3) h^2). Where the surface curves more
    than that, they are cut to its radius of curvature, but not below half the samples' distance.
    And they grow no faster over the surface than ``growth``.

    Its number of vertices is greater than the wanted one if that takes more.
    """
    points = fine.points
    wanted = _lengths(sizing(points.copy(), field, isovalue))
    bad = ~(np.isfinite(wanted) & (wanted > 0))
    if wanted.shape != (len(points),) or bad.any():
        raise ArgumentError(
            "A03",
            f"sizing: expected a function that returns {len(points)} positive lengths for as many "
            f"points, got shape {wanted.shape} with {bad.sum()} that are not",
        )
    count_vertices, gentle = _vertex_count(fine), _growth_limit(fine, growth)
    most = _resolving(fine, field)

    def made(factor: float) -> tuple[Floats, float]:
        lengths = gentle(np.minimum(factor * wanted, most))
        return lengths, count_vertices(lengths)

    if vertices is None:
        lengths, count = made(1.0)
        return SizingField(points, lengths, max(12, round(count)))
    lengths, least = made(np.inf)
    if least >= vertices:
        return SizingField(points, lengths, round(least))
    areas = node_areas(points, fine.triangles)
    factor = float(np.sqrt((areas / wanted**2).sum() / vertices))
    for _ in range(_CALIBRATIONS):
        lengths, count = made(factor)
        if abs(count - vertices) < _CLOSE * vertices:
            break
        factor *= float(np.sqrt(count / vertices))
    return SizingField(points, lengths, vertices)


def _lengths(returned: object) -> Floats:
    try:
        return np.asarray(returned, dtype=float)
    except (TypeError, ValueError) as error:
        raise ArgumentError(
            "A03", f"sizing: expected a function that returns numbers, got {error}"
        ) from error


def _resolving(fine: Draft, field: ScalarField) -> Floats:
    """Longest edges (n,) that can follow the surface: the smaller radius of curvature.

    On a rim, that of the rim if it is smaller still. Not below half the samples' distance, where
    the field has no detail; but for each component below the radius of a sphere of its area.
    """
    with np.errstate(divide="ignore", invalid="ignore"):  # where the gradient vanishes: no limit
        bend = np.nan_to_num(np.abs(principal_curvatures(fine.points, field)).max(axis=1))
    rim = np.flatnonzero(fine.rank == 1)
    if len(rim):
        faces = fine.held[rim].astype(float)
        bend[rim] = np.maximum(bend[rim], section_curvatures(fine.points[rim], field, faces))
    extent = float(np.ptp(fine.points, axis=0).max())
    radius = np.maximum(1 / np.maximum(bend, 1 / extent), float(field.spacing.min()) / 2)
    parts = node_components(fine.triangles)
    areas = np.bincount(parts, node_areas(fine.points, fine.triangles))
    most: Floats = np.minimum(radius, np.sqrt(areas / (4 * np.pi))[parts])
    return most


def _vertex_count(fine: Draft) -> Callable[[Floats], float]:
    """Function that tells how many vertices a mesh with edges of given lengths has.

    V = F / 2 + B / 2 + chi, by Euler's formula, with F equilateral triangles and B rim edges.
    """
    areas = node_areas(fine.points, fine.triangles)
    edges, _, counts = edges_of(fine.triangles)
    i, j = edges[counts == 1].T
    way = np.linalg.norm(fine.points[i] - fine.points[j], axis=1)
    euler = topology(fine.triangles).euler

    def count(lengths: Floats) -> float:
        triangles = (areas / lengths**2).sum() * 4 / np.sqrt(3)
        rim_edges = (2 * way / (lengths[i] + lengths[j])).sum()
        return float(triangles / 2 + rim_edges / 2 + euler)

    return count


def _growth_limit(fine: Draft, growth: float) -> Callable[[Floats], Floats]:
    """Function that cuts lengths h to min over j of h_j + growth * (way from j along the edges).

    Shortest ways from one more node, at the distance h_j from each vertex j.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import dijkstra

    count = len(fine.points)
    i, j = edges_of(fine.triangles)[0].T
    way = growth * np.linalg.norm(fine.points[i] - fine.points[j], axis=1)
    every, source = np.arange(count), np.full(count, count)
    rows, columns = np.concatenate([i, j, source]), np.concatenate([j, i, every])

    def limited(lengths: Floats) -> Floats:
        weights = np.concatenate([way, way, lengths])
        graph = coo_array((weights, (rows, columns)), shape=(count + 1, count + 1)).tocsr()
        distances: Floats = dijkstra(graph, indices=count)[:count]
        return distances

    return limited
