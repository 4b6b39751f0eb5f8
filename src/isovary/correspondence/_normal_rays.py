"""The thesis's correspondence: rays along the base normals onto the perturbed triangles."""

from __future__ import annotations

import numpy as np

from ..errors import ArgumentError
from ..geometry import Bools, Floats, Ints, linear_triangles
from ..records import Correspondence, Surface
from ._elements import (
    full,
    nearest_places,
    neighbours,
    position,
    stepped_across,
    tangents_at,
    to_parent,
)
from ._locator import pieces_on_lines

_STEPS = 6
_CROSSINGS = 4  # triangles that a hit may be moved on by, from the flat one to the curved one
_GRAZING = 0.05  # cosine between normal and ray below which a hit is none
_ON_RIM = 1e-9  # barycentric coordinate by which a hit may lie beyond an edge
_SAME = 1e-7  # of the diagonal: distance between hits of one place
_OUTSIDE = 1e-10  # barycentric coordinate


def normal_rays(base: Surface, perturbed: Surface, *, reach: float | None = None) -> Correspondence:
    """Each base node matched to the nearest hit of its normal, either way, on the other surface.

    A hit counts only where the two normals agree: the product of the ray's direction and the
    triangle's normal exceeds 0.05, so that surfaces that face the other way and those that are
    grazed, within 3 degrees, are passed through. Neighbouring triangles decide by the same
    numbers on which side of their edge a ray passes, so that none slips between them; a
    hit on an edge or corner counts once. On curved elements the hit is refined by
    Newton steps, across edges where need be.

    Parameters
    ----------
    base, perturbed : Surface
    reach : float, optional
        Longest distance searched; default a quarter of the diagonal of the
        base's bounding box.

    Returns
    -------
    Correspondence
        ``triangle`` is -1 where nothing was hit: no data, never the nearest by stealth.
        ``hits`` counts all that agree within reach: where it exceeds 1, several sheets
        competed, and the nearest one won.

    Raises
    ------
    ArgumentError
        A02 for a reach that is not positive.

    Notes
    -----
    Where a curved rim lies inside its flat triangle, the partner is the rim's place
    nearest to the flat hit.
    Cost: 30 microseconds a node.

    References
    ----------
    Thesis, section 4.1.4 and figure 4.4. Edges: S. Woop, C. Benthin, I. Wald, *Watertight
    ray/triangle intersection*, J. Computer Graphics Techniques 2 (2013) 65-82.

    Examples
    --------
    >>> triangle = Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> lower = Surface(triangle.points * 2 - [0.5, 0.5, 0.1], triangle.triangles)
    >>> normal_rays(triangle, lower, reach=1.0).distance.round(12).tolist()
    [-0.1, -0.1, -0.1]
    """
    diagonal = float(np.linalg.norm(np.ptp(base.points, axis=0)))
    reach = diagonal / 4 if reach is None else reach
    if not reach > 0:
        raise ArgumentError("A02", f"reach: expected a positive length, got {reach}")
    node, piece, distance, local = _all_hits(base, perturbed, reach)
    nearest, hits = _nearest_hits(len(base.points), node, distance, _SAME * diagonal)
    found = nearest >= 0
    chosen = nearest[found]
    triangle, barycentric = to_parent(perturbed, piece[chosen], local[chosen])
    signed = distance[chosen]
    if perturbed.order == 2:
        points, normals = base.points[found], base.normals[found]
        triangle, barycentric = _refined(points, normals, perturbed, triangle, barycentric, signed)
        offset = position(perturbed, triangle, barycentric) - points
        signed = np.einsum("nd,nd->n", offset, normals)
    return _spread(found, triangle, barycentric, signed, hits)


def _all_hits(base: Surface, perturbed: Surface, reach: float) -> tuple[Ints, Ints, Floats, Floats]:
    """Every hit that counts: node, flat piece, signed distance, barycentric coordinates."""
    way = reach * base.normals
    node, piece = pieces_on_lines(base.points - way, base.points + way, perturbed, 1e-6 * reach)
    corners = perturbed.points[linear_triangles(perturbed.triangles)[piece]]
    direction = base.normals[node]
    distance, local, hit = _on_pieces(corners, base.points[node], direction)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(across, axis=1)
    hit &= np.einsum("nd,nd->n", across, direction) > _GRAZING * size
    return node[hit], piece[hit], distance[hit], local[hit]


def _on_pieces(corners: Floats, points: Floats, direction: Floats) -> tuple[Floats, Floats, Bools]:
    """Signed distance and barycentric coordinates of lines on triangles, and whether they meet.

    Seen along the line, each edge passes it on one side. Rounding may call that 0, which
    is a hit, but never the other side, and the triangle beyond gets the same number negated.
    A little more, for rims, is a hit, too.
    """
    main = np.abs(direction).argmax(axis=1)
    axes = (main[:, None] + [1, 2, 0]) % 3
    x, y, z = np.moveaxis(
        np.take_along_axis(corners - points[:, None], axes[:, None, :], axis=2), 2, 0
    )
    lean = np.take_along_axis(direction, axes, axis=1)
    length = np.where(lean[:, 2] != 0, lean[:, 2], 1.0)[:, None]
    x = x - (lean[:, :1] / length) * z
    y = y - (lean[:, 1:2] / length) * z
    parts = np.column_stack(
        [x[:, j] * y[:, k] - y[:, j] * x[:, k] for j, k in ((1, 2), (2, 0), (0, 1))]
    )
    total = parts.sum(axis=1)
    local = parts / np.where(total != 0, total, 1.0)[:, None]
    meets = (local >= -_ON_RIM).all(axis=1) & (total != 0) & (lean[:, 2] != 0)
    distance: Floats = (local * z).sum(axis=1) / length[:, 0]
    return distance, full(local[:, 1:]), meets


def _nearest_hits(count: int, node: Ints, distance: Floats, same: float) -> tuple[Ints, Ints]:
    """Row of the nearest hit of each node (-1 for none), and the number of distinct hits."""
    nearest = np.full(count, -1, dtype=np.int64)
    order = np.lexsort((np.abs(distance), node))
    first = np.ones(len(order), dtype=bool)
    first[1:] = node[order][1:] != node[order][:-1]
    nearest[node[order][first]] = order[first]
    by_place = np.lexsort((distance, node))
    distinct = np.ones(len(by_place), dtype=bool)
    distinct[1:] = (np.diff(node[by_place]) > 0) | (np.diff(distance[by_place]) > same)
    return nearest, np.bincount(node[by_place][distinct], minlength=count)


def _refined(
    points: Floats,
    normals: Floats,
    perturbed: Surface,
    triangle: Ints,
    barycentric: Floats,
    distance: Floats,
) -> tuple[Ints, Floats]:
    """Hits of the curved elements: the triangle of the flat hit, or one near to it."""
    across = neighbours(perturbed)
    place, end = barycentric.copy(), triangle.copy()
    lost, active = np.ones(len(points), dtype=bool), np.arange(len(points))
    start, there = barycentric, triangle
    for _ in range(_CROSSINGS):
        reached = _newton(
            points[active], normals[active], perturbed, there, start, distance[active]
        )
        inside = (reached >= -_OUTSIDE).all(axis=1)
        hit = active[inside]
        place[hit], end[hit], lost[hit] = full(reached[inside, 1:]), there[inside], False
        there, start = stepped_across(perturbed, across, there, reached, reached.argmin(axis=1))
        left = ~inside & (there >= 0)
        active, there, start = active[left], there[left], start[left]
        if len(active) == 0:
            break
    flat = points[lost] + distance[lost, None] * normals[lost]
    end[lost], place[lost] = nearest_places(perturbed, flat, triangle[lost], barycentric[lost])
    return end, place


def _newton(
    points: Floats,
    normals: Floats,
    surface: Surface,
    triangle: Ints,
    barycentric: Floats,
    distance: Floats,
) -> Floats:
    """Roots of position(barycentric) = point + distance * normal, also outside the triangle."""
    barycentric, distance = barycentric.copy(), distance.copy()
    for _ in range(_STEPS):
        jacobian = tangents_at(surface, triangle, barycentric)
        matrix = np.concatenate([jacobian, -normals[..., None]], axis=-1)
        flat = np.abs(np.linalg.det(matrix)) <= 1e-12 * np.abs(matrix).max(axis=(1, 2)) ** 2
        matrix[flat] = np.eye(3)
        offset = points + distance[:, None] * normals - position(surface, triangle, barycentric)
        offset[flat] = 0.0
        step = np.linalg.solve(matrix, offset[..., None])[..., 0]
        step[:, :2] = np.clip(step[:, :2], -1.0, 1.0)
        barycentric[:, 1:] += step[:, :2]
        barycentric[:, 0] = 1 - barycentric[:, 1] - barycentric[:, 2]
        distance += step[:, 2]
    return barycentric


def _spread(
    found: Bools, triangle: Ints, barycentric: Floats, distance: Floats, hits: Ints
) -> Correspondence:
    """Rows of the nodes that have a partner put among those that have none."""
    triangles = np.full(len(found), -1, dtype=np.int64)
    places = np.full((len(found), 3), np.nan)
    distances = np.full(len(found), np.nan)
    triangles[found], places[found], distances[found] = triangle, barycentric, distance
    return Correspondence(triangles, places, distances, hits)
