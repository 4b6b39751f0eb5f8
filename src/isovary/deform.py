"""The dimple maker: surfaces pushed in or drawn out, with every correspondence known.

The nodes are particles and a charged projectile flies at them; they do not act on one
another, so where a node goes does not depend on the mesh around it.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .dimple_checks import (
    as_point,
    check_finite,
    check_positive,
    check_surface,
    doubts,
    one_each,
    warn_of_crossings,
)
from .errors import ArgumentError, MeshError
from .geometry import (
    EDGES,
    Bools,
    Floats,
    Ints,
    edges_of,
    jacobian_ratios,
    linear_triangles,
    node_places,
    tangents,
)
from .records import Surface

_FIRST, _LAST = 1.0, 0.5  # distances of a dimple's projectile from the centre, in radii
_HALVINGS = 4


@dataclass(frozen=True, eq=False)
class Region:
    """The particles that a projectile acts on: the part of a surface around a point.

    What lies within the radius and hangs together with the node nearest to the centre; the
    other side of a thin body stays where it is.

    Parameters
    ----------
    center : array (3,)
        A point on the surface, or near it; length.
    radius : float
        Nothing moves at this distance from the centre, or farther, in a straight line; length.
    decay : float
        Width sigma of the force's decay, in radii.
    charge : float
        Charge q_i of each particle.

    Raises
    ------
    ArgumentError
        A03 for a centre that is no point, A02 for numbers that are not finite, or a radius or
        decay that is not positive.
    """

    center: Floats
    radius: float
    decay: float = 0.35
    charge: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", as_point("center", self.center))
        check_positive("radius", self.radius)
        check_positive("decay", self.decay)
        check_finite("charge", self.charge)


@dataclass(frozen=True, eq=False)
class Projectile:
    """A charge that flies straight from one point to another at constant speed.

    Parameters
    ----------
    start, end : array (3,)
        Where it flies from and to; length.
    charge : float
        Its charge q_p: with the sign of the particles' it repels them, else it attracts.
    steps : int
        Number of time steps.
    dt : float
        Duration of each; time, in the unit that ``alpha`` has in :func:`shoot`.

    Raises
    ------
    ArgumentError
        A03 for a start or an end that is no point, A02 for numbers that are not finite, a
        ``dt`` that is not positive, or less than one step.
    """

    start: Floats
    end: Floats
    charge: float = 1.0
    steps: int = 20
    dt: float = 0.01

    def __post_init__(self) -> None:
        object.__setattr__(self, "start", as_point("start", self.start))
        object.__setattr__(self, "end", as_point("end", self.end))
        check_finite("charge", self.charge)
        check_positive("dt", self.dt)
        if not (self.steps >= 1 and self.steps % 1 == 0):
            raise ArgumentError("A02", f"steps: expected a whole number from 1, got {self.steps}")
        object.__setattr__(self, "steps", int(self.steps))


def dimple(
    surface: Surface,
    center: ArrayLike,
    radius: ArrayLike,
    *,
    alpha: ArrayLike = 5.0,
    charge: float = 1.0,
    decay: float = 0.35,
    steps: int = 20,
) -> Surface:
    """The surface with one or several dimples, pushed in or drawn out.

    At each centre a projectile flies along the outward normal, from one radius above the surface
    to half a radius; see :func:`shoot` for the force. Dimples of equal ``alpha`` are similar: on a
    surface that was flat there the depth is, for every radius,

    ===== ===== ===== ===== ===== ===== ===== =====
    alpha 1     3     5     9     -1    -3    -5
    depth 0.030 0.088 0.143 0.246 0.031 0.098 0.171 radii
    ===== ===== ===== ===== ===== ===== ===== =====

    and nodes at 0.24 radii from the centre move half as far. From alpha = -11.5 on, the tip meets
    the projectile.

    Parameters
    ----------
    surface : Surface
        Open or closed, of order 1 or 2; nodes on a rim move as others do.
    center : array (3,) or (k, 3)
        Points on the surface, or near it; length.
    radius : float or array (k,)
        Distance from the centre beyond which nothing moves, several edges of the mesh; length.
    alpha : float or array (k,)
        Strength: positive pushes in, negative draws out. The thesis's 100 to 900 correspond to
        1 to 9.
    charge : float
        Of the projectile; that of the particles is 1.
    decay : float
        Of the force, in radii, as of a :class:`Region`.
    steps : int
        How long the force acts, in time steps of 0.01: the depth grows nearly with its square, so
        20 are no more exact than 10, but almost four times deeper.

    Returns
    -------
    Surface
        With the same triangles: nodes correspond by their numbers.

    Raises
    ------
    ArgumentError
        A03 for wrong shapes, or what is no Surface; A02 for numbers that are not finite, a radius
        that is not positive, or a centre with no node within the radius.
    MeshError
        M03 if triangles are turned over, even in small time steps.

    Warns
    -----
    UserWarning
        M03 if the time steps had to be made smaller, so that no triangle is turned over; M08 if
        the surface runs through itself now, where it did not before; M11 for a dimple that is
        probably not what was meant: its centre off the surface by so much that a tenth of the
        force is lost, fewer than 20 nodes moved, all of them, none at all, or farther than the
        radius.

    Notes
    -----
    Several dimples are made one after the other, each on the surface that the one before it
    left; where their regions have nothing in common the order does not matter. A dimple in a
    dimple takes a second call, with the tip's new place as its centre.

    Cost: 20 steps for the nodes in the region; 0.2 s for 10 000 nodes, a quarter of them in it,
    a third of that to see whether the surface runs through itself.

    References
    ----------
    Thesis, section 5.1, figures 5.1 to 5.4.

    Examples
    --------
    >>> from isovary.shapes import icosphere
    >>> sphere = icosphere(3)
    >>> pole = sphere.points[:, 2].argmax()
    >>> pushed = dimple(sphere, sphere.points[pole], 1.0)
    >>> round(float(1 - np.linalg.norm(pushed.points[pole])), 2)
    0.14
    """
    check_surface(surface)
    centers = np.atleast_2d(np.asarray(center, dtype=float))
    if centers.ndim != 2 or centers.shape[1] != 3 or len(centers) == 0:
        shape = np.shape(center)
        raise ArgumentError("A03", f"center: expected shape (3,) or (k, 3), got {shape}")
    radii = one_each("radius", radius, len(centers))
    strengths = one_each("alpha", alpha, len(centers))
    made, found = surface, dict[str, None]()
    for point, width, strength in zip(centers, radii, strengths, strict=True):
        region = Region(point, float(width), decay)
        place, normal = _nearest(made, region.center)
        start, end = (region.center + far * region.radius * normal for far in (_FIRST, _LAST))
        projectile = Projectile(start, end, charge, steps)
        moved = _shot(made, projectile, region, float(strength), stacklevel=3)
        found |= dict.fromkeys(doubts(made, moved, region.center, region.radius, decay, place))
        made = moved
    if found:
        warnings.warn("; ".join(found) + " [M11]", UserWarning, stacklevel=2)
    warn_of_crossings(surface, made)
    return made


def shoot(
    surface: Surface, projectile: Projectile, region: Region, *, alpha: float = 5.0
) -> Surface:
    r"""The surface after a charged projectile has flown by.

    Each node in the region, of unit mass and at rest before, feels

    .. math:: \dot v = \alpha R^3 q_i q_p \, e^{-(s / \sigma R)^2} (1 - (s / R)^2)^2
              \, \frac{r}{\lVert r \rVert^3}

    with r the vector to it from the projectile, R the region's radius, sigma its decay, and s the
    distance of the node to the centre before anything moved. In a step, x grows by
    v dt + a dt^2 / 2 and then v by a dt, with a from the node's place at the step's beginning and
    the projectile's at its middle.

    Lengths count in radii: surface, region and flight scaled alike give the result scaled. The
    unit of time is free; of dt and alpha only alpha dt^2 counts.

    Parameters
    ----------
    surface : Surface
        Open or closed, of order 1 or 2; nodes on a rim move as others do.
    projectile : Projectile
    region : Region
    alpha : float
        Strength alpha; 1/time^2.

    Returns
    -------
    Surface
        With the same triangles. The normals are those of the smooth motion that the nodes sample.

    Raises
    ------
    ArgumentError
        A02 for a strength that is not finite, or a region without a node.
    MeshError
        M03 if triangles are turned over, even in time steps 16 times smaller.

    Warns
    -----
    UserWarning
        M03 if it took smaller time steps than the projectile's; M08 if the surface runs through
        itself now, where it did not before.

    Notes
    -----
    The motion is a map of space, known at every point and not only at the nodes, and with it goes
    its gradient F. A surface may lean over without harm; a triangle is turned over where its
    normal turns by more than a right angle in one step, or in the end points against the normal
    cof(F) N of the moved surface itself, at any of its nodes, or where a curved triangle's
    Jacobian changes sign; and where a node and the projectile pass one another in one step. The
    mesh is then too coarse for the dimple, or the time step too long: that is halved, with the
    same total time, up to four times. Nodes that two meshes share move identically, if neither
    takes smaller steps.

    The result differs from that of infinitely small steps by O(dt): 0.7 % of the depth for 20
    steps at alpha = 5. Whether parts of the surface pass through one another is looked for in the
    flat pieces of the triangles that moved, at the end of the flight only.

    References
    ----------
    Thesis, section 5.1. The decay d_i that it leaves open is (s / sigma R)^2 here; the window,
    which makes the motion smooth at the region's border, and R^3 are ours.

    Examples
    --------
    From far away the acceleration is constant, a = alpha R^3 / r^2 = 5 / 10^2, and the way
    a t^2 / 2 = 0.05 * 0.2^2 / 2 = 0.001:

    >>> from isovary.shapes import icosphere
    >>> sphere = icosphere(3)
    >>> pole = sphere.points[:, 2].argmax()
    >>> top = sphere.points[pole]
    >>> moved = shoot(sphere, Projectile(11 * top, 11 * top), Region(top, 1.0))
    >>> round(float(np.linalg.norm(moved.points[pole] - top)), 5)
    0.001
    """
    check_surface(surface)
    moved = _shot(surface, projectile, region, alpha, stacklevel=3)
    warn_of_crossings(surface, moved)
    return moved


def _shot(
    surface: Surface, projectile: Projectile, region: Region, alpha: float, stacklevel: int
) -> Surface:
    """The surface after a projectile, with as small time steps as it takes."""
    check_finite("alpha", alpha)
    nodes = _nodes_in(surface, region)
    strength = alpha * region.charge * projectile.charge
    bad = np.zeros(0, dtype=np.int64)
    for halvings in range(_HALVINGS + 1):
        flight = _fly(surface.points[nodes], projectile, region, strength, 2**halvings)
        moved, bad = _moved(surface, nodes, flight)
        if len(bad) == 0:
            _warn_of_halvings(halvings, projectile, stacklevel + 1)
            return Surface(moved.points, surface.triangles, _turn(surface.normals, moved, nodes))
    near = surface.points[surface.triangles[bad[0], :3]].mean(axis=0).round(6).tolist()
    raise MeshError(
        "M03",
        f"triangles: expected none turned over by the projectile, got {len(bad)}, the first near "
        f"{near}, even in {2**_HALVINGS} times as many steps; make alpha smaller, the region or "
        "the distance of the projectile larger, or the mesh finer",
    )


class _Motion(NamedTuple):
    """Where points (n, 3) arrive, and the gradients (n, 3, 3) of the motion there."""

    points: Floats
    gradients: Floats


def _fly(
    rest: Floats, projectile: Projectile, region: Region, strength: float, finer: int
) -> Iterator[_Motion]:
    """The motion, and its derivative by the places at rest, after each of the finer steps.

    NaN for points that pass the projectile, or are passed by it, within one step.
    """
    weights, slopes = _window(rest, region)
    scale = strength * region.radius**3
    steps, dt = projectile.steps * finer, projectile.dt / finer
    flight = projectile.end - projectile.start
    points, velocities = rest, np.zeros_like(rest)
    gradients, rates = np.tile(np.eye(3), (len(rest), 1, 1)), np.zeros((len(rest), 3, 3))
    before, passed = points - projectile.start, np.zeros(len(rest), dtype=bool)
    for step in range(steps):
        away = points - (projectile.start + (step + 0.5) / steps * flight)
        distance = np.sqrt((away**2).sum(axis=1))
        direction = away / distance[:, None]
        field = direction * (scale / distance**2)[:, None]
        tide = np.eye(3) - 3 * direction[:, :, None] * direction[:, None, :]
        tide *= (scale * weights / distance**3)[:, None, None]
        push = weights[:, None] * field
        bend = field[:, :, None] * slopes[:, None, :] + tide @ gradients
        points = points + dt * velocities + dt**2 / 2 * push
        gradients = gradients + dt * rates + dt**2 / 2 * bend
        velocities, rates = velocities + dt * push, rates + dt * bend
        after = points - (projectile.start + (step + 1) / steps * flight)
        passed |= ~((before * after).sum(axis=1) > 0)
        before = after
        yield _Motion(np.where(passed[:, None], np.nan, points), gradients)


def _window(rest: Floats, region: Region) -> tuple[Floats, Floats]:
    """The force's share (n,) at each place exp(-(s / sigma R)^2) (1 - (s / R)^2)^2; its slope."""
    away = (rest - region.center) / region.radius
    squared = (away**2).sum(axis=1)
    decay, inside = np.exp(-squared / region.decay**2), 1 - squared
    slope = -2 * decay * inside * (inside / region.decay**2 + 2) / region.radius
    return decay * inside**2, slope[:, None] * away


def _nodes_in(surface: Surface, region: Region) -> Ints:
    """Nodes that move: within the radius, in the piece that holds the node nearest to the centre.

    The piece is one of the flat triangles' part within the radius: two edges of a triangle that
    both come so near hang together, whether or not their ends are within.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    distance = np.linalg.norm(surface.points - region.center, axis=1)
    nearest = int(distance.argmin())
    if not distance[nearest] < region.radius:
        raise ArgumentError(
            "A02",
            f"center: expected a node within the radius of {region.radius:g}, got the nearest at "
            f"{distance[nearest]:g}; choose a centre on the surface, or a larger radius",
        )
    edges, of_triangle, _ = edges_of(linear_triangles(surface.triangles))
    near = _segment_distance(surface.points[edges], region.center) < region.radius
    links = np.concatenate([of_triangle[:, list(pair)] for pair in EDGES])
    links = links[near[links].all(axis=1)]
    graph = coo_array((np.ones(len(links)), links.T), shape=(len(edges),) * 2)
    piece = connected_components(graph, directed=False)[1]
    own = near & (piece == piece[np.flatnonzero((edges == nearest).any(axis=1))[0]])
    nodes = np.unique(edges[own])
    within: Ints = nodes[distance[nodes] < region.radius]
    return within


def _segment_distance(ends: Floats, point: Floats) -> Floats:
    """Distance (e,) of a point to each segment (e, 2, 3)."""
    along, to_point = ends[:, 1] - ends[:, 0], point - ends[:, 0]
    squared = (along**2).sum(axis=1)
    share = (along * to_point).sum(axis=1) / np.where(squared > 0, squared, 1.0)
    rest = to_point - np.clip(share, 0, 1)[:, None] * along
    return np.asarray(np.linalg.norm(rest, axis=1))


def _moved(surface: Surface, nodes: Ints, flight: Iterator[_Motion]) -> tuple[_Motion, Ints]:
    """The surface's nodes after a flight, and the sound triangles that it turned over."""
    touched = np.flatnonzero(np.isin(surface.triangles, nodes).any(axis=1))
    triangles, points = surface.triangles[touched], surface.points
    gradients = np.tile(np.eye(3), (len(points), 1, 1))
    sides = tangents(points, triangles, node_places(surface.order))
    normals = _across(sides)
    turned = np.zeros(len(touched), dtype=bool)
    with np.errstate(all="ignore"):  # what is not finite counts as turned over
        sound = _along(normals, normals) & (jacobian_ratios(points, triangles) > 0)
        for motion in flight:
            points = surface.points.copy()
            points[nodes], gradients[nodes] = motion
            before = normals
            normals = _across(tangents(points, triangles, node_places(surface.order)))
            turned |= ~_along(normals, before)
        turned |= ~_along(normals, _across(gradients[triangles] @ sides))
        turned |= ~(jacobian_ratios(points, triangles) > 0)
    return _Motion(points, gradients), touched[sound & turned]


def _along(normals: Floats, others: Floats) -> Bools:
    """Mask (m,) of the triangles whose normals (m, q, 3) point along others at all q places."""
    return np.asarray(((normals * others).sum(axis=2) > 0).all(axis=1))


def _across(columns: Floats) -> Floats:
    """Cross product (..., 3) of the two columns (..., 3, 2)."""
    return np.asarray(np.cross(columns[..., 0], columns[..., 1]))


def _turn(normals: Floats, moved: _Motion, nodes: Ints) -> Floats:
    """Unit normals turned by the cofactors of the gradients at some nodes."""
    f = moved.gradients[nodes]
    cofactors = np.stack(
        [np.cross(f[:, :, 1], f[:, :, 2]), np.cross(f[:, :, 2], f[:, :, 0]), _across(f[:, :, :2])],
        axis=2,
    )
    turned = normals.copy()
    turned[nodes] = _unit(np.einsum("nij,nj->ni", cofactors, normals[nodes]))
    return turned


def _warn_of_halvings(halvings: int, projectile: Projectile, stacklevel: int) -> None:
    if halvings:
        warnings.warn(
            f"steps: expected {projectile.steps} to turn no triangle over, got some turned over; "
            f"took {projectile.steps * 2**halvings} smaller ones in the same time [M03]",
            UserWarning,
            stacklevel=stacklevel,
        )


def _nearest(surface: Surface, point: Floats) -> tuple[Floats, Floats]:
    """Place nearest to a point on the flat triangles at the nearest node, and unit normal there."""
    nearest = int(((surface.points - point) ** 2).sum(axis=1).argmin())
    flat = linear_triangles(surface.triangles)
    flat = flat[(flat == nearest).any(axis=1)]
    first = (flat == nearest).argmax(axis=1)
    flat = np.take_along_axis(flat, (first[:, None] + np.arange(3)) % 3, axis=1)
    origin = surface.points[nearest]
    sides = (surface.points[flat[:, 1:]] - origin).transpose(0, 2, 1)
    shares = np.clip(np.linalg.pinv(sides) @ (point - origin), 0, 1)
    shares /= np.maximum(shares.sum(axis=1, keepdims=True), 1)
    misses = np.linalg.norm(point - origin - np.einsum("mij,mj->mi", sides, shares), axis=1)
    best = int(misses.argmin())
    weights = np.append(1 - shares[best].sum(), shares[best])
    nodes = flat[best]
    return weights @ surface.points[nodes], _unit(weights @ surface.normals[nodes])


def _unit(vectors: Floats) -> Floats:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.where(length > 0, length, 1.0))
