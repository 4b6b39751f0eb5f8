"""What the error of a few eigenpairs does to the heat kernel signature."""

from __future__ import annotations

import numpy as np

from ..geometry import Floats

UNIT = 4 * np.pi
"""Mean spacing of the eigenvalues at unit area (Weyl): their natural unit."""

SMALLEST_GAP = 1e-7
"""Relative: two eigenvalues that are closer are one to the solver."""


def signature_error(values: Floats, directions: Floats) -> float:
    """Largest relative error of the heat kernel signature, over all times, that one expects.

    A unit eigenvector that points wrong by d_i changes its square by 2 d_i, so

    2 sum_i exp(-lambda_i t) d_i / sum_i exp(-lambda_i t)

    bounds the mean error over the surface, as if no two pairs cancelled.
    """
    weights = _weights(values)
    return float((2 * weights @ np.minimum(directions, 1.0) / weights.sum(axis=1)).max())


def signature_change(before: tuple[Floats, Floats], after: tuple[Floats, Floats]) -> float:
    """Root mean square over the nodes of the signature's change, relative to the heat trace.

    Both problems have unit area; the largest over the times of the first.
    """
    times = _times(before[0])
    first, second = (
        vectors**2 @ np.exp(-np.outer(values, times)) for values, vectors in (before, after)
    )
    change = np.sqrt(((second - first) ** 2).mean(axis=0))
    return float((change / _weights(before[0]).sum(axis=1)).max())


def _times(values: Floats) -> Floats:
    """Ten times from the smallest one that the pairs resolve, each four times the one before."""
    smallest = 4 * np.log(10) / max(values[-1], UNIT)
    result: Floats = smallest * 4.0 ** np.arange(10)
    return result


def _weights(values: Floats) -> Floats:
    """exp(-lambda t), times and pairs; relative to the first pair's, which is 1 on a surface."""
    result: Floats = np.exp(-np.outer(_times(values), values - values[0]))
    return result
