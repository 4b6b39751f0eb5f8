"""The numerical noise floor of a change: how much of it is the mesh's doing."""

from __future__ import annotations

import numpy as np

from .correspondence import closest_point, interpolate
from .geometry import EDGES, Floats, linear_triangles
from .records import Surface

_SMOOTHINGS = 4


def noise_floor(surface: Surface, change: Floats, coarse: Surface, coarse_change: Floats) -> Floats:
    """Numerical error of a change at each node and time, from a second, coarser base mesh.

    The same comparison was made on two base meshes of one isosurface. Their
    difference d at corresponding places is squared, averaged over a
    neighbourhood of four rings of nodes, and its root taken: a local root mean
    square, so that a chance agreement at one node does not pass for accuracy.
    With r times fewer vertices the coarser mesh errs r^order times more
    (h^2 for flat, h^4 for curved elements), so the finer one errs by
    d / (r^order - 1); the floor is that or d, whichever is larger. It does not
    contain what both meshes share: the sampling of the fields and the number of
    eigenpairs.

    Parameters
    ----------
    surface : Surface
        Base mesh with n nodes.
    change : array (n, T)
    coarse : Surface
        Another mesh of the same isosurface, with fewer vertices and n' nodes.
    coarse_change : array (n', T)
        The change computed on it, at the same times.

    Returns
    -------
    array (n, T)
        In the change's unit; NaN where no neighbour has both changes.

    Notes
    -----
    Cost: one closest-point search, 20 microseconds a node.

    Examples
    --------
    Two meshes that differ by 0.25 everywhere:

    >>> from isovary.shapes import icosphere
    >>> fine, coarse = icosphere(2), icosphere(1)
    >>> floor = noise_floor(fine, np.ones((642, 1)), coarse, np.full((162, 1), 0.75))
    >>> float(floor.min().round(9)), float(floor.max().round(9))
    (0.25, 0.25)
    """
    there = interpolate(closest_point(surface, coarse), coarse, coarse_change)
    square = (change - there) ** 2
    known = np.asarray(np.isfinite(square).all(axis=1))
    floor = np.full(change.shape, np.nan)
    weight = _neighbourhood_mean(surface, known.astype(float)[:, None])
    total = _neighbourhood_mean(surface, np.where(known[:, None], square, 0.0))
    reached = weight[:, 0] > 0
    floor[reached] = np.sqrt(total[reached] / weight[reached])
    return floor * max(1.0, 1.0 / (_refinement(surface, coarse) ** surface.order - 1.0))


def _refinement(surface: Surface, coarse: Surface) -> float:
    """How many times more vertices the finer mesh has, at least 1.05."""
    fine, few = (len(np.unique(mesh.corners)) for mesh in (surface, coarse))
    return max(fine / few, 1.05)


def _neighbourhood_mean(surface: Surface, values: Floats) -> Floats:
    """Mean over each node and its neighbours, taken four times over."""
    from scipy.sparse import coo_array, diags_array

    pieces = linear_triangles(surface.triangles)
    links = np.concatenate([pieces[:, list(pair)] for pair in EDGES])
    size = len(surface.points)
    graph = coo_array((np.ones(len(links)), (links[:, 0], links[:, 1])), shape=(size, size)).tocsr()
    joined = (graph + graph.T + diags_array(np.ones(size))).sign()
    average = diags_array(1 / joined.sum(axis=1)) @ joined
    for _ in range(_SMOOTHINGS):
        values = average @ values
    return values
