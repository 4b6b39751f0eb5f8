"""How far rows are from each other, and how much each weighs."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from .errors import ArgumentError
from .geometry import Floats

Metric = Literal["l1", "l2"]
"""Sum of the absolute differences of two rows, or the root of the sum of their squares."""

_CDIST = {"l1": "cityblock", "l2": "euclidean"}


def check_metric(metric: str) -> None:
    """Raise ArgumentError A02 unless it is l1 or l2."""
    if metric not in get_args(Metric):
        raise ArgumentError("A02", f"metric: expected l1 or l2, got {metric}")


def distances(data: Floats, others: Floats, metric: Metric = "l1") -> Floats:
    """Distances (m, k) of rows (m, T) to others (k, T)."""
    from scipy.spatial.distance import cdist

    table: Floats = cdist(data, others, _CDIST[metric])
    return table


def checked_weights(weights: ArrayLike | None, count: int) -> Floats:
    """Positive weights (count,), all 1 if none are given; ArgumentError A02 or A03 otherwise."""
    if weights is None:
        return np.ones(count)
    heavy = np.asarray(weights, dtype=float)
    if heavy.shape != (count,):
        raise ArgumentError("A03", f"weights: expected shape ({count},), got {heavy.shape}")
    if not (np.isfinite(heavy) & (heavy > 0)).all():
        raise ArgumentError(
            "A02", "weights: expected positive numbers, got others; give areas, for example"
        )
    return heavy
