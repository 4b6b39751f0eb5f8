"""Marching cubes made fit for finite elements: the default mesher."""

from __future__ import annotations

from ..errors import ArgumentError
from ..geometry import topology
from ..records import Surface
from ..scalar_field import ScalarField
from ._contour import contour
from ._draft import draft
from ._finish import finished
from ._moves import centroid_step
from ._remesh import Progress, remesh
from ._sizing import Sizing
from ._sizing_field import GROWTH
from ._start import check_order, start

_ROUNDS, _STILL = 40, 0.02


def marching_cubes(
    field: ScalarField,
    isovalue: float,
    *,
    vertices: int | None = None,
    sizing: Sizing | float | None = None,
    growth: float = GROWTH,
    order: int = 2,
    remeshed: bool = True,
    progress: Progress | None = None,
) -> Surface:
    """Curved (or flat) triangle mesh of an isosurface: marching cubes, remeshed and projected.

    Contour the spline; split, collapse and flip edges until they have the wanted lengths, while
    the vertices slide to the centroid of their triangles; put every node, edge midpoints
    included, onto the spline's isosurface.

    Parameters
    ----------
    field : ScalarField
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
    remeshed : bool
        False leaves the marching-cubes triangles of the data's grid as they are, slivers and
        all: the thesis's mesh, but with its nodes on the isosurface.
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
    Cost: 0.7 s for 1 000 vertices, 6 s for 12 000.

    References
    ----------
    Thesis, section 4.1.1; W. Lorensen and H. Cline, *Marching cubes*, SIGGRAPH (1987);
    M. Botsch and L. Kobbelt, *A remeshing approach to multiresolution modeling*, SGP (2004);
    Q. Du, V. Faber and M. Gunzburger, *Centroidal Voronoi tessellations*, SIAM Review 41 (1999).

    Examples
    --------
    >>> ball = ScalarField.from_function(
    ...     lambda p: -(p**2).sum(axis=-1), bounds=((-2, -2, -2), (2, 2, 2)), shape=(17, 17, 17))
    >>> sphere = marching_cubes(ball, -1.0, vertices=400)
    >>> len(set(sphere.corners.ravel())), round(sphere.area / 3.14159265, 3)
    (400, 4.0)
    """
    if not remeshed:
        return _raw(field, isovalue, vertices, sizing, order)
    mesh, sizes, expected = start(field, isovalue, vertices, sizing, growth, order)
    mesh = remesh(mesh, sizes, field, isovalue, centroid_step, _ROUNDS, _STILL, progress)
    return finished(mesh, field, isovalue, order, expected)


def _raw(
    field: ScalarField,
    isovalue: float,
    vertices: int | None,
    sizing: Sizing | float | None,
    order: int,
) -> Surface:
    """The contour's own triangles, with their nodes on the isosurface."""
    check_order(order)
    if vertices is not None or sizing is not None:
        raise ArgumentError(
            "A02",
            "remeshed: expected True with vertices or a sizing, got False; the triangles of "
            "marching cubes are as many as the data's grid makes",
        )
    raw = contour(field, isovalue)
    mesh = draft(raw.points, raw.triangles, field, isovalue)
    return finished(mesh, field, isovalue, order, topology(raw.triangles), judged=False)
