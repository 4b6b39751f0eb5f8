"""The XML header of a VTK file, and whether the file can hold what it declares.

VTK's own reader fills what it does not find with leftover memory: data cut from an
uncompressed array and pieces that leave a gap both give a full-size field without
a complaint. So extents and lengths are checked here; surfaces (.vtp, .vtu) pass the
same checks as images.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from ..errors import FileError
from ._checks import check_memory, check_shape

_SUFFIXES = {
    "ImageData": ".vti",
    "PImageData": ".pvti",
    "PolyData": ".vtp",
    "RectilinearGrid": ".vtr",
    "StructuredGrid": ".vts",
    "UnstructuredGrid": ".vtu",
}
BYTES = {f"{sign}Int{8 * size}": size for sign in ("", "U") for size in (1, 2, 4, 8)}
BYTES |= {"Float32": 4, "Float64": 8}
#: Largest ratio each compressor can reach.
_RATIOS = {
    "": 1,
    "vtkZLibDataCompressor": 1100,
    "vtkLZ4DataCompressor": 300,
    "vtkLZMADataCompressor": 20000,
}
#: The elements whose arrays count.
_SECTIONS = ("PointData", "CellData", "Points", "Cells", "Verts", "Lines", "Strips", "Polys")
_REMEDIES = {"ImageData": "resample the data onto a regular grid and write a .vti file"}
Attributes = dict[str, str]


@dataclass
class Array:
    """A DataArray: where it stands, its attributes, its text's characters and words."""

    section: str
    attributes: Attributes
    length: int = 0
    words: int = 0


@dataclass
class Piece:
    """A piece of the data and its arrays."""

    attributes: Attributes
    arrays: list[Array] = field(default_factory=list)


@dataclass
class Header:
    """What the XML declares.

    ``image`` are the attributes of the element of the file's type, ``appended`` is the tag of
    the appended data and its byte, ``others`` whether there are arrays outside of the pieces.
    """

    root: Attributes = field(default_factory=dict)
    image: Attributes = field(default_factory=dict)
    pieces: list[Piece] = field(default_factory=list)
    appended: tuple[Attributes, int] = field(default_factory=lambda: ({}, 0))
    others: bool = False

    def named(self, section: str) -> dict[str, Attributes]:
        """Attributes of the arrays of PointData or CellData, by name."""
        return {
            array.attributes["Name"]: array.attributes
            for piece in self.pieces
            for array in piece.arrays
            if array.section == section and "Name" in array.attributes
        }


class _Done(Exception):  # noqa: N818
    """The XML ends: binary data may follow."""


class _Parser:
    """Fills a Header from the events of expat."""

    def __init__(self, path: Path, kind: str) -> None:
        self.path, self.kind, self.header = path, kind, Header()
        self.expat = expat.ParserCreate()
        self.expat.StartElementHandler = self.start
        self.expat.EndElementHandler = self.end
        self.expat.CharacterDataHandler = self.text
        self.expat.StartDoctypeDeclHandler = self.doctype
        self.expat.EntityDeclHandler = self.doctype
        self._section = ""
        self._array: Array | None = None
        self._inside_word = False
        self._inner = 0  # depth inside of an array: its InformationKey has text of its own

    def doctype(self, *_: object) -> NoReturn:
        raise FileError(
            "F12",
            f"{self.path}: expected plain XML, got a DOCTYPE or ENTITY declaration; "
            "VTK writes none, do not trust this file",
        )

    def start(self, tag: str, attributes: Attributes) -> None:
        header = self.header
        self._inner += self._array is not None
        if not header.root:
            _check_root(self.path, tag, attributes, self.kind)
            header.root = attributes
        elif tag == self.kind:
            header.image = attributes
        elif tag == "Piece":
            header.pieces.append(Piece(attributes))
        elif tag in _SECTIONS:
            self._section = tag
        elif tag == "AppendedData":
            header.appended = attributes, self.expat.CurrentByteIndex
            raise _Done
        elif tag in ("DataArray", "Array"):
            if not self._section or not header.pieces:
                header.others = True
                return
            self._array = Array(self._section, attributes)
            header.pieces[-1].arrays.append(self._array)
            self._inside_word = False

    def end(self, tag: str) -> None:
        if tag == self._section:
            self._section = ""
        elif tag in ("DataArray", "Array"):
            self._array = None
        self._inner = max(self._inner - 1, 0) if self._array is not None else 0

    def text(self, data: str) -> None:
        if self._array is not None and not self._inner:
            words = data.split()
            self._array.length += sum(map(len, words))
            goes_on = self._inside_word and not data[0].isspace()  # expat cuts where it likes
            self._array.words += len(words) - goes_on
            self._inside_word = not data[-1].isspace()


def read_header(path: Path, kind: str = "ImageData") -> Header:
    """Parse the XML up to the appended data; FileError F03, F04, F06 or F12."""
    _check_end(path)
    parser = _Parser(path, kind)
    try:
        with path.open("rb") as stream:
            while chunk := stream.read(1 << 16):
                parser.expat.Parse(chunk, False)
        parser.expat.Parse(b"", True)
    except _Done:
        pass
    except expat.ExpatError as error:
        raise FileError(
            "F06", f"{path}: expected XML, got a syntax error ({error}); write the file again"
        ) from None
    return parser.header


def _check_end(path: Path) -> None:
    with path.open("rb") as stream:
        stream.seek(max(0, path.stat().st_size - 256))
        tail = stream.read().rstrip(b" \t\r\n\0")
    if not tail.endswith(b"</VTKFile>"):
        raise FileError(
            "F03",
            f"{path}: expected </VTKFile> at the end, got {tail[-20:]!r}; "
            "the file is truncated, write or copy it again",
        )


def _check_root(path: Path, tag: str, attributes: Attributes, expected: str) -> None:
    kind = attributes.get("type", "")
    if tag == "VTKFile" and kind == expected:
        return
    suffix = f", a {_SUFFIXES[kind]} file" if kind in _SUFFIXES else ""
    remedy = _REMEDIES.get(expected, "convert it, or rename it if only its suffix is wrong")
    raise FileError(
        "F04",
        f"{path}: expected a VTKFile of type {expected}, got {tag} {kind!r}{suffix}; {remedy}",
    )


def numbers(path: Path, attributes: Attributes, name: str, default: str) -> NDArray[np.float64]:
    """Numbers of an attribute, as many as the default has; else FileError F06."""
    text = attributes.get(name, default)
    try:
        values = np.array([float(word) for word in text.split()])
    except ValueError:
        values = np.empty(0)
    if len(values) != len(default.split()):
        raise FileError(
            "F06",
            f"{path}: {name}: expected {len(default.split())} numbers, got {text!r}; "
            "write the file again",
        )
    return values


def whole_number(path: Path, attributes: Attributes, name: str, default: str) -> int:
    """An attribute that is a single integer; else FileError F06."""
    value = numbers(path, attributes, name, default)[0]
    if not abs(value) < 2**62 or value % 1 != 0:
        raise FileError("F06", f"{path}: {name}: expected an integer, got {value}")
    return int(value)


def extent(path: Path, attributes: Attributes, name: str) -> NDArray[np.int64]:
    """First and last index along each axis (3, 2); FileError F06."""
    values = numbers(path, {name: attributes.get(name, "")}, name, "0 0 0 0 0 0")
    if not (np.abs(values) < 2**31).all() or (values % 1 != 0).any():
        raise FileError("F06", f"{path}: {name}: expected 6 indices, got {values.tolist()}")
    return values.astype(np.int64).reshape(3, 2)


def image_shape(path: Path, header: Header) -> tuple[int, int, int]:
    """Shape of the image, which fits into memory and which its pieces fill."""
    whole = extent(path, header.image, "WholeExtent")
    nx, ny, nz = (max(int(count), 0) for count in whole[:, 1] - whole[:, 0] + 1)
    check_shape(path, (nx, ny, nz))
    check_memory(path, nx * ny * nz)
    return nx, ny, nz


def check_pieces(path: Path, header: Header, shape: tuple[int, int, int]) -> None:
    """FileError F06 unless the pieces fill the whole extent."""
    whole = extent(path, header.image, "WholeExtent")
    covered = np.zeros(shape, dtype=bool)
    for piece in header.pieces:
        part = extent(path, piece.attributes, "Extent")
        low, high = part[:, 0] - whole[:, 0], part[:, 1] - whole[:, 0] + 1
        if (low < 0).any() or (high > shape).any():
            raise FileError(
                "F06", f"{path}: Piece: expected inside {whole.tolist()}, got {part.tolist()}"
            )
        covered[tuple(slice(a, b) for a, b in zip(low, high, strict=True))] = True
    if not covered.all():
        raise FileError(
            "F06",
            f"{path}: expected pieces that fill the whole extent, got {int((~covered).sum())} "
            "samples in none; write the file again",
        )


def check_room(path: Path, header: Header, attributes: Attributes, count: int) -> None:
    """FileError F08 if ``count`` samples of an array cannot be in a file of this size."""
    each = 1 if attributes.get("format") == "ascii" else BYTES[attributes["type"]]
    compressor = header.root.get("compressor", "")
    room = path.stat().st_size * _RATIOS.get(compressor, max(_RATIOS.values()))
    if count * each > room:
        raise FileError(
            "F08",
            f"{path}: WholeExtent: expected at most {room // each} samples of "
            f"{attributes['Name']!r} in a file of this size, got {count}; "
            "the header is damaged, write the file again",
        )


def _image_count(path: Path, piece: Piece, array: Array) -> int | None:
    """Number of tuples that an array of an image's piece must have."""
    shape = np.diff(extent(path, piece.attributes, "Extent"))[:, 0] + 1
    counts = shape if array.section == "PointData" else np.maximum(shape - 1, 1)
    return int(math.prod(counts.tolist()))


def check_lengths(
    path: Path,
    header: Header,
    count_of: Callable[[Path, Piece, Array], int | None] = _image_count,
) -> None:
    """FileError F03 if text or uncompressed data are shorter or longer than declared.

    Compressed data need no check: VTK notices when a block does not unpack. ``count_of``
    tells the number of an array's tuples, None if the header does not.
    """
    packed = bool(header.root.get("compressor"))
    word = 8 if header.root.get("header_type") == "UInt64" else 4
    at_end = []
    for piece in header.pieces:
        for array in piece.arrays:
            kind = array.attributes.get("format", "ascii")
            each = BYTES.get(array.attributes.get("type", ""))
            if each is None or (packed and kind != "ascii"):
                continue
            count = count_of(path, piece, array)
            components = whole_number(path, array.attributes, "NumberOfComponents", "1")
            values = None if count is None else count * components
            need = None if values is None else values * each
            if kind == "appended":
                at_end.append(_check_appended(path, header, array, word, need))
            elif values is None or need is None:
                continue
            elif kind == "ascii" and array.words != values:
                _short(path, array, f"{values} values", f"{array.words}")
            elif kind == "binary" and array.length != _encoded(word + need):
                _short(path, array, f"{need} bytes", "another number")
    if at_end and not any(at_end) and not header.others:
        raise FileError(
            "F03",
            f"{path}: expected the last array to end where the appended data do, got bytes left "
            "over; the file is damaged, for example by a text-mode transfer, copy it again",
        )


def _encoded(count: int) -> int:
    """Number of base64 characters for so many bytes."""
    return 4 * -(-count // 3)


def _short(path: Path, array: Array, expected: str, got: str) -> NoReturn:
    raise FileError(
        "F03",
        f"{path}: expected {expected} of array {array.attributes.get('Name')!r}, got {got}; "
        "the file is truncated or damaged, write or copy it again",
    )


def _check_appended(path: Path, header: Header, array: Array, word: int, need: int | None) -> bool:
    """Check the length word at the array's offset, and that the array ends before the tag closes.

    Returns whether nothing but blanks stands between its end and the closing tag.
    """
    attributes, tag = header.appended
    raw = attributes.get("encoding", "raw") == "raw"
    offset = whole_number(path, array.attributes, "offset", "0")
    with path.open("rb") as stream:
        stream.seek(max(tag, path.stat().st_size - 4096))
        begin = stream.tell()
        close = begin + stream.read().rfind(b"</AppendedData>")
        stream.seek(tag)
        first = tag + stream.read(4096).find(b"_") + 1 + offset
        stream.seek(max(first, 0))
        head = stream.read(word if raw else _encoded(word))
    stated = _stated(head if raw else _decoded(head)[:word], header)
    need = stated if need is None else need
    length = word + need if raw else _encoded(word + need)
    if first + length > close or stated != need:
        _short(path, array, f"{need} bytes", "fewer, or bytes out of place")
    with path.open("rb") as stream:
        stream.seek(first + length)
        return not stream.read(min(close - first - length, 4096)).strip()


def _stated(head: bytes, header: Header) -> int:
    return int.from_bytes(head, "big" if header.root.get("byte_order") == "BigEndian" else "little")


def _decoded(text: bytes) -> bytes:
    try:
        return base64.b64decode(text)
    except ValueError:
        return b""
