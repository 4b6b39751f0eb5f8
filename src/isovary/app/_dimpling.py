"""The third part of the page: push dimples into a surface by hand."""

from __future__ import annotations

import asyncio
import os
import re
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import to_hex
from scipy.spatial import cKDTree

from ..color import NEUTRAL
from ..errors import ArgumentError, IsovaryError
from ..geometry import Floats
from ..io import read_surface
from ..io._meshes import save_mesh
from ..names import SHAPES
from ..notes import noted_warnings
from ..quality import mesh_quality
from ..records import Surface
from ..view import _paint as paint
from ..view._tessellate import at_pieces
from . import _dimpling_widgets as widgets
from ._dimple_change import change_between
from ._dimple_depth import strength_for
from ._dimple_history import DimpleHistory, command, disc, python_script
from ._exploring import Exploring
from ._opened_result import size
from ._painting import Drawn, drawn
from ._scene import Mesh, mesh_of
from ._settings import SessionSettings
from ._turns import Turns
from ._views import OBLIQUE, Views
from ._work import Work

_START: dict[str, Any] = {
    "shape": "sphere",
    "shape_name": "",
    "center": None,
    "center_words": "click the surface",
    "radius": 0.5,
    "radius_most": 1.0,
    "charge": 1.0,
    "alpha": 5.0,
    "depth": "",
    "decay": 0.35,
    "steps": 20,
    "can_undo": False,
    "can_redo": False,
    "pushes": 0,
    "moved_words": "",
    "dimple_problem": "",
    "dimple_command": "",
    "dimple_files": [],
    "comparing_dimple": False,
    "deforming": False,
    "saving": False,
    "dimple_stage": "",
    "dimple_notes": [],
}


class Dimpling:
    """A surface, the dimples in it, and the way back.

    Parameters
    ----------
    server : trame's Server
    views : Views
    settings : SessionSettings
    turns : Turns
    exploring : Exploring
        Whose search for groups makes way for a comparison.
    """

    def __init__(
        self,
        server: Any,
        views: Views,
        settings: SessionSettings,
        turns: Turns,
        exploring: Exploring,
    ) -> None:
        self._state, self._views, self._exploring = server.state, views, exploring
        self._settings, self._work = settings, Work(turns)
        self._history: DimpleHistory | None = None
        self._norm: Floats | None = None
        self._sent: tuple[Path, str] | None = None
        self._asked = self._taken = 0  # surfaces: a slow one knows that it comes too late
        self._pushing = asyncio.Lock()  # warnings are caught for all threads: one push at a time
        self._disc_problem = ""
        self._state.update(_START)
        server.state.change("shape")(self._begin)
        server.state.change("radius")(lambda **_: self._mark_disc())

    def drawer(self) -> None:
        """Build its part of the drawer."""
        widgets.drawer(tuple(SHAPES), self)

    async def close(self) -> None:
        """End what still runs."""
        await self._work.cancel()

    def enter(self) -> None:
        """Show the surface in the views again."""
        if self._history is None:
            self._begin()
        else:
            self._frame()
            self._fill()

    async def uploaded(self, _role: str, path: Path, name: str) -> None:
        """Take a surface that the browser sent."""
        self._asked += 1
        asked = self._asked
        try:
            surface, notes = await asyncio.to_thread(_read_noted, path)
        except IsovaryError as error:
            if asked > self._taken:
                with self._state as state:
                    state.dimple_problem = str(error).replace(str(path), name)
            return
        if asked < self._taken:
            return  # another surface was taken meanwhile
        self._taken = asked
        plain = re.sub(r"[^A-Za-z0-9._-]", "_", name)
        used = plain in _SAVED or (self._settings.folder / "out" / plain).exists()
        self._sent = path, f"start-{plain}" if used else plain
        with self._state as state:
            state.shape, state.shape_name = "", name
            self._open(surface, [str(path)], notes)

    def pick(self, place: Floats) -> None:
        """Take the centre of the next dimple: the node nearest to a place."""
        assert self._history is not None
        surface = self._history.current
        center = surface.points[int(cKDTree(surface.points).query(place)[1])]
        self._state.center = [float(x) for x in center]
        self._state.center_words = ", ".join(f"{x:.4g}" for x in center)
        self._mark_disc()

    async def deform(self) -> None:
        """Push the dimple."""
        state, history = self._state, self._history
        if history is None or state.center is None:
            state.dimple_problem = "center: expected a click on the surface first"
            return
        if _too_coarse(history.current):
            return  # the note says so
        flight: dict[str, Any] = {
            "charge": float(state.charge),
            "decay": float(state.decay),
            "steps": int(state.steps),
        }
        center, radius, alpha = state.center, float(state.radius), float(state.alpha)
        try:
            if flight["steps"] > _MOST_STEPS:
                raise ArgumentError("A02", f"steps: expected at most {_MOST_STEPS}")
            with self._busy("deforming"):
                async with self._pushing:
                    if str(state.depth or "").strip():
                        length = _length(state.depth)
                        aim = partial(strength_for, history.current, center, radius, length)
                        alpha = float(f"{await asyncio.to_thread(aim, **flight):.4g}")
                    if self._history is history:
                        state.alpha = alpha
                        self._take(history.push(center, radius, alpha=alpha, **flight))
        except IsovaryError as error:
            if self._history is history:
                state.dimple_problem = str(error)

    @contextmanager
    def _busy(self, button: str) -> Iterator[None]:
        """Let a button show that its work is under way."""
        with self._state as state:
            state[button] = True
        try:
            yield
        finally:
            with self._state as state:
                state[button] = False

    def undo(self) -> None:
        """Take the last dimple back."""
        if self._history is not None:
            self._take(self._history.undo())

    def redo(self) -> None:
        """Push the dimple that was taken back."""
        if self._history is not None:
            self._take(self._history.redo())

    async def compare(self) -> None:
        """Compare the signatures of the surface and of the one it began with."""
        history = self._history
        if history is None or not history.can_undo:
            return
        self._state.comparing_dimple, self._state.dimple_stage = True, "starting"
        self._work.start(
            change_between,
            (history.surfaces[0], history.current),
            done=partial(self._compared, history),
            failed=partial(self._failed, history),
            progress=lambda event: self._tell_stage(event.stage),
            waiting=lambda position: self._tell_stage(f"waiting, {position} before this one"),
            first=self._exploring.pause,
        )

    async def cancel(self) -> None:
        """End the comparison with the start."""
        await self._work.cancel()
        with self._state as state:
            state.comparing_dimple = False
        self._exploring.find_groups()

    async def save(self) -> None:
        """Offer the surface, the command and the script as files."""
        history = self._history
        if history is None:
            return
        try:
            with self._busy("saving"):
                files = await asyncio.to_thread(self._write, history)
        except (IsovaryError, OSError) as error:
            self._state.dimple_problem = str(error)
            return
        if self._history is history:
            with self._state as state:
                state.dimple_files = files

    def _write(self, history: DimpleHistory) -> list[dict[str, str]]:
        out, folder = self._settings.folder / "out", self._settings.folder / "dimpled"
        base, made = history.surfaces[0], history.current
        save_mesh(
            made,
            mesh_quality(made),
            folder,
            title="dimpled on the page",
            choices={"command": self._told(command(history))},
            notes=[],
            timings={},
            arrays={"displacement": made.points - base.points},
        )
        mesh, shell, script = (out / name for name in _SAVED)
        (folder / "mesh.vtu").replace(mesh)
        for path in (shell, script):
            path.unlink(missing_ok=True)  # it may be a link to a file of a result
        shell.write_text(self._told(command(history)), encoding="utf-8")
        script.write_text(self._told(python_script(history)), encoding="utf-8")
        names = list(_SAVED)
        if history.words[0] not in SHAPES and self._sent is not None:
            path, name = self._sent
            (out / name).unlink(missing_ok=True)
            shutil.copy2(path, out / name)
            names.append(name)
        return [{"name": name, "size": size(out / name)} for name in names]

    def _told(self, text: str) -> str:
        """A command or script with the names that files have for the reader."""
        if self._sent is not None:
            text = text.replace(str(self._sent[0]), self._sent[1])
        return text.replace(f"{Path.cwd()}{os.sep}", "")

    def _begin(self, **_: object) -> None:
        shape = self._state.shape
        if self._state.part == "dimple" and shape in SHAPES:
            self._asked += 1
            self._taken = self._asked
            self._state.shape_name = ""
            self._open(SHAPES[shape](4, 2), [shape])

    def _open(self, surface: Surface, words: list[str], notes: Sequence[str] = ()) -> None:
        state = self._state
        state.center, state.center_words = None, "click the surface"
        reach = Mesh(surface.points, surface.points, surface.triangles).reach
        state.radius_most = float(f"{reach:.2g}")
        state.radius = float(f"{reach / 2:.2g}")
        self._history = DimpleHistory.start(surface, words, [*notes, *_too_coarse(surface)])
        if state.part == "dimple":
            self._frame()
        self._take(self._history)

    def _take(self, history: DimpleHistory) -> None:
        self._history, self._norm = history, None
        state = self._state
        if state.comparing_dimple:
            self._work.stop()
            self._exploring.find_groups()
        state.dimple_notes = list(history.notes)
        state.comparing_dimple = False  # what is compared is not this surface
        state.can_undo, state.can_redo = history.can_undo, history.can_redo
        state.pushes, state.dimple_problem = len(history.done), ""
        state.dimple_command, state.dimple_files = self._told(command(history)), []
        moved = np.linalg.norm(history.current.points - history.surfaces[0].points, axis=1)
        state.moved_words = (
            f"{(moved > 0).sum()} of {len(moved)} nodes moved, at most by {moved.max():.3g}"
        )
        if state.part == "dimple":
            self._fill()

    def _frame(self) -> None:
        assert self._history is not None
        self._views.frame(mesh_of(drawn(self._history.surfaces[0])), *OBLIQUE)

    def _fill(self) -> None:
        assert self._history is not None
        surface = drawn(self._history.current)
        mesh = mesh_of(surface)
        self._views.show("perturbed", mesh, np.tile(_CLAY, (len(mesh.triangles), 1)))
        self._views.show("change", mesh, self._colors(surface))
        self._mark_disc()
        self._views.push("perturbed", "change")

    def _colors(self, surface: Drawn) -> np.ndarray:
        """Colours of the change if it is known, else of the displacement; tells their key."""
        state, history = self._state, self._history
        assert history is not None
        state.titles = {"perturbed": "Surface", "change": "Displacement"}
        state.subtitles = {"perturbed": "click: centre of the next dimple", "change": ""}
        first = history.surfaces[0]
        if self._norm is not None:
            values, unit, low = 100 * self._norm, "% of mean HKS", 0.0
            state.titles = state.titles | {"change": "Change of the HKS against the start"}
            state.subtitles = state.subtitles | {"change": "mean size over all scales"}
            colors = paint.NORM_MAP
        else:
            values = ((history.current.points - first.points) * first.normals).sum(axis=1)
            unit, low, colors = "length, along the normal", -1.0, paint.MOVE_MAP
        limit = float(np.abs(values).max())
        low *= limit
        inside = at_pieces(history.current, surface.split, values)
        stops = [to_hex(colors(k / 8)) for k in range(9)]
        key: dict[str, Any] = {
            "low": f"{low:.3g}",
            "high": f"{limit:.3g}",
            "unit": unit,
            "colors": stops,
        }
        if not limit:
            key |= {"colors": [], "unit": ""}
        patches = [] if limit else [{"color": NEUTRAL, "words": "nothing moved"}]
        state.keys = {"change": key | {"patches": patches}, "perturbed": None}
        share = (inside - low) / ((limit - low) or 1.0) if limit else np.full(len(inside), 0.5)
        return np.round(255 * paint.mapped(colors, share)).astype(np.uint8)

    def _mark_disc(self) -> None:
        """Draw the rim of what the next dimple would move."""
        state, history = self._state, self._history
        if state.part != "dimple" or history is None:
            return
        strokes = np.empty((0, 2, 3))
        if state.center is not None:
            try:
                lines, problem = disc(history.current, state.center, float(state.radius)), ""
            except IsovaryError as error:
                lines, problem = (), str(error)
            if problem or state.dimple_problem == self._disc_problem:
                state.dimple_problem = self._disc_problem = problem
            if lines:
                strokes = np.concatenate(
                    [np.stack([line[:-1], line[1:]], axis=1) for line in lines]
                )
        self._views.draw_lines(strokes, ("perturbed", "change"))
        self._views.push("perturbed", "change")

    def _compared(self, history: DimpleHistory, norm: Floats) -> None:
        self._exploring.find_groups()
        if self._history is not history:
            return  # another dimple, or another surface, meanwhile
        with self._state as state:
            self._norm, state.comparing_dimple = norm, False
            if state.part == "dimple":
                self._fill()

    def _tell_stage(self, words: str) -> None:
        with self._state as state:
            state.dimple_stage = words

    def _failed(self, history: DimpleHistory, message: str) -> None:
        self._exploring.find_groups()
        if self._history is not history:
            return
        with self._state as state:
            state.comparing_dimple, state.dimple_problem = False, message


def _read_noted(path: Path) -> tuple[Surface, list[str]]:
    """A surface, and what was repaired in it."""
    with noted_warnings() as notes:
        surface = read_surface(path)
    return surface, list(notes)


def _too_coarse(surface: Surface) -> list[str]:
    """Words if a surface has too few nodes for a dimple."""
    count = len(surface.points)
    if count >= _FEWEST_NODES:
        return []
    return [
        f"Too coarse for a dimple: it has {count} nodes, and {_FEWEST_NODES} are the least. "
        "Refine it and send it again."
    ]


def _length(text: object) -> float:
    try:
        return float(str(text))
    except ValueError:
        raise ArgumentError("A02", f"depth: expected a length, got {text}") from None


_SAVED = "dimpled.vtu", "dimple.sh", "dimple.py"
_MOST_STEPS, _FEWEST_NODES = 1000, 100
_CLAY = np.array([205, 202, 196], dtype=np.uint8)
