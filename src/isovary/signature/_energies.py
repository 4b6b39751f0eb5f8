"""The energies of the wave kernel signature."""

from __future__ import annotations

import numpy as np

from ..errors import ArgumentError
from ..geometry import Floats
from ..records import Eigenpairs

WIDTH_IN_STEPS = 7
"""Width of the wave kernel signature's filters in steps of log energy."""


def wave_energies(pairs: Eigenpairs, count: int = 100) -> Floats:
    """Logarithmic energies that the eigenpairs resolve, for the wave kernel signature.

    log E from log lambda_2 + 2 sigma to log lambda_k - 2 sigma, where lambda_2 is
    the first nonzero eigenvalue and sigma = 7 steps the default width of the
    filters: so those at the ends do not reach far beyond the eigenvalues. With
    N energies the step is log(lambda_k / lambda_2) / (N - 1 + 28).

    Parameters
    ----------
    pairs : Eigenpairs
        Of the base surface: one array of energies serves every surface of a comparison.
    count : int
        Number of energies. It sets the width too: with fewer of them the filters
        are wider, and the energies keep more to the middle.

    Returns
    -------
    array (count,)
        Ascending; 1/length^2, as the eigenvalues.

    Raises
    ------
    ArgumentError
        A02 for fewer than two energies, or no two different nonzero eigenvalues.

    Notes
    -----
    Some programs take the step before the ends are pulled inward, 7 (log lambda_k -
    log lambda_2) / N for sigma, which leaves no energies for N <= 28; others end at
    log(lambda_k) / 1.02, which depends on the unit of length.

    References
    ----------
    M. Aubry, U. Schlickewei and D. Cremers, *The wave kernel signature: a quantum
    mechanical approach to shape analysis*, ICCV Workshops 2011, 1626-1633, section 4.

    Examples
    --------
    Nine pairs of the unit sphere end at 6 and start, after the 0, at 2. The first of 100
    energies lies 14 of 127 steps inward, at 2 * 3^(14 / 127) = 2.26:

    >>> from isovary.laplacian import fem
    >>> from isovary.shapes import icosphere
    >>> from isovary.spectrum import eigenpairs
    >>> round(float(wave_energies(eigenpairs(fem(icosphere(3)), 9))[0]), 2)
    2.26
    """
    values = pairs.values[pairs.zero_count :]
    if count < 2 or len(values) == 0 or values[-1] <= values[0]:
        raise ArgumentError(
            "A02",
            "count: expected at least 2 energies and 2 different nonzero eigenvalues, got "
            f"{count} energies and {len(np.unique(values))} different eigenvalues",
        )
    inward = 2 * WIDTH_IN_STEPS
    step = np.log(values[-1] / values[0]) / (count - 1 + 2 * inward)
    energies: Floats = values[0] * np.exp(step * (inward + np.arange(count)))
    return energies
