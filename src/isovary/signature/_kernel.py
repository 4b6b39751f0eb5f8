"""The heat kernel between chosen nodes and all others."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ArgumentError
from ..geometry import Floats
from ..records import Eigenpairs
from ._times import checked_times


def heat_kernel(pairs: Eigenpairs, times: ArrayLike, sources: ArrayLike) -> Floats:
    """Heat that has come to every node a time t after a unit of it was put at a source.

    k_t(x, y) = sum_i exp(-lambda_i t) phi_i(x) phi_i(y). It is symmetric in x and y,
    its integral over the surface is 1, and it tends to 1 / area; on the diagonal it is
    the heat kernel signature. It is not smaller than 0, but with k pairs ripples of
    either sign remain far from the source before t = 4 ln 10 / lambda_k.

    Parameters
    ----------
    pairs : Eigenpairs
        k pairs on n nodes.
    times : array (T,)
        Diffusion times, length^2.
    sources : array (s,) of int
        Nodes y.

    Returns
    -------
    array (n, s, T)
        Unit 1/length^2.

    Raises
    ------
    ArgumentError
        A02 for a source that is no node, or times below 0 or NaN.

    Notes
    -----
    Cost: 2 n k s T operations. Products of an eigenvector with itself, so no sign and
    no rotation within a repeated eigenvalue enters.

    References
    ----------
    Thesis, section 3.1.1; J. Sun, M. Ovsjanikov and L. Guibas, *A concise and provably
    informative multi-scale signature based on heat diffusion*, Computer Graphics Forum
    28 (2009) 1383-1392, section 2.

    Examples
    --------
    Late heat is the mean and what is left of the sphere's l = 1 shell, whose eigenvectors
    change sign at the other side: 1 / (4 pi) (1 - 3 exp(-2 * 2)) = 0.0752 there at t = 2:

    >>> from isovary.laplacian import fem
    >>> from isovary.shapes import icosphere
    >>> from isovary.spectrum import eigenpairs
    >>> sphere = icosphere(3)
    >>> kernel = heat_kernel(eigenpairs(fem(sphere), 36), [2.0], [0])
    >>> antipode = (sphere.points @ sphere.points[0]).argmin()
    >>> round(float(kernel[antipode, 0, 0]), 4)
    0.0752
    """
    nodes = np.atleast_1d(np.asarray(sources))
    count = len(pairs.vectors)
    if nodes.dtype.kind not in "iu" or not ((nodes >= 0) & (nodes < count)).all():
        raise ArgumentError(
            "A02",
            f"sources: expected indices of nodes in [0, {count}), got "
            f"{np.array2string(nodes, threshold=6)}",
        )
    decay = np.exp(-np.outer(pairs.values, checked_times(times)))
    kernel: Floats = np.stack(
        [(pairs.vectors * pairs.vectors[node]) @ decay for node in nodes], axis=1
    )
    return kernel
