"""Repelling particles: their energy, and the descent to where it rests."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ..geometry import Bools, Floats, Ints, node_components
from ..scalar_field import ScalarField
from ._draft import Draft, moved, tangential
from ._edits import edges_with_sides
from ._moves import summed
from ._triangulation import refined

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

# All lengths are parts of the wanted edge length.
_REACH = float(np.sqrt(3))  # of the energy: hexagonal packing's second ring is just out of it
FINE = 0.3  # longest edge of the fine mesh: some 30 fine vertices a particle
_LONGEST = 0.3  # step
_STIFFNESS = 4.5  # of the hexagonal packing: second derivative of the energy
_BLEND = 8  # fine vertices that tell the wanted length at a place
_WIDTH = 18  # neighbours looked up at first
_MEMORY, _HALVINGS = 6, 8  # steps that the descent remembers; shorter steps that it tries
STEPS, _WINDOW, _REST = 60, 10, 1e-4  # the energy rests if it falls by so little in a window


@dataclass(frozen=True, eq=False)
class Rim:
    """Middles of the fine rim edges, unit vectors along them, the surface's normals there."""

    edges: Ints
    points: Floats
    along: Floats
    normals: Floats
    tree: cKDTree

    def ways(self, draft: Draft, longest: Floats) -> tuple[Ints, Floats]:
        """Particles inside that are nearer to a rim of their sheet, and the ways (k, 3) from it."""
        distance, near = self.tree.query(draft.points)
        there = np.flatnonzero((draft.rank == 0) & (distance < longest))
        near = near[there]
        way, along = draft.points[there] - self.points[near], self.along[near]
        way = way - (way * along).sum(axis=1, keepdims=True) * along
        same = (draft.normals[there] * self.normals[near]).sum(axis=1) > 0
        return there[same], way[same]


@dataclass(frozen=True, eq=False)
class Ground:
    """The isosurface under the particles: a fine mesh with the wanted lengths at its vertices.

    ``slopes`` (n, 3) are the lengths' gradients, ``areas`` (n,) what belongs to each vertex,
    ``parts`` (n,) the numbers of the components.
    """

    draft: Draft
    lengths: Floats
    slopes: Floats
    areas: Floats
    parts: Ints
    tree: cKDTree
    rim: Rim | None

    def sizes(self, points: Floats) -> tuple[Floats, Floats]:
        """Wanted lengths (m,) and their gradients (m, 3).

        The mean of what the nearest vertices' values and slopes tell, with weights
        ``(1 - d^2 / R^2)^2`` that vanish at the distance R of the last: smooth when that changes.
        """
        distance, near = self.tree.query(points, _BLEND)
        bar, slopes = points[:, None] - self.draft.points[near], self.slopes[near]
        told = self.lengths[near] + np.einsum("nkd,nkd->nk", bar, slopes)
        inner = 1 - (distance / distance[:, -1:]) ** 2
        weight = inner**2 + np.finfo(float).eps
        weight /= weight.sum(axis=1, keepdims=True)
        lengths = np.einsum("nk,nk->n", weight, told)
        change = 4 * inner / (inner**2).sum(axis=1, keepdims=True) / distance[:, -1:] ** 2
        change *= told - lengths[:, None]  # of the mean, as the weights and R change
        gradient = np.einsum("nk,nkd->nd", weight, slopes) - np.einsum("nk,nkd->nd", change, bar)
        gradient += (change * (1 - inner)).sum(axis=1, keepdims=True) * bar[:, -1]
        return np.maximum(lengths, self.lengths[near[:, 0]] / 2), gradient


@dataclass(frozen=True, eq=False)
class Cloud:
    """Particles: a draft without triangles, and the component (n,) that each is on."""

    draft: Draft
    parts: Ints

    def __getitem__(self, chosen: Ints | Bools) -> Cloud:
        held, normals = self.draft.held[chosen], self.draft.normals[chosen]
        draft = Draft(self.draft.points[chosen], self.draft.triangles, held, normals)
        return Cloud(draft, self.parts[chosen])


@dataclass(frozen=True, eq=False)
class State:
    """Particles with the energy of each (n,) and the total's gradient (n, 3) in the surface."""

    cloud: Cloud
    lengths: Floats
    energies: Floats
    gradient: Floats

    @property
    def energy(self) -> float:
        """Of all pairs; each counts at both its ends."""
        return float(self.energies.sum() / 2)


_Memory = list[tuple[Floats, Floats]]
"""The last steps (n, 3), and the changes of the gradient."""


def ground_of(
    draft: Draft, lengths: Floats, most: int, field: ScalarField, isovalue: float
) -> Ground:
    """The fine mesh under the particles, from any mesh and the lengths wanted at its vertices.

    Of ``most`` vertices at most.
    """
    from scipy.spatial import cKDTree

    fine, lengths = refined(draft, lengths, FINE, most, field, isovalue)
    slopes, areas = _slopes(fine.points, fine.triangles, lengths)
    parts = node_components(fine.triangles)
    return Ground(fine, lengths, slopes, areas, parts, cKDTree(fine.points), _rim(fine))


def _rim(fine: Draft) -> Rim | None:
    from scipy.spatial import cKDTree

    edges = edges_with_sides(fine.triangles)
    if not edges.on_rim.any():
        return None
    ends, forward = edges.ends[edges.on_rim], edges.forward[edges.on_rim, None]
    ends = np.where(forward, ends, ends[:, ::-1])
    first, last = fine.points[ends].transpose(1, 0, 2)
    along = (last - first) / np.linalg.norm(last - first, axis=1, keepdims=True)
    middle = (first + last) / 2
    return Rim(ends, middle, along, fine.normals[ends[:, 0]], cKDTree(middle))


def _slopes(points: Floats, triangles: Ints, lengths: Floats) -> tuple[Floats, Floats]:
    """Gradients (n, 3) of a function linear in each triangle, averaged by area; the areas (n,)."""
    corners, count = points[triangles], len(points)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    twice = np.maximum(np.linalg.norm(normal, axis=1), np.finfo(float).tiny)
    opposite = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)
    across = np.cross((normal / twice[:, None])[:, None], opposite)
    total = np.einsum("nk,nkd->nd", lengths[triangles], across)  # gradient times twice the area
    area = np.bincount(triangles.ravel(), np.repeat(twice, 3), count)
    sums = summed(triangles.ravel(), np.repeat(total, 3, axis=0), count)
    return sums / area[:, None], area / 6


def kernel(s: Floats) -> tuple[Floats, Floats]:
    """Energy of a pair at the distance s, of the reach, and its derivative: zero from 1 on."""
    angle = np.clip(s, 1e-6, 1.0) * (np.pi / 2)
    tangent = np.tan(angle)
    return 1 / tangent + angle - np.pi / 2, -np.pi / 2 / tangent**2


IDEAL_ENERGY = 6 * float(kernel(np.array(1 / _REACH))[0])  # of a particle in the hexagonal packing


def _near(points: Floats, radius: Floats) -> Ints:
    """Pairs (2, k) of points, the smaller number first, nearer than the greater ``radius``."""
    from scipy.spatial import cKDTree

    tree, count = cKDTree(points), len(points)
    left, width, found = np.arange(count), min(_WIDTH, count), [np.empty((2, 0), dtype=np.int64)]
    while len(left):
        distance, near = tree.query(points[left], [*range(1, width + 1)])
        inside = distance < radius[left, None]
        full = inside.all(axis=1) & (width < count)
        rows, columns = np.nonzero(inside & ~full[:, None])
        i, j = left[rows], near[rows, columns]
        mine = (radius[i] > radius[j]) | ((radius[i] == radius[j]) & (i < j))
        found.append(np.stack([i[mine], j[mine]]))
        left, width = left[full], min(2 * width, count)
    pairs: Ints = np.sort(np.concatenate(found, axis=1), axis=0)
    return pairs


def _close(cloud: Cloud, radius: Floats) -> tuple[Ints, Ints]:
    """Pairs i < j of particles on one sheet that are nearer than the mean of their radii."""
    points, normals = cloud.draft.points, cloud.draft.normals
    i, j = _near(points, radius)
    bar = points[i] - points[j]
    close = np.einsum("nd,nd->n", bar, bar) < ((radius[i] + radius[j]) / 2) ** 2
    close &= np.einsum("nd,nd->n", normals[i], normals[j]) > 0
    close &= cloud.parts[i] == cloud.parts[j]
    return i[close], j[close]


def first_apart(cloud: Cloud, radius: Floats, fixed: int = 0) -> Bools:
    """Mask of the particles that no earlier chosen one is nearer to than the mean radius.

    The first ``fixed`` are chosen in any case.
    """
    i, j = _close(cloud, radius)
    i, j = i[j >= fixed], j[j >= fixed]
    alive, chosen = (np.full(len(radius), value) for value in (True, False))
    while alive.any():
        first = alive.copy()
        first[j] = False
        chosen |= first
        alive &= ~first
        alive[j[first[i]]] = False
        left = alive[i] & alive[j]
        i, j = i[left], j[left]
    return chosen


def state_of(cloud: Cloud, ground: Ground) -> State:
    """The energies and the gradient; the latter knows how the lengths change with the place."""
    points, count = cloud.draft.points, len(cloud.parts)
    lengths, slopes = ground.sizes(points)
    i, j = _close(cloud, _REACH * lengths)
    bar, reach = points[i] - points[j], _REACH * (lengths[i] + lengths[j]) / 2
    way = np.maximum(np.linalg.norm(bar, axis=1), np.finfo(float).tiny)
    value, slope = kernel(way / reach)
    push = (slope / (reach * way))[:, None] * bar
    by_length = -slope * way / reach**2 * (_REACH / 2)
    energies = _at_ends(i, j, value, count)
    gradient = (summed(i, push, count) - summed(j, push, count)).astype(np.float64)
    change = _at_ends(i, j, by_length, count)
    if ground.rim:
        near, bar = ground.rim.ways(cloud.draft, _REACH * lengths / 2)
        reach = _REACH * lengths[near]
        way = np.maximum(np.linalg.norm(bar, axis=1), np.finfo(float).tiny)
        value, slope = kernel(2 * way / reach)
        energies[near] += value
        gradient[near] += (slope / (reach * way))[:, None] * bar
        change[near] -= slope * way / reach**2 * _REACH
    gradient = tangential(cloud.draft, gradient + change[:, None] * slopes)
    return State(cloud, lengths, energies, gradient)


def _at_ends(i: Ints, j: Ints, values: Floats, count: int) -> Floats:
    """Sum (count,) of the pairs' values at each particle."""
    return (np.bincount(i, values, count) + np.bincount(j, values, count)).astype(np.float64)


def relaxed(
    state: State,
    ground: Ground,
    field: ScalarField,
    isovalue: float,
    steps: int,
    tell: Callable[[float], None] | None = None,
) -> tuple[State, list[float]]:
    """The particles nearly at rest, and the energy before and after each step: it never rises.

    ``tell`` is called with the part of the steps done.
    """
    memory: _Memory = []
    history = [state.energy]
    for count in range(steps):
        if tell:
            tell(count / steps)
        new = _lower(state, _direction(state, memory), ground, field, isovalue)
        if new is None and not memory:
            break
        if new is None:
            memory = []
            continue
        way = new.cloud.draft.points - state.cloud.draft.points
        change = new.gradient - state.gradient
        if (way * change).sum() > 0:
            memory = [*memory, (way, change)][-_MEMORY:]
        state = new
        history.append(state.energy)
        if len(history) > _WINDOW and history[-_WINDOW - 1] - history[-1] < _REST * history[-1]:
            break
    return state, history


def _direction(state: State, memory: _Memory) -> Floats:
    """Minus the gradient times the inverse Hessian, as limited-memory BFGS guesses it.

    Without a memory: times the squared lengths over the hexagonal packing's stiffness.
    """
    step, weights = state.gradient.copy(), []
    for way, change in reversed(memory):
        weights.append((way * step).sum() / (way * change).sum())
        step -= weights[-1] * change
    scale, factor = state.lengths[:, None] ** 2, 1 / _STIFFNESS
    if memory:
        way, change = memory[-1]
        factor = (way * change).sum() / (scale * change**2).sum()
    step *= scale * factor
    for (way, change), weight in zip(memory, reversed(weights), strict=True):
        step += (weight - (change * step).sum() / (way * change).sum()) * way
    step = tangential(state.cloud.draft, -step)
    length, longest = np.linalg.norm(step, axis=1), _LONGEST * state.lengths
    shorter: Floats = step * (longest / np.maximum(length, longest))[:, None]
    return shorter


def _lower(
    state: State, step: Floats, ground: Ground, field: ScalarField, isovalue: float
) -> State | None:
    """The particles after the step, or a half of it, ..., as soon as that lowers the energy."""
    slope = float((step * state.gradient).sum())
    old = state.cloud.draft
    for part in 0.5 ** np.arange(_HALVINGS if slope < 0 else 0):
        draft = moved(old, part * step, field, isovalue)
        lost = (draft.normals * old.normals).sum(axis=1, keepdims=True) <= 0  # to another sheet
        points = np.where(lost, old.points, draft.points)
        normals = np.where(lost, old.normals, draft.normals)
        draft = replace(draft, points=points, normals=normals)
        new = state_of(replace(state.cloud, draft=draft), ground)
        if new.energy <= state.energy + 1e-4 * part * slope:
            return new
    return None
