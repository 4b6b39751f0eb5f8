"""The one process with a port: it lets the right browser in, and passes everything on.

Behind it each session is a process without a port; see `Sessions`. Nothing of what browsers and
sessions say to one another is understood here.
"""

from __future__ import annotations

import asyncio
import html
import logging
import os
import signal
import socket
import tempfile
import threading
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlencode

from aiohttp import WSMsgType, web

from ..errors import ArgumentError, IsovaryError
from . import _session
from ._channel import Kind
from ._locks import (
    Locks,
    Refused,
    forwarding_page,
    hosts_of,
    install,
    is_loopback,
    page,
    protocol,
    script_hashes,
)
from ._receiving import receive
from ._sessions import Session, SessionMain, Sessions
from ._settings import GatewaySettings
from ._static import StaticFiles, page_folders
from ._uploads import confined

_log = logging.getLogger("isovary.app")

LONGEST_MESSAGE = 16 * 1024 * 1024
"""Bytes of the longest message that a browser may send."""

_ROLES = ("base", "perturbed", "surface")
_SHORTEST_TOKEN = 43  # letters of 256 bits in base64
_CHUNK = 256 * 1024
_HEARTBEAT = 30.0

_AS_WEBSOCKET = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13"}

# How requests are read: nothing is unpacked, and the log shows no address, as it has the token.
_READING: dict[str, Any] = {
    "access_log": None,
    "auto_decompress": False,
    "keepalive_timeout": 60.0,
    "lingering_time": 2.0,
}

# What trame's page would take from the address, and send its words to another server.
_KEPT_BACK = {"token", "reconnect", "secret", "application", "remove", "iframe", "wsProxy"}


class Gateway:
    """What is done with a request that passed the locks.

    Parameters
    ----------
    settings : GatewaySettings
    locks : Locks
    sessions : Sessions
    static : StaticFiles
    """

    def __init__(
        self, settings: GatewaySettings, locks: Locks, sessions: Sessions, static: StaticFiles
    ) -> None:
        self._settings, self._locks = settings, locks
        self._sessions, self._static = sessions, static

    def application(self) -> web.Application:
        """The web application."""
        app = web.Application()
        install(app, self._locks)
        app.router.add_get("/", self._start)
        app.router.add_get("/s/{sid}/ws", self._relay, allow_head=False)
        app.router.add_get("/s/{sid}/files/{name}", self._download)
        app.router.add_post("/s/{sid}/upload/{role}", self._upload)
        app.router.add_get("/s/{sid}/{path:.*}", self._file)
        return app

    async def _start(self, request: web.Request) -> web.StreamResponse:
        """Take the token for a cookie, or begin a session."""
        rest = [(k, v) for k, v in request.query.items() if not _is_kept_back(k)]
        if self._locks.has_token(request):
            return self._let_in(request, f"/?{urlencode(rest)}" if rest else "/")
        if request.method == "HEAD":
            return web.Response(content_type="text/html")
        session = await self._sessions.open()
        if session is None:
            text = "All sessions are taken. Close another page of isovary, and try again in a while"
            return page("No session is free", f"{text}.", link="/", status=503)
        query = urlencode([("reconnect", "auto"), *rest])
        return _moved(f"/s/{session.sid}/?{query}")

    def _let_in(self, request: web.Request, target: str) -> web.Response:
        from_here = request.headers.get("Sec-Fetch-Site", "none") in ("none", "same-origin")
        answer = _moved(target) if from_here else forwarding_page(target)
        answer.set_cookie(
            self._locks.cookie, self._locks.key, path="/", httponly=True, samesite="Strict"
        )
        return answer

    def _session(self, request: web.Request) -> Session | web.Response:
        """Return the session that a request names, or the page that says why not."""
        sid = request.match_info["sid"]
        session = self._sessions.find(sid)
        if session is not None:
            return session
        if self._sessions.is_gone(sid):
            text = "This session has ended; its files are removed. A new one begins empty."
            return page("The session is over", text, link="/", status=410)
        return page("There is no such session", "It may be of an earlier start.", "/", 404)

    async def _file(self, request: web.Request) -> web.StreamResponse:
        session = self._session(request)
        if not isinstance(session, Session):
            shown = request.headers.get("Sec-Fetch-Dest") == "document"
            page_itself = not request.match_info["path"]
            # a new session takes what the address keeps behind its "#", which no server sees
            return _moved("/") if shown and page_itself else session
        packed = "gzip" in request.headers.get("Accept-Encoding", "")
        address = request.match_info["path"] or "index.html"
        answer = await self._static.answer(address, packed)
        if answer is None:
            raise Refused(404, "there is no such file")
        return answer

    async def _relay(self, request: web.Request) -> web.StreamResponse:
        """Pass a websocket's messages to its session, and back."""
        session = self._session(request)
        if not isinstance(session, Session):
            return session
        websocket = web.WebSocketResponse(
            max_msg_size=LONGEST_MESSAGE, heartbeat=_HEARTBEAT, compress=False, timeout=2.0
        )
        if not websocket.can_prepare(request).ok:
            raise Refused(426, "expected a websocket", **_AS_WEBSOCKET)
        number = session.enter()
        if number is None:
            raise Refused(503, "too many pages look at this session")
        try:
            await websocket.prepare(request)
            await self._sessions.join(session, number, websocket)
            await _passed_on(websocket, session, number)
        except ConnectionError:
            await websocket.close(code=1011)
        finally:
            await self._sessions.leave(session, number)
        return websocket

    async def _upload(self, request: web.Request) -> web.StreamResponse:
        session = self._session(request)
        if not isinstance(session, Session):
            return session
        role = request.match_info["role"]
        if role not in _ROLES:
            raise Refused(404, f"expected one of {', '.join(_ROLES)}")
        async with session.uploading:
            name, path = await receive(request, session.folder / "in", self._settings.upload)
            await session.tell(uploaded={"role": role, "path": str(path), "name": name})
        return web.json_response({"name": name})

    async def _download(self, request: web.Request) -> web.StreamResponse:
        session = self._session(request)
        if not isinstance(session, Session):
            return session
        stream, length = await asyncio.to_thread(
            _opened, session.folder / "out", request.match_info["name"]
        )
        answer = web.StreamResponse(headers=_as_attachment(request.match_info["name"]))
        answer.content_length = length
        with open(stream, "rb") as file:
            await answer.prepare(request)
            left = length if request.method == "GET" else 0
            while left and (chunk := await asyncio.to_thread(file.read, min(left, _CHUNK))):
                await answer.write(chunk)
                left -= len(chunk)
        return answer


async def _passed_on(websocket: web.WebSocketResponse, session: Session, number: int) -> None:
    """Send a websocket's messages to the session until it closes; binary ones only."""
    async for message in websocket:
        if message.type != WSMsgType.BINARY:
            await websocket.close(code=1003, message=b"binary messages only")
            break
        await session.channel.send(Kind.MESSAGE, number, message.data)


def _is_kept_back(name: str) -> bool:
    return name in _KEPT_BACK or name.lower().startswith("session")


def _moved(target: str) -> web.Response:
    return web.Response(status=303, headers={"Location": target})


def _opened(folder: Path, name: str) -> tuple[int, int]:
    """Open a file right below a folder, and tell its length; 404 for anything else."""
    try:
        path = confined(folder, name)
        if path.parent != folder.resolve() or name.startswith(".") or (folder / name).is_symlink():
            raise Refused(404, "there is no such file")
        stream = os.open(path, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | _O_BINARY)
    except (IsovaryError, OSError, ValueError):
        raise Refused(404, "there is no such file") from None
    if not os.path.isfile(stream):
        os.close(stream)
        raise Refused(404, "there is no such file")
    return stream, os.fstat(stream).st_size


_O_BINARY = getattr(os, "O_BINARY", 0) | getattr(os, "O_NONBLOCK", 0)


def _as_attachment(name: str) -> dict[str, str]:
    """Return the headers by which a browser saves a file, and never shows it.

    Examples
    --------
    >>> print(_as_attachment('a"b.vtp')["Content-Disposition"])
    attachment; filename="a_b.vtp"; filename*=UTF-8''a%22b.vtp
    """
    plain = "".join(c if c.isascii() and (c.isalnum() or c in "._- ") else "_" for c in name)
    words = f"attachment; filename=\"{plain}\"; filename*=UTF-8''{quote(name, safe='')}"
    return {"Content-Disposition": words, "Content-Type": "application/octet-stream"}


async def serve(
    settings: GatewaySettings,
    *,
    started: Callable[[str], None],
    session_main: SessionMain = _session.main,
    stop: asyncio.Event | None = None,
) -> None:
    """Run the gateway until SIGINT or SIGTERM, or ``stop``; then end every session.

    Parameters
    ----------
    settings : GatewaySettings
    started : callable
        Called with the address, token included, as soon as it answers.
    session_main : callable
        What a session's process runs.
    stop : asyncio.Event, optional
        Ends the gateway as a signal does.

    Raises
    ------
    ArgumentError
        A02 for a token of less than 256 bits, or an address that is not free.
    """
    if len(settings.token) < _SHORTEST_TOKEN:
        got = f"{len(settings.token)} letters"
        raise ArgumentError("A02", f"token: expected {_SHORTEST_TOKEN} letters, got {got}")
    with _listening(settings) as listener:
        port = listener.getsockname()[1]
        static = StaticFiles(page_folders())
        hosts = hosts_of(settings.host, port, settings.hosts)
        locks = Locks(settings.token, port, hosts, script_hashes(static.index))
        if not is_loopback(settings.host):
            _log.warning("other computers reach this page, and what it sends is not encrypted")
        sessions = Sessions(settings, session_main)
        app = Gateway(settings, locks, sessions, static).application()
        ended = stop or asyncio.Event()
        with _on_signals(ended):
            await _run(
                app, locks, listener, ended, sessions, lambda: started(_address(settings, port))
            )


async def _run(
    app: web.Application,
    locks: Locks,
    listener: socket.socket,
    ended: asyncio.Event,
    sessions: Sessions,
    started: Callable[[], None],
) -> None:
    runner = web.AppRunner(app, shutdown_timeout=1.0)
    await runner.setup()
    loop, reader, server = asyncio.get_running_loop(), protocol(locks), runner.server
    assert server is not None
    listening = await loop.create_server(
        lambda: reader(server, loop=loop, **_READING), sock=listener
    )
    try:
        await sessions.start()
        started()
        await ended.wait()
    finally:
        listening.close()
        await sessions.close()
        await runner.cleanup()


def _listening(settings: GatewaySettings) -> socket.socket:
    if not 0 <= settings.port <= 65535:
        raise ArgumentError("A02", f"port: expected a number up to 65535, got {settings.port}")
    host = "127.0.0.1" if settings.host == "localhost" else settings.host
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return socket.create_server((host, settings.port), family=family)
    except OSError as error:
        got = f"{host} port {settings.port} ({error})"
        raise ArgumentError(
            "A02", f"host, port: expected an address that is free, got {got}; name another port"
        ) from None


def _address(settings: GatewaySettings, port: int) -> str:
    host = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(settings.host, settings.host)
    return f"http://{f'[{host}]' if ':' in host else host}:{port}/?token={settings.token}"


@contextmanager
def _on_signals(ended: asyncio.Event) -> Iterator[None]:
    """Let SIGINT and SIGTERM set an event, where they can be heard."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    loop = asyncio.get_running_loop()
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.getsignal(number) for number in numbers]
    for number in numbers:
        signal.signal(number, lambda *_: loop.call_soon_threadsafe(ended.set))
    try:
        yield
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)


def run(settings: GatewaySettings, open_browser: bool, say: Callable[[str], None] = print) -> None:
    """Run the gateway until Ctrl-C, and say where the page is.

    Parameters
    ----------
    settings : GatewaySettings
    open_browser : bool
        Show the page at once.
    say : callable
        Called with a line.

    Raises
    ------
    ArgumentError
        A02 as `serve`.
    """
    with tempfile.TemporaryDirectory(prefix="isovary-open-") as folder:

        def started(address: str) -> None:
            say(f"Open {address}")
            say("Ctrl-C ends it")
            if open_browser:
                way = _leading_file(Path(folder), address).as_uri()
                threading.Thread(target=webbrowser.open, args=(way,), daemon=True).start()

        asyncio.run(serve(settings, started=started))


def _leading_file(folder: Path, address: str) -> Path:
    """Write a page that leads to an address: all users see what a browser is started with.

    The token would stand there for all to read; this file is for its owner only.
    """
    path = folder / "open.html"
    goal = html.escape(address)
    path.touch(mode=0o600)
    path.write_text(
        f'<!doctype html><meta charset="utf-8"><meta http-equiv="refresh" content="0; url={goal}">'
        f'<title>isovary</title><p><a href="{goal}">Go on</a>',
        encoding="utf-8",
    )
    return path
