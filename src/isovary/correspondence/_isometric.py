"""Points of another mesh matched so that lengths change least."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from ..errors import ArgumentError, CorrespondenceError
from ..geometry import (
    EDGES,
    Floats,
    Ints,
    edges_of,
    linear_triangles,
    rim_nodes,
    shape_functions,
    shape_gradients,
    topology,
)
from ..isometry import distortion
from ..records import Correspondence, Surface
from ..sliding import Landing, facing, slide, tangent_frames
from ._closest_point import closest_point, nearest
from ._elements import position
from ._interpolate import interpolate
from ._normal_rays import normal_rays

_WIDTHS = (2.0, 6.0, 20.0, 60.0)  # in edges, over which a folded start is smoothed
_ROUNDS = 4  # of smoothing and going back onto the surface
_CORNER = np.cos(np.pi / 4)  # cosine of the turn from which on a rim has a corner
_SAMPLES = 16  # of a rim edge, to find the nearest
_STEPS = 8  # of Newton along a rim edge


def isometric_match(
    base: Surface, perturbed: Surface, *, start: Correspondence | None = None
) -> Correspondence:
    """Each base node matched so that the map as a whole changes lengths least.

    From a start the nodes slide on the perturbed surface until the integral of the squared
    Green strain between the base and its image is smallest (:func:`isovary.sliding.slide`):
    a piece of a surface finds itself again wherever it was shifted, turned, bent or rolled to.
    Rays and closest points, which know nothing of lengths, slide points past each other there.

    Rims go to rims and slide along them. Their corners, where a rim turns by more than 45
    degrees, stay at the perturbed rims' corners if there are as many: those nearest to them, or
    to where a given start puts them. Where the start turns triangles over, closest points and
    both smoothed over 2 to 60 edges are tried; the least strained that turns none over is taken.

    Parameters
    ----------
    base, perturbed : Surface
        Of the same topology, and near enough that the start is no worse than a distorted map.
    start : Correspondence, optional
        From base to perturbed. Default: :func:`normal_rays`. Lost nodes take the closest point.

    Returns
    -------
    Correspondence
        Every node has a partner. ``distance`` is signed by the side of the base normal.

    Raises
    ------
    CorrespondenceError
        C01 for surfaces of different topology; C05 if every start turns triangles over.
    ArgumentError
        A03 for a start that belongs to other surfaces.

    Notes
    -----
    The least strain near the start is found, which may not be the least of all: where it is
    large (:func:`isovary.distortion`), align the surfaces first, or go by way of surfaces
    between: the closest points of the image on each are the next ``start``. A motion that changes
    no length, such as a sphere's turn, is decided by the meshes' errors: on curved elements it
    is nothing, on coarse flat ones up to a part of an edge.
    Cost: for each of some 5 to 20 steps that of :func:`closest_point` and a sparse factorization
    of 2 n unknowns, 1 to 2 s for 2 000 nodes; as much again where the start has to be smoothed.

    Examples
    --------
    A strip rolled to a third of a circle: the end of the flat one, 1 from the middle, finds the
    end of the rolled one, at the angle 1.

    >>> from isovary.shapes import sheet
    >>> flat, rolled = sheet(2.0, 0.5, (8, 2)), sheet(2.0, 0.5, (6, 2), bend=1.0)
    >>> match = isometric_match(flat, rolled)
    >>> there = interpolate(match, rolled, rolled.points)
    >>> angle = np.arctan2(there[:, 0], 1 + there[:, 2])
    >>> bool(np.abs(angle - flat.points[:, 0]).max() < 2e-3)
    True
    """
    _check(base, perturbed, start)
    ground = _ground(base, perturbed, start)
    points = slide(base, _unfolded(base, ground, start), ground, exact=False)
    triangle, barycentric, _ = ground.places(points)
    offset = position(perturbed, triangle, barycentric) - base.points
    side = np.where(np.einsum("nd,nd->n", offset, base.normals) >= 0, 1.0, -1.0)
    distance = side * np.linalg.norm(offset, axis=1)
    return Correspondence(triangle, barycentric, distance, np.ones(len(triangle), dtype=np.int64))


def _check(base: Surface, perturbed: Surface, start: Correspondence | None) -> None:
    here, there = topology(base.triangles), topology(perturbed.triangles)
    if here != there:
        raise CorrespondenceError(
            "C01",
            f"base, perturbed: expected the same topology, got {here} and {there}; take other "
            "isovalues, or compare with normal_rays",
        )
    if start is not None and len(start.triangle) != len(base.points):
        raise ArgumentError(
            "A03",
            f"start: expected {len(base.points)} nodes, got {len(start.triangle)}; give one made "
            "from the same base",
        )


# ------------------------------------------------------------------ rims


@dataclass(frozen=True, eq=False)
class _Rim:
    """Edges of a surface's rims: triangle (e,), side (e,) and the nodes (e, 2 or 3) of each."""

    surface: Surface
    triangle: Ints
    side: Ints
    nodes: Ints

    def curves(self, edge: Ints, part: Floats) -> tuple[Floats, Floats, Floats]:
        """Places (..., 3) at parts of edges, first and second derivatives by the part."""
        nodes = self.surface.points[self.nodes[edge]]
        first, last = nodes[..., 0, :], nodes[..., 1, :]
        middle = nodes[..., 2, :] if self.nodes.shape[1] == 3 else (first + last) / 2
        bent, s = 2 * (first + last - 2 * middle), part[..., None]
        slope = 4 * middle - 3 * first - last
        return first + s * (slope + s * bent), slope + 2 * s * bent, 2 * bent

    def places(self, edge: Ints, part: Floats) -> tuple[Ints, Floats]:
        """Triangle (r,) and barycentric coordinates (r, 3)."""
        rows, ends = np.arange(len(edge)), np.array(EDGES)[self.side[edge]]
        barycentric = np.zeros((len(edge), 3))
        barycentric[rows, ends[:, 0]], barycentric[rows, ends[:, 1]] = 1 - part, part
        return self.triangle[edge], barycentric

    def nearest(self, points: Floats) -> tuple[Ints, Floats]:
        """Edge (r,) and the part of it (r,) that lies nearest to each point (r, 3)."""
        from scipy.spatial import cKDTree

        parts = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
        edges = np.repeat(np.arange(len(self.side)), _SAMPLES)
        samples = self.curves(edges, np.tile(parts, len(self.side)))[0]
        row = cKDTree(samples).query(points, k=2)[1].T
        edge, target = edges[row], np.broadcast_to(points, (2, *points.shape))
        part = self._refined(edge, parts[row % _SAMPLES], target)
        far = np.linalg.norm(self.curves(edge, part)[0] - target, axis=-1).argmin(axis=0)
        rows = np.arange(len(points))
        return edge[far, rows], part[far, rows]

    def _refined(self, edge: Ints, part: Floats, points: Floats) -> Floats:
        """Newton steps along the edge towards the place nearest to the point."""
        for _ in range(_STEPS):
            place, slope, bend = self.curves(edge, part)
            square = (slope**2).sum(axis=-1)
            curve = square + (bend * (place - points)).sum(axis=-1)
            down = (slope * (points - place)).sum(axis=-1)
            part = np.clip(part + down / np.maximum(curve, square / 4), 0.0, 1.0)
        return part

    def corners(self) -> Ints:
        """Nodes where the rim's direction turns by more than 45 degrees."""
        rows = np.arange(len(self.side))
        ways = np.zeros((2, len(self.surface.points), 3))
        for end in (0, 1):
            slope = self.curves(rows, np.full(len(rows), float(end)))[1]
            length = np.linalg.norm(slope, axis=1, keepdims=True)
            ways[end, self.nodes[:, end]] = slope / np.where(length > 0, length, 1.0)
        found = np.unique(self.nodes[:, :2])
        turned = np.einsum("nd,nd->n", ways[0, found], ways[1, found]) < _CORNER
        corners: Ints = found[turned]
        return corners


def _rim(surface: Surface) -> _Rim:
    _, of_triangle, counts = edges_of(surface.triangles)
    triangle, side = np.nonzero(counts[of_triangle] == 1)
    local = np.column_stack([np.array(EDGES), [3, 4, 5]])[:, : surface.order + 1]
    return _Rim(surface, triangle, side, surface.triangles[triangle[:, None], local[side]])


# ------------------------------------------------------------------ the way onto the mesh


@dataclass(frozen=True, eq=False)
class _Ground:
    """Where nodes may land: those in ``on_rim`` on the rims, ``held`` at ``corners`` (h, 3)."""

    surface: Surface
    rim: _Rim
    on_rim: Ints
    held: Ints
    corners: Floats

    def __call__(self, points: Floats) -> Landing:
        triangle, barycentric, along = self.places(points)
        landed = position(self.surface, triangle, barycentric)
        weights = shape_functions(barycentric, self.surface.order)
        nodes = self.surface.triangles[triangle]
        normals = _unit(np.einsum("ni,nid->nd", weights, self.surface.normals[nodes]))
        slopes = shape_gradients(barycentric, self.surface.order)
        along_sides = np.einsum("nid,nik->knd", self.surface.points[nodes], slopes)
        frames = tangent_frames(_unit(np.cross(*along_sides)))  # of the triangle, not smoothed
        frames[self.on_rim] = 0
        frames[self.on_rim, :, 0] = along
        frames[self.held] = 0
        return Landing(landed, normals, frames, np.ones(len(points), dtype=bool))

    def places(self, points: Floats) -> tuple[Ints, Floats, Floats]:
        """Triangle (n,) and coordinates (n, 3) of each node, the rim's direction (r, 3) there."""
        if len(self.on_rim) == 0:
            return *nearest(points, self.surface), np.empty((0, 3))
        triangle, barycentric = np.empty(len(points), dtype=np.int64), np.empty((len(points), 3))
        inner = np.ones(len(points), dtype=bool)
        inner[self.on_rim] = False
        triangle[inner], barycentric[inner] = nearest(points[inner], self.surface)
        wanted = points.copy()
        wanted[self.held] = self.corners
        edge, part = self.rim.nearest(wanted[self.on_rim])
        triangle[self.on_rim], barycentric[self.on_rim] = self.rim.places(edge, part)
        return triangle, barycentric, _unit(self.rim.curves(edge, part)[1])


def _ground(base: Surface, perturbed: Surface, start: Correspondence | None) -> _Ground:
    from scipy.optimize import linear_sum_assignment
    from scipy.spatial.distance import cdist

    rim = _rim(perturbed)
    held, corners = _rim(base).corners(), perturbed.points[rim.corners()]
    if len(held) != len(corners):
        held, corners = held[:0], corners[:0]
    near = base.points[held]
    if start is not None:
        near = _filled(start, perturbed, base.points)[held]
    _, partner = linear_sum_assignment(cdist(near, corners) ** 2)
    return _Ground(perturbed, rim, rim_nodes(base.triangles), held, corners[partner])


def _unit(vectors: Floats) -> Floats:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    unit: Floats = vectors / np.where(length > 0, length, 1.0)
    return unit


# ------------------------------------------------------------------ the start


def _unfolded(base: Surface, ground: _Ground, start: Correspondence | None) -> Floats:
    """The given start or rays, unless they turn triangles over: then the least strained start."""
    fewest, least, best = np.arange(len(base.triangles)), np.inf, None
    for number, landing in enumerate(_starts(base, ground, start)):
        turned = _turned(base, landing)
        fewest = min(fewest, turned, key=len)
        if len(turned) == 0:
            strain = distortion(base, landing.points).strain
            if strain < least:
                least, best = strain, landing.points
            if number == 0:
                break  # as wanted: no other is looked for
    if best is not None:
        return best
    raise CorrespondenceError(
        "C05",
        f"triangles: expected a start that turns none over, got {len(fewest)} at best, first "
        f"{fewest[:5].tolist()}, of rays, closest points and both smoothed; the surfaces are too "
        "far apart for their features: align them first, give a start, or compare with normal_rays",
    )


def _turned(base: Surface, landing: Landing) -> Ints:
    """Triangles that are turned over."""
    return np.flatnonzero(facing(landing.points, base.triangles, landing.normals) <= 0)


def _starts(base: Surface, ground: _Ground, start: Correspondence | None) -> Iterator[Landing]:
    """The given start or rays, closest points, both smoothed, each on the other surface."""
    other = ground.surface
    near = interpolate(closest_point(base, other), other, other.points)
    given = normal_rays(base, other) if start is None else start
    first = _filled(given, other, near)
    landings = []
    for points in (first, near):
        landings.append(ground(points))
        yield landings[-1]
    smooth = _smoothing(base, ground.held)
    for landing in landings:
        for width in _WIDTHS:
            smoothed = landing
            for _ in range(_ROUNDS):
                moves = smooth(smoothed.points - base.points, width)
                smoothed = ground(base.points + moves)
                if len(_turned(base, smoothed)) == 0:
                    break
            yield smoothed


def _filled(match: Correspondence, surface: Surface, otherwise: Floats) -> Floats:
    """Partners' places (n, 3), and others where there is none."""
    return np.where(match.found[:, None], interpolate(match, surface, surface.points), otherwise)


def _smoothing(base: Surface, held: Ints) -> Callable[[Floats, float], Floats]:
    """The way to spread moves (n, 3) over a width in edges; rims know only their own."""
    from scipy.sparse import coo_array, diags_array, eye_array
    from scipy.sparse.linalg import splu

    size = len(base.points)
    edges, _, counts = edges_of(linear_triangles(base.triangles))
    rim = np.zeros(size, dtype=bool)
    rim[edges[counts == 1]] = True
    links = np.concatenate([edges, edges[:, ::-1]])
    outer = np.tile(counts == 1, 2)
    links = links[(~rim[links[:, 0]] | outer) & ~np.isin(links[:, 0], held)]
    around = coo_array((np.ones(len(links)), links.T), shape=(size, size)).tocsr()
    degree = around.sum(axis=1)

    def smooth(moves: Floats, width: float) -> Floats:
        away = diags_array((degree > 0).astype(float)) - around / np.maximum(degree, 1)[:, None]
        spread: Floats = splu((eye_array(size) + width**2 * away).tocsc()).solve(moves)
        return spread

    return smooth
