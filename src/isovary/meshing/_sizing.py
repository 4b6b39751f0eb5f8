"""Sizing functions: the edge length that a mesh should have at each point of an isosurface."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ArgumentError
from ..geometry import Floats
from ..scalar_field import ScalarField
from ._curvature import principal_curvatures

Sizing = Callable[[Floats, ScalarField, float], Floats]
"""Points (n, 3) on an isosurface, field, isovalue -> wanted edge lengths (n,)."""


def as_sizing(sizing: Sizing | float) -> Sizing:
    """A sizing function as it is, a length as the same everywhere; A03 for anything else."""
    if callable(sizing):
        return sizing
    if isinstance(sizing, (int, float)) and not isinstance(sizing, bool):
        return partial(uniform_sizing, length=float(sizing))
    raise ArgumentError(
        "A03",
        "sizing: expected an edge length or a function of points, field and isovalue, such as "
        f"curvature_sizing, got {type(sizing).__name__}",
    )


def uniform_sizing(
    points: ArrayLike, field: ScalarField, isovalue: float, *, length: float = 1.0
) -> Floats:
    """The same edge length everywhere.

    Parameters
    ----------
    points : array (n, 3)
    field : ScalarField
    isovalue : float
    length : float
        Of every edge; length unit.

    Returns
    -------
    array (n,)

    See Also
    --------
    nonuniform_sizing, curvature_sizing

    Examples
    --------
    >>> box = ScalarField.from_function(
    ...     lambda p: p[..., 0], bounds=((0, 0, 0), (3, 3, 3)), shape=(4, 4, 4))
    >>> uniform_sizing([[0, 1, 1], [1, 1, 1]], box, 1.0, length=0.1).tolist()
    [0.1, 0.1]
    """
    return np.full(len(np.asarray(points)), float(length))


def nonuniform_sizing(
    points: ArrayLike,
    field: ScalarField,
    isovalue: float,
    *,
    length: float = 1.0,
    ratio: float = 4.0,
    axis: int = 0,
) -> Floats:
    """Edges that grow across the box, blind to the surface's shape: the thesis's Figure 4.13.

    ``length * ratio ** s`` with s from 0 to 1 along one axis of the field's box. A mesh to
    compare with, not one to use.

    Parameters
    ----------
    points : array (n, 3)
    field : ScalarField
    isovalue : float
    length : float
        At the low side of the box; length unit.
    ratio : float
        Length at the high side over that at the low side.
    axis : int
        0, 1 or 2: along x, y or z.

    Returns
    -------
    array (n,)

    References
    ----------
    Thesis, section 4.2.5 and Figure 4.13.

    Examples
    --------
    >>> box = ScalarField.from_function(
    ...     lambda p: p[..., 0], bounds=((0, 0, 0), (3, 3, 3)), shape=(4, 4, 4))
    >>> nonuniform_sizing([[0, 1, 1], [1.5, 1, 1], [3, 1, 1]], box, 1.0).tolist()
    [1.0, 2.0, 4.0]
    """
    if axis not in (0, 1, 2) or not ratio > 0:
        raise ArgumentError(
            "A02", f"axis, ratio: expected 0, 1 or 2 and a positive number, got {axis}, {ratio}"
        )
    low, high = field.bounds
    along = (np.asarray(points, dtype=float)[:, axis] - low[axis]) / (high[axis] - low[axis])
    lengths: Floats = length * ratio**along
    return lengths


def curvature_sizing(
    points: ArrayLike,
    field: ScalarField,
    isovalue: float,
    *,
    angle: float = 0.5,
    shortest: float | None = None,
    longest: float | None = None,
) -> Floats:
    """Edges that span the same angle wherever the surface bends: short where it curves much.

    ``angle / sqrt((k1^2 + k2^2) / 2)`` with the principal curvatures k1 and k2, clipped to
    [shortest, longest].

    Parameters
    ----------
    points : array (n, 3)
    field : ScalarField
    isovalue : float
    angle : float
        Between the normals at the ends of an edge; radians.
    shortest : float, optional
        Default: half the smallest distance of samples, below which the field has no detail.
    longest : float, optional
        Default: a quarter of the box's diagonal.

    Returns
    -------
    array (n,)

    References
    ----------
    Thesis, sections 4.1.1 and 4.2.1.

    Examples
    --------
    A sphere of radius 2 bends by one radian over a length of 2:

    >>> ball = ScalarField.from_function(
    ...     lambda p: -(p**2).sum(axis=-1), bounds=((-3, -3, -3), (3, 3, 3)), shape=(13, 13, 13))
    >>> curvature_sizing([[2, 0, 0]], ball, -4.0, angle=0.25).round(9).tolist()
    [0.5]
    """
    low, high = field.bounds
    shortest = float(field.spacing.min()) / 2 if shortest is None else shortest
    longest = float(np.linalg.norm(high - low)) / 4 if longest is None else longest
    if not angle > 0:
        raise ArgumentError("A02", f"angle: expected a positive number, got {angle}")
    if not 0 < shortest <= longest:
        raise ArgumentError(
            "A02", f"shortest, longest: expected 0 < shortest <= longest, got {shortest}, {longest}"
        )
    bend = np.sqrt((principal_curvatures(points, field) ** 2).mean(axis=1))
    with np.errstate(divide="ignore"):
        lengths: Floats = np.clip(angle / bend, shortest, longest)
    return lengths
