"""The report's legends, one for each thing that the colours can show."""

from __future__ import annotations

from html import escape

import numpy as np
from matplotlib.colors import Colormap, to_hex

from ..color import group_colors
from ..comparison import Comparison
from ..extrinsic import Kind
from . import _paint as paint
from ._panels import View
from ._report_data import modes, noise_limit, rim_limit, scale_limit, slider_columns
from ._report_tables import swatch
from ._words import percent, unknown


def legends(view: View) -> str:
    """The legend of each mode."""
    result = view.result
    limit, moved = paint.norm_limit(result), paint.move_limit(result)
    noise, scale = noise_limit(result), scale_limit(result)
    stretch = paint.strain_limit(result)
    steps = len(slider_columns(result)) - 1
    slider = (
        f'<p><label>Scale <input id="scale" type="range" min="0" max="{steps}" '
        f'value="{steps // 2}"></label><br><span id="scale-words"></span></p>'
    )
    grey = swatch(to_hex(paint.NEUTRAL), "less than twice the noise floor")
    lost = (
        swatch(to_hex(paint.NO_PARTNER), unknown(result)) if np.isnan(result.change).any() else ""
    )
    keys = {
        "change": _bar(paint.NORM_MAP, "0 %", percent(limit), "mean of |change|", limit)
        + _patches(grey, lost),
        "scale": slider
        + _bar(paint.MOVE_MAP, f"−{percent(scale)}", percent(scale), "base − perturbed", scale)
        + _patches(grey, lost),
        "groups": _patches(*_group_patches(result), lost),
        "displacement": _bar(
            paint.MOVE_MAP, f"{-moved:.3g}", f"{moved:.3g}", "along the normal (length)", moved
        )
        + _patches(lost),
        "strain": _bar(
            paint.NORM_MAP, "0 %", percent(stretch), "largest change of a length", stretch
        )
        + _patches(lost),
        "kinds": _patches(*_kind_patches(result)),
        "likeness": "<div>The more alike two colours, the more alike the changes at all scales: "
        "three axes of a multidimensional scaling.</div>" + _patches(grey, lost),
        "rim": _bar(
            paint.NORM_MAP,
            "0",
            f"{rim_limit(result):.3g}",
            "distance to the rim: it shows at diffusion radii above that",
            rim_limit(result),
        ),
        "noise": _bar(paint.NORM_MAP, "0 %", percent(noise), "mean numerical error", noise)
        + _patches(lost),
    }
    return "".join(f'<div data-mode="{mode}">{keys[mode]}</div>' for mode in modes(result))


def _bar(colors: Colormap, low: str, high: str, label: str, limit: float) -> str:
    if limit == 0:
        return f"<div>{escape(label)}: 0 everywhere</div>"
    stops = ", ".join(to_hex(colors(k / 16)) for k in range(17))
    return (
        f'<div class="bar" style="background: linear-gradient(to right, {stops})"></div>'
        f'<div class="ends"><span>{low}</span><span>{escape(label)}</span><span>{high}</span></div>'
    )


def _patches(*patches: str) -> str:
    return f'<div class="patches">{"".join(patches)}</div>'


def _group_patches(result: Comparison) -> list[str]:
    colors = group_colors(len(result.clusters.centers))
    patches = []
    for group in sorted(result.group_table, key=lambda group: group.number):
        words = (
            f"group {group.number}: {percent(group.area_share)} of the area, "
            f"mean {percent(group.mean_change)}"
        )
        patches.append(
            f'<button type="button" class="group" data-group="{group.number}" aria-pressed="true">'
            + swatch(to_hex(colors[group.number]), words)
            + "</button>"
        )
    return [*patches, swatch(to_hex(paint.NEUTRAL), "no group")]


def _kind_patches(result: Comparison) -> list[str]:
    shares = result.kind_shares
    return [
        swatch(to_hex(paint.KIND_COLORS[kind]), f"{kind.words}: {percent(shares[kind.words])}")
        for kind in Kind
        if shares[kind.words] > 0
    ]
