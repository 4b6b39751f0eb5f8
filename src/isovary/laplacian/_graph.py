"""What the graph Laplacians share: their scale, and what they ask of a graph.

The weights of a graph fix an operator up to two scales. Both are set by facts
that every surface fulfils: linear functions of space have the Dirichlet energy
sum over x, y, z of integral |grad x|^2 = 2 area, since the projector on the
tangent plane has trace 2, and constants have the mass integral 1 = area.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ..errors import SpectrumError
from ..geometry import Floats, Ints
from ..records import Laplacian
from ._sites import Sites

if TYPE_CHECKING:
    from scipy.sparse import csr_array

ROUNDING = 1e-9
"""Relative difference of lengths that decides nothing, so that a turn changes no graph."""

_GRADED = 4.0
"""Largest ratio of the areas per node (95 % over 5 % quantile) of nodes of even density.

Icospheres reach 1.2, remeshed isosurfaces 2.9 (a 1:1:0.5 ellipsoid), random points 1.9; a sphere
whose edges are graded 2:1 from pole to pole has 3.5, one graded 3:1 has 7.
"""


def weighted_graph(pairs: Ints, weights: Floats, size: int) -> csr_array:
    """Symmetric matrix (size, size) of the weights of pairs (e, 2); repeated pairs add up."""
    from scipy.sparse import coo_array

    low, high = pairs.min(axis=1), pairs.max(axis=1)
    half = coo_array((weights, (low, high)), shape=(size, size)).tocsr()
    return (half + half.T).tocsr()


def graph_stiffness(graph: csr_array) -> csr_array:
    """D - W, with D the row sums of the weights W."""
    from scipy.sparse import diags_array

    return (diags_array(graph.sum(axis=1)) - graph).tocsr()


def graph_laplacian(graph: csr_array, sites: Sites, random_walk: bool) -> Laplacian:
    """Scaled D - W on area/n identity, or on area D / sum(D) for a random walk.

    The stiffness is c (D - W), with c such that the coordinates X have the energy
    trace(X^T stiffness X) = 2 area.
    """
    from scipy.sparse import diags_array

    entries = graph.tocoo()
    steps = sites.points[entries.row] - sites.points[entries.col]
    energy = entries.data @ (steps**2).sum(axis=1) / 2  # each pair stands there twice
    share = graph.sum(axis=1) if random_walk else np.ones(len(sites.points))
    mass = sites.area * share / share.sum()
    return Laplacian(
        (graph_stiffness(graph) * (2 * sites.area / energy)).tocsr(), diags_array(mass).tocsr()
    )


def heat_weights(squares: Floats, heat: float | None) -> Floats:
    """exp(-d^2 / (heat mean d^2)) of squared distances, or ones."""
    if heat is None or len(squares) == 0:
        return np.ones(len(squares))
    weights: Floats = np.exp(-squares / (heat * squares.mean()))
    return weights


def squared_lengths(points: Floats, pairs: Ints) -> Floats:
    """Squared distance (e,) of each pair of points (e, 2)."""
    squares: Floats = ((points[pairs[:, 1]] - points[pairs[:, 0]]) ** 2).sum(axis=1)
    return squares


def pairs_within(points: Floats, radius: float) -> Ints:
    """Pairs (e, 2) of different points that are no farther apart than a radius."""
    from scipy.spatial import cKDTree

    pairs: Ints = cKDTree(points).query_pairs(radius * (1 + ROUNDING), output_type="ndarray")
    return pairs.astype(np.int64).reshape(-1, 2)


def check_parts(graph: csr_array, sites: Sites, *, more: Callable[[float], str], less: str) -> None:
    """Raise SpectrumError S08 unless the graph has the same components as the surface.

    ``more`` says what helps where edges are missing, from the length that they must reach.
    """
    from scipy.sparse.csgraph import connected_components

    wanted = int(sites.parts.max()) + 1
    entries = graph.tocoo()
    if (sites.parts[entries.row] != sites.parts[entries.col]).any():
        joined = int(connected_components(graph, directed=False)[0])
        raise SpectrumError(
            "S08",
            f"graph: expected no edge between the {wanted} components of the surface, got "
            f"{joined} components; it bridges a gap in space: {less}",
        )
    found = int(connected_components(graph, directed=False)[0])
    if found > wanted:
        radius = 1.001 * connecting_radius(sites)
        raise SpectrumError(
            "S08",
            f"graph: expected {wanted} component(s), got {found}; {more(radius)}",
        )


def connecting_radius(sites: Sites) -> float:
    """Longest edge of the minimum spanning trees of the components (Prim's algorithm).

    A compiled tree would need a sparse graph that is sure to hold it; this one
    takes n steps of length n, and only an error pays them.
    """
    longest = 0.0
    for part in range(int(sites.parts.max()) + 1):
        outside = sites.points[sites.parts == part]
        nearest = np.full(len(outside), np.inf)
        new = outside[0]
        outside, nearest = outside[1:], nearest[1:]
        while len(outside):
            nearest = np.minimum(nearest, ((outside - new) ** 2).sum(axis=1))
            chosen = int(nearest.argmin())
            longest = max(longest, float(nearest[chosen]))
            new = outside[chosen].copy()
            outside[chosen], nearest[chosen] = outside[-1], nearest[-1]
            outside, nearest = outside[:-1], nearest[:-1]
    return float(np.sqrt(longest))


def warn_if_graded(sites: Sites) -> None:
    """Warn that a graph Laplacian mistakes the density of the nodes for shape."""
    low, high = np.quantile(sites.grain, (0.05, 0.95))
    if high > _GRADED * low:
        warnings.warn(
            "surface: expected nodes of even density, got areas per node that differ "
            f"{high / low:.1f} times (95 % over 5 % quantile); graph Laplacians see the density of "
            "nodes as if it were shape, fem and cotangent do not [L01]",
            UserWarning,
            stacklevel=3,
        )
