"""Dirichlet boundaries: functions that are zero at chosen nodes."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ArgumentError
from ..records import Laplacian


def fix_nodes(laplacian: Laplacian, nodes: ArrayLike) -> Laplacian:
    """The same operator on the functions that are 0 at the given nodes (Dirichlet boundary).

    The rows and columns of these nodes are left out, so the eigenvalues can only grow, and
    none is 0 on a component that has a fixed node. The eigenvectors are 0 there, and so are
    the heat and the wave kernel.

    Parameters
    ----------
    laplacian : Laplacian
    nodes : array of int
        Nodes to fix, such as :func:`isovary.rim_nodes` of an open surface. May be
        empty; nodes that are fixed already stay so.

    Returns
    -------
    Laplacian
        Of the same nodes and area, with fewer unknowns.

    Raises
    ------
    ArgumentError
        A02 for an index that is no node, or if no unknown is left; A03 for a mask.

    References
    ----------
    G. Dziuk and C. M. Elliott, *Finite element methods for surface PDEs*, Acta Numerica 22
    (2013) 289-396, section 4.

    Examples
    --------
    Of the four nodes of two triangles one is left:

    >>> from isovary.laplacian import fem
    >>> from isovary.records import Surface
    >>> square = Surface([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> fix_nodes(fem(square), [1, 2, 3])
    Laplacian(4 nodes, 3 fixed at 0, 1 entries)
    """
    fixed = np.zeros(laplacian.nodes, dtype=bool)
    chosen = np.asarray(nodes)
    if chosen.size and chosen.dtype.kind not in "iu":
        raise ArgumentError(
            "A03",
            f"nodes: expected indices, got dtype {chosen.dtype}; np.flatnonzero(mask) makes them "
            "of a mask",
        )
    chosen = chosen.astype(np.int64)
    if ((chosen < 0) | (chosen >= laplacian.nodes)).any():
        raise ArgumentError(
            "A02",
            f"nodes: expected indices in [0, {laplacian.nodes}), got {chosen.min()} to "
            f"{chosen.max()}",
        )
    fixed[chosen] = True
    kept = ~fixed[laplacian.unknowns]
    if not kept.any():
        raise ArgumentError(
            "A02",
            f"nodes: expected some to stay free, got all {laplacian.nodes} fixed; use a finer mesh",
        )
    stiffness, mass = (matrix[kept][:, kept] for matrix in (laplacian.stiffness, laplacian.mass))
    unknowns = laplacian.unknowns[kept]
    return Laplacian(stiffness, mass, unknowns, laplacian.nodes, laplacian.area)
