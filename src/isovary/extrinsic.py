"""What a change looks like from outside: distances, volumes, and which kind of change is where."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass

import numpy as np

from .correspondence import closest_point
from .errors import ArgumentError
from .geometry import (
    Bools,
    Floats,
    Ints,
    edges_of,
    node_areas,
    quadrature,
    shape_functions,
    tangents,
)
from .records import Correspondence, Surface
from .rigid_motion import RigidMotion

NOISE_FACTOR = 2.0
"""How many times its noise floor a strain must exceed to count."""


class Kind(enum.IntEnum):
    """What happened to a place of the surface; see :func:`kinds_of_change`."""

    UNKNOWN = -1
    UNCHANGED = 0
    MOVED = 1
    BENT = 2
    STRETCHED = 3
    NEW_SHAPE = 4

    @property
    def words(self) -> str:
        """The kind in words, as for a legend."""
        return "moved rigidly" if self is Kind.MOVED else self.name.lower().replace("_", " ")


@dataclass(frozen=True)
class HausdorffDistance:
    """How far apart two surfaces are, seen from each; made by :func:`hausdorff_distance`.

    ``from_base`` is the longest way from a node of the base to the perturbed surface,
    ``from_perturbed`` that from a node of the perturbed surface to the base; length.
    """

    from_base: float
    from_perturbed: float

    @property
    def largest(self) -> float:
        """The larger of both: the Hausdorff distance."""
        return max(self.from_base, self.from_perturbed)


def hausdorff_distance(base: Surface, perturbed: Surface) -> HausdorffDistance:
    """Longest distance between two surfaces, in either direction.

    max over x of min over y of norm(x - y), with x among all nodes of one surface, edge
    midpoints included, and y anywhere on the other's flat or curved triangles. Between the
    nodes of x nothing is looked at: a finer mesh sees more.

    Parameters
    ----------
    base, perturbed : Surface

    Returns
    -------
    HausdorffDistance

    Notes
    -----
    Cost: 30 microseconds a node. For flat triangles it is what VTK's
    vtkHausdorffDistancePointSetFilter computes from points to cells.

    Examples
    --------
    A triangle and its half of the same height: the far corner is 1 from the smaller one.

    >>> corners = [[0, 0, 0], [2, 0, 0], [0, 1, 0]]
    >>> whole = Surface(corners, [[0, 1, 2]])
    >>> half = Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> distance = hausdorff_distance(whole, half)
    >>> distance.from_base, distance.from_perturbed, distance.largest
    (1.0, 0.0, 1.0)
    """
    there = closest_point(base, perturbed).distance
    back = closest_point(perturbed, base).distance
    return HausdorffDistance(float(np.abs(there).max()), float(np.abs(back).max()))


def enclosed_volume(surface: Surface) -> float:
    """Volume that a closed surface encloses.

    V = 1/3 sum over triangles of the integral of x . n dA, the divergence theorem, by a
    quadrature that is exact for flat triangles and for six-node ones.

    Parameters
    ----------
    surface : Surface

    Returns
    -------
    float
        length^3. Negative where the normals point inward, as for the isosurface of a distance;
        a cavity's wall counts against the wall around it. NaN for an open surface.

    Notes
    -----
    The volume of the mesh itself: for flat triangles it differs from that of a smooth surface
    by the order 2, for curved ones by the order 4. Cost: 1 microsecond a triangle.

    Examples
    --------
    >>> from isovary.shapes import icosphere
    >>> round(enclosed_volume(icosphere(3)) / (4 / 3 * np.pi), 4)
    1.0
    >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> tetrahedron = Surface(corners, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    >>> round(6 * enclosed_volume(tetrahedron), 12)
    1.0
    """
    if not _is_closed(surface.triangles):
        return math.nan
    barycentric, weights = quadrature()
    points = surface.points - surface.points.mean(axis=0)  # near the origin rounding is least
    places = np.einsum(
        "qi,mid->mqd", shape_functions(barycentric, surface.order), points[surface.triangles]
    )
    columns = tangents(points, surface.triangles, barycentric)
    across = np.cross(columns[..., 0], columns[..., 1])
    return float(((places * across).sum(axis=2) @ weights).sum() / 6)


def _is_closed(triangles: Ints) -> bool:
    """Whether each edge is passed as often one way as the other."""
    edges, of_triangle, _ = edges_of(triangles)
    starts = triangles[:, :3]
    forward = starts == edges[of_triangle][:, :, 0]
    balance = np.bincount(of_triangle.ravel(), np.where(forward, 1, -1).ravel(), len(edges))
    return bool((balance == 0).all())


def kinds_of_change(
    moved: Floats,
    deformed: Floats,
    strain: Floats,
    strain_floor: Floats,
    significant: Bools,
    found: Bools,
    *,
    size: float,
    least_strain: float = 0.01,
    least_move: float = 0.01,
) -> Ints:
    """Which kind of change happened at each node, from outside and from within.

    The first row that holds decides:

    ==== ============= ============================================================
    code kind          rule
    ==== ============= ============================================================
    -1   unknown       no partner
    4    new shape     the intrinsic signature changed by more than its noise
    3    stretched     strain above ``max(2 strain_floor, least_strain)``: lengths
                       changed, but not what the signature sees of them
    2    bent          deformed above ``least_move size``: moved against the rest
                       of the surface, with the old lengths and signature
    1    moved rigidly moved above ``least_move size``, but along with the whole
    0    unchanged     none of them
    ==== ============= ============================================================

    A row that needs a number that is NaN makes the node unknown, if no row above it holds.

    Parameters
    ----------
    moved : array (n,)
        Length of the displacement where the surfaces lie; length.
    deformed : array (n,)
        Length of the displacement that is left after the rigid alignment; length.
    strain : array (n,)
        Size of the metric distortion, 0 for an isometry.
    strain_floor : array (n,)
        Its noise.
    significant : array (n,)
        Mask of the nodes whose signature changed.
    found : array (n,)
        Mask of the nodes with a partner.
    size : float
        What lengths are measured by, such as the square root of the base's area; length.
    least_strain : float
        Default 1 %, above what corresponding points that slid a little along the surface feign.
    least_move : float
        Part of ``size``. Default 1 %, about what is seen in a picture.

    Returns
    -------
    array (n,)
        Codes of :class:`Kind`.

    Raises
    ------
    ArgumentError
        A03 for arrays of unequal shapes, A02 for a size that is not positive, or a negative
        threshold.

    Notes
    -----
    *Bent* is said of the place that moved, not of the hinge: an arm that swings rigidly on a
    bending joint is bent here as a whole, since it no longer lies where the rest of the surface
    would put it; only what stays with the whole is *moved rigidly*. Cost: n operations.

    Examples
    --------
    A place that nobody finds, one that lies as before, and one that moved by a tenth with the
    whole:

    >>> moved, still = np.array([np.nan, 0.0, 0.1]), np.array([np.nan, 0.0, 0.0])
    >>> none, found = np.array([False] * 3), np.array([False, True, True])
    >>> codes = kinds_of_change(moved, still, still, still, none, found, size=1.0)
    >>> [Kind(code).words for code in codes]
    ['unknown', 'unchanged', 'moved rigidly']
    """
    numbers = {"moved": moved, "deformed": deformed, "strain": strain, "strain_floor": strain_floor}
    _check_kinds({**numbers, "significant": significant, "found": found}, size)
    if not (least_strain >= 0 and least_move >= 0):
        raise ArgumentError(
            "A02",
            "least_strain, least_move: expected 0 or more, got "
            f"{least_strain:g} and {least_move:g}",
        )
    limit = np.maximum(NOISE_FACTOR * strain_floor, least_strain)
    kinds = np.full(len(moved), Kind.UNCHANGED, dtype=np.int64)
    for value, least, kind in (
        (moved, least_move * size, Kind.MOVED),
        (deformed, least_move * size, Kind.BENT),
        (strain, limit, Kind.STRETCHED),
    ):
        kinds[value > least] = kind
        kinds[np.isnan(value) | np.isnan(least)] = Kind.UNKNOWN
    kinds[significant] = Kind.NEW_SHAPE
    kinds[~found] = Kind.UNKNOWN
    return kinds


def _check_kinds(arrays: dict[str, Floats | Bools], size: float) -> None:
    shapes = {name: array.shape for name, array in arrays.items()}
    if len(set(shapes.values())) > 1 or len(shapes["moved"]) != 1:
        raise ArgumentError("A03", f"arrays: expected one shape (n,), got {shapes}")
    masks = [name for name in ("significant", "found") if arrays[name].dtype != np.bool_]
    if masks:
        raise ArgumentError("A03", f"{', '.join(masks)}: expected a mask of booleans, got numbers")
    if not (size > 0 and math.isfinite(size)):
        raise ArgumentError("A02", f"size: expected a positive length, got {size:g}")


def extrinsic_summary(
    base: Surface,
    perturbed: Surface,
    correspondence: Correspondence,
    *,
    motion: RigidMotion | None = None,
) -> dict[str, float | None]:
    """Areas, volumes, distances and displacements of two surfaces as plain numbers for JSON.

    Parameters
    ----------
    base, perturbed : Surface
        Where they lie.
    correspondence : Correspondence
        From base to perturbed; its ``distance`` is the normal displacement.
    motion : RigidMotion, optional
        That carries the perturbed surface onto the base. Default: none, no alignment.

    Returns
    -------
    dict
        ``base_area``, ``perturbed_area`` (length^2); ``base_volume``, ``perturbed_volume``
        (length^3); ``hausdorff_from_base``, ``hausdorff_from_perturbed``, ``hausdorff_distance``
        and ``hausdorff_distance_aligned``, with the perturbed surface moved (length);
        ``normal_displacement_mean``, ``..._mean_size``, ``..._largest_size`` (length; means by
        area, positive to the normals' side). None for what is unknown: the volume of an open
        surface, an alignment that was not made, displacements without a partner.

    Notes
    -----
    Cost: 30 microseconds for each node of both, twice with a motion.

    Examples
    --------
    A sphere grown by a tenth, its volume by 1.1^3:

    >>> from isovary.correspondence import identity
    >>> from isovary.shapes import icosphere
    >>> small = icosphere(2)
    >>> large = Surface(1.1 * small.points, small.triangles)
    >>> said = extrinsic_summary(small, large, identity(small, large))
    >>> round(said["perturbed_volume"] / said["base_volume"], 9)
    1.331
    >>> round(said["normal_displacement_mean"], 9), said["hausdorff_distance_aligned"]
    (0.1, None)
    """
    apart = hausdorff_distance(base, perturbed)
    aligned = math.nan
    if motion is not None:
        aligned = hausdorff_distance(base, motion.surface(perturbed)).largest
    distance = np.abs(correspondence.distance)
    known = np.isfinite(distance)
    numbers = {
        "base_area": base.area,
        "perturbed_area": perturbed.area,
        "base_volume": enclosed_volume(base),
        "perturbed_volume": enclosed_volume(perturbed),
        "hausdorff_from_base": apart.from_base,
        "hausdorff_from_perturbed": apart.from_perturbed,
        "hausdorff_distance": apart.largest,
        "hausdorff_distance_aligned": aligned,
        "normal_displacement_mean": _mean(base, correspondence.distance),
        "normal_displacement_mean_size": _mean(base, distance),
        "normal_displacement_largest_size": distance[known].max() if known.any() else math.nan,
    }
    return {k: float(v) if math.isfinite(v) else None for k, v in numbers.items()}


def _mean(surface: Surface, values: Floats) -> float:
    """Mean by area over the nodes where the values are known."""
    known = np.isfinite(values)
    areas = node_areas(surface.points, surface.triangles)[known]
    return float(areas @ values[known] / areas.sum()) if areas.sum() > 0 else math.nan
