"""Where a family of isosurfaces changes its topology: a critical point of the field tells."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from .errors import ArgumentError, FieldError
from .geometry import Bools, Floats, Topology, topology
from .matching import match_components
from .meshing import contour
from .records import Surface
from .scalar_field import ScalarField

if TYPE_CHECKING:
    from .levels import Progress

Family = Callable[[float], tuple[ScalarField, float]]
"""Parameter -> field and isovalue."""

JOINED = "components join or part"
HANDLE = "a handle opens or closes"
ISLAND = "a component appears or vanishes"
BOX = "the surface meets the box"

_HALVINGS = 10
_SEEDS = 12  # of each kind, on each surface
_NEWTON = 40
_ARRIVED = 1e-9  # cells
_ASTRAY = 4.0  # cells from its seed: another point's business
_ROUNDS = 3  # of the secant, before the interval is given up
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
    known: dict[float, float] = field(default_factory=dict)

    def level(self, parameter: float) -> float:
        """Value at the critical point; :class:`_LostError` if there is none near the last one."""
        if parameter not in self.known:
            scalar, isovalue = self.family(parameter)
            start = self.critical
            points, arrived = _to_critical(scalar, start.point[None], start.held[None])
            if not arrived[0]:
                raise _LostError
            self.critical = replace(start, point=points[0])
            self.known[parameter] = float(scalar.level_set(points, isovalue)[0][0])
        return self.known[parameter]


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
    Where no such point is found the result is the bracket's middle, and says so.

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
    first, last = _state(family, low), _state(family, high)
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
    found = _refined(family, first, last, (low, high))
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
    for critical in _candidates(scalar, isovalue, first, last):
        tracked = _Tracked(family, critical)
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

    The level at the point, in units of what the grid can hide, decides, but points that would
    change the Euler characteristic the other way come last.
    """
    low, high = scalar.bounds
    seeds = _seeds(first, last)
    rims = first.topology.boundary_loops != last.topology.boundary_loops
    starts = list(_starts(seeds, low, high, 2 * scalar.spacing) if rims else _free(seeds))
    if not starts:
        return []
    points, arrived = _to_critical(
        scalar, np.array([s.point for s in starts]), np.array([s.held for s in starts])
    )
    found: list[_Critical] = []
    for start, point, good in zip(starts, points, arrived, strict=True):
        critical = replace(start, point=point)
        if good and not any(_equal(critical, other, scalar.spacing) for other in found):
            found.append(critical)
    order = []
    for critical in found:
        level = abs(float(scalar.level_set(critical.point[None], isovalue)[0][0]))
        wrong = not rims and not _right_way(scalar, critical, first, last)
        order.append((wrong, level / _hidden(scalar, critical)))
    return [found[i] for i in sorted(range(len(found)), key=order.__getitem__)]


def _free(seeds: Floats) -> Iterator[_Critical]:
    for seed in seeds:
        yield _Critical(seed, np.zeros(3, dtype=bool))


def _starts(seeds: Floats, low: Floats, high: Floats, near: Floats) -> Iterator[_Critical]:
    """Each seed on the faces, edges and corners of the box that are near it."""
    for seed in seeds:
        closest = np.where(seed - low < high - seed, low, high)
        axes = np.flatnonzero(np.abs(seed - closest) <= near)
        for count in range(1, len(axes) + 1):
            for chosen in combinations(axes.tolist(), count):
                held = np.isin(np.arange(3), chosen)
                yield _Critical(np.where(held, closest, seed), held)


def _equal(first: _Critical, second: _Critical, spacing: Floats) -> bool:
    near = (np.abs(first.point - second.point) < 1e-6 * spacing).all()
    return bool(near and (first.held == second.held).all())


def _seeds(first: _State, last: _State) -> Floats:
    """Points (k, 3) of two contours that lie farthest from the other, or where it is flattest."""
    pieces = []
    for here, there in ((first, last), (last, first)):
        if here.surface is None:
            continue
        points = here.surface.points
        _, gradient = here.field.level_set(points, here.isovalue)
        flattest = np.argsort((gradient**2).sum(axis=1))[:_SEEDS]
        pieces.append(points[flattest])
        pieces.append(_farthest(points, there.surface, here.field.spacing))
    return np.concatenate(pieces)


def _farthest(points: Floats, other: Surface | None, spacing: Floats) -> Floats:
    """Points (k, 3) farthest from another surface, no two within the same cell."""
    from scipy.spatial import cKDTree

    if other is None:
        distance = np.zeros(len(points))
    else:
        distance = cKDTree(other.points).query(points)[0]
    order = np.argsort(-distance, kind="stable")
    cells = np.floor(points[order] / spacing).astype(np.int64)
    _, single = np.unique(cells, axis=0, return_index=True)
    farthest: Floats = points[order[np.sort(single)[:_SEEDS]]]
    return farthest


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
        steps = _newton_steps(*_slopes(scalar, points[active]), held[active])
        length = np.abs(steps / cell).max(axis=1)
        steps /= np.maximum(length, 1.0)[:, None]
        moved = np.clip(points[active] + steps, low, high)
        moved = np.where(held[active], points[active], moved)
        arrived[active] = (length < _ARRIVED) & (moved == points[active] + steps).all(axis=1)
        points[active] = moved
        astray = (np.abs(moved - starts[active]) > _ASTRAY * cell).any(axis=1)
        active = active[~arrived[active] & ~astray]
        if len(active) == 0:
            break
    return points, arrived


def _newton_steps(gradient: Floats, hessian: Floats, held: Bools) -> Floats:
    """Newton's steps (n, 3) to gradient zero; 0 along held axes."""
    free = ~held
    both = free[:, :, None] & free[:, None, :]
    values, vectors = np.linalg.eigh(np.where(both, hessian, 0.0))
    size = np.abs(values)
    least = np.maximum(1e-9 * size.max(axis=1, keepdims=True), np.finfo(float).tiny)
    inverse = np.where(size > least, 1.0, 0.0) / np.where(size > least, values, 1.0)
    along = (vectors * np.where(free, gradient, 0.0)[:, :, None]).sum(axis=1)
    steps: Floats = -(vectors * (inverse * along)[:, None, :]).sum(axis=2)
    return np.where(free, steps, 0.0)


def _hidden(scalar: ScalarField, critical: _Critical) -> float:
    """Change of the level set function within a cell of a critical point."""
    gradient, hessian = _slopes(scalar, critical.point[None])
    linear = np.where(critical.held, 0.0, np.abs(gradient[0])) @ scalar.spacing
    curved = np.abs(np.diagonal(hessian[0])) @ scalar.spacing**2 / 2
    return float(linear + curved + scalar.rounding)


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
            root = float(brentq(tracked.level, a, b, xtol=1e-14 * max(abs(a), abs(b), b - a)))
            tracked.level(root)
            return root
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
    """
    level, later = (
        float(state.field.level_set(critical.point[None], state.isovalue)[0][0])
        for state in (first, last)
    )
    sign = 1 if _negative(scalar, critical) % 2 == 1 else -1
    return bool(sign * (later - level) * (last.topology.euler - first.topology.euler) > 0)


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


def blended(first: ScalarField, second: ScalarField) -> Callable[[float], ScalarField]:
    """Two fields on one grid, mixed: 0 is the first, 1 the second.

    F_t = (1 - t) F_0 + t F_1, or log F_t = (1 - t) log F_0 + t log F_1 for two logarithmic
    fields: linear in what the spline interpolates.

    Parameters
    ----------
    first, second : ScalarField
        Samples at the same places, both logarithmic or neither.

    Returns
    -------
    callable
        Takes the part t of the second, 0 to 1, and gives the field; ArgumentError A02 beyond.

    Raises
    ------
    ArgumentError
        A03 for different grids or kinds of interpolation.

    Examples
    --------
    >>> def ramp(slope):
    ...     return ScalarField.from_function(
    ...         lambda p: slope * p[..., 0], bounds=((0, 0, 0), (3, 3, 3)), shape=(4, 4, 4))
    >>> round(float(blended(ramp(1.0), ramp(3.0))(0.25).value([2, 1, 1])), 9)
    3.0
    """
    _check_alike(first, second)

    def mixed(part: float) -> ScalarField:
        if not 0 <= part <= 1:
            raise ArgumentError("A02", f"part: expected a number in [0, 1], got {part}")
        if part in (0, 1):
            return second if part else first
        ends = first.values, second.values
        if first.logarithmic:
            values = np.exp((1 - part) * np.log(ends[0]) + part * np.log(ends[1]))
        else:
            values = (1 - part) * ends[0] + part * ends[1]
        return replace(first, values=values)

    return mixed


def _check_alike(first: ScalarField, second: ScalarField) -> None:
    same = first.values.shape == second.values.shape and all(
        np.allclose(a, b, rtol=0, atol=1e-6 * first.spacing.min())
        for a, b in zip(first.bounds, second.bounds, strict=True)
    )
    if not same:
        raise ArgumentError(
            "A03",
            f"first, second: expected samples at the same places, got {first.values.shape} from "
            f"{first.bounds[0]} to {first.bounds[1]} and {second.values.shape} from "
            f"{second.bounds[0]} to {second.bounds[1]}; sample both on one grid",
        )
    if first.logarithmic != second.logarithmic:
        raise ArgumentError(
            "A03",
            "first, second: expected both logarithmic or neither, got "
            f"{first.logarithmic} and {second.logarithmic}; make them alike",
        )


def sweep_family(parameters: ArrayLike, fields: Sequence[ScalarField], isovalue: float) -> Family:
    """The members of a sweep as a family, blended between neighbours.

    Parameters
    ----------
    parameters : array (k,)
        Of the members, ascending.
    fields : sequence of ScalarField
        On one grid; see :func:`blended`.
    isovalue : float

    Returns
    -------
    callable
        Takes a parameter in the range of the members and gives the field, which at a member's
        parameter is the member, and the isovalue; ArgumentError A02 beyond.

    Raises
    ------
    ArgumentError
        A02 for parameters that do not ascend, A03 for less than two, for another number of
        fields and for fields that are not alike.

    Notes
    -----
    Between members the family is an interpolation, second-order accurate in their distance.

    Examples
    --------
    >>> ramps = [ScalarField.from_function(
    ...     lambda p, a=a: a * p[..., 0], bounds=((0, 0, 0), (3, 3, 3)), shape=(4, 4, 4))
    ...     for a in (1.0, 2.0, 4.0)]
    >>> family = sweep_family([10, 20, 30], ramps, 0.5)
    >>> scalar, isovalue = family(25)
    >>> round(float(scalar.value([1, 1, 1])), 9), isovalue
    (3.0, 0.5)
    """
    places = np.asarray(parameters, dtype=float)
    if places.ndim != 1 or len(places) < 2 or len(places) != len(fields):
        raise ArgumentError(
            "A03",
            "parameters, fields: expected as many parameters as fields, at least two, got "
            f"{places.shape} and {len(fields)}",
        )
    if not (np.diff(places) > 0).all():
        raise ArgumentError("A02", f"parameters: expected ascending, got {places.tolist()}")
    pieces = [blended(a, b) for a, b in zip(fields[:-1], fields[1:], strict=True)]

    def family(parameter: float) -> tuple[ScalarField, float]:
        if not places[0] <= parameter <= places[-1]:
            raise ArgumentError(
                "A02",
                f"parameter: expected within [{places[0]:g}, {places[-1]:g}], got {parameter}",
            )
        k = min(int(np.searchsorted(places, parameter, side="right")) - 1, len(pieces) - 1)
        return pieces[k](float((parameter - places[k]) / (places[k + 1] - places[k]))), isovalue

    return family
