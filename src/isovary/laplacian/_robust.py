"""The intrinsic Delaunay Laplacian of Sharp and Crane, for bad and non-manifold meshes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..errors import ArgumentError, MeshError, RunError
from ..geometry import Floats, Ints, linear_triangles
from ..records import Laplacian, Surface
from ._checks import check_surface
from ._graph import graph_stiffness

if TYPE_CHECKING:
    from scipy.sparse import csr_array


def robust(surface: Surface, *, mollify: float = 1e-5) -> Laplacian:
    """Cotangent Laplacian of the intrinsic Delaunay triangulation, for bad and non-manifold meshes.

    The surface stays, its triangulation is exchanged: edges are flipped within the
    surface until opposite angles sum to at most 180 degrees, so no weight
    (cot a + cot b)/2 is negative; the mass is a third of the new triangles' areas.
    Where more than two triangles meet at an edge, the flips are done on a double
    cover of the surface, the tufted cover. Degenerate triangles are opened a little
    before. On a mesh that is Delaunay already, the stiffness is that of
    :func:`cotangent`. Open surfaces get the natural (Neumann) boundary.

    It repairs triangles, not shapes: curvature that the nodes do not resolve stays
    unresolved. On good meshes it is as accurate as :func:`cotangent`.

    Parameters
    ----------
    surface : Surface
        Of order 2, its triangles are replaced by four flat pieces each.
    mollify : float
        How far degenerate triangles are opened, relative to the mean edge length: each
        triangle inequality gets at least this room. 0 for none.

    Returns
    -------
    Laplacian
        Unknowns are the surface's points. The mass sums to the area of the flat
        triangles; opening a degenerate one adds about the root of ``mollify`` of a whole one.

    Raises
    ------
    ArgumentError
        A02 for a negative ``mollify``; A03 for what is no Surface.
    MeshError
        M03 if ``mollify`` is too small to open the degenerate triangles.
    RunError
        W10 if the package robust_laplacian is missing or fails.

    Notes
    -----
    Cost: linear in the number of triangles, 0.1 s for 10 000 nodes.

    References
    ----------
    N. Sharp and K. Crane, *A Laplacian for nonmanifold triangle meshes*, Computer
    Graphics Forum 39 (2020) 69-80; their package robust_laplacian computes it.

    Examples
    --------
    Two flat triangles whose common edge is the long diagonal of a rhombus: it is
    flipped to the short one, so nodes 0 and 2 are no neighbours any more, and the
    short diagonal of the two equilateral triangles gets the weight 1/sqrt(3):

    >>> height = 3**0.5 / 2
    >>> rhombus = Surface(
    ...     [[0, -height, 0], [0.5, 0, 0], [0, height, 0], [-0.5, 0, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> (robust(rhombus).stiffness.toarray()[1] * 3**0.5).round(9).tolist()
    [-0.5, 2.0, -0.5, -1.0]
    """
    from scipy.sparse import csr_array

    check_surface(surface)
    if not 0 <= mollify < np.inf:
        raise ArgumentError("A02", f"mollify: expected 0 or more, got {mollify}")
    centred = surface.points - surface.points.mean(axis=0)
    size = float(np.abs(centred).max())
    stiffness, mass = _call(centred / size, linear_triangles(surface.triangles), mollify)
    if not (np.isfinite(stiffness.data).all() and (mass.diagonal() > 0).all()):
        raise MeshError(
            "M03",
            "triangles: expected positive areas after opening the degenerate ones, got nodes on "
            f"none; use a `mollify` above {mollify:g}",
        )
    weights = -(stiffness + stiffness.T).tocsr() / 2
    weights.setdiag(0)
    weights.eliminate_zeros()
    return Laplacian(graph_stiffness(csr_array(weights)), csr_array(mass * size**2))


def _call(points: Floats, triangles: Ints, mollify: float) -> tuple[csr_array, csr_array]:
    """Stiffness and mass from the package."""
    try:
        import robust_laplacian
    except ImportError as error:
        raise RunError(
            "W10",
            "robust: expected the package robust_laplacian, got none; "
            "python -m pip install robust_laplacian",
        ) from error
    try:
        stiffness, mass = robust_laplacian.mesh_laplacian(points, triangles, mollify)
    except RuntimeError as error:
        raise RunError(
            "W10", f"robust: expected robust_laplacian to succeed, got {error}; check the mesh"
        ) from error
    return stiffness, mass
