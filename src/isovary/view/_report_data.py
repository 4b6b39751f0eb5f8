"""What the report's page knows of each node: colours, values and curves, in few bytes."""

from __future__ import annotations

from base64 import b64encode
from typing import Any

import numpy as np
from matplotlib.colors import to_hex

from ..comparison import Comparison
from ..geometry import Floats
from ..signature import diffusion_radius
from . import _paint as paint

_UNKNOWN, _NEUTRAL, _LOWEST, _HIGHEST = 0, 1, 2, 254
_SLIDER, _CURVE = 50, 20  # columns at most
_STEPS = 65_534  # from the smallest to the largest value; one more for unknown


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
    return {mode: _text(np.round(255 * rgb).astype(np.uint8)) for mode, rgb in painted.items()}


def noise_limit(result: Comparison) -> float:
    """Upper end of the noise mode's colour scale."""
    noise = paint.node_samples(result).noise
    return float(np.nanmax(noise)) if np.isfinite(noise).any() else 0.0


def scale_limit(result: Comparison) -> float:
    """Largest significant change at any time."""
    clear = np.abs(result.change) > result.noise_floor
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
    code[~(np.abs(change) > result.noise_floor[:, columns])] = _NEUTRAL
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
