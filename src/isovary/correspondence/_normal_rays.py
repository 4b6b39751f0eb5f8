"""The thesis's correspondence: rays along the base normals onto the perturbed triangles."""

from __future__ import annotations

import numpy as np

from ..errors import ArgumentError
from ..geometry import Bools, Floats, Ints, linear_triangles
from ..records import Correspondence, Surface
from ._locator import build_locator, position, step_within, tangents_at, to_parent

_STEPS = 4


def normal_rays(base: Surface, perturbed: Surface, *, reach: float | None = None) -> Correspondence:
    """Each base node matched to the nearest hit of its normal, either way, on the other surface.

    A hit counts only where the two normals agree (their product is positive);
    a hit on an edge or corner shared by triangles counts once, and the search
    tolerance closes the cracks between them. On curved elements the hit is
    refined by Newton steps.

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

    Raises
    ------
    ArgumentError
        A02 for a reach that is not positive.

    Notes
    -----
    Cost: 30 microseconds a node.

    References
    ----------
    Thesis, section 4.1.4 and figure 4.4.

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
    node, piece = _all_hits(base, perturbed, reach)
    distance, local, agrees = _on_pieces(base, perturbed, node, piece)
    node, piece, distance, local = node[agrees], piece[agrees], distance[agrees], local[agrees]
    nearest, hits = _nearest_hits(len(base.points), node, distance, 1e-9 * diagonal)
    found = nearest >= 0
    chosen = nearest[found]
    triangle, barycentric = to_parent(perturbed, piece[chosen], local[chosen])
    signed = distance[chosen]
    if perturbed.order == 2:
        barycentric, signed = _refined(base, perturbed, found, triangle, barycentric, signed)
    return _spread(found, triangle, barycentric, signed, hits)


def _all_hits(base: Surface, perturbed: Surface, reach: float) -> tuple[Ints, Ints]:
    """Node and flat piece of every crossing of a normal line with the perturbed surface."""
    from vtkmodules.vtkCommonCore import vtkIdList, vtkPoints

    locator = build_locator(perturbed)
    tolerance = 1e-6 * reach
    starts = base.points - reach * base.normals
    ends = base.points + reach * base.normals
    cells, places = vtkIdList(), vtkPoints()
    nodes, pieces = [], []
    for row in range(len(starts)):
        locator.IntersectWithLine(starts[row], ends[row], tolerance, places, cells)
        count = cells.GetNumberOfIds()
        nodes += [row] * count
        pieces += [cells.GetId(i) for i in range(count)]
        cells.Reset()
        places.Reset()
    return np.array(nodes, dtype=np.int64), np.array(pieces, dtype=np.int64)


def _on_pieces(
    base: Surface, perturbed: Surface, node: Ints, piece: Ints
) -> tuple[Floats, Floats, Bools]:
    """Signed distance, barycentric coordinates and agreement of normals of each hit."""
    corners = perturbed.points[linear_triangles(perturbed.triangles)[piece]]
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    direction = base.normals[node]
    cosine = np.einsum("nd,nd->n", np.cross(first, second), direction)
    agrees = cosine > 0
    matrix = np.stack([first, second, -direction], axis=-1)
    matrix[~agrees] = np.eye(3)  # grazing or opposed: dropped by the caller
    offset = base.points[node] - corners[:, 0]
    solution: Floats = np.asarray(np.linalg.solve(matrix, offset[..., None])[..., 0], dtype=float)
    origin = np.tile([1.0, 0.0, 0.0], (len(node), 1))
    local: Floats = step_within(origin, solution[:, :2])
    return solution[:, 2], local, agrees


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
    base: Surface,
    perturbed: Surface,
    found: Bools,
    triangle: Ints,
    barycentric: Floats,
    distance: Floats,
) -> tuple[Floats, Floats]:
    """Newton steps for position(barycentric) = point + distance * normal."""
    points, normals = base.points[found], base.normals[found]
    for _ in range(_STEPS):
        jacobian = tangents_at(perturbed, triangle, barycentric)
        matrix = np.concatenate([jacobian, -normals[..., None]], axis=-1)
        offset = points + distance[:, None] * normals - position(perturbed, triangle, barycentric)
        step = np.linalg.solve(matrix, offset[..., None])[..., 0]
        barycentric = step_within(barycentric, step[:, :2])
        offset = position(perturbed, triangle, barycentric) - points
        distance = np.einsum("nd,nd->n", offset, normals)
    return barycentric, distance


def _spread(
    found: Bools, triangle: Ints, barycentric: Floats, distance: Floats, hits: Ints
) -> Correspondence:
    """Rows of the nodes that have a partner put among those that have none."""
    triangles = np.full(len(found), -1, dtype=np.int64)
    places = np.full((len(found), 3), np.nan)
    distances = np.full(len(found), np.nan)
    triangles[found], places[found], distances[found] = triangle, barycentric, distance
    return Correspondence(triangles, places, distances, hits)
