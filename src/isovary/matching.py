"""Which component of one isosurface is which of another: what came, went, joined or parted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from .errors import ArgumentError
from .geometry import (
    Bools,
    Floats,
    Ints,
    Topology,
    components,
    linear_triangles,
    node_areas,
    node_components,
    topology,
)
from .records import Surface

Event = Literal["matched", "lost", "born", "merged", "split", "handle", "rim"]
"""What became of a component."""

_SHARED = 0.3  # part of the smaller area that must lie at the other component
_FAR = 4.0  # of the size: centres farther apart are no pair
_UNLIKE = 0.01  # of the size: what another topology adds to a distance


@dataclass(frozen=True)
class Component:
    """Facts about one connected component of a surface; made by :func:`component_table`.

    ``topology``; ``area`` in length^2; ``volume`` in length^3, positive for a solid piece,
    negative for a pocket inside one and NaN for an open component; ``centre``, the mean of its
    points by area, and ``size``, their root-mean-square distance from it, in length; ``nodes``,
    their number.
    """

    topology: Topology
    area: float
    volume: float
    centre: tuple[float, float, float]
    size: float
    nodes: int

    def __str__(self) -> str:
        decimals = 3 - int(np.floor(np.log10(self.size)))
        place = ", ".join(f"{round(x, decimals) + 0.0:g}" for x in self.centre)
        return (
            f"genus {self.topology.genus}, {self.topology.boundary_loops} loops, "
            f"near ({place}), area {self.area:.4g}"
        )


@dataclass(frozen=True)
class ComponentMatch:
    """What became of a component of the base, or where one of the perturbed comes from.

    Parameters
    ----------
    base, perturbed : int
        Numbers of the components, as of :func:`isovary.geometry.components`; -1 for none.
    base_part, perturbed_part : Component, optional
        Their facts; None for none.
    event : str
        ``matched``; ``handle`` or ``rim``: matched, but of another genus or number of boundary
        loops; ``lost`` or ``born``; ``merged``: several of the base are one of the perturbed,
        ``split``: the other way round, with a match for each of the several.
    """

    base: int
    perturbed: int
    base_part: Component | None
    perturbed_part: Component | None
    event: Event

    @property
    def base_topology(self) -> Topology | None:
        """Topology of the base's component, None for none."""
        return None if self.base_part is None else self.base_part.topology

    @property
    def perturbed_topology(self) -> Topology | None:
        """Topology of the perturbed one's component, None for none."""
        return None if self.perturbed_part is None else self.perturbed_part.topology

    @property
    def same(self) -> bool:
        """Whether one component of each belong together and have the same topology."""
        return self.event == "matched"

    def __str__(self) -> str:
        before = f"component {self.base} of the base ({self.base_part})"
        after = f"component {self.perturbed} of the perturbed ({self.perturbed_part})"
        if self.event == "lost":
            return f"{before} -> lost"
        if self.event == "born":
            return f"{after}: born"
        return f"{before} -> {after}: {self.event}"


def describe(matches: Sequence[ComponentMatch]) -> str:
    """One line for each match, for errors and reports.

    Examples
    --------
    >>> from isovary.shapes import icosphere
    >>> sphere = icosphere(4)
    >>> print(describe(match_components(sphere, sphere)))
    component 0 of the base (genus 0, 0 loops, near (0, 0, 0), area 12.56) -> component 0 of the
    perturbed (genus 0, 0 loops, near (0, 0, 0), area 12.56): matched
    """
    return "\n".join(map(str, matches))


def component_table(surface: Surface) -> tuple[Component, ...]:
    """Topology, area, volume, place and size of each component, in the order of their numbers.

    Parameters
    ----------
    surface : Surface

    Returns
    -------
    tuple of Component

    Notes
    -----
    Cost: 50 ms for 50 000 triangles. Areas and volumes are those of the flat triangles over
    the nodes.

    Examples
    --------
    >>> from isovary.shapes import icosphere
    >>> (ball,) = component_table(icosphere(4))
    >>> round(ball.volume / (4 * np.pi / 3), 2), round(ball.size, 6), ball.topology.genus
    (1.0, 1.0, 0)
    """
    labels = components(surface.triangles)
    order = np.argsort(labels, kind="stable")
    rows = np.split(order, np.flatnonzero(np.diff(labels[order])) + 1)
    areas = node_areas(surface.points, surface.triangles)
    return tuple(_component(surface, surface.triangles[row], areas) for row in rows)


def _component(surface: Surface, triangles: Ints, areas: Floats) -> Component:
    nodes = np.unique(triangles)
    points, weights = surface.points[nodes], areas[nodes]
    centre = weights @ points / weights.sum()
    size = np.sqrt(weights @ ((points - centre) ** 2).sum(axis=1) / weights.sum())
    own = topology(triangles)
    a, b, c = (surface.points[linear_triangles(triangles)[:, k]] - centre for k in range(3))
    volume = float((a * np.cross(b, c)).sum()) / 6
    return Component(
        own,
        float(weights.sum()),
        volume if own.boundary_loops == 0 else float("nan"),
        (float(centre[0]), float(centre[1]), float(centre[2])),
        float(size),
        len(nodes),
    )


def part_of(surface: Surface, component: int | Sequence[int]) -> tuple[Surface, Ints]:
    """Some components of a surface as a surface of their own.

    Parameters
    ----------
    surface : Surface
    component : int or sequence of int
        Numbers as of :func:`isovary.geometry.components`.

    Returns
    -------
    part : Surface
        With the normals of the whole.
    nodes : array (k,)
        Number in the whole of each node of the part, ascending.

    Raises
    ------
    ArgumentError
        A02 for a number that no component has, or none at all.

    Examples
    --------
    >>> two = Surface(
    ...     [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 5], [1, 0, 5], [0, 1, 5]],
    ...     [[0, 1, 2], [3, 4, 5]])
    >>> upper, nodes = part_of(two, 1)
    >>> upper.triangles.tolist(), nodes.tolist()
    ([[0, 1, 2]], [3, 4, 5])
    """
    labels = components(surface.triangles)
    wanted = np.unique(np.asarray(component, dtype=np.int64))
    count = int(labels.max()) + 1
    if len(wanted) == 0 or wanted[0] < 0 or wanted[-1] >= count:
        raise ArgumentError(
            "A02", f"component: expected numbers in [0, {count}), got {wanted.tolist()}"
        )
    triangles = surface.triangles[np.isin(labels, wanted)]
    nodes, local = np.unique(triangles, return_inverse=True)
    normals = surface.normals[nodes]
    return Surface(surface.points[nodes], local.reshape(triangles.shape), normals), nodes


def match_components(base: Surface, perturbed: Surface) -> tuple[ComponentMatch, ...]:
    """Which components of two isosurfaces belong together, and what became of the others.

    A node lies at a component of the other surface if the other's nearest node belongs to that
    component, is not farther than the size of the node's own component (the root-mean-square
    distance from its centre) and faces the same way. Two components are linked if of each
    an area lies at the other that is 30 % of the smaller one's, at least. One linked to one is
    matched; several linked to one have merged, one linked to several has split. Components
    without a link are paired one to one so that the sum of their distances is least, where the
    distance, the mean to the nearest node of the other both ways, is not above the larger size
    of the two; solid pieces are never paired with pockets. What is left is lost or born.

    Parameters
    ----------
    base, perturbed : Surface
        In the same coordinates.

    Returns
    -------
    tuple of ComponentMatch
        By the number in the base, then in the perturbed; the born last.

    Notes
    -----
    Knows the surfaces only, not what happened between: a droplet that another swallows whole
    is lost, and droplets that merge while they move farther than their size are lost but one.
    Cost: two search trees, 0.1 s for 20 000 nodes each, and one for each component without
    a link.

    Examples
    --------
    A sphere that grows by a tenth:

    >>> from isovary.shapes import icosphere
    >>> sphere = icosphere(2)
    >>> (match,) = match_components(sphere, Surface(1.1 * sphere.points, sphere.triangles))
    >>> match.event, match.same
    ('matched', True)
    """
    parts = component_table(base), component_table(perturbed)
    linked = _linked(base, perturbed, *parts)
    pairs = [(int(i), int(j)) for i, j in np.argwhere(linked)]
    loose = np.flatnonzero(~linked.any(axis=1)), np.flatnonzero(~linked.any(axis=0))
    pairs += _assigned(base, perturbed, parts, loose)
    known = {i for i, _ in pairs}, {j for _, j in pairs}
    pairs += [(i, -1) for i in range(len(parts[0])) if i not in known[0]]
    pairs = sorted(pairs) + [(-1, j) for j in range(len(parts[1])) if j not in known[1]]
    return tuple(_match(i, j, pairs, parts) for i, j in pairs)


_Parts = tuple[tuple[Component, ...], tuple[Component, ...]]


def _match(i: int, j: int, pairs: list[tuple[int, int]], parts: _Parts) -> ComponentMatch:
    first = parts[0][i] if i >= 0 else None
    second = parts[1][j] if j >= 0 else None
    event: Event
    if first is None or second is None:
        event = "born" if first is None else "lost"
    elif sum(other == j for _, other in pairs) > 1:
        event = "merged"
    elif sum(other == i for other, _ in pairs) > 1:
        event = "split"
    elif first.topology.boundary_loops != second.topology.boundary_loops:
        event = "rim"
    else:
        event = "matched" if first.topology == second.topology else "handle"
    return ComponentMatch(i, j, first, second, event)


def _linked(
    base: Surface,
    perturbed: Surface,
    base_parts: tuple[Component, ...],
    perturbed_parts: tuple[Component, ...],
) -> Bools:
    """Mask (b, p) of the components that lie at each other."""
    there = _area_at(base, perturbed, base_parts, len(perturbed_parts))
    back = _area_at(perturbed, base, perturbed_parts, len(base_parts)).T
    smaller = np.minimum.outer(
        [part.area for part in base_parts], [part.area for part in perturbed_parts]
    )
    linked: Bools = np.minimum(there, back) >= _SHARED * smaller
    return linked


def _area_at(surface: Surface, other: Surface, parts: tuple[Component, ...], count: int) -> Floats:
    """Area of each component of the surface that lies at each of the other's ``count``."""
    from scipy.spatial import cKDTree

    own, others = node_components(surface.triangles), node_components(other.triangles)
    sizes = np.array([part.size for part in parts])
    distance, nearest = cKDTree(other.points).query(surface.points)
    facing = (surface.normals * other.normals[nearest]).sum(axis=1) > 0
    counts = facing & (distance <= sizes[own])
    areas = np.where(counts, node_areas(surface.points, surface.triangles), 0.0)
    cells = own * count + others[nearest]
    table: Floats = np.bincount(cells, areas, len(parts) * count).astype(np.float64)
    return table.reshape(len(parts), count)


def _assigned(
    base: Surface, perturbed: Surface, parts: _Parts, loose: tuple[Ints, Ints]
) -> list[tuple[int, int]]:
    """Pairs of components without a link, one to one, that are near enough."""
    if min(map(len, loose)) == 0:
        return []
    from scipy.optimize import linear_sum_assignment

    facts = [[parts[side][k] for k in loose[side]] for side in (0, 1)]
    sizes = np.maximum.outer([p.size for p in facts[0]], [p.size for p in facts[1]])
    centres = [np.array([p.centre for p in side]) for side in facts]
    apart = np.linalg.norm(centres[0][:, None] - centres[1], axis=2)
    clouds = [
        [surface.points[node_components(surface.triangles) == k] for k in numbers]
        for surface, numbers in zip((base, perturbed), loose, strict=True)
    ]
    distances = _distances(clouds[0], clouds[1], apart < _FAR * sizes)
    turned = np.multiply.outer([p.volume for p in facts[0]], [p.volume for p in facts[1]]) < 0
    unlike = np.array([[a.topology != b.topology for b in facts[1]] for a in facts[0]])
    near = (distances <= sizes) & ~turned
    cost = np.where(near, distances, 1e3 * sizes.max()) + _UNLIKE * sizes * unlike
    rows, columns = linear_sum_assignment(cost)
    return [
        (int(loose[0][i]), int(loose[1][j]))
        for i, j in zip(rows, columns, strict=True)
        if near[i, j]
    ]


def _distances(first: list[Floats], second: list[Floats], wanted: Bools) -> Floats:
    """Mean distance (f, s) to the nearest point of the other cloud, both ways; infinite if far."""
    from scipy.spatial import cKDTree

    here, there = [cKDTree(cloud) for cloud in first], [cKDTree(cloud) for cloud in second]
    table = np.full(wanted.shape, np.inf)
    for i, j in np.argwhere(wanted):
        ways = there[j].query(first[i])[0].mean(), here[i].query(second[j])[0].mean()
        table[i, j] = sum(ways) / 2
    return table
