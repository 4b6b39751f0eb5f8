"""The first part of the page: turn a result, move its sliders, click a point."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any
from urllib.parse import parse_qsl, urlencode

import numpy as np

from ..color import NEUTRAL, UNKNOWN
from ..errors import IsovaryError
from ..geometry import Floats
from ..records import Clusters
from ..signature import diffusion_radius
from ..view._words import percent
from . import _exploring_widgets as widgets
from ._charts import curve_values, curves_svg
from ._group_cache import find_groups, kept_groups
from ._groupings import COUNTS, group_rows, palettes
from ._opened_result import OpenedResult, offer, open_folder
from ._painting import Drawn, Legend, Painted, paint_change, paint_groups, paint_signature
from ._saved_result import SavedResult
from ._scene import Mesh, mesh_of
from ._settings import SessionSettings
from ._turns import Turns
from ._views import NAMES, PRESETS, Views
from ._work import Work

_START: dict[str, Any] = {
    "titles": {},
    "subtitles": {},
    "keys": {},
    "has_result": False,
    "verdict": "",
    "facts": [],
    "result_notes": [],
    "files": [],
    "column": 0,
    "column_last": 0,
    "column_words": "",
    "mean": True,
    "count": 3,
    "count_words": "",
    "factor": 2.0,
    "factor_words": "",
    "legend": [],
    "headline": "",
    "group_words": "",
    "value_names": [],
    "node": -1,
    "node_words": "",
    "node_values": [],
    "curves": "",
    "hover_words": "",
    "link": "",
    "problem": "",
}


class Exploring:
    """A result on the page.

    Parameters
    ----------
    server : trame's Server
    views : Views
    settings : SessionSettings
    turns : Turns
    """

    def __init__(self, server: Any, views: Views, settings: SessionSettings, turns: Turns) -> None:
        self._state, self._views = server.state, views
        self._settings, self._work = settings, Work(turns)
        self._opened: OpenedResult | None = None
        self._saved, self._asked = 0, 0
        self._why_missing = ""
        self._groups: dict[int, Clusters] = {}
        self._palettes: dict[int, Floats] = {}
        self._rows: dict[int, list[dict[str, Any]]] = {}
        self._group_paint: dict[int, Painted] = {}
        self._dirty: set[str] = set()
        self._link: dict[str, str] = {}
        self._state.update(_START)
        change = server.state.change
        change("column")(lambda **_: self._mark("base", "perturbed", *self._of_column()))
        change("mean")(lambda **_: self._mark("change"))
        change("factor")(lambda **_: self._mark("change"))
        change("count")(lambda **_: self._mark("groups"))
        change("layout")(lambda **_: self._tell_link())

    def drawer(self) -> None:
        """Build its part of the drawer."""
        widgets.drawer(self._preset, COUNTS)

    def panel(self) -> None:
        """Build the panel of the clicked point."""
        widgets.panel(self._forget_node)

    async def close(self) -> None:
        """End what still runs."""
        await self._work.cancel()

    async def open_result(self, folder: Path, reveal: bool = True) -> None:
        """Read a folder and show it, in place of another part of the page only if it should."""
        self._asked += 1
        asked = self._asked
        try:
            opened = await asyncio.to_thread(open_folder, folder)
            if asked != self._asked:
                return  # another result was asked for meanwhile
            files = await asyncio.to_thread(offer, folder, self._settings.folder / "out")
        except (IsovaryError, OSError, LookupError, TypeError, ValueError) as error:
            with self._state as state:
                state.part = "explore" if reveal else state.part
                state.problem = f"{folder.name} cannot be shown: {error}"
            self.find_groups()  # of the result that stays
            return
        await self._work.cancel()
        with self._state as state:
            state.files = files
            self._show(opened, reveal)
        if self._state.arrived:
            self.find_groups()

    def find_groups(self) -> None:
        """Find the groups for all counts, if they are not there and nobody does."""
        opened = self._opened
        if opened is None or self._work.running:
            return
        cache = self._settings.cache

        def take(_: object) -> None:
            if self._opened is opened:
                self._take_groups(kept_groups(cache, opened.name))

        take(None)
        if not set(COUNTS) <= set(self._groups):
            arguments = opened.saved.folder, cache
            self._why_missing = ""
            self._work.start(find_groups, arguments, done=take, progress=take, failed=self._no_more)

    async def pause(self) -> None:
        """Leave the place among the long runs to another run of this session."""
        await self._work.cancel()
        if self._opened is not None:
            with self._state:
                self._tell_count()

    def enter(self) -> None:
        """Show the result in the views again."""
        if self._opened is None:
            self._views.clear(*NAMES)
            self._state.update({"titles": {}, "subtitles": {}, "keys": {}})
        else:
            self._fill()

    def follow(self, link: str) -> None:
        """Take the state that an address keeps."""
        shown = self._opened is not None and self._state.part == "explore"
        self._link = dict(parse_qsl(link)) if shown or self._opened is None else {}
        if shown:
            self._apply_link()
            self._tell_node(int(self._state.node))
        self.find_groups()

    def pick(self, name: str, place: Floats) -> None:
        """Tell everything of the node nearest to a place in a view."""
        node = None if self._opened is None else self._opened.node_at(name, place)
        if node is not None:
            self._tell_node(node)

    def words_at(self, name: str, place: Floats | None) -> str:
        """Return what the pointer is on, in a line."""
        if self._opened is None or place is None:
            return ""
        node = self._opened.node_at(name, place)
        return "no partner near" if node is None else f"node {node}: {self._words_of(node)}"

    def _words_of(self, node: int) -> str:
        """What happened at a node, in a line."""
        label, norm = int(self._clusters.labels[node]), float(self._now.norm[node])
        if not np.isfinite(norm):
            return "no partner, change unknown"
        group = "no group" if label < 0 else f"group {label}"
        kept = "" if self._now.saved.significant[node] else ", within the noise"
        return f"mean change {percent(norm)}{kept}, {group}"

    @property
    def _now(self) -> OpenedResult:
        """The result that is open."""
        assert self._opened is not None
        return self._opened

    @property
    def _shown(self) -> int:
        """The number of groups that is shown: the one asked for, or until it is there the saved."""
        asked = int(self._state.count)
        return asked if asked in self._groups else self._saved

    @property
    def _clusters(self) -> Clusters:
        return self._groups[self._shown]

    def _show(self, opened: OpenedResult, reveal: bool) -> None:
        result = opened.saved
        self._opened, self._saved = opened, result.count
        self._group({result.count: opened.groups})
        state = self._state
        state.has_result, state.problem, state.node = True, "", -1
        state.column_last = len(result.columns) - 1
        state.column, state.count = len(result.columns) // 3, max(2, result.count)
        state.headline = widgets.headline(result)
        state.verdict, state.facts = widgets.verdict(opened), widgets.facts(result)
        state.result_notes = [str(note) for note in result.summary.get("notes", [])]
        state.hover_words = ""
        self._apply_link()
        if state.part == "explore":
            self._fill()
        elif reveal:
            state.part = "explore"  # and its handler fills the views

    def _group(self, found: dict[int, Clusters]) -> None:
        self._groups, self._rows, self._group_paint = found, {}, {}
        self._palettes = palettes(found, self._saved, self._now.areas)

    def _fill(self) -> None:
        """Put both surfaces into the views."""
        opened, keys = self._now, {}
        self._views.frame(_both(opened), opened.towards, opened.up)
        for name in NAMES:
            surface, painted = self._surface(name), self._painted(name)
            self._views.show(name, mesh_of(surface), painted.colors)
            keys[name] = self._key(name, painted.legend)
        self._state.keys = keys
        self._tell()
        self._tell_node(int(self._state.node))
        self._views.push()

    def _surface(self, name: str) -> Drawn:
        return self._now.perturbed if name == "perturbed" else self._now.base

    def _painted(self, name: str) -> Painted:
        opened, state = self._now, self._state
        result, column, factor = opened.saved, int(state.column), float(state.factor)
        if name == "base":
            return paint_signature(result, "base", column, opened.base)
        if name == "perturbed":
            return paint_signature(result, "perturbed", column, opened.perturbed)
        if name == "change":
            return paint_change(result, None if state.mean else column, factor, opened.base)
        return self._painted_groups(result, self._shown)

    def _painted_groups(self, result: SavedResult, count: int) -> Painted:
        """The groups' colours, made once for each count."""
        if count not in self._group_paint:
            palette = self._palettes[count]
            self._group_paint[count] = paint_groups(
                result, self._groups[count], self._now.base, palette=palette
            )
        return self._group_paint[count]

    def _of_column(self) -> tuple[str, ...]:
        """The views of the change that a column changes: none while the mean is shown."""
        return () if self._state.mean else ("change",)

    def _mark(self, *names: str) -> None:
        """Paint these views once the messages that wait have been read."""
        if self._opened is None or self._state.part != "explore":
            return
        if not self._dirty:
            asyncio.get_running_loop().call_soon(self._repaint)
        self._dirty |= set(names)

    def _repaint(self) -> None:
        names, self._dirty = tuple(self._dirty), set()
        if self._state.part != "explore":
            return
        with self._state:
            keys = dict(self._state.keys)
            for name in names:
                painted = self._painted(name)
                self._views.paint(name, painted.colors)
                keys[name] = self._key(name, painted.legend)
            self._state.keys = keys
            self._tell()
            node = int(self._state.node)
            if "base" in names and node >= 0:
                self._tell_curves(node)
            if "groups" in names:
                self._state.hover_words = ""
                self._state.group_words = self._words_of(node) if node >= 0 else ""
            self._views.push(*names)

    def _tell(self) -> None:
        """Words beside the sliders, titles, the groups' legend, the address."""
        state, result = self._state, self._now.saved
        words = _column_words(result, int(state.column))
        state.column_words, short = words, result.kind.abbreviation
        factor = float(state.factor)
        state.factor_words = (
            f"shown above {factor:g} times the noise floor" if factor else "everything is shown"
        )
        state.titles = {
            "base": f"Base: {short}",
            "perturbed": f"Perturbed: {short}",
            "change": f"Change of the {short}",
            "groups": _groups_title(len(self._clusters.centers)),
        }
        state.subtitles = {
            "base": words,
            "perturbed": words,
            "change": "mean size over all scales" if state.mean else f"base − perturbed, {words}",
            "groups": "",
        }
        self._tell_count()
        state.legend = self._legend()
        self._tell_link()

    def _tell_count(self) -> None:
        ready, running = int(self._state.count) in self._groups, self._work.running
        missing = "still being computed" if running else self._why_missing or "not computed"
        self._state.count_words = "" if ready else f"{missing}; the saved ones are shown"

    def _legend(self) -> list[dict[str, Any]]:
        """The table of the groups that are shown, made once for each count."""
        shown = self._shown
        if shown not in self._rows:
            rows = group_rows(self._now.saved, self._groups[shown], self._palettes[shown])
            self._rows[shown] = widgets.legend(rows)
        return self._rows[shown]

    def _key(self, name: str, legend: Legend) -> dict[str, Any]:
        """A view's colour key: its bar, and what the plain colours mean."""
        rows = self._legend() if name == "groups" else []
        patches = [
            {"color": row["color"], "words": f"{row['number']}: {row['area']}"} for row in rows
        ]
        plain = ((NEUTRAL, legend.neutral), (UNKNOWN, legend.unknown))
        patches += [{"color": color, "words": words} for color, words in plain if words]
        key = {"low": "", "high": "", "unit": legend.unit, "colors": [], "patches": patches}
        if legend.low is None or legend.high is None or legend.low == legend.high:
            return key
        ends = {"low": f"{legend.low:.3g}", "high": f"{legend.high:.3g}"}
        return key | ends | {"colors": list(legend.stops)}

    def _take_groups(self, found: dict[int, Clusters]) -> None:
        """Take what was found so far; only the part that is seen changes its views."""
        self._group({**found, self._saved: self._groups[self._saved]})
        with self._state as state:
            self._tell_count()
            if state.part == "explore":
                self._mark("groups")
                self._tell()

    def _no_more(self, message: str) -> None:
        self._why_missing = f"not computed ({message})"
        with self._state:
            self._tell_count()

    def _tell_node(self, node: int) -> None:
        if self._opened is None or not 0 <= node < len(self._opened.norm):
            self._forget_node()
            return
        result = self._opened.saved
        self._state.node = node
        place = result.base.points[node]
        at = ", ".join(f"{x:.4g}" for x in place)
        self._state.node_words = f"Node {node} at ({at})"
        self._state.group_words = self._words_of(node)
        self._tell_curves(node)
        size, normal = 2 * mesh_of(self._now.base).reach, result.base.normals[node]
        self._views.draw_lines(_cross(place, normal, size), ("base", "change", "groups"))
        other = result.partners[node]
        known = np.isfinite(other).all()
        self._views.draw_lines(
            _cross(other, normal, size) if known else np.empty((0, 2, 3)), ("perturbed",)
        )
        self._tell_link()
        self._views.push()

    def _tell_curves(self, node: int) -> None:
        result = self._now.saved
        shown = (
            result.columns,
            result.base_signature[node],
            result.perturbed_signature[node],
            result.change[node],
            result.noise_floor[node],
        )
        column, title = int(self._state.column), f"Node {node}"
        self._state.curves = curves_svg(
            *shown, kind=result.kind, title=title, column=column, width=_CHART[0], height=_CHART[1]
        )
        rows = curve_values(*shown, kind=result.kind)
        self._state.value_names, self._state.node_values = rows[0], rows[1:]

    def _forget_node(self) -> None:
        self._state.node, self._state.curves = -1, ""
        self._views.draw_lines(np.empty((0, 2, 3)))
        self._views.push()
        self._tell_link()

    def _preset(self, name: str) -> None:
        self._views.look(*PRESETS[name])

    def _tell_link(self) -> None:
        if self._opened is None:
            return
        state = self._state
        kept = {
            "view": state.layout,
            "column": "mean" if state.mean else int(state.column),
            "at": int(state.column),
            "groups": int(state.count),
            "noise": f"{float(state.factor):g}",
        }
        if state.node >= 0:
            kept["node"] = int(state.node)
        state.link = urlencode(kept)

    def _apply_link(self) -> None:
        """Take what the address keeps; what makes no sense is left aside."""
        link, state, result = self._link, self._state, self._now.saved
        if link.get("view") in ("four", "base", "perturbed", "change", "groups"):
            state.layout = link["view"]
        state.column = int(_number(link.get("at"), 0, len(result.columns) - 1, state.column))
        state.mean = link.get("column", "mean" if state.mean else "") == "mean"
        state.count = int(_number(link.get("groups"), COUNTS[0], COUNTS[-1], state.count))
        state.factor = _number(link.get("noise"), 0.0, 10.0, state.factor)
        state.node = int(_number(link.get("node"), -1, len(result.change) - 1, state.node))
        self._link = {}


_CHART = 352, 400  # about the panel's pixels


def _column_words(result: SavedResult, column: int) -> str:
    """Where a column stands, as a length where it can be."""
    value = float(result.columns[column])
    if not result.kind.per_time:
        return f"{result.kind.axis} {value:.3g}"
    return f"radius {float(diffusion_radius(value)):.3g} (time {value:.3g})"


def _cross(place: Floats, normal: Floats, size: float) -> Floats:
    """A ring with a pin (s, 2, 3) that marks a place on a surface."""
    across = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    across /= np.linalg.norm(across)
    along = np.cross(normal, across)
    angle = np.linspace(0, 2 * np.pi, 25)[:, None]
    ring = place + 0.012 * size * (np.cos(angle) * across + np.sin(angle) * along + 0.4 * normal)
    pin = np.array([place, place + 0.05 * size * normal])
    return np.concatenate([np.stack([ring[:-1], ring[1:]], axis=1), pin[None]])


def _number(text: str | None, low: float, high: float, default: float) -> float:
    """A number of an address, or the default where it is none or out of its range."""
    try:
        value = float(text or "")
    except ValueError:
        return default
    return value if low <= value <= high else default


def _groups_title(count: int) -> str:
    words = {0: "No groups of like change", 1: "1 group of like change"}
    return words.get(count, f"{count} groups of like change")


def _both(opened: OpenedResult) -> Mesh:
    """Both surfaces, which the camera has to see."""
    base, perturbed = opened.base, opened.perturbed
    return Mesh(
        np.concatenate([base.points, perturbed.points]),
        np.concatenate([base.normals, perturbed.normals]),
        base.triangles,
    )
