"""One mesh on two isosurfaces: each node moved along its normal."""

from __future__ import annotations

import numpy as np

from ..errors import ArgumentError, CorrespondenceError, MeshError
from ..geometry import (
    EDGES,
    Bools,
    Floats,
    Ints,
    linear_triangles,
    own_places,
)
from ..level_sets import LevelSet
from ..projection import outward_normals, project
from ..records import Correspondence, Surface
from ..sliding import check_facing

_NEWTON_STEPS = 60
_LOST_LIMIT = 0.5
_FOLLOWING = 4.0  # how far a rim's slide reaches, in its own length


def carry(
    surface: Surface, field: LevelSet, isovalue: float, *, reach: float | None = None
) -> tuple[Surface, Correspondence]:
    """The base mesh carried along its normals onto an isosurface of another field.

    Node x goes to x + s n, where s is the root nearest to 0 of
    field(x + s n) = isovalue at which the field falls along n, as it does on
    the base; both directions are searched. Connectivity stays, so the
    correspondence is known and the discretization errors of the two
    signatures cancel. Nodes on a face of the field's box move within it, along
    the part of their normal that lies in the face; what this moves them along the
    surface the nodes nearby follow, less with distance, before their own rays.

    Parameters
    ----------
    surface : Surface
        The base; its normals must point to smaller field values.
    field : LevelSet
        The perturbed field: a ScalarField, a moved or a blended one.
    isovalue : float
        In the field's unit.
    reach : float, optional
        Longest distance searched, to a third of a grid cell; default a quarter
        of the diagonal of the base's bounding box.

    Returns
    -------
    carried : Surface
        Same triangles, points on the perturbed isosurface, the field's normals.
        Nodes without a root are filled in from their neighbours so that the
        mesh stays whole.
    correspondence : Correspondence
        Each node matched to itself; ``triangle`` is -1 for nodes that were
        filled in: no data, to be shown as unknown. ``hits`` counts the roots
        met up to the nearest one: 2 where both directions hold one at about
        the same distance.

    Raises
    ------
    CorrespondenceError
        C02 if more than half of the nodes find no root within reach, or a lost
        node cannot be filled in; C05 if triangles are turned over: the
        surfaces are farther apart than their features are large.
    ArgumentError
        A02 for a reach that is not positive.

    Notes
    -----
    Roots are bracketed in steps of a third of a grid cell and refined by Newton
    steps kept inside the bracket; a pair of roots closer than a step is missed.
    Cost: about 0.1 s for 4 000 nodes and moves of a grid cell.

    References
    ----------
    Thesis, section 4.1.4 (rays onto triangles); here the ray meets the field itself.

    Examples
    --------
    A unit sphere in the field of a sphere of radius 1.1:

    >>> from isovary.shapes import icosphere
    >>> from isovary.scalar_field import ScalarField
    >>> ball = ScalarField.from_function(
    ...     lambda p: -(p**2).sum(axis=-1), bounds=((-2, -2, -2), (2, 2, 2)), shape=(9, 9, 9))
    >>> carried, match = carry(icosphere(2), ball, -1.21)
    >>> match.distance.min().round(9).tolist(), match.distance.max().round(9).tolist()
    (0.1, 0.1)
    """
    diagonal = float(np.linalg.norm(np.ptp(surface.points, axis=0)))
    reach = diagonal / 4 if reach is None else reach
    if not reach > 0:
        raise ArgumentError("A02", f"reach: expected a positive length, got {reach}")
    rays = _directions(surface, field)
    starts = surface.points + _rim_followed(surface, rays, field, isovalue, reach)
    distance, hits = _nearest_roots(starts, rays, field, isovalue, reach)
    found = np.isfinite(distance)
    _check_lost(found, reach)
    points = starts + distance[:, None] * rays
    if not found.all():
        points = _filled(surface, points, found, field, isovalue)
    carried = Surface(points, surface.triangles, outward_normals(points, field, isovalue))
    check_facing(carried.points, carried.triangles, carried.normals)
    triangle, places = own_places(surface.triangles)
    triangle, places = np.where(found, triangle, -1), np.where(found[:, None], places, np.nan)
    return carried, Correspondence(triangle, places, distance, hits)


def faces_held(points: Floats, field: LevelSet) -> Bools:
    """Coordinates (n, 3) that put a point on a face of the field's box."""
    low, high = field.bounds
    edge = 1e-9 * (high - low)
    held: Bools = (np.abs(points - low) < edge) | (np.abs(points - high) < edge)
    return held


def _directions(surface: Surface, field: LevelSet) -> Floats:
    """Unit normals, without the part that would leave the faces of the box a node lies on."""
    within = np.where(faces_held(surface.points, field), 0.0, surface.normals)
    length = np.linalg.norm(within, axis=1, keepdims=True)
    rays: Floats = np.where(length > 0.1, within / np.maximum(length, 0.1), np.nan)
    return rays


def _rim_followed(
    surface: Surface, rays: Floats, field: LevelSet, isovalue: float, reach: float
) -> Floats:
    """Tangential moves (n, 3) by which nodes follow a rim that slides in its face; 0 without rim.

    Screened diffusion of the rim's own, over a length of four times its largest.
    """
    rim = np.flatnonzero(faces_held(surface.points, field).any(axis=1))
    moves = np.zeros_like(surface.points)
    if len(rim) == 0:
        return moves
    distance, _ = _nearest_roots(surface.points[rim], rays[rim], field, isovalue, reach)
    rim, distance = rim[np.isfinite(distance)], distance[np.isfinite(distance)]
    along = distance[:, None] * rays[rim]
    normals = surface.normals[rim]
    along -= np.einsum("nd,nd->n", along, normals)[:, None] * normals
    length = _FOLLOWING * float(np.linalg.norm(along, axis=1).max(initial=0.0))
    if length == 0:
        return moves
    moves = _diffused(surface, rim, along, length)
    moves -= np.einsum("nd,nd->n", moves, surface.normals)[:, None] * surface.normals
    moves[rim] = 0  # their own rays carry them
    return moves


def _diffused(surface: Surface, fixed: Ints, values: Floats, length: float) -> Floats:
    """Values (n, 3) that are given at some nodes and fall off with a length from there."""
    from scipy.sparse import coo_array, csgraph, diags_array
    from scipy.sparse.linalg import spsolve

    pieces = linear_triangles(surface.triangles)
    i, j = np.concatenate([pieces[:, list(pair)] for pair in EDGES]).T
    edge = float(np.median(np.linalg.norm(surface.points[i] - surface.points[j], axis=1)))
    size = len(surface.points)
    links = coo_array((np.ones(2 * len(i)), (np.r_[i, j], np.r_[j, i])), shape=(size, size))
    operator = csgraph.laplacian(links.tocsr().sign()) + diags_array(
        np.full(size, (edge / length) ** 2)
    )
    held = np.zeros(size)
    held[fixed] = 1
    right = np.zeros((size, 3))
    right[fixed] = values
    matrix = diags_array(1 - held) @ operator + diags_array(held)
    spread: Floats = np.asarray(spsolve(matrix.tocsc(), right))
    return spread


def _nearest_roots(
    points: Floats, rays: Floats, field: LevelSet, isovalue: float, reach: float
) -> tuple[Floats, Ints]:
    """Signed distance of the nearest root of each ray, NaN if none, and the roots met.

    A node already on the isosurface to rounding stays: distance exactly 0.
    """
    step = float(field.spacing.min()) / 3
    start, gradient = field.level_set(points, isovalue)
    slope = np.linalg.norm(gradient, axis=1)
    size = max(float(np.abs(points).max()), step)
    at_home = np.abs(start) <= 1e-13 * size * slope + field.rounding
    at_home &= np.einsum("nd,nd->n", gradient, rays) < 0
    distance = np.where(at_home, 0.0, np.nan)
    hits = at_home.astype(np.int64)
    before = {1: start.copy(), -1: start.copy()}
    for count in range(int(np.ceil(reach / step))):
        lost = np.flatnonzero(np.isnan(distance))
        if len(lost) == 0:
            break
        for sign in (1, -1):
            far = sign * (count + 1) * step
            value, _ = field.level_set(points[lost] + far * rays[lost], isovalue)
            near_value = before[sign][lost]
            falls = (near_value > 0) & (value <= 0) if sign > 0 else (near_value <= 0) & (value > 0)
            before[sign][lost] = value
            crossed = lost[falls]
            low, high = sorted((sign * count * step, far))
            root = _roots(points[crossed], rays[crossed], field, isovalue, low, high)
            nearer = ~(np.abs(distance[crossed]) <= np.abs(root))
            distance[crossed[nearer]] = root[nearer]
            hits[crossed] += 1
    return distance, hits


def _roots(
    points: Floats, rays: Floats, field: LevelSet, isovalue: float, start: float, stop: float
) -> Floats:
    """Newton steps along the rays, replaced by bisection where they leave the bracket."""
    low, high = np.full(len(points), start), np.full(len(points), stop)
    rounding = 1e-14 * max(float(np.abs(points).max(initial=0.0)), abs(start), abs(stop))
    root: Floats = np.asarray((low + high) / 2)
    active = np.arange(len(points))
    for _ in range(_NEWTON_STEPS):
        if len(active) == 0:
            break
        place = points[active] + root[active, None] * rays[active]
        value, gradient = field.level_set(place, isovalue)
        slope = np.einsum("nd,nd->n", gradient, rays[active])
        inside = value > 0
        low[active] = np.where(inside, root[active], low[active])
        high[active] = np.where(inside, high[active], root[active])
        with np.errstate(divide="ignore", invalid="ignore"):
            newton = root[active] - value / slope
        kept = (newton > low[active]) & (newton < high[active])
        target = np.where(kept, newton, (low[active] + high[active]) / 2)
        change = np.abs(target - root[active])
        root[active] = target
        active = active[change > rounding]
    return root


def _check_lost(found: Bools, reach: float) -> None:
    lost = ~found
    if lost.mean() > _LOST_LIMIT:
        raise CorrespondenceError(
            "C02",
            f"nodes: expected at most {_LOST_LIMIT:.0%} without a partner, got {lost.mean():.0%} "
            f"({lost.sum()}, first {np.flatnonzero(lost)[:5].tolist()}) within a distance of "
            f"{reach:.4g}; the surfaces are too far apart: go in smaller steps of the parameter",
        )


def _filled(
    surface: Surface, points: Floats, found: Bools, field: LevelSet, isovalue: float
) -> Floats:
    """Lost nodes put near the mean move of their neighbours, then onto the isosurface."""
    move = np.where(found[:, None], points - surface.points, 0.0)
    known = found.copy()
    pieces = linear_triangles(surface.triangles)
    links = np.concatenate([pieces[:, list(pair)] for pair in EDGES])
    links = np.concatenate([links, links[:, ::-1]])
    while not known.all():
        useful = links[~known[links[:, 0]] & known[links[:, 1]]]
        if len(useful) == 0:
            break  # a whole component without a partner stays where it is
        total, count = np.zeros_like(move), np.zeros(len(move))
        np.add.at(total, useful[:, 0], move[useful[:, 1]])
        np.add.at(count, useful[:, 0], 1)
        reached = count > 0
        move[reached] = total[reached] / count[reached, None]
        known |= reached
    start = surface.points + move
    lost = ~found
    filled = np.where(lost[:, None], start, points)
    try:
        filled[lost] = project(start[lost], field, isovalue)
    except MeshError as error:
        raise CorrespondenceError(
            "C02",
            f"nodes: expected a partner, or a place beside the neighbours, got {lost.sum()} "
            f"without, first {np.flatnonzero(lost)[:5].tolist()}, that could not be "
            "filled in; go in smaller steps of the parameter, or compare with normal_rays",
        ) from error
    return filled
