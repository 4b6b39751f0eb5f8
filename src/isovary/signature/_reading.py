"""What times and values of the heat kernel signature mean as lengths and curvatures."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ArgumentError
from ..geometry import Floats


def diffusion_radius(times: ArrayLike) -> Floats:
    """Root mean square distance that heat has travelled in the plane: what a time sees.

    r = 2 sqrt(t), since the mean of the squared distance under exp(-r^2 / (4 t)) / (4 pi t)
    is 4 t. On a curved surface it is right as long as r is small against the radii of
    curvature and the distance to a rim; on a closed one it has no meaning beyond the
    surface's own size.

    Parameters
    ----------
    times : array (T,)
        Diffusion times, length^2.

    Returns
    -------
    array (T,)
        Length.

    Raises
    ------
    ArgumentError
        A02 for a negative time.

    Notes
    -----
    Cost: none.

    References
    ----------
    J. Crank, *The mathematics of diffusion*, 2nd ed., Oxford 1975, section 3.2.1.

    Examples
    --------
    >>> diffusion_radius([0.25, 1.0]).tolist()
    [1.0, 2.0]
    """
    values = np.asarray(times, dtype=float)
    if (values < 0).any():
        raise ArgumentError("A02", f"times: expected none below 0, got {np.nanmin(values):g}")
    radius: Floats = 2 * np.sqrt(values)
    return radius


def implied_curvature(signature: Floats, times: ArrayLike) -> Floats:
    """Gaussian curvature that the heat kernel signature implies at each time.

    K(x, t) = 3 (4 pi t HKS(x, t) - 1) / t, from 4 pi t HKS = 1 + K t / 3 + O(t^2).
    Read it a little above the smallest time that the k pairs resolve, from about
    5 ln 10 / lambda_k on (:func:`isovary.diffusion_times` starts at 4): at larger times it
    is a mean over the distance 2 sqrt(t) and more, on a unit sphere 1 + t / 5; at smaller
    ones the terms left out, and the mesh's error, are divided by t and drown it. Within
    2 sqrt(t) of a rim it is the rim that is read, not curvature.

    Parameters
    ----------
    signature : array (n, T)
        Heat kernel signature, 1/length^2.
    times : array (T,)
        Its diffusion times, length^2.

    Returns
    -------
    array (n, T)
        Unit 1/length^2; NaN where the signature is.

    Raises
    ------
    ArgumentError
        A03 for a number of times that is not that of the columns, A02 for times that
        are not positive.

    Notes
    -----
    Cost: n T operations. An error e of 4 pi t HKS becomes one of 3 e / t.

    References
    ----------
    H. P. McKean and I. M. Singer, *Curvature and the eigenvalues of the Laplacian*, J.
    Differential Geometry 1 (1967) 43-69, section 4.

    Examples
    --------
    On the unit sphere 4 pi t HKS = 1 + t / 3 + t^2 / 15 + ..., so K = 1 + 0.1 / 5 at t = 0.1:

    >>> from isovary.laplacian import fem
    >>> from isovary.shapes import icosphere
    >>> from isovary.signature import heat_kernel_signature
    >>> from isovary.spectrum import eigenpairs
    >>> signature = heat_kernel_signature(eigenpairs(fem(icosphere(3)), 225), [0.1])
    >>> round(float(implied_curvature(signature, [0.1])[0, 0]), 2)
    1.02
    """
    values = np.atleast_1d(np.asarray(times, dtype=float))
    if signature.shape[1:] != values.shape:
        raise ArgumentError(
            "A03",
            "signature, times: expected shapes (n, T) and (T,), got "
            f"{signature.shape} and {values.shape}",
        )
    if not (values > 0).all():
        raise ArgumentError("A02", f"times: expected positive ones, got {values.min():g}")
    curvature: Floats = 3 * (4 * np.pi * values * signature - 1) / values
    return curvature
