"""The four views: base, perturbed, change and groups, with one camera."""

from __future__ import annotations

import asyncio
from typing import Any

import numpy as np
from trame.widgets import html
from trame.widgets import vtk as vtk_widgets

from ..geometry import Floats
from ._html import also
from ._scene import Mesh, Scene, camera_at, describe_plainly

NAMES = ("base", "perturbed", "change", "groups")
_QUIET = 0.4  # seconds after which arrays of older scenes have come, as a rule

PRESETS: dict[str, tuple[Floats, Floats]] = {
    "+x": (np.array([1.0, 0, 0]), np.array([0.0, 0, 1])),
    "-x": (np.array([-1.0, 0, 0]), np.array([0.0, 0, 1])),
    "+y": (np.array([0, 1.0, 0]), np.array([0.0, 0, 1])),
    "-y": (np.array([0, -1.0, 0]), np.array([0.0, 0, 1])),
    "+z": (np.array([0, 0, 1.0]), np.array([0.0, 1, 0])),
    "-z": (np.array([0, 0, -1.0]), np.array([0.0, 1, 0])),
}
"""Direction towards the viewer, and what is up."""


OBLIQUE = np.array([0.48, -0.64, 0.6]), np.array([-0.36, 0.48, 0.8])
"""The same for what has no direction of its own."""


class Views:
    """The scenes of the page and the widgets that show them."""

    def __init__(self, server: Any) -> None:
        self._server = server
        self._scenes = {name: Scene() for name in NAMES}
        self._widgets: dict[str, Any] = {}
        self._center = np.zeros(3)
        self._mesh: Mesh | None = None
        self._sent: dict[str, float] = {}
        self._again: dict[str, asyncio.TimerHandle] = {}
        server.state.filled = []
        server.controller.on_server_ready.add(lambda **_: describe_plainly())

    def build(self, click: Any, hover: Any) -> None:
        """Make the widgets, inside the layout that is open."""
        with html.Div(classes=("'iso-grid iso-' + shown.length",)):
            for name in NAMES:
                with html.Div(
                    id=f"view_{name}",
                    classes=(f"filled.includes('{name}') ? 'iso-view' : 'iso-view iso-empty'",),
                    v_show=(f"shown.includes('{name}')",),
                    **also(role="img", aria_label=(f"titles.{name}",)),
                ):
                    self._widgets[name] = _widget(self._scenes[name], name, click, hover)
                    _caption(name)
                    html.Div(f"{{{{ {_waiting(name)} }}}}", classes="iso-wait")

    def show(self, name: str, mesh: Mesh, colors: np.ndarray) -> None:
        """Show a surface in a view; its own length unit, wherever it lies."""
        moved = Mesh(mesh.points - self._center, mesh.normals, mesh.triangles)
        self._scenes[name].show(moved, colors)
        self._fill(name, True)

    def clear(self, *names: str) -> None:
        """Show nothing in these views."""
        for name in names:
            self._scenes[name].clear()
            self._fill(name, False)

    def _fill(self, name: str, full: bool) -> None:
        """Tell the page which views have a surface, so that the others say why not."""
        filled = {*self._server.state.filled} - {name} | ({name} if full else set())
        self._server.state.filled = [view for view in NAMES if view in filled]

    def paint(self, name: str, colors: np.ndarray) -> None:
        """Colour the triangles of a view anew."""
        self._scenes[name].paint(colors)

    def draw_lines(self, ends: Floats, names: tuple[str, ...] = NAMES) -> None:
        """Draw strokes (s, 2, 3) in views, instead of those before."""
        for name in names:
            self._scenes[name].draw_lines(ends - self._center)

    def frame(self, mesh: Mesh, direction: Floats, up: Floats) -> None:
        """Let all views look at a mesh; coordinates are sent from its middle."""
        self._center, self._mesh = mesh.center, mesh
        camera = self._server.state.camera = self._camera(direction, up)
        for scene in self._scenes.values():
            scene.look(camera)

    def look(self, direction: Floats, up: Floats) -> None:
        """Turn all cameras of all browsers."""
        if self._mesh is not None:
            self._server.state.camera = self._camera(direction, up)

    def dark(self, dark: bool) -> None:
        """Change all views to the dark or the light theme."""
        for scene in self._scenes.values():
            scene.dark(dark)

    def push(self, *names: str) -> None:
        """Send what changed in these views.

        A browser may fetch the arrays of two scenes at once, and show the older one last. So of
        scenes that follow each other quickly the last is sent once more when it is quiet.
        """
        loop = asyncio.get_running_loop()
        for name in names or NAMES:
            self._widgets[name].update()
            last = self._sent.get(name, -np.inf)
            self._sent[name] = loop.time()
            if name in self._again:
                self._again.pop(name).cancel()
            if loop.time() - last < _QUIET:
                self._again[name] = loop.call_later(_QUIET, self._send_again, name)

    def _send_again(self, name: str) -> None:
        del self._again[name]
        self._sent[name] = asyncio.get_running_loop().time()
        self._widgets[name].update()

    def place(self, event: dict[str, Any] | None) -> Floats | None:
        """Where on a surface a pointer's event took place, or None beside it."""
        position = (event or {}).get("worldPosition")
        if position is None or not np.isfinite(position).all():
            return None
        found: Floats = np.asarray(position, dtype=float) + self._center
        return found

    def _camera(self, direction: Floats, up: Floats) -> dict[str, list[float]]:
        assert self._mesh is not None
        mesh = Mesh(self._mesh.points - self._center, self._mesh.normals, self._mesh.triangles)
        return camera_at(mesh, direction, up)


def _widget(scene: Scene, name: str, click: Any, hover: Any) -> Any:
    link = f"window.isovary.link('view_{name}')"
    return vtk_widgets.VtkLocalView(
        scene.window,
        ref=f"view_{name}",
        picking_modes=("['click', 'hover']",),
        click=(click, f"['{name}', $event, window.isovary.dragged()]"),
        hover=(hover, f"['{name}', $event]"),
        interactor_events=(
            "events",
            ["Animation", "EndAnimation", "MouseWheel", "EndMouseWheel", "EndPinch"],
        ),
        Animation=link,
        EndAnimation=link,
        MouseWheel=link,
        EndMouseWheel=link,
        EndPinch=link,
        view_state_change=f"window.isovary.loaded('view_{name}', $event)",
        after_scene_loaded=f"window.isovary.join('view_{name}')",
        resize=f"window.isovary.join('view_{name}')",
    )


def _waiting(name: str) -> str:
    """The page's expression for the words of a view that has no picture yet."""
    explore = "opening ? 'reading the result…' : 'no result is open'"
    facts = f"{name}_facts" if name in ("base", "perturbed") else "''"
    empty = f"{facts} ? 'no isosurface at this value' : 'no field is open'"
    compare = f"{facts} === 'reading…' ? 'reading the field…' : {empty}"
    drawing = f"filled.includes('{name}') || part === 'dimple' ? 'drawing…'"
    return f"{drawing} : part === 'explore' ? ({explore}) : {compare}"


def _caption(name: str) -> None:
    """The view's title and its colour key, over its upper left corner."""
    with html.Div(classes="iso-caption"):
        html.Div(f"{{{{ titles.{name} }}}}", classes="iso-title", **also(data_print="text"))
        html.Div(
            f"{{{{ subtitles.{name} }}}}",
            v_if=(f"subtitles.{name}",),
            classes="iso-words",
            **also(data_print="text"),
        )
        with html.Div(v_if=(f"keys.{name} && keys.{name}.colors.length",), classes="iso-key"):
            html.Span(f"{{{{ keys.{name}.low }}}}", **also(data_print="text"))
            html.Span(
                classes="iso-bar",
                **also(data_print="bar", data_colors=(f"keys.{name}.colors.join(' ')",)),
                style=(
                    f"{{background: 'linear-gradient(to right,' + keys.{name}.colors.join(',')"
                    " + ')'}",
                ),
            )
            html.Span(f"{{{{ keys.{name}.high }}}}", **also(data_print="text"))
        with html.Div(v_if=(f"keys.{name}",), classes="iso-words"):
            html.Div(f"{{{{ keys.{name}.unit }}}}", **also(data_print="text"))
            with (
                html.Div(
                    classes=(f"keys.{name}.patches.length > 5 ? 'iso-patches' : ''",),
                ),
                html.Div(v_for=(f"patch in keys.{name}.patches",), key="patch.words"),
            ):
                html.Span(
                    classes="iso-patch",
                    style=("{background: patch.color}",),
                    **also(data_print="patch"),
                )
                html.Span(" {{ patch.words }}", **also(data_print="text"))
