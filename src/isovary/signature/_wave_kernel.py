"""The wave kernel signature."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ArgumentError
from ..geometry import Floats
from ..records import Eigenpairs
from ._energies import WIDTH_IN_STEPS
from ._logarithmic import log_step


def wave_kernel_signature(
    pairs: Eigenpairs, energies: ArrayLike, *, width: float | None = None
) -> Floats:
    """Mean probability to find a quantum particle of about a given energy at a node.

    WKS(x, E) = sum_i w_i phi_i(x)^2 / sum_i w_i,
    w_i = exp(-(log E - log lambda_i)^2 / (2 width^2)), over the nonzero eigenvalues.

    Its mean over the surface is 1 / area at every energy. Where the heat kernel
    signature mixes all eigenvalues below 1 / t, a band of them speaks here, so
    details are not covered by the large shape. The price is that it reacts more
    to a shift of eigenvalues, and has no reading as curvature.

    Parameters
    ----------
    pairs : Eigenpairs
        k pairs on n nodes.
    energies : array (T,)
        Energies, 1/length^2, positive: see :func:`isovary.wave_energies`. Use one
        array for all surfaces of a comparison.
    width : float, optional
        Standard deviation of the filters in log energy. Default: seven steps of the
        logarithmic energies. A wide one averages more eigenvalues and is steadier,
        a narrow one separates more. An energy further away from all eigenvalues
        than the width gets the nearest ones.

    Returns
    -------
    array (n, T)
        Unit 1/length^2.

    Raises
    ------
    ArgumentError
        A02 for energies that are not positive, a width that is not, no nonzero
        eigenvalue, or energies that are not logarithmic and no width.

    Notes
    -----
    Cost: one matrix product, 2 n k T operations. A sum of squares, so no sign
    and no rotation within a repeated eigenvalue enters.

    References
    ----------
    M. Aubry, U. Schlickewei and D. Cremers, *The wave kernel signature: a quantum
    mechanical approach to shape analysis*, ICCV Workshops 2011, 1626-1633, section 4.

    Examples
    --------
    On the unit sphere all places are equal, so it is the mean, 1 / (4 pi) = 0.0796:

    >>> from isovary.laplacian import fem
    >>> from isovary.shapes import icosphere
    >>> from isovary.spectrum import eigenpairs
    >>> pairs = eigenpairs(fem(icosphere(3)), 36)
    >>> signature = wave_kernel_signature(pairs, [3.0, 10.0], width=0.5)
    >>> signature[0].round(4).tolist()
    [0.0796, 0.0796]
    """
    first = pairs.zero_count
    levels = np.asarray(energies, dtype=float)
    sigma = WIDTH_IN_STEPS * log_step("energies", levels) if width is None else width
    if not (sigma > 0 and (levels > 0).all() and first < len(pairs.values)):
        raise ArgumentError(
            "A02",
            "energies, width: expected positive ones and a nonzero eigenvalue, got a smallest "
            f"energy of {levels.min(initial=np.inf):g}, a width of {sigma:g} and "
            f"{len(pairs.values) - first} nonzero eigenvalues",
        )
    distance = np.subtract.outer(np.log(pairs.values[first:]), np.log(levels)) / sigma
    # relative to the largest weight of each energy, so that their sum is at least 1
    weights = np.exp(((distance**2).min(axis=0) - distance**2) / 2)
    signature: Floats = pairs.vectors[:, first:] ** 2 @ (weights / weights.sum(axis=0))
    return signature
