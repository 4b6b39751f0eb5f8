"""Points slid on a surface to the most isometric map there is."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .errors import CorrespondenceError
from .geometry import (
    Bools,
    Floats,
    Ints,
    edge_length,
    node_areas,
    node_places,
    tangents,
    triangle_areas,
)
from .isometry import Metric, distortion, metric_of
from .quasi_newton import Memory
from .records import Surface

if TYPE_CHECKING:
    from scipy.sparse import csc_array

_STEPS = 100
_ROUNDS = 20
_ROUND = 10.0  # last steps: a round that moves no point farther is the last
_SHRINKS = 0.5  # of the way of the round before: more, and it is the mesh that moves the points
_ANCHOR = 10.0  # what the strain is multiplied by, and 1, where all move by the surface's width
_FIRST_DAMPING, _DAMPING, _MOST_DAMPING = 1e-3, 1e-9, 1e6  # of the diagonal
_SHORTEST = 0.01  # part of a step that goes too far
_LITTLE = 3e-6  # damping that shortens no step
_ISOMETRIC = 1e-11  # strain that is rounding
_GAIN = 1e-12  # a step that lowers what is to be small by less, relative to it, is the last

SETTLED = 1e-5
"""Part of an edge: longer moves are gone on with."""


class Landing(NamedTuple):
    """Where points arrive on a surface.

    ``points`` (n, 3) on it, its unit ``normals`` (n, 3) there, the directions ``frames``
    (n, 3, 2) in which each may slide (0 for none), and the mask ``arrived`` (n,).
    """

    points: Floats
    normals: Floats
    frames: Floats
    arrived: Bools


Ground = Callable[[Floats], Landing]
"""The way from points near a surface onto it."""


def slide(
    base: Surface, start: Floats, ground: Ground, *, settled: float = SETTLED, exact: bool = True
) -> Floats:
    """Points slid on another surface until the map from the base is as isometric as can be.

    Minimizes the integral over the base of the strain's square, half there and half back,
    (E : E + E' : E') / 2 with C = F^T F / s^2, E = (C - 1) / 2 and E' = (1 - C^-1) / 2, F the
    gradient of the map and s^2 the ratio of the areas: a similarity strains nothing, small
    strains count as usual, and a triangle that collapses costs without bound (the Green strain
    E alone would let it, and wrinkle what shrinks below 0.7). Where points can slide almost
    freely (a sphere may turn) little would decide between maps but the mesh. So the integral is
    multiplied by 1 + 10 d^2, with d the root mean square of the ways the points have gone, over
    the root of the area, and this is done again from where it ends, in rounds (the proximal
    point method): what strain decides shrinks from round to round by a factor of 5 or more, and
    is taken to its end; where a round goes more than half as far as the one before it is the
    mesh that moves the points, and they stay.

    A round's steps are those of limited-memory BFGS around the damped Gauss-Newton matrix in the
    tangent planes of the other surface, each followed by the way back onto it; one that does not
    lower what is to be small, or turns a triangle over, is taken back, what was learned forgotten,
    and then the damping raised.

    Parameters
    ----------
    base : Surface
        With n nodes.
    start : array (n, 3)
        On the other surface, no triangle turned over.
    ground : callable
        The other surface.
    settled : float
        The last step is shorter than this part of an edge.
    exact : bool
        False where the other surface is a mesh, whose errors would decide what strain does not:
        one round, and the first short step is its last, though it was damped.

    Returns
    -------
    array (n, 3)

    Raises
    ------
    CorrespondenceError
        C05 if triangles are turned over at the start.

    Warns
    -----
    UserWarning
        C07 if a round has not settled after 100 steps. Not where the other surface is a mesh: on
        flat triangles the strain has kinks, at which no step is the last.

    Notes
    -----
    Cost: 5 steps where the surfaces are nearly isometric, 10 to 20 where lengths change by a few
    percent, 50 and more where points slide far, each with a sparse factorization of 2 n unknowns:
    0.15 s for 4 000 nodes.

    References
    ----------
    O. Sorkine and M. Alexa, *As-rigid-as-possible surface modeling*, SGP 2007, minimize the
    same to leading order by turns (local) and a fixed stiffness (global), in many more steps;
    R. T. Rockafellar, *Monotone operators and the proximal point algorithm*, SIAM J. Control Optim.
    14 (1976) 877-898. J. Nocedal and S. Wright, *Numerical Optimization*, 2006, algorithm 7.4
    (limited-memory BFGS) and section 10.3 (damping).
    """
    if distortion(base, start).strain < _ISOMETRIC:
        return start
    here = ground(start)
    check_facing(here.points, base.triangles, here.normals)
    aim = _aim(base, here.points)
    least = settled * edge_length(here.points, base.triangles)
    last, damping, little = np.inf, _FIRST_DAMPING, _LITTLE if exact else np.inf
    for _ in range(_ROUNDS if exact else 1):
        there, found = _descend(
            aim._replace(start=here.points), here, ground, least, damping, little
        )
        moved = float(np.linalg.norm(there.points - here.points, axis=1).max())
        if moved > _SHRINKS * last:
            break
        here, last, damping = there, moved, _LITTLE
        if not found or moved < _ROUND * least:
            break
    if exact and not found:
        warnings.warn(
            "the map of least strain has not settled: where the surface can slide almost freely "
            "the places of points are uncertain [C07]",
            stacklevel=2,
        )
    return here.points


def _descend(
    aim: _Aim, here: Landing, ground: Ground, least: float, damping: float, little: float
) -> tuple[Landing, bool]:
    """Steps down to the aim's minimum near here, and whether it was found.

    A step counts as the last one only if it was damped ``little``: others are short anyway.
    """
    energy, memory = aim.energy(here.points), Memory()
    gradient, matrix = aim.equations(here)
    for _ in range(_STEPS):
        if energy < _ISOMETRIC**2:
            return here, True
        way = memory.direction(gradient, _divider(matrix, here.frames, damping))
        promise = -float(np.vdot(gradient, way))
        if promise < _GAIN * energy:  # rounding
            if damping <= little:
                return here, True
            damping = little
            continue
        there = ground(here.points + way)
        lower = aim.energy(there.points)
        if lower > energy and memory.steps:  # too long: to the lowest point of a parabola
            part = promise / (2 * (promise + lower - energy))
            there = ground(here.points + max(part, _SHORTEST) * way)
            lower = aim.energy(there.points)
        if there.arrived.all() and lower < energy and _faces(there, aim.metric.triangles):
            step = there.points - here.points
            short = np.linalg.norm(step, axis=1).max() < least or energy - lower < _GAIN * energy
            before, here, energy = gradient, there, lower
            if short and damping <= little:
                return here, True
            gradient, matrix = aim.equations(here)
            memory, damping = memory.after(step, gradient - before), max(damping / 10, _DAMPING)
        elif memory.steps:
            memory = Memory()
        elif damping > _MOST_DAMPING:
            return here, True  # no way down: a kink of flat triangles
        else:
            damping *= 10
    return here, False


def tangent_frames(normals: Floats) -> Floats:
    """Two unit vectors at right angles to each normal and each other, (n, 3, 2)."""
    away = np.eye(3)[np.abs(normals).argmin(axis=1)]
    first = np.cross(normals, away)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    frames: Floats = np.stack([first, np.cross(normals, first)], axis=-1)
    return frames


def check_facing(points: Floats, triangles: Ints, normals: Floats) -> None:
    """Raise CorrespondenceError C05 if a triangle does not face along the normals (n, 3)."""
    turned = facing(points, triangles, normals) <= 0
    if turned.any():
        raise CorrespondenceError(
            "C05",
            f"triangles: expected all carried ones to face outward, got {turned.sum()} turned "
            f"over, first {np.flatnonzero(turned)[:5].tolist()}; the surfaces are too far apart "
            "for their features: go in smaller steps of the parameter, or compare with normal_rays",
        )


def facing(points: Floats, triangles: Ints, normals: Floats) -> Floats:
    """Least product (m,) of a triangle's own normal at its nodes and the nodes' normals."""
    jacobian = tangents(points, triangles, node_places(1 if triangles.shape[1] == 3 else 2))
    own = np.cross(jacobian[..., 0], jacobian[..., 1])
    least: Floats = np.einsum("mqd,mqd->mq", own, normals[triangles]).min(axis=1)
    return least


def _faces(landing: Landing, triangles: Ints) -> bool:
    return bool((facing(landing.points, triangles, landing.normals) > 0).all())


class _Aim(NamedTuple):
    """What is made small: the strain, times one and a bit more the farther points have gone.

    E (1 + c sum_i w_i d_i^2), with d_i the way of node i from its place in ``start`` (n, 3)
    and w_i (n,) its area over the surface's squared.
    """

    metric: Metric
    start: Floats
    weights: Floats

    def energy(self, points: Floats) -> float:
        return self.metric.energy(self.metric.tensor(points)) * self._more(points)

    def equations(self, here: Landing) -> tuple[Floats, csc_array]:
        """Gradient (n, 3) and the Gauss-Newton matrix (2n, 2n) for moves along the frames."""
        from scipy.sparse import diags_array

        strain, more = self.metric.energy(self.metric.tensor(here.points)), self._more(here.points)
        matrix, slope = self.metric.equations(here.points, here.frames)
        pull = 2 * _ANCHOR * strain * self.weights[:, None]
        moving = (here.frames != 0).any(axis=1)
        away = np.einsum("ndc,nd->nc", here.frames, here.points - self.start)
        slope = more * slope.reshape(-1, 2) + pull * away
        held = diags_array((pull * moving).ravel())
        return np.einsum("ndc,nc->nd", here.frames, slope), (more * matrix + held).tocsc()

    def _more(self, points: Floats) -> float:
        return 1 + _ANCHOR * float(self.weights @ ((points - self.start) ** 2).sum(axis=1))


def _aim(base: Surface, start: Floats) -> _Aim:
    areas = node_areas(start, base.triangles)
    landed = triangle_areas(start, base.triangles).sum()
    return _Aim(metric_of(base, float(np.sqrt(landed / base.area))), start, areas / landed**2)


def _divider(matrix: csc_array, frames: Floats, damping: float) -> Callable[[Floats], Floats]:
    """Moves (n, 3) along the frames that a damped Gauss-Newton step takes for gradients (n, 3)."""
    from scipy.sparse import diags_array
    from scipy.sparse.linalg import splu

    diagonal = matrix.diagonal()
    scale = float(diagonal.mean()) or 1.0
    held = diagonal <= 1e-12 * scale
    damped = matrix + diags_array(damping * diagonal + held * scale)
    factors = splu(
        damped.tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )

    def divided(gradient: Floats) -> Floats:
        slope = np.einsum("ndc,nd->nc", frames, gradient)
        move: Floats = np.einsum("ndc,nc->nd", frames, factors.solve(slope.ravel()).reshape(-1, 2))
        return move

    return divided
