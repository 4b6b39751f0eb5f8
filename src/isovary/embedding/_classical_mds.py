"""Classical multidimensional scaling, and of many rows that of some, which place the others."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ArgumentError
from ..geometry import Bools, Floats, Ints
from ..row_distances import Metric, check_metric, checked_weights, distances

_BLOCK = 1_000_000  # distances at a time: 8 MB
_ROUNDING = 1e-12  # of the largest eigenvalue: one below is taken for 0


class Known(NamedTuple):
    """The known rows (m, T), their weights (m,) of sum 1, and which (n,) of all they are."""

    data: Floats
    weights: Floats
    known: Bools

    def spread(self, points: Floats) -> Floats:
        """Points (m, k) of the known rows at their places among all, NaN at the others."""
        result = np.full((len(self.known), points.shape[1]), np.nan)
        result[self.known] = points
        return result


class Landmarks(NamedTuple):
    """The rows (l, T) that are embedded first, and the share (l,) of all that each stands for."""

    data: Floats
    weights: Floats


def classical_mds(
    rows: ArrayLike,
    dimensions: int = 3,
    *,
    metric: Metric = "l1",
    landmarks: int = 1000,
    weights: ArrayLike | None = None,
    rng: int | np.random.Generator = 0,
) -> Floats:
    """Points whose scalar products are nearest to those that the rows' distances imply.

    With the squared distances D of the rows, their weights w of sum 1, W = diag(w) and
    J = I - 1 w^T, the doubly centred B = -1/2 J D J^T would be the scalar products of points
    around their mean. The leading eigenpairs (lambda, v) of W^1/2 B W^1/2 give the axes
    W^-1/2 v sqrt(lambda); lambda is the variance along the axis. For the metric l2 these are
    the principal components.

    Distances in L1 are not those of any Euclidean points: B then has negative eigenvalues, which
    are left out, and no choice of ``dimensions`` brings the points to the rows' distances. Where
    fewer eigenvalues than ``dimensions`` are positive the other axes are 0. Distances come out
    too small where axes are missing; :func:`universal_mds` balances them.

    Of more rows than ``landmarks``, only so many are embedded like this: half of them drawn with
    a chance in proportion to the weights, so that they are like the rest; each of the other half
    the row farthest from all landmarks so far, so that a small group of rows far from the others
    is not missed. A landmark weighs what the rows nearest to it weigh together. All rows are
    then placed by their distances to the landmarks, which is exact where ``dimensions`` axes
    are.

    The points have mean 0 and their axes are principal, the longest first. Each axis points to
    where the sums of the rows grow; one along which they do not (a correlation below 1e-6) to
    its point farthest from 0. So the same rows give the same axes, in any order; axes of equal
    variance are undefined.

    Parameters
    ----------
    rows : array (n, T)
        For example a change. Rows with NaN or infinity are unknown.
    dimensions : int
        Number of axes.
    metric : {"l1", "l2"}
        Distance of two rows: sum of the absolute differences, as in the groups; or the root of
        the sum of the squares.
    landmarks : int
        Number of rows up to which all are embedded together. 1000 take about a second.
    weights : array (n,), optional
        Positive, such as the area of each node. Default: all alike.
    rng : int or Generator
        Seed of the landmarks: the same seed gives the same points.

    Returns
    -------
    array (n, dimensions)
        In the unit of the rows; NaN where a row is unknown.

    Raises
    ------
    ArgumentError
        A02 for fewer than 1 dimension, no more landmarks than dimensions, an unknown metric or
        weights that are not positive; A03 for rows that are not (n, T) or weights that are not
        (n,).

    Notes
    -----
    Cost: with l landmarks, 2 n l T operations for the distances and l^3 for the eigenpairs;
    memory for l^2 numbers besides the rows.

    References
    ----------
    W. S. Torgerson, *Multidimensional scaling: I. Theory and method*, Psychometrika 17 (1952)
    401-419. V. de Silva, J. B. Tenenbaum, *Sparse multidimensional scaling using landmark
    points*, Stanford University (2004), sections 2.2 and 2.3; the weights are ours.

    Examples
    --------
    The rows lie on a line, in L1 at 0, 2 and 7; their mean is 3:

    >>> rows = np.array([[0.0, 0.0], [1.0, 1.0], [np.nan, 0.0], [3.5, 3.5]])
    >>> (classical_mds(rows, 1).round(9) + 0.0).ravel().tolist()
    [-3.0, -1.0, nan, 4.0]
    """
    known = known_rows(rows, dimensions, metric, landmarks, weights)
    marks = chosen_landmarks(known, landmarks, metric, np.random.default_rng(rng))
    return known.spread(principal(classical(known, marks, dimensions, metric), known))


def known_rows(
    rows: ArrayLike, dimensions: int, metric: Metric, landmarks: int, weights: ArrayLike | None
) -> Known:
    """The rows without NaN, once all arguments are checked."""
    values = np.asarray(rows, dtype=float)
    if values.ndim != 2:
        raise ArgumentError("A03", f"rows: expected shape (n, T), got {values.shape}")
    if dimensions < 1:
        raise ArgumentError("A02", f"dimensions: expected 1 or more, got {dimensions}")
    check_metric(metric)
    if landmarks <= dimensions:
        raise ArgumentError(
            "A02",
            f"landmarks: expected more than the {dimensions} dimensions, got {landmarks}; "
            "1000 are a good choice",
        )
    heavy = checked_weights(weights, len(values))
    known = np.isfinite(values).all(axis=1)
    total = heavy[known].sum()
    return Known(values[known], heavy[known] / total if known.any() else heavy[known], known)


def blocks(count: int, width: int) -> list[slice]:
    """Cut range(count) so that a table of ``width`` columns has about 8 MB a piece."""
    step = max(1, _BLOCK // max(width, 1))
    return [slice(start, start + step) for start in range(0, count, step)]


def chosen_landmarks(
    known: Known, most: int, metric: Metric, generator: np.random.Generator
) -> Landmarks:
    """All rows if there are no more than ``most``; else half drawn, half the farthest."""
    data, weights = known.data, known.weights
    if len(data) <= most:
        return Landmarks(data, weights)
    drawn = generator.choice(len(data), most - most // 2, replace=False, p=weights)
    chosen: list[int] = [int(row) for row in np.sort(drawn)]
    owner, nearest = _nearest(data, data[chosen], metric)
    while len(chosen) < most and nearest.max() > 0:
        farthest = int(nearest.argmax())
        fresh = distances(data, data[farthest : farthest + 1], metric)[:, 0]
        closer = fresh < nearest
        owner[closer], nearest[closer] = len(chosen), fresh[closer]
        chosen.append(farthest)
    shares = np.bincount(owner, weights=weights, minlength=len(chosen)).astype(float)
    apart = shares > 0  # one that equals another has no rows
    return Landmarks(data[chosen][apart], shares[apart])


def _nearest(data: Floats, others: Floats, metric: Metric) -> tuple[Ints, Floats]:
    """Index (m,) of the nearest of the others and the distance (m,) to it."""
    owner, nearest = np.empty(len(data), dtype=np.int64), np.empty(len(data))
    for part in blocks(len(data), len(others)):
        table = distances(data[part], others, metric)
        owner[part] = table.argmin(axis=1)
        nearest[part] = table.min(axis=1)
    return owner, nearest


def classical(known: Known, marks: Landmarks, dimensions: int, metric: Metric) -> Floats:
    """Points (m, dimensions) of the known rows by their distances to the landmarks."""
    if len(known.data) == 0:
        return np.empty((0, dimensions))
    squares = distances(marks.data, marks.data, metric) ** 2
    points, variances = axes(squares, marks.weights, dimensions)
    if len(marks.data) == len(known.data):
        return points
    mean = marks.weights @ squares
    back = marks.weights[:, None] * points / np.where(variances > 0, -2 * variances, np.inf)
    placed = np.empty((len(known.data), dimensions))
    for part in blocks(len(placed), len(mean)):
        placed[part] = (distances(known.data[part], marks.data, metric) ** 2 - mean) @ back
    return placed


def axes(squares: Floats, weights: Floats, dimensions: int) -> tuple[Floats, Floats]:
    """Points (l, dimensions) of squared distances (l, l), and the variance along each axis."""
    from scipy.linalg import eigh

    count = len(weights)
    centred = squares - weights @ squares
    centred -= (centred @ weights)[:, None]
    root = np.sqrt(weights)
    centred *= -0.5 * root[:, None] * root
    kept = min(dimensions, count)
    values, vectors = eigh(centred, subset_by_index=[count - kept, count - 1])
    variances, points = np.zeros(dimensions), np.zeros((count, dimensions))
    positive = values[::-1] > _ROUNDING * max(float(values[-1]), 0.0)
    variances[:kept] = np.where(positive, values[::-1], 0.0)
    points[:, :kept] = vectors[:, ::-1] / root[:, None] * np.sqrt(variances[:kept])
    return points, variances


def principal(points: Floats, known: Known) -> Floats:
    """The points (m, k) moved and turned to mean 0 and principal axes with settled signs."""
    if len(points) == 0:
        return points
    centred = points - known.weights @ points
    variances, turn = np.linalg.eigh(centred.T @ (known.weights[:, None] * centred))
    turned: Floats = centred @ turn[:, ::-1]
    turned[:, variances[::-1] <= _ROUNDING * variances[-1]] = 0.0
    sums = known.data.sum(axis=1)
    sums = known.weights * (sums - known.weights @ sums)
    along = sums @ turned
    size = np.sqrt(np.maximum(variances[::-1], 0.0)) * np.linalg.norm(sums / known.weights**0.5)
    longest = turned[np.abs(turned).argmax(axis=0), np.arange(turned.shape[1])]
    signs = np.where(np.abs(along) > 1e-6 * size, along, longest)
    return turned * np.where(signs < 0, -1.0, 1.0)
