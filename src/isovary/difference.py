"""Two signatures at corresponding points -> scaled change (thesis 4.1.5)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .errors import ArgumentError
from .geometry import Floats
from .records import Eigenpairs


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


def heat_trace_scale(pairs: Eigenpairs, times: ArrayLike) -> Floats:
    """Mean of the heat kernel signature over the surface, the scale that a change is divided by.

    w(t) = sum_i exp(-lambda_i t) / area. Unlike a sum over vertices it does not
    depend on how dense the mesh is.

    Returns
    -------
    array (T,)
        Unit 1/length^2.

    Examples
    --------
    On the unit sphere 4 pi t w(t) = 1 + t / 3 + t^2 / 15 for small t, 1.034 at t = 0.1:

    >>> from isovary.laplacian import fem
    >>> from isovary.shapes import icosphere
    >>> from isovary.spectrum import eigenpairs
    >>> scale = heat_trace_scale(eigenpairs(fem(icosphere(3)), 225), [0.1])
    >>> round(4 * np.pi * 0.1 * float(scale[0]), 3)
    1.034
    """
    decay = np.exp(-np.outer(pairs.values, np.asarray(times, dtype=float)))
    scale: Floats = decay.sum(axis=0) / pairs.area
    return scale


def signature_difference(
    base: Floats, perturbed: Floats, scale: Floats, *, parameter_step: float = 1.0
) -> Floats:
    """Scaled change of a signature: base minus perturbed, divided by the base's scale.

    change(x, t) = (base(x, t) - perturbed(x', t)) / w(t) / parameter_step.
    The thesis prints a product with w; its stated reason, that small times must
    not drown the large ones, and its source ask for the quotient.

    Parameters
    ----------
    base, perturbed : array (n, T)
        Signatures at corresponding points; NaN rows where there is no partner.
    scale : array (T,)
        Positive weights of the base, such as :func:`heat_trace_scale`. The same
        for both surfaces, or uniform growth would vanish.
    parameter_step : float
        Change of the simulation's parameter, to get a derivative.

    Returns
    -------
    array (n, T)
        Dimensionless (per parameter unit); NaN where a partner is missing.

    Raises
    ------
    ArgumentError
        A03 for unequal shapes, A02 for a scale that is not positive or a zero step.

    References
    ----------
    Thesis, section 4.1.5.

    Examples
    --------
    >>> signature_difference(np.array([[3.0, 2.0]]), np.array([[2.0, 2.0]]), np.array([4.0, 2.0]))
    array([[0.25, 0.  ]])
    """
    if base.shape != perturbed.shape or base.shape[1:] != scale.shape:
        raise ArgumentError(
            "A03",
            "signatures: expected equal shapes (n, T) and a scale (T,), got "
            f"{base.shape}, {perturbed.shape} and {scale.shape}",
        )
    if not (scale > 0).all() or parameter_step == 0:
        raise ArgumentError(
            "A02",
            "scale, parameter_step: expected positive weights and a step other than 0, got a "
            f"smallest weight of {scale.min():g} and a step of {parameter_step:g}",
        )
    change: Floats = (base - perturbed) / scale / parameter_step
    return change


def change_norm(change: Floats) -> Floats:
    """Mean over times of the absolute change of each node, the length of its vector in L1.

    Parameters
    ----------
    change : array (n, T)

    Returns
    -------
    array (n,)
        NaN where a partner is missing.

    Examples
    --------
    >>> change_norm(np.array([[0.25, -0.75]]))
    array([0.5])
    """
    norm: Floats = np.abs(change).mean(axis=1)
    return norm
