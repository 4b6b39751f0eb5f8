"""Small parts of the page that trame has not."""

from __future__ import annotations

from html import escape

from trame.widgets import html
from trame.widgets import vuetify3 as v3


def also(**attributes: str | tuple[str]) -> dict[str, list[str]]:
    """Further attributes of a widget, for its call: ``html.Div(**also(aria_label="Scale"))``.

    Parameters
    ----------
    **attributes
        By name, with underscores for hyphens; a tuple holds an expression of the page.

    Examples
    --------
    >>> also(aria_label="base & perturbed", data_at=("column + 1",))
    {'raw_attrs': ['aria-label="base &amp; perturbed"', ':data-at="column + 1"']}
    """
    made = []
    for name, value in attributes.items():
        bound, text = (":", value[0]) if isinstance(value, tuple) else ("", value)
        made.append(f'{bound}{name.replace("_", "-")}="{escape(text, quote=True)}"')
    return {"raw_attrs": made}


def downloads(files: str) -> None:
    """Links to the session's files that a variable of the page lists, each with its size."""
    with html.Div(v_for=f"file in {files}", key="file.name", classes="iso-facts"):
        html.A(
            "{{ file.name }}",
            href=("'files/' + encodeURIComponent(file.name)",),
            download=("file.name",),
            style="color: rgb(var(--v-theme-primary))",
        )
        html.Span(" {{ file.size }}", classes="iso-quiet")


def slider(
    name: str, words: str, low: float, high: float | str, step: float, **looks: object
) -> None:
    """A slider of a number on the page; ``high`` may be the name of another one."""
    v3.VSlider(
        v_model_number=(name,),
        min=low,
        max=(high,) if isinstance(high, str) else high,
        step=step,
        hide_details=True,
        density="compact",
        id=f"{name}_slider",
        **also(aria_label=words),
        **looks,
    )


def problem(name: str) -> None:
    """Words on the page that say what went wrong, shown while there are any."""
    v3.VAlert(
        f"{{{{ {name} }}}}",
        v_if=(name,),
        type="error",
        variant="tonal",
        density="compact",
        classes="mt-2",
        id=name,
        style="white-space: pre-line; overflow-wrap: anywhere",
    )


def upload(role: str, words: str, refusal: str) -> None:
    """A field that sends a file to the session; what speaks against it goes to ``refusal``."""
    v3.VFileInput(
        label=words,
        density="compact",
        hide_details=True,
        variant="outlined",
        prepend_icon="",
        prepend_inner_icon="mdi-upload",
        update_modelValue=(
            "const files = Array.isArray($event) ? $event : [$event];"
            f" files[0] && window.isovary.upload(files[0], '{role}')"
            f".then((words) => {{ if (words) {refusal} = words }})"
        ),
        classes="mb-1",
        id=f"upload_{role}",
    )
