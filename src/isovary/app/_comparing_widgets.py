"""What the comparing part shows in the drawer."""

from __future__ import annotations

from itertools import islice
from math import inf, nan
from pathlib import Path
from typing import Any

from trame.widgets import html
from trame.widgets import vuetify3 as v3

from ..names import CLUSTERINGS
from ._html import also, problem, slider, upload
from ._opened_field import OpenedField, Preview
from ._uploads import FIELD_SUFFIXES

_MOST, _DEEP = 500, 3  # files offered, folders deep
_FEWEST_PAIRS = 10  # that isovary.compare takes


def field_files(root: Path) -> list[str]:
    """Names of the field files in a folder and at most three below it, 500 at most.

    Hidden ones are left out, and links.
    """
    found = (
        path.relative_to(root).as_posix()
        for depth in range(_DEEP + 1)
        for path in sorted(root.glob("*/" * depth + "*"))
        if path.name.endswith(FIELD_SUFFIXES) and path.is_file() and not path.is_symlink()
    )
    return list(islice((name for name in found if "/." not in f"/{name}"), _MOST))


def facts(field: OpenedField) -> str:
    """A field in a line."""
    shape = " x ".join(map(str, field.shape))
    bad = f", {field.bad} without a value" if field.bad else ""
    low, high = field.range
    return f"{field.name}: {shape} samples, {low:.4g} to {high:.4g}{bad}"


def preview_words(found: Preview) -> str:
    """What a preview shows, in a sentence or two."""
    if not len(found.triangles):
        return found.words
    parts = {None: "", 1: "one piece"}.get(found.components, f"{found.components} pieces")
    cut = "cut by the box" if found.cut else "closed"
    return f"{', '.join(word for word in (parts, cut) if word)}. {found.words}".strip()


def wrong_choices(smooth: object, eigenpairs: object, vertices: object) -> dict[str, str]:
    """What cannot be in the fields of the choices, by their names; nothing if all can.

    Examples
    --------
    >>> wrong_choices("0.5", "", "600"), sorted(wrong_choices("-1", "9", "2.5"))
    ({}, ['eigenpairs', 'smooth', 'vertices'])
    """
    wrong = {}
    if str(smooth or "").strip() and not 0 < _number(smooth) < inf:
        wrong["smooth"] = (
            f"smooth: expected a length above 0, got {smooth}; leave it empty for none"
        )
    for name, text, least, empty in (
        ("eigenpairs", eigenpairs, _FEWEST_PAIRS, "for 300"),
        ("vertices", vertices, 1, "and the accuracy decides"),
    ):
        words = str(text or "").strip()
        if words and not (words.isascii() and words.isdigit() and int(words) >= least):
            wrong[name] = (
                f"{name}: expected a whole number from {least}, got {text}; leave it empty {empty}"
            )
    return wrong


def _number(text: object) -> float:
    """The number in a field; NaN for other text."""
    try:
        return float(str(text))
    except ValueError:
        return nan


def drawer(demo: Any, choose: Any, run: Any, cancel: Any) -> None:
    """Files, isovalue, options, and the run."""
    with html.Div(v_show=("part == 'compare'",)):
        _files(demo, choose)
        _isovalue()
        _options()
        _run(run, cancel)


def _files(demo: Any, choose: Any) -> None:
    with html.Div(classes="iso-section"):
        html.H2("Fields")
        for role, words in (("base", "Base"), ("perturbed", "Perturbed")):
            v3.VAutocomplete(
                label=f"{words}: a file of this folder",
                items=("choices",),
                v_if=("choices.length",),
                density="compact",
                hide_details=True,
                variant="outlined",
                classes="mb-1",
                update_modelValue=(choose, f"['{role}', $event]"),
            )
            upload(role, f"{words}: upload", "run_problem")
            html.Div(
                f"{{{{ {role}_name }}}} {{{{ {role}_facts }}}}",
                classes="iso-quiet mb-2",
                id=f"{role}_facts",
            )
        v3.VBtn("Take the demo's", size="small", variant="tonal", click=demo, id="demo")
        html.Div(
            f"Up to 1 GB each: {', '.join(FIELD_SUFFIXES)}",
            classes="iso-quiet",
            style="margin-top: 4px",
        )


def _isovalue() -> None:
    with html.Div(classes="iso-section", v_show=("base_facts",)):
        html.H2("Isovalue")
        v3.VSelect(
            label="Array",
            v_model=("array",),
            items=("arrays",),
            v_if=("arrays.length > 1",),
            density="compact",
            hide_details=True,
            variant="outlined",
            classes="mb-1",
        )
        html.Div(v_html=("histogram",), classes="iso-chart")
        slider("slide", "Isovalue", 0, 1000, 1)
        v3.VTextField(
            label="Isovalue",
            v_model=("isovalue",),
            density="compact",
            hide_details=True,
            variant="outlined",
            id="isovalue",
        )
        html.Div("{{ preview_words }}", classes="iso-quiet", id="preview_words")


def _options() -> None:
    with html.Div(classes="iso-section"):
        html.H2("Choices")
        with html.Div(style="display: grid; grid-template-columns: 1fr 1fr; gap: 6px"):
            v3.VSelect(
                label="Groups",
                v_model_number=("wanted_groups",),
                items=("[1, 2, 3, 4, 5, 6, 8, 10, 12]",),
                density="compact",
                hide_details=True,
                variant="outlined",
            )
            v3.VSelect(
                label="Elements",
                v_model_number=("wanted_order",),
                items=("[{title: 'curved', value: 2}, {title: 'flat', value: 1}]",),
                density="compact",
                hide_details=True,
                variant="outlined",
            )
        v3.VTextField(
            label="Vertices (empty: by accuracy)",
            v_model=("wanted_vertices",),
            error_messages=("wrong_choices.vertices",),
            density="compact",
            hide_details="auto",
            variant="outlined",
            classes="mt-2",
            id="wanted_vertices",
        )
        with html.Details(classes="iso-more", id="more_choices"):
            html.Summary("More choices", classes="iso-facts", style="cursor: pointer")
            _more_options()


def _more_options() -> None:
    """Choices of the command that most runs leave as they are."""
    _number_field("smooth", "Smooth", "width of a Gaussian, in the unit of length; empty: none")
    _number_field("eigenpairs", "Eigenpairs", "empty: 300")
    v3.VSelect(
        label="Cluster",
        v_model=("wanted_cluster",),
        items=(str(list(CLUSTERINGS)),),
        density="compact",
        hide_details=True,
        variant="outlined",
        classes="mt-2",
    )
    v3.VSwitch(
        v_model=("wanted_align",),
        label="Align: take the rigid motion out first",
        hide_details=True,
        density="compact",
        color="primary",
    )


def _number_field(name: str, label: str, hint: str) -> None:
    """A number with words below it: what it means, or what is wrong with it."""
    v3.VTextField(
        label=label,
        v_model=(f"wanted_{name}",),
        hint=hint,
        persistent_hint=True,
        error_messages=(f"wrong_choices.{name}",),
        density="compact",
        variant="outlined",
        classes="mt-2",
        id=f"wanted_{name}",
    )


def _run(run: Any, cancel: Any) -> None:
    with html.Div(classes="iso-section", style="padding-bottom: 20px"):
        v3.VBtn(
            "Compare",
            color="primary",
            variant="flat",
            block=True,
            click=run,
            disabled=("!ready_to_run || running",),
            id="run",
        )
        with html.Div(v_if=("running",), style="margin-top: 8px", id="progress"):
            html.Div("{{ stage }} {{ stage_words }}", classes="iso-facts", **also(role="status"))
            v3.VProgressLinear(model_value=("stage_done",), color="primary", height=6, rounded=True)
            v3.VBtn(
                "Cancel", size="small", variant="tonal", click=cancel, id="cancel", classes="mt-2"
            )
        html.Div(
            "{{ stage_words }}",
            v_if=("!running && stage_words",),
            classes="iso-facts",
            **also(role="status"),
            id="run_words",
        )
        problem("run_problem")
