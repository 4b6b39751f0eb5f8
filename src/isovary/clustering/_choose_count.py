"""How many groups: silhouettes, gaps, and how alike the groups of other samples are."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ArgumentError
from ..geometry import Floats, Ints, frozen
from ..records import Clusters
from ..row_distances import Metric, distances
from ._gap import gaps
from ._rand_index import adjusted_rand_index
from ._rows import Rows, checked_rows

_SHARE = 0.8  # of the sample goes into each run


class Method(Protocol):
    """A grouping: rows (n, T), number of groups and seed -> Clusters."""

    def __call__(self, rows: Floats, count: int, /, *, rng: int) -> Clusters:
        """Group the rows."""
        ...


@dataclass(frozen=True, eq=False)
class CountChoice:
    """How good and how repeatable groupings into several numbers of groups are.

    Parameters
    ----------
    counts : array (c,)
        Numbers of groups, ascending.
    silhouette : array (c,)
        Mean :func:`silhouette`, averaged over the runs; at most 1. NaN if a run found only one
        group.
    error : array (c,)
        Standard error of that average.
    stability : array (c,)
        Mean :func:`adjusted_rand_index` of pairs of runs; 1 if they all agree, about 0 if
        they agree as chance does.
    gap : array (c + 1,), optional
        Of one group, then of the counts: by how much the logarithm of the spread within the
        groups is below that of rows without structure. None if it was not asked for.
    gap_error : array (c + 1,), optional
        Its standard error.
    """

    counts: Ints
    silhouette: Floats
    error: Floats
    stability: Floats
    gap: Floats | None = None
    gap_error: Floats | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "counts", frozen(self.counts, np.int64))
        for name in ("silhouette", "error", "stability"):
            object.__setattr__(self, name, frozen(getattr(self, name)))
        for name in ("gap", "gap_error"):
            value = getattr(self, name)
            if value is None:
                continue
            object.__setattr__(self, name, frozen(value))
            if np.shape(value) != (len(self.counts) + 1,):
                raise ArgumentError(
                    "A03",
                    f"{name}: expected shape ({len(self.counts) + 1},), of one group and of each "
                    f"count, got {np.shape(value)}",
                )

    @property
    def best(self) -> int:
        """The smallest count whose silhouette is within one standard error of the highest.

        -1 if no silhouette is known.
        """
        if np.isnan(self.silhouette).all():
            return -1
        highest = np.nanargmax(self.silhouette)
        enough = self.silhouette >= self.silhouette[highest] - self.error[highest]
        return int(self.counts[enough][0])

    @property
    def best_gap(self) -> int:
        """The smallest count k, of 1 and those tried, with gap(k) >= gap(next) - error(next).

        The largest if there is none: then more should be tried. -1 if no gap is known.
        """
        if self.gap is None or self.gap_error is None or np.isnan(self.gap).any():
            return -1
        enough = self.gap[:-1] >= self.gap[1:] - self.gap_error[1:]
        return int(np.append(1, self.counts)[np.append(enough, True)][0])


def choose_count(
    rows: ArrayLike,
    method: Method,
    counts: Iterable[int] = range(2, 9),
    *,
    metric: Metric = "l1",
    weights: ArrayLike | None = None,
    rng: int | np.random.Generator = 0,
    samples: int = 1500,
    repeats: int = 5,
    references: int = 0,
) -> CountChoice:
    """Groups samples of the rows into several numbers of groups, to say which number fits.

    Draws a sample, and from it as many parts of 80 % as there are repeats. The method groups
    each part into each number of groups, with a seed of its own. Two things are asked of the
    groups: are the rows nearer to their own group than to the next (:func:`silhouette`), and
    do two parts put the rows that they share into the same groups
    (:func:`adjusted_rand_index`, the stability)? ``best`` follows from the first by the
    one-standard-error rule; a best count whose stability is far below 1 is no finding. Neither
    can speak for a single group.

    That can the gap: with W(k) the summed distance of the rows to the median of their group
    (squared distance to the mean for "l2"),

    gap(k) = mean over references of log W*(k) - mean over parts of log W(k),

    where W* is the same of as many rows drawn uniformly from the box around the sample along
    its principal axes. ``best_gap`` follows. It counts clumps: rows that change gradually from
    one place to the next, dense at one end, are one clump to it, however far it reaches.

    Parameters
    ----------
    rows : array (n, T)
        Rows with NaN are left out.
    method : callable
        ``method(rows, count, rng=seed)`` gives Clusters; options with ``functools.partial``.
    counts : iterable of int
        Numbers of groups to try, each at least 2.
    metric : {"l1", "l2"}
        Distance of the silhouettes; that of the method, if it is to be fair.
    weights : array (n,), optional
        The chance of each row to be drawn is in proportion; what is drawn weighs alike.
    rng : int or Generator
        Seed: the same seed gives the same choice.
    samples : int
        Rows in the sample; all, if there are fewer.
    repeats : int
        Runs for each count, at least 2.
    references : int
        Samples without structure for the gap; 20 are plenty, with 0 it is not asked for. The
        silhouettes and stabilities are the same, whether it is or not.

    Returns
    -------
    CountChoice

    Raises
    ------
    ClusterError
        K02 if there are fewer distinct rows than groups, among all rows or in a part.
    ArgumentError
        A02 for counts below 2 or none, samples below 3, repeats below 2, references below 0,
        an unknown metric or weights that are not positive; A03 for rows that are not (n, T) or
        weights not (n,).

    Notes
    -----
    Cost: repeats + references times the number of counts runs of the method on 0.8 samples
    rows, and samples^2 T for the distances, whatever n is.

    Of columns that go together, as the times of a signature do, the box knows: their many
    sides are a few long principal axes and the rest so short that they decide nothing, where a
    box along the columns would be a cube and make any rows seem clumped (version b of
    Tibshirani et al.).

    References
    ----------
    P. J. Rousseeuw, *Silhouettes*, J. Comput. Appl. Math. 20 (1987) 53-65. A. Ben-Hur,
    A. Elisseeff, I. Guyon, *A stability based method for discovering structure in clustered
    data*, Pac. Symp. Biocomputing 7 (2002) 6-17. R. Tibshirani, G. Walther, T. Hastie,
    *Estimating the number of clusters in a data set via the gap statistic*, J. R. Stat. Soc. B
    63 (2001) 411-423. L. Breiman et al., *Classification and
    Regression Trees*, 1984, section 3.4.3 (the one-standard-error rule).

    Examples
    --------
    >>> from isovary.clustering import k_medians
    >>> rows = np.repeat([[0.0], [5.0], [9.0]], 20, axis=0) + np.linspace(0, 0.1, 60)[:, None]
    >>> choice = choose_count(rows, k_medians, range(2, 5))
    >>> choice.best, float(choice.stability[1])
    (3, 1.0)
    >>> choose_count(rows, k_medians, range(2, 5), references=5).best_gap
    3
    """
    tried = sorted(set(counts))
    _check(tried, samples, repeats, references)
    known = checked_rows(rows, tried[-1], weights=weights, metric=metric)
    generator = np.random.default_rng(rng)
    sample = known.sample(samples, generator)
    parts = [_part(sample, generator) for _ in range(repeats)]
    table = distances(sample.data, sample.data, metric)
    runs = [_runs(method, sample.data, parts, count, generator) for count in tried]
    judged = np.array([_judged(labels, parts, table) for labels in runs])
    means, errors, agreements = judged.T
    gap = gap_error = None
    if references:

        def group(data: Floats, count: int) -> Ints:
            return method(data, count, rng=int(generator.integers(2**31))).labels

        gap, gap_error = gaps(sample.data, runs, group, tried, metric, references, generator)
    return CountChoice(np.array(tried), means, errors, agreements, gap, gap_error)


def _check(counts: Sequence[int], samples: int, repeats: int, references: int) -> None:
    if not counts or counts[0] < 2:
        raise ArgumentError("A02", f"counts: expected numbers of 2 or more, got {list(counts)}")
    if samples < 3:
        raise ArgumentError("A02", f"samples: expected 3 or more, got {samples}")
    if repeats < 2:
        raise ArgumentError("A02", f"repeats: expected 2 or more, got {repeats}")
    if references < 0:
        raise ArgumentError("A02", f"references: expected 0 or more, got {references}")


def _part(sample: Rows, generator: np.random.Generator) -> Ints:
    """Places of the sample's rows that go into one run, ascending."""
    size = len(sample.data)
    chance = sample.weights / sample.weights.sum()
    drawn = generator.choice(size, int(np.ceil(_SHARE * size)), replace=False, p=chance)
    return np.sort(drawn)


def _runs(
    method: Method, data: Floats, parts: list[Ints], count: int, generator: np.random.Generator
) -> list[Ints]:
    """For each part the labels of the sample's rows, -1 for those not in the part."""
    seeds = generator.integers(2**31, size=len(parts))
    runs = []
    for part, seed in zip(parts, map(int, seeds), strict=True):
        labels = np.full(len(data), -1, dtype=np.int64)
        labels[part] = method(data[part], count, rng=seed).labels
        runs.append(labels)
    return runs


def _judged(runs: list[Ints], parts: list[Ints], table: Floats) -> tuple[float, float, float]:
    """Mean silhouette of the runs, its standard error, and their stability."""
    scores = []
    for labels, part in zip(runs, parts, strict=True):
        own = labels[part]
        scores.append(_mean_silhouette(table[np.ix_(part, part)], own, np.ones(len(part))))
    agreements = [adjusted_rand_index(one, other) for one, other in combinations(runs, 2)]
    error = np.std(scores, ddof=1) / np.sqrt(len(scores))
    return float(np.mean(scores)), float(error), float(np.mean(agreements))


def silhouette(
    rows: ArrayLike,
    labels: ArrayLike,
    *,
    metric: Metric = "l1",
    weights: ArrayLike | None = None,
    rng: int | np.random.Generator = 0,
    samples: int = 1500,
) -> float:
    """Mean silhouette: how much nearer the rows are to their own group than to the next.

    For each row s = (b - a) / max(a, b), where a is its mean distance to the other rows of
    its group and b the smallest of its mean distances to those of another group; s = 0 for a
    row that is alone. 1 is the best; below 0 rows lie in the wrong group.

    Parameters
    ----------
    rows : array (n, T)
        Rows with NaN are left out.
    labels : array (n,)
        Group of each row; those below 0 are left out.
    metric : {"l1", "l2"}
        Distance of two rows.
    weights : array (n,), optional
        How much each row counts in all means. Default: all alike.
    rng : int or Generator
        Seed of the sample.
    samples : int
        Above so many rows, so many are drawn in proportion to their weights, to weigh alike.

    Returns
    -------
    float
        In [-1, 1]; NaN if fewer than two groups were drawn.

    Raises
    ------
    ArgumentError
        A02 for fewer than two groups, an unknown metric or weights that are not positive;
        A03 for rows that are not (n, T), labels or weights that are not (n,).
    ClusterError
        K02 if no row is known.

    Notes
    -----
    Cost: m^2 T operations and 8 m^2 bytes for m rows; 0.1 s for 1500 rows of 100 times.

    References
    ----------
    P. J. Rousseeuw, *Silhouettes*, J. Comput. Appl. Math. 20 (1987) 53-65.

    Examples
    --------
    In the first group s = (9.5 - 1) / 9.5 and (8.5 - 1) / 8.5; the second is its mirror:

    >>> mean = silhouette([[0.0], [1.0], [9.0], [10.0]], [0, 0, 1, 1])
    >>> round(mean, 6), round((8.5 / 9.5 + 7.5 / 8.5) / 2, 6)
    (0.888545, 0.888545)
    """
    values = np.array(rows, dtype=float)
    groups = np.asarray(labels)
    if values.ndim == 2 and groups.shape != (len(values),):
        raise ArgumentError("A03", f"labels: expected shape ({len(values)},), got {groups.shape}")
    if values.ndim == 2:
        values[groups < 0] = np.nan
    known = checked_rows(values, 1, weights=weights, metric=metric)
    number = len(np.unique(groups[known.known]))
    if number < 2:
        raise ArgumentError("A02", f"labels: expected 2 or more groups, got {number}")
    # the labels are drawn as one more column of the rows, which is then taken off again
    labelled = np.column_stack([known.data, groups[known.known]])
    drawn = known._replace(data=labelled).sample(samples, np.random.default_rng(rng))
    data, own = drawn.data[:, :-1], drawn.data[:, -1].astype(np.int64)
    return _mean_silhouette(distances(data, data, metric), own, drawn.weights)


def _mean_silhouette(table: Floats, labels: Ints, weights: Floats) -> float:
    names, own = np.unique(labels, return_inverse=True)
    if len(names) < 2:
        return float("nan")
    places = np.arange(len(own))
    belongs = (own[:, None] == np.arange(len(names))) * weights[:, None]
    sums = table @ belongs
    rest = np.broadcast_to(belongs.sum(axis=0), sums.shape).copy()
    alone = np.bincount(own)[own] == 1
    rest[places, own] -= weights
    rest[places[alone], own[alone]] = 1.0
    means = sums / rest
    inner = means[places, own]
    means[places, own] = np.inf
    outer = means.min(axis=1)
    larger = np.maximum(inner, outer)
    score = np.divide(outer - inner, larger, out=np.zeros_like(larger), where=larger > 0)
    score[alone] = 0.0
    return float(weights @ score / weights.sum())
