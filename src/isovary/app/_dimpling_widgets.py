"""What the dimpling part shows in the drawer."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from trame.widgets import html
from trame.widgets import vuetify3 as v3

from ._html import also, downloads, problem, slider, upload

if TYPE_CHECKING:
    from ._dimpling import Dimpling


def drawer(shapes: tuple[str, ...], part: Dimpling) -> None:
    """Surface, dimple, history and files."""
    with html.Div(v_show=("part == 'dimple'",)):
        _surface(shapes)
        _dimple()
        _history(part)
        _files(part)


def _surface(shapes: tuple[str, ...]) -> None:
    with html.Div(classes="iso-section"):
        html.H2("Surface")
        v3.VSelect(
            label="Shape",
            v_model=("shape",),
            items=(str(list(shapes)),),
            density="compact",
            hide_details=True,
            variant="outlined",
            classes="mb-1",
        )
        upload("surface", "Or upload a surface", "dimple_problem")
        html.Div("{{ shape_name }}", classes="iso-quiet")


def _dimple() -> None:
    with html.Div(classes="iso-section"):
        html.H2("Next dimple")
        html.Div("Centre: {{ center_words }}", classes="iso-facts", id="center_words")
        _slider("radius", "Radius", 0, "radius_most", 0.01)
        _slider("charge", "Charge: + pushes in, − draws out", -3, 3, 0.1)
        _slider("alpha", "Strength", 0.5, 20, 0.5)
        v3.VTextField(
            label="Depth (empty: by strength)",
            v_model=("depth",),
            density="compact",
            hide_details=True,
            variant="outlined",
            classes="mb-1",
            id="depth",
        )
        _slider("decay", "Decay of the force, in radii", 0.05, 1, 0.05)
        _slider("steps", "Flight of the projectile, in steps of 0.01", 1, 60, 1)


def _slider(name: str, words: str, low: float, high: float | str, step: float) -> None:
    with html.Div(classes="iso-facts", style="display: flex"):
        html.Span(words)
        v3.VSpacer()
        html.Span(f"{{{{ {name} }}}}", id=f"{name}_words")
    slider(name, words, low, high, step)


def _history(part: Dimpling) -> None:
    with html.Div(classes="iso-section"):
        with html.Div(classes="iso-buttons"):
            _button(
                "Deform",
                part.deform,
                "!center",
                "deform",
                color="primary",
                variant="flat",
                loading=("deforming",),
            )
            _button("Undo", part.undo, "!can_undo", "undo")
            _button("Redo", part.redo, "!can_redo", "redo")
            _button("Compare", part.compare, "!can_undo || comparing_dimple", "compare_dimple")
        html.Div(
            "{{ moved_words }}", classes="iso-facts mt-1", id="moved_words", **also(role="status")
        )
        with html.Div(v_if=("comparing_dimple",), classes="iso-facts mt-1"):
            html.Div("{{ dimple_stage }}", **also(role="status"))
            v3.VProgressLinear(indeterminate=True, color="primary", height=4)
            v3.VBtn("Cancel", size="small", variant="tonal", click=part.cancel, id="cancel_dimple")
        v3.VAlert(
            "{{ note }}",
            v_for="note in dimple_notes",
            key="note",
            type="warning",
            variant="tonal",
            density="compact",
            classes="mt-2",
            style="overflow-wrap: anywhere",
        )
        problem("dimple_problem")


def _button(words: str, click: Any, disabled: str, name: str, **looks: Any) -> None:
    given = {"size": "small", "variant": "tonal"} | looks
    v3.VBtn(words, click=click, disabled=(disabled,), id=name, **given)


def _files(part: Dimpling) -> None:
    with html.Div(classes="iso-section", style="padding-bottom: 20px", v_show=("pushes",)):
        html.H2("Save")
        _button("Save", part.save, "!pushes", "save_dimple", loading=("saving",))
        downloads("dimple_files")
        html.Div("The same from the command line:", classes="iso-quiet mt-2")
        html.Pre("{{ dimple_command }}", classes="iso-code", id="dimple_command")
