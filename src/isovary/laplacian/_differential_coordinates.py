"""Where a node lies relative to its neighbours."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ArgumentError
from ..geometry import Floats
from ..records import Laplacian


def differential_coordinates(
    laplacian: Laplacian, points: ArrayLike, *, per_area: bool = False
) -> Floats:
    """Differential coordinates: each node minus the weighted mean of its neighbours.

    delta_i = sum_j w_ij (v_i - v_j) / sum_j w_ij = (stiffness v)_i / stiffness_ii,
    whatever the scale of the operator: L v = D delta. For :func:`uniform_graph` the
    mean is that of the neighbours, and delta has tangential parts where they are
    unevenly spaced. With ``per_area`` the divisor is the node's area: for
    :func:`cotangent` this is the mean-curvature normal 2 H n of Meyer et al., the
    thesis's second formula; it points outward where the surface is convex.

    Parameters
    ----------
    laplacian : Laplacian
        Without fixed nodes.
    points : array (n, 3)
        Of the surface that the operator belongs to.
    per_area : bool
        Divide by the row sums of the mass, not by the diagonal of the stiffness.

    Returns
    -------
    array (n, 3)
        Length; 1/length with ``per_area``.

    Raises
    ------
    ArgumentError
        A02 for ``per_area`` with a mass that is not diagonal; A03 for points that are not
        (n, 3) of the operator's nodes, or fixed nodes.

    Notes
    -----
    Cost: one sparse product, 1 ms for 10 000 nodes. The second derivatives that
    ``per_area`` takes need not converge at single nodes of an irregular mesh.

    References
    ----------
    Thesis, section 3.2.1; M. Meyer, M. Desbrun, P. Schroeder and A. H. Barr,
    *Discrete differential-geometry operators for triangulated 2-manifolds*, 2003,
    equation (8).

    Examples
    --------
    A regular tetrahedron about the origin: the mean of the other three corners is -v/3,
    so delta = 4/3 v.

    >>> from isovary.laplacian import uniform_graph
    >>> from isovary.records import Surface
    >>> corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    >>> solid = Surface(corners, [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
    >>> (3 * differential_coordinates(uniform_graph(solid), corners)[0]).round(12).tolist()
    [4.0, 4.0, 4.0]
    """
    places = np.asarray(points, dtype=np.float64)
    size = laplacian.stiffness.shape[0]
    if places.shape != (size, 3) or laplacian.nodes != size:
        raise ArgumentError(
            "A03",
            f"points: expected shape ({laplacian.nodes}, 3) and an operator without fixed nodes, "
            f"got {places.shape} and {laplacian.nodes - size} fixed",
        )
    stiffness = laplacian.stiffness
    if per_area and laplacian.mass.nnz > size:
        raise ArgumentError(
            "A02",
            "laplacian: expected a diagonal mass with per_area, got a consistent one, whose row "
            "sums are no areas; use cotangent, or fem(surface, lumped=True) of order 1",
        )
    force = stiffness @ (places - places.mean(axis=0))
    share = laplacian.mass.sum(axis=1) if per_area else stiffness.diagonal()
    coordinates: Floats = force / share[:, None]
    return coordinates
