"""Histograms of the norms of the differences of all pairs of HKS vectors."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..geometry import Floats

BINS, DRAWN = 3000, 60
"""Of a histogram: fine ones for distances between two, and those drawn."""

_BLOCK = 2500
_LOST = 1e-4  # of the rows' spread, that the reduction to few components leaves out
_JUDGED, _DEEP, _HIGH = 30, 0.1, 0.02


def pair_histogram(rows: Floats, top: float, weights: Floats | None = None) -> Floats:
    """Shares (BINS,) of all pairs of rows (n, T) by the L2 norm of their difference, 0 to top.

    Larger norms count in the last bin. The rows are turned to their principal axes, of which
    the first few suffice, and multiplied in single precision, block by block.
    """
    few = _components(rows / top * BINS)
    if weights is not None:
        weights = weights.astype(np.float32)
    counts = np.zeros(BINS)
    for one, other in _blocks(len(few)):
        bins = np.minimum(_norms(few[one], few[other]), BINS - 1).astype(np.int32).ravel()
        both = None if weights is None else np.outer(weights[one], weights[other]).ravel()
        counts += np.bincount(bins, both, minlength=BINS) * (1 if one == other else 2)
    if weights is None:
        counts[0] -= len(few)  # of each row with itself
    shares: Floats = counts / counts.sum()
    return shares


def _blocks(size: int) -> Iterator[tuple[slice, slice]]:
    parts = [slice(first, first + _BLOCK) for first in range(0, size, _BLOCK)]
    for place, one in enumerate(parts):
        for other in parts[place:]:
            yield one, other


def _components(rows: Floats) -> Floats:
    """The rows from their mean, along the principal axes that hold all but a 1e-4 of the spread."""
    rows = rows - rows.mean(axis=0)
    values, axes = np.linalg.eigh(rows.T @ rows)
    left = np.cumsum(np.maximum(values, 0))
    few: Floats = (rows @ axes[:, left > _LOST**2 * left[-1]]).astype(np.float32)
    return few


def _norms(one: Floats, other: Floats) -> Floats:
    squares = one @ (-2 * other.T)
    squares += (one**2).sum(axis=1)[:, None]
    squares += (other**2).sum(axis=1)
    np.maximum(squares, 0, out=squares)
    norms: Floats = np.sqrt(squares, out=squares)
    return norms


def transport(one: Floats, other: Floats, top: float) -> float:
    """W1 distance of two histograms: how far the pairs must be shifted on average."""
    return float(np.abs(np.cumsum(one - other)).sum() * top / BINS)


def drawn(shares: Floats, bins: int = DRAWN) -> Floats:
    """The histogram in fewer bins."""
    coarse: Floats = shares.reshape(bins, -1).sum(axis=1)
    return coarse


def modes(shares: Floats) -> int:
    """Maxima of the histogram in 30 bins.

    One counts if it reaches a fiftieth of the highest, and if the valley towards a higher one is
    at least a tenth of it deep: less is the noise of counting.
    """
    from scipy.signal import find_peaks

    heights = np.pad(drawn(shares, _JUDGED), 1)
    peaks, found = find_peaks(heights, height=_HIGH * heights.max(), prominence=0)
    return int((found["prominences"] >= _DEEP * heights[peaks]).sum())


def roughness(shares: Floats) -> float:
    """Share of the pairs that a smooth outline of the drawn histogram would put elsewhere.

    Half the sum of the distances of each bin to the mean of its two neighbours, over all but
    the first bins, where the histogram is steep.
    """
    inside = drawn(shares)[2:]
    return float(np.abs(inside[1:-1] - (inside[:-2] + inside[2:]) / 2).sum() / 2)
