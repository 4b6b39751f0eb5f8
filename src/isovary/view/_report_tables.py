"""The report's tables: groups, and how the result was made, enough to judge and to repeat it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from importlib.metadata import version
from typing import Any, cast

import numpy as np
from matplotlib.colors import to_hex

from ..color import group_colors
from ..comparison import Comparison
from ._report_data import column_words
from ._words import facts, percent, place

_FIELDS = ("base", "perturbed", "through")
_ELSEWHERE = {"command", "files", "interpolation_errors_at_half_resolution", *_FIELDS}
_NOISE = "noise_of_the_"


def group_rows(result: Comparison) -> str:
    """The table of the groups, the most changed first."""
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
        name = swatch(to_hex(colors[group.number]), str(group.number))
        rows += f'<tr><th scope="row">{name}</th>'
        rows += "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>"
    return f'<table class="groups"><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>'


def swatch(color: str, words: str) -> str:
    """A patch of colour and what it means."""
    return f'<span><span class="swatch" style="background: {color}"></span>{escape(words)}</span>'


def repeat(result: Comparison) -> str:
    """The command that makes the result again and the files that it read; empty without."""
    command = result.choices.get("command")
    if command is None:
        return ""
    files = cast(Sequence[Mapping[str, str]], result.choices["files"])
    head = "".join(f'<th scope="col">{name}</th>' for name in ("file", "array", "sha256"))
    rows = "".join(
        "<tr>"
        + "".join(f"<td>{escape(file[key])}</td>" for key in ("path", "array", "sha256"))
        + "</tr>"
        for file in files
    )
    return (
        f"<h3>To repeat it, with isovary {escape(version('isovary'))}</h3>"
        f"<pre>{escape(str(command))}</pre>"
        f'<table class="files"><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>'
    )


def tables(result: Comparison) -> str:
    """Counts, noise, correspondence, meshes, fields, choices and times, each a table."""
    seconds = dict(result.timings) | {"together": sum(result.timings.values())}
    choices = {
        name: said(value)
        for name, value in result.choices.items()
        if name not in _ELSEWHERE and not name.startswith(_NOISE)
    }
    parts: dict[str, Iterable[tuple[str, str]]] = {
        "Result": facts(result).items(),
        "Noise floor": _noise(result),
        "Correspondence": _correspondence(result),
        "Components": _components(result),
        "Meshes": _meshes(result),
        "Fields": _fields(result),
        "Choices": choices.items(),
        "Time": ((name, f"{value:.2f} s") for name, value in seconds.items()),
    }
    return "".join(
        f"<div><h3>{name}</h3><table><tbody>"
        + "".join(_row(*row) for row in rows)
        + "</tbody></table></div>"
        for name, rows in parts.items()
    )


def _noise(result: Comparison) -> list[tuple[str, str]]:
    """What the floor is made of, each relative to the change."""
    parts = {
        name.removeprefix(_NOISE): cast(float, value)
        for name, value in result.choices.items()
        if name.startswith(_NOISE)
    }
    known = result.strain_floor[np.isfinite(result.strain_floor)]
    return [
        ("all together", f"{percent(result.relative_noise)} of the change (rms)"),
        *((f"of the {name}", _part(value)) for name, value in parts.items()),
        ("nodes above twice the floor", percent(float(result.significant.mean()))),
        ("floor of the strain", percent(float(np.median(known))) if len(known) else "unknown"),
    ]


def _part(value: float) -> str:
    return "unknown" if np.isnan(value) else f"{percent(value)} of the change"


def _correspondence(result: Comparison) -> list[tuple[str, str]]:
    """The audit: what the map covers, folds and stretches."""
    found = result.audit
    rows = [
        ("nodes without a partner", f"{found.lost} of {found.nodes}"),
        ("of the base covered", percent(found.base_coverage)),
        ("of the perturbed covered", percent(found.perturbed_coverage)),
        ("folded", percent(found.folded)),
        ("with several partners to choose from", percent(found.several)),
    ]
    if np.isfinite(found.area_ratios).any():
        low, high = found.area_ratios[[1, 3]]
        rows.append(("area of a triangle after / before", f"{low:.4g} to {high:.4g} (5 to 95 %)"))
    rows.append(("faults", "; ".join(found.faults) or "none"))
    return rows


def _components(result: Comparison) -> list[tuple[str, str]]:
    """What became of each component."""
    return [(str(k), str(match)) for k, match in enumerate(result.components)]


def _meshes(result: Comparison) -> list[tuple[str, str]]:
    """How good the two meshes are."""
    rows = []
    for name, quality in (("base", result.base_quality), ("perturbed", result.perturbed_quality)):
        q, angles = quality.quality, quality.angles
        words = (
            f"quality {q.mean():.3f} in the mean, {q.min():.2g} the worst; angles "
            f"{angles.min():.0f} to {angles.max():.0f} degrees; "
        )
        rows.append((name, words + ("clean" if quality.clean else "; ".join(quality.faults))))
    return rows


def _fields(result: Comparison) -> list[tuple[str, str]]:
    """Grid and digest of each field's samples."""
    choices = result.choices
    members = cast(Sequence[Any], choices.get("through", ()))
    named = [("base", choices["base"])]
    named += [(f"member {k}", member) for k, member in enumerate(members, start=1)]
    named.append(("perturbed", choices["perturbed"]))
    return [(name, said(value)) for name, value in named]


def _row(name: str, value: str) -> str:
    words = name.replace("_", " ")
    return f'<tr><th scope="row">{escape(words)}</th><td>{escape(value)}</td></tr>'


def said(value: object) -> str:
    """A choice as text: numbers to four digits, digests short."""
    if isinstance(value, dict):
        return ", ".join(f"{name.replace('_', ' ')} {said(part)}" for name, part in value.items())
    if isinstance(value, list | tuple):
        return " × ".join(said(part) for part in value)
    if isinstance(value, float):
        return f"{value:.4g}" if value == value else "unknown"
    text = str(value)
    return text[:12] + "…" if re.fullmatch(r"[0-9a-f]{64}", text) else text
