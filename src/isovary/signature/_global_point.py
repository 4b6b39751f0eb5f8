"""The global point signature."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ArgumentError
from ..geometry import Floats
from ..records import Eigenpairs


def global_point_signature(pairs: Eigenpairs, numbers: ArrayLike | None = None) -> Floats:
    """Eigenvectors over the roots of their eigenvalues: the place of a node in the whole.

    GPS_i(x) = phi_i(x) / sqrt(lambda_i) over the nonzero eigenvalues. The scalar
    product of two nodes' rows tends to the Green's function of the Laplacian, and
    no two places of a surface have equal rows.

    The sign of each column is arbitrary, and so is any rotation among the columns
    of a repeated eigenvalue; where two eigenvalues come close, a small change of
    the surface turns their columns. So those of two surfaces must not be subtracted
    one by one: use it to look at one surface. The sum of squares over all columns
    of a repeated eigenvalue is free of this.

    Parameters
    ----------
    pairs : Eigenpairs
        k pairs on n nodes.
    numbers : array (m,), optional
        Which columns: 1 is the first nonzero eigenvalue. Default: all of them.

    Returns
    -------
    array (n, m)
        Dimensionless, and equal for scaled surfaces.

    Raises
    ------
    ArgumentError
        A02 for a number that is not whole, or beyond the nonzero eigenvalues.

    Notes
    -----
    Cost: n m operations.

    References
    ----------
    R. M. Rustamov, *Laplace-Beltrami eigenfunctions for deformation invariant shape
    representation*, SGP 2007, 225-233, section 4; thesis, section 4.2.6.

    Examples
    --------
    The squares of the sphere's three eigenvectors with lambda = 2 sum up to 3 / (4 pi),
    so those of the first three columns to 3 / (8 pi) = 0.1194:

    >>> from isovary.laplacian import fem
    >>> from isovary.shapes import icosphere
    >>> from isovary.spectrum import eigenpairs
    >>> signature = global_point_signature(eigenpairs(fem(icosphere(3)), 9), [1, 2, 3])
    >>> round(float((signature[0] ** 2).sum()), 4)
    0.1194
    """
    first = pairs.zero_count
    most = len(pairs.values) - first
    chosen = np.arange(1, most + 1) if numbers is None else np.ravel(np.asarray(numbers))
    if not ((chosen >= 1) & (chosen <= most) & (chosen == np.floor(chosen))).all():
        raise ArgumentError(
            "A02",
            f"numbers: expected whole numbers in [1, {most}], one for each nonzero eigenvalue, "
            f"got {np.array2string(chosen, threshold=6)}",
        )
    index = first - 1 + chosen.astype(np.int64)
    signature: Floats = pairs.vectors[:, index] / np.sqrt(pairs.values[index])
    return signature
