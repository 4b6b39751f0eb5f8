"""Cotangent weights and mixed Voronoi areas."""

from __future__ import annotations

import numpy as np

from ..errors import MeshError
from ..geometry import Floats, Ints, linear_triangles, rim_nodes
from ..records import Laplacian, Surface
from ._boundary import fix_nodes
from ._checks import check_surface
from ._graph import graph_stiffness, weighted_graph


def cotangent(surface: Surface, *, dirichlet: bool = False) -> Laplacian:
    """Cotangent Laplacian with mixed Voronoi areas: the geometry processor's standard.

    stiffness_ij = -(cot a + cot b)/2, with a and b the angles opposite to the
    edge ij; this is the stiffness of linear finite elements. mass = diag(A), with
    A_i the area of the points that are nearest to node i in its triangles; an
    obtuse triangle gives half of its area to the obtuse corner and a quarter to
    each other one. Open surfaces get the natural (Neumann) boundary unless
    ``dirichlet``. Eigenvalues of smooth surfaces converge with order 2, from below
    where those of consistent finite elements come from above.

    Weights of edges opposite to wide angles are negative; the operator is
    semidefinite all the same, but heat may then flow the wrong way. Where that
    matters, take :func:`robust`; where accuracy does, :func:`isovary.fem`.

    Parameters
    ----------
    surface : Surface
        Of order 2, its triangles are replaced by four flat pieces each.
    dirichlet : bool
        Functions are 0 on the rims of an open surface, see :func:`fix_nodes`.

    Returns
    -------
    Laplacian
        Unknowns are the surface's points. The mass sums to the area of the flat
        triangles.

    Raises
    ------
    MeshError
        M03 for a triangle without area.
    ArgumentError
        A02 if ``dirichlet`` leaves no unknown; A03 for what is no Surface.

    Notes
    -----
    Cost: linear in the number of triangles, 30 ms for 10 000 nodes.

    References
    ----------
    U. Pinkall and K. Polthier, *Computing discrete minimal surfaces and their
    conjugates*, Experimental Mathematics 2 (1993) 15-36; M. Meyer,
    M. Desbrun, P. Schroeder and A. H. Barr, *Discrete differential-geometry
    operators for triangulated 2-manifolds*, 2003, sections 3.3 and 3.4, Fig. 4;
    thesis, section 3.2.1.

    Examples
    --------
    A right triangle with legs 1: cot 45 degrees = 1 and cot 90 degrees = 0; the right
    corner has the square of side 1/2, half of the triangle's area:

    >>> laplacian = cotangent(Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
    >>> laplacian.stiffness.toarray().round(12).tolist()
    [[1.0, -0.5, -0.5], [-0.5, 0.5, 0.0], [-0.5, 0.0, 0.5]]
    >>> laplacian.mass.diagonal().round(12).tolist()
    [0.25, 0.125, 0.125]
    """
    from scipy.sparse import diags_array

    check_surface(surface)
    flat = linear_triangles(surface.triangles)
    size = len(surface.points)
    squares, products, double = _angles(surface.points, flat)
    cotangents = products / double[:, None]
    opposite = np.concatenate([flat[:, [1, 2]], flat[:, [2, 0]], flat[:, [0, 1]]])
    graph = weighted_graph(opposite, cotangents.T.ravel() / 2, size)
    areas = np.bincount(flat.ravel(), _mixed(squares, products, double).ravel(), size)
    laplacian = Laplacian(graph_stiffness(graph), diags_array(areas).tocsr())
    return fix_nodes(laplacian, rim_nodes(surface.triangles)) if dirichlet else laplacian


def _angles(points: Floats, triangles: Ints) -> tuple[Floats, Floats, Floats]:
    """Squared opposite edges (m, 3), products of adjacent edges (m, 3), double areas (m,)."""
    corner = points[triangles]
    ahead, behind = np.roll(corner, -1, axis=1) - corner, np.roll(corner, 1, axis=1) - corner
    squares = ((ahead - behind) ** 2).sum(axis=2)
    double = np.linalg.norm(np.cross(ahead[:, 0], behind[:, 0]), axis=1)
    bad = double <= 1e-12 * squares.max(axis=1)
    if bad.any():
        raise MeshError(
            "M03",
            f"triangles: expected a positive area of each, got {int(bad.sum())} degenerate, first "
            f"{np.flatnonzero(bad)[:5].tolist()}; remove them, mesh with more vertices, or use "
            "robust",
        )
    return squares, (ahead * behind).sum(axis=2), double


def _mixed(squares: Floats, products: Floats, double: Floats) -> Floats:
    """Share (m, 3) of each corner in its triangle's area."""
    parts = squares * products / double[:, None] / 8  # |edge|^2 cot / 8, for both its ends
    voronoi: Floats = parts.sum(axis=1, keepdims=True) - parts
    obtuse = products < 0
    quarter = double[:, None] / 8
    return np.where(obtuse.any(axis=1, keepdims=True), np.where(obtuse, 2, 1) * quarter, voronoi)
