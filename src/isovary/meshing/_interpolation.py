"""Which interpolation suits a field: its values or their logarithm? Decided by measurement."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..geometry import Floats
from ..scalar_field import ScalarField


def interpolation_errors(field: ScalarField, isovalue: float) -> dict[str, float]:
    """How far splines through every other sample misplace the isosurface.

    The samples left out, in cells that the isosurface crosses, are predicted
    from the others; the error is divided by the gradient to become a length.
    At the full resolution a smooth field errs about 16 times less.

    Parameters
    ----------
    field : ScalarField
    isovalue : float

    Returns
    -------
    dict
        Root-mean-square error by interpolation, ``"plain"`` and, for positive
        fields, ``"logarithmic"``; length. Empty if every other sample is no
        field: fewer than seven along an axis, or a constant.

    Notes
    -----
    Cost: two splines of an eighth of the samples.
    """
    field.check_isovalue(isovalue)
    if min(field.values.shape) < 7:
        return {}
    points, values = _held_out(field, isovalue)
    half = field.values[::2, ::2, ::2]
    if len(points) == 0 or half.min() == half.max():
        return {}
    errors = {}
    for name, logarithmic in (("plain", False), ("logarithmic", True)):
        if logarithmic and not (field.values.min() > 0 and isovalue > 0):
            continue
        coarse = ScalarField(half, 2 * field.spacing, field.origin, field.name, logarithmic)
        level = np.log(values) if logarithmic else values
        predicted, gradient = coarse.level_set(points, 1.0 if logarithmic else 0.0)
        slope = np.maximum(np.linalg.norm(gradient, axis=1), coarse.rounding)
        errors[name] = float(np.sqrt(np.mean(((predicted - level) / slope) ** 2)))
    return errors


def better_interpolation(field: ScalarField, isovalue: float) -> ScalarField:
    """The field with the interpolation, plain or logarithmic, that misplaces the isosurface less.

    Parameters
    ----------
    field : ScalarField
    isovalue : float

    Returns
    -------
    ScalarField
        The same samples; ``logarithmic`` tells the choice.

    See Also
    --------
    interpolation_errors : the measurement behind the choice.

    Examples
    --------
    An exponential decay is a straight line in the logarithm:

    >>> decay = ScalarField.from_function(
    ...     lambda p: np.exp(-p.sum(axis=-1)), bounds=((0, 0, 0), (9, 9, 9)), shape=(10, 10, 10))
    >>> better_interpolation(decay, 0.01).logarithmic
    True
    """
    return replace(field, logarithmic=suits_logarithm(field, isovalue))


def suits_logarithm(field: ScalarField, isovalue: float) -> bool:
    """Whether the spline of the logarithm misplaces the isosurface less than that of the values."""
    errors = interpolation_errors(field, isovalue)
    return bool(errors.get("logarithmic", np.inf) < errors.get("plain", 0.0))


def _held_out(field: ScalarField, isovalue: float) -> tuple[Floats, Floats]:
    """Positions and values of samples left out of the half grid, next to the isosurface."""
    last = [count - 1 - (count - 1) % 2 for count in field.values.shape]
    inner = field.values[: last[0] + 1, : last[1] + 1, : last[2] + 1]
    above = inner > isovalue
    near = np.zeros_like(above)
    for axis in range(3):
        flips = np.diff(above.astype(np.int8), axis=axis) != 0
        for side in (slice(None, -1), slice(1, None)):
            window = [slice(None)] * 3
            window[axis] = side
            near[tuple(window)] |= flips
    near[::2, ::2, ::2] = False
    index = np.argwhere(near)
    return field.origin + index * field.spacing, inner[near]
