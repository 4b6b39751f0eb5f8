"""The second part of the page: open two fields, choose an isovalue, run."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np

from .. import data
from ..errors import IsovaryError
from ..geometry import node_normals
from . import _comparing_widgets as widgets
from ._charts import histogram_svg
from ._exploring import Exploring
from ._jobs import Failed, Finished, Progress, compare_files_job, start
from ._opened_field import OpenedField, Preview, opened, preview
from ._scene import Mesh
from ._settings import SessionSettings
from ._turns import Turns
from ._uploads import confined
from ._views import OBLIQUE, Views
from ._work import Work

Role = Literal["base", "perturbed"]
_ROLES: tuple[Role, ...] = ("base", "perturbed")

_STEPS = 1000  # of the isovalue's slider
_START: dict[str, Any] = {
    "choices": [],
    "base_name": "",
    "perturbed_name": "",
    "base_facts": "",
    "perturbed_facts": "",
    "arrays": [],
    "array": None,
    "histogram": "",
    "slide": _STEPS // 2,
    "isovalue": "",
    "preview_words": "",
    "wanted_groups": 3,
    "wanted_order": 2,
    "wanted_vertices": "",
    "wanted_smooth": "",
    "wanted_eigenpairs": "",
    "wanted_cluster": "k-medians",
    "wanted_align": True,
    "wrong_choices": {},
    "running": False,
    "stage": "",
    "stage_done": 0,
    "stage_words": "",
    "run_problem": "",
    "ready_to_run": False,
}


class Comparing:
    """Two fields, and the run that compares them.

    Parameters
    ----------
    server : trame's Server
    views : Views
    settings : SessionSettings
    turns : Turns
    exploring : Exploring
        Where the result is opened.
    """

    def __init__(
        self,
        server: Any,
        views: Views,
        settings: SessionSettings,
        turns: Turns,
        exploring: Exploring,
    ) -> None:
        self._state, self._views = server.state, views
        self._settings, self._work, self._exploring = settings, Work(turns), exploring
        self._fields: dict[str, OpenedField] = {}
        self._paths: dict[str, Path] = {}
        self._sent: dict[str, bool] = {}
        self._asked = {"base": 0, "perturbed": 0}
        self._runs = 0
        self._waits, self._framed = False, 0.0
        self._state.update(_START)
        change = server.state.change
        change("slide")(self._slid)
        change("isovalue")(self._typed)
        change("array")(self._other_array)
        change("wanted_smooth", "wanted_eigenpairs", "wanted_vertices")(self._check_choices)

    def drawer(self) -> None:
        """Build its part of the drawer."""
        widgets.drawer(self._demo, self._choose, self._run, self._cancel)

    async def close(self) -> None:
        """End what still runs."""
        await self._work.cancel()

    async def list_files(self) -> None:
        """Look what field files there are."""
        found = await asyncio.to_thread(_files, self._settings.roots)
        with self._state as state:
            state.choices = found

    def enter(self) -> None:
        """Show the previews in the views again."""
        self._state.titles = {"base": "Base", "perturbed": "Perturbed"}
        self._state.subtitles, self._state.keys = {"base": "preview", "perturbed": "preview"}, {}
        self._framed = 0.0
        self._preview()

    async def uploaded(self, role: Role, path: Path, name: str) -> None:
        """Take a file that the browser sent; it is read in a process of its own."""
        await self._open(role, path, name, sent=True)

    async def _demo(self) -> None:
        pair = dict(zip(_ROLES, data.water_pair(), strict=True))
        await asyncio.gather(*(self._open(role, path, path.name) for role, path in pair.items()))
        if self._paths == pair and len(self._fields) == 2:  # nothing else was chosen meanwhile
            with self._state as state:
                state.isovalue = "0.05"

    async def _choose(self, role: Role, choice: str | None) -> None:
        """Open a file below one of the folders that the page may read."""
        if choice is None:
            return  # the list's own cross: the file stays
        number, _, name = choice.partition("/")
        try:
            path = confined(self._settings.roots[int(number)], name)
        except (IsovaryError, ValueError, IndexError):
            self._state.run_problem = "file: expected one of the list, got another"
            return
        await self._open(role, path, path.name)

    async def _open(self, role: Role, path: Path, name: str, sent: bool = False) -> None:
        self._asked[role] += 1
        asked = self._asked[role]
        self._drop(role)
        with self._state as state:
            state[f"{role}_name"], state[f"{role}_facts"] = name, "reading…"
            state.run_problem = ""
        field = await _read(path, sent, self._state.array)
        if asked != self._asked[role]:
            return  # another file was taken meanwhile
        if isinstance(field, str):
            with self._state as state:
                state[f"{role}_name"], state[f"{role}_facts"] = "", ""
                state.run_problem = field.replace(str(path), name)
                self._preview()
            return
        self._take(role, field, path, sent)

    def _drop(self, role: Role) -> None:
        self._fields.pop(role, None)
        self._state.ready_to_run = False

    def _take(self, role: Role, field: OpenedField, path: Path, sent: bool) -> None:
        self._fields[role], self._paths[role], self._sent[role] = field, path, sent
        with self._state as state:
            state[f"{role}_facts"] = widgets.facts(field)
            bad = [
                self._state[f"{r}_name"]
                for r in _ROLES
                if r in self._fields and self._fields[r].bad
            ]
            state.ready_to_run = len(self._fields) == 2 and not bad
            if bad:
                state.run_problem = (
                    f"{' and '.join(bad)}: expected finite values, got some that are not; "
                    "find out where they come from [I01]"
                )
            if role == "base":
                self._start_isovalue(field)
            self._framed = 0.0
            self._preview()

    def _start_isovalue(self, field: OpenedField) -> None:
        state = self._state
        state.arrays, state.array = list(field.arrays), field.array or ""
        state.isovalue = _shown(field.isovalue, field.range)
        state.slide = self._slide_of(field.isovalue)

    async def _other_array(self, array: str | None, **_: object) -> None:
        for role in _ROLES:
            field = self._fields.get(role)
            if field is None or not array or array == field.array or array not in field.arrays:
                continue
            await self._open(role, self._paths[role], self._state[f"{role}_name"], self._sent[role])

    def _value_of(self, slide: float) -> float:
        edges = self._fields["base"].edges
        return float(np.interp(slide / _STEPS * (len(edges) - 1), np.arange(len(edges)), edges))

    def _slide_of(self, value: float) -> int:
        edges = self._fields["base"].edges
        return round(float(np.interp(value, edges, np.linspace(0, _STEPS, len(edges)))))

    def _slid(self, slide: float, **_: object) -> None:
        now = self._isovalue()
        if "base" in self._fields and not (np.isfinite(now) and slide == self._slide_of(now)):
            value = self._value_of(float(slide))
            self._state.isovalue = _shown(value, self._fields["base"].range)

    def _typed(self, **_: object) -> None:
        if "base" in self._fields:
            if np.isfinite(self._isovalue()):
                self._state.slide = self._slide_of(self._isovalue())
            self._preview_soon()

    def _isovalue(self) -> float:
        try:
            return float(self._state.isovalue)
        except (TypeError, ValueError):
            return float("nan")

    def _preview_soon(self) -> None:
        """Draw the last isovalue asked for, once the messages that wait have been read."""
        if not self._waits:
            self._waits = True
            asyncio.get_running_loop().call_soon(self._preview)

    def _frame(self, mesh: Mesh) -> None:
        """Look at a preview, and keep the camera until a preview is far larger or smaller."""
        if not mesh.reach / 4 < self._framed < 1.3 * mesh.reach:
            self._framed = 1.2 * mesh.reach
            around = mesh.center + 1.2 * (mesh.points - mesh.center)
            self._views.frame(Mesh(around, mesh.normals, mesh.triangles), *OBLIQUE)

    def _preview(self) -> None:
        self._waits = False
        if self._state.part != "compare":
            return
        isovalue = self._isovalue()
        self._views.clear("base", "perturbed")
        found = {role: preview(field, isovalue) for role, field in self._fields.items()}
        with self._state as state:
            self._views.draw_lines(np.empty((0, 2, 3)))
            for role, shown in found.items():
                mesh = _drawn(shown)
                if len(mesh.triangles):
                    self._frame(mesh)
                    self._views.show(role, mesh, np.tile(_BLUE, (len(mesh.triangles), 1)))
            state.histogram = ""
            if "base" in self._fields:
                base = self._fields["base"]
                state.histogram = histogram_svg(
                    base.counts,
                    base.edges,
                    isovalue,
                    title=f"Samples of {base.name}",
                    logarithmic=base.logarithmic,
                    width=_CHART[0],
                    height=_CHART[1],
                )
            state.preview_words = " ".join(
                f"{role.capitalize()}: {widgets.preview_words(shown)}"
                for role, shown in found.items()
            )
            self._views.push("base", "perturbed")

    async def _run(self) -> None:
        state = self._state
        if self._work.running or not state.ready_to_run:
            return
        self._runs += 1
        if self._check_choices():
            state.run_problem = "\n".join(state.wrong_choices.values())
            return
        options = self._options()
        if len(state.arrays) > 1:
            options["array"] = state.array
        out = self._settings.folder / f"result-{self._runs}"
        paths = self._paths["base"], self._paths["perturbed"]
        state.running, state.run_problem = True, ""
        state.stage, state.stage_done, state.stage_words = "starting", 0, ""
        names = {str(self._paths[role]): str(state[f"{role}_name"]) for role in _ROLES}
        self._work.start(
            compare_files_job,
            (*paths, self._isovalue(), options, out),
            done=self._done,
            failed=partial(self._failed, names),
            progress=self._progressed,
            waiting=self._waiting,
            first=self._exploring.pause,
        )

    def _check_choices(self, **_: object) -> bool:
        """Tell what is wrong with the further choices; whether anything is."""
        state = self._state
        state.wrong_choices = widgets.wrong_choices(
            state.wanted_smooth, state.wanted_eigenpairs, state.wanted_vertices
        )
        return bool(state.wrong_choices)

    def _options(self) -> dict[str, object]:
        """The choices that the page offers, by the names of the command."""
        state = self._state
        options: dict[str, object] = {
            "groups": int(state.wanted_groups),
            "order": int(state.wanted_order),
            "cluster": str(state.wanted_cluster),
            "align": bool(state.wanted_align),
        }
        if str(state.wanted_smooth or "").strip():
            options["smooth"] = float(state.wanted_smooth)
        if str(state.wanted_eigenpairs or "").strip():
            options["eigenpairs"] = int(state.wanted_eigenpairs)
        if str(state.wanted_vertices or "").strip():
            options["vertices"] = int(state.wanted_vertices)
        return options

    async def _cancel(self) -> None:
        if not self._work.running:
            return
        with self._state as state:
            state.stage, state.stage_words = "stopping", ""
        await self._work.cancel()
        with self._state as state:
            state.running, state.stage, state.stage_words = False, "", "cancelled"
        self._exploring.find_groups()

    def _progressed(self, event: Progress) -> None:
        with self._state as state:
            state.stage, state.stage_done = event.stage, round(100 * event.done)
            left = event.seconds_left
            state.stage_words = "" if left is None else f"about {left:.0f} s left"

    def _waiting(self, position: int) -> None:
        with self._state as state:
            state.stage, state.stage_words = "waiting", f"{position} before this one"

    def _done(self, folder: Path) -> None:
        with self._state as state:
            state.running, state.stage, state.stage_words = False, "", ""
        self._opening = asyncio.ensure_future(self._exploring.open_result(folder))

    def _failed(self, names: dict[str, str], message: str) -> None:
        """Tell why there is no result, of files by the names that they had when it began."""
        for path, name in names.items():
            message = message.replace(path, name)
        with self._state as state:
            state.running, state.stage, state.stage_words = False, "", ""
            state.run_problem = message
        self._exploring.find_groups()


def _files(roots: tuple[Path, ...]) -> list[dict[str, str]]:
    """The field files below the folders that the page may read."""
    return [
        {"title": name, "value": f"{number}/{name}"}
        for number, root in enumerate(roots)
        for name in widgets.field_files(root)
    ]


def _shown(value: float, limits: tuple[float, float]) -> str:
    """A value in as many digits as tell a thousandth of the range."""
    low, high = limits
    larger = max(abs(low), abs(high)) / ((high - low) or 1.0)
    digits = 4 + max(0, int(np.ceil(np.log10(max(larger, 1.0)))))
    return f"{value:.{digits}g}"


async def _read(path: Path, sent: bool, array: str | None) -> OpenedField | str:
    """A field, of this array if it has it, or why there is none.

    What was sent is read where it can do no harm.
    """
    if not sent:
        try:
            field = await asyncio.to_thread(opened, path)
            if array and array != field.array and array in field.arrays:
                field = await asyncio.to_thread(opened, path, array)
            return field
        except (IsovaryError, OSError, MemoryError) as error:
            return str(error)
    ended = await start(_opened_of, path, array).wait()
    if isinstance(ended, Finished):
        found: OpenedField = ended.value
        return found
    return ended.message if isinstance(ended, Failed) else "reading was stopped"


def _opened_of(
    path: Path, array: str | None, progress: Callable[[str, float], None]
) -> OpenedField:
    field = opened(path, progress=progress)
    wanted = array and array != field.array and array in field.arrays
    return opened(path, array, progress=progress) if wanted else field


def _drawn(found: Preview) -> Mesh:
    points = found.points + found.offset
    triangles = found.triangles.astype(np.int64)
    return Mesh(points, node_normals(found.points.astype(float), triangles), triangles)


_CHART = 340, 180  # about the drawer's pixels
_BLUE = np.array([86, 140, 190], dtype=np.uint8)
