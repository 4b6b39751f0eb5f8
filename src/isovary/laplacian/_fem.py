"""Isoparametric finite elements of order 1 and 2."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..errors import MeshError
from ..geometry import (
    Floats,
    Ints,
    quadrature,
    rim_nodes,
    shape_functions,
    shape_gradients,
    tangents,
)
from ..records import Laplacian, Surface
from ._boundary import fix_nodes
from ._checks import check_surface

if TYPE_CHECKING:
    from scipy.sparse import csr_array


def fem(surface: Surface, *, lumped: bool = False, dirichlet: bool = False) -> Laplacian:
    """Finite-element Laplacian of a surface, with the elements' own order.

    stiffness_ij = integral grad N_i . G^-1 grad N_j sqrt(det G),
    mass_ij = integral N_i N_j sqrt(det G), with G the metric of the (curved)
    element. Eigenvalues of smooth surfaces converge with order 2 for flat linear and
    4 for curved quadratic elements; with lumped mass with order 2 for both.

    Parameters
    ----------
    surface : Surface
        Order 1 or 2; the element order is the surface's. A flat mesh from a file becomes
        one of order 2 by :meth:`Surface.quadratic`.
    lumped : bool
        Diagonal mass: each element's area shared among its nodes as the diagonal of its
        consistent mass is (a third each for order 1; sums of rows, the other usual rule,
        vanish at the corners of quadratic elements). Not more accurate, but positive: for
        explicit time steps, and to compare with other packages.
    dirichlet : bool
        Functions are 0 on the rims of an open surface. By default the boundary is the
        natural (Neumann) one: no heat crosses it.

    Returns
    -------
    Laplacian
        Unknowns are the surface's points, those on rims left out if ``dirichlet``.

    Raises
    ------
    MeshError
        M03 if a triangle is degenerate or folded: its metric is singular, or
        its normal turns over, at a quadrature point.
    ArgumentError
        A02 if every node lies on a rim and ``dirichlet`` is asked for; A03 for what is no Surface.

    Notes
    -----
    Cost: linear in the number of triangles, 60 ms for 5 000 six-node triangles.

    References
    ----------
    G. Dziuk and C. M. Elliott, *Finite element methods for surface PDEs*,
    Acta Numerica 22 (2013) 289-396, section 4; thesis, section 3.2.2; for the lumped
    mass E. Hinton, T. Rock and O. C. Zienkiewicz, Earthquake Eng. Struct. Dyn. 4 (1976)
    245-249.

    Examples
    --------
    The hat-function integrals on a triangle of area 1/2 are 1/24 and 1/12 of twice the area:

    >>> triangle = Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> (24 * fem(triangle).mass.toarray()).round(12).tolist()
    [[2.0, 1.0, 1.0], [1.0, 2.0, 1.0], [1.0, 1.0, 2.0]]
    >>> (24 * fem(triangle, lumped=True).mass.diagonal()).round(12).tolist()
    [4.0, 4.0, 4.0]
    """
    check_surface(surface)
    barycentric, weights = quadrature()
    values = shape_functions(barycentric, surface.order)
    by_barycentric = shape_gradients(barycentric, surface.order)
    jacobian = tangents(surface.points, surface.triangles, barycentric)
    root = _metric_root(jacobian)
    measure = root * (weights / 2)
    metric = np.einsum("mqdk,mqdl->mqkl", jacobian, jacobian)
    adjugate = metric[..., ::-1, ::-1] * [[1.0, -1.0], [-1.0, 1.0]]  # det G = root^2
    tensor = adjugate * (measure / root**2)[..., None, None]
    stiffness = np.einsum(
        "qik,mqkl,qjl->mij", by_barycentric, tensor, by_barycentric, optimize=True
    )
    mass = np.einsum("mq,qi,qj->mij", measure, values, values, optimize=True)
    size = len(surface.points)
    whole = _lump(mass, surface.triangles) if lumped else _assemble(mass, surface.triangles, size)
    laplacian = Laplacian(_assemble(stiffness, surface.triangles, size), whole)
    return fix_nodes(laplacian, rim_nodes(surface.triangles)) if dirichlet else laplacian


def _lump(mass: Floats, triangles: Ints) -> csr_array:
    """Diagonal mass: the diagonal of each local matrix, scaled to the whole of its element."""
    from scipy.sparse import diags_array

    diagonal = np.einsum("mii->mi", mass)
    share = diagonal * (mass.sum(axis=(1, 2)) / diagonal.sum(axis=1))[:, None]
    return diags_array(np.bincount(triangles.ravel(), share.ravel())).tocsr()


def _metric_root(jacobian: Floats) -> Floats:
    """sqrt(det G) of each element at each quadrature point; raises if it vanishes or turns over."""
    normals = np.cross(jacobian[..., 0], jacobian[..., 1])
    root: Floats = np.linalg.norm(normals, axis=-1)
    longest = (jacobian**2).sum(axis=-2).max(axis=(1, 2))
    turned = np.einsum("mqd,md->mq", normals, normals.mean(axis=1)) <= 0
    bad = (root <= 1e-12 * longest[:, None]).any(axis=1) | turned.any(axis=1)
    if bad.any():
        raise MeshError(
            "M03",
            "triangles: expected a positive, unfolded metric in each, got "
            f"{int(bad.sum())} degenerate or folded, first "
            f"{np.flatnonzero(bad)[:5].tolist()}; mesh with more vertices or order=1, and smooth "
            "the field first if it is a mask or noisy",
        )
    return root


def _assemble(local: Floats, triangles: Ints, size: int) -> csr_array:
    """Sum the local matrices (m, k, k) into a symmetric sparse (size, size)."""
    from scipy.sparse import coo_array

    width = triangles.shape[1]
    rows = np.repeat(triangles, width, axis=1).ravel()
    columns = np.tile(triangles, width).ravel()
    whole = coo_array((local.ravel(), (rows, columns)), shape=(size, size)).tocsr()
    return ((whole + whole.T) / 2).tocsr()
