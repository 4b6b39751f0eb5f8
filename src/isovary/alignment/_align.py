"""Rigid alignment: the motion that brings a perturbed surface nearest to the base."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..errors import ArgumentError
from ..geometry import EDGES, Bools, Floats, Ints, linear_triangles, rim_nodes
from ..level_sets import LevelSet
from ..projection import newton
from ..records import Surface
from ..rigid_motion import RigidMotion
from ._starts import Poses, Sites, exponential, sites_of, starts

_UNSEEN = 1e-2  # part of a motion along the normals below which it is not seen
_CLEARLY = 0.5  # another pose must leave less than this part of the distance,
_ALIKE = 1.25  # up to this factor poses count as equally near
_MIRROR = 0.5  # and a mirrored one less than this part of what the best other leaves
_FLOOR = 1e-5  # distances, in sizes, that no other pose need explain
_LITTLE = 1 + 2**0.5  # trace of a turn of 45 degrees, less than which no symmetry undercuts
_REAL = 1e-3  # least relative gain that counts as a motion
_ROUNDING = 1e-12  # in coordinates
_SAMPLES, _FEW = 300, 150  # nodes that try and shortlist the starts
_ROUNDS = 40
_ROUGHLY, _FINELY = 1e-2, 1e-8  # gains of the squared distance that are worth a step
_STEPS = 8  # towards the nearest point of an isosurface


@dataclass(frozen=True, eq=False)
class Alignment:
    """How a perturbed surface was moved onto the base.

    Parameters
    ----------
    motion : RigidMotion
        x = R y + t for y on the perturbed surface, x near the base.
    rms_before : float
        Root of the mean squared distance of the base's nodes, weighted by their areas, to the
        perturbed surface as it came; length.
    rms_after : float
        The same after the motion.
    held : tuple of str
        Axes ("x", "y", "z") of the faces of the box that cut the surface: the motion keeps these
        faces. Empty for a closed surface.

    Examples
    --------
    >>> Alignment(RigidMotion(translation=[1, 0, 0]), 0.5, 0.3, ()).share
    0.64
    """

    motion: RigidMotion
    rms_before: float
    rms_after: float
    held: tuple[str, ...]

    @property
    def share(self) -> float:
        """Part of the mean squared distance that the motion explains, 0 to 1."""
        if self.motion.is_identity:
            return 0.0
        return 1 - (self.rms_after / self.rms_before) ** 2


def align(
    base: Surface,
    perturbed: Surface,
    field: LevelSet | None = None,
    isovalue: float | None = None,
) -> Alignment:
    """Rigid motion that brings a perturbed surface nearest to the base.

    Minimizes sum_i a_i d(T^-1 x_i, S')^2 over rigid motions T, mirrors included, with x_i the
    base's nodes, a_i their areas and d the distance to the perturbed surface S'. A rigid motion
    changes no intrinsic shape.

    Parameters
    ----------
    base : Surface
    perturbed : Surface
        Any mesh of the perturbed surface, in the perturbed run's own coordinates. With a field
        it serves only to come near.
    field : LevelSet, optional
        The perturbed field: distances are then those to its isosurface. Without it they
        are those to the planes at the nearest nodes of ``perturbed``, as accurate as that mesh.
    isovalue : float, optional
        In the field's unit; given with the field.

    Returns
    -------
    Alignment
        Exactly the identity if the surfaces agree to rounding, or if no motion lowers the
        root-mean-square distance by more than 0.1 %.

    Raises
    ------
    ArgumentError
        A02 for a field without an isovalue, or the reverse.

    Notes
    -----
    Gauss-Newton steps on the distances along the normals, applied by the exponential map. They
    start from the place as it is and, unless that leaves less than 1e-5 of the size after a turn
    of less than 45 degrees, also with the centroids on each other from the turns of a cube, those
    of the principal axes, and the mirror images of all. The least turned pose wins unless others
    leave less than half of its distance: then the nearest, and of those that leave up to a
    quarter more the least turned. A mirrored pose must leave less than half of what the best other
    leaves. So a surface that is symmetric, or nearly so, is not turned into its own
    likeness, nor a slightly changed one mirrored.

    Motions that hardly move the surface along its normals, by less than 1 % of their way (a
    sphere's turn, a spheroid's about its axis), are left out: nothing could tell how large
    they are. Where several parts moved against each other, least squares may bring one of them
    together and leave the others apart.

    An open surface whose rim lies on faces of the field's box stays on them: no shift across
    such a face, a turn about an axis only if no other axis has such faces. Without a field, or
    if its box has its faces elsewhere, the surfaces are aligned freely.

    Cost: 0.1 s for 2000 nodes and 64^3 samples if a small motion explains all, else 0.3 to 1 s.

    References
    ----------
    Y. Chen, G. Medioni, *Object modelling by registration of multiple range images*, Image and
    Vision Computing 10 (1992) 145-155 (distances along normals).

    Examples
    --------
    A mesh that was shifted by 0.1 along x comes back:

    >>> from isovary.shapes import ellipsoid
    >>> base = ellipsoid((1.0, 1.2, 1.5), 3)
    >>> found = align(base, RigidMotion(translation=[0.1, 0, 0]).surface(base))
    >>> found.motion.translation.round(6)[0].tolist(), round(found.share, 6), found.held
    (-0.1, 1.0, ())
    """
    if (field is None) != (isovalue is None):
        raise ArgumentError(
            "A02",
            "field, isovalue: expected both or neither, got one; the distance to an isosurface "
            "needs both",
        )
    held = np.zeros(3, dtype=bool) if field is None else _held(base, field)
    names = tuple(name for name, holds in zip("xyz", held, strict=True) if holds)
    sites = sites_of(base)
    frame = _frame(base, sites, held)
    rough = _mesh_feet(perturbed)
    exact = rough
    rounding = _ROUNDING * max(float(np.abs(s.points).max()) for s in (base, perturbed))
    if field is not None and isovalue is not None:
        exact = _field_feet(rough, field, isovalue)
        rounding += _blur(perturbed, field, isovalue)
    unmoved = _measure(_IDENTITY, sites, exact)
    before = float(unmoved.rms[0])
    stays = Alignment(RigidMotion(), before, before, names)
    if before <= rounding or frame.seen.shape[1] == 0:
        return stays
    start = _best_start(base, perturbed, held, sites, frame, rough, exact)
    best = _descend(start, sites, exact, frame, _FINELY, rounding)
    after = float(best.rms[0])
    if not after < (1 - _REAL) * before:
        return stays
    return Alignment(RigidMotion(best.poses.turns[0], best.poses.shifts[0]), before, after, names)


@dataclass(frozen=True, eq=False)
class _Frame:
    """Centre and size of the base, and the motions (6, k) about it that are allowed and seen."""

    centre: Floats
    size: float
    seen: Floats


_IDENTITY = Poses(np.eye(3)[None], np.zeros((1, 3)))


@dataclass(frozen=True, eq=False)
class _Feet:
    """Nearest points (m, 3), normals there, and how far (m,) beside one still counts as on it."""

    points: Floats
    normals: Floats
    slack: Floats


_FeetOf = Callable[[Floats], _Feet]


class _Fit(NamedTuple):
    """Poses with moved feet (s, n, 3), two unit directions and the distances (s, n) along them."""

    turns: Floats
    shifts: Floats
    feet: Floats
    normals: Floats
    sides: Floats
    along: Floats
    beside: Floats
    rms: Floats

    @property
    def poses(self) -> Poses:
        return Poses(self.turns, self.shifts)


def _held(base: Surface, field: LevelSet) -> Bools:
    """The axes (3,) on whose faces of the box the base has rim nodes."""
    low, high = field.bounds
    rim = base.points[rim_nodes(base.triangles)]
    edge = 1e-9 * (high - low)
    on_face: Bools = (np.abs(rim - low) < edge) | (np.abs(rim - high) < edge)
    return np.asarray(on_face.any(axis=0))


def _blur(perturbed: Surface, field: LevelSet, isovalue: float) -> float:
    """Distance that the rounding of a field's values makes."""
    steep = _length(field.level_set(perturbed.points, isovalue)[1])
    steep = steep[steep > 0]
    return field.rounding / float(np.median(steep)) if len(steep) else 0.0


def _frame(base: Surface, sites: Sites, held: Bools) -> _Frame:
    """The base's frame, with the motions that keep the held faces and that its normals show."""
    centre = sites.weights @ sites.points
    offsets = sites.points - centre
    size = float(np.sqrt(sites.weights @ (offsets**2).sum(axis=1)))
    rows = np.hstack([base.normals, np.cross(offsets / size, base.normals)])
    turns = [not np.delete(held, axis).any() for axis in range(3)]
    allowed = np.concatenate([~held, turns])
    square = np.einsum("n,ni,nj->ij", sites.weights, rows, rows) * np.outer(allowed, allowed)
    values, vectors = np.linalg.eigh(square)
    return _Frame(centre, size, vectors[:, values > _UNSEEN**2 * values[-1]])


def _mesh_feet(surface: Surface) -> _FeetOf:
    """Nearest nodes, each a piece of a plane as wide as its longest edge."""
    from scipy.spatial import cKDTree

    pieces = linear_triangles(surface.triangles)
    links = np.concatenate([pieces[:, list(pair)] for pair in EDGES])
    lengths = np.linalg.norm(surface.points[links[:, 0]] - surface.points[links[:, 1]], axis=1)
    longest = np.zeros(len(surface.points))
    np.maximum.at(longest, links.ravel(), np.repeat(lengths, 2))
    tree = cKDTree(surface.points)

    def feet(points: Floats) -> _Feet:
        node = tree.query(points)[1]
        return _Feet(surface.points[node], surface.normals[node], longest[node])

    return feet


def _field_feet(rough: _FeetOf, field: LevelSet, isovalue: float) -> _FeetOf:
    """Nearest points of an isosurface, started from the points or, far away, from a mesh of it.

    A point whose steps go astray, or farther than the mesh, gets the mesh's foot.
    """
    cell = float(field.spacing.max())

    def feet(points: Floats) -> _Feet:
        mesh = rough(points)
        far = _length(points - mesh.points)
        near = far <= 2 * np.maximum(cell, mesh.slack)
        start = np.where(near[:, None], points, mesh.points)
        found, normals, off = _below(points, start, field, isovalue)
        lost = np.flatnonzero(~((off <= cell / 10) & (_length(points - found) <= far)))
        if len(lost):
            again, arrived = newton(mesh.points[lost], field, isovalue)
            found[lost] = np.where(arrived[:, None], again, mesh.points[lost])
            normals[lost] = mesh.normals[lost]
        return _Feet(found, normals, np.full(len(points), cell))

    return feet


def _below(
    points: Floats, start: Floats, field: LevelSet, isovalue: float
) -> tuple[Floats, Floats, Floats]:
    """Feet on an isosurface that the points stand straight above, normals, and how far off it.

    Each step is one of Newton's along the gradient, and one sideways to below the point. Within
    the box, but for the last step, which follows the surface's plane.
    """
    low, high = field.bounds
    cell = float(field.spacing.max())
    feet, normals = start.copy(), np.zeros_like(start)
    off = np.full(len(start), np.nan)
    active = np.arange(len(start))
    for _ in range(_STEPS):
        feet[active] = np.clip(feet[active], low, high)
        level, slope = field.level_set(feet[active], isovalue)
        steep = _length(slope)
        above = points[active] - feet[active]
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            normal, height = -slope / steep[:, None], level / steep
            across = height - np.einsum("nd,nd->n", above, normal)
            step = above + across[:, None] * normal
            step *= (cell / np.maximum(_length(step), cell))[:, None]
        feet[active] += step
        normals[active], off[active] = normal, np.abs(height)
        active = active[_length(step) > 1e-3 * _length(above + step)]
        if len(active) == 0:
            break
    return feet, normals, off


def _length(vectors: Floats) -> Floats:
    length: Floats = np.linalg.norm(vectors, axis=-1)
    return length


def _measure(poses: Poses, sites: Sites, feet_of: _FeetOf) -> _Fit:
    """Distances of the sites to the surface in each pose: along normals, and beyond its rims."""
    own = np.einsum("sji,snj->sni", poses.turns, sites.points - poses.shifts[:, None])
    found = feet_of(own.reshape(-1, 3))
    offset = own - found.points.reshape(own.shape)
    normal = found.normals.reshape(own.shape)
    along = np.einsum("snd,snd->sn", offset, normal)
    side = offset - along[..., None] * normal
    length = _length(side)
    beside = np.maximum(length - found.slack.reshape(length.shape), 0)
    side = side / np.where(beside > 0, length, np.inf)[..., None]
    turned = [np.einsum("sij,snj->sni", poses.turns, v) for v in (offset, normal, side)]
    rms = np.sqrt(np.einsum("n,sn->s", sites.weights, along**2 + beside**2))
    return _Fit(*poses, sites.points - turned[0], turned[1], turned[2], along, beside, rms)


def _steps(fit: _Fit, sites: Sites, frame: _Frame) -> tuple[Floats, Floats]:
    """Gauss-Newton steps (s, 6) within what is seen, and what they should take off rms^2.

    The first half of a step is a shift, the other a turn times the size.
    """
    lever = (fit.feet - frame.centre) / frame.size
    square, slope = np.zeros((len(lever), 6, 6)), np.zeros((len(lever), 6))
    for direction, distance in ((fit.normals, fit.along), (fit.sides, fit.beside)):
        if distance.any():
            rows = np.concatenate([direction, np.cross(lever, direction)], axis=2)
            heavy = rows * sites.weights[:, None]
            square += np.einsum("sni,snj->sij", heavy, rows)
            slope += np.einsum("sni,sn->si", heavy, distance)
    values, vectors = np.linalg.eigh(frame.seen.T @ square @ frame.seen)
    kept = values > _UNSEEN**2 * values[:, -1:]
    part = np.einsum("sji,sj->si", vectors, slope @ frame.seen)
    part = np.where(kept, part / np.where(kept, values, 1), 0)
    steps = np.einsum("sij,sj->si", vectors, part) @ frame.seen.T
    turn = _length(steps[:, 3:]) / frame.size
    return steps / np.maximum(turn, 1)[:, None], np.einsum("si,si->s", steps, slope)


def _moved(poses: Poses, steps: Floats, frame: _Frame) -> Poses:
    """Poses after a step each: a turn about the base's centre, then a shift."""
    turns = exponential(steps[:, 3:] / frame.size)
    shifts = np.einsum("sij,sj->si", turns, poses.shifts - frame.centre) + frame.centre
    return Poses(turns @ poses.turns, shifts + steps[:, :3])


def _descend(
    poses: Poses, sites: Sites, feet_of: _FeetOf, frame: _Frame, gain: float, enough: float
) -> _Fit:
    """Steps that lower the distance, a quarter as long after one that did not.

    A pose rests once a step promises less than a part ``gain`` of rms^2, or rms is ``enough``.
    """
    fit = _Fit(*(part.copy() for part in _measure(poses, sites, feet_of)))
    damp = np.ones(len(fit.rms))
    for _ in range(_ROUNDS):
        steps, promise = _steps(fit, sites, frame)
        moving = (promise > gain * fit.rms**2) & (fit.rms > enough) & (damp > 1e-2)
        active = np.flatnonzero(moving)
        if len(active) == 0:
            break
        here = Poses(fit.turns[active], fit.shifts[active])
        trial = _measure(_moved(here, damp[active, None] * steps[active], frame), sites, feet_of)
        better = trial.rms < fit.rms[active]
        damp[active] = np.where(better, 1.0, damp[active] / 4)
        for all_of, new in zip(fit, trial, strict=True):
            all_of[active[better]] = new[better]
    return fit


def _best_start(
    base: Surface,
    perturbed: Surface,
    held: Bools,
    sites: Sites,
    frame: _Frame,
    rough: _FeetOf,
    exact: _FeetOf,
) -> Poses:
    """The pose, roughly fitted, that the rule in the notes of align chooses."""
    floor, some = _FLOOR * frame.size, sites.some(_SAMPLES)
    near = _descend(_IDENTITY, some, rough, frame, _ROUGHLY, 0.0)
    near = _descend(near.poses, some, exact, frame, _ROUGHLY, floor / 10)
    if near.rms[0] <= floor and np.trace(near.turns[0]) > _LITTLE:
        return near.poses
    fit = _descend(starts(base, perturbed, held), sites.some(_FEW), rough, frame, _ROUGHLY, 0.0)
    few = _shortlist(fit)
    poses = Poses(
        np.concatenate([near.turns, fit.turns[few]]), np.concatenate([near.shifts, fit.shifts[few]])
    )
    fit = _descend(poses, some, exact, frame, _ROUGHLY, floor / 10)
    fit = _descend(fit.poses, sites, exact, frame, _ROUGHLY, floor / 10)  # some may mislead
    best = _choice(fit, floor)
    return Poses(fit.turns[[best]], fit.shifts[[best]])


def _shortlist(fit: _Fit) -> list[int]:
    """Poses worth a closer look: least turned, nearest, least turned of the near ones."""
    mirrored = np.linalg.det(fit.turns) < 0
    few = []
    for kind in (~mirrored, mirrored):
        if kind.any():
            which = np.flatnonzero(kind)
            rms = fit.rms[which]
            near = which[rms <= 2 * rms.min()]
            few += [_least_turned(which, fit), _least_turned(near, fit), int(which[rms.argmin()])]
    return sorted(set(few))


def _choice(fit: _Fit, floor: float) -> int:
    """The pose that the rule chooses."""
    mirrored = np.linalg.det(fit.turns) < 0
    best = _best_of(np.flatnonzero(~mirrored), fit, floor)
    if mirrored.any():
        other = _best_of(np.flatnonzero(mirrored), fit, floor)
        if fit.rms[other] + floor < _MIRROR * (fit.rms[best] + floor):
            return other
    return best


def _best_of(which: Ints, fit: _Fit, floor: float) -> int:
    """The least turned of some poses, or the least turned nearest if that is clearly nearer."""
    rms = fit.rms + floor
    plain = _least_turned(which, fit)
    near = _least_turned(which[rms[which] <= _ALIKE * rms[which].min()], fit)
    return near if rms[near] < _CLEARLY * rms[plain] else plain


def _least_turned(which: Ints, fit: _Fit) -> int:
    return int(which[np.argmax(np.trace(fit.turns[which], axis1=1, axis2=2))])
