"""Points of single triangles, flat or curved: where they are, the nearest, the next triangle."""

from __future__ import annotations

import numpy as np

from ..geometry import (
    EDGES,
    LINEAR_PIECES,
    Bools,
    Floats,
    Ints,
    edges_of,
    node_places,
    shape_functions,
    shape_gradients,
)
from ..records import Surface

_STEPS = 20
_HALVINGS = 6
_STILL = 1e-14  # step in local coordinates below which a search has ended
_NEAR_EDGE = 0.03  # barycentric coordinate
_CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
_SECOND = np.array(
    [
        [[4, 4], [4, 4]],
        [[4, 0], [0, 0]],
        [[0, 0], [0, 4]],
        [[-8, -4], [-4, 0]],
        [[0, 4], [4, 0]],
        [[0, -4], [-4, -8]],
    ],
    dtype=float,
)  # second derivatives of the six shape functions by the local coordinates (b1, b2)


def to_parent(surface: Surface, piece: Ints, barycentric: Floats) -> tuple[Ints, Floats]:
    """Triangle and barycentric coordinates of a place given in a flat piece."""
    if surface.order == 1:
        return piece, barycentric
    nodes = np.array(LINEAR_PIECES)[piece % 4]
    places = node_places(2)[nodes]
    return piece // 4, np.einsum("nk,nkb->nb", barycentric, places)


def position(surface: Surface, triangle: Ints, barycentric: Floats) -> Floats:
    """Points (n, 3) on the curved elements."""
    weights = shape_functions(barycentric, surface.order)
    points: Floats = np.einsum("ni,nid->nd", weights, surface.points[surface.triangles[triangle]])
    return points


def tangents_at(surface: Surface, triangle: Ints, barycentric: Floats) -> Floats:
    """Tangents (n, 3, 2) of the curved elements."""
    gradients = shape_gradients(barycentric, surface.order)
    tangents: Floats = np.einsum(
        "nik,nid->ndk", gradients, surface.points[surface.triangles[triangle]]
    )
    return tangents


def full(local: Floats) -> Floats:
    """Barycentric coordinates (n, 3) of local ones (b1, b2), kept in [0, 1]."""
    barycentric = np.clip(np.column_stack([1 - local.sum(axis=1), local]), 0.0, None)
    kept: Floats = barycentric / barycentric.sum(axis=1, keepdims=True)
    return kept


def neighbours(surface: Surface) -> Ints:
    """The triangle (m, 3) across the edges 01, 12 and 20 of each, -1 at a rim."""
    of_triangle = edges_of(surface.triangles)[1]
    sides = np.argsort(of_triangle.ravel(), kind="stable")
    edge = of_triangle.ravel()[sides]
    across = np.full(len(sides), -1, dtype=np.int64)
    same = np.flatnonzero(edge[1:] == edge[:-1])
    across[sides[same]] = sides[same + 1] // 3
    across[sides[same + 1]] = sides[same] // 3
    return across.reshape(-1, 3)


def stepped_across(
    surface: Surface, across: Ints, triangle: Ints, barycentric: Floats, corner: Ints
) -> tuple[Ints, Floats]:
    """The next triangle over the edge opposite to a corner, -1 at a rim, and the same place in it.

    The place is taken on that edge, the other coordinates in proportion.
    """
    place = np.clip(barycentric, 0.0, None)
    place[np.arange(len(place)), corner] = 0.0
    place /= place.sum(axis=1, keepdims=True)
    other = across[triangle, (corner + 1) % 3]
    same = surface.corners[triangle][:, :, None] == surface.corners[other][:, None, :]
    return other, np.einsum("ni,nij->nj", place, same)


def nearest_places(
    surface: Surface, points: Floats, triangle: Ints, barycentric: Floats
) -> tuple[Ints, Floats]:
    """The nearest place to each point, from a start near to it: triangle and coordinates.

    Where the nearest place of the start's triangle lies near an edge, the triangle across is
    tried: where two meet at an angle, each may hold a place nearer than all around it.
    """
    barycentric, square = _nearest_within(surface, points, triangle, barycentric)
    if surface.order == 1:
        return triangle, barycentric
    across = neighbours(surface)
    triangle = triangle.copy()
    for corner in (0, 1, 2) * 2:
        rows = np.flatnonzero(barycentric[:, corner] < _NEAR_EDGE)
        other, start = stepped_across(
            surface, across, triangle[rows], barycentric[rows], np.full(len(rows), corner)
        )
        rows, other, start = rows[other >= 0], other[other >= 0], start[other >= 0]
        place, there = _nearest_within(surface, points[rows], other, start)
        nearer = there < square[rows]
        rows = rows[nearer]
        triangle[rows], barycentric[rows] = other[nearer], place[nearer]
        square[rows] = there[nearer]
    return triangle, barycentric


def _nearest_within(
    surface: Surface, points: Floats, triangle: Ints, barycentric: Floats
) -> tuple[Floats, Floats]:
    """Nearest places within given triangles by Newton steps, and the squared distances."""
    local = barycentric[:, 1:].copy()
    square = _square(surface, points, triangle, local)
    active = np.arange(len(points))
    for _ in range(1 if surface.order == 1 else _STEPS):
        here, there, start = points[active], triangle[active], local[active]
        metric, slope = _model(surface, here, there, start)
        step = _lowest(start, metric, slope) - start
        for _ in range(_HALVINGS):
            reached = _square(surface, here, there, start + step)
            worse = reached > square[active]
            step[worse] /= 2
            if not worse.any():
                break
        better = reached < square[active]
        local[active[better]] += step[better]
        square[active[better]] = reached[better]
        active = active[better & (np.abs(step).max(axis=1) > _STILL)]
        if len(active) == 0:
            break
    return full(local), square


def _square(surface: Surface, points: Floats, triangle: Ints, local: Floats) -> Floats:
    offset = position(surface, triangle, full(local)) - points
    square: Floats = np.einsum("nd,nd->n", offset, offset)
    return square


def _model(
    surface: Surface, points: Floats, triangle: Ints, local: Floats
) -> tuple[Floats, Floats]:
    """Half the squared distance to second order: matrix (n, 2, 2) and downhill slope (n, 2).

    Where the true second derivatives have no minimum, those of the tangent plane stand in.
    """
    place = full(local)
    offset = points - position(surface, triangle, place)
    jacobian = tangents_at(surface, triangle, place)
    metric = np.einsum("ndk,ndl->nkl", jacobian, jacobian)
    slope: Floats = np.einsum("ndk,nd->nk", jacobian, offset)
    if surface.order == 1:
        return metric, slope
    nodes = surface.points[surface.triangles[triangle]]
    exact = metric - np.einsum("ikl,nid,nd->nkl", _SECOND, nodes, offset, optimize=True)
    sound = _determinant(exact) > 0.01 * _determinant(metric)
    sound &= exact[:, 0, 0] + exact[:, 1, 1] > 0
    return np.where(sound[:, None, None], exact, metric), slope


def _determinant(matrix: Floats) -> Floats:
    value: Floats = matrix[:, 0, 0] * matrix[:, 1, 1] - matrix[:, 0, 1] ** 2
    return value


def _lowest(local: Floats, metric: Floats, slope: Floats) -> Floats:
    """Where in the triangle a quadratic function is lowest: inside, or on one of the edges."""
    best, inside = _free_minimum(local, metric, slope)
    rows = np.flatnonzero(~inside)
    local, metric, slope = local[rows], metric[rows], slope[rows]
    lowest = np.full(len(rows), np.inf)
    for i, j in EDGES:
        along, start = _CORNERS[j] - _CORNERS[i], _CORNERS[i] - local
        push = metric @ along
        down, curve = slope @ along - np.einsum("nk,nk->n", start, push), push @ along
        part = np.where(curve > 0, np.clip(down / np.where(curve > 0, curve, 1.0), 0.0, 1.0), 0.0)
        move = start + part[:, None] * along
        height = np.einsum("nk,nkl,nl->n", move, metric, move) / 2
        height -= np.einsum("nk,nk->n", slope, move)
        lower = height < lowest
        lowest[lower] = height[lower]
        best[rows[lower]] = (local + move)[lower]
    return best


def _free_minimum(local: Floats, metric: Floats, slope: Floats) -> tuple[Floats, Bools]:
    """The lowest point of a quadratic function in the plane, and whether it is in the triangle."""
    determinant = _determinant(metric)
    sound = determinant > 1e-14 * metric[:, 0, 0] * metric[:, 1, 1]
    (a, b), (_, c) = metric.transpose(1, 2, 0)
    u, v = slope.T
    move = np.column_stack([c * u - b * v, a * v - b * u])
    target = local + move / np.where(sound, determinant, 1.0)[:, None]
    inside = sound & (target >= 0).all(axis=1) & (target.sum(axis=1) <= 1)
    return target, inside
