"""Where a family of isosurfaces changes its topology: a critical point of the field tells."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from .errors import ArgumentError, FieldError
from .families import Family
from .geometry import Bools, Floats, Topology, topology
from .matching import match_components
from .meshing import contour
from .records import Surface
from .scalar_field import ScalarField

if TYPE_CHECKING:
    from .levels import Progress

JOINED = "components join or part"
HANDLE = "a handle opens or closes"
ISLAND = "a component appears or vanishes"
BOX = "the surface meets the box"

_HALVINGS = 10
_FLATTEST = 12  # points of each contour to start from
_MOST_STARTS = 300
_NEAR_BOX = 2.0  # cells
_ALIKE = 0.5
_AROUND = 2.0  # cells: where the contours differ because of a critical point
_NEWTON = 40
_ARRIVED = 1e-9  # cells
_LEVEL = 1e-7  # of a cell's bend: a slope that no curvature explains is not critical
_ASTRAY = 4.0  # cells from its seed: another point's business
_UNBENT = 1e-9  # of the largest curvature: none
_NOISE = 10.0  # rounding errors in a difference of samples
_ROUNDS = 3  # of the secant, before the interval is given up
_JUMP = 1e-6  # of the values at the ends
_NOTHING = Topology(0, 0, 0, 0)


@dataclass(frozen=True)
class TopologyChange:
    """Where a family of isosurfaces changes its topology; made by :func:`topology_change`.

    Parameters
    ----------
    parameter : float
        Where: if ``refined``, the isovalue is the field's value at a critical point;
        otherwise the middle of the bracket.
    bracket : (float, float)
        Neighbouring parameters between which the contours on the grid change their topology.
    place : (x, y, z)
        The critical point, on a face of the box if the surface meets the box there; length,
        NaN if not refined.
    before, after : Topology
        At the ends of the bracket; no component where there is no isosurface.
    kind : str
        ``components join or part``, ``a handle opens or closes``, ``a component appears or
        vanishes`` or ``the surface meets the box``.
    refined : bool
        Whether the critical point was found.
    """

    parameter: float
    bracket: tuple[float, float]
    place: tuple[float, float, float]
    before: Topology
    after: Topology
    kind: str
    refined: bool


@dataclass(frozen=True, eq=False)
class _State:
    """A member of the family with its contour, None where the field does not reach the level."""

    parameter: float
    field: ScalarField
    isovalue: float
    surface: Surface | None
    topology: Topology


@dataclass(frozen=True, eq=False)
class _Critical:
    """A critical point, of the field restricted to the faces of the box that hold it."""

    point: Floats
    held: Bools


@dataclass
class _Tracked:
    """The level set function at a critical point, followed from one parameter to the next."""

    family: Family
    critical: _Critical
    known: dict[float, tuple[_Critical, float]] = field(default_factory=dict)

    def level(self, parameter: float) -> float:
        """Value at the critical point; :class:`_LostError` if there is none near the last one."""
        if parameter not in self.known:
            scalar, isovalue = self.family(parameter)
            start = self.critical
            points, arrived = _to_critical(scalar, start.point[None], start.held[None])
            if not arrived[0]:
                raise _LostError
            self.critical = replace(start, point=points[0])
            level = float(scalar.level_set(points, isovalue)[0][0])
            self.known[parameter] = self.critical, level
        self.critical, value = self.known[parameter]
        return value


class _LostError(Exception):
    """A critical point could not be followed."""


def topology_change(
    family: Family,
    low: float,
    high: float,
    *,
    tolerance: float | None = None,
    progress: Progress | None = None,
) -> TopologyChange:
    """Parameter and place at which the isosurfaces of a family change their topology.

    An isosurface changes its topology where it passes a critical point of the field,
    grad F(x, s) = 0 and F(x, s) = v(s), or one of the field restricted to a face, an edge or a
    corner of the box. Contours are bisected until their topologies differ by one small step of
    the parameter s. As close to the event the grid decides them, the critical point is then
    found by Newton steps from where the two contours differ, followed along s, and
    F(x(s), s) - v(s) = 0 is solved by Brent's method. The solution must lie as near to the
    bracket as the grid can err: by the change of the field within a cell of the critical point.
    Where no such point is found between ``low`` and ``high`` the result is the bracket's middle,
    and says so.

    Parameters
    ----------
    family : callable
        Takes the parameter, gives the field and the isovalue; see :func:`blended` and
        :func:`sweep_family`.
    low, high : float
        Parameters where the topologies differ. Of several changes between, one is found;
        ``before`` is then the topology at ``low``.
    tolerance : float, optional
        Width of the bracket. By default 1/1024 of the range, which is enough to refine it.
    progress : callable, optional
        Called with the stage's name and the part of the work done.

    Returns
    -------
    TopologyChange

    Raises
    ------
    ArgumentError
        A02 if low and high are not in order, the tolerance is not positive, or both ends have
        the same topology.

    Notes
    -----
    Right to the spline's error in the field's value at the critical point, divided by the
    value's slope along the parameter. Features thinner than a cell are not seen. Cost: one
    contour for each halving, some ten more fields: 1 s for 64^3 if fields are at hand.

    References
    ----------
    J. Milnor, *Morse Theory*, Princeton University Press (1963), section 3.
    M. Goresky and R. MacPherson, *Stratified Morse Theory*, Springer (1988), part I,
    section 3 (the box).

    Examples
    --------
    A ball that shrinks until nothing is left, at its field's maximum:

    >>> ball = ScalarField.from_function(
    ...     lambda p: -(p**2).sum(axis=-1), bounds=((-1, -1, -1), (2, 2, 2)), shape=(9, 9, 9))
    >>> found = topology_change(lambda isovalue: (ball, isovalue), -0.9, 0.5)
    >>> found.kind, found.refined, round(found.parameter, 9) + 0.0
    ('a component appears or vanishes', True, 0.0)
    """
    if not (np.isfinite([low, high]).all() and low < high):
        raise ArgumentError("A02", f"low, high: expected finite and in order, got {low}, {high}")
    if tolerance is not None and not tolerance > 0:
        raise ArgumentError("A02", f"tolerance: expected positive, got {tolerance}")
    tell = progress or (lambda stage, done: None)
    tell("bisection", 0.0)
    first, last = _state(family, float(low)), _state(family, float(high))
    if first.topology == last.topology:
        raise ArgumentError(
            "A02",
            f"low, high: expected different topologies, got {first.topology} at {low:g} and "
            f"{last.topology} at {high:g}; choose a range in which it changes",
        )
    width = (high - low) / 2**_HALVINGS if tolerance is None else tolerance
    halvings = max(1, int(np.ceil(np.log2((high - low) / width))))
    for done in range(halvings):
        first, last = _halved(family, first, last)
        tell("bisection", 0.7 * (done + 1) / halvings)
    tell("critical point", 0.7)
    found = _refined(family, first, last, (float(low), float(high)))
    tell("done", 1.0)
    return found


def _state(family: Family, parameter: float) -> _State:
    scalar, isovalue = family(parameter)
    try:
        surface = contour(scalar, isovalue)
    except FieldError as error:
        if error.code != "I02":
            raise
        return _State(parameter, scalar, isovalue, None, _NOTHING)
    return _State(parameter, scalar, isovalue, surface, topology(surface.triangles))


def _halved(family: Family, first: _State, last: _State) -> tuple[_State, _State]:
    """The half of a bracket in which the topology of its first end changes."""
    middle = _state(family, (first.parameter + last.parameter) / 2)
    return (middle, last) if middle.topology == first.topology else (first, middle)


def _refined(
    family: Family, first: _State, last: _State, limits: tuple[float, float]
) -> TopologyChange:
    """The change in a bracket, at a critical point if there is one."""
    bracket = first.parameter, last.parameter
    middle = (bracket[0] + bracket[1]) / 2
    scalar, isovalue = family(middle)
    ready = {state.parameter: (state.field, state.isovalue) for state in (first, last)}
    for critical in _candidates(scalar, isovalue, first, last):
        tracked = _Tracked(lambda s: ready[s] if s in ready else family(s), critical)
        slack = _hidden(scalar, critical)
        try:
            parameter = _solved(tracked, bracket, limits, slack)
        except _LostError:
            continue
        if parameter is not None:
            point = tracked.critical.point
            place = (float(point[0]), float(point[1]), float(point[2]))
            kind = _kind(scalar, critical, first, last)
            return TopologyChange(
                parameter, bracket, place, first.topology, last.topology, kind, True
            )
    nowhere = (float("nan"),) * 3
    kind = _kind_without_point(first, last)
    return TopologyChange(middle, bracket, nowhere, first.topology, last.topology, kind, False)


def _candidates(
    scalar: ScalarField, isovalue: float, first: _State, last: _State
) -> list[_Critical]:
    """Critical points near the contours' difference, the likeliest first.

    The contours differ most where the topology changes. Points where they differ by less than
    half of that are left out, and those that would change the Euler characteristic the other
    way; that with the smallest level, in units of what the grid can hide, is first.
    """
    rims = first.topology.boundary_loops != last.topology.boundary_loops
    starts, held = _starts(scalar, _seeds(first, last), rims)
    points, arrived = _to_critical(scalar, starts, held)
    found: list[_Critical] = []
    for point, fixed in zip(points[arrived], held[arrived], strict=True):
        critical = _Critical(point, fixed)
        known = any(_equal(critical, other, scalar.spacing) for other in found)
        if not known and (rims or _right_way(scalar, critical, first, last)):
            found.append(critical)

    points, apart = _differences(first, last)

    def difference(critical: _Critical) -> float:
        near = (np.abs(points - critical.point) <= _AROUND * scalar.spacing).all(axis=1)
        return float(apart[near].max(initial=0.0))

    def level(critical: _Critical) -> float:
        level = float(scalar.level_set(critical.point[None], isovalue)[0][0])
        return abs(level) / _hidden(scalar, critical)

    differences = [difference(critical) for critical in found]
    least = _ALIKE * max(differences, default=0.0)
    likely = [c for c, size in zip(found, differences, strict=True) if size >= least]
    return sorted(likely, key=level)


def _differences(first: _State, last: _State) -> tuple[Floats, Floats]:
    """Points (k, 3) of both contours, and their distance (k,) to the other; infinite for none."""
    from scipy.spatial import cKDTree

    clouds = [np.empty((0, 3)) if s.surface is None else s.surface.points for s in (first, last)]
    ways = [
        cKDTree(there).query(here)[0] if len(there) else np.full(len(here), np.inf)
        for here, there in (clouds, clouds[::-1])
    ]
    return np.concatenate(clouds), np.concatenate(ways)


def _equal(first: _Critical, second: _Critical, spacing: Floats) -> bool:
    near = (np.abs(first.point - second.point) < 1e-6 * spacing).all()
    return bool(near and (first.held == second.held).all())


def _seeds(first: _State, last: _State) -> Floats:
    """Samples (k, 3) that change their side, and where the two contours are flattest."""
    pieces = []
    one, other = first.field, last.field
    if one.values.shape == other.values.shape:
        flipped = (one.values > first.isovalue) != (other.values > last.isovalue)
        pieces.append(one.origin + np.argwhere(flipped) * one.spacing)
    for state in (first, last):
        if state.surface is not None:
            points = state.surface.points
            slopes = np.linalg.norm(state.field.level_set(points, state.isovalue)[1], axis=1)
            pieces.append(points[np.argsort(slopes)[:_FLATTEST]])
    return np.concatenate(pieces)


def _starts(scalar: ScalarField, seeds: Floats, rims: bool) -> tuple[Floats, Bools]:
    """The seeds with the shortest Newton steps (k, 3), and which of their coordinates are held.

    For a change of the rims each seed is put on the faces, edges and corners of the box near it.
    """
    low, high = scalar.bounds
    closest = np.where(seeds - low < high - seeds, low, high)
    near = np.abs(seeds - closest) <= _NEAR_BOX * scalar.spacing
    starts, held = [], []
    for chosen in product((False, True), repeat=3):
        mask = np.array(chosen)
        wanted = near[:, mask].all(axis=1) & (rims == any(chosen))
        starts.append(np.where(mask, closest, seeds)[wanted])
        held.append(np.broadcast_to(mask, starts[-1].shape))
    points, fixed = np.concatenate(starts), np.concatenate(held)
    steps = _newton_steps(scalar, *_slopes(scalar, points), fixed) / scalar.spacing
    shortest = np.argsort(np.abs(steps).max(axis=1), kind="stable")[:_MOST_STARTS]
    return points[shortest], fixed[shortest]


def _slopes(scalar: ScalarField, points: Floats) -> tuple[Floats, Floats]:
    """Gradients (n, 3) and Hessians (n, 3, 3) of the level set function."""
    _, gradient = scalar.level_set(points, float(scalar.values.max()))
    hessian = scalar.hessian(points)
    if scalar.logarithmic:
        outer = gradient[:, :, None] * gradient[:, None, :]
        hessian = hessian / scalar.value(points)[:, None, None] - outer
    return gradient, hessian


def _to_critical(scalar: ScalarField, starts: Floats, held: Bools) -> tuple[Floats, Bools]:
    """Points moved to where the gradient's free part vanishes, and which of them arrived."""
    low, high = scalar.bounds
    cell = scalar.spacing
    points = starts.copy()
    arrived = np.zeros(len(points), dtype=bool)
    active = np.arange(len(points))
    for _ in range(_NEWTON):
        gradient, hessian = _slopes(scalar, points[active])
        steps = _newton_steps(scalar, gradient, hessian, held[active])
        length = np.abs(steps / cell).max(axis=1)
        left = np.abs(np.where(held[active], 0.0, gradient) * cell).max(axis=1)
        bend = np.abs(hessian * np.multiply.outer(cell, cell)).max(axis=(1, 2))
        level = left <= _LEVEL * bend + _NOISE * scalar.rounding
        steps /= np.maximum(length, 1.0)[:, None]
        moved = np.clip(points[active] + steps, low, high)
        moved = np.where(held[active], points[active], moved)
        free = (moved == points[active] + steps).all(axis=1)
        arrived[active] = (length < _ARRIVED) & free & level
        points[active] = moved
        astray = (np.abs(moved - starts[active]) > _ASTRAY * cell).any(axis=1)
        active = active[~arrived[active] & ~astray]
        if len(active) == 0:
            break
    return points, arrived


def _newton_steps(scalar: ScalarField, gradient: Floats, hessian: Floats, held: Bools) -> Floats:
    """Newton's steps (n, 3) to gradient zero; 0 along held axes and where nothing bends."""
    free = ~held
    both = free[:, :, None] & free[:, None, :]
    values, vectors = np.linalg.eigh(np.where(both, hessian, 0.0))
    size = np.abs(values)
    noise = _NOISE * scalar.rounding / scalar.spacing.min() ** 2
    least = np.maximum(_UNBENT * size.max(axis=1, keepdims=True), noise)
    inverse = np.where(size > least, 1.0, 0.0) / np.where(size > least, values, 1.0)
    along = (vectors * np.where(free, gradient, 0.0)[:, :, None]).sum(axis=1)
    steps: Floats = -(vectors * (inverse * along)[:, None, :]).sum(axis=2)
    return np.where(free, steps, 0.0)


def _hidden(scalar: ScalarField, critical: _Critical) -> float:
    """Change of the level set function within a cell of a critical point."""
    curvature = np.abs(np.diagonal(_slopes(scalar, critical.point[None])[1][0]))
    free = ~critical.held
    return float(curvature[free] @ scalar.spacing[free] ** 2 / 2 + scalar.rounding)


def _solved(
    tracked: _Tracked, bracket: tuple[float, float], limits: tuple[float, float], slack: float
) -> float | None:
    """Parameter near the bracket at which the tracked level is 0; None if it is not near."""
    from scipy.optimize import brentq

    a, b = bracket
    values = tracked.level(a), tracked.level(b)
    slope = (values[1] - values[0]) / (b - a)
    if slope == 0:
        return None
    reach = (b - a) + slack / abs(slope)
    least, most = max(limits[0], a - reach), min(limits[1], b + reach)
    for _ in range(_ROUNDS):
        if values[0] * values[1] <= 0:
            root = float(brentq(tracked.level, a, b, xtol=1e-13 * max(abs(a), abs(b), b - a)))
            jump = abs(tracked.level(root)) > _JUMP * (abs(values[0]) + abs(values[1]))
            return None if jump else root
        a, b = _widened(a, b, values, (least, most))
        values = tracked.level(a), tracked.level(b)
    return None


def _widened(
    a: float, b: float, values: tuple[float, float], limits: tuple[float, float]
) -> tuple[float, float]:
    """The interval with the end nearer to the secant's root moved twice as far as the root."""
    root = a - values[0] * (b - a) / (values[1] - values[0]) if values[1] != values[0] else a
    if root < a:
        return max(limits[0], a - 2 * (a - root)), b
    return a, min(limits[1], b + 2 * (root - b))


def _negative(scalar: ScalarField, critical: _Critical) -> int:
    """Number of directions in which the field falls from a free critical point."""
    return int((np.linalg.eigvalsh(_slopes(scalar, critical.point[None])[1][0]) < 0).sum())


def _right_way(scalar: ScalarField, critical: _Critical, first: _State, last: _State) -> bool:
    """Whether passing a free critical point changes the Euler characteristic as observed.

    When the level at it rises through 0, a maximum (three directions down) adds a sphere, +2,
    a saddle with two joins, -2, one with one closes a tunnel, +2, a minimum fills a pocket, -2.
    Several at once may leave the characteristic as it was: then either way is right.
    """
    level, later = (
        float(state.field.level_set(critical.point[None], state.isovalue)[0][0])
        for state in (first, last)
    )
    sign = 1 if _negative(scalar, critical) % 2 == 1 else -1
    change = last.topology.euler - first.topology.euler
    return change == 0 or bool(sign * (later - level) * change > 0)


def _kind(scalar: ScalarField, critical: _Critical, first: _State, last: _State) -> str:
    """Name of the change by the type of its critical point."""
    if critical.held.any():
        return BOX
    if _negative(scalar, critical) in (0, 3):
        return ISLAND
    return HANDLE if first.topology.components == last.topology.components else JOINED


def _kind_without_point(first: _State, last: _State) -> str:
    """Name of the change by what the two contours differ in."""
    if first.topology.boundary_loops != last.topology.boundary_loops:
        return BOX
    if first.topology.components == last.topology.components:
        return HANDLE
    if first.surface is None or last.surface is None:
        return ISLAND
    events = {match.event for match in match_components(first.surface, last.surface)}
    return ISLAND if events & {"lost", "born"} else JOINED
