"""What an uploaded file is, and where it may lie: nothing that it says of itself is believed."""

from __future__ import annotations

import os
import re
import secrets
import zlib
from collections.abc import Callable
from pathlib import Path

from ..errors import ArgumentError, FileError

FIELD_SUFFIXES = (".cube.gz", ".vti", ".npy", ".npz", ".cube")
SURFACE_SUFFIXES = (".vtp", ".vtu", ".vtk", ".ply", ".stl", ".obj", ".off")

_HEAD = 4096
_LONGEST = 255  # bytes of a part of a path
_OTHERS = {
    b"\x89HDF": "HDF5",
    b"\x89PNG": "PNG",
    b"\xff\xd8\xff": "JPEG",
    b"%PDF": "PDF",
    b"\x7fELF": "a program",
    b"MZ": "a program",
    b"#!": "a script",
    b"<!DOCTYPE": "a web page",
    b"<html": "a web page",
    b"\x80\x04\x95": "a pickle",
    b"PK\x03\x04": ".npz",
    b"\x93NUMPY": ".npy",
    b"\x1f\x8b": "gzip",
    b"# vtk DataFile": ".vtk",
    b"ply": ".ply",
    b"OFF": ".off",
}
_OBJ = re.compile(rb"(#.*|(v|vn|vt|vp|f|l|p|o|g|s|mtllib|usemtl)(\s.*)?)")
_DEVICES = re.compile(r"(con|prn|aux|nul|com[0-9¹²³]|lpt[0-9¹²³])(\..*)?", re.IGNORECASE)


def accepted_suffixes() -> tuple[str, ...]:
    """Endings of the files that :func:`read_field` and :func:`read_surface` read."""
    return FIELD_SUFFIXES + SURFACE_SUFFIXES


def sniff(path: str | os.PathLike[str], name: str) -> str:
    """The suffix of an uploaded file, if its first bytes fit what its name claims.

    Parameters
    ----------
    path : path
        Where the file lies, under any name.
    name : str
        What the sender calls it; only how it ends counts.

    Returns
    -------
    str
        One of :func:`accepted_suffixes`.

    Raises
    ------
    FileError
        F02 if the file is empty, F04 for another ending, or content of another format.

    Notes
    -----
    Cost: reads 4 kB. The reader checks the rest: this keeps out what is something else.
    """
    suffix = next((end for end in accepted_suffixes() if str(name).lower().endswith(end)), None)
    if suffix is None:
        raise FileError(
            "F04",
            f"upload: expected a name that ends in {', '.join(accepted_suffixes())}, got "
            f"{_shown(name)}; convert the file",
        )
    with open(path, "rb") as stream:
        head = stream.read(_HEAD)
        size = stream.seek(0, os.SEEK_END)
    if not head:
        raise FileError("F02", "upload: expected data, got an empty file; write it again")
    if suffix == ".stl" and _is_binary_stl(head, size):
        return suffix
    if not _CHECKS[suffix](head):
        raise FileError(
            "F04",
            f"upload: expected the content of a {suffix} file, got {_looks(head)}; rename it, or "
            "check how it was written",
        )
    return suffix


def random_name(suffix: str) -> str:
    """A new name for an uploaded file: 32 random hexadecimal digits and an accepted suffix.

    Raises
    ------
    ArgumentError
        A02 for another suffix.
    """
    if suffix not in accepted_suffixes():
        raise ArgumentError(
            "A02",
            f"suffix: expected one of {', '.join(accepted_suffixes())}, got {_shown(suffix)}",
        )
    return secrets.token_hex(16) + suffix


def confined(root: str | os.PathLike[str], name: str) -> Path:
    """The path of a name below a folder, if it stays there on every system.

    Parameters
    ----------
    root : path
    name : str
        Relative, with ``/`` between its parts, as in a URL after decoding.

    Returns
    -------
    Path
        Absolute, without symbolic links; nothing need be there.

    Raises
    ------
    ArgumentError
        A02 for a name that is empty, absolute or on a drive; that has an empty part, ``.`` or
        ``..``; that has a backslash, a colon, a control character, a part of more than
        255 bytes, or one which Windows would read as another; or whose symbolic links lead out.

    Notes
    -----
    The answer holds as long as nobody changes links below the folder.

    Examples
    --------
    >>> confined("/srv", "run/report.html").relative_to(Path("/srv").resolve()).as_posix()
    'run/report.html'
    """
    parts = name.split("/") if isinstance(name, str) else []
    if not parts or not all(map(_is_plain, parts)):
        raise _outside(name)
    try:
        folder = Path(root).resolve()
        path = folder.joinpath(*parts).resolve()
    except (OSError, ValueError, RuntimeError):  # no Unicode, a loop of links
        raise _outside(name) from None
    if path == folder or not path.is_relative_to(folder):
        raise _outside(name)
    return path


def _is_plain(part: str) -> bool:
    """Whether a part of a path means itself and nothing else, on every system."""
    if part in ("", ".", "..") or part != part.rstrip(". ") or _DEVICES.fullmatch(part):
        return False
    if len(part.encode(errors="replace")) > _LONGEST:
        return False
    return not any(c in '\\:<>"|?*' or ord(c) < 32 or ord(c) == 127 for c in part)


def _outside(name: object) -> ArgumentError:
    return ArgumentError("A02", f"name: expected a path inside the folder, got {_shown(name)}")


def _shown(text: object) -> str:
    """What somebody else wrote, fit for a message: quoted, ASCII, short."""
    return ascii(text if len(str(text)) <= 60 else str(text)[:60] + "...")


def _looks(head: bytes) -> str:
    xml = re.search(rb'<VTKFile[^>]*\btype="(\w{1,40})"', head)
    if xml:
        return f"a VTKFile of type {xml[1].decode('ascii', 'replace')}"
    start = head.lstrip()
    kind = next((word for magic, word in _OTHERS.items() if start.startswith(magic)), None)
    if kind is None:
        return "bytes of another format" if b"\0" in head else "other text"
    return f"what looks like {kind}"


def _is_text(head: bytes) -> bool:
    return b"\0" not in head


def _xml(kind: bytes) -> Callable[[bytes], bool]:
    """A check for VTK's XML: a root VTKFile of a type, after a declaration and comments."""
    before = rb"(\xef\xbb\xbf)?\s*(<\?xml[^>]*\?>\s*)?(<!--.*?-->\s*)*"
    root = re.compile(before + rb"<VTKFile\s[^>]*\btype=[\"']" + kind + rb"[\"']", re.DOTALL)
    return lambda head: root.match(head) is not None


def _is_cube(head: bytes) -> bool:
    """Two lines of words; a count and an origin; three times a count and an axis."""
    lines = head.splitlines()
    if not _is_text(head) or len(lines) < 6:
        return False
    try:
        for line in lines[2:6]:
            words = line.split()
            int(words[0])
            if len([float(word) for word in words[1:4]]) != 3:
                return False
    except (ValueError, IndexError):
        return False
    return True


def _is_zipped_cube(head: bytes) -> bool:
    if not head.startswith(b"\x1f\x8b\x08"):
        return False
    try:
        return _is_cube(zlib.decompressobj(wbits=31).decompress(head, _HEAD))
    except zlib.error:
        return False


def _is_obj(head: bytes) -> bool:
    """Every line that is there in full begins with one of the format's words."""
    if not _is_text(head) or head.startswith((b"# vtk DataFile", b"#!")):
        return False
    lines = head.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ").splitlines()
    lines = [line.strip() for line in (lines[:-1] if len(head) == _HEAD else lines)]
    words = [line for line in lines if line]
    return bool(words) and all(_OBJ.fullmatch(line) for line in words)


def _is_text_stl(head: bytes) -> bool:
    return re.match(rb"\s*solid\b[^\n]*\n\s*(facet\s+normal|endsolid)\b", head) is not None


def _is_binary_stl(head: bytes, size: int) -> bool:
    """80 bytes of anything, a count, and 50 bytes for each triangle."""
    return size >= 84 and size == 84 + 50 * int.from_bytes(head[80:84], "little")


_CHECKS: dict[str, Callable[[bytes], bool]] = {
    ".vti": _xml(b"ImageData"),
    ".vtp": _xml(b"PolyData"),
    ".vtu": _xml(b"UnstructuredGrid"),
    ".npy": lambda head: re.match(rb"\x93NUMPY[\x01-\x03]\x00", head) is not None,
    ".npz": lambda head: head.startswith(b"PK\x03\x04"),
    ".cube": _is_cube,
    ".cube.gz": _is_zipped_cube,
    ".vtk": lambda head: head.startswith(b"# vtk DataFile Version "),
    ".ply": lambda head: re.match(rb"ply\r?\nformat |ply\rformat ", head) is not None,
    ".stl": _is_text_stl,
    ".obj": _is_obj,
    ".off": lambda head: re.match(rb"OFF(\s|$)", head) is not None,
}
