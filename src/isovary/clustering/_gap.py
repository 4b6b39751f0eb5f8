"""The gap: how much narrower the groups of rows are than those of rows without structure."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ..geometry import Floats, Ints
from ..row_distances import Metric
from ._k_medians import middles_of


def gaps(
    data: Floats,
    runs: Sequence[Sequence[Ints]],
    group: Callable[[Floats, int], Ints],
    counts: Sequence[int],
    metric: Metric,
    references: int,
    generator: np.random.Generator,
) -> tuple[Floats, Floats]:
    """The gap (c + 1,) of one group and of each count, and its standard error.

    ``runs`` has for each count labels (s,) of the rows (s, T), those below 0 left out;
    ``group`` takes other rows and a count to labels.
    """
    whole = [np.minimum(labels, 0) for labels in runs[0]]
    ours = [[_of_part(data, labels, metric) for labels in one] for one in (whole, *runs)]
    size = int((runs[0][0] >= 0).sum())
    theirs = []
    for _ in range(references):
        rows = unstructured(data, size, generator)
        found = [np.zeros(size, dtype=np.int64), *(group(rows, count) for count in counts)]
        theirs.append([log_spread(rows, labels, metric) for labels in found])
    return compared(np.array(ours).T, np.array(theirs))


def compared(ours: Floats, theirs: Floats) -> tuple[Floats, Floats]:
    """Gap and error (c,) of the log spreads of runs (r, c) below those of references (b, c).

    s = sd sqrt(1 + 1/b), with the standard deviation of the b references.
    """
    with np.errstate(invalid="ignore"):  # without any spread in both there is no gap to know
        gap: Floats = theirs.mean(axis=0) - ours.mean(axis=0)
        error: Floats = theirs.std(axis=0) * np.sqrt(1 + 1 / len(theirs))
    return gap, error


def log_spread(data: Floats, labels: Ints, metric: Metric) -> float:
    """Logarithm of the rows' summed distance to their group's median; "l2": squared, mean."""
    names, own = np.unique(labels, return_inverse=True)
    middles = middles_of(data, np.ones(len(data)), metric)(own, len(names))
    away = data - middles[own]
    spread = np.abs(away).sum() if metric == "l1" else (away**2).sum()
    with np.errstate(divide="ignore"):
        return float(np.log(spread))


def unstructured(data: Floats, size: int, generator: np.random.Generator) -> Floats:
    """Rows (size, T) drawn uniformly from the box around rows (s, T) along their principal axes."""
    middle = data.mean(axis=0)
    axes = np.linalg.svd(data - middle, full_matrices=False)[2]
    places = (data - middle) @ axes.T
    drawn = generator.uniform(places.min(axis=0), places.max(axis=0), (size, len(axes)))
    rows: Floats = drawn @ axes + middle
    return rows


def _of_part(data: Floats, labels: Ints, metric: Metric) -> float:
    inside = labels >= 0
    return log_spread(data[inside], labels[inside], metric)
