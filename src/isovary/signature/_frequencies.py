"""Frequencies that the columns of the scale-invariant signature belong to."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ArgumentError
from ..geometry import Floats
from ._logarithmic import extended


def frequencies_of(times: ArrayLike, count: int = 16) -> Floats:
    """Frequencies of the columns of the scale-invariant heat kernel signature.

    f_j = j / L, where L is the length of the window in log t: that of the
    times, three decades below and one above.

    Parameters
    ----------
    times : array (T,)
        Logarithmic diffusion times, length^2.
    count : int
        Number of frequencies.

    Returns
    -------
    array (count,)
        Cycles while t grows by the factor e; the first is 0.

    Raises
    ------
    ArgumentError
        A02 for times that are not logarithmic, or a count that they do not resolve.

    Examples
    --------
    30 times, ten in a decade, make a window of 3 + 3 + 1 = 7 decades, 7 ln 10 = 16.12 e-folds:

    >>> frequencies_of(np.geomspace(0.1, 10**1.9, 30), 3).round(4).tolist()
    [0.0, 0.062, 0.1241]
    """
    grid, step = extended(times)
    most = len(grid) // 2 + 1
    if not 1 <= count <= most:
        raise ArgumentError(
            "A02",
            f"frequencies: expected 1 to {most}, which these times resolve, got {count}; "
            "use closer times for more",
        )
    return np.arange(count) / (len(grid) * step)
