"""What the page shows of a folder that ``isovary compare`` wrote."""

from __future__ import annotations

import json
import os
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from ..difference import change_norm
from ..errors import CorrespondenceError, FileError, IsovaryError
from ..extrinsic import Kind
from ..geometry import Bools, Floats, Ints, frozen
from ..io._checks import check_file
from ..io._child import run_child
from ..io._surface_checks import check_content
from ..records import Surface
from ..signature import (
    SignatureKind,
    global_point_signature,
    heat_kernel_signature,
    scale_invariant_heat_kernel_signature,
    signature_kind,
    wave_kernel_signature,
)

_CHILD = Path(__file__).with_name("_saved_child.py")
_NODES_OF_CELL = {5: 3, 22: 6}  # of VTK's flat and of its curved triangle
_SIGNATURES = (
    heat_kernel_signature,
    scale_invariant_heat_kernel_signature,
    wave_kernel_signature,
    global_point_signature,
)
_AGAIN = "run isovary compare again"
Arrays = dict[str, np.ndarray]


@dataclass(frozen=True, eq=False, repr=False)
class SavedResult:
    """A comparison as it was saved: both surfaces, signatures, change, noise and groups.

    The base has n nodes, the perturbed surface q; C is the number of the signature's columns.

    Parameters
    ----------
    folder : Path
        Where it was read from.
    base, perturbed : Surface
        Both where their fields have them; nothing is aligned. Normals are averaged from the
        triangles.
    partners : array (n, 3)
        Where each node of the base lies on the perturbed surface; NaN without a partner.
    base_signature, perturbed_signature : array (n, C)
        At the base's nodes and at their partners, NaN rows without; 1/length^2 for the heat
        kernel signature.
    perturbed_own_signature : array (q, C)
        At the perturbed surface's nodes.
    change, noise_floor : array (n, C)
        Scaled change, base minus perturbed, and its numerical error; NaN without a partner.
    kind : SignatureKind
        Names, unit and axis of the signature; ``kind.per_time`` if the columns are times.
    columns : array (C,)
        Each column's diffusion time (length^2), energy, frequency or number.
    found : array (n,)
        True where there is a partner.
    distance : array (n,)
        Signed distance to the partner along the normal; length, NaN without.
    strain : array (n,)
        Largest change of a length, relative to it; NaN without a partner.
    kind_of_change : array (n,)
        As :class:`isovary.Kind`.
    significant : array (n,)
        True where the change exceeded twice the noise floor.
    labels : array (n,)
        Group of each node, -1 for none.
    summary : dict
        The content of ``summary.json``.
    """

    folder: Path
    base: Surface
    perturbed: Surface
    partners: Floats
    base_signature: Floats
    perturbed_signature: Floats
    perturbed_own_signature: Floats
    change: Floats
    noise_floor: Floats
    kind: SignatureKind
    columns: Floats
    found: Bools
    distance: Floats
    strain: Floats
    kind_of_change: Ints
    significant: Bools
    labels: Ints
    summary: dict[str, Any]

    @property
    def same_mesh(self) -> bool:
        """Whether the perturbed surface has the base's triangles, node for node."""
        return np.array_equal(self.base.triangles, self.perturbed.triangles)

    @property
    def choices(self) -> dict[str, Any]:
        """Every choice, default or not, that made the result."""
        choices: dict[str, Any] = self.summary["choices"]
        return choices

    @property
    def count(self) -> int:
        """Number of groups in the file."""
        return 1 + int(self.labels.max(initial=-1))

    @property
    def known(self) -> Bools:
        """Mask (n,) of the nodes whose change is known in every column."""
        known: Bools = self.found & np.isfinite(self.change_norm)
        return known

    @property
    def change_norm(self) -> Floats:
        """Mean absolute scaled change over the columns (n,), NaN without a partner."""
        return change_norm(self.change)

    def __repr__(self) -> str:
        return (
            f"SavedResult({self.folder.name}, {len(self.base.points)} nodes, "
            f"{len(self.columns)} columns, {self.count} groups)"
        )


def read_result(folder: str | os.PathLike[str]) -> SavedResult:
    """Read a folder that ``isovary compare`` wrote, or refuse it.

    Parameters
    ----------
    folder : path
        With ``change.vtu``, ``perturbed.vtu`` and ``summary.json``.

    Returns
    -------
    SavedResult

    Raises
    ------
    FileError
        F01 missing or unreadable, F02 empty, F03 truncated, F04 no result of a comparison or
        one of another version, F05 no mesh, F06 damaged, F09 arrays that are missing or have
        other shapes, F12 XML with a DOCTYPE.
    CorrespondenceError
        C09 if the files belong to different results.

    Notes
    -----
    Cost: VTK parses each grid in a child process, both at once, 0.5 s to start; 0.3 s more for
    10 000 nodes and 100 columns, and 40 MB of memory.
    """
    place = Path(folder)
    summary = _summary(place)
    with ThreadPoolExecutor(2) as pool:  # each waits for a process of its own
        change, own = pool.map(_Grid, (place / "change.vtu", place / "perturbed.vtu"))
    kind, name = _kind(change)
    columns = change.field(name)
    if not np.array_equal(columns, own.field(name)):
        _mixed(place, f"the same {name} in change.vtu and perturbed.vtu", "others")
    base, count = change.surface, len(columns)
    if len(base.points) != summary["counts"].get("nodes"):
        _mixed(
            place,
            f"{summary['counts'].get('nodes')} nodes in change.vtu, as summary.json says",
            f"{len(base.points)}",
        )
    return SavedResult(
        folder=place,
        base=base,
        perturbed=own.surface,
        partners=change.point("partner", 3),
        base_signature=change.point(f"{kind.short}_base", count),
        perturbed_signature=change.point(f"{kind.short}_perturbed", count),
        perturbed_own_signature=own.point(kind.short, count),
        change=change.point(f"{kind.short}_change", count),
        noise_floor=change.point("noise_floor", count),
        kind=kind,
        columns=columns,
        found=change.whole("partner_found", (0, 1)).astype(bool),
        distance=change.point("normal_displacement"),
        strain=change.point("strain"),
        kind_of_change=change.whole("kind_of_change", (min(Kind), max(Kind))),
        significant=change.whole("significant", (0, 1)).astype(bool),
        labels=change.whole("group", (-1, len(base.points) - 1)),
        summary=summary,
    )


def _summary(folder: Path) -> dict[str, Any]:
    """What ``summary.json`` holds; FileError unless a comparison of this version wrote it."""
    if not folder.is_dir():
        got = "a file" if folder.exists() else "no such folder"
        raise FileError("F01", f"{folder}: expected a folder of results, got {got}; check the path")
    path = folder / "summary.json"
    if not path.exists():
        _no_result(folder, "one without summary.json")
    check_file(path)
    try:
        summary = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise FileError(
            "F06",
            f"{path}: expected JSON, got a fault ({str(error)[:200]}); it is damaged, {_AGAIN}",
        ) from None
    if not isinstance(summary, dict) or not isinstance(summary.get("isovary"), str):
        _no_result(folder, "a summary.json of something else")
    _check_version(folder, summary["isovary"])
    parts = [summary.get(name) for name in ("choices", "counts")]
    if not all(isinstance(part, dict) for part in parts) or not (folder / "change.vtu").exists():
        _no_result(folder, "the folder of another command, or one that lacks files")
    return summary


def _check_version(folder: Path, wrote: str) -> None:
    """FileError F04 unless the first two numbers of the version are this one's."""
    here = version("isovary")
    if wrote.split(".")[:2] != here.split(".")[:2]:
        raise FileError(
            "F04",
            f"{folder}: expected a result of isovary {here}, got one of {wrote[:40]}; "
            f"{_AGAIN}, or open it with that version",
        )


def _no_result(folder: Path, got: str) -> NoReturn:
    raise FileError(
        "F04",
        f"{folder}: expected a folder that isovary compare wrote, got {got}; name another one",
    )


def _mixed(folder: Path, expected: str, got: str) -> NoReturn:
    raise CorrespondenceError(
        "C09", f"{folder}: expected {expected}, got {got}; files of two results? {_AGAIN}"
    )


def _kind(grid: _Grid) -> tuple[SignatureKind, str]:
    """What the signature is, by the arrays' names, and what its columns are called."""
    kinds = {kind.short: kind for kind in (signature_kind(method) for method in _SIGNATURES)}
    ends = "_base", "_perturbed", "_change"
    shorts = [
        name[: -len(ends[0])]
        for name in grid.names
        if name.endswith(ends[0]) and all(name[: -len(ends[0])] + end in grid.names for end in ends)
    ]
    if len(shorts) != 1:
        grid.lacks("one signature, of base and perturbed, and its change", f"{len(shorts)}")
    short, times = shorts[0], "times" in grid.fields
    if short in kinds:
        return kinds[short], "times" if kinds[short].per_time else "columns"
    if not times:
        grid.lacks(f"a signature among {', '.join(kinds)}, or one over times", short)
    heat = signature_kind(heat_kernel_signature)
    return replace(heat, short=short, title=short), "times"


class _Grid:
    """A grid with its arrays, as VTK reads it in a child process; FileError otherwise."""

    def __init__(self, path: Path) -> None:
        self.path = path
        check_file(path)
        promise = check_content(path, ".vtu")
        with tempfile.TemporaryDirectory(prefix="isovary-") as folder:
            output = Path(folder) / "grid.npz"
            report = run_child(_CHILD, path, str(output))
            self._check(report, promise.points, promise.cells)
            with np.load(output, allow_pickle=False) as arrays:
                loaded = {name: arrays[name] for name in arrays.files}
        width = _NODES_OF_CELL[report["cells"][0]]
        self.surface = self._surface(loaded.pop("points"), loaded.pop("nodes"), width)
        self._points: Arrays = _named(loaded, "point ")
        self.fields: Arrays = _named(loaded, "field ")

    @property
    def names(self) -> list[str]:
        """Names of the arrays of nodes."""
        return list(self._points)

    def field(self, name: str) -> Floats:
        """A field array that rises (C,)."""
        values = frozen(self.fields.get(name, np.empty(0)))
        if values.ndim != 1 or not len(values) or not (np.diff(values) > 0).all():
            self.lacks(f"a field array {name!r} of numbers that rise", f"shape {values.shape}")
        if not np.isfinite(values).all():
            self.lacks(f"finite {name}", "NaN or infinity")
        return values

    def point(self, name: str, width: int | None = None) -> Floats:
        """An array of nodes (n,) or (n, width)."""
        values = self._points.get(name)
        rows = len(self.surface.points)
        if values is None:
            self.lacks(f"an array {name!r}", "none")
        if values.ndim == 1 and width == 1:
            values = values[:, None]
        shape = (rows,) if width is None else (rows, width)
        if values.shape != shape:
            self.lacks(f"an array {name!r} of shape {shape}", f"{values.shape}")
        return frozen(values)

    def whole(self, name: str, between: tuple[int, int]) -> Ints:
        """An array (n,) of whole numbers of a range."""
        values = self.point(name)
        low, high = between
        if not ((values >= low) & (values <= high) & (values % 1 == 0)).all():
            self.lacks(f"whole numbers from {low} to {high} in {name!r}", "others")
        return frozen(values, np.int64)

    def lacks(self, expected: str, got: str) -> NoReturn:
        """FileError F09."""
        raise FileError("F09", f"{self.path}: expected {expected}, got {got}; {_AGAIN}")

    def _check(self, report: dict[str, Any], points: int | None, cells: int | None) -> None:
        """FileError F05 or F06 unless VTK read triangles of one kind, as many as promised."""
        if report["log"]:
            said = " ".join(report["log"].split())[:500]
            raise FileError("F06", f"{self.path}: expected VTK to read it, got: {said}; {_AGAIN}")
        if len(report["cells"]) != 1 or report["cells"][0] not in _NODES_OF_CELL:
            raise FileError(
                "F05",
                f"{self.path}: expected flat or curved triangles, got cells of the VTK types "
                f"{report['cells']}; {_AGAIN}",
            )
        if (points, cells) != (report["points"], report["count"]):
            raise FileError(
                "F06",
                f"{self.path}: expected {points} points and {cells} cells as its header says, "
                f"got {report['points']} and {report['count']} from VTK; {_AGAIN}",
            )

    def _surface(self, points: Floats, nodes: Ints, width: int) -> Surface:
        if len(nodes) % width:
            raise FileError(
                "F06",
                f"{self.path}: expected {width} nodes a triangle, got {len(nodes)} in all; "
                f"{_AGAIN}",
            )
        try:
            return Surface(points, nodes.reshape(-1, width))
        except IsovaryError as error:
            raise FileError("F06", f"{self.path}: {error.message}; {_AGAIN}") from None


def _named(arrays: Arrays, head: str) -> Arrays:
    """The arrays whose names begin so, under the rest of their names."""
    return {name[len(head) :]: array for name, array in arrays.items() if name.startswith(head)}
