"""Multidimensional scaling for several costs: one point at a time goes to its best place."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ArgumentError
from ..geometry import Floats
from ..row_distances import Metric, distances
from ._classical_mds import (
    Known,
    Landmarks,
    axes,
    blocks,
    chosen_landmarks,
    classical,
    known_rows,
    principal,
)

Cost = Literal["squared", "absolute"]
"""Sum of the squared, or of the absolute, differences of distances."""

_STEPS = {"squared": 2, "absolute": 4}  # of one point in one round
_SOFT = (0.3, 0.1, 0.03, 0.003)  # of the mean residual, in turn: those below pull alike
_PLACING_STEPS = 12  # of a row that is placed once, at most
_BEYOND = 1.8  # times the way to the mean: no cost increases below 2
_TINY = 1e-150
_CLOSE = 1e-9  # of the largest distance: points closer coincide


def universal_mds(
    rows: ArrayLike,
    dimensions: int = 3,
    *,
    metric: Metric = "l1",
    cost: Cost = "squared",
    landmarks: int = 1000,
    weights: ArrayLike | None = None,
    rng: int | np.random.Generator = 0,
    rounds: int = 30,
    tolerance: float = 1e-3,
) -> Floats:
    """Points whose distances are nearest to the rows' distances.

    The cost is the sum over all pairs of w_i w_j (norm(x_i - x_j) - d_ij)^2 ("squared", also
    called raw stress) or of w_i w_j abs(norm(x_i - x_j) - d_ij) ("absolute", which a few
    distances that fit nowhere do not bend). One point after the other is moved while all others
    stay. The line from each other point x_j through it meets the sphere of radius d_ij around
    x_j. The point goes towards the mean of these meeting places, or for the absolute cost one
    step of Weiszfeld towards their median; 1.8 times as far, which halves the rounds, and a few
    times in a row. No move increases the cost: one that would is not made. It starts from
    :func:`classical_mds` and goes towards a local minimum; an axis that is 0 there stays 0.

    Of more rows than ``landmarks``, only so many, chosen and weighed as in
    :func:`classical_mds`, are embedded like this. Each row then starts where
    :func:`classical_mds` puts it, changed by the affine map that fits the landmarks best, and is
    moved alike, twelve times at most, towards its best place among them. Mean, axes and signs are
    settled as in :func:`classical_mds`.

    Parameters
    ----------
    rows : array (n, T)
        For example a change. Rows with NaN or infinity are unknown.
    dimensions : int
        Number of axes.
    metric : {"l1", "l2"}
        Distance of two rows: sum of the absolute differences, as in the groups; or the root of
        the sum of the squares.
    cost : {"squared", "absolute"}
        What is minimized.
    landmarks : int
        Number of rows up to which all are embedded together.
    weights : array (n,), optional
        Positive, such as the area of each node. Default: all alike.
    rng : int or Generator
        Seed of the landmarks: the same seed gives the same points.
    rounds : int
        At most so often each point is moved.
    tolerance : float
        The rounds end when one decreases the cost by less than this part of it.

    Returns
    -------
    array (n, dimensions)
        In the unit of the rows; NaN where a row is unknown.

    Raises
    ------
    ArgumentError
        A02 for an unknown cost or metric, fewer than 1 dimension or round, a negative
        tolerance, no more landmarks than dimensions or weights that are not positive; A03 for
        rows that are not (n, T) or weights that are not (n,).

    Notes
    -----
    Cost: with l landmarks, about 10 l^2 operations a round and 3 n l T for the distances of
    the others; memory for l^2 numbers besides the rows.

    References
    ----------
    A. Agarwal, J. M. Phillips, S. Venkatasubramanian, *Universal multi-dimensional scaling*,
    KDD 2010, 1149-1158, section 4 (arXiv 1003.0529). E. Weiszfeld, *Sur le point pour lequel la
    somme des distances de n points donnes est minimum*, Tohoku Math. J. 43 (1937) 355-386.

    Examples
    --------
    The corners of a square, in L1 at distances 1 along the sides and 2 across. The best square
    of side s has the cost 4 (s - 1)^2 + 2 (sqrt(2) s - 2)^2, smallest at s = (1 + sqrt(2)) / 2:

    >>> corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> points = universal_mds(corners, 2, tolerance=1e-9)
    >>> round(float(np.linalg.norm(points[0] - points[1])), 4), round((1 + 2**0.5) / 2, 4)
    (1.2071, 1.2071)
    """
    if cost not in get_args(Cost):
        raise ArgumentError("A02", f"cost: expected squared or absolute, got {cost}")
    if rounds < 1:
        raise ArgumentError("A02", f"rounds: expected 1 or more, got {rounds}")
    if not tolerance >= 0:
        raise ArgumentError("A02", f"tolerance: expected 0 or more, got {tolerance}")
    known = known_rows(rows, dimensions, metric, landmarks, weights)
    marks = chosen_landmarks(known, landmarks, metric, np.random.default_rng(rng))
    points = classical(known, marks, dimensions, metric)
    if len(marks.data) == len(known.data):
        table = distances(marks.data, marks.data, metric)
        points = rearranged(points, table, marks.weights, cost, rounds, tolerance)
    else:
        points = _by_landmarks(known, marks, points, metric, cost, rounds, tolerance)
    return known.spread(principal(points, known))


def _by_landmarks(
    known: Known,
    marks: Landmarks,
    points: Floats,
    metric: Metric,
    cost: Cost,
    rounds: int,
    tolerance: float,
) -> Floats:
    """Points (m, k) of all rows, from where classical scaling puts them."""
    table = distances(marks.data, marks.data, metric)
    start, _ = axes(table**2, marks.weights, points.shape[1])
    anchors = rearranged(start, table, marks.weights, cost, rounds, tolerance)
    ones = np.ones((len(start), 1))
    moved = np.linalg.lstsq(np.hstack([start, ones]), anchors, rcond=None)[0]
    begin = points @ moved[:-1] + moved[-1]

    def work(part: slice) -> Floats:
        wanted = distances(known.data[part], marks.data, metric)
        return placed(begin[part], wanted, anchors, marks.weights, cost, _PLACING_STEPS, tolerance)

    with ThreadPoolExecutor(os.cpu_count()) as threads:
        return np.vstack(list(threads.map(work, blocks(len(points), len(anchors)))))


def rearranged(
    start: Floats, table: Floats, weights: Floats, cost: Cost, rounds: int, tolerance: float
) -> Floats:
    """Points (l, k) from a start (l, k), moved one at a time towards the distances (l, l)."""
    points = start.copy()
    others = weights.copy()
    before = total_cost(points, table, weights, cost)
    for _ in range(rounds):
        for i in range(len(points)):
            others[i] = 0.0
            here = slice(i, i + 1)
            points[here] = placed(
                points[here], table[here], points, others, cost, _STEPS[cost], 0.0
            )
            others[i] = weights[i]
        after = total_cost(points, table, weights, cost)
        if before - after <= tolerance * before:
            break
        before = after
    return points


def total_cost(points: Floats, table: Floats, weights: Floats, cost: Cost) -> float:
    """Cost of points (l, k) for the wanted distances (l, l), each pair once."""
    return 0.5 * float(weights @ _costs(_lengths(points, points) - table, weights, cost))


def _lengths(points: Floats, anchors: Floats) -> Floats:
    from scipy.spatial.distance import cdist

    lengths: Floats = cdist(points, anchors)
    return lengths


def _costs(residuals: Floats, weights: Floats, cost: Cost) -> Floats:
    """Cost (b,) of each of some points, from residuals (b, l)."""
    sizes = residuals**2 if cost == "squared" else np.abs(residuals)
    costs: Floats = sizes @ weights
    return costs


def placed(
    points: Floats,
    wanted: Floats,
    anchors: Floats,
    weights: Floats,
    cost: Cost,
    steps: int,
    tolerance: float,
) -> Floats:
    """Points (b, k), each moved alone towards the wanted distances (b, l) to the anchors (l, k).

    They end after so many steps; for the squared cost also when one decreases the sum of their
    costs by no more than the tolerance times it. The median's step takes residuals much below
    their mean for larger than they are, each time another amount: a residual of nearly 0 would
    hold the point where it is.
    """
    lengths = _lengths(points, anchors)
    costs = _costs(lengths - wanted, weights, cost)
    for step in range(steps):
        if not costs.any():
            break
        pull = weights
        if cost == "absolute":
            soft = _SOFT[step % len(_SOFT)] * costs / weights.sum()
            pull = weights / np.maximum(np.abs(lengths - wanted), soft[:, None] + _TINY)
        means = _step(points, lengths, wanted, anchors, pull)
        moved = points + _BEYOND * (means - points)
        moved_lengths = _lengths(moved, anchors)
        moved_costs = _costs(moved_lengths - wanted, weights, cost)
        better = moved_costs < costs
        gain = float((costs - moved_costs)[better].sum())
        if cost == "squared" and gain <= tolerance * float(costs.sum()):
            break
        points = np.where(better[:, None], moved, points)
        lengths = np.where(better[:, None], moved_lengths, lengths)
        costs = np.where(better, moved_costs, costs)
    return points


def _step(points: Floats, lengths: Floats, wanted: Floats, anchors: Floats, pull: Floats) -> Floats:
    """Means (b, k), weighed by the pull, of where lines from the anchors meet their spheres.

    A point on an anchor is taken to lie from it along the first axis.
    """
    small = _CLOSE * float(wanted.max()) + _TINY
    reach = wanted / np.maximum(lengths, small)
    reach *= pull
    touching = lengths <= small
    reach[touching] = 0.0
    sums: Floats = pull @ anchors - reach @ anchors + reach.sum(axis=1)[:, None] * points
    if touching.any():
        sums[:, 0] += np.where(touching, pull * wanted, 0.0).sum(axis=1)
    means: Floats = sums / pull.sum(axis=-1, keepdims=True)
    return means
