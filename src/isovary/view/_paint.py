"""What is drawn at each node or piece of surface, and in which colour."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import Colormap, ListedColormap, to_rgb

from .. import color
from ..comparison import Comparison
from ..difference import change_norm
from ..extrinsic import Kind
from ..geometry import Bools, Floats
from ..noise import SIGNIFICANCE
from ..records import Clusters, Surface
from ..row_distances import distances
from ._tessellate import at_pieces, nearest_nodes

NEUTRAL = to_rgb(color.NEUTRAL)
"""No significant change, no group."""

NO_PARTNER = to_rgb(color.UNKNOWN)
"""Nothing known: the node has no partner on the perturbed surface. Hatched with NO_PARTNER_2."""

NO_PARTNER_2 = to_rgb("#a0a0a0")

NORM_MAP = colormaps["viridis"]

MOVE_MAP = ListedColormap(colormaps["RdBu_r"](np.linspace(0.1, 0.9, 256)))
"""Without its darkest ends, on which lines could not be seen."""

KIND_COLORS = {
    Kind.UNKNOWN: NO_PARTNER,
    Kind.UNCHANGED: NEUTRAL,
    Kind.MOVED: to_rgb("#56b4e9"),
    Kind.BENT: to_rgb("#009e73"),
    Kind.STRETCHED: to_rgb("#f0e442"),
    Kind.NEW_SHAPE: to_rgb("#d55e00"),
}


@dataclass(frozen=True, eq=False)
class Samples:
    """What is known at k places of the base surface.

    Parameters
    ----------
    norm, noise : array (k,)
        Norm of the change and of its noise floor; NaN without a partner.
    margin, group_margin : array (k,)
        Positive where the change is significant; where the place has a group.
    scores : array (k, groups)
        The smallest tells the group.
    displacement : array (k,)
        Along the normal; length.
    known : array (k,)
        1 where the change is known, else 0.
    found : array (k,)
        1 where there is a partner, else 0.
    memberships : array (k, groups)
        How far the place belongs to each group; (k, 0) where groups are hard.
    """

    norm: Floats
    noise: Floats
    margin: Floats
    group_margin: Floats
    scores: Floats
    displacement: Floats
    known: Floats
    found: Floats
    memberships: Floats

    @property
    def moved(self) -> Samples:
        """The same for what is known wherever there is a partner, as the displacement is."""
        return replace(self, known=self.found)

    @property
    def groups(self) -> np.ndarray:
        """Group of each place, -1 for none."""
        if self.scores.shape[1] == 0:
            return np.full(len(self.norm), -1)
        best = np.nan_to_num(self.scores, nan=np.inf).argmin(axis=1)
        return np.where((self.group_margin > 0) & (self.known > 0), best, -1)


def node_samples(result: Comparison) -> Samples:
    """What is known at the nodes of the base."""
    match = result.correspondence
    return samples_of(
        result.change,
        result.noise_floor,
        result.clusters,
        significant=result.significant,
        found=match.found,
        distance=match.distance,
    )


def samples_of(
    change: Floats,
    noise_floor: Floats,
    clusters: Clusters,
    *,
    significant: Bools,
    found: Bools,
    distance: Floats,
    factor: float = SIGNIFICANCE,
) -> Samples:
    """What is known at n nodes.

    Parameters
    ----------
    change, noise_floor : array (n, T)
    clusters : Clusters
    significant : array (n,)
        Where the norm of the change exceeds ``factor`` times that of the noise floor.
    found : array (n,)
        Where there is a partner.
    distance : array (n,)
        Displacement along the normal.
    factor : float
    """
    norm, noise = change_norm(change), change_norm(noise_floor)
    excess = np.abs(np.nan_to_num(norm - factor * noise)) + np.finfo(float).tiny
    labels, shares = clusters.labels, clusters.memberships
    return Samples(
        norm=norm,
        noise=noise,
        margin=np.where(significant, excess, -excess),
        group_margin=np.where(labels >= 0, excess, -excess),
        scores=_scores(change, clusters),
        displacement=distance,
        known=(found & np.isfinite(norm)).astype(float),
        found=found.astype(float),
        memberships=np.empty((len(labels), 0)) if shares is None else shares,
    )


def piece_samples(result: Comparison, split: int) -> Samples:
    """The same at the middle of each piece; its nearest node tells what is known.

    Borders of significance and of groups run where interpolated values cross,
    so they are smooth and still agree with every node.
    """
    return spread(node_samples(result), result.base, split)


def spread(nodes: Samples, surface: Surface, split: int) -> Samples:
    """What is known at a surface's nodes, at the middle of each of its pieces."""
    inside = {f.name: at_pieces(surface, split, getattr(nodes, f.name)) for f in fields(Samples)}
    nearest = nearest_nodes(surface, split)
    inside |= {"known": nodes.known[nearest], "found": nodes.found[nearest]}
    return Samples(**inside)


def _scores(change: Floats, clusters: Clusters) -> Floats:
    """Distances of each node to the group centers, made to agree with the labels."""
    centers, labels = clusters.centers, clusters.labels
    if len(centers) == 0:
        return np.empty((len(labels), 0))
    scores: Floats = distances(change, centers) / change.shape[1]
    rows = np.flatnonzero((labels >= 0) & np.isfinite(scores).all(axis=1))
    nearest, own = scores[rows].argmin(axis=1), labels[rows]
    first, second = scores[rows, nearest], scores[rows, own]
    scores[rows, own], scores[rows, nearest] = first, np.where(own == nearest, first, second)
    return scores


def paint_norm(samples: Samples, limit: float) -> Floats:
    """Change norm from 0 to ``limit``; neutral where it is not significant (k, 3)."""
    colors = mapped(NORM_MAP, samples.norm / (limit or 1.0))
    colors[~(samples.margin > 0)] = NEUTRAL
    return _unknown(colors, samples)


def paint_noise(samples: Samples, limit: float) -> Floats:
    """Norm of the noise floor on the change's own scale (k, 3)."""
    return _unknown(mapped(NORM_MAP, samples.noise / (limit or 1.0)), samples)


def paint_displacement(samples: Samples, limit: float) -> Floats:
    """Displacement along the normal, from -limit to limit; all neutral if the limit is 0 (k, 3)."""
    if limit == 0:
        colors = np.tile(NEUTRAL, (len(samples.norm), 1))
    else:
        colors = mapped(MOVE_MAP, 0.5 + samples.displacement / (2 * limit))
    return _unknown(colors, samples.moved)


def paint_groups(samples: Samples, colors: Floats | None = None) -> Floats:
    """Each group in its colour, mixed by memberships; neutral where there is none (k, 3)."""
    own = color.group_colors(samples.scores.shape[1]) if colors is None else colors
    palette = np.vstack([own, NEUTRAL])
    painted = palette[samples.groups]
    if samples.memberships.shape[1]:
        some = (samples.groups >= 0) & np.isfinite(samples.memberships).all(axis=1)
        painted[some] = blended(palette[:-1], samples.memberships[some])
    return _unknown(painted, samples)


def blended(palette: Floats, shares: Floats) -> Floats:
    """Colours (k, 3) mixed of a palette (g, 3) by shares (k, g), evenly to the eye: in OKLab."""
    parts = np.clip(shares, 0.0, None)
    lab = parts @ color.srgb_to_oklab(palette) / parts.sum(axis=1, keepdims=True)
    return np.clip(color.oklab_to_srgb(lab), 0.0, 1.0)


def paint_strain(result: Comparison) -> Floats:
    """Largest change of a length at each node, from 0 to :func:`strain_limit` (n, 3)."""
    colors = mapped(NORM_MAP, result.strain / (strain_limit(result) or 1.0))
    colors[np.isnan(result.strain)] = NO_PARTNER
    return colors


def paint_kinds(result: Comparison) -> Floats:
    """Each kind of change in its colour (n, 3)."""
    return np.array([KIND_COLORS[kind] for kind in Kind])[result.kinds - Kind.UNKNOWN]


def hatched(colors: Floats, samples: Samples, places: Floats) -> Floats:
    """The colours (k, 3) with stripes in space over the places (k, 3) without a partner."""
    width = 0.03 * float(np.ptp(places, axis=0).max())
    odd = np.floor(places.sum(axis=1) / width) % 2 == 1
    return np.where(((samples.known == 0) & odd)[:, None], NO_PARTNER_2, colors)


def norm_limit(result: Comparison) -> float:
    """Upper end of the colour scale: the largest significant norm, 0 if there is none."""
    shown = result.change_norm[result.significant]
    return float(np.nanmax(shown)) if len(shown) else 0.0


def strain_limit(result: Comparison) -> float:
    """Upper end of the strain's colour scale: its largest, 0 if it is unknown."""
    known = result.strain[np.isfinite(result.strain)]
    return float(known.max()) if len(known) else 0.0


def move_limit(result: Comparison) -> float:
    """End of the displacement's scale: its largest size, 0 if nothing moved."""
    known = result.correspondence.distance[result.correspondence.found]
    limit = float(np.abs(known).max()) if len(known) else 0.0
    size = float(np.ptp(result.base.points, axis=0).max())
    return limit if limit > 1e-12 * size else 0.0


def mapped(colors: Colormap, values: Floats) -> Floats:
    """Colours (k, 3) of values from 0 to 1."""
    return np.asarray(colors(np.clip(np.nan_to_num(values), 0.0, 1.0)))[:, :3]


def _unknown(colors: Floats, samples: Samples) -> Floats:
    colors[samples.known == 0] = NO_PARTNER
    return colors
