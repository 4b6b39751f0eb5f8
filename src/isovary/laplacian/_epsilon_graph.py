"""The graph of all pairs of nodes that are near in space."""

from __future__ import annotations

from numpy.typing import ArrayLike

from ..records import Laplacian, Surface
from ._graph import (
    check_parts,
    graph_laplacian,
    heat_weights,
    pairs_within,
    squared_lengths,
    warn_if_graded,
    weighted_graph,
)
from ._sites import check_positive, sites_of

_EDGES = 4.0  # default radius in mean edge lengths: about the 50 neighbours of knn_graph


def epsilon_graph(
    surface: Surface | ArrayLike,
    radius: float | None = None,
    *,
    heat: float | None = 1.0,
    random_walk: bool = False,
) -> Laplacian:
    """Graph Laplacian of all pairs of nodes within a radius in space, with heat weights.

    The weight of an edge is exp(-d^2 / (heat mean d^2)), the mean over all edges.
    Then stiffness = c (D - W) and mass = area/n identity, with c such that the
    coordinates X have the Dirichlet energy of the surface,
    trace(X^T stiffness X) = 2 area; on a sphere this puts lambda_2 at 2.

    One radius must serve the whole surface: too small, and sparse regions fall
    apart; too large, and it joins sheets that are near in space but far on the
    surface. Prefer :func:`isovary.fem` where there are triangles.

    Parameters
    ----------
    surface : Surface or array (n, 3)
        Only its nodes and its area count. The area of bare points is estimated
        as in :func:`point_cloud`.
    radius : float, optional
        Largest distance of a pair, the root of the thesis's epsilon; length.
        Default: 4 mean edge lengths, about 58 neighbours; for bare points the
        edges of a triangular lattice of their density.
    heat : float, optional
        Width of the weights, in mean squared lengths of the edges; None for weights 1. On
        2 562 nodes of the sphere the worst error of the signature for t >= 0.1 is 8 % with
        heat weights, 12 % without; on 10 242 nodes 4.5 % and 4.9 %.
    random_walk : bool
        mass = area D / sum(D), so that the operator is I - D^-1 W up to its scale.

    Returns
    -------
    Laplacian
        Unknowns are the points.

    Raises
    ------
    SpectrumError
        S08 if the graph has not the components of the surface (one for bare
        points); the text has the smallest radius that connects them.
    ArgumentError
        A02 for a radius or heat out of range, A03 for an array that is not (n, 3).
    MeshError
        I01 or M03 for bare points that are not finite or coincide.

    Warns
    -----
    UserWarning
        L01 if the density of the nodes is graded, which the graph takes for shape.

    Notes
    -----
    Cost: linear in the number of pairs, 0.4 s for 10 000 nodes.

    References
    ----------
    Thesis, sections 3.2.1 and 4.2.2; M. Belkin and P. Niyogi, *Laplacian
    eigenmaps for dimensionality reduction and data representation*, Neural
    Computation 15 (2003) 1373-1396, section 2.

    Examples
    --------
    A square of side 1: four sides within a radius of 1.1, the diagonals are not. Their
    energy is 4 c = 2 area, so c = 1/2:

    >>> square = Surface([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> epsilon_graph(square, 1.1, heat=None).stiffness.toarray()[0].round(12).tolist()
    [1.0, -0.5, 0.0, -0.5]
    """
    sites = sites_of(surface)
    reach = _EDGES * sites.spacing if radius is None else radius
    check_positive("radius", reach)
    if heat is not None:
        check_positive("heat", heat)
    pairs = pairs_within(sites.points, reach)
    weights = heat_weights(squared_lengths(sites.points, pairs), heat)
    graph = weighted_graph(pairs, weights, len(sites.points))
    check_parts(graph, sites, more=_remedy, less="use a smaller radius")
    warn_if_graded(sites)
    return graph_laplacian(graph, sites, random_walk)


def _remedy(radius: float) -> str:
    return f"it connects from the radius {radius:.4g} on, unless heat is tiny"
