"""What the exploring part shows beside the views: its drawer, and the panel of a point."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from trame.widgets import html
from trame.widgets import vuetify3 as v3

from ..view._words import percent
from ._html import also, downloads, problem, slider
from ._opened_result import OpenedResult
from ._saved_result import SavedResult
from ._views import PRESETS


def facts(result: SavedResult) -> list[dict[str, str]]:
    """The facts of a result, each with its name."""
    choices, summary = result.choices, result.summary
    share = float(result.significant[result.known].mean()) if result.known.any() else 0.0
    missing = 1.0 - float(result.found.mean())
    rows = [("Field", str(choices.get("field", "")))]
    files = choices.get("files", [])
    if isinstance(files, list) and len(files) > 1:  # the base, members of a way, the perturbed
        field = str(choices.get("field", ""))
        rows += [
            (r, _file_words(f, field)) for r, f in (("Base", files[0]), ("Perturbed", files[-1]))
        ]
    rows += [
        ("Isovalue", f"{float(choices.get('isovalue', summary.get('isovalue', 0))):g}"),
        ("Mesh", f"{len(result.base.points)} nodes, order {result.base.order}"),
        ("Signature", f"{result.kind.title}, {len(result.columns)} columns"),
        ("Above the noise", f"{percent(share)} of the nodes"),
    ]
    if missing > 0:
        rows.append(("Without a partner", f"{percent(missing)} of the nodes"))
    return [{"name": name, "value": value} for name, value in rows]


def _file_words(file: dict[str, Any], field: str) -> str:
    """A field's file by its name, and the array where that is not the field's name."""
    array = str(file.get("array") or field)
    return Path(str(file.get("path", ""))).name + ("" if array == field else f", {array}")


def headline(result: SavedResult) -> str:
    """Which isosurface: the title of the page and of its pictures."""
    field = str(result.choices.get("field", "")) or "field"
    return f"{field} = {float(result.summary['isovalue']):g}"


def verdict(opened: OpenedResult) -> str:
    """What was found, in a sentence."""
    result = opened.saved
    norm = np.where(result.significant, opened.norm, np.nan)
    if not result.significant.any():
        return "No change above the noise."
    node = int(np.nanargmax(norm))
    place = ", ".join(f"{x:.3g}" for x in result.base.points[node])
    share = percent(float(result.significant[result.known].mean()))
    return (
        f"{share} of the nodes changed beyond the noise, most of all node {node} at ({place}): "
        f"{percent(float(norm[node]))} of the mean {result.kind.abbreviation}, mean over scales."
    )


def legend(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The rows of the groups' table, in words."""
    return [
        {
            "number": row["number"],
            "color": row["color"],
            "area": percent(row["area_percent"] / 100),
            "change": f"{row['change_percent']:+.2g} %",
            "radius": "" if row["radius"] is None else f"{row['radius']:.2g}",
        }
        for row in rows
    ]


def drawer(preset: Callable[[str], None], counts: Sequence[int]) -> None:
    """The sliders, the legend, the cameras and the files."""
    with html.Div(v_show=("part == 'explore'",)):
        problem("problem")
        with html.Div(classes="iso-section", v_if=("!has_result",)):
            html.Div("Reading the result…", v_if=("opening",), classes="iso-facts")
            html.Div(
                "No result is open. Compare two fields first.",
                v_if=("!opening",),
                classes="iso-facts",
            )
        with html.Div(v_show=("has_result",)):
            _narrow_layout()
            _result()
            _scale()
            _noise()
            _groups(counts)
            _cameras(preset)
            _files()


def _narrow_layout() -> None:
    """The choice of views, where the bar has no room for it."""
    with html.Div(classes="iso-section d-md-none"):
        v3.VSelect(
            label="Views",
            v_model=("layout",),
            items=("['four', 'base', 'perturbed', 'change', 'groups']",),
            density="compact",
            hide_details=True,
            variant="outlined",
        )


def _result() -> None:
    with html.Div(classes="iso-section"):
        html.H2("Result")
        html.Div("{{ verdict }}", classes="iso-facts", style="margin-bottom: 6px")
        with html.Table(classes="iso-facts"), html.Tr(v_for="fact in facts", key="fact.name"):
            html.Td("{{ fact.name }}", style="opacity: .75; padding-right: 10px; min-width: 110px")
            html.Td("{{ fact.value }}")
        with html.Details(v_if=("result_notes.length",), open=True, id="result_notes"):
            html.Summary(
                "Notes: {{ result_notes.length }}", classes="iso-facts", style="cursor: pointer"
            )
            html.Div(
                "{{ note }}",
                v_for="note in result_notes",
                key="note",
                classes="iso-quiet",
                style="margin-bottom: 6px",
            )


def _scale() -> None:
    with html.Div(classes="iso-section"):
        html.H2("Scale")
        html.Div("{{ column_words }}", classes="iso-facts", id="column_words")
        slider("column", "Scale: time of diffusion", 0, "column_last", 1)
        v3.VSwitch(
            v_model=("mean",),
            label="Change: mean over all scales",
            hide_details=True,
            density="compact",
            color="primary",
        )


def _noise() -> None:
    with html.Div(classes="iso-section"):
        html.H2("Threshold")
        html.Div("{{ factor_words }}", classes="iso-facts", id="factor_words")
        slider("factor", "Threshold in noise floors", 0, 10, 0.5)


def _groups(counts: Sequence[int]) -> None:
    with html.Div(classes="iso-section"):
        html.H2("Groups: {{ count }}")
        slider("count", "Number of groups", counts[0], counts[-1], 1, show_ticks="always")
        html.Div("{{ count_words }}", classes="iso-quiet", v_if=("count_words",))
        with html.Table(classes="iso-legend", id="legend"):
            with html.Thead(), html.Tr():
                for words in ("Group", "Area", "Most change", "at radius"):
                    html.Th(words, **also(scope="col"))
            with html.Tbody(), html.Tr(v_for="row in legend", key="row.number"):
                with html.Td():
                    html.Span(classes="iso-patch", style=("{background: row.color}",))
                    html.Span(" {{ row.number }}")
                html.Td("{{ row.area }}")
                html.Td("{{ row.change }}")
                html.Td("{{ row.radius }}")


def _cameras(preset: Callable[[str], None]) -> None:
    with html.Div(classes="iso-section"):
        html.H2("Look from")
        with html.Div(classes="iso-buttons"):
            for name in PRESETS:
                v3.VBtn(
                    name,
                    size="small",
                    variant="tonal",
                    min_width=44,
                    click=(preset, f"['{name}']"),
                    **also(aria_label=f"Look from {name}"),
                )


def _files() -> None:
    with html.Div(classes="iso-section", style="padding-bottom: 20px"):
        html.H2("Save")
        with html.Div(classes="iso-buttons"):
            v3.VBtn(
                "Picture of the views",
                size="small",
                variant="tonal",
                prepend_icon="mdi-camera-outline",
                click="window.isovary.screenshot(headline, 'isovary.png', 1)",
                id="screenshot",
            )
            v3.VBtn(
                "2×",
                size="small",
                variant="tonal",
                min_width=44,
                click="window.isovary.screenshot(headline, 'isovary.png', 2)",
                id="screenshot_large",
                **also(
                    aria_label="Picture with twice the pixels each way",
                    title="twice the pixels each way",
                ),
            )
        downloads("files")


def panel(forget: Callable[[], None]) -> None:
    """The panel of the clicked point: its curves, and their values as a table."""
    shown = "part == 'explore' && node >= 0"
    with html.Div(classes="iso-panel", v_if=(shown,), id="point"):
        with html.Div(style="display: flex; align-items: center"):
            html.Div("{{ node_words }}", classes="iso-title", id="node_words")
            v3.VSpacer()
            v3.VBtn(
                icon="mdi-close",
                size="small",
                variant="text",
                click=forget,
                **also(aria_label="Close the point's panel"),
            )
        html.Div("{{ group_words }}", classes="iso-facts")
        html.Div(v_html=("curves",), classes="iso-chart")
        with html.Details():
            html.Summary("Values", classes="iso-facts", style="cursor: pointer")
            with html.Table(classes="iso-values", id="values"):
                with html.Thead(), html.Tr():
                    html.Th(
                        "{{ name }}", v_for="name in value_names", key="name", **also(scope="col")
                    )
                with html.Tbody(), html.Tr(v_for="(row, i) in node_values", key="i"):
                    html.Td("{{ cell }}", v_for="(cell, j) in row", key="j")
