"""Groups of nodes that changed alike: which there are, how large, where and at which scale."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from inspect import signature
from typing import Literal

import numpy as np

from .clustering import CountChoice, choose_count
from .difference import change_norm
from .errors import ClusterError
from .geometry import Bools, Floats, node_areas
from .records import Clusters, Surface
from .row_distances import Metric

Clustering = Callable[..., Clusters]
"""A method of the clustering room: rows (n, T), a count, weights or none -> groups."""

_MOST, _SAMPLES = 8, 500
_STABLE = 0.8  # two ways of cutting rows that change gradually agree to 0.6 or less
_JACKKNIFE = np.sqrt(5 * 0.8 / (1 - 0.8))  # error of a mean over 5 parts of 80 % -> of a sample


@dataclass(frozen=True)
class ChosenCount:
    """A number of groups that the rows chose themselves.

    Parameters
    ----------
    count : int
    silhouette, stability : float, optional
        Of groupings into so many, as in :class:`isovary.CountChoice`; None for one group.
    """

    count: int
    silhouette: float | None = None
    stability: float | None = None


def chosen_count(
    rows: Floats, clustering: Clustering, weights: Floats | None = None, seed: int = 0
) -> ChosenCount:
    """How many groups of rows there are, from 2 to 8 by the silhouette, or else one.

    Counts on which groupings of two parts of the rows agree by an adjusted Rand index below
    0.8 are passed over: another seed would find other groups. Of the others it is the smallest
    whose silhouette is within one standard error of the highest. One group if there is none.
    The error is the sample's: parts that share most rows vary less than samples would, and by
    the jackknife their standard deviation counts twice.

    Parameters
    ----------
    rows : array (m, T)
        Without NaN.
    clustering : callable
        With a seed ``rng``; the silhouette takes its ``metric``, l1 if it has none.
    weights : array (m,), optional
        Areas of the nodes: the chance of each to be looked at. Default: all alike.
    seed : int

    Returns
    -------
    ChosenCount

    Notes
    -----
    The gap statistic has no say: changes fade away from where they are, without a gap, and
    to it that is one group, even with a dimple at one place and a bump at another.

    Cost: 35 runs of the clustering on 400 rows, however many there are; 2 to 3 s.

    References
    ----------
    See :func:`isovary.choose_count`. J. Shao, C. F. J. Wu, *A general theory for jackknife
    variance estimation*, Ann. Statist. 17 (1989) 1176-1197.
    """
    choice = _judged(rows, clustering, weights, seed)
    if choice is None:
        return ChosenCount(1)
    known = np.where(choice.stability >= _STABLE, choice.silhouette, np.nan)
    best = replace(choice, silhouette=known, error=_JACKKNIFE * choice.error).best
    if best < 0:
        return ChosenCount(1)
    at = choice.counts.tolist().index(best)
    return ChosenCount(best, float(choice.silhouette[at]), float(choice.stability[at]))


def _judged(
    rows: Floats, clustering: Clustering, weights: Floats | None, seed: int
) -> CountChoice | None:
    """As many counts as there are rows that differ; None if these are too few for two."""
    for most in range(min(_MOST, len(rows) // 3), 1, -1):
        try:
            return choose_count(
                rows,
                clustering,
                range(2, most + 1),
                metric=_metric(clustering),
                weights=weights,
                rng=seed,
                samples=_SAMPLES,
            )
        except ClusterError as error:
            if error.code != "K02":
                raise
    return None


def _metric(clustering: Clustering) -> Metric:
    parameter = signature(clustering).parameters.get("metric")
    return "l2" if parameter is not None and parameter.default == "l2" else "l1"


def grouped(
    change: Floats,
    floor: Floats,
    significant: Bools,
    count: int | Literal["auto"],
    clustering: Clustering,
    weights: Floats | None = None,
    seed: int = 0,
) -> tuple[Clusters, dict[str, object]]:
    """Groups of the significant rows, and what to record of their number.

    Parameters
    ----------
    change, floor, significant, clustering, weights
        As for :func:`groups_above_noise`.
    count : int or "auto"
        Groups at most; by :func:`chosen_count` if "auto".
    seed : int
        Of that choice.

    Returns
    -------
    Clusters, dict
        The latter empty for a number, else ``groups_chosen``.
    """
    if count != "auto":
        return groups_above_noise(change, floor, significant, count, clustering, weights), {}
    heavy = None if weights is None else weights[significant]
    chosen = chosen_count(change[significant], clustering, heavy, seed)
    clusters = groups_above_noise(change, floor, significant, chosen.count, clustering, weights)
    return clusters, {"groups_chosen": asdict(chosen)}


def groups_above_noise(
    change: Floats,
    floor: Floats,
    significant: Bools,
    count: int,
    clustering: Clustering,
    weights: Floats | None = None,
) -> Clusters:
    """Groups of the significant rows, as many as differ by more than the noise.

    Parameters
    ----------
    change, floor : array (n, T)
        The change and its noise floor.
    significant : array (n,)
    count : int
        Groups at most.
    clustering : callable
    weights : array (n,), optional
        Areas of the nodes. Default: all alike.

    Returns
    -------
    Clusters
        Labels (n,), -1 where the change is not significant.
    """
    if not significant.any():
        labels = np.full(len(change), -1, dtype=np.int64)
        return Clusters(labels, np.empty((0, change.shape[1])))
    rows = np.where(significant[:, None], change, np.nan)
    noise = float(change_norm(floor[significant]).mean())
    asked = min(count, len(np.unique(change[significant], axis=0)))
    options = {} if weights is None else {"weights": weights}
    while True:
        clusters = clustering(rows, asked, **options)
        centers = clusters.centers
        apart = np.abs(centers[:, None] - centers[None]).mean(axis=2)
        np.fill_diagonal(apart, np.inf)
        if asked == 1 or apart.min() > 2 * noise:
            return clusters
        asked -= 1


@dataclass(frozen=True, eq=False)
class GroupFacts:
    """One group of nodes.

    Parameters
    ----------
    number : int
        The label.
    rank : int
        1 for the group that changed most in the mean.
    nodes : int
    area_share : float
        Part of the surface's area.
    mean_change : float
        Mean norm of the change over the group's area.
    place : array (3,)
        The group's node that changed most.
    column : int
        Where the group's median change differs most from the surface's mean: the scale at which
        it stands out. (Growth of the area alone is the same for all at large times.)
    change : float
        The median there, signed.
    """

    number: int
    rank: int
    nodes: int
    area_share: float
    mean_change: float
    place: Floats
    column: int
    change: float


def group_table(surface: Surface, clusters: Clusters, change: Floats) -> tuple[GroupFacts, ...]:
    """A row for each group of nodes that is not empty, in the order of the labels.

    Parameters
    ----------
    surface : Surface
        With n nodes.
    clusters : Clusters
        Labels (n,), -1 for no group.
    change : array (n, T)

    Returns
    -------
    tuple of GroupFacts

    Examples
    --------
    A sixth of the vertices changed by 1 at the second of two times, the others nowhere:

    >>> from isovary.shapes import icosphere
    >>> ball = icosphere(0, order=1)
    >>> labels = np.arange(12) % 6 == 0
    >>> change = np.outer(labels, [0.0, 1.0])
    >>> still, moved = group_table(ball, Clusters(labels, np.array([[0.0, 0], [0, 1]])), change)
    >>> moved.rank, moved.nodes, round(moved.area_share, 12), moved.column, moved.mean_change
    (1, 2, 0.166666666667, 1, 0.5)
    """
    areas = node_areas(surface.points, surface.triangles)
    norm = change_norm(change)
    count, known = len(clusters.centers), np.isfinite(norm)
    mean = np.average(change[known], axis=0, weights=areas[known]) if known.any() else 0.0
    inside = [np.flatnonzero(clusters.labels == number) for number in range(count)]
    means = [
        float(np.average(norm[rows], weights=areas[rows])) if len(rows) else -1.0 for rows in inside
    ]
    ranks = np.argsort(np.argsort(-np.array(means), kind="stable"))
    table = []
    for number, rows in enumerate(inside):
        if len(rows) == 0:
            continue
        median = np.median(change[rows], axis=0)
        column = int(np.abs(median - mean).argmax())
        table.append(
            GroupFacts(
                number=number,
                rank=int(ranks[number]) + 1,
                nodes=len(rows),
                area_share=float(areas[rows].sum() / areas.sum()),
                mean_change=means[number],
                place=surface.points[rows[norm[rows].argmax()]],
                column=column,
                change=float(median[column]),
            )
        )
    return tuple(table)
