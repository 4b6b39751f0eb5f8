"""Groups by how much alone: bins of the rows' norms."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..geometry import Floats
from ..records import Clusters
from ..row_distances import Metric, distances
from ._k_medians import middles_of
from ._rows import checked_rows


def norm_bins(
    rows: Floats,
    count: int,
    *,
    metric: Metric = "l1",
    weights: ArrayLike | None = None,
    rng: int | np.random.Generator = 0,
) -> Clusters:
    """Groups of rows whose norms lie in the same one of equally wide bins from 0 to the largest.

    bin = floor(count norm / largest norm); the largest itself falls into the last bin.

    The simplest way, and a look at how much changed. It does not see *what* changed: rows
    of different kinds but equal norms share a group, and one large row empties the bins
    between. For kinds of change take :func:`isovary.k_medians`.

    Parameters
    ----------
    rows : array (n, T)
        For example a change. Rows with NaN are left out and labelled -1.
    count : int
        Number of bins.
    metric : str
        Norm: "l1" for the sum of the absolute values, "l2" for the root of the sum of squares.
    weights : array (n,), optional
        Positive weights of the rows in their bins' medians. By default all weigh alike.
    rng : int or Generator
        Of no consequence: here so that every method is called alike.

    Returns
    -------
    Clusters
        ``centers`` are the medians of the bins' rows. Empty bins are dropped, for a group
        without rows has no center: there may be fewer groups than ``count``. Groups are
        numbered by the norm of their center, as everywhere; that is the order of the bins
        unless rows of different kinds share one, whose median may be small.

    Raises
    ------
    ClusterError
        K02 if there are fewer distinct rows than bins.
    ArgumentError
        A02 for a count below 1, an unknown metric or weights that are not positive, A03 for rows
        that are not (n, T) or weights that are not (n,).

    Notes
    -----
    Nothing is left to chance, and the order of the rows does not matter. Cost: n T operations
    for the norms, and the medians.

    References
    ----------
    Thesis, section 4.1.6, the first of its groupings.

    Examples
    --------
    Bins [0, 3), [3, 6) and [6, 9]; no norm lies in the middle one:

    >>> groups = norm_bins(np.array([[0.0, 1.0], [-1.0, 1.0], [9.0, 0.0], [5.0, -3.0]]), 3)
    >>> groups.labels.tolist(), groups.centers.tolist()
    ([0, 0, 1, 1], [[-0.5, 1.0], [7.0, -1.5]])
    """
    known = checked_rows(rows, count, weights=weights, metric=metric)
    norms = distances(known.data, np.zeros((1, known.data.shape[1])), metric)[:, 0]
    inner = norms.max() * np.arange(1, count) / count
    kept, labels = np.unique(np.searchsorted(inner, norms, side="right"), return_inverse=True)
    centers = middles_of(known.data, known.weights, "l1")(labels, len(kept))
    return known.clusters(labels, centers)
