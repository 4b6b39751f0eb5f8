"""The noise floor of a change: how much of it is the doing of the mesh and of the samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from .carrying import carry, carry_isometrically
from .correspondence import closest_point, interpolate
from .difference import signature_difference
from .geometry import EDGES, Floats, linear_triangles
from .laplacian import fem
from .level_sets import LevelSet, moved
from .meshing import interpolation_errors
from .methods import Methods, Operator, Signature
from .records import Correspondence, Surface
from .rigid_motion import RigidMotion
from .scalar_field import ScalarField
from .signature import heat_kernel_signature
from .spectrum import eigenpairs, with_spare

SIGNIFICANCE = 2.0
"""A change counts where its norm exceeds this many noise floors: two standard errors."""

_SMOOTHINGS = 4


def noise_floor(
    surface: Surface,
    change: Floats,
    coarse: Surface,
    coarse_change: Floats,
    *,
    order: int | None = None,
) -> Floats:
    """Numerical error of a change at each node and time, from a second, coarser base mesh.

    The same comparison was made on two base meshes of one isosurface. Their
    difference d at corresponding places is squared, averaged over a
    neighbourhood of four rings of nodes, and its root taken: a local root mean
    square, so that a chance agreement at one node does not pass for accuracy.
    With r times fewer vertices the coarser mesh errs r^order times more
    (h^2 for flat, h^4 for curved elements), so the finer one errs by
    d / (r^order - 1); the floor is that or d, whichever is larger. It does not
    contain what both meshes share: the sampling of the fields
    (:func:`sampling_floor` does), the number of eigenpairs, and the error that a graph
    Laplacian makes on every mesh alike.

    Parameters
    ----------
    surface : Surface
        Base mesh with n nodes.
    change : array (n, T)
    coarse : Surface
        Another mesh of the same isosurface, with fewer vertices and n' nodes.
    coarse_change : array (n', T)
        The change computed on it, at the same times.
    order : int, optional
        Half the order in h of the operator's error. Default: the surface's order, right
        for :func:`isovary.fem`; 1 for other operators.

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
    floor = _local_rms(surface, change - there)
    gain = _refinement(surface, coarse) ** (order or surface.order)
    return floor * max(1.0, 1.0 / (gain - 1.0))


def sampling_floor(
    surface: Surface,
    base: ScalarField,
    perturbed: ScalarField,
    isovalue: float,
    pairs: int,
    times: Floats,
    *,
    motion: RigidMotion | None = None,
    isometric: bool = True,
    laplacian: Operator = fem,
    signature: Signature = heat_kernel_signature,
) -> Floats:
    """Numerical error of a change due to the samples of the fields, from every other sample.

    The carried change is computed with splines through all samples and through
    every other one, on one mesh. If halving the spacing divides the error by q,
    a (q - 1)th of the difference is the error with all samples; its local root
    mean square is taken as in :func:`noise_floor`. q is measured: the error of
    every fourth sample over that of every other
    (:func:`isovary.interpolation_errors`), at most 16, the cubic spline's own,
    and at least 2; noise in the data shows as a small q. Sampling errors that
    both fields share cancel, as they do in the change.

    Parameters
    ----------
    surface : Surface
        A mesh of the base isosurface, with n nodes; a coarse one will do.
    base, perturbed : ScalarField
        At least seven samples along each axis.
    isovalue : float
    pairs : int
        Eigenpairs; a count that cuts no multiplet.
    times : array (T,)
        Diffusion times, or what else the signature is sampled at.
    motion : RigidMotion, optional
        Brings the perturbed field onto the base. Default: none.
    isometric : bool
        Carried isometrically, or along the normals.
    laplacian, signature : callable
        As in :func:`isovary.compare`.

    Returns
    -------
    array (n, T)
        In the change's unit; NaN around nodes that find no partner.

    Raises
    ------
    IsovaryError
        Of many kinds, where every other sample holds no such isosurface: then
        the error cannot be told, and is large.

    Notes
    -----
    Cost: four eigensolves on the mesh given.

    Examples
    --------
    A field that the spline reproduces has no such error:

    >>> def ball(radius):
    ...     return ScalarField.from_function(
    ...         lambda p: radius**2 - (p**2).sum(axis=-1),
    ...         bounds=((-2, -2, -2), (2, 2, 2)), shape=(9, 9, 9))
    >>> from isovary.shapes import icosphere
    >>> floor = sampling_floor(icosphere(1), ball(1.0), ball(1.1), 0.0, 25, np.array([0.5]))
    >>> bool(floor.max() < 1e-9)
    True
    """
    change = partial(
        _carried_change, surface, isovalue, pairs, times, Methods(laplacian, signature), isometric
    )
    motion = motion or RigidMotion()
    all_samples = change(base, moved(perturbed, motion))
    half_samples = change(_every_other(base), moved(_every_other(perturbed), motion))
    gain = min(_gain(base, isovalue), _gain(perturbed, isovalue))
    return _local_rms(surface, half_samples - all_samples) / (gain - 1)


def carried(
    surface: Surface, fields: Sequence[LevelSet], isovalue: float, isometric: bool
) -> tuple[Surface, Correspondence]:
    """The mesh on the isosurface of the last field: isometrically, or straight along normals."""
    if isometric:
        return carry_isometrically(surface, fields, isovalue)
    return carry(surface, fields[-1], isovalue)


def truncation_floor(
    surface: Surface, change: Floats, fewer: Floats, last: ArrayLike, times: ArrayLike
) -> Floats:
    """Error of a change by the eigenpairs that were left out, from leaving out some more.

    By Weyl's law eigenvalues have a constant density, so the heat trace beyond an eigenvalue m
    is in proportion to exp(-m t). Between m' and m lies the part exp(-m' t) - exp(-m t), and the
    difference of the two changes shows what it does; what lies beyond m is
    1 / (exp((m - m') t) - 1) times as much. Its local root mean square is taken as in
    :func:`noise_floor`.

    Parameters
    ----------
    surface : Surface
        With n nodes.
    change, fewer : array (n, T)
        With all pairs, and with fewer.
    last : array (2,)
        The last eigenvalues m' and m of the two.
    times : array (T,)
        Diffusion times; length^2.

    Returns
    -------
    array (n, T)
        In the change's unit.

    References
    ----------
    H. Weyl, Math. Ann. 71 (1912) 441-479.

    Examples
    --------
    Where m - m' = ln 2 / t as much lies beyond m as between m' and m:

    >>> from isovary.shapes import icosphere
    >>> here = np.ones((162, 1))
    >>> floor = truncation_floor(icosphere(1), here, here - 0.25, [1, 1 + np.log(2)], [1.0])
    >>> float(floor.min().round(9)), float(floor.max().round(9))
    (0.25, 0.25)
    """
    beyond = 1 / np.expm1(np.diff(last) * np.asarray(times))
    floor: Floats = _local_rms(surface, change - fewer) * beyond
    return floor


def combined_floor(floors: Sequence[Floats]) -> Floats:
    """Root of the mean square of several floors (n, T) of one error."""
    mean: Floats = np.sqrt(np.mean(np.square(floors), axis=0))
    return mean


def _every_other(field: ScalarField) -> ScalarField:
    return replace(field, values=field.values[::2, ::2, ::2], spacing=2 * field.spacing)


def _gain(field: ScalarField, isovalue: float) -> float:
    """Factor by which halving the spacing divides the isosurface's error, 2 if unknown, to 16."""
    name = "logarithmic" if field.logarithmic else "plain"
    half = interpolation_errors(field, isovalue).get(name, np.nan)
    quarter = interpolation_errors(_every_other(field), isovalue).get(name, np.nan)
    ratio = quarter / half if half > 0 else 16.0
    return float(np.clip(np.nan_to_num(ratio, nan=2.0), 2.0, 16.0))


def _carried_change(
    surface: Surface,
    isovalue: float,
    pairs: int,
    samples: Floats,
    methods: Methods,
    isometric: bool,
    base: ScalarField,
    perturbed: LevelSet,
) -> Floats:
    """The change between two fields on one mesh carried to both; NaN where a node is lost."""
    first, at_first = carry(surface, base, isovalue)
    second, at_second = carried(first, [base, perturbed], isovalue, isometric)
    known = at_first.found & at_second.found
    operator = methods.laplacian(first)
    more = eigenpairs(operator, with_spare(pairs, len(operator.unknowns)))
    there = eigenpairs(methods.laplacian(second), pairs, start=more).truncate(pairs)
    here = more.truncate(pairs)
    before, after = (methods.sample(p, samples) for p in (here, there))
    scale = methods.scale(first, here, before, samples)
    return np.where(known[:, None], signature_difference(before, after, scale), np.nan)


def _local_rms(surface: Surface, error: Floats) -> Floats:
    """Root mean square over each node's neighbourhood of what is known there, NaN if nothing is."""
    known = np.asarray(np.isfinite(error).all(axis=1))
    weight = _neighbourhood_mean(surface, known.astype(float)[:, None])
    total = _neighbourhood_mean(surface, np.where(known[:, None], error**2, 0.0))
    rms = np.full(error.shape, np.nan)
    reached = weight[:, 0] > 0
    rms[reached] = np.sqrt(total[reached] / weight[reached])
    return rms


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
