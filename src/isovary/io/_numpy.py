"""NumPy's .npy and .npz files, never unpickled."""

from __future__ import annotations

import lzma
import math
import re
import struct
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import IO, Any, NamedTuple

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from ..errors import FileError
from ._checks import Samples, check_memory, check_shape, choose

_GRID = ("spacing", "origin")
#: Deflate cannot exceed 1032; more is a bomb.
_MAX_RATIO = 1100
_BROKEN = (
    zipfile.BadZipFile,
    zlib.error,
    lzma.LZMAError,
    struct.error,
    EOFError,
    NotImplementedError,  # an unknown compression
    RuntimeError,  # an encrypted member
    OSError,
    ValueError,
)


class _Header(NamedTuple):
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    end: int


def read_npy(path: Path, array: str | None) -> Samples:
    """Samples of an .npy file; ``array`` may be ``"[i]"`` for a 4-D array."""
    name, index = _split(array, ())
    if name is not None:
        raise FileError("F09", f"{path}: array: expected None or '[0]', got {array!r}")
    with path.open("rb") as stream:
        header = _header(path, stream)
        _check_choice(path, "", header.shape, index)
        with _reported(path):
            values = _values(path, stream, header, path.stat().st_size)
    values = values if index is None else values[index]
    return Samples(values, None, None, path.stem + _bracket(index))


def read_npz(path: Path, array: str | None) -> Samples:
    """Samples, and ``spacing`` and ``origin`` if present, of an .npz file."""
    with _reported(path), zipfile.ZipFile(path) as archive:
        members = _members(path, archive)
        headers = {}
        for key, info in members.items():
            with archive.open(info) as stream:
                headers[key] = _header(path, stream)
        fields = _candidates(path, headers)
        name, index = _split(array, fields)
        key = choose(path, name, fields)
        _check_choice(path, key, headers[key].shape, index)

        def load(key: str) -> NDArray[Any]:
            with archive.open(members[key]) as stream:
                return _values(path, stream, headers[key], members[key].file_size)

        grid = [_vector(path, key, load(key)) if key in members else None for key in _GRID]
        values = load(key)
    return Samples(
        values if index is None else values[index], grid[0], grid[1], key + _bracket(index)
    )


def _bracket(index: int | None) -> str:
    return "" if index is None else f"[{index}]"


def _split(array: str | None, names: tuple[str, ...]) -> tuple[str | None, int | None]:
    """``"s[3]"`` is ("s", 3), ``"[3]"`` is (None, 3); a key that exists is taken as it is."""
    match = re.fullmatch(r"(.*)\[(\d{1,9})\]", array or "", re.ASCII)
    if array in names or match is None:
        return array, None
    return match[1] or None, int(match[2])


def _header(path: Path, stream: IO[bytes]) -> _Header:
    readers = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}
    try:
        shape, _, dtype = readers[npy.read_magic(stream)](stream)
    except Exception as error:  # NumPy's header parser lets many kinds through
        raise FileError(
            "F03",
            f"{path}: expected a NumPy header, got a damaged one ({_line(error)}); write it again",
        ) from None
    if min(shape, default=0) < 0:
        raise FileError("F03", f"{path}: expected a shape, got {shape}; write the file again")
    return _Header(shape, dtype, stream.tell())


def _line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0][:120]


def _values(path: Path, stream: IO[bytes], header: _Header, size: int) -> NDArray[Any]:
    """The array, after its header was checked against the size of the file or zip member."""
    if header.dtype.hasobject:
        raise FileError(
            "F10",
            f"{path}: expected numbers, got pickled Python objects, which are never loaded; "
            "save the array with a numeric dtype",
        )
    if header.dtype.kind not in "biuf":
        raise FileError(
            "F09",
            f"{path}: expected real numbers, got dtype {header.dtype}; save abs() or real parts",
        )
    count = math.prod(header.shape)
    check_memory(path, count)
    end = header.end + count * header.dtype.itemsize
    if end != size:
        raise FileError(
            "F03",
            f"{path}: expected {end} bytes for shape {header.shape} of {header.dtype}, got {size}; "
            "the array is truncated or has bytes left over, write it again",
        )
    stream.seek(0)
    values: NDArray[Any] = npy.read_array(stream, allow_pickle=False)
    return values


def _check_choice(path: Path, key: str, shape: tuple[int, ...], index: int | None) -> None:
    if len(shape) == 4 and (index is None or index >= shape[0]):
        got = "none" if index is None else f"'{key}[{index}]'"
        raise FileError(
            "F09",
            f"{path}: array: expected one of '{key}[0]' .. '{key}[{shape[0] - 1}]' of the "
            f"4-D array of shape {shape}, got {got}; name one, as in read_field(path, '{key}[0]')",
        )
    if len(shape) == 3 and index is not None:
        raise FileError(
            "F09",
            f"{path}: array: expected no index for the 3-D array of shape {shape}, got {index}",
        )
    check_shape(path, shape[1:] if len(shape) == 4 else shape)


@contextmanager
def _reported(path: Path) -> Iterator[None]:
    """Turn what zipfile and NumPy raise on damaged data into a FileError."""
    try:
        yield
    except _BROKEN as error:
        raise FileError(
            "F03",
            f"{path}: expected whole data, got a damaged file ({_line(error)}); write it again",
        ) from None


def _members(path: Path, archive: zipfile.ZipFile) -> dict[str, zipfile.ZipInfo]:
    infos = archive.infolist()
    names = [info.filename for info in infos]
    for info in infos:
        name = PurePosixPath(info.filename.replace("\\", "/"))
        if name.is_absolute() or ".." in name.parts or ":" in info.filename:
            _unsafe(path, f"relative member names, got {info.filename!r}")
        if info.file_size > _MAX_RATIO * max(info.compress_size, 1):
            sizes = f"{info.compress_size} bytes that unpack to {info.file_size}"
            _unsafe(path, f"a compression ratio below {_MAX_RATIO}, got {sizes}")
    if len(set(names)) < len(names) or sum(i.compress_size for i in infos) > path.stat().st_size:
        _unsafe(path, "distinct members, got repeated or overlapping ones")
    return {i.filename.removesuffix(".npy"): i for i in infos if i.filename.endswith(".npy")}


def _unsafe(path: Path, text: str) -> None:
    raise FileError("F11", f"{path}: expected {text}; do not trust this archive, write it again")


def _candidates(path: Path, headers: dict[str, _Header]) -> tuple[str, ...]:
    """Keys that can be a field: three axes of four or more, or four axes."""
    names = tuple(
        key
        for key, header in headers.items()
        if key not in _GRID and len(header.shape) in (3, 4) and min(header.shape[-3:]) >= 4
    )
    if not names:
        listed = ", ".join(f"{key!r} {header.shape}" for key, header in headers.items()) or "none"
        raise FileError(
            "F09",
            f"{path}: expected a 3-D or 4-D array with at least 4 samples along x, y and z, "
            f"got {listed}; save the field as such",
        )
    return names


def _vector(path: Path, key: str, values: NDArray[Any]) -> NDArray[np.float64]:
    if values.shape != (3,):
        raise FileError("F14", f"{path}: {key}: expected 3 numbers, got shape {values.shape}")
    return values.astype(np.float64)
