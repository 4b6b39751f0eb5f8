"""How much an isosurface bends, from the field's gradient and Hessian."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..geometry import Floats
from ..scalar_field import ScalarField


def principal_curvatures(points: ArrayLike, field: ScalarField) -> Floats:
    """Principal curvatures of the field's isosurface through each point, the smaller first.

    Eigenvalues of ``-P H P / |g|`` in the tangent plane, with g and H the field's gradient and
    Hessian and P the projection onto the plane; positive where the surface bends away from
    smaller field values, as a ball of high density does.

    Parameters
    ----------
    points : array (n, 3)
    field : ScalarField

    Returns
    -------
    array (n, 2)
        1 / length.

    Examples
    --------
    A cylinder of radius 2:

    >>> rod = ScalarField.from_function(
    ...     lambda p: -p[..., 0]**2 - p[..., 1]**2,
    ...     bounds=((-3, -3, -3), (3, 3, 3)), shape=(13, 13, 13))
    >>> (principal_curvatures([[0, 2, 1]], rod) + 0).round(9).tolist()
    [[0.0, 0.5]]
    """
    gradient, hessian = field.gradient(points), field.hessian(points)
    slope = np.linalg.norm(gradient, axis=1)
    normal = gradient / slope[:, None]
    flat = np.eye(3) - normal[:, :, None] * normal[:, None, :]
    shape = -np.einsum("nij,njk,nkl->nil", flat, hessian, flat) / slope[:, None, None]
    mean = np.einsum("nii->n", shape) / 2
    square = np.einsum("nij,nij->n", shape, shape)
    half = np.sqrt(np.maximum(square / 2 - mean**2, 0.0))
    return np.stack([mean - half, mean + half], axis=1)


def section_curvatures(points: Floats, field: ScalarField, planes: Floats) -> Floats:
    """Curvature (n,), without a sign, of the curves in which planes cut the isosurface.

    ``abs(t H t) / abs(g')`` with the unit tangent t and the part g' of the gradient in the plane.

    Parameters
    ----------
    points : array (n, 3)
    field : ScalarField
    planes : array (n, 3)
        Unit normals of the planes through the points.
    """
    gradient, hessian = field.gradient(points), field.hessian(points)
    along = np.cross(gradient, planes)  # as long as the part of the gradient in the plane
    slope = np.maximum(np.linalg.norm(along, axis=1), np.finfo(float).tiny)
    tangent = along / slope[:, None]
    curvature: Floats = np.abs(np.einsum("ni,nij,nj->n", tangent, hessian, tangent)) / slope
    return curvature
