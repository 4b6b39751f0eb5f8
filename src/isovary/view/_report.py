"""The report: one HTML file that opens without a network and whose surface can be turned."""

from __future__ import annotations

import json
import os
import re
from base64 import b64encode
from html import escape
from importlib.metadata import version
from importlib.resources import files
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import Colormap, to_hex
from matplotlib.figure import Figure
from plotly.offline import get_plotlyjs

from ..color import group_colors
from ..comparison import Comparison
from ..extrinsic import Kind
from . import _paint as paint
from ._details import details
from ._overview import overview, prepare
from ._panels import View
from ._report_data import (
    column_words,
    mode_colors,
    node_curves,
    node_values,
    noise_limit,
    scale_bytes,
    scale_limit,
    slider_columns,
)
from ._report_plots import curves_figure, heat_figure, surface_figure
from ._tessellate import outside
from ._words import answer, facts, group_shares, percent, place, title, unknown, verdict

_DPI = 110  # of the pictures: the page is not wider
_MODES = {
    "change": "Mean change",
    "scale": "Change at one scale",
    "groups": "Groups",
    "displacement": "Displacement",
    "strain": "Strain",
    "kinds": "Kind of change",
    "noise": "Noise floor",
}


def write_report(
    result: Comparison,
    path: str | os.PathLike[str],
    *,
    pictures: tuple[Figure, Figure] | None = None,
) -> None:
    """Write one HTML file with the verdict, the surface to turn, the curves and every choice.

    The file holds all it needs, plotly's script included (5 MB), and forbids
    the browser to load anything else.

    Parameters
    ----------
    result : Comparison
    path : path
        The file; its folder exists.
    pictures : tuple of matplotlib.figure.Figure, optional
        The comparison's overview and details if they were drawn already; by default they are.

    Notes
    -----
    Cost: 1 s besides the picture; 7 MB for 4 000 nodes.
    """
    view = prepare(result)
    words = verdict(result, view.half_share)
    drawn = pictures or (overview(result), details(result))
    parts = {
        "title": escape(f"isovary: {title(result)}"),
        "verdict": escape(words),
        "subtitle": escape(f"Isosurface {title(result)}, base against perturbed."),
        "answer": escape(answer(result, view.significant_share)),
        "notes": _notes(result),
        "buttons": "".join(
            f'<button type="button" data-mode="{mode}" aria-pressed="false">{name}</button>'
            for mode, name in _MODES.items()
        ),
        "keys": _keys(view),
        "curves_where": "Medians over the nodes"
        if view.peak is None
        else f"At the point that changed most (node {view.peak})",
        "curves_words": escape(_curves_words(view)),
        "last": str(len(result.base.points) - 1),
        "marked": "" if view.peak is None else str(view.peak),
        "groups": _group_rows(view),
        "picture": _png(drawn[0]),
        "details": _png(drawn[1]),
        "tables": _tables(result),
        "version": escape(version("isovary")),
        "plotly": get_plotlyjs(),
        "data": _data(view),
    }
    page = files(__package__).joinpath("_report.html").read_text(encoding="utf-8")
    page = re.sub(r"\{\{(\w+)\}\}", lambda match: parts[match[1]], page)
    Path(path).write_text(page, encoding="utf-8")


def _data(view: View) -> str:
    """What the page's script needs, as JSON that cannot end the script element."""
    result = view.result
    data: dict[str, Any] = {
        "surface": json.loads(surface_figure(result, view.camera, view.peak).to_json()),
        "curves": json.loads(curves_figure(result, view.peak).to_json()),
        "heat": json.loads(heat_figure(result).to_json()),
        "colors": mode_colors(result),
        "scales": scale_bytes(result),
        "nodes": node_values(result),
        "node_curves": node_curves(result),
        "facing": 1 if outside(result.base) > 0 else -1,
        "unknown": unknown(result),
    }
    text = json.dumps(data, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c")


def _png(figure: Figure) -> str:
    buffer = BytesIO()
    figure.savefig(buffer, format="png", dpi=_DPI)
    return b64encode(buffer.getvalue()).decode("ascii")


def _notes(result: Comparison) -> str:
    if not result.notes:
        return ""
    return '<ul class="notes">' + "".join(f"<li>{escape(n)}</li>" for n in result.notes) + "</ul>"


def _curves_words(view: View) -> str:
    if view.peak is None:
        return ": the two signatures agree everywhere."
    kind = view.result.methods.kind
    times = (
        "Small times see details, large ones the whole: heat spreads over the diffusion radius "
        "2√t. "
    )
    return (
        ", with the median of each group. "
        + (times if kind.per_time else "")
        + f"The change is the base's {kind.title} minus the perturbed one's, in percent of the "
        "base's mean."
    )


def _keys(view: View) -> str:
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
    grey = _patch(to_hex(paint.NEUTRAL), "less than twice the noise floor")
    lost = (
        _patch(to_hex(paint.NO_PARTNER), unknown(result)) if np.isnan(result.change).any() else ""
    )
    keys = {
        "change": _bar(paint.NORM_MAP, "0 %", percent(limit), "mean of |change|", limit)
        + _patches(grey, lost),
        "scale": slider
        + _bar(paint.MOVE_MAP, f"−{percent(scale)}", percent(scale), "base − perturbed", scale)
        + _patches(grey, lost),
        "groups": _patches(*_group_patches(view), lost),
        "displacement": _bar(
            paint.MOVE_MAP, f"{-moved:.3g}", f"{moved:.3g}", "along the normal (length)", moved
        )
        + _patches(lost),
        "strain": _bar(
            paint.NORM_MAP, "0 %", percent(stretch), "largest change of a length", stretch
        )
        + _patches(lost),
        "kinds": _patches(*_kind_patches(result)),
        "noise": _bar(paint.NORM_MAP, "0 %", percent(noise), "mean numerical error", noise)
        + _patches(lost),
    }
    return "".join(f'<div data-mode="{mode}">{keys[mode]}</div>' for mode in _MODES)


def _bar(colors: Colormap, low: str, high: str, label: str, limit: float) -> str:
    if limit == 0:
        return f"<div>{escape(label)}: 0 everywhere</div>"
    stops = ", ".join(to_hex(colors(k / 16)) for k in range(17))
    return (
        f'<div class="bar" style="background: linear-gradient(to right, {stops})"></div>'
        f'<div class="ends"><span>{low}</span><span>{escape(label)}</span><span>{high}</span></div>'
    )


def _patch(color: str, words: str) -> str:
    return f'<span><span class="swatch" style="background: {color}"></span>{escape(words)}</span>'


def _patches(*patches: str) -> str:
    return f'<div class="patches">{"".join(patches)}</div>'


def _group_patches(view: View) -> list[str]:
    count, samples = len(view.result.clusters.centers), view.samples
    shares = group_shares(samples.groups, view.pieces.areas, samples.norm, count)
    colors = group_colors(count)
    patches = [
        f'<button type="button" class="group" data-group="{k}" aria-pressed="true">'
        + _patch(to_hex(color), f"group {k}: {percent(share)} of the area, mean {percent(mean)}")
        + "</button>"
        for k, (color, (share, mean)) in enumerate(zip(colors, shares, strict=True))
    ]
    return [*patches, _patch(to_hex(paint.NEUTRAL), "no group")]


def _group_rows(view: View) -> str:
    """The table of the groups, the most changed first."""
    result = view.result
    if not result.group_table:
        return "<p>No group: no node changed significantly.</p>"
    colors = group_colors(len(result.clusters.centers))
    names = ("group", "part of the area", "mean change", "median change where it stands out", "at")
    head = "".join(f'<th scope="col">{name}</th>' for name in (*names, "changed most near"))
    rows = ""
    for group in sorted(result.group_table, key=lambda group: group.rank):
        cells = (
            percent(group.area_share),
            percent(group.mean_change),
            f"{100 * group.change:+.2g} %",
            column_words(result, float(result.columns[group.column])),
            place(result, group.place),
        )
        name = _patch(to_hex(colors[group.number]), str(group.number))
        rows += f'<tr><th scope="row">{name}</th>'
        rows += "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>"
    return f'<table class="groups"><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>'


def _kind_patches(result: Comparison) -> list[str]:
    shares = result.kind_shares
    return [
        _patch(to_hex(paint.KIND_COLORS[kind]), f"{kind.words}: {percent(shares[kind.words])}")
        for kind in Kind
        if shares[kind.words] > 0
    ]


def _tables(result: Comparison) -> str:
    counts = "".join(_row(name, value) for name, value in facts(result).items())
    choices = "".join(_row(name, _said(value)) for name, value in result.choices.items())
    seconds = dict(result.timings) | {"together": sum(result.timings.values())}
    timings = "".join(_row(name, f"{value:.2f} s", "number") for name, value in seconds.items())
    parts = {"Counts": counts, "Mesh": _mesh_rows(result), "Choices": choices, "Time": timings}
    return "".join(
        f"<div><h3>{name}</h3><table><tbody>{rows}</tbody></table></div>"
        for name, rows in parts.items()
    )


def _mesh_rows(result: Comparison) -> str:
    """How good the two meshes are."""
    rows = ""
    for name, quality in (("base", result.base_quality), ("perturbed", result.perturbed_quality)):
        q, angles = quality.quality, quality.angles
        said = (
            f"quality {q.mean():.3f} in the mean, {q.min():.2g} the worst; angles "
            f"{angles.min():.0f} to {angles.max():.0f} degrees; "
        )
        rows += _row(name, said + ("clean" if quality.clean else "; ".join(quality.faults)))
    return rows


def _row(name: str, value: str, kind: str = "") -> str:
    words = name.replace("_", " ")
    return f'<tr><th scope="row">{escape(words)}</th><td class="{kind}">{escape(value)}</td></tr>'


def _said(value: object) -> str:
    """A choice as text: digests short, numbers to four digits."""
    if isinstance(value, dict):
        return ", ".join(f"{name} {_said(part)}" for name, part in value.items())
    if isinstance(value, list | tuple):
        return " × ".join(_said(part) for part in value)
    if isinstance(value, float):
        return f"{value:.4g}"
    text = str(value)
    return text[:12] + "…" if re.fullmatch(r"[0-9a-f]{64}", text) else text
