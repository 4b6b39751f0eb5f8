"""Gaussian cube files, plain or gzipped, by a parser of our own.

Layout: two title lines; atom count, origin, optional number of values a voxel;
three lines of voxel count and axis; one line an atom; for orbital files (negative
atom count) the number of orbitals and their ids; values, z running fastest.
"""

from __future__ import annotations

import gzip
import math
import zlib
from pathlib import Path
from typing import IO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import FileError
from ._checks import Samples, check_memory, check_shape, choose

BOHR = 0.529177210903  # angstrom, CODATA 2018
_LINE = 65536
_CHUNK = 1 << 20
_MOST = 10_000  # values a voxel
_OFF_AXIS = 1e-6  # of the axis's length


class _Header(NamedTuple):
    title: str
    shape: tuple[int, int, int]
    axes: NDArray[np.float64]
    origin: NDArray[np.float64]
    each: int  # values a voxel


def read_cube(path: Path, array: str | None) -> Samples:
    """Samples of a .cube or .cube.gz file, lengths in bohr; ``array`` picks a value a voxel."""
    zipped = path.suffix.lower() == ".gz"
    opener = gzip.open if zipped else open
    size = path.stat().st_size * (1032 if zipped else 1)  # deflate's largest ratio
    try:
        with opener(path, "rt", encoding="latin-1") as stream:
            header = _header(path, stream)
            names = [str(i) for i in range(header.each)]
            chosen = names.index(choose(path, array, names))
            count = math.prod(header.shape) * len(names)
            check_memory(path, count)
            if 2 * count > size:  # a digit and a blank each
                raise _short(path, f"{count} values", f"{path.stat().st_size} bytes")
            values = _values(path, stream, count)
    except (EOFError, OSError, zlib.error) as error:
        raise _short(path, "whole gzip data", str(error)) from None
    volume = values.reshape(*header.shape, len(names))[..., chosen]
    return _turned(path, volume, header)


def _short(path: Path, expected: str, got: str) -> FileError:
    return FileError(
        "F03", f"{path}: expected {expected}, got {got}; the file is truncated or damaged"
    )


def _header(path: Path, stream: IO[str]) -> _Header:
    def words(what: str) -> list[str]:
        line = stream.readline(_LINE)
        if not line.endswith("\n"):
            raise _short(path, what, "the end of the file")
        return line.split()

    title = " ".join(words("a title"))
    words("a second title")
    try:
        first = words("atom count and origin")
        atoms, origin = int(first[0]), np.array(first[1:4], dtype=float)
        rows = [words("a voxel count and axis") for _ in range(3)]
        counts = [int(row[0]) for row in rows]
        axes = np.array([row[1:4] for row in rows], dtype=float).reshape(3, 3)
        for _ in range(abs(atoms)):
            words(f"{abs(atoms)} atoms")
        each = int(first[4]) if len(first) > 4 else 1
        if atoms < 0:
            ids = words("orbital ids")
            each = int(ids[0])
            while len(ids) < 1 + each:
                ids += words("orbital ids")
            each = each if len(ids) == 1 + each else 0
    except (ValueError, IndexError) as error:
        raise _short(path, "a cube header of numbers", str(error)) from None
    if origin.shape != (3,) or not 1 <= each <= _MOST:
        raise _short(path, f"an origin and 1 to {_MOST} values a voxel", f"{first} and {each}")
    scale = _unit(path, counts)
    shape = (abs(counts[0]), abs(counts[1]), abs(counts[2]))
    check_shape(path, shape)
    return _Header(title[:80] or path.stem, shape, axes * scale, origin * scale, each)


def _unit(path: Path, counts: list[int]) -> float:
    """Bohr in the file's length unit: negative voxel counts mean angstrom."""
    if all(count >= 0 for count in counts):
        return 1.0
    if all(count < 0 for count in counts):
        return 1.0 / BOHR
    raise FileError(
        "F14", f"{path}: voxel counts: expected all positive or all negative, got {counts}"
    )


def _values(path: Path, stream: IO[str], count: int) -> NDArray[np.float64]:
    values, filled, rest = np.empty(count), 0, ""
    while chunk := stream.read(_CHUNK):
        words = (rest + chunk).split()
        rest = "" if chunk[-1].isspace() or not words else words.pop()
        if filled + len(words) > count:
            raise _short(path, f"{count} values", "more numbers or text after them")
        try:
            values[filled : filled + len(words)] = np.array(words, dtype=float)
        except ValueError as error:
            raise _short(path, "numbers", str(error)) from None
        filled += len(words)
        if len(rest) > _LINE:
            break
    if rest:  # "1.5E-0" may have been "1.5E-07"
        raise _short(
            path,
            "a line end after the last number",
            f"{rest[:30]!r} (add one if the file is whole)",
        )
    if filled < count:
        raise _short(path, f"{count} values", str(filled))
    return values


def _turned(path: Path, volume: NDArray[np.float64], header: _Header) -> Samples:
    """Axes brought into the order +x, +y, +z by transposing and flipping."""
    lengths = np.linalg.norm(header.axes, axis=1, keepdims=True)
    main = np.abs(header.axes) > _OFF_AXIS * lengths
    if not np.isfinite(header.axes).all() or not ((main.sum(0) == 1) & (main.sum(1) == 1)).all():
        raise FileError(
            "F14",
            f"{path}: axes: expected three along x, y and z, got {header.axes.tolist()}; "
            "a grid that is skewed or rotated must be resampled onto such a box",
        )
    order = [int(np.flatnonzero(main[:, direction])[0]) for direction in range(3)]
    steps = np.array([header.axes[order[direction], direction] for direction in range(3)])
    volume = volume.transpose(order)
    back = tuple(direction for direction in range(3) if steps[direction] < 0)
    last = steps * (np.array(volume.shape) - 1)
    origin = header.origin + np.minimum(last, 0.0)
    return Samples(np.flip(volume, back), np.abs(steps), origin, header.title)
