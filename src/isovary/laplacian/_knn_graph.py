"""The graph of the nearest neighbours in space."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..geometry import Floats, Ints
from ..records import Laplacian, Surface
from ._graph import (
    ROUNDING,
    check_parts,
    graph_laplacian,
    heat_weights,
    squared_lengths,
    warn_if_graded,
    weighted_graph,
)
from ._sites import check_neighbours, check_positive, sites_of


def knn_graph(
    surface: Surface | ArrayLike,
    neighbours: int = 50,
    *,
    heat: float | None = 1.0,
    random_walk: bool = False,
) -> Laplacian:
    """Graph Laplacian of the nearest neighbours in space, with heat weights.

    An edge joins two nodes if either is among the nearest neighbours of the
    other; nodes as near as the last one count as well. Its weight is
    exp(-d^2 / (heat mean d^2)), the mean over all edges. Then stiffness =
    c (D - W) and mass = area/n identity, with c such that the coordinates X have
    the Dirichlet energy of the surface, trace(X^T stiffness X) = 2 area; on a
    sphere this puts lambda_2 at 2.

    Straight distances take short cuts: where two sheets of a surface are nearer
    than the neighbours reach, the graph joins them. The thesis's 50 neighbours
    average over 4 edge lengths; fewer see finer detail and more of the mesh.
    Prefer :func:`isovary.fem` where there are triangles.

    Parameters
    ----------
    surface : Surface or array (n, 3)
        Only its nodes and its area count. The area of bare points is estimated
        as in :func:`point_cloud`.
    neighbours : int
        At least 1.
    heat : float, optional
        Width of the weights, in mean squared lengths of the edges; None for weights 1.
    random_walk : bool
        mass = area D / sum(D), so that the operator is I - D^-1 W up to its scale.

    Returns
    -------
    Laplacian
        Unknowns are the points.

    Raises
    ------
    SpectrumError
        S08 if the graph has not the components of the surface (one for bare points).
    ArgumentError
        A02 for neighbours or heat out of range, A03 for an array that is not (n, 3).
    MeshError
        I01 or M03 for bare points that are not finite or coincide.

    Warns
    -----
    UserWarning
        L01 if the density of the nodes is graded, which the graph takes for shape.

    Notes
    -----
    Cost: n neighbours log n, 0.7 s for 10 000 nodes and 50 neighbours.

    References
    ----------
    Thesis, section 4.2.2; M. Belkin and P. Niyogi, *Laplacian eigenmaps for
    dimensionality reduction and data representation*, Neural Computation 15
    (2003) 1373-1396, section 2.

    Examples
    --------
    On a sphere the scale makes lambda_2 = 2, as it should be:

    >>> from isovary.shapes import icosphere
    >>> from isovary.spectrum import eigenpairs
    >>> eigenpairs(knn_graph(icosphere(3, order=1)), 4).values.round(2).tolist()
    [0.0, 2.0, 2.0, 2.0]
    """
    sites = sites_of(surface)
    size = len(sites.points)
    check_neighbours("neighbours", neighbours, size)
    if heat is not None:
        check_positive("heat", heat)
    pairs = _nearest_pairs(sites.points, neighbours)
    weights = heat_weights(squared_lengths(sites.points, pairs), heat)
    graph = weighted_graph(pairs, weights, size)
    check_parts(graph, sites, more=_remedy, less="use fewer neighbours")
    warn_if_graded(sites)
    return graph_laplacian(graph, sites, random_walk)


def _remedy(radius: float) -> str:
    return (
        "use more neighbours or a larger heat; an epsilon graph connects from the radius "
        f"{radius:.4g} on"
    )


def _nearest_pairs(points: Floats, count: int) -> Ints:
    """Pairs (e, 2), each once, of which either is among the other's nearest."""
    from scipy.spatial import cKDTree

    tree = cKDTree(points)
    reach = tree.query(points, count + 1)[0][:, -1] * (1 + ROUNDING)
    balls = tree.query_ball_point(points, reach)
    near = np.concatenate([np.asarray(ball, dtype=np.int64) for ball in balls])
    centre = np.repeat(np.arange(len(points)), [len(ball) for ball in balls])
    pairs = np.stack([np.minimum(centre, near), np.maximum(centre, near)], axis=1)
    key = np.unique((pairs[:, 0] * len(points) + pairs[:, 1])[pairs[:, 0] < pairs[:, 1]])
    return np.stack(np.divmod(key, len(points)), axis=1)
