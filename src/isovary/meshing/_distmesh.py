"""DistMesh on an isosurface: the mesh as a truss whose bars push one another to equal lengths."""

from __future__ import annotations

from ..records import Surface
from ..scalar_field import ScalarField
from ._finish import finished
from ._moves import truss_step
from ._remesh import Progress, remesh
from ._sizing import Sizing
from ._sizing_field import GROWTH
from ._start import start

_ROUNDS, _STILL = 200, 0.005


def distmesh(
    field: ScalarField,
    isovalue: float,
    *,
    vertices: int | None = None,
    sizing: Sizing | float | None = None,
    growth: float = GROWTH,
    order: int = 2,
    progress: Progress | None = None,
) -> Surface:
    """Curved (or flat) triangle mesh of an isosurface by DistMesh: a truss in equilibrium.

    Every edge is a bar that pushes while it is shorter than 1.2 times the wanted length. The
    vertices follow the forces in the surface (Euler steps), one Newton step along the field's
    gradient brings them back onto it, and edges are flipped to the Delaunay triangulation. Bars
    far too long or short are split or collapsed. It ends when no vertex moves by more than 0.5 %
    of its edges or the mean quality of the triangles rests.

    Parameters
    ----------
    field : ScalarField
        Any: no distance function is needed.
    isovalue : float
    vertices : int, optional
        Wanted number of vertices; order 2 has four times as many nodes. The sizing's lengths are
        multiplied by the one factor that gives this number. Default: 1 000, or with a ``sizing``
        as many as its lengths take.
    sizing : callable or float, optional
        Wanted edge lengths: :func:`isovary.uniform_sizing` (the default),
        :func:`isovary.curvature_sizing`, any function of points, field and isovalue, or one
        length.
    growth : float
        Largest difference of two edge lengths over the distance between them.
    order : int
        2 for curved six-node triangles, 1 for flat ones.
    progress : callable, optional
        Called with a stage's name and the part of it done, 0 to 1.

    Returns
    -------
    Surface
        With the field's exact normals; nodes on the isosurface to rounding, rims on the faces
        of the box.

    Warns
    -----
    UserWarning
        M15 if the surface's curvature takes more vertices: no edge is longer than the radius of
        curvature, down to half the samples' distance.

    Raises
    ------
    FieldError
        I02 for an isovalue outside the field's range.
    MeshError
        M03 if curved triangles stay folded, M12 if the mesh cannot be made.
    ArgumentError
        A02 for fewer than 12 vertices, an order other than 1 and 2 or a growth that is not
        positive, A03 for a sizing that does not return positive lengths.

    Notes
    -----
    Cost: 2 s for 1 000 vertices, 18 s for 12 000.

    References
    ----------
    Thesis, section 4.1.1; P.-O. Persson and G. Strang, *A simple mesh generator in MATLAB*, SIAM
    Review 46 (2004) 329-345; P.-O. Persson, *Mesh generation for implicit geometries*, PhD
    thesis, MIT (2005), chapter 3.

    Examples
    --------
    >>> ball = ScalarField.from_function(
    ...     lambda p: -(p**2).sum(axis=-1), bounds=((-2, -2, -2), (2, 2, 2)), shape=(17, 17, 17))
    >>> sphere = distmesh(ball, -1.0, vertices=400)
    >>> len(set(sphere.corners.ravel())), round(sphere.area / 3.14159265, 3)
    (400, 4.0)
    """
    mesh, sizes, expected = start(field, isovalue, vertices, sizing, growth, order)
    mesh = remesh(mesh, sizes, field, isovalue, truss_step, _ROUNDS, _STILL, progress)
    return finished(mesh, field, isovalue, order, expected)
