"""Fields between fields: two mixed, or the members of a sweep, as a family of one parameter."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from .errors import ArgumentError
from .scalar_field import ScalarField

Family = Callable[[float], tuple[ScalarField, float]]
"""Parameter -> field and isovalue."""


def blended(first: ScalarField, second: ScalarField) -> Callable[[float], ScalarField]:
    """Two fields on one grid, mixed: 0 is the first, 1 the second.

    F_t = (1 - t) F_0 + t F_1, or log F_t = (1 - t) log F_0 + t log F_1 for two logarithmic
    fields: linear in what the spline interpolates.

    Parameters
    ----------
    first, second : ScalarField
        Samples at the same places, both logarithmic or neither.

    Returns
    -------
    callable
        Takes the part t of the second, 0 to 1, and gives the field; ArgumentError A02 beyond.

    Raises
    ------
    ArgumentError
        A03 for different grids or kinds of interpolation.

    Examples
    --------
    >>> def ramp(slope):
    ...     return ScalarField.from_function(
    ...         lambda p: slope * p[..., 0], bounds=((0, 0, 0), (3, 3, 3)), shape=(4, 4, 4))
    >>> round(float(blended(ramp(1.0), ramp(3.0))(0.25).value([2, 1, 1])), 9)
    3.0
    """
    _check_alike(first, second)
    ends = first.values, second.values
    if first.logarithmic:
        ends = np.log(ends[0]), np.log(ends[1])

    def mixed(part: float) -> ScalarField:
        if not 0 <= part <= 1:
            raise ArgumentError("A02", f"part: expected a number in [0, 1], got {part}")
        if part in (0, 1):
            return second if part else first
        mean = (1 - part) * ends[0] + part * ends[1]
        return replace(first, values=np.exp(mean) if first.logarithmic else mean)

    return mixed


def _check_alike(first: ScalarField, second: ScalarField) -> None:
    same = first.values.shape == second.values.shape and all(
        np.allclose(a, b, rtol=0, atol=1e-6 * first.spacing.min())
        for a, b in zip(first.bounds, second.bounds, strict=True)
    )
    if not same:
        raise ArgumentError(
            "A03",
            f"first, second: expected samples at the same places, got {first.values.shape} from "
            f"{first.bounds[0]} to {first.bounds[1]} and {second.values.shape} from "
            f"{second.bounds[0]} to {second.bounds[1]}; sample both on one grid",
        )
    if first.logarithmic != second.logarithmic:
        raise ArgumentError(
            "A03",
            "first, second: expected both logarithmic or neither, got "
            f"{first.logarithmic} and {second.logarithmic}; make them alike",
        )


def sweep_family(parameters: ArrayLike, fields: Sequence[ScalarField], isovalue: float) -> Family:
    """The members of a sweep as a family, blended between neighbours.

    Parameters
    ----------
    parameters : array (k,)
        Of the members, ascending.
    fields : sequence of ScalarField
        On one grid; see :func:`blended`.
    isovalue : float

    Returns
    -------
    callable
        Takes a parameter in the range of the members and gives the field, which at a member's
        parameter is the member, and the isovalue; ArgumentError A02 beyond.

    Raises
    ------
    ArgumentError
        A02 for parameters that do not ascend, A03 for less than two, for another number of
        fields and for fields that are not alike.

    Notes
    -----
    Between members the family is an interpolation, second-order accurate in their distance.

    Examples
    --------
    >>> ramps = [ScalarField.from_function(
    ...     lambda p, a=a: a * p[..., 0], bounds=((0, 0, 0), (3, 3, 3)), shape=(4, 4, 4))
    ...     for a in (1.0, 2.0, 4.0)]
    >>> family = sweep_family([10, 20, 30], ramps, 0.5)
    >>> scalar, isovalue = family(25)
    >>> round(float(scalar.value([1, 1, 1])), 9), isovalue
    (3.0, 0.5)
    """
    places = np.asarray(parameters, dtype=float)
    if places.ndim != 1 or len(places) < 2 or len(places) != len(fields):
        raise ArgumentError(
            "A03",
            "parameters, fields: expected as many parameters as fields, at least two, got "
            f"{places.shape} and {len(fields)}",
        )
    if not (np.diff(places) > 0).all():
        raise ArgumentError("A02", f"parameters: expected ascending, got {places.tolist()}")
    pieces = [blended(a, b) for a, b in pairwise(fields)]

    def family(parameter: float) -> tuple[ScalarField, float]:
        if not places[0] <= parameter <= places[-1]:
            raise ArgumentError(
                "A02",
                f"parameter: expected within [{places[0]:g}, {places[-1]:g}], got {parameter}",
            )
        k = min(int(np.searchsorted(places, parameter, side="right")) - 1, len(pieces) - 1)
        return pieces[k](float((parameter - places[k]) / (places[k + 1] - places[k]))), isovalue

    return family
