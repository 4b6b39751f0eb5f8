"""Groups of nodes that changed alike: which there are, how large, where and at which scale."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .difference import change_norm
from .geometry import Bools, Floats, node_areas
from .records import Clusters, Surface

Clustering = Callable[..., Clusters]
"""A method of the clustering room: rows (n, T), a count, weights or none -> groups."""


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
