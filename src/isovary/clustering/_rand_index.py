"""How alike two groupings are."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ArgumentError
from ..geometry import Ints


def adjusted_rand_index(first: ArrayLike, second: ArrayLike) -> float:
    r"""How alike two groupings of the same things are, whatever their groups are called.

    Of all pairs, count those that lie together in both groupings, A; in the first, B; in the
    second, C. By chance A would be E = B C / (number of pairs). The index is

    .. math:: \frac{A - E}{(B + C) / 2 - E} .

    Parameters
    ----------
    first, second : array (n,)
        Group of each thing; what is below 0 in either is left out.

    Returns
    -------
    float
        1 for the same groups, 0 on average for independent ones, NaN for less than one pair.

    Raises
    ------
    ArgumentError
        A03 if the labels are not two arrays (n,).

    Notes
    -----
    Cost: n log n.

    References
    ----------
    L. Hubert, P. Arabie, *Comparing partitions*, J. Classification 2 (1985) 193-218, eq. 5.

    Examples
    --------
    Of 6 pairs A = 1, B = 2, C = 3, thus E = 1 and the index (1 - 1) / (2.5 - 1):

    >>> adjusted_rand_index([0, 0, 1, 1], [5, 5, 5, 2])
    0.0
    """
    one, other = np.asarray(first), np.asarray(second)
    if one.ndim != 1 or one.shape != other.shape:
        raise ArgumentError(
            "A03", f"second: expected labels (n,) as the first, got {one.shape} and {other.shape}"
        )
    both = (one >= 0) & (other >= 0)
    rows, columns = (np.unique(labels[both], return_inverse=True)[1] for labels in (one, other))
    pairs = _pairs(np.array([both.sum()]))
    if pairs < 1:
        return float("nan")
    cells = np.unique(np.stack([rows, columns]), axis=1, return_counts=True)[1]
    together, in_first, in_second = (
        _pairs(sizes) for sizes in (cells, np.bincount(rows), np.bincount(columns))
    )
    chance = in_first * in_second / pairs
    most = (in_first + in_second) / 2
    return 1.0 if most == chance else (together - chance) / (most - chance)


def _pairs(sizes: Ints) -> float:
    """Number of pairs within groups of these sizes."""
    large = sizes.astype(float)
    return float((large * (large - 1) / 2).sum())
