"""The heat kernel signature."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..geometry import Floats
from ..records import Eigenpairs
from ._times import checked_times


def heat_kernel_signature(pairs: Eigenpairs, times: ArrayLike) -> Floats:
    """Heat that is still at a node a time t after a unit of it was put there.

    HKS(x, t) = sum_i exp(-lambda_i t) phi_i(x)^2. For small t it measures the
    Gaussian curvature K, 4 pi t HKS = 1 + K t / 3 + O(t^2); for large t it
    tends to 1 / area. With k pairs it is right for t >= 4 ln 10 / lambda_k,
    where the first term left out has a weight of 1e-4.

    Parameters
    ----------
    pairs : Eigenpairs
        k pairs on n nodes.
    times : array (T,)
        Diffusion times, length^2. Use one array for all surfaces of a comparison.

    Returns
    -------
    array (n, T)
        Unit 1/length^2.

    Raises
    ------
    ArgumentError
        A02 for times below 0 or NaN.

    Notes
    -----
    Cost: one matrix product, 2 n k T operations. A sum of squares, so no sign
    and no rotation within a repeated eigenvalue enters.

    References
    ----------
    J. Sun, M. Ovsjanikov and L. Guibas, *A concise and provably informative
    multi-scale signature based on heat diffusion*, Computer Graphics Forum 28
    (2009) 1383-1392; thesis, section 3.1.2.

    Examples
    --------
    The unit sphere has K = 1; at t = 0.1, 4 pi t HKS = 1 + t/3 + t^2/15 = 1.034 everywhere:

    >>> from isovary.laplacian import fem
    >>> from isovary.shapes import icosphere
    >>> from isovary.spectrum import eigenpairs
    >>> signature = heat_kernel_signature(eigenpairs(fem(icosphere(3)), 225), [0.1])
    >>> round(4 * np.pi * 0.1 * float(signature[0, 0]), 3)
    1.034
    """
    decay = np.exp(-np.outer(pairs.values, checked_times(times)))
    signature: Floats = pairs.vectors**2 @ decay
    return signature
