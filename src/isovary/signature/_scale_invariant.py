"""The scale-invariant heat kernel signature."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ArgumentError
from ..geometry import Floats
from ..records import Eigenpairs
from ._frequencies import frequencies_of
from ._logarithmic import extended

_EARLY, _LATE = 0.05, 1e-3  # slopes at the ends that change no frequency by 1 %


def scale_invariant_heat_kernel_signature(
    pairs: Eigenpairs, times: ArrayLike, *, frequencies: int = 16
) -> Floats:
    """Heat kernel signature (HKS) without the size of the surface, as a spectrum over log t.

    SI(x, f) = abs(integral of g(x, u) exp(-2 pi i f u) du),
    g = d log HKS / d log t = -t sum_i lambda_i w_i / sum_i w_i,
    with u = log t and w_i = exp(-lambda_i t) phi_i(x)^2.

    A surface s times as large has HKS(t / s^2) / s^2: the derivative of the
    logarithm takes the factor away, and the modulus the shift of u by 2 log s.
    This holds place by place, unlike a scaling to unit area, but what a size
    says is lost: choose it only if size means nothing.

    The spectrum falls by more than a thousand from the first to the last of the 16
    frequencies; the lowest ones hold nearly all of it. It depends on the number
    of pairs, so use one number for all surfaces of a comparison.

    Parameters
    ----------
    pairs : Eigenpairs
        k pairs on n nodes.
    times : array (T,)
        Diffusion times, length^2, with equal steps of their logarithm, such as
        :func:`isovary.diffusion_times`. Use one array for all surfaces of a comparison.
    frequencies : int
        Number of frequencies, from 0 on; :class:`isovary.SignatureKind` tells
        their values. The default reaches to about one cycle per e-fold of t;
        above it next to nothing is left, because heat makes g smooth.

    Returns
    -------
    array (n, frequencies)
        Dimensionless; NaN at nodes where all eigenvectors are 0, as on a
        Dirichlet rim: nothing is known there.

    Raises
    ------
    ArgumentError
        A02 for times that are not logarithmic, more frequencies than they resolve, or times
        that do not suit this surface: some three times as large or as small as another.

    Notes
    -----
    The derivative is exact for the given pairs. It is summed over the times, three
    decades below and one above. Further below it is proportional to t, because the
    pairs end, and its sum a geometric series; further above it has decayed. So a
    surface twice as large or as small does not meet an end of the window.
    On a surface with a Dirichlet rim the derivative would tend to -lambda_1 t instead;
    the lowest eigenvalue is therefore subtracted from all, which changes nothing where
    it is 0. Surfaces of several pieces with such rims are to be taken piece by piece.

    Cost: two matrix products, about 12 n k T operations for 100 times over two decades.

    References
    ----------
    M. M. Bronstein and I. Kokkinos, *Scale-invariant heat kernel signatures for
    non-rigid shape recognition*, CVPR 2010, 1704-1711, section 3. Their derivative is
    a difference of samples, their window has ends.

    Examples
    --------
    At frequency 0 stands what log HKS loses on the whole. On the unit sphere with 36
    pairs it falls from 36 / (4 pi) to 1 / (4 pi), by log 36 = 3.584:

    >>> from isovary.laplacian import fem
    >>> from isovary.shapes import icosphere
    >>> from isovary.spectrum import eigenpairs
    >>> pairs = eigenpairs(fem(icosphere(3)), 36)
    >>> spectrum = scale_invariant_heat_kernel_signature(pairs, np.geomspace(0.2, 5, 50))
    >>> round(float(spectrum[0, 0]), 3)
    3.584
    """
    cycles = frequencies_of(times, frequencies)
    slope, step = _log_slope(pairs, times)
    spectrum = np.fft.rfft(slope, axis=1)[:, :frequencies]
    ratio = np.exp(step * (2j * np.pi * cycles - 1))  # of the terms below the window
    spectrum += slope[:, :1] * ratio / (1 - ratio)
    result: Floats = step * np.abs(spectrum)
    return result


def _log_slope(pairs: Eigenpairs, times: ArrayLike) -> tuple[Floats, float]:
    """Return d log HKS / d log t (n, M) on the extended times, and the step of log t."""
    grid, step = extended(times)
    squares = pairs.vectors**2
    above = pairs.values - pairs.values[0]
    decay = np.exp(-np.outer(above, grid))
    heat = squares @ decay
    slope = np.full_like(heat, np.nan)
    np.divide(squares @ (above[:, None] * decay), heat, out=slope, where=heat > 0)
    slope *= -grid
    early, late = (np.nanmax(np.abs(slope[:, end]), initial=0.0) for end in (0, -1))
    if early > _EARLY or late > _LATE:
        raise ArgumentError(
            "A02",
            "times: expected so wide a range that the heat of every node comes to rest in it, got "
            f"a slope of its logarithm of {early:.2g} at the start (at most {_EARLY}) and "
            f"{late:.2g} at the end (at most {_LATE}); use times nearer to diffusion_times of this "
            "surface, and take parts with a Dirichlet rim one by one",
        )
    return slope, step
