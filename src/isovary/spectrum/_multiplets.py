"""Repeated eigenvalues, and how many pairs to take so that none is cut."""

from __future__ import annotations

import numpy as np

from ..records import Eigenpairs
from ._accuracy import first_gap


def with_spare(count: int, size: int) -> int:
    """So many pairs of ``size`` unknowns are to be solved for if ``count`` start another solve."""
    return max(count, min(count + max(8, count // 10), size - 2))


def first_pairs(pairs: Eigenpairs, count: int) -> Eigenpairs:
    """The first ``count`` pairs and the other copies of the last one."""
    values = pairs.values * pairs.area
    whole = first_gap(values, np.zeros(len(values)), count)
    return pairs.truncate(whole or len(values))


def drop_cut_multiplet(pairs: Eigenpairs) -> Eigenpairs:
    """Leave out the last pairs where the count cuts a multiplet of a symmetric surface.

    300 pairs cut the l = 17 shell of a sphere (17^2 = 289 below, 18^2 = 324
    above), and a part of a shell is no symmetric signature. If the last 15 % of
    the pairs hold a gap of at least eight mean spacings 4 pi / area (Weyl), the
    spectrum is cut there; a generic surface has no such gap and keeps all.

    Returns
    -------
    Eigenpairs
        The given pairs, or fewer.

    Examples
    --------
    40 pairs of a sphere become the 36 of the shells l = 0 to 5:

    >>> from isovary.laplacian import fem
    >>> from isovary.shapes import icosphere
    >>> from isovary.spectrum import eigenpairs
    >>> len(drop_cut_multiplet(eigenpairs(fem(icosphere(3)), 40)).values)
    36
    """
    first = int(0.85 * len(pairs.values))
    gaps = np.diff(pairs.values[first:])
    widest = 8 * 4 * np.pi / pairs.area
    if len(gaps) == 0 or gaps.max() < widest:
        return pairs
    return pairs.truncate(first + int(np.argmax(gaps)) + 1)
