"""k-medians in L1: the clustering that the thesis describes under the name k-medoids."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ArgumentError
from ..geometry import Floats, Ints
from ..records import Clusters
from ..row_distances import Metric, distances
from ._rows import Rows, checked_rows

_ROUNDS = 200
_SAMPLE = 4000
_ROUNDS_OF_MANY = 20  # with more rows than the sample; pure noise is then within 1e-3 of the end


def k_medians(
    rows: Floats,
    count: int,
    *,
    metric: Metric = "l1",
    weights: ArrayLike | None = None,
    rng: int | np.random.Generator = 0,
    restarts: int = 10,
) -> Clusters:
    """Groups of rows around coordinate-wise medians, minimizing the summed L1 distance.

    cost = sum_i w_i d(row_i, center of its group), least over centers and groups.

    Lloyd's iteration with L1 distance and medians, from k-means++-like seeds
    (each next seed drawn with a probability proportional to its part of the
    cost so far). The best of the restarts wins. Groups are numbered
    by the norm of their center, so that group 0 is the least changed.

    With ``metric="l2"`` d is the *squared* Euclidean distance and the centers are
    means: that is k-means. Its groups are balls; one far row moves a mean, but no median.

    Parameters
    ----------
    rows : array (n, T)
        For example a change. Rows with NaN are left out and labelled -1.
    count : int
        Number of groups.
    metric : str
        "l1" for medians, "l2" for means.
    weights : array (n,), optional
        Positive weights, in any unit: areas of the nodes, so that a dense mesh does not
        decide. A row of weight 3 costs what three copies cost. By default all weigh alike.
    rng : int or Generator
        Seed: the same seed gives the same groups.
    restarts : int
        Number of independent starts.

    Returns
    -------
    Clusters
        ``centers`` are the groups' medians, or means. Where the weights differ, of all
        medians the lowest: the smallest value that half the weight does not exceed.

    Raises
    ------
    ClusterError
        K02 if there are fewer distinct rows than groups.
    ArgumentError
        A02 for a count or restarts below 1, an unknown metric or weights that are not
        positive, A03 for rows that are not (n, T) or weights that are not (n,).

    Notes
    -----
    Above 4000 rows the restarts take a sample of 4000, drawn by weight, and the best is
    finished on all rows, in at most 20 rounds each. Cost: n T count operations a round;
    2 to 8 s for 50 000 rows, 100 times, 5 groups.

    References
    ----------
    Thesis, section 4.1.6; the L1 median of a set is its coordinate-wise median.

    Examples
    --------
    >>> groups = k_medians(np.array([[5.0], [0.0], [0.2], [5.1], [np.nan]]), 2)
    >>> groups.labels.tolist(), groups.centers.round(2).tolist()
    ([1, 0, 0, 1, -1], [[0.1], [5.05]])
    """
    if restarts < 1:
        raise ArgumentError("A02", f"restarts: expected 1 or more, got {restarts}")
    known = checked_rows(rows, count, weights=weights, metric=metric)
    generator = np.random.default_rng(rng)
    sample = known.sample(_SAMPLE, generator)
    rounds = _ROUNDS if sample is known else _ROUNDS_OF_MANY

    def run(rows: Rows, centers: Floats | None = None) -> tuple[Floats, Ints, float]:
        start = with_seeds(rows, count, metric, generator, centers)
        return _lloyd(rows.data, start, rows.weights, metric, rounds)

    centers, nearest, _ = min((run(sample) for _ in range(restarts)), key=_cost)
    if sample is not known:
        centers, nearest, _ = run(known, centers)
    return known.clusters(nearest, centers)


def _cost(run: tuple[Floats, Ints, float]) -> float:
    return run[2]


def seeds(
    rows: Rows,
    count: int,
    metric: Metric,
    generator: np.random.Generator,
    centers: Floats | None = None,
) -> Ints:
    """Distinct rows that, with the centers there are, make so many; fewer if there are no more."""
    data, weights = rows.data, rows.weights
    chosen: list[int] = []
    if centers is None:
        alike = bool((weights == weights[0]).all())
        chance = None if alike else weights / weights.sum()
        first = generator.integers(len(data)) if alike else generator.choice(len(data), p=chance)
        chosen, centers = [int(first)], data[[int(first)]]
    nearest = distances(data, centers, metric).min(axis=1)
    for _ in range(count - len(centers)):
        share = weights * (nearest if metric == "l1" else nearest**2)
        if not share.any():
            break
        row = int(generator.choice(len(data), p=share / share.sum()))
        chosen.append(row)
        nearest = np.minimum(nearest, distances(data, data[[row]], metric)[:, 0])
    return np.array(chosen, dtype=np.int64)


def with_seeds(
    rows: Rows,
    count: int,
    metric: Metric,
    generator: np.random.Generator,
    centers: Floats | None = None,
) -> Floats:
    """The centers there are, and seeds beside them."""
    further = rows.data[seeds(rows, count, metric, generator, centers)]
    return further if centers is None else np.concatenate([centers, further])


def _lloyd(
    data: Floats,
    centers: Floats,
    weights: Floats | None = None,
    metric: Metric = "l1",
    rounds: int = _ROUNDS,
) -> tuple[Floats, Ints, float]:
    """Alternate nearest and middles until no label changes; no group is ever empty."""
    weights = np.ones(len(data)) if weights is None else weights
    middles = middles_of(data, weights, metric)
    labels = np.full(len(data), -1, dtype=np.int64)
    for _ in range(rounds):
        distance = distances(data, centers, metric)
        nearest = distance.argmin(axis=1)
        for group in np.setdiff1d(np.arange(len(centers)), nearest):  # refill an empty group
            shared = np.bincount(nearest, minlength=len(centers))[nearest] > 1
            nearest[np.where(shared, distance.min(axis=1), -1.0).argmax()] = group
        if np.array_equal(nearest, labels):
            break
        labels = nearest
        centers = middles(labels, len(centers))
    distance = distances(data, centers, metric)[np.arange(len(data)), labels]
    cost = float((weights * (distance if metric == "l1" else distance**2)).sum())
    return centers, labels, cost


def middles_of(data: Floats, weights: Floats, metric: Metric) -> Callable[[Ints, int], Floats]:
    """What takes labels (m,) and their number k, no group empty, to medians or means (k, T)."""
    if metric == "l2":
        return lambda labels, count: _means(data, weights, labels, count)
    if (weights == weights[:1]).all():
        return lambda labels, count: _medians(data, labels, count)
    order = np.ascontiguousarray(data.argsort(axis=0, kind="stable").T)
    return lambda labels, count: _weighted_medians(data, weights, order, labels, count)


def _means(data: Floats, weights: Floats, labels: Ints, count: int) -> Floats:
    groups = [labels == g for g in range(count)]
    return np.stack([np.average(data[g], axis=0, weights=weights[g]) for g in groups])


def _medians(data: Floats, labels: Ints, count: int) -> Floats:
    return np.stack([np.median(data[labels == g], axis=0) for g in range(count)])


def _weighted_medians(
    data: Floats, weights: Floats, order: Ints, labels: Ints, count: int
) -> Floats:
    """Lower weighted medians; ``order`` (T, m) sorts each column of the rows once for all."""
    sorted_labels = labels[order]
    columns = np.arange(len(order))
    medians = np.empty((count, len(order)))
    for group in range(count):
        members = order[sorted_labels == group].reshape(len(order), -1)
        below = np.cumsum(weights[members], axis=1)
        half = below[:, -1:] / 2 * (1 - 1e-12)  # a sum that rounding left below half is half
        place = (below >= half).argmax(axis=1)
        medians[group] = data[members[columns, place], columns]
    return medians
