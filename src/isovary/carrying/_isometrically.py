"""One mesh on two isosurfaces: carried along the normals, then slid to keep all lengths it can."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np

from ..errors import ArgumentError, CorrespondenceError, MeshError
from ..geometry import Bools, Floats, own_places
from ..level_sets import BlendedField, LevelSet
from ..projection import newton, outward_normals
from ..records import Correspondence, Surface
from ..sliding import SETTLED, Ground, Landing, slide, tangent_frames
from ._along_normals import carry, faces_held

_SMALLEST_STEP = 1 / 64
_ON_THE_WAY = 1e-2  # of an edge: how well the map settles before the last field
_LEAST_COSINE = 0.5  # no normal turns by more than 60 degrees in one step


def carry_isometrically(
    surface: Surface,
    fields: Sequence[LevelSet],
    isovalue: float,
    *,
    start: Surface | None = None,
) -> tuple[Surface, Correspondence]:
    """The base mesh carried onto another isosurface by the map that changes lengths least.

    Carried along the normals (:func:`carry`), the nodes slide on the perturbed isosurface until
    the integral of the squared Green strain between the base and its image is smallest: what
    strain is left no map of this kind avoids, so it is the surface's own. Signatures compared
    at points so matched are those of one material point, as far as there is one; normals alone
    slide points past each other where the surface shifts, bends or twists.

    If a single step turns a normal by more than 60 degrees, turns a triangle over or does not
    converge, it is halved: the way leads through blended fields (:class:`BlendedField`), each
    a start for the next. The strain is always that between the base and the latest image, so
    nothing adds up. Nodes on a face of the field's box slide within it, on its edges not at all.

    Parameters
    ----------
    surface : Surface
        The base mesh, normals towards smaller field values.
    fields : sequence of LevelSet
        On the way from the base to the perturbed one, that one last: ``[perturbed]`` for one
        step, ``[base, perturbed]`` for as many as it takes, or with members of a sweep between.
    isovalue : float
        In the fields' unit.
    start : Surface, optional
        An image of the base that lies near the first field's isosurface already, to go on from.
        Default: the base itself.

    Returns
    -------
    carried : Surface
        Same triangles, points on the isosurface of the last field, its normals.
    correspondence : Correspondence
        Each node matched to itself; ``distance`` is the displacement along the base normal.

    Raises
    ------
    CorrespondenceError
        C05 or C02 as :func:`carry`, if the way cannot be gone in steps of 1/64 from one field
        to the next.
    ArgumentError
        A02 without a field.

    Warns
    -----
    UserWarning
        C05 if it took more than one step from one field to the next.

    Notes
    -----
    Cost: 0.7 s for 4 000 nodes and one step, see :func:`isovary.sliding.slide`.

    Examples
    --------
    A sphere shifted by 0.3: along normals points gather on one side, isometrically they shift.

    >>> from isovary.scalar_field import ScalarField
    >>> from isovary.shapes import icosphere
    >>> ball = ScalarField.from_function(
    ...     lambda p: -((p - [0.3, 0, 0])**2).sum(axis=-1),
    ...     bounds=((-2, -2, -2), (2, 2, 2)), shape=(9, 9, 9))
    >>> sphere = icosphere(2)
    >>> carried, _ = carry_isometrically(sphere, [ball], -1.0)
    >>> bool(np.abs(carried.points - sphere.points - [0.3, 0, 0]).max() < 1e-3)
    True
    """
    if len(fields) == 0:
        raise ArgumentError("A02", "fields: expected at least the perturbed one, got none")
    held = faces_held(surface.points, fields[0])
    current, steps = start or surface, []
    last = len(fields[1:] or fields) - 1
    for number, ahead in enumerate(fields[1:] or fields):
        behind = fields[number] if len(fields) > 1 else None
        try:
            settled = SETTLED if number == last else _ON_THE_WAY
            current, count = _leg(surface, current, behind, ahead, isovalue, held, settled)
        except (CorrespondenceError, MeshError) as error:
            error.add_note(f"(field {number + 1} of {len(fields) - 1} after the base)")
            raise
        steps.append(count)
    if max(steps) > 1:
        warnings.warn(
            "the isosurfaces are far apart for their features: the mesh was carried in "
            f"{sum(steps)} steps through blended fields; members of the sweep between them "
            "(through=, --through) are surer [C05]",
            stacklevel=2,
        )
    triangle, places = own_places(surface.triangles)
    distance = np.einsum("nd,nd->n", current.points - surface.points, surface.normals)
    return current, Correspondence(triangle, places, distance, np.ones(len(triangle), np.int64))


def _leg(
    base: Surface,
    current: Surface,
    behind: LevelSet | None,
    ahead: LevelSet,
    isovalue: float,
    held: Bools,
    settled: float,
) -> tuple[Surface, int]:
    """From one field to the next, in as few steps as can be gone, and their number."""
    part, step, count = 0.0, 1.0, 0
    while part < 1:
        step = min(step, 1 - part)
        whole = behind is None or part + step == 1
        field = ahead if behind is None or whole else BlendedField(behind, ahead, part + step)
        try:
            end = settled if whole else _ON_THE_WAY
            current = _step(base, current, field, isovalue, held, end)
        except (CorrespondenceError, MeshError) as error:
            step /= 2
            if behind is None or step < _SMALLEST_STEP:
                error.add_note(f"the mesh was carried {part:.0%} of the way to the next field")
                raise
            continue
        part, step, count = part + step, 2 * step, count + 1
    return current, count


def _step(
    base: Surface,
    current: Surface,
    field: LevelSet,
    isovalue: float,
    held: Bools,
    settled: float,
) -> Surface:
    """Carried along the current normals, then slid."""
    carried, _ = carry(current, field, isovalue)
    turned = np.einsum("nd,nd->n", carried.normals, current.normals) < _LEAST_COSINE
    if turned.any():
        raise CorrespondenceError(
            "C05",
            f"normals: expected none to turn by more than 60 degrees, got {turned.sum()} that do, "
            f"first {np.flatnonzero(turned)[:5].tolist()}; the surfaces are too far apart for "
            "their features: go in smaller steps of the parameter, or carry along normals",
        )
    ground = field_ground(field, isovalue, held)
    points = slide(base, carried.points, ground, settled=settled)
    return Surface(points, base.triangles, outward_normals(points, field, isovalue))


def field_ground(field: LevelSet, isovalue: float, held: Bools) -> Ground:
    """The way onto an isosurface; coordinates that are held (n, 3) do not change."""
    axes = np.eye(3)
    count = held.sum(axis=1)

    def ground(points: Floats) -> Landing:
        landed, arrived = newton(points, field, isovalue, held=held)
        normals = outward_normals(landed, field, isovalue)
        frames = tangent_frames(normals)
        on_face = count == 1
        along = np.cross(normals[on_face], axes[held[on_face].argmax(axis=1)])
        length = np.linalg.norm(along, axis=1, keepdims=True)
        frames[on_face] = 0
        frames[on_face, :, 0] = along / np.where(length > 1e-6, length, np.inf)
        frames[count > 1] = 0
        return Landing(landed, normals, frames, arrived)

    return ground
