"""The report: one HTML file that opens without a network and whose surface can be turned."""

from __future__ import annotations

import json
import os
import re
from base64 import b64encode
from collections.abc import Mapping, Sequence
from html import escape
from importlib.metadata import version
from importlib.resources import files as package_files
from io import BytesIO
from pathlib import Path, PurePath
from typing import Any, cast

from matplotlib.figure import Figure
from plotly.offline import get_plotlyjs

from ..comparison import Comparison
from ._both import both
from ._details import details
from ._overview import overview, prepare
from ._panels import View
from ._report_data import (
    border_pieces,
    mode_colors,
    modes,
    node_curves,
    node_values,
    other_surface,
    scale_bytes,
)
from ._report_keys import legends
from ._report_plots import curves_figure, heat_figure, surface_figure
from ._report_tables import group_rows, repeat, tables
from ._tessellate import outside
from ._words import answer, title, unknown, verdict

_PICTURES = (
    "Base and perturbed surface, side by side and in one place",
    "The opposite side, strain, histogram, groups by scale, eigenvalues",
)
_DPI = 100  # of the pictures: the page is not wider


def write_report(
    result: Comparison,
    path: str | os.PathLike[str],
    *,
    pictures: Sequence[Figure] | None = None,
) -> None:
    """Write one HTML file with the verdict, the surface to turn, the curves and every choice.

    The file holds all it needs, plotly's script included (5 MB), and forbids
    the browser to load anything else.

    Parameters
    ----------
    result : Comparison
    path : path
        The file; its folder exists.
    pictures : sequence of matplotlib.figure.Figure, optional
        Overview, both surfaces and details if they were drawn already; by default they are.

    Notes
    -----
    Cost: 1 s besides the picture; 7 MB for 4 000 nodes.
    """
    view = prepare(result)
    drawn = pictures or (overview(result), both(result), details(result))
    words = (verdict(result, view.half_share), *_PICTURES)
    parts = {
        "title": escape(f"isovary: {title(result)}"),
        "verdict": escape(words[0]),
        "subtitle": escape(f"Isosurface {title(result)}, {_sources(result)}."),
        "answer": _answer(view),
        "notes": _notes(result),
        "buttons": "".join(
            f'<button type="button" data-mode="{mode}" aria-pressed="false">{name}</button>'
            for mode, name in modes(result).items()
        ),
        "keys": legends(view),
        "curves_where": "Medians over the nodes"
        if view.peak is None
        else f"At the point that changed most (node {view.peak})",
        "curves_words": escape(_curves_words(view)),
        "last": str(len(result.base.points) - 1),
        "marked": "" if view.peak is None else str(view.peak),
        "groups": group_rows(result),
        "pictures": "".join(_picture(*both) for both in zip(drawn, words, strict=True)),
        "repeat": repeat(result),
        "tables": tables(result),
        "version": escape(version("isovary")),
        "plotly": get_plotlyjs(),
        "data": _data(view),
    }
    page = package_files(__package__).joinpath("_report.html").read_text(encoding="utf-8")
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
        "pieces": border_pieces(result),
        "other": other_surface(result),
    }
    text = json.dumps(data, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c")


def _answer(view: View) -> str:
    words = answer(view.result, view.significant_share)
    return f'<p id="answer">{escape(words)}</p>' if words else ""


def _picture(figure: Figure, words: str) -> str:
    buffer = BytesIO()
    figure.savefig(buffer, format="png", dpi=_DPI)
    data = b64encode(buffer.getvalue()).decode("ascii")
    return f'<figure><img alt="{escape(words)}" src="data:image/png;base64,{data}"></figure>'


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


def _sources(result: Comparison) -> str:
    """What is compared with what, by the files' names if they are known."""
    files = cast(Sequence[Mapping[str, str]], result.choices.get("files", ()))
    if not files:
        return "base against perturbed"
    first, last = (PurePath(files[k]["path"]).name for k in (0, -1))
    if first == last:
        first, last = (f"{first} {files[k]['array']}" for k in (0, -1))
    return f"base {first} against perturbed {last}"
