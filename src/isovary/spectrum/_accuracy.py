"""What the error of a few eigenpairs does to the heat kernel signature."""

from __future__ import annotations

import numpy as np

from ..geometry import Floats
from ._threads import each, pieces

UNIT = 4 * np.pi
"""Mean spacing of the eigenvalues at unit area (Weyl): their natural unit."""

SMALLEST_GAP = 1e-7
"""Relative: two eigenvalues that are closer are one to the solver."""


_COOLED = 30.0
"""At the time _COOLED / lambda_1 all heat has left through a Dirichlet boundary."""


def times_resolved(values: Floats) -> Floats:
    """At most ten times from the smallest one that the pairs resolve, each four times the last.

    They end where a Dirichlet boundary has let out all heat.
    """
    smallest = 4 * np.log(10) / max(values[-1], UNIT)
    times = smallest * 4.0 ** np.arange(10)
    warm: Floats = times[values.min() * times <= _COOLED]
    return warm


def signature_error(values: Floats, directions: Floats) -> float:
    """Largest relative error of the heat kernel signature, over all times, that one expects.

    A unit eigenvector that points wrong by d_i changes its square by 2 d_i, so

    2 sum_i exp(-lambda_i t) d_i / sum_i exp(-lambda_i t)

    bounds the mean error over the surface, as if no two pairs cancelled.
    """
    # relative to the first pair's weight, which is 1 on a surface
    weights = np.exp(-np.outer(times_resolved(values), values - values.min()))
    return float((2 * weights @ np.minimum(directions, 1.0) / weights.sum(axis=1)).max())


def signature(values: Floats, vectors: Floats, times: Floats) -> Floats:
    """Heat kernel signature (n, T) on several threads."""
    weights = np.exp(-np.outer(values, times))
    return np.concatenate(each(lambda rows: vectors[rows] ** 2 @ weights, pieces(len(vectors))))


def first_gap(values: Floats, errors: Floats, count: int) -> int:
    """Number of pairs before the first gap behind ``count`` of them; 0 if none is sure.

    A gap is one if it is wider than rounding and than the errors of the values beside it.
    """
    gaps = np.diff(values[count - 1 :])
    sure = gaps > 2 * (errors[count - 1 : -1] + errors[count:])
    sure &= gaps > SMALLEST_GAP * max(values[-1], UNIT)
    return count + int(np.argmax(sure)) if sure.any() else 0
