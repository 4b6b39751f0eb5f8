"""How much memory an eigensolve will need, told before it starts."""

from __future__ import annotations

import numpy as np

from ..errors import RunError

_VECTORS = 5.0  # Lanczos vectors a pair, and two copies of the result
_BLOCKS = 12 * 32  # vectors that the blocks at work add
_SQUARES = 75  # times count^2: the projected matrix and its eigenvectors
_FILL = 3.0  # factor entries per unknown and log2(unknowns), for a triangle mesh's 7 a row
_BYTES = 85  # a factor entry: SuperLU's two factors, their copies, the panels


def predicted_memory(size: int, entries: int, count: int) -> float:
    """Bytes that ``count`` pairs of ``size`` unknowns with so many matrix entries will need."""
    vectors = size * (_VECTORS * count + _BLOCKS) + _SQUARES * count**2
    factor = _FILL * size * np.log2(size) * (entries / (7 * size)) * _BYTES
    return float(8 * vectors + factor)


def check_memory(size: int, entries: int, count: int) -> None:
    """Stop with W08 if the machine's free memory will not do."""
    import psutil

    needed, free = predicted_memory(size, entries, count), psutil.virtual_memory().available
    if needed > free:
        raise RunError(
            "W08",
            f"memory: expected at least {needed / 1e9:.1f} GB for {count} eigenpairs of {size} "
            f"unknowns, got {free / 1e9:.1f} GB free; use a coarser mesh or fewer pairs",
        )
