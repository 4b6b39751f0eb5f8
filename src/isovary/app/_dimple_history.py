"""Dimples one after the other, with a way back, and the command that makes them again."""

from __future__ import annotations

import os
import shlex
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..deform import Region, _nodes_in, dimple
from ..errors import ArgumentError
from ..geometry import Bools, Floats, Ints, edges_of, linear_triangles
from ..names import SHAPES
from ..notes import noted_warnings
from ..records import Surface


@dataclass(frozen=True)
class Push:
    """One dimple: where, and with which numbers of :func:`isovary.dimple`."""

    center: tuple[float, float, float]
    radius: float
    alpha: float = 5.0
    charge: float = 1.0
    decay: float = 0.35
    steps: int = 20

    @property
    def numbers(self) -> dict[str, Any]:
        """All but the centre, by name."""
        given = asdict(self)
        del given["center"]
        return given


@dataclass(frozen=True, eq=False)
class DimpleHistory:
    """A surface, the dimples pushed into it, and those taken back; made by :meth:`start`.

    Parameters
    ----------
    words : tuple of str
        What follows ``isovary dimple`` to name the first surface.
    pushes : tuple of Push
        All, those taken back included.
    surfaces : tuple of Surface
        The first, and that after each push.
    told : tuple of tuple of str
        What must be known of the first surface, and of each push.
    place : int
        Number of pushes that are not taken back.

    Notes
    -----
    Dimples of equal numbers are those of one call of :func:`isovary.dimple`, in order. Where the
    numbers change the surface goes on as a file would hold it: points and triangles, with normals
    averaged anew. So :func:`command`, which writes such a file, makes the same surface.
    """

    words: tuple[str, ...]
    pushes: tuple[Push, ...]
    surfaces: tuple[Surface, ...]
    told: tuple[tuple[str, ...], ...] = ((),)
    place: int = 0

    @classmethod
    def start(
        cls, surface: Surface, words: Sequence[str], notes: Sequence[str] = ()
    ) -> DimpleHistory:
        """A history without dimples.

        Parameters
        ----------
        surface : Surface
        words : sequence of str
            What ``isovary dimple`` makes it from: a file, or ``sphere``, ``ellipsoid`` or
            ``torus``, perhaps with ``--subdivisions N`` and ``--order N``.
        notes : sequence of str
            What must be known of it, such as what was repaired.

        Raises
        ------
        ArgumentError
            A02 for other words.
        """
        _options(words)
        return cls(tuple(words), (), (surface,), (tuple(notes),))

    @property
    def current(self) -> Surface:
        """The surface as it is now."""
        return self.surfaces[self.place]

    @property
    def done(self) -> tuple[Push, ...]:
        """The pushes that made it."""
        return self.pushes[: self.place]

    @property
    def notes(self) -> tuple[str, ...]:
        """What must be known of the current surface, each note once."""
        told = (note for notes in self.told[: self.place + 1] for note in notes)
        return tuple(dict.fromkeys(told))

    @property
    def can_undo(self) -> bool:
        """Whether there is a push to take back."""
        return self.place > 0

    @property
    def can_redo(self) -> bool:
        """Whether one was taken back, and nothing pushed since."""
        return self.place < len(self.pushes)

    def push(self, center: ArrayLike, radius: float, **numbers: Any) -> DimpleHistory:
        """The history with one more dimple; those taken back are forgotten.

        What :func:`isovary.dimple` warns of goes to :attr:`notes`.

        Parameters
        ----------
        center, radius, **numbers
            As of :func:`isovary.dimple`: ``alpha``, ``charge``, ``decay``, ``steps``.

        Raises
        ------
        ArgumentError
            A03 for a centre that is no point; what :func:`isovary.dimple` raises.
        MeshError
            M03 if triangles are turned over.

        Examples
        --------
        >>> from isovary.shapes import icosphere
        >>> history = DimpleHistory.start(icosphere(3), ["sphere", "--subdivisions", "3"])
        >>> history = history.push([0, 0, 1], 0.7)
        >>> history.can_undo, history.undo().current is history.surfaces[0]
        (True, True)
        """
        found = np.asarray(center, dtype=float)
        if found.shape != (3,):
            raise ArgumentError("A03", f"center: expected shape (3,), got {found.shape}")
        x, y, z = map(float, found)
        new = Push((x, y, z), float(radius), **numbers)
        base = self.current
        if self.place and self.pushes[self.place - 1].numbers != new.numbers:
            base = Surface(base.points, base.triangles)
        with noted_warnings() as notes:
            made = dimple(base, new.center, **new.numbers)
        kept = slice(self.place + 1)
        return replace(
            self,
            pushes=(*self.done, new),
            surfaces=(*self.surfaces[kept], made),
            told=(*self.told[kept], tuple(notes)),
            place=self.place + 1,
        )

    def undo(self) -> DimpleHistory:
        """One push back; the same history if there is none."""
        return replace(self, place=self.place - 1) if self.can_undo else self

    def redo(self) -> DimpleHistory:
        """One push forth that was taken back; the same history if there is none."""
        return replace(self, place=self.place + 1) if self.can_redo else self


def _options(words: Sequence[str]) -> tuple[str, dict[str, int]]:
    """The shape or file that words name, and its options; ArgumentError A02 for others."""
    shape, *rest = words or ("",)
    names, values = rest[::2], rest[1::2]
    known = all(name in ("--subdivisions", "--order") for name in names)
    whole = all(value.isascii() and value.isdigit() for value in values)
    if not shape or shape.startswith("-") or not known or not whole or len(rest) % 2:
        raise ArgumentError(
            "A02",
            "words: expected a file, sphere, ellipsoid or torus, and --subdivisions N or --order "
            f"N, got {shlex.join(words)!r}",
        )
    return shape, {name[2:]: int(value) for name, value in zip(names, values, strict=True)}


def _runs(pushes: Sequence[Push]) -> list[list[Push]]:
    """Pushes of equal numbers that follow one another."""
    runs: list[list[Push]] = []
    for push in pushes:
        if runs and runs[-1][-1].numbers == push.numbers:
            runs[-1].append(push)
        else:
            runs.append([push])
    return runs


def command(history: DimpleHistory, out: str | os.PathLike[str] = "dimpled") -> str:
    """The shell commands that make the current surface again, to the last bit of its points.

    Parameters
    ----------
    history : DimpleHistory
    out : path
        Folder for the result, and the beginning of the names of those before it.

    Returns
    -------
    str
        A line ``isovary dimple ...`` for each run of pushes with equal numbers, which reads what
        the line before it wrote; for a POSIX shell, with absolute paths. Empty without pushes.
    """
    from ..cli._dimple import dimple_surface
    from ..cli._record import command_line

    shape, options = _options(history.words)
    runs = _runs(history.done)
    defaults = {"subdivisions": 4, "order": 2}
    source: str | Path = shape if shape in SHAPES else Path(shape)
    lines = []
    for number, run in enumerate(runs, 1):
        last = number == len(runs)
        folder = Path(out) if last else Path(f"{os.fspath(out)}-{number}")
        given = {"shape": source, "out": folder, "center": [push.center for push in run]}
        made = defaults | (options if number == 1 else {}) | run[0].numbers
        lines.append(command_line("dimple", dimple_surface, given | made))
        source = folder / "mesh.vtu"
    return "".join(f"{line}\n" for line in lines)


def python_script(history: DimpleHistory) -> str:
    """The program in Python that makes the current surface again, as ``surface``.

    Parameters
    ----------
    history : DimpleHistory

    Returns
    -------
    str
        It needs nothing but isovary.
    """
    lines = ["import isovary as iv", "", f"surface = {_first(history.words)}"]
    for number, run in enumerate(_runs(history.done)):
        if number:
            lines.append("surface = iv.Surface(surface.points, surface.triangles)")
        centers = [list(push.center) for push in run]
        numbers = ", ".join(f"{name}={value!r}" for name, value in run[0].numbers.items())
        lines.append(f"surface = iv.dimple(surface, {centers}, {numbers})")
    return "\n".join(lines) + "\n"


def _first(words: Sequence[str]) -> str:
    """The call that makes the first surface."""
    shape, options = _options(words)
    if shape not in SHAPES:
        return f"iv.read_surface({os.path.abspath(shape)!r})"
    fine, order = options.get("subdivisions", 4), options.get("order", 2)
    counts = f"({24 * 2 ** (fine - 2)}, {10 * 2 ** (fine - 2)})"
    calls = {
        "sphere": f"iv.icosphere({fine}, order={order})",
        "ellipsoid": f"iv.ellipsoid((1, 1, 2), {fine}, order={order})",
        "torus": f"iv.torus(1.0, 0.4, {counts}, order={order})",
    }
    return calls[shape]


def disc(surface: Surface, center: ArrayLike, radius: float) -> tuple[Floats, ...]:
    """Lines on a surface around the part that a dimple would move.

    Parameters
    ----------
    surface : Surface
        Drawn in its flat triangles, four for each curved one.
    center : array (3,)
        A point on the surface; length.
    radius : float
        Distance of the lines from the centre, in a straight line; length.

    Returns
    -------
    tuple of array (k, 3)
        The longest first. A line around the part repeats its first point at the end; one that
        meets a rim of an open surface ends there. None if all of a closed component is within.

    Raises
    ------
    ArgumentError
        A02 if no node is within the radius, A02 and A03 as :class:`isovary.deform.Region`.
    """
    region = Region(np.asarray(center, dtype=float), float(radius))
    flat = linear_triangles(surface.triangles)
    edges, of_triangle, _ = edges_of(flat)
    inside = np.zeros(len(surface.points), dtype=bool)
    inside[_nodes_in(surface, region)] = True
    away = surface.points - region.center
    near: Bools = (away**2).sum(axis=1) < region.radius**2
    first, second = edges.T
    crossed = (inside[first] & ~near[second]) | (inside[second] & ~near[first])
    points = np.zeros((len(edges), 3))
    points[crossed] = region.center + _crossings(away[edges[crossed]], region.radius)
    marked = crossed[of_triangle]
    links = of_triangle[marked.sum(axis=1) == 2][marked[marked.sum(axis=1) == 2]].reshape(-1, 2)
    lines = [points[line] for line in _chained(links)]
    return tuple(sorted(lines, key=_length, reverse=True))


def _crossings(ends: Floats, radius: float) -> Floats:
    """Where segments (e, 2, 3), with one end inside of a sphere around 0, leave it."""
    swap = (ends[:, 0] ** 2).sum(axis=1) > (ends[:, 1] ** 2).sum(axis=1)
    start, stop = np.where(swap[:, None, None], ends[:, ::-1], ends).transpose(1, 0, 2)
    along = stop - start
    a, b = (along**2).sum(axis=1), (along * start).sum(axis=1)
    c = (start**2).sum(axis=1) - radius**2
    share = (np.sqrt(b**2 - a * c) - b) / a
    found: Floats = start + share[:, None] * along
    return found


def _chained(links: Ints) -> list[Ints]:
    """Pairs of numbers put together to lines: those with ends first, then the closed ones."""
    around: dict[int, list[int]] = {}
    for one, other in links.tolist():
        around.setdefault(one, []).append(other)
        around.setdefault(other, []).append(one)
    lines = []
    for begin in sorted(around, key=lambda node: len(around[node]) != 1):
        line = [begin]
        while around[line[-1]]:
            follower = around[line[-1]].pop()
            around[follower].remove(line[-1])
            line.append(follower)
        if len(line) > 1:
            lines.append(np.array(line))
    return lines


def _length(line: Floats) -> float:
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())
