"""The closest point of the perturbed surface."""

from __future__ import annotations

import numpy as np

from ..geometry import Floats, Ints, linear_triangles
from ..records import Correspondence, Surface
from ._locator import (
    build_locator,
    flat_barycentric,
    position,
    step_within,
    tangents_at,
    to_parent,
)

_STEPS = 4


def closest_point(base: Surface, perturbed: Surface) -> Correspondence:
    """Each base node matched to the closest point of the perturbed surface.

    Searched on flat triangles, then refined on the curved element by
    Gauss-Newton steps. Every node finds a partner, however far: look at
    ``distance``, and prefer a carried mesh wherever a field is at hand.

    Parameters
    ----------
    base, perturbed : Surface

    Returns
    -------
    Correspondence
        ``distance`` is signed by the side of the base normal.

    Notes
    -----
    Cost: 20 microseconds a node.

    Examples
    --------
    >>> triangle = Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> lifted = Surface(triangle.points + [0, 0, 0.5], triangle.triangles)
    >>> closest_point(triangle, lifted).distance.tolist()
    [0.5, 0.5, 0.5]
    """
    piece = _nearest_pieces(base.points, perturbed)
    flat = linear_triangles(perturbed.triangles)[piece]
    local = flat_barycentric(perturbed.points[flat], base.points)
    triangle, barycentric = to_parent(perturbed, piece, local)
    if perturbed.order == 2:
        for _ in range(_STEPS):
            offset = base.points - position(perturbed, triangle, barycentric)
            jacobian = tangents_at(perturbed, triangle, barycentric)
            metric = np.einsum("ndk,ndl->nkl", jacobian, jacobian)
            right = np.einsum("ndk,nd->nk", jacobian, offset)
            move = np.linalg.solve(metric, right[..., None])[..., 0]
            barycentric = step_within(barycentric, move)
    offset = position(perturbed, triangle, barycentric) - base.points
    side = np.where(np.einsum("nd,nd->n", offset, base.normals) >= 0, 1.0, -1.0)
    distance = side * np.linalg.norm(offset, axis=1)
    return Correspondence(triangle, barycentric, distance, np.ones(len(triangle), dtype=np.int64))


def _nearest_pieces(points: Floats, surface: Surface) -> Ints:
    from vtkmodules.vtkCommonCore import reference
    from vtkmodules.vtkCommonDataModel import vtkGenericCell

    locator = build_locator(surface)
    cell, number, part, square = vtkGenericCell(), reference(0), reference(0), reference(0.0)
    found = np.empty(len(points), dtype=np.int64)
    place = [0.0, 0.0, 0.0]
    for row, point in enumerate(points):
        locator.FindClosestPoint(point.tolist(), place, cell, number, part, square)  # type: ignore[call-overload]
        found[row] = int(number)
    return found
