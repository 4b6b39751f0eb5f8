"""Points onto an isosurface by Newton steps along the gradient."""

from __future__ import annotations

import numpy as np

from .errors import MeshError
from .geometry import Bools, Floats
from .level_sets import LevelSet

_STEPS = 40


def project(
    points: Floats, field: LevelSet, isovalue: float, *, held: Bools | None = None
) -> Floats:
    """Points moved onto the isosurface by Newton steps along the field's gradient.

    ``x <- x - g grad g / |grad g|^2`` with g the field's level set function, each
    step at most one grid cell.

    Parameters
    ----------
    points : array (n, 3)
        Within a cell or two of the isosurface.
    field : LevelSet
        A ScalarField, a moved or a blended one.
    isovalue : float
    held : array (n, 3) of bool, optional
        Coordinates that do not change. Default: those on a face of the box.

    Returns
    -------
    array (n, 3)
        On the isosurface to rounding.

    Raises
    ------
    MeshError
        M12 if a point does not arrive: the gradient vanishes there, or the
        surface leaves the box.

    Notes
    -----
    Cost: 3 to 6 evaluations of the spline, 30 ms for 10 000 points.

    Examples
    --------
    >>> from isovary.scalar_field import ScalarField
    >>> ball = ScalarField.from_function(
    ...     lambda p: -(p**2).sum(axis=-1), bounds=((-2, -2, -2), (2, 2, 2)), shape=(9, 9, 9))
    >>> project(np.array([[1.2, 0.0, 0.0]]), ball, -1.0).round(12)[0, 0].tolist()
    1.0
    """
    moved, arrived = newton(points, field, isovalue, held=held)
    if not arrived.all():
        lost = np.flatnonzero(~arrived)
        raise MeshError(
            "M12",
            f"points: expected all to reach the isosurface {isovalue:.6g} within {_STEPS} steps, "
            f"got {len(lost)} that did not, the first near {moved[lost[0]].round(6).tolist()}; "
            "the gradient, or its part in a face of the box, may vanish there: choose another "
            "isovalue, a finer or smoother field or another box",
        )
    return moved


def newton(
    points: Floats, field: LevelSet, isovalue: float, *, held: Bools | None = None
) -> tuple[Floats, Bools]:
    """What :func:`project` does, and a mask (n,) of the points that arrived."""
    low, high = field.bounds
    longest = float(field.spacing.max())
    rounding = 1e-13 * max(float(np.abs(points).max()), longest)
    moved = np.clip(points, low, high)
    fixed = (moved == low) | (moved == high) if held is None else held
    active = np.arange(len(moved))
    for _ in range(_STEPS):
        level, gradient = field.level_set(moved[active], isovalue)
        gradient = np.where(fixed[active], 0.0, gradient)
        square = (gradient**2).sum(axis=1)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            step = -(level / square)[:, None] * gradient
        length = np.linalg.norm(step, axis=1, keepdims=True)
        step *= longest / np.maximum(length, longest)
        moved[active] = np.clip(moved[active] + np.nan_to_num(step), low, high)
        here = rounding + field.rounding / np.sqrt(np.maximum(square, np.finfo(float).tiny))
        active = active[~(length[:, 0] <= here)]
        if len(active) == 0:
            break
    arrived = np.ones(len(moved), dtype=bool)
    if len(active):
        level, gradient = field.level_set(moved[active], isovalue)
        off = np.abs(level) / np.maximum(np.linalg.norm(gradient, axis=1), np.finfo(float).tiny)
        arrived[active] = off < 1e-8 * longest
    return moved, arrived


def outward_normals(points: Floats, field: LevelSet, isovalue: float) -> Floats:
    """Unit normals (n, 3) towards smaller field values at points of an isosurface."""
    _, gradient = field.level_set(points, isovalue)
    normals: Floats = -gradient / np.linalg.norm(gradient, axis=1, keepdims=True)
    return normals
