"""The files that the page is made of: a fixed table, so that no address leads anywhere else."""

from __future__ import annotations

import asyncio
import gzip
import mimetypes
import os
from dataclasses import dataclass
from pathlib import Path

from aiohttp import web

_TYPES = {
    ".js": "text/javascript",
    ".mjs": "text/javascript",
    ".css": "text/css",
    ".html": "text/html",
    ".tpl": "text/html",
    ".json": "application/json",
    ".svg": "image/svg+xml",
    ".woff2": "font/woff2",
    ".ttf": "font/ttf",
}
_PACKED = ("text/", "application/json", "image/svg")
_SMALL = 1024  # bytes that are not worth packing


def page_folders() -> dict[str, Path]:
    """Return the folders whose files the page asks for, by the start of their address."""
    from trame_client.module import vue3 as client
    from trame_vtk.modules import common as vtk
    from trame_vuetify.module import v3 as vuetify

    served = {**vtk.serve, **vuetify.serve}
    folders = {"": Path(client.www), "__isovary": Path(__file__).with_name("static")}
    return folders | {name: Path(folder) for name, folder in served.items()}


def files_of(folders: dict[str, Path]) -> dict[str, Path]:
    """List the plain files of folders by address; leaves out links and hidden files.

    Examples
    --------
    >>> "errors.py" in files_of({"": Path(__file__).parents[1]})
    True
    """
    found = {}
    for prefix, folder in folders.items():
        for place, inside, names in os.walk(folder):
            inside[:] = [name for name in inside if not name.startswith(".")]
            for name in names:
                path = Path(place, name)
                if not name.startswith(".") and not path.is_symlink():
                    address = path.relative_to(folder).as_posix()
                    found[f"{prefix}/{address}" if prefix else address] = path
    return found


@dataclass
class _File:
    plain: bytes
    kind: str
    packed: bytes | None = None


class StaticFiles:
    """Answers with files of a table, read and packed once.

    Parameters
    ----------
    folders : dict of str to path
        As of `page_folders`.
    """

    def __init__(self, folders: dict[str, Path]) -> None:
        self._paths = files_of(folders)
        self._files: dict[str, _File] = {}

    @property
    def index(self) -> str:
        """The text of the page."""
        return self._paths["index.html"].read_text("utf-8")

    async def answer(self, address: str, packed: bool) -> web.Response | None:
        """Return the file at an address, packed if that is wanted and helps, or None."""
        if address not in self._paths:
            return None
        if address not in self._files:
            self._files[address] = await asyncio.to_thread(_read, self._paths[address])
        file = self._files[address]
        headers = {"Cache-Control": "private, max-age=31536000, immutable"}
        if address == "index.html":
            headers["Cache-Control"] = "no-store"
        if file.packed:
            headers["Vary"] = "Accept-Encoding"
        if file.packed and packed:
            headers["Content-Encoding"] = "gzip"
        body = file.packed if file.packed and packed else file.plain
        charset = "utf-8" if file.kind.startswith("text/") else None
        return web.Response(body=body, content_type=file.kind, charset=charset, headers=headers)


def _read(path: Path) -> _File:
    kind = _TYPES.get(path.suffix) or mimetypes.guess_type(path.name)[0]
    file = _File(path.read_bytes(), kind or "application/octet-stream")
    if file.kind.startswith(_PACKED) and len(file.plain) > _SMALL:
        file.packed = gzip.compress(file.plain, 6, mtime=0)
    return file
