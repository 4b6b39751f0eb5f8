"""How much memory an eigensolve will need, told before it starts."""

from __future__ import annotations

import numpy as np

from ..errors import RunError

_VECTORS = 2.9  # Lanczos vectors a pair, with the results beside them
_BLOCKS = 12 * 32  # vectors that the blocks at work add
_FILL = 3.0  # factor entries per unknown and log2(unknowns), for a triangle mesh's 7 a row
_BYTES = 85  # a factor entry: SuperLU's two factors, their copies, the panels


def predicted_memory(size: int, entries: int, count: int) -> float:
    """Bytes that ``count`` pairs of ``size`` unknowns with so many matrix entries will need."""
    vectors = 8.0 * size * (_VECTORS * count + _BLOCKS)
    factor = _FILL * size * np.log2(size) * (entries / (7 * size)) * _BYTES
    return float(vectors + factor)


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
