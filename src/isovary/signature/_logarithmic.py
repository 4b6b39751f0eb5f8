"""Logarithmic samples: their step, and the grid that the scale-invariant signature needs."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ArgumentError
from ..geometry import Floats

DECADES_BELOW = 3
"""The logarithmic derivative of the HKS is there proportional to t, but for 1e-5."""

DECADES_ABOVE = 1
"""It has decayed to exp(-92) there, to exp(-23) on a surface of twice the size."""

_EQUAL = 1e-3  # of a step: times rounded to four digits still pass


def log_step(name: str, samples: ArrayLike) -> float:
    """Step of the samples' logarithm; ArgumentError A02 unless it is one positive number."""
    values = np.asarray(samples, dtype=float)
    if values.ndim == 1 and len(values) > 1 and np.isfinite(values).all() and (values > 0).all():
        steps = np.diff(np.log(values))
        if steps.min() > 0 and np.ptp(steps) <= _EQUAL * steps.max():
            return float(steps.mean())
    raise ArgumentError(
        "A02",
        f"{name}: expected at least 2 positive ascending values with equal steps of their "
        f"logarithm, got {np.array2string(values, precision=4, threshold=6)}; use numpy.geomspace",
    )


def extended(times: ArrayLike) -> tuple[Floats, float]:
    """Logarithmic times continued at both ends, and the step of their logarithm."""
    step = log_step("times", times)
    decade = np.log(10) / step
    # what is a whole number but for rounding stays it
    below, above = (int(np.ceil(n * decade - 1e-6)) for n in (DECADES_BELOW, DECADES_ABOVE))
    values = np.asarray(times, dtype=float)
    grid: Floats = values[0] * np.exp(step * np.arange(-below, len(values) + above))
    return grid, step
