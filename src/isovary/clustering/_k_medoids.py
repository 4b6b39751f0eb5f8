"""k-medoids: groups around true rows, by swaps that are exact on the matrix of distances."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ArgumentError
from ..geometry import Bools, Floats, Ints
from ..records import Clusters
from ..row_distances import Metric, distances
from ._k_medians import middles_of, seeds, with_seeds
from ._rows import Rows, checked_rows

_PASSES = 20
_CANDIDATES = 50


def k_medoids(
    rows: Floats,
    count: int,
    *,
    metric: Metric = "l1",
    weights: ArrayLike | None = None,
    rng: int | np.random.Generator = 0,
    restarts: int = 5,
    samples: int = 3000,
) -> Clusters:
    """Groups around rows of the data, the medoids, minimizing the summed distance to them.

    cost = sum_i w_i min_j d(row_i, medoid_j), least over sets of ``count`` rows.

    Partitioning around medoids: while exchanging one medoid for another row lowers the
    cost, do it at once. What is left cannot be improved by one exchange.
    The center of a group is a curve that occurs, with its noise; for a smooth typical one
    take :func:`isovary.k_medians`, which is faster besides.

    Parameters
    ----------
    rows : array (n, T)
        For example a change. Rows with NaN are left out and labelled -1.
    count : int
        Number of groups.
    metric : str
        Distance of two rows: "l1", or "l2", which is not squared here.
    weights : array (n,), optional
        Positive weights, in any unit, such as areas of the nodes. A row of weight 3 costs
        what three copies cost. By default all weigh alike.
    rng : int or Generator
        Seed: the same seed gives the same groups.
    restarts : int
        Number of independent starts; the best wins.
    samples : int
        Most rows whose pairwise distances are held in memory.

    Returns
    -------
    Clusters
        ``centers`` are rows of the data.

    Raises
    ------
    ClusterError
        K02 if there are fewer distinct rows than groups.
    ArgumentError
        A02 for a count or restarts below 1, fewer samples than groups, an unknown metric or
        weights that are not positive, A03 for rows that are not (n, T) or weights that are
        not (n,).

    Notes
    -----
    With more rows than ``samples`` each start takes its own sample, drawn by weight; the
    medoids that cost least on all rows win. Each is then replaced by the best of its group's
    rows near the middle, as long as that lowers the cost. The result is close to, but need
    not be, one that no exchange improves.

    Cost: with s samples s^2 T for the distances, s^2 for a pass over the exchanges, and
    8 s^2 bytes; 4 to 10 s for 50 000 rows, 100 times, 5 groups.

    References
    ----------
    L. Kaufman and P. J. Rousseeuw, *Finding Groups in Data*, Wiley 1990, chapters 2 and 3
    (samples). E. Schubert and P. J. Rousseeuw, *Fast and eager k-medoids clustering*,
    Information Systems 101 (2021) 101804, section 4 (all exchanges with one row at once).

    Examples
    --------
    The middle one of three rows costs least, and no mean of rows is a center:

    >>> groups = k_medoids(np.array([[0.0], [9.0], [1.0], [5.0], [9.5]]), 2)
    >>> groups.labels.tolist(), groups.centers[0].tolist()
    ([0, 1, 0, 1, 1], [0.0])
    """
    if restarts < 1:
        raise ArgumentError("A02", f"restarts: expected 1 or more, got {restarts}")
    if samples < count:
        raise ArgumentError(
            "A02", f"samples: expected at least the {count} groups, got {samples}; give more"
        )
    known = checked_rows(rows, count, weights=weights, metric=metric)
    generator = np.random.default_rng(rng)
    tries = _tries(known, count, metric, generator, restarts, samples)
    centers = min(tries, key=lambda centers: _cost(known, centers, metric))
    if len(known.data) > samples:
        centers = _polished(known, centers, metric)
    return known.clusters(distances(known.data, centers, metric).argmin(axis=1), centers)


def _cost(rows: Rows, centers: Floats, metric: Metric) -> float:
    return float((rows.weights * distances(rows.data, centers, metric).min(axis=1)).sum())


def _tries(
    rows: Rows,
    count: int,
    metric: Metric,
    generator: np.random.Generator,
    restarts: int,
    samples: int,
) -> Iterator[Floats]:
    """Medoids (count, T) of each start, on all rows or on a sample of its own."""
    whole = len(rows.data) <= samples
    table = distances(rows.data, rows.data, metric) if whole else np.empty(0)
    for _ in range(restarts):
        sample = rows if whole else rows.sample(samples, generator)
        if not whole:
            table = distances(sample.data, sample.data, metric)
        first = seeds(sample, count, metric, generator)
        centers = sample.data[_swapped(table, sample.weights, first)]
        yield with_seeds(rows, count, metric, generator, centers)


class _Near(NamedTuple):
    """Of each row its nearest medoid, the distances to it and to the next, and the cost.

    The next of a lone medoid is infinitely far.
    """

    first: Ints
    near: Floats
    next: Floats
    cost: float


def _near(table: Floats, weights: Floats, medoids: Ints) -> _Near:
    reach = table[medoids]
    first = reach.argmin(axis=0)
    columns = np.arange(len(table))
    near = reach[first, columns]
    reach[first, columns] = np.inf
    return _Near(first, near, reach.min(axis=0), float((weights * near).sum()))


def _swapped(table: Floats, weights: Floats, medoids: Ints) -> Ints:
    """Medoids after exchanges with one row each, until none of all lowers the cost.

    What the exchange with a row costs is, for every medoid at once, what the rows nearer to
    the newcomer gain, and what the rows of the medoid lose if they go to it or to their next.
    """
    medoids, count = medoids.copy(), len(medoids)
    now = _near(table, weights, medoids)
    row, tried = -1, 0
    while tried < len(table):
        row, tried = (row + 1) % len(table), tried + 1
        reach = table[row]
        gain = (weights * np.minimum(reach - now.near, 0.0)).sum()
        loss = weights * (np.minimum(np.maximum(reach, now.near), now.next) - now.near)
        losses = np.bincount(now.first, loss, minlength=count)
        worst = losses.argmin()
        if gain + losses[worst] < 0:
            trial = medoids.copy()
            trial[worst] = row
            after = _near(table, weights, trial)
            if after.cost < now.cost:
                medoids, now, tried = trial, after, 0
    return medoids


def _polished(rows: Rows, centers: Floats, metric: Metric) -> Floats:
    """Each medoid exchanged for the best row near the middle of its group, while that helps."""
    middles = middles_of(rows.data, rows.weights, metric)
    cost = _cost(rows, centers, metric)
    for _ in range(_PASSES):
        labels = distances(rows.data, centers, metric).argmin(axis=1)
        middle = middles(labels, len(centers))
        trial = np.stack(
            [
                _best_of(rows, labels == group, centers[group], middle[group], metric)
                for group in range(len(centers))
            ]
        )
        after = _cost(rows, trial, metric)
        if not after < cost:
            break
        centers, cost = trial, after
    return centers


def _best_of(rows: Rows, group: Bools, medoid: Floats, middle: Floats, metric: Metric) -> Floats:
    """The medoid, or a row of the group near its middle, whichever costs the group least."""
    data, weights = rows.data[group], rows.weights[group]
    near = distances(data, middle[None], metric)[:, 0].argsort(kind="stable")[:_CANDIDATES]
    candidates = np.concatenate([medoid[None], data[near]])
    costs = (weights[:, None] * distances(data, candidates, metric)).sum(axis=0)
    best: Floats = candidates[costs.argmin()]
    return best
