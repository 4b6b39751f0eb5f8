"""What the report's page knows of each node: colours, values and curves, in few bytes."""

from __future__ import annotations

from base64 import b64encode
from typing import Any

import numpy as np
from matplotlib.colors import to_hex

from ..color import embedding_colors, group_colors
from ..comparison import Comparison
from ..embedding import classical_mds
from ..geometry import EDGES, Floats, Ints, linear_triangles
from ..noise import SIGNIFICANCE
from ..records import Surface
from ..signature import diffusion_radius
from . import _paint as paint
from ._borders import group_pieces, no_pieces, node_labels
from ._both import is_carried, partner_nodes, reach

_UNKNOWN, _NEUTRAL, _LOWEST, _HIGHEST = 0, 1, 2, 254
_SLIDER, _CURVE = 40, 20  # columns at most
_STEPS = 65_534  # from the smallest to the largest value; one more for unknown


def modes(result: Comparison) -> dict[str, str]:
    """What the colours can show, and the words of its button."""
    shown = {
        "change": "Mean change",
        "scale": "Change at one scale",
        "groups": "Groups",
        "likeness": "Likeness",
        "displacement": "Displacement",
        "strain": "Strain",
        "kinds": "Kind of change",
        "rim": "Rim",
        "noise": "Noise floor",
    }
    if not result.significant.any():
        del shown["likeness"]
    if not result.topology.boundary_loops:
        del shown["rim"]
    return shown


def mode_colors(result: Comparison) -> dict[str, str]:
    """A colour for each node in each of the page's modes: three bytes a node."""
    samples = paint.node_samples(result)
    limit, moved = paint.norm_limit(result), paint.move_limit(result)
    painted = {
        "change": paint.paint_norm(samples, limit),
        "groups": paint.paint_groups(samples),
        "displacement": paint.paint_displacement(samples, moved),
        "strain": paint.paint_strain(result),
        "kinds": paint.paint_kinds(result),
        "noise": paint.paint_noise(samples, noise_limit(result)),
    }
    if result.significant.any():
        painted["likeness"] = paint_likeness(result)
    if result.topology.boundary_loops:
        painted["rim"] = paint.mapped(paint.NORM_MAP, result.rim_distance / rim_limit(result))
    return {mode: _text(np.round(255 * rgb).astype(np.uint8)) for mode, rgb in painted.items()}


def paint_likeness(result: Comparison) -> Floats:
    """Colours (n, 3) of the significant nodes as far apart as their changes; grey elsewhere."""
    colors = np.tile(paint.NEUTRAL, (len(result.change), 1))
    colors[paint.node_samples(result).known == 0] = paint.NO_PARTNER
    shown = result.significant
    colors[shown] = embedding_colors(classical_mds(result.change[shown]))
    return colors


def rim_limit(result: Comparison) -> float:
    """Largest finite distance to a rim; 0 without one."""
    distance = result.rim_distance
    return float(distance[np.isfinite(distance)].max(initial=0.0))


def border_pieces(result: Comparison) -> dict[str, Any]:
    """The triangles cut by the groups' borders, and a colour for each label.

    Nothing to cut where groups fade into each other by memberships.
    """
    soft, samples = result.clusters.memberships is not None, paint.node_samples(result)
    pieces = no_pieces() if soft else group_pieces(result.base, samples)
    colors = [*group_colors(len(result.clusters.centers)), paint.NO_PARTNER, paint.NEUTRAL]
    return {
        "soft": soft,
        "corners": _text(pieces.corners.astype("<i4")),
        "weights": _text(pieces.weights.astype("<f4")),
        "triangles": _text(pieces.triangles.astype("<i4")),
        "labels": pieces.labels.tolist(),
        "node_labels": node_labels(samples).tolist(),
        "colors": [to_hex(color) for color in colors],  # [-1] no group, [-2] unknown
    }


def other_surface(result: Comparison) -> dict[str, Any]:
    """The perturbed surface, aligned: its nodes, edges, triangles and nearest nodes of the base.

    The latter two are None for a mesh that was carried whole: they are the base's. A node far
    from all partners has -1.
    """
    surface = result.perturbed
    near, away = partner_nodes(result, 1)
    nodes = np.where(away < reach(result), near, -1).ravel()
    same = np.array_equal(surface.triangles, result.base.triangles) and is_carried(result)
    flat = None if same else _text(linear_triangles(surface.triangles).astype("<i4"))
    return {
        "points": _text(surface.points.astype("<f4")),
        "nodes": None if same else nodes.tolist(),
        "edges": _text(edge_nodes(surface).astype("<i4")),
        "along": surface.order + 1,  # nodes of an edge
        "triangles": flat,
    }


def edge_nodes(surface: Surface) -> Ints:
    """Nodes (e, 2) or (e, 3) along each edge of a mesh, each edge once."""
    sides = np.concatenate([surface.corners[:, list(edge)] for edge in EDGES])
    first = np.unique(np.sort(sides, axis=1), axis=0, return_index=True)[1]
    nodes: Ints = sides[first]
    if surface.order == 2:
        middles = surface.triangles[:, 3:].T.ravel()[first]
        nodes = np.column_stack([nodes[:, 0], middles, nodes[:, 1]])
    return nodes


def noise_limit(result: Comparison) -> float:
    """Upper end of the noise mode's colour scale."""
    noise = paint.node_samples(result).noise
    return float(np.nanmax(noise)) if np.isfinite(noise).any() else 0.0


def scale_limit(result: Comparison) -> float:
    """Largest significant change at any time."""
    clear = np.abs(result.change) > SIGNIFICANCE * result.noise_floor
    return float(np.abs(result.change[clear]).max()) if clear.any() else 0.0


def slider_columns(result: Comparison) -> np.ndarray:
    """The columns that the page's slider stops at."""
    return _some(len(result.columns), _SLIDER)


def scale_bytes(result: Comparison) -> dict[str, Any]:
    """The change of each node at some times as a byte, and the colour of each byte.

    0: no partner; 1: below twice the noise floor; 2 to 254: from -limit to limit.
    """
    limit = scale_limit(result) or 1.0
    columns = slider_columns(result)
    change = result.change[:, columns]
    share = np.clip(np.nan_to_num(change) / limit, -1, 1)
    middle, half = (_LOWEST + _HIGHEST) / 2, (_HIGHEST - _LOWEST) / 2
    code = np.round(middle + half * share).astype(np.uint8)
    code[~(np.abs(change) > SIGNIFICANCE * result.noise_floor[:, columns])] = _NEUTRAL
    code[np.isnan(change)] = _UNKNOWN
    colors = paint.mapped(paint.MOVE_MAP, (np.arange(256) - _LOWEST) / (2 * half))
    colors[_UNKNOWN], colors[_NEUTRAL] = paint.NO_PARTNER, paint.NEUTRAL
    return {
        "words": [column_words(result, float(result.columns[k])) for k in columns],
        "bytes": _text(code.T),
        "palette": [to_hex(color) for color in colors],
    }


def column_words(result: Comparison, column: float) -> str:
    """Where on its axis a column of the signature stands."""
    if not result.methods.kind.per_time:
        return f"{result.methods.kind.axis}: {column:.3g}"
    radius = float(diffusion_radius(column))
    return f"diffusion radius {radius:.3g} (time {column:.3g} length²)"


def node_values(result: Comparison) -> dict[str, Any]:
    """What the page tells of a node that is pointed at."""
    samples = paint.node_samples(result)
    return {
        "norm": packed(100 * samples.norm[:, None]),
        "noise": packed(100 * samples.noise[:, None]),
        "moved": packed(samples.displacement[:, None]),
        "strain": packed(100 * result.strain[:, None]),
        "group": samples.groups.tolist(),
    }


def node_curves(result: Comparison) -> dict[str, Any]:
    """Both signatures, the change and its noise floor of each node, at some of the columns."""
    columns = _some(len(result.columns), _CURVE)
    return {
        "columns": [float(f"{value:.6g}") for value in result.columns[columns]],
        "base": packed(result.base_signature[:, columns]),
        "perturbed": packed(result.perturbed_signature[:, columns]),
        "change": packed(100 * result.change[:, columns]),
        "noise": packed(100 * result.noise_floor[:, columns]),
    }


def packed(values: Floats) -> dict[str, Any]:
    """Values (n, C) as two bytes each, between the smallest and the largest of their column.

    Value = low + step * code; code 65535 is unknown. The error is at most a 130 000th of the
    column's range.
    """
    known = np.isfinite(values)
    low = np.min(values, axis=0, where=known, initial=np.inf)
    high = np.max(values, axis=0, where=known, initial=-np.inf)
    some = known.any(axis=0)
    low, high = np.where(some, low, 0.0), np.where(some, high, 0.0)
    step = (high - low) / _STEPS
    code = np.round((np.where(known, values, low) - low) / np.where(step > 0, step, 1.0))
    code[~known] = _STEPS + 1
    return {"low": low.tolist(), "step": step.tolist(), "codes": _text(code.astype("<u2"))}


def _some(count: int, most: int) -> np.ndarray:
    """At most so many of a number of columns, evenly, the first and the last among them."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(int))


def _text(codes: np.ndarray) -> str:
    return b64encode(np.ascontiguousarray(codes).tobytes()).decode("ascii")
