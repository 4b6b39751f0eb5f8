"""The noise floor of a change: how much of it is the doing of the mesh and of the samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from math import comb

import numpy as np
from numpy.typing import ArrayLike

from .carrying import carry, carry_isometrically
from .correspondence import closest_point, interpolate
from .difference import signature_difference
from .geometry import EDGES, Bools, Floats, linear_triangles
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
"""A change counts where its norm exceeds this many noise floors, of two standard errors each."""

_SMOOTHINGS = 4
_STANDARD_ERRORS = 2.0  # in a floor: 95 % of a normal distribution
_NORMAL_MEDIAN = 0.6745  # median size of a normal distribution, in standard deviations
_MOST_DIFFERENCES = 4  # along each axis


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
    difference d is taken at the coarser mesh's nodes, where it contains the least error of
    interpolation, squared, averaged over a neighbourhood of four rings of nodes, and its root
    taken: a local root mean square, so that a chance agreement at one node does not pass for
    accuracy. With r times fewer vertices the coarser mesh errs g = r^order times more
    (h^2 for flat, h^4 for curved elements). The two errors then differ by at least g - 1 times
    the finer one's, which they do if they have the same sign everywhere, so its standard error
    is at most d / (g - 1); the floor is two of these, which a normally distributed error keeps
    below at 95 % of the nodes. More than r = 2 is taken for 2. The floor does not
    contain what both meshes share: the sampling of the fields
    (:func:`sampling_floor` does), the number of eigenpairs (:func:`truncation_floor` does), and
    the error that a graph Laplacian makes on every mesh alike.

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
    Cost: two closest-point searches, 20 microseconds a node.

    Examples
    --------
    Curved meshes with about four times the vertices of one another, taken for twice: a
    difference of 0.75 everywhere is 3 times the error, and the floor twice that.

    >>> from isovary.shapes import icosphere
    >>> fine, coarse = icosphere(2), icosphere(1)
    >>> floor = noise_floor(fine, np.ones((642, 1)), coarse, np.full((162, 1), 0.25))
    >>> float(floor.min().round(9)), float(floor.max().round(9))
    (0.5, 0.5)
    """
    here = interpolate(closest_point(coarse, surface), surface, change)
    rms = _local_rms(coarse, here - coarse_change)
    flat = Surface(coarse.points, linear_triangles(coarse.triangles), coarse.normals)
    gain = _refinement(surface, coarse) ** (order or surface.order)
    floor = interpolate(closest_point(surface, flat), flat, rms)  # linear: nowhere negative
    return _STANDARD_ERRORS / (gain - 1) * floor


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
    through: Sequence[LevelSet] = (),
    laplacian: Operator = fem,
    signature: Signature = heat_kernel_signature,
    rng: int = 7,
) -> Floats:
    """Numerical error of a change due to the samples of the fields, from every other sample.

    The carried change is computed with splines through all samples and through
    every other one, on one mesh. If halving the spacing divides the error by q,
    a (q - 1)th of the difference is the error with all samples; two of its local root
    mean squares are taken as in :func:`noise_floor`. q is measured: the error of
    every fourth sample over that of every other
    (:func:`isovary.interpolation_errors`), at most 16, the cubic spline's own,
    and at least 2. Sampling errors that both fields share cancel, as they do in the change.

    White noise does not fall with the spacing, and little of it hides behind the spline's
    error at every other sample. Its size is read off the samples' differences near the
    isosurface, up to the fourth along every axis, which leave of a smooth field almost nothing
    (Moré and Wild); noise of that size is added to both fields, and what that does to the
    change is the other part of the floor: the root of the sum of the squares. Of a smoothed
    field the noise is that of the samples before, smoothed alike. Noise that neighbouring
    samples shared from the start is not seen.

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
    through : sequence of LevelSet
        Fields between the two, aligned, that the mesh is carried through.
    laplacian, signature : callable
        As in :func:`isovary.compare`.
    rng : int
        Seed of the noise that is added.

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
    Cost: six eigensolves on the mesh given.

    References
    ----------
    J. J. Moré, S. M. Wild, SIAM J. Sci. Comput. 33 (2011) 1292-1314, for the size of the noise.

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
    methods, motion = Methods(laplacian, signature), motion or RigidMotion()
    pair, chance = (base, perturbed), np.random.default_rng(rng)
    there = moved(perturbed, motion)
    both = carried(surface, [base, *through, there], isovalue, isometric)
    change = partial(_change, pairs=pairs, samples=times, methods=methods)
    again = partial(_carried_again, surface, both[0], there, isovalue, isometric)
    halves = [_every_other(field) for field in pair]
    noisy = [_with_more_noise(field, isovalue, chance) for field in pair]
    all_samples = change(surface, *both)
    half_samples, more_noise = (
        change(*again(first, moved(second, motion))) for first, second in (halves, noisy)
    )
    gain = min(_gain(field, isovalue) for field in pair)
    smooth = _local_rms(surface, half_samples - all_samples) / (gain - 1)
    return _STANDARD_ERRORS * np.hypot(smooth, _local_rms(surface, more_noise - all_samples))


def carried(
    surface: Surface, fields: Sequence[LevelSet], isovalue: float, isometric: bool
) -> tuple[Surface, Correspondence]:
    """The mesh carried through the fields to the last one: isometrically, or along normals."""
    if isometric:
        return carry_isometrically(surface, fields, isovalue)
    current, found = surface, np.ones(len(surface.points), dtype=bool)
    for field in fields[1:]:
        current, match = carry(current, field, isovalue)
        found &= match.found
    along = np.einsum("nd,nd->n", current.points - surface.points, surface.normals)
    distance = np.where(found, match.distance if len(fields) == 2 else along, np.nan)
    triangle = np.where(found, match.triangle, -1)
    return current, replace(match, triangle=triangle, distance=distance)


def truncation_floor(
    surface: Surface, change: Floats, fewer: Floats, last: ArrayLike, times: ArrayLike
) -> Floats:
    """Error of a change by the eigenpairs that were left out, from leaving out some more.

    By Weyl's law eigenvalues have a constant density, and where lengths change by some factor
    all of them change by another, c: exp(-c m t) by m t exp(-m t) for a small change of c. So
    the change beyond an eigenvalue m is in proportion to F(m) = (1 + m t) exp(-m t). Between m'
    and m lies the part F(m') - F(m), and the difference of the two changes shows what it does;
    what lies beyond m is F(m) / (F(m') - F(m)) times as much. Two of its local root mean
    squares are taken as in :func:`noise_floor`.

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
    F(0) = 1, and F(1) = 2 / e at t = 1: beyond 1 lies 2 / (e - 2) times what lies below, and the
    floor is twice that.

    >>> from isovary.shapes import icosphere
    >>> here = np.ones((162, 1))
    >>> floor = truncation_floor(icosphere(1), here, here - (np.e - 2) / 4, [0, 1], [1.0])
    >>> float(floor.min().round(9)), float(floor.max().round(9))
    (1.0, 1.0)
    """
    fewest, most = np.multiply.outer(np.asarray(last, dtype=float), np.asarray(times))
    part = (1 + most) / (1 + fewest) * np.exp(fewest - most)
    floor: Floats = _STANDARD_ERRORS * _local_rms(surface, change - fewer) * part / (1 - part)
    return floor


def combined_floor(floors: Sequence[Floats]) -> Floats:
    """Root of the mean square of several floors (n, T) of one error."""
    mean: Floats = np.sqrt(np.mean(np.square(floors), axis=0))
    return mean


def _every_other(field: ScalarField) -> ScalarField:
    values, spacing = field.values[::2, ::2, ::2], 2 * field.spacing
    return replace(field, values=values, spacing=spacing, unsmoothed=None)


def _gain(field: ScalarField, isovalue: float) -> float:
    """Factor by which halving the spacing divides the isosurface's error, 2 if unknown, to 16."""
    name = "logarithmic" if field.logarithmic else "plain"
    half = interpolation_errors(field, isovalue).get(name, np.nan)
    quarter = interpolation_errors(_every_other(field), isovalue).get(name, np.nan)
    ratio = quarter / half if half > 0 else 16.0
    return float(np.clip(np.nan_to_num(ratio, nan=2.0), 2.0, 16.0))


def _with_more_noise(field: ScalarField, isovalue: float, rng: np.random.Generator) -> ScalarField:
    """The field with as much noise again as its samples show, white or, as they are, smoothed."""
    from scipy.ndimage import gaussian_filter

    near, noise = _beside(field.values > isovalue), rng.standard_normal(field.values.shape)
    if field.unsmoothed is not None:
        noise = gaussian_filter(noise, field.smoothing / field.spacing, mode="nearest")
        rough = field.values + _noise_of_samples(field.unsmoothed, near) * noise
        return replace(field, values=np.maximum(rough, field.values.min()))
    if field.logarithmic:
        rough = field.values * np.exp(_noise_of_samples(np.log(field.values), near) * noise)
    else:
        rough = field.values + _noise_of_samples(field.values, near) * noise
    return replace(field, values=rough)


def _noise_of_samples(values: Floats, near: Bools) -> float:
    """Standard deviation of white noise of the values (nx, ny, nz), where they are near.

    Differences of order k along each of the three axes multiply it by the root of
    ((2k)! / k!^2)^3; the smallest estimate has the least of the smooth field in it. The median
    is not moved by a few creases.
    """
    differences, estimates = values, []
    for k in range(1, 1 + min(_MOST_DIFFERENCES, min(near.shape) - 1)):
        for axis in range(3):
            differences = np.diff(differences, axis=axis)
        middle = near[tuple(slice(k // 2, k // 2 + count) for count in differences.shape)]
        if middle.any():
            size = np.median(np.abs(differences[middle])) / _NORMAL_MEDIAN
            estimates.append(size / comb(2 * k, k) ** 1.5)
    return float(min(estimates, default=0.0))


def _beside(above: Bools) -> Bools:
    """Samples with a neighbour on the other side."""
    beside = np.zeros_like(above)
    for axis in range(3):
        flips = np.moveaxis(np.diff(above, axis=axis), axis, 0)
        along = np.moveaxis(beside, axis, 0)
        along[:-1] |= flips
        along[1:] |= flips
    return beside


def _carried_again(
    surface: Surface,
    image: Surface,
    field: LevelSet,
    isovalue: float,
    isometric: bool,
    base: ScalarField,
    perturbed: LevelSet,
) -> tuple[Surface, Surface, Correspondence]:
    """The mesh and its image on the perturbed field, both carried on to fields near theirs."""
    first, at_first = carry(surface, base, isovalue)
    if isometric:
        second, _ = carry_isometrically(first, [field, perturbed], isovalue, start=image)
        return first, second, at_first
    second, at_second = carry(first, perturbed, isovalue)
    found = np.where(at_first.found, at_second.triangle, -1)
    return first, second, replace(at_second, triangle=found)


def _change(
    first: Surface,
    second: Surface,
    match: Correspondence,
    *,
    pairs: int,
    samples: Floats,
    methods: Methods,
) -> Floats:
    """The change from a mesh to its image; NaN where a node is lost."""
    operator = methods.laplacian(first)
    more = eigenpairs(operator, with_spare(pairs, len(operator.unknowns)))
    there = eigenpairs(methods.laplacian(second), pairs, start=more).truncate(pairs)
    here = more.truncate(pairs)
    before, after = (methods.sample(p, samples) for p in (here, there))
    scale = methods.scale(first, here, before, samples)
    return np.where(match.found[:, None], signature_difference(before, after, scale), np.nan)


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
    """How many times more vertices the finer mesh has, 1.05 to 2: beyond, the order is a hope."""
    fine, few = (len(np.unique(mesh.corners)) for mesh in (surface, coarse))
    return float(np.clip(fine / few, 1.05, 2.0))


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
