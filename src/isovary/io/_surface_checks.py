"""What is checked in a mesh file before VTK sees it, and against its counts afterwards.

VTK's PLY reader crashes on damaged files, and several readers return half a mesh
without a complaint where a file was cut off.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from ..errors import FileError
from ..geometry import Floats
from ._checks import guess_suffix
from ._ply import check_ply
from ._vti_header import Array, Piece, check_lengths, read_header, whole_number

SUFFIXES = (".vtp", ".vtu", ".vtk", ".ply", ".stl", ".obj", ".off")
_HEADS = {b"ply": ".ply", b"OFF": ".off", b"solid": ".stl"}
_XML = {b'"PolyData"': ".vtp", b'"UnstructuredGrid"': ".vtu"}


@dataclass(frozen=True)
class Promise:
    """What a file's header promises: numbers of points and cells, None if it does not say.

    ``exact`` are points that were read here because VTK would round them.
    """

    points: int | None = None
    cells: int | None = None
    exact: Floats | None = None

    def check(self, path: Path, report: dict[str, Any]) -> None:
        """FileError F06 if VTK found other numbers of points or cells."""
        found = {"points": report["points"], "cells": sum(report["cells"].values())}
        for name, promised in (("points", self.points), ("cells", self.cells)):
            if promised is not None and promised != found[name]:
                raise FileError(
                    "F06",
                    f"{path}: expected {promised} {name} as its header says, got {found[name]} "
                    "from VTK; the file is damaged",
                )

    def points_of(self, path: Path, points: Floats) -> Floats:
        """The exact points, if they are VTK's up to its rounding; else FileError F06."""
        if self.exact is None:
            return points
        with np.errstate(over="ignore"):
            rounded = self.exact.astype(np.float32)
        if not np.allclose(points, rounded, rtol=1e-6, atol=1e-30, equal_nan=True):
            raise FileError(
                "F06", f"{path}: expected the points that VTK reads, got others; it is damaged"
            )
        return self.exact


def check_suffix(path: Path) -> str:
    """The suffix, if isovary reads it and the first bytes fit; else FileError F04."""
    suffix, guess = path.suffix.lower(), _guess(path)
    if suffix not in SUFFIXES:
        looks = f", whose content looks like {guess}" if guess else ""
        remedy = "rename it" if guess in SUFFIXES else "convert it to one of these"
        raise FileError(
            "F04",
            f"{path}: expected a suffix among {', '.join(SUFFIXES)}, got {suffix!r}{looks}; "
            f"{remedy}{_is_field(suffix)}",
        )
    free = suffix in (".stl", ".obj") and guess is None  # formats without a magic number
    if guess != suffix and not free:
        found = f"a file that looks like {guess}" if guess else "bytes of another format"
        remedy = "rename it" if guess in SUFFIXES else "check how it was written"
        raise FileError(
            "F04",
            f"{path}: expected the content of a {suffix} file, got {found}; "
            f"{remedy}{_is_field(guess or '')}",
        )
    return suffix


def _is_field(suffix: str) -> str:
    fields = (".vti", ".npy", ".npz", ".cube", ".gz")
    return ", or read_field, if it holds a scalar field" if suffix in fields else ""


def _guess(path: Path) -> str | None:
    with path.open("rb") as stream:
        head = stream.read(1024)
    if b"<VTKFile" in head:
        kind = next((suffix for name, suffix in _XML.items() if name in head), None)
        return kind or guess_suffix(path)
    if head.startswith(b"solid") and path.suffix.lower() == ".obj":
        return None
    return next((s for magic, s in _HEADS.items() if head.startswith(magic)), guess_suffix(path))


def check_content(path: Path, suffix: str) -> Promise:
    """What the file promises; FileError F03, F04, F06 or F12 if it cannot be whole."""
    if suffix in (".vtp", ".vtu"):
        return _check_xml(path, "PolyData" if suffix == ".vtp" else "UnstructuredGrid")
    if suffix == ".stl":
        return _check_stl(path)
    if suffix == ".ply":
        return Promise(*check_ply(path))
    if suffix == ".vtk":
        with path.open("rb") as stream:
            text = stream.read(1024).split(b"\n")[2:3] == [b"ASCII"]
        return _check_text(path) if text else Promise()
    return _check_text(path)


def _check_text(path: Path) -> Promise:
    with path.open("rb") as stream:
        if b"\0" in stream.read(1 << 16):
            raise FileError(
                "F04",
                f"{path}: expected text, got bytes of another format; check how it was written",
            )
        stream.seek(-1, 2)
        if stream.read() not in (b"\n", b"\r"):
            _cut(path, "a line end after the last line", "none", "; if it is whole, add one")
    return Promise()


def _check_stl(path: Path) -> Promise:
    size = path.stat().st_size
    with path.open("rb") as stream:
        head = stream.read(1024)
        stream.seek(max(0, size - 1024))
        tail = stream.read()
    count = int.from_bytes(head[80:84], "little")
    if size >= 84 and size == 84 + 50 * count:
        return Promise(cells=count)
    if head.lstrip().startswith(b"solid") and b"\0" not in head:
        if b"endsolid" not in tail:
            _cut(path, "endsolid at the end", repr(tail[-20:]))
        return Promise()
    expected = f"84 + 50 x {count} bytes, as its header says" if size >= 84 else "84 bytes or more"
    _cut(path, expected, f"{size}")


def _cut(path: Path, expected: str, got: str, remedy: str = "") -> NoReturn:
    raise FileError(
        "F03",
        f"{path}: expected {expected}, got {got}; the file is truncated or damaged, "
        f"write or copy it again{remedy}",
    )


def _check_xml(path: Path, kind: str) -> Promise:
    header = read_header(path, kind)
    check_lengths(path, header, _tuples)
    pieces = header.pieces
    return Promise(
        sum(_number(path, piece, "Points") for piece in pieces),
        sum(_cell_count(path, piece) for piece in pieces),
    )


def _tuples(path: Path, piece: Piece, array: Array) -> int | None:
    """Number of tuples of an array of a mesh, None if the header does not tell."""
    if array.section in ("Points", "PointData"):
        return _number(path, piece, "Points")
    if array.section == "CellData":
        return _cell_count(path, piece)
    return (
        _number(path, piece, array.section)
        if array.attributes.get("Name") in ("offsets", "types")
        else None
    )


def _cell_count(path: Path, piece: Piece) -> int:
    return sum(
        _number(path, piece, name) for name in ("Cells", "Verts", "Lines", "Strips", "Polys")
    )


def _number(path: Path, piece: Piece, name: str) -> int:
    return whole_number(path, piece.attributes, f"NumberOf{name}", "0")
