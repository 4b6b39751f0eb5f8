"""The header of a PLY file, whether the file can hold what it declares, and its exact points."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple, NoReturn

import numpy as np

from ..errors import FileError
from ..geometry import Floats

_TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2"},
    **{"int": "i4", "uint": "u4", "float": "f4", "double": "f8"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2"},
    **{"int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8"},
}
_FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


class _Property(NamedTuple):
    """A number, or a list of numbers with the type of its length."""

    name: str
    kind: str
    length: str | None


class _Element(NamedTuple):
    """A table: its rows one after the other."""

    name: str
    rows: int
    properties: list[_Property]

    def row(self, order: str) -> np.dtype[np.void]:
        """Layout of a row without lists."""
        return np.dtype([(item.name, order + item.kind) for item in self.properties])


def check_ply(path: Path) -> tuple[int, int | None, Floats | None]:
    """Numbers of points and faces, and the points if they are in double precision.

    FileError F03 if the file is too short for its header, F06 if the header is damaged.
    """
    content = path.read_bytes()
    order, elements, start = _header(path, content)
    if order:
        _check_binary(path, content, order, elements, start)
    else:
        need, got = sum(item.rows for item in elements), content.count(b"\n", start)
        if got < need:
            _short(path, f"{need} lines", f"{got}")
    by_name = {item.name: item for item in elements}
    faces = None if "tristrips" in by_name else 0
    if "face" in by_name:
        faces = by_name["face"].rows
    if "vertex" not in by_name:
        _damaged(path, "an element vertex", f"{list(by_name)[:5]}")
    exact = _exact(path, content[start:], order, elements)
    return by_name["vertex"].rows, faces or None, exact


def _header(path: Path, content: bytes) -> tuple[str, list[_Element], int]:
    """Byte order ("" for text), the elements, and where their rows begin."""
    end = content.find(b"end_header")
    start = content.find(b"\n", end) + 1
    if end < 0 or start == 0:
        _short(path, "end_header", "none")
    order, elements = "?", list[_Element]()
    for line in content[:end].decode("latin-1").splitlines():
        words = line.split()
        try:
            if words[:1] == ["format"]:
                order = _FORMATS[words[1]]
            elif words[:1] == ["element"]:
                elements.append(_Element(words[1], int(words[2]), []))
            elif words[:1] == ["property"]:
                elements[-1].properties.append(_property(words[1:]))
        except (KeyError, IndexError, ValueError):
            _damaged(path, "a PLY header", repr(line[:60]))
    if order == "?" or any(item.rows < 0 for item in elements):
        _damaged(path, "a format and counts", repr(content[:60]))
    return order, elements, start


def _property(words: list[str]) -> _Property:
    if words[0] == "list":
        return _Property(words[3], _TYPES[words[2]], _TYPES[words[1]])
    return _Property(words[1], _TYPES[words[0]], None)


def _check_binary(
    path: Path, content: bytes, order: str, elements: list[_Element], start: int
) -> None:
    """FileError F03 unless the rows of the elements fill the file."""
    for element in elements:
        end = _end(content, order, element, start)
        if end is None or end > len(content):
            _short(path, f"{element.rows} rows of {element.name!r}", "fewer")
        start = end
    if content[start:].strip(b"\r\n\0"):
        _short(path, f"the last row to end at byte {start}", f"{len(content)} bytes")


def _end(content: bytes, order: str, element: _Element, start: int) -> int | None:
    """Where an element's rows end, None if beyond the file."""
    if not any(item.length for item in element.properties):
        return start + element.rows * sum(int(item.kind[1:]) for item in element.properties)
    if element.rows > len(content) - start:
        return None
    first = _row_end(content, order, element, start)
    if first is None or element.rows == 0:
        return first if element.rows else start
    if first == start:
        return None
    width, end = first - start, start + (first - start) * element.rows
    lists = [item for item in element.properties if item.length]
    if len(lists) == 1 and end <= len(content):
        before = element.properties[: element.properties.index(lists[0])]
        place = sum(int(item.kind[1:]) for item in before)
        rows = np.frombuffer(content, np.uint8, end - start, start).reshape(-1, width)
        lengths = rows[:, place : place + int(str(lists[0].length)[1:])]
        if (lengths == lengths[0]).all():
            return end
    for _ in range(element.rows):
        following = _row_end(content, order, element, start)
        if following is None:
            return None
        start = following
    return start


def _row_end(content: bytes, order: str, element: _Element, start: int) -> int | None:
    """Where a row ends, None if beyond the file."""
    for item in element.properties:
        count = 1
        if item.length:
            width = int(item.length[1:])
            head = content[start : start + width]
            if item.length[0] == "f":
                return None
            signed = item.length[0] == "i"
            count = int.from_bytes(head, "big" if order == ">" else "little", signed=signed)
            start += width
        start += count * int(item.kind[1:])
        if count < 0 or start > len(content):
            return None
    return start


def _exact(path: Path, body: bytes, order: str, elements: list[_Element]) -> Floats | None:
    """Points in double precision, which VTK would round; None if they are in single precision."""
    vertex = elements[0]
    kinds = {item.name: item.kind for item in vertex.properties}
    doubles = any(kinds.get(axis) == "f8" for axis in "xyz")
    if vertex.name != "vertex" or not doubles or any(item.length for item in vertex.properties):
        return None
    names = [item.name for item in vertex.properties]
    if len(set(names)) < len(names) or not {"x", "y", "z"} <= set(names):
        _damaged(path, "properties x, y and z", f"{names[:8]}")
    if order:
        table = np.frombuffer(body, vertex.row(order), vertex.rows)
        points: Floats = np.stack([table[axis] for axis in "xyz"], axis=1).astype(float)
        return points
    lines = body.split(b"\n", vertex.rows)[: vertex.rows]
    try:
        numbers = [[float(word) for word in line.split()] for line in lines]
        points = np.array([[row[names.index(axis)] for axis in "xyz"] for row in numbers])
    except (ValueError, IndexError) as error:
        _damaged(path, "numbers", str(error))
    return points.reshape(-1, 3)


def _damaged(path: Path, expected: str, got: str) -> NoReturn:
    raise FileError(
        "F06", f"{path}: expected {expected}, got {got}; the file is damaged, write it again"
    )


def _short(path: Path, expected: str, got: str) -> NoReturn:
    raise FileError(
        "F03",
        f"{path}: expected {expected}, got {got}; the file is truncated or damaged, "
        "write or copy it again",
    )
