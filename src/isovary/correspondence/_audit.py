"""How far a correspondence can be trusted: what it covers, folds and stretches."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import ArgumentError
from ..geometry import (
    EDGES,
    Bools,
    Floats,
    Ints,
    frozen,
    linear_triangles,
    node_areas,
    rim_nodes,
    triangle_areas,
)
from ..records import Correspondence, Surface
from ._closest_point import nearest
from ._elements import position, to_parent
from ._interpolate import interpolate

_COVERED = 0.99
_STRETCHED = 4.0
_ROUNDING = 1e-9  # of the bounding box's diagonal
DISTANCE_PARTS = (0.5, 0.95, 1.0)
"""Parts of the base's area that the distances of an audit are quantiles for."""
AREA_PARTS = (0.0, 0.05, 0.5, 0.95, 1.0)
"""Parts of the base's area that the area ratios of an audit are quantiles for."""


@dataclass(frozen=True, eq=False, repr=False)
class CorrespondenceAudit:
    """What a correspondence covers, folds and stretches; made by :func:`audit`.

    For a base of n nodes and m triangles, a perturbed surface of m' triangles. Areas are those of
    the flat triangles over the nodes, four for each curved one; parts lie between 0 and 1.

    Parameters
    ----------
    nodes, lost, lost_inside : int
        Nodes of the base; those without a partner; those of them that no other lost nodes link
        to a rim of the base. Losses along a rim are what a moved rim leaves; others are holes.
    base_coverage : float
        Part of the base's area whose nodes have a partner.
    perturbed_coverage : float
        Part of the perturbed area that the image of the base passes over.
    several : float
        Part of the base's area whose nodes had more than one hit to choose from.
    folded : float
        Part of the mapped area of the base whose image has turned over or collapsed.
    distances : array (3,)
        Size of the distance that 50, 95 and 100 % of the area with a partner do not exceed;
        length. NaN without any.
    area_ratios : array (5,)
        Image area over base area of the flat triangles: smallest, quantiles for 5, 50 and 95 % of
        the base's area, largest. NaN without any.
    covered : array (m',)
        Part of each perturbed triangle that is covered.
    turned : array (m,)
        Mask of the base triangles whose image has turned over or collapsed, wholly or in part.
    """

    nodes: int
    lost: int
    lost_inside: int
    base_coverage: float
    perturbed_coverage: float
    several: float
    folded: float
    distances: Floats
    area_ratios: Floats
    covered: Floats
    turned: Bools

    def __post_init__(self) -> None:
        for name in ("distances", "area_ratios", "covered"):
            object.__setattr__(self, name, frozen(getattr(self, name)))
        object.__setattr__(self, "turned", frozen(self.turned, np.bool_))

    @property
    def faults(self) -> tuple[str, ...]:
        """What a reader should know, in words; empty for a correspondence one to one."""
        found = []
        if self.lost:
            found.append(
                f"{self.lost} of {self.nodes} nodes without a partner, {1 - self.base_coverage:.2%}"
                f" of the base's area; {self.lost_inside} of them away from the rims"
            )
        if self.perturbed_coverage < _COVERED:
            missed = 1 - self.perturbed_coverage
            found.append(f"{missed:.2%} of the perturbed area is the partner of nothing")
        if self.turned.any():
            found.append(
                f"{self.turned.sum()} triangles turned over or collapsed on the way, "
                f"{self.folded:.2%} of the mapped area"
            )
        if self.several > 0:
            found.append(
                f"several partners to choose from on {self.several:.2%} of the base's area"
            )
        low, high = self.area_ratios[0], self.area_ratios[-1]
        if high > _STRETCHED or low < 1 / _STRETCHED:
            found.append(f"areas of triangles multiplied by {low:.2g} to {high:.2g}")
        return tuple(found)

    def summary(self) -> dict[str, Any]:
        """Plain numbers and words for JSON; None for what is unknown."""
        return {
            "nodes": self.nodes,
            "nodes_without_partner": self.lost,
            "nodes_without_partner_away_from_rims": self.lost_inside,
            "base_coverage": self.base_coverage,
            "perturbed_coverage": self.perturbed_coverage,
            "several_hits": self.several,
            "folded": self.folded,
            "folded_triangles": int(self.turned.sum()),
            "distance": _named(self.distances, ("median", "quantile_95_percent", "largest")),
            "area_ratio": _named(
                self.area_ratios,
                ("smallest", "quantile_5_percent", "median", "quantile_95_percent", "largest"),
            ),
            "faults": list(self.faults),
        }

    def __repr__(self) -> str:
        return (
            f"CorrespondenceAudit(covers {self.base_coverage:.1%} of the base and "
            f"{self.perturbed_coverage:.1%} of the perturbed surface, {self.folded:.1%} folded)"
        )


def audit(base: Surface, perturbed: Surface, correspondence: Correspondence) -> CorrespondenceAudit:
    """What a correspondence covers of both surfaces, and where it folds, stretches or chooses.

    The partners of the base's nodes, joined as the base's flat triangles are, form its *image*;
    triangles with a lost corner have none. The middle c of each flat triangle of the perturbed
    surface counts as covered if the image passes over it: with q the image's point nearest to c,
    p the perturbed surface's point nearest to q,

    ``norm(q - c) <= 2 norm(q - p)``.

    The image is made of chords, so q lies off the surface a little; the condition says
    that c is about as near to q as the surface gets. A second sheet, however close,
    a part beyond the image's rim, a tentacle that stands over it or an island fail it.

    Parameters
    ----------
    base, perturbed : Surface
    correspondence : Correspondence
        From base to perturbed, of any method.

    Returns
    -------
    CorrespondenceAudit

    Raises
    ------
    ArgumentError
        A03 for a correspondence that does not belong to the two surfaces.

    Notes
    -----
    Resolved to one flat triangle: along a rim of the image, up to a row of triangles is not
    covered; along sharp edges, whose corners the chords cut, the next row may or may not be.
    Two sheets are told apart if they are three times as far apart as the image's chords leave
    the surface. Turning over is judged by the perturbed normals at the partners.
    Cost: 50 microseconds for each flat triangle of the perturbed surface.

    Examples
    --------
    A sheet over one half as wide: 5 of its 9 columns of nodes find a partner, and they
    stand for 4.5 of 8 columns of cells.

    >>> from isovary.correspondence import normal_rays
    >>> from isovary.shapes import sheet
    >>> base, half = sheet(2.0, 1.0, (8, 4)), sheet(1.0, 1.0, (4, 4))
    >>> found = audit(base, half, normal_rays(base, half))
    >>> round(found.base_coverage, 9), found.perturbed_coverage, found.lost_inside
    (0.5625, 1.0, 0)
    """
    _check(base, perturbed, correspondence)
    found, areas = correspondence.found, node_areas(base.points, base.triangles)
    partners = interpolate(correspondence, perturbed, perturbed.points)
    pieces = linear_triangles(base.triangles)
    mapped = found[pieces].all(axis=1)
    before = triangle_areas(base.points, pieces[mapped])
    ratios, turned = _image_of(before, pieces[mapped], partners, perturbed, correspondence)
    of_triangle = np.flatnonzero(mapped) * len(base.triangles) // len(pieces)
    some_turned = np.bincount(of_triangle[turned], minlength=len(base.triangles)) > 0
    covered, cover = _covered(perturbed, partners, pieces[mapped])
    return CorrespondenceAudit(
        nodes=len(found),
        lost=int((~found).sum()),
        lost_inside=_lost_inside(base, found),
        base_coverage=_part(areas, found),
        perturbed_coverage=cover,
        several=_part(areas, correspondence.hits > 1),
        folded=_part(before, turned),
        distances=_quantiles(np.abs(correspondence.distance[found]), areas[found], DISTANCE_PARTS),
        area_ratios=_quantiles(ratios, before, AREA_PARTS),
        covered=covered,
        turned=some_turned,
    )


def _check(base: Surface, perturbed: Surface, correspondence: Correspondence) -> None:
    nodes, last = len(correspondence.triangle), int(correspondence.triangle.max(initial=-1))
    if nodes != len(base.points) or last >= len(perturbed.triangles):
        raise ArgumentError(
            "A03",
            f"correspondence: expected {len(base.points)} nodes matched to triangles below "
            f"{len(perturbed.triangles)}, got {nodes} and triangle {last}; give the two surfaces "
            "that it was made from",
        )


def _image_of(
    before: Floats, pieces: Ints, partners: Floats, perturbed: Surface, match: Correspondence
) -> tuple[Floats, Bools]:
    """Area of each flat triangle's image over its own area, and whether it has turned over."""
    a, b, c = (partners[pieces[:, k]] for k in range(3))
    across = np.cross(b - a, c - a)
    facing = interpolate(match, perturbed, perturbed.normals)[pieces].sum(axis=1)
    sound = before > 0
    ratios = np.linalg.norm(across, axis=1) / 2 / np.where(sound, before, 1.0)
    turned: Bools = (across * facing).sum(axis=1) <= 0
    return np.where(sound, ratios, 1.0), turned & sound


def _covered(perturbed: Surface, partners: Floats, pieces: Ints) -> tuple[Floats, float]:
    """Covered part of each perturbed triangle (m',), and of the whole."""
    flat = linear_triangles(perturbed.triangles)
    areas = triangle_areas(perturbed.points, flat)
    hit = np.zeros(len(flat), dtype=bool)
    pieces = pieces[triangle_areas(partners, pieces) > 0]
    if len(pieces):
        hit = _passed_over(perturbed, flat, partners, pieces)
    by_triangle = areas.reshape(len(perturbed.triangles), -1)
    total = by_triangle.sum(axis=1)
    covered = (by_triangle * hit.reshape(by_triangle.shape)).sum(axis=1)
    return covered / np.where(total > 0, total, 1.0), _part(areas, hit)


def _passed_over(perturbed: Surface, flat: Ints, partners: Floats, pieces: Ints) -> Bools:
    """Whether the image passes over the middle of each flat triangle of the perturbed surface."""
    nodes, local = np.unique(pieces, return_inverse=True)
    image = Surface(partners[nodes], local.reshape(-1, 3))
    middle = np.full((len(flat), 3), 1 / 3)
    centres = position(perturbed, *to_parent(perturbed, np.arange(len(flat)), middle))
    under, place = nearest(centres, image)
    there = position(image, under, place)
    back = position(perturbed, *nearest(there, perturbed))
    away = np.linalg.norm(there - centres, axis=1)
    off = np.linalg.norm(there - back, axis=1)
    rounding = _ROUNDING * np.linalg.norm(np.ptp(perturbed.points, axis=0))
    passed: Bools = away <= 2 * off + rounding
    return passed


def _lost_inside(base: Surface, found: Bools) -> int:
    """Lost nodes that hang together with no lost node on a rim."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    pieces = linear_triangles(base.triangles)
    links = np.concatenate([pieces[:, list(pair)] for pair in EDGES])
    links = links[~found[links].any(axis=1)]
    size = len(found)
    graph = coo_array((np.ones(len(links)), (links[:, 0], links[:, 1])), shape=(size, size))
    group = connected_components(graph, directed=False)[1]
    rim = rim_nodes(base.triangles)
    return int((~found & ~np.isin(group, group[rim[~found[rim]]])).sum())


def _part(areas: Floats, mask: Bools) -> float:
    total = float(areas.sum())
    return float(areas[mask].sum()) / total if total > 0 else 0.0


def _quantiles(values: Floats, weights: Floats, parts: tuple[float, ...]) -> Floats:
    """Smallest values that are not exceeded on the given parts of the weight; NaN for none."""
    if len(values) == 0:
        return np.full(len(parts), np.nan)
    order = np.argsort(values, kind="stable")
    reached = np.cumsum(weights[order])
    wanted = np.array(parts) * reached[-1] * (1 - 1e-12)
    rows = np.searchsorted(reached, wanted)
    found: Floats = values[order][np.minimum(rows, len(values) - 1)]
    return found


def _named(values: Floats, names: tuple[str, ...]) -> dict[str, float] | None:
    if np.isnan(values).any():
        return None
    return dict(zip(names, values.tolist(), strict=True))
