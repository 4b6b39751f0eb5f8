"""What every reader checks before it trusts a file, and what it hands back."""

from __future__ import annotations

import math
import os
import stat
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import FileError

#: ScalarField keeps float64 samples, spline coefficients and work arrays.
BYTES_PER_VALUE = 40
MAGIC = {
    ".npy": b"\x93NUMPY",
    ".npz": b"PK\x03\x04",
    ".cube.gz": b"\x1f\x8b",
    ".vtk": b"# vtk DataFile",
    ".h5": b"\x89HDF",
    ".png": b"\x89PNG",
}
_XML = b"<VTKFile"


class Samples(NamedTuple):
    """What a file holds: samples [x, y, z], and the grid if the file states it."""

    values: NDArray[Any]
    spacing: NDArray[np.float64] | None
    origin: NDArray[np.float64] | None
    name: str


def check_file(path: Path) -> int:
    """Size of a readable, regular, non-empty file in bytes; else FileError F01 or F02."""
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):
            raise OSError(0, "it is a folder or a device")
        with path.open("rb"):
            pass
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise FileError(
            "F01", f"{path}: expected a readable file, got: {reason}; check the path and its rights"
        ) from None
    if status.st_size == 0:
        raise FileError("F02", f"{path}: expected data, got an empty file; write it again")
    return status.st_size


def guess_suffix(path: Path) -> str | None:
    """Suffix that fits the first bytes of a file, or None."""
    with path.open("rb") as stream:
        head = stream.read(1024)
    if _XML in head:
        return ".vti" if b"ImageData" in head else None
    return next((suffix for suffix, magic in MAGIC.items() if head.startswith(magic)), None)


def check_magic(path: Path, suffix: str) -> None:
    """FileError F04 if the first bytes belong to another format than the suffix."""
    guess = guess_suffix(path)
    expected = None if suffix == ".cube" else suffix
    if guess == expected:
        return
    found = f"a file that looks like {guess}" if guess else "bytes of another format"
    remedy = "rename it" if guess else "check how it was written"
    raise FileError(
        "F04", f"{path}: expected the content of a {suffix} file, got {found}; {remedy}"
    )


def check_memory(path: Path, count: int) -> None:
    """FileError F08 if a field of ``count`` samples cannot fit into this computer's memory."""
    try:
        memory: float = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):  # not a POSIX system
        memory = math.inf
    need = count * BYTES_PER_VALUE
    if need > memory:
        raise FileError(
            "F08",
            f"{path}: expected a field that fits into {memory:.3g} bytes of memory, got {count} "
            f"samples that need {need:.3g}; crop or coarsen it, or check the file's header",
        )


def check_shape(path: Path, shape: Sequence[int]) -> None:
    """FileError F05 unless there are at least four samples along each of three axes."""
    if len(shape) != 3 or min(shape) < 4:
        raise FileError(
            "F05",
            f"{path}: expected a volume with at least 4 samples along each axis, "
            f"got shape {tuple(shape)}; a cubic spline needs four",
        )


def check_grid(
    path: Path, spacing: NDArray[np.float64] | None, origin: NDArray[np.float64] | None
) -> None:
    """FileError F14 unless the file's spacing is positive and its origin finite, 3 numbers each."""
    for name, vector in (("spacing", spacing), ("origin", origin)):
        if vector is None:
            continue
        good = vector.shape == (3,) and np.isfinite(vector).all()
        if not good or (name == "spacing" and not (vector > 0).all()):
            kind = "positive" if name == "spacing" else "finite"
            raise FileError(
                "F14",
                f"{path}: {name}: expected 3 {kind} numbers, got {vector.tolist()}; "
                "correct the file",
            )


def choose(path: Path, array: str | None, names: Sequence[str]) -> str:
    """The array to read: the one asked for, or the only one; else F09."""
    listed = ", ".join(repr(name) for name in names[:20])
    if array is not None:
        if array in names:
            return array
        raise FileError("F09", f"{path}: array: expected one of {listed}, got {array!r}")
    if len(names) == 1:
        return names[0]
    raise FileError(
        "F09",
        f"{path}: array: expected a choice among {listed}, got none; "
        f"name one, as in read_field(path, {names[0]!r})",
    )
