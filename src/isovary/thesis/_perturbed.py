"""One dimple whose place is known, compared on one mesh or on two, and how well it is found."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..correspondence import interpolate, normal_rays
from ..difference import heat_trace_scale, signature_difference
from ..geometry import Bools, Floats, Ints, edges_of, linear_triangles, node_areas
from ..records import Surface
from ._irregular import irregular_ellipsoid, polar_dimple, scattered_ellipsoid
from ._records import Settings
from ._steps import scaled_change, signed

WAYS = {
    "carried": "one mesh, curved elements",
    "flat": "one mesh, flat elements",
    "rays": "two meshes, flat elements, rays",
}
"""Isovary's way, the thesis's where the dimple maker knows the partners, and where rays do."""

_MOVED = 0.1  # of the largest displacement: what belongs to the region
_PEAK = 0.5  # of the largest displacement: the bigger protrusion


@dataclass(frozen=True, eq=False)
class Perturbed:
    """A surface, the one compared with it, and the change at the nodes that have a partner.

    Parameters
    ----------
    base, dimpled : Surface
        The dimpled one on the base's mesh, whatever was compared.
    change : array (n, T)
        NaN where a ray met nothing.
    """

    base: Surface
    dimpled: Surface
    change: Floats

    @property
    def displacement(self) -> Floats:
        """Of each node (n,), as a part of the largest."""
        size = np.linalg.norm(self.dimpled.points - self.base.points, axis=1)
        part: Floats = size / size.max()
        return part

    @property
    def region(self) -> Bools:
        """Nodes (n,) that moved by more than a tenth of the largest displacement."""
        return self.displacement > _MOVED

    @property
    def peak(self) -> Bools:
        """Nodes (n,) that moved by more than half of it."""
        return self.displacement > _PEAK

    @property
    def still(self) -> Bools:
        """Nodes (n,) that did not move at all."""
        return np.equal(self.displacement, 0)

    @property
    def areas(self) -> Floats:
        """Of the base, at each node (n,); length^2."""
        return node_areas(self.base.points, self.base.triangles)


def perturbed(way: str, axes: list[float], alpha: float, settings: Settings) -> Perturbed:
    """An ellipsoid with one dimple at its upper pole, in one of the ways."""
    curved = way == "carried"
    subdivisions = settings["subdivisions" if curved else "flat_subdivisions"]
    shift, seed, order = settings["shift"], settings["seed"], 2 if curved else 1
    base = irregular_ellipsoid(axes, subdivisions, shift, seed, order=order)
    dimpled = polar_dimple(base, axes[2], settings["dimple_radius"], alpha)
    one = signed(base, settings["pairs"], settings["times"])
    if way != "rays":
        two = signed(dimpled, settings["pairs"], one.times)
        return Perturbed(base, dimpled, scaled_change(one, two))
    other = scattered_ellipsoid(axes, settings["other_vertices"], shift, seed)
    other = polar_dimple(other, axes[2], settings["dimple_radius"], alpha)
    partners = normal_rays(base, other)
    met = interpolate(partners, other, signed(other, settings["pairs"], one.times).signature)
    scale = heat_trace_scale(one.pairs, one.times)
    return Perturbed(base, dimpled, signature_difference(one.signature, met, scale))


def overlap(found: Bools, wanted: Bools, areas: Floats) -> float:
    """IoU: the area in both over the area in either."""
    both, either = np.logical_and(found, wanted), np.logical_or(found, wanted)
    return float(areas[both].sum() / areas[either].sum())


def best_group(labels: Ints, wanted: Bools, areas: Floats) -> int:
    """The group that fits best."""
    groups = np.unique(labels[labels >= 0])
    return int(max(groups, key=lambda group: overlap(np.equal(labels, group), wanted, areas)))


def roughness(rows: Floats, surface: Surface, nodes: Bools | None = None) -> float:
    """Mean squared step between neighbours over that between any two: 0 smooth, 1 noise.

    Of the nodes (n,) of a mask, if one is given.
    """
    i, j = edges_of(linear_triangles(surface.triangles))[0].T
    known = np.asarray(np.isfinite(rows).all(axis=1))
    if nodes is not None:
        known &= nodes
    both = np.asarray(known[i] & known[j])
    steps = ((rows[i] - rows[j])[both] ** 2).sum(axis=1).mean()
    return float(steps / (2 * rows[known].var(axis=0).sum()))
