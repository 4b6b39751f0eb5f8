"""The graph of the mesh edges, every edge of weight 1."""

from __future__ import annotations

import numpy as np

from ..geometry import Floats, Ints, edges_of, linear_triangles
from ..records import Laplacian, Surface
from ._checks import check_surface
from ._graph import (
    ROUNDING,
    check_parts,
    graph_laplacian,
    squared_lengths,
    warn_if_graded,
    weighted_graph,
)
from ._sites import check_neighbours, sites_of


def uniform_graph(
    surface: Surface, *, nearest: int | None = None, random_walk: bool = False
) -> Laplacian:
    """Graph Laplacian of the mesh edges with weights 1: the combinatorial Laplacian D - A.

    stiffness = c (D - A) and mass = area/n identity, with A the adjacency of the
    edges, D its row sums, and c such that the coordinates X have the Dirichlet
    energy of the surface, trace(X^T stiffness X) = 2 area. On equilateral
    triangles c = 1/sqrt(3), the cotangent weight; on a sphere the scale puts
    lambda_2 near 2.

    It knows nothing of lengths and angles: it is right on meshes whose triangles
    are all alike, and wrong on others, however fine the mesh: on icospheres the
    eigenvalues of l = 3 stay up to 9 % off. Prefer :func:`isovary.fem`.

    Parameters
    ----------
    surface : Surface
        Of order 2, the edges are those of its four flat pieces per triangle.
    nearest : int, optional
        Keep of each node's edges only those to its nearest so many neighbours; an
        edge stays if either end keeps it, and edges of equal length stay together.
        Default: all edges.
    random_walk : bool
        mass = area D / sum(D), so that the operator is I - D^-1 A up to its scale,
        the thesis's L, and not D - A, its L_s.

    Returns
    -------
    Laplacian
        Unknowns are the surface's points.

    Raises
    ------
    SpectrumError
        S08 if the nearest neighbours do not connect the surface.
    ArgumentError
        A02 for ``nearest`` below 1 or not below the number of points; A03 for what is no Surface.

    Warns
    -----
    UserWarning
        L01 if the density of the nodes is graded, which the graph takes for shape.

    Notes
    -----
    Cost: linear in the number of edges, 0.2 s for 10 000 nodes.

    References
    ----------
    Thesis, section 3.2.1; G. Taubin, *A signal processing approach to fair
    surface design*, SIGGRAPH 1995, section 2.

    Examples
    --------
    An equilateral triangle of side 1: three edges of energy c each, 2 area = sqrt(3)/2,
    so c = sqrt(3)/6, half the weight 1/sqrt(3) of an edge with a triangle on both sides:

    >>> triangle = Surface([[0, 0, 0], [1, 0, 0], [0.5, 3**0.5 / 2, 0]], [[0, 1, 2]])
    >>> (uniform_graph(triangle).stiffness.toarray() / (3**0.5 / 6)).round(12).tolist()
    [[2.0, -1.0, -1.0], [-1.0, 2.0, -1.0], [-1.0, -1.0, 2.0]]
    """
    check_surface(surface)
    sites = sites_of(surface)
    edges = edges_of(linear_triangles(surface.triangles))[0]
    size = len(surface.points)
    if nearest is not None:
        check_neighbours("nearest", nearest, size)
        edges = _shortest(edges, squared_lengths(sites.points, edges), nearest)
    graph = weighted_graph(edges, np.ones(len(edges)), size)
    check_parts(graph, sites, more=lambda _: "use a larger `nearest`", less="")
    warn_if_graded(sites)
    return graph_laplacian(graph, sites, random_walk)


def _shortest(edges: Ints, squares: Floats, count: int) -> Ints:
    """Edges that are among the shortest so many of either end, or as short as these."""
    ends, both = edges.T.ravel(), np.tile(squares, 2)
    order = np.lexsort((both, ends))
    first = np.searchsorted(ends[order], np.arange(ends.max() + 1))
    last = np.minimum(first + count, np.append(first[1:], len(ends))) - 1
    limit = both[order][last] * (1 + 2 * ROUNDING)
    kept: Ints = edges[squares <= limit[edges].max(axis=1)]
    return kept
