"""The page: what is where. What happens is in the files of its three parts."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any, Protocol

from trame.ui.vuetify3 import VAppLayout
from trame.widgets import client, html
from trame.widgets import vuetify3 as v3

from ._comparing import Comparing
from ._dimpling import Dimpling
from ._exploring import Exploring
from ._html import also
from ._settings import SessionSettings
from ._turns import Send, Turns
from ._views import NAMES, Views


class _Part(Protocol):
    def enter(self) -> None: ...


_STATIC = "__isovary"
MODULE = {
    "serve": {_STATIC: str(Path(__file__).with_name("static"))},
    "scripts": [f"{_STATIC}/isovary.js"],
    "styles": [f"{_STATIC}/isovary.css"],
}
"""What trame serves of ours."""

_LIGHT = {"primary": "#0b5a8a", "background": "#ffffff", "surface": "#ffffff"}
_DARK = {"primary": "#7cc4f4", "background": "#16191d", "surface": "#1f242a"}


class Page:
    """One browser session: three parts that share four views.

    Parameters
    ----------
    server : trame's Server
    settings : SessionSettings
    send : async callable
        Sends a note to the gateway.
    """

    def __init__(self, server: Any, settings: SessionSettings, send: Send) -> None:
        self._server, self._state = server, server.state
        self._send, self._turns = send, Turns(send)
        server.enable_module(MODULE)
        self._state.update(
            {"part": "explore", "layout": "four", "drawer": True, "dark": False, "camera": None}
        )
        self._state.update({"shown": list(NAMES), "headline": ""})
        self._state.update({"arrived": False, "trame__title": "isovary"})
        self._state.opening = settings.result is not None
        self._views = Views(server)
        self.exploring = Exploring(server, self._views, settings, self._turns)
        self.comparing = Comparing(server, self._views, settings, self._turns, self.exploring)
        self.dimpling = Dimpling(server, self._views, settings, self._turns, self.exploring)
        server.state.change("dark")(self._darken)
        server.state.change("part")(self._enter)
        server.state.change("layout")(self._arrange)
        self._build()
        self._build_lost()
        server.controller.on_server_ready.add_task(self._begin)
        self._settings = settings

    async def noted(self, note: dict[str, Any]) -> None:
        """Take a note of the gateway."""
        self._turns.noted(note)
        if "uploaded" in note:
            uploaded = note["uploaded"]
            part = self.dimpling if uploaded["role"] == "surface" else self.comparing
            await part.uploaded(uploaded["role"], Path(uploaded["path"]), uploaded["name"])

    async def close(self) -> None:
        """End what still runs."""
        for part in (self.exploring, self.comparing, self.dimpling):
            await part.close()

    async def _begin(self, **_: object) -> None:
        try:
            if self._settings.result is not None:
                await self.exploring.open_result(self._settings.result, reveal=False)
        finally:
            with self._state:
                self._state.opening = False
                if self._settings.result is None:
                    self._state.part = "compare"
            with suppress(ConnectionError):  # the gateway has gone, and the session goes, too
                await self._send(shown=True)

    def _darken(self, dark: bool, **_: object) -> None:
        self._views.dark(bool(dark))
        self._views.push()

    def _enter(self, part: str, **_: object) -> None:
        parts: dict[str, _Part] = {
            "explore": self.exploring,
            "compare": self.comparing,
            "dimple": self.dimpling,
        }
        self._state.hover_words = ""
        self._arrange()
        if part in parts:
            parts[part].enter()

    def _arrange(self, **_: object) -> None:
        """Choose the views that the part shows."""
        part, layout = self._state.part, self._state.layout
        whole = list(NAMES) if layout == "four" else [layout]
        self._state.shown = {"explore": whole}.get(part, list(_SHOWN.get(part, ())))

    async def _arrive(self, arrival: dict[str, Any]) -> None:
        """A browser came: it says its theme, its width and the state in its address."""
        if not self._state.arrived:
            self._state.dark = bool(arrival.get("dark"))
            self._state.layout = "change" if arrival.get("narrow") else self._state.layout
            self._state.drawer = not arrival.get("narrow")
            self._state.arrived = True
        self.exploring.follow(str(arrival.get("link", "")))
        await self.comparing.list_files()

    def _build(self) -> None:
        with VAppLayout(self._server, vuetify_config=_vuetify_config()) as layout:
            layout.root.theme = ("dark ? 'dark' : 'light'",)
            client.ClientTriggers(mounted=(self._arrive, "[window.isovary.arrival()]"))
            client.ClientStateChange(value="part", change="window.isovary.reveal('')")
            client.ClientStateChange(
                value="running", change="running && window.isovary.reveal('progress')"
            )
            client.ClientStateChange(value="link", change="window.isovary.remember(link)")
            client.ClientStateChange(value="camera", change="camera && window.isovary.look(camera)")
            self._bar()
            with v3.VNavigationDrawer(
                v_model=("drawer",),
                width=330,
                mobile_breakpoint=("900",),  # a number: other words name steps of Vuetify's own
            ):
                self.exploring.drawer()
                self.comparing.drawer()
                self.dimpling.drawer()
            with v3.VMain(classes="iso-main"), html.Div(classes="iso-work"):
                with html.Div(style="position: relative; min-width: 0"):
                    self._views.build(self._click, self._hover)
                    html.Div("{{ hover_words }}", classes="iso-hover", v_if=("hover_words",))
                self.exploring.panel()

    def _build_lost(self) -> None:
        """What stands in the page's place while the server does not answer."""
        with VAppLayout(
            self._server, template_name="error_reconnect", vuetify_config=_vuetify_config()
        ) as layout:
            layout.root.theme = ("dark ? 'dark' : 'light'",)
            client.ClientTriggers(mounted="window.isovary.comeBack()")
            with html.Div(classes="iso-lost", **also(role="status")):
                html.Div("Trying to come back…", id="lost_words")
                v3.VBtn(
                    "Reload",
                    click="window.isovary.reload()",
                    size="small",
                    variant="tonal",
                    id="lost_reload",
                    **also(hidden=""),
                )
        self._state.trame__template_error = self._state.trame__template_error_reconnect

    def _bar(self) -> None:
        with v3.VAppBar(density="compact", flat=True, border=True):
            v3.VAppBarNavIcon(
                click="drawer = !drawer", **also(aria_label="Show or hide the drawer")
            )
            v3.VAppBarTitle(
                "isovary", classes="hidden-xs", style="flex: 0 0 auto; margin-right: 16px"
            )
            with v3.VTabs(v_model=("part",), density="compact"):
                for value, words in _PARTS.items():
                    v3.VTab(words, value=value)
            v3.VSpacer()
            with v3.VBtnToggle(
                v_model=("layout",),
                density="compact",
                mandatory=True,
                variant="outlined",
                classes="mr-2 hidden-sm-and-down",
                v_if=("part == 'explore'",),
            ):
                for value, words in _LAYOUTS.items():
                    v3.VBtn(words, value=value, size="small")
            v3.VBtn(
                icon=("dark ? 'mdi-weather-sunny' : 'mdi-weather-night'",),
                click="dark = !dark",
                **also(aria_label="Light or dark"),
            )

    def _click(self, name: str, event: dict[str, Any] | None, dragged: bool) -> None:
        place = None if dragged else self._views.place(event)
        if place is None:
            return
        if self._state.part == "dimple":
            self.dimpling.pick(place)
        elif self._state.part == "explore":
            self.exploring.pick(name, place)

    def _hover(self, name: str, event: dict[str, Any] | None) -> None:
        place = self._views.place(event)
        exploring = self._state.part == "explore"
        self._state.hover_words = self.exploring.words_at(name, place) if exploring else ""


_SHOWN = {"compare": ("base", "perturbed"), "dimple": ("perturbed", "change")}
_PARTS = {"explore": "Explore", "compare": "Compare", "dimple": "Dimple"}
_LAYOUTS = {
    "four": "Four",
    "base": "Base",
    "perturbed": "Perturbed",
    "change": "Change",
    "groups": "Groups",
}


def _vuetify_config() -> dict[str, Any]:
    themes = {"light": {"colors": _LIGHT}, "dark": {"dark": True, "colors": _DARK}}
    return {"theme": {"themes": themes}}
