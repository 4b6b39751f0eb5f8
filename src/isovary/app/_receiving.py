"""A file that a browser sends: measured while it comes, looked at, and put under another name."""

from __future__ import annotations

import asyncio
import os
import secrets
import unicodedata
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO, TypeVar
from urllib.parse import unquote

from aiohttp import BodyPartReader, web
from aiohttp.http_exceptions import BadHttpMessage

from ..errors import IsovaryError
from ._locks import Refused
from ._uploads import random_name, sniff

FOLDER = 4
"""A session's uploads together may be so many times as large as the largest one."""

_CHUNK = 256 * 1024
_PATIENCE = 60.0  # seconds between two chunks
_WRAPPING = 64 * 1024  # bytes of a form around the file
_LONGEST_NAME = 200
_TOO_LARGE = "the file is larger than this page takes"

_T = TypeVar("_T")
_Chunks = AsyncIterator[bytes]


async def receive(request: web.Request, folder: Path, largest: int) -> tuple[str, Path]:
    """Store the file that a request carries, as its body or as the first part of a form.

    Parameters
    ----------
    request : aiohttp.web.Request
        The name is the form's, or ``?name=...``, or the header ``X-File-Name`` (as in a URL).
    folder : path
        Where the file goes.
    largest : int
        Bytes of the largest file; the folder takes `FOLDER` times as many.

    Returns
    -------
    name, path : str, Path
        What the sender calls the file, fit to be shown; and where it lies, under a random name.

    Raises
    ------
    Refused
        400 for a body without file or name, 408 if it stops coming, 413 if it is too large, 415
        if it is packed or of another kind than its name says, 507 if the disk is full.
    """
    if request.headers.get("Content-Encoding", "identity").lower() != "identity":
        raise Refused(415, "expected the file as it is, without a content encoding")
    is_form = request.content_type.startswith("multipart/")
    room = min(largest, FOLDER * largest - await asyncio.to_thread(_size, folder))
    if (request.content_length or 0) > room + is_form * _WRAPPING:
        raise Refused(413, _TOO_LARGE)
    name, chunks = await (_from_form(request) if is_form else _from_body(request))
    part = folder / f"{secrets.token_hex(16)}.part"
    try:
        with open(os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
            await _copy(chunks, file, room)
        return name, await asyncio.to_thread(_named, part, name)
    except OSError as error:
        if isinstance(error, ConnectionError):
            raise
        raise Refused(507, "the file cannot be stored; free some space") from error
    finally:
        with suppress(FileNotFoundError):
            part.unlink()


def shown_name(name: str) -> str:
    r"""Return the last part of a file's name, without what a screen or a header may stumble on.

    Examples
    --------
    >>> shown_name("C:\\fields\\a\r\nb.vti")
    'ab.vti'
    """
    last = name.replace("\\", "/").rsplit("/", 1)[-1]
    plain = "".join(letter for letter in last if unicodedata.category(letter)[0] != "C")
    return plain.strip()[-_LONGEST_NAME:]


async def _from_body(request: web.Request) -> tuple[str, _Chunks]:
    given = request.query.get("name") or unquote(request.headers.get("X-File-Name", ""))
    return _checked(given), _each(lambda: request.content.read(_CHUNK))


async def _from_form(request: web.Request) -> tuple[str, _Chunks]:
    try:
        form = await request.multipart()
    except (ValueError, AssertionError):
        raise Refused(400, "the form is broken") from None
    part = await _soon(form.next())
    if not isinstance(part, BodyPartReader):
        raise Refused(400, "expected a form with one file")
    return _checked(part.filename or ""), _each(lambda: part.read_chunk(_CHUNK))


def _checked(given: str) -> str:
    name = shown_name(given)
    if not name:
        raise Refused(400, "expected the file's name")
    return name


async def _each(read: Callable[[], Awaitable[bytes]]) -> _Chunks:
    while chunk := await _soon(read()):
        yield chunk


async def _soon(awaited: Awaitable[_T]) -> _T:
    try:
        return await asyncio.wait_for(awaited, _PATIENCE)
    except TimeoutError:
        raise Refused(408, "the file stopped coming") from None
    except (ValueError, AssertionError, RuntimeError, BadHttpMessage):  # how aiohttp says it
        raise Refused(400, "the form is broken") from None


async def _copy(chunks: _Chunks, file: BinaryIO, room: int) -> None:
    written = 0
    async for chunk in chunks:
        written += len(chunk)
        if written > room:
            raise Refused(413, _TOO_LARGE)
        await asyncio.to_thread(file.write, chunk)


def _named(part: Path, name: str) -> Path:
    """Look at what came, and give it a name of ours."""
    try:
        path = part.with_name(random_name(sniff(part, name)))
    except IsovaryError as error:
        raise Refused(415, error.message.replace(str(part), name)) from None
    part.rename(path)
    return path


def _size(folder: Path) -> int:
    return sum(entry.stat().st_size for entry in os.scandir(folder) if entry.is_file())
