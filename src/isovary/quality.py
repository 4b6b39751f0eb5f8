"""How good a mesh is: its triangles, its connections, how near it lies to the isosurface."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import ArgumentError
from .geometry import (
    EDGES,
    Bools,
    Floats,
    Ints,
    Topology,
    edges_of,
    jacobian_ratios,
    quadrature,
    rim_nodes,
    shape_functions,
    tangents,
    topology,
    triangle_quality,
)
from .meshing import Sizing, as_sizing, principal_curvatures, uniform_sizing
from .records import Surface
from .scalar_field import ScalarField

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LEAST_QUALITY = 0.3
"""Quality of the worst triangle of a clean mesh."""

_POOR = 0.5
_ON_BOX = 1e-6  # of the mean edge
_ALIKE = 1e-3  # spread of logarithms below which a correlation would be one of rounding


@dataclass(frozen=True, eq=False, repr=False)
class MeshQuality:
    """Counts, shapes, connections and distances of a triangle mesh; made by :func:`mesh_quality`.

    Of a mesh with v vertices, n nodes, m triangles, e edges and r nodes on rims. What needs the
    field is None or NaN without one.

    Parameters
    ----------
    vertices, nodes, triangles, order : int
        Corners; points, edge midpoints included; triangles; 1 for flat ones, 2 for curved ones.
    area : float
        length^2.
    topology : Topology
    quality : array (m,)
        2 inradius / circumradius of the corners: 1 for equilateral, 0 for a sliver.
    angles : array (m, 3)
        Between the straight edges at each corner; degrees.
    jacobians : array (m,)
        Smallest over largest Jacobian of each triangle: 1 if flat, 0 or less if folded.
    facing : array (m,)
        Cosine between each triangle's normal and that of its corners; 0 or less if turned over.
    edge_lengths : array (e,)
        From corner to corner; length.
    tears : dict
        What a manifold does not have, in words, and how many of it.
    distances : array (n,), optional
        Of the nodes to the isosurface; length.
    element_distances : array (m,), optional
        Largest distance of each triangle to the isosurface, between its nodes, too; length.
    surface_distance : float
        Root-mean-square distance of the whole mesh to the isosurface; length.
    rim_distances : array (r,), optional
        Of the nodes on rims to the nearest face of the field's box; length.
    edge_ratios : array (e,), optional
        Edge length over the one wished for at its middle, divided by the rms of all.
    size_curvature_correlation : float
        Over the vertices, of the logarithms of mean edge length and curvedness
        sqrt((k1^2 + k2^2) / 2): -1 where edges shorten as the surface curves, 0 where they do
        not care. NaN where either is the same everywhere.
    """

    vertices: int
    nodes: int
    triangles: int
    order: int
    area: float
    topology: Topology
    quality: Floats
    angles: Floats
    jacobians: Floats
    facing: Floats
    edge_lengths: Floats
    tears: dict[str, int]
    distances: Floats | None = None
    element_distances: Floats | None = None
    surface_distance: float = math.nan
    rim_distances: Floats | None = None
    edge_ratios: Floats | None = None
    size_curvature_correlation: float = math.nan

    @property
    def folded(self) -> Bools:
        """Mask (m,) of the triangles that are folded or turned over."""
        return ~(self.jacobians > 0) | ~(self.facing > 0)

    @property
    def faults(self) -> tuple[str, ...]:
        """What is not clean, in words; empty for a clean mesh."""
        found = [f"{count} {what}" for what, count in self.tears.items() if count]
        if self.folded.any():
            found.append(f"{self.folded.sum()} triangles folded or turned over")
        poor = ~(self.quality > LEAST_QUALITY)
        if poor.any():
            limit, worst = LEAST_QUALITY, self.quality.min()
            found.append(f"{poor.sum()} triangles of a quality below {limit}, worst {worst:.2g}")
        if self.rim_distances is not None:
            off = self.rim_distances > _ON_BOX * self.edge_lengths.mean()
            if off.any():
                found.append(f"{off.sum()} nodes on rims inside the box")
        return tuple(found)

    @property
    def clean(self) -> bool:
        """Whether the mesh is fit for finite elements.

        It is a manifold, closed or with its rims on the box (where the field is known), no
        triangle is folded, and the worst quality exceeds 0.3.
        """
        return not self.faults

    def summary(self) -> dict[str, Any]:
        """Plain numbers and words for JSON; None for what is unknown."""
        q, a, e = self.quality, self.angles, self.edge_lengths
        return {
            "vertices": self.vertices,
            "nodes": self.nodes,
            "triangles": self.triangles,
            "order": self.order,
            "components": self.topology.components,
            "boundary_loops": self.topology.boundary_loops,
            "genus": self.topology.genus,
            "area": self.area,
            "quality": {
                "mean": float(q.mean()),
                "min": float(q.min()),
                "quantile_1_percent": float(np.quantile(q, 0.01)),
                "part_below_half": float((q < _POOR).mean()),
            },
            "angle_degrees": {"smallest": float(a.min()), "largest": float(a.max())},
            "edge_length": {name: float(getattr(e, name)()) for name in ("mean", "min", "max")},
            "edge_over_wish": _ends(self.edge_ratios),
            "smallest_jacobian": _known(self.jacobians.min()),
            "distance_to_isosurface": {
                "nodes": _largest(self.distances),
                "elements": _largest(self.element_distances),
                "rms": _known(self.surface_distance),
            },
            "distance_of_rims_to_box": _largest(self.rim_distances),
            "size_curvature_correlation": _known(self.size_curvature_correlation),
            "clean": self.clean,
            "faults": list(self.faults),
        }

    def plot(self, surface: Surface) -> Figure:
        """The figure of this quality, with the surface that it was measured on."""
        from .view import mesh_quality_figure

        return mesh_quality_figure(surface, self)

    def __repr__(self) -> str:
        return (
            f"MeshQuality({self.vertices} vertices, mean quality {self.quality.mean():.3f}, "
            f"worst {self.quality.min():.2g}, {'clean' if self.clean else 'not clean'})"
        )

    def __str__(self) -> str:
        q, a, e = self.quality, self.angles, self.edge_lengths
        kind = "curved" if self.order == 2 else "flat"
        lines = [
            f"mesh        {self.vertices} vertices, {self.nodes} nodes, {self.triangles} {kind} "
            "triangles",
            f"surface     {self.topology}; area {self.area:.6g}",
            f"quality     mean {q.mean():.3f}, worst {q.min():.2g}; {(q < _POOR).mean():.2%} of "
            f"the triangles below {_POOR}",
            f"angles      {a.min():.1f} to {a.max():.1f} degrees",
            f"edges       {e.min():.3g} to {e.max():.3g}, mean {e.mean():.3g} (length)"
            + _wish_said(self),
        ]
        if self.order == 2:
            lines.append(
                f"Jacobians   smallest over largest in a triangle: {self.jacobians.min():.2g}"
            )
        if self.distances is not None:
            lines.append(f"distance    {_distance_said(self)}")
        lines.append(f"clean       {'yes' if self.clean else 'NO: ' + '; '.join(self.faults)}")
        return "\n".join(lines)


def mesh_quality(
    surface: Surface,
    field: ScalarField | None = None,
    isovalue: float | None = None,
    *,
    sizing: Sizing | float | None = None,
) -> MeshQuality:
    """Counts, quality, angles, Jacobians and faults of a mesh; with its field, distances, too.

    The distance of a point to the isosurface is that of one Newton step,
    ``abs(g) / norm(grad g)`` with g the field's level set function, exact to second order. It is
    taken at the nodes, and at the 12 quadrature points and the middle of each triangle.

    Parameters
    ----------
    surface : Surface
    field : ScalarField, optional
        Whose isosurface the mesh is to be; with the interpolation that it was meshed with.
    isovalue : float, optional
        Of the isosurface; needed with the field.
    sizing : callable, optional
        What the edges are compared with, as given to the mesher. The mesher cuts these lengths
        where they grow too fast or cannot follow the surface; this report does not. Default:
        :func:`isovary.uniform_sizing`.

    Returns
    -------
    MeshQuality

    Raises
    ------
    ArgumentError
        A03 for a field without an isovalue, an isovalue or a sizing without a field, or a sizing
        that does not return positive lengths.
    FieldError
        I02 for an isovalue outside the field's range.

    Notes
    -----
    Cost: 0.2 s for 1 000 vertices, 4 s for 12 000, most of it the field between the nodes.

    Examples
    --------
    >>> from isovary.shapes import icosphere
    >>> ball = mesh_quality(icosphere(2, order=1))
    >>> ball.vertices, ball.clean, round(float(ball.angles.sum(axis=1).max()), 9)
    (162, True, 180.0)
    """
    if (field is None) != (isovalue is None) or (field is None and sizing is not None):
        got = [field is not None, isovalue is not None, sizing is not None]
        raise ArgumentError(
            "A03",
            "field, isovalue, sizing: expected both field and isovalue, with or without a sizing, "
            f"or none of them, got {dict(zip(('field', 'isovalue', 'sizing'), got, strict=True))}",
        )
    points, triangles = surface.points, surface.triangles
    edges = edges_of(triangles)[0]
    with np.errstate(divide="ignore", invalid="ignore"):
        jacobians = jacobian_ratios(points, triangles)
    known: dict[str, Any] = {}
    if field is not None and isovalue is not None:
        field.check_isovalue(isovalue)
        known = _field_measures(
            surface, field, isovalue, uniform_sizing if sizing is None else as_sizing(sizing)
        )
    return MeshQuality(
        vertices=len(np.unique(surface.corners)),
        nodes=len(points),
        triangles=len(triangles),
        order=surface.order,
        area=surface.area,
        topology=topology(triangles),
        quality=triangle_quality(points, triangles),
        angles=_angles(points, triangles),
        jacobians=jacobians,
        facing=_facing(surface),
        edge_lengths=_lengths(points, edges),
        tears=_tears(triangles),
        **known,
    )


def _lengths(points: Floats, edges: Ints) -> Floats:
    lengths: Floats = np.linalg.norm(points[edges[:, 1]] - points[edges[:, 0]], axis=1)
    return lengths


def _angles(points: Floats, triangles: Ints) -> Floats:
    """Angles (m, 3) at the corners; degrees."""
    corners = points[triangles[:, :3]]
    ahead, back = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    height = np.linalg.norm(np.cross(ahead, back), axis=2)
    angles: Floats = np.degrees(np.arctan2(height, (ahead * back).sum(axis=2)))
    return angles


def _facing(surface: Surface) -> Floats:
    """Cosine (m,) between each flat triangle's normal and the mean normal of its corners."""
    a, b, c = (surface.points[surface.corners[:, k]] for k in range(3))
    across = np.cross(b - a, c - a)
    mean = surface.normals[surface.corners].mean(axis=1)
    size = np.linalg.norm(across, axis=1) * np.linalg.norm(mean, axis=1)
    cosine: Floats = (across * mean).sum(axis=1) / np.where(size > 0, size, 1.0)
    return cosine


def _tears(triangles: Ints) -> dict[str, int]:
    """How many edges and vertices are none of a manifold, by what is wrong with them."""
    edges, of_triangle, counts = edges_of(triangles)
    ways = np.concatenate([triangles[:, [i, j]] for i, j in EDGES])
    _, passed = np.unique(ways, axis=0, return_counts=True)
    tears = {
        "edges with more than two triangles": int((counts > 2).sum()),
        "edges whose triangles face opposite sides": int((passed > 1).sum()),
        "vertices where parts of the surface only touch": _touching(triangles, edges, of_triangle),
    }
    if triangles.shape[1] == 6:
        middles = np.unique(
            np.stack([of_triangle, triangles[:, 3:]], axis=2).reshape(-1, 2), axis=0
        )
        tears["edges with several midpoints"] = int((np.bincount(middles[:, 0]) > 1).sum())
    return tears


def _touching(triangles: Ints, edges: Ints, of_triangle: Ints) -> int:
    """Number of vertices whose triangles form more than one fan.

    Each corner of a triangle is linked to the two ends, at its vertex, of the edges that meet
    there; what hangs together is a fan.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    vertex = triangles[:, :3].ravel()
    corner = np.arange(len(vertex))
    sides = of_triangle.ravel(), np.roll(of_triangle, 1, axis=1).ravel()
    ends = [len(vertex) + 2 * side + (edges[side, 1] == vertex) for side in sides]
    rows, columns = np.concatenate([corner, corner]), np.concatenate(ends)
    size = len(vertex) + 2 * len(edges)
    graph = coo_array((np.ones(len(rows)), (rows, columns)), shape=(size, size))
    fan = connected_components(graph, directed=False)[1][: len(vertex)]
    pairs = np.unique(np.column_stack([vertex, fan]), axis=0)
    return int((np.bincount(pairs[:, 0]) > 1).sum())


def _field_measures(
    surface: Surface, field: ScalarField, isovalue: float, sizing: Sizing
) -> dict[str, Any]:
    """What can be told with the field, by the names of MeshQuality."""
    points, triangles = surface.points, surface.triangles
    barycentric, weights = quadrature()
    places = np.vstack([barycentric, np.full(3, 1 / 3)])
    shape = shape_functions(places, surface.order)
    between = np.einsum("qi,mid->mqd", shape, points[triangles])
    away = _distances(between.reshape(-1, 3), field, isovalue).reshape(len(triangles), -1)
    columns = tangents(points, triangles, barycentric)
    areas = np.linalg.norm(np.cross(columns[..., 0], columns[..., 1]), axis=2) * weights
    nodes = _distances(points, field, isovalue)
    rim, (low, high) = points[rim_nodes(triangles)], field.bounds
    to_box = np.minimum(np.abs(rim - low), np.abs(rim - high)).min(axis=1)
    return {
        "distances": nodes,
        "element_distances": np.maximum(away.max(axis=1), nodes[triangles].max(axis=1)),
        "surface_distance": float(np.sqrt((away[:, :-1] ** 2 * areas).sum() / areas.sum())),
        "rim_distances": to_box if len(rim) else None,
        "edge_ratios": _edge_ratios(surface, field, isovalue, sizing),
        "size_curvature_correlation": _size_curvature(surface, field),
    }


def _distances(points: Floats, field: ScalarField, isovalue: float) -> Floats:
    """Distance (k,) of points to the isosurface; from outside of the box by way of its faces."""
    inside = np.clip(points, *field.bounds)
    level, gradient = field.level_set(inside, isovalue)
    slope = np.linalg.norm(gradient, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        step = np.where(level == 0, 0.0, np.abs(level) / slope)
    distances: Floats = np.hypot(step, np.linalg.norm(points - inside, axis=1))
    return distances


def _edge_ratios(surface: Surface, field: ScalarField, isovalue: float, sizing: Sizing) -> Floats:
    """Edge lengths over the sizing's at their middles, divided by the rms."""
    edges, of_triangle, _ = edges_of(surface.triangles)
    middles = surface.points[edges].mean(axis=1)
    if surface.order == 2:
        middles[of_triangle] = surface.points[surface.triangles[:, 3:]]
    wish = np.asarray(sizing(np.clip(middles, *field.bounds), field, isovalue), dtype=float)
    if wish.shape != (len(edges),) or not (np.isfinite(wish) & (wish > 0)).all():
        raise ArgumentError(
            "A03",
            f"sizing: expected {len(edges)} positive lengths for as many points, got shape "
            f"{wish.shape} with {np.sum(~(wish > 0))} that are not",
        )
    ratios = _lengths(surface.points, edges) / wish
    scaled: Floats = ratios / np.sqrt(np.mean(ratios**2))
    return scaled


def _size_curvature(surface: Surface, field: ScalarField) -> float:
    """Correlation over the vertices of log mean edge length and log curvedness."""
    edges = edges_of(surface.triangles)[0]
    count = np.bincount(edges.ravel())
    size = np.bincount(edges.ravel(), np.repeat(_lengths(surface.points, edges), 2))
    vertices = np.flatnonzero(count)
    inside = np.clip(surface.points[vertices], *field.bounds)
    with np.errstate(divide="ignore", invalid="ignore"):
        bend = np.sqrt((principal_curvatures(inside, field) ** 2).mean(axis=1))
    extent = float(np.ptp(surface.points, axis=0).max())  # flatter than that is flat
    pair = np.log([size[vertices] / count[vertices], np.maximum(bend, 1 / extent)])
    pair = pair[:, np.isfinite(pair).all(axis=0)]
    if pair.shape[1] < 2 or (np.ptp(pair, axis=1) < _ALIKE).any():
        return math.nan
    return float(np.corrcoef(pair)[0, 1])


def _known(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _largest(values: Floats | None) -> float | None:
    return None if values is None else _known(values.max())


def _ends(values: Floats | None) -> dict[str, float] | None:
    return None if values is None else {"min": float(values.min()), "max": float(values.max())}


def _wish_said(quality: MeshQuality) -> str:
    if quality.edge_ratios is None:
        return ""
    low, high = quality.edge_ratios.min(), quality.edge_ratios.max()
    return f"; {low:.3g} to {high:.3g} of the sizing, before its limits"


def _distance_said(quality: MeshQuality) -> str:
    """Largest distances, in words; empty without a field."""
    if quality.distances is None or quality.element_distances is None:
        return ""
    said = (
        f"nodes within {quality.distances.max():.1g} of the isosurface, triangles within "
        f"{quality.element_distances.max():.1g}, rms {quality.surface_distance:.1g} (length)"
    )
    if quality.rim_distances is not None:
        said += f"; rims within {quality.rim_distances.max():.1g} of the box"
    return said
