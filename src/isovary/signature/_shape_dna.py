"""The spectrum as a signature of the whole surface."""

from __future__ import annotations

from ..geometry import Floats
from ..records import Eigenpairs


def shape_dna(pairs: Eigenpairs, *, unit_area: bool = False) -> Floats:
    """Eigenvalues in ascending order: one signature of the whole surface, not of its places.

    They need no correspondence of points, and tell that, not where, two surfaces
    differ. Equal ones do not prove equal surfaces, but different ones prove
    different surfaces. Compare the same number of them, lowest first.

    Parameters
    ----------
    pairs : Eigenpairs
        k pairs.
    unit_area : bool
        Multiply by the area, so that a change of size alone changes nothing.

    Returns
    -------
    array (k,)
        Unit 1/length^2; dimensionless with ``unit_area``.

    Notes
    -----
    Cost: none. By Weyl's law lambda_i area tends to 4 pi i, the more slowly the
    longer a rim is.

    References
    ----------
    M. Reuter, F.-E. Wolter and N. Peinecke, *Laplace-Beltrami spectra as 'Shape-DNA' of
    surfaces and solids*, Computer-Aided Design 38 (2006) 342-366, section 2.

    Examples
    --------
    On a sphere of any radius lambda_2 area = 2 * 4 pi = 25.13:

    >>> from isovary.laplacian import fem
    >>> from isovary.shapes import icosphere
    >>> from isovary.spectrum import eigenpairs
    >>> round(float(shape_dna(eigenpairs(fem(icosphere(3)), 9), unit_area=True)[1]), 2)
    25.13
    """
    return pairs.values * (pairs.area if unit_area else 1.0)
