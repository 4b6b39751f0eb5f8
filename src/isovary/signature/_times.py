"""The diffusion times that eigenpairs resolve."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ArgumentError
from ..geometry import Floats
from ..records import Eigenpairs


def checked_times(times: ArrayLike) -> Floats:
    """The times as an array (T,); ArgumentError A02 for negative or NaN ones."""
    values = np.atleast_1d(np.asarray(times, dtype=float))
    if not (values >= 0).all():
        raise ArgumentError(
            "A02", f"times: expected none below 0 and no NaN, got {values[~(values >= 0)][0]:g}"
        )
    return values


def diffusion_times(pairs: Eigenpairs, count: int = 100) -> Floats:
    """Logarithmic diffusion times that the eigenpairs resolve.

    From 4 ln 10 / lambda_k, where the last pair has decayed to 1e-4, to
    4 ln 10 / lambda_2, where the first non-constant one has.

    Parameters
    ----------
    pairs : Eigenpairs
        Of the base surface: one array of times serves every surface of a comparison.
    count : int
        Number of times.

    Returns
    -------
    array (count,)
        Ascending; length^2.

    Raises
    ------
    ArgumentError
        A02 for fewer than two times, or no non-zero eigenvalue.

    References
    ----------
    Sun, Ovsjanikov and Guibas (2009), section 4; thesis, section 4.1.3.

    Examples
    --------
    The unit sphere's first non-zero eigenvalue is 2, so the longest time is 2 ln 10 = 4.605:

    >>> from isovary.laplacian import fem
    >>> from isovary.shapes import icosphere
    >>> from isovary.spectrum import eigenpairs
    >>> round(float(diffusion_times(eigenpairs(fem(icosphere(3)), 9))[-1]), 3)
    4.605
    """
    first = pairs.zero_count
    if count < 2 or first >= len(pairs.values):
        raise ArgumentError(
            "A02",
            f"count: expected at least 2 times and a non-zero eigenvalue, got {count} times and "
            f"{len(pairs.values) - first} non-zero eigenvalues",
        )
    reach = 4 * np.log(10)
    return np.geomspace(reach / pairs.values[-1], reach / pairs.values[first], count)
