"""The Laplacian of bare points of Belkin, Sun and Wang."""

from __future__ import annotations

from numpy.typing import ArrayLike

from ..records import Laplacian, Surface
from ._heat_kernel import heat_kernel_laplacian
from ._sites import NEIGHBOURS, check_positive, cloud_sites


def point_cloud(
    points: Surface | ArrayLike, *, time: float | None = None, neighbours: int = NEIGHBOURS
) -> Laplacian:
    """Heat-kernel Laplacian of bare points: the mesh Laplacian with areas from tangent planes.

    The nearest neighbours of a point, projected on the plane of their principal
    components, are triangulated by Delaunay there; the triangles at the point give the
    area a_i that it stands for. Then, as in :func:`mesh_laplacian`, mass = diag(a) and
    stiffness = D - W with W_ij = a_i a_j exp(-d_ij^2 / 4h) / (4 pi h^2).

    Two things differ from the paper, both on purpose. Its operator gives point j the
    area that it has in the plane of point i; one area per point, from its own plane,
    makes the operator symmetric, so that its eigenvalues are real. And a_i is the
    Voronoi cell, not a third of the triangles: where four points lie on a circle, as
    on any lattice, the triangulation is a matter of rounding, and with it the thirds
    (a square lattice loses a quarter of its area), but not the cells.

    It fails where two sheets are nearer than the neighbours reach, or where the
    surface bends sharply within them. With triangles, prefer :func:`isovary.fem`.

    Parameters
    ----------
    points : array (n, 3) or Surface
        Of a surface only the points are used, and how many components it has.
    time : float, optional
        The kernel's h; length^2. Default: the squared edge length of a triangular
        lattice of the same density.
    neighbours : int
        Points for each tangent plane, at least 6. Enough to surround every point, and no
        more than lie in a nearly flat piece: 8 for even points, 20 for random ones.

    Returns
    -------
    Laplacian
        Unknowns are the points. The mass sums to the estimated area, for even points
        within 1 %.

    Raises
    ------
    SpectrumError
        S08 if the kernel reaches too short to connect the points, or joins the
        components of a surface.
    ArgumentError
        A02 for a time or neighbours out of range, A03 for an array that is not (n, 3).
    MeshError
        I01 for points that are not finite, M03 if they coincide or lie on a line.

    Notes
    -----
    Cost: a small triangulation for each point, 2 s for 10 000.

    References
    ----------
    M. Belkin, J. Sun and Y. Wang, *Constructing Laplace operator from point clouds in
    R^d*, Symposium on Discrete Algorithms 2009, 1031-1040; thesis,
    section 3.2.1.

    Examples
    --------
    In a square lattice of step 1 a point stands for the area 1, at a side for 1/2, at a
    corner for 1/4:

    >>> import numpy as np
    >>> lattice = np.array([[i, j, 0] for i in range(7) for j in range(7)])
    >>> point_cloud(lattice).mass.diagonal()[[24, 3, 0]].round(12).tolist()
    [1.0, 0.5, 0.25]
    """
    sites = cloud_sites(points, neighbours)
    step = sites.spacing**2 if time is None else time
    check_positive("time", step)
    return heat_kernel_laplacian(sites, step)
