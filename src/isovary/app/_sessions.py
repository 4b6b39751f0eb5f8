"""The sessions of the gateway, each a process with a folder, and the queue of their long runs."""

from __future__ import annotations

import asyncio
import logging
import os
import secrets
import shutil
import signal
import socket
import tempfile
from collections import deque
from collections.abc import Callable, Coroutine
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import count
from multiprocessing import get_context
from multiprocessing.connection import wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any, Protocol

from ._channel import Channel, Frame, Kind
from ._settings import GatewaySettings, SessionSettings

_log = logging.getLogger("isovary.app")

WEBSOCKETS = 4
"""Websockets that one session has at most."""
WAITING = 3
"""Long runs that may wait for one session."""

_PATIENCE = 30.0  # seconds that a browser has to take a message
_STEP = 0.8  # seconds that a process has to end, each time it is asked
_REMEMBERED = 1000  # ended sessions that are answered as gone

SessionMain = Callable[[socket.socket, SessionSettings], None]
News = list[tuple[str, dict[str, Any]]]


class Client(Protocol):
    """A browser's websocket, as far as it is used here."""

    async def send_bytes(self, data: bytes) -> None:
        """Send a binary message."""

    async def close(self, *, code: int = 1000, message: bytes = b"") -> Any:
        """Close it."""


class Jobs:
    """Places for long runs, first come, first served.

    Parameters
    ----------
    places : int
        Runs at once.
    waiting : int
        Runs of one session that may wait; a further one is refused.

    Examples
    --------
    >>> jobs = Jobs(places=1)
    >>> jobs.ask("a", 1)
    [('a', {'job': 'go', 'id': 1})]
    >>> jobs.ask("b", 1)
    [('b', {'job': 'wait', 'id': 1, 'position': 1})]
    >>> jobs.done("a", 1)
    [('b', {'job': 'go', 'id': 1})]
    """

    def __init__(self, places: int, waiting: int = WAITING) -> None:
        self._places, self._most = places, waiting
        self._running: list[tuple[str, int | str]] = []
        self._line: list[tuple[str, int | str]] = []

    def ask(self, session: str, job: int | str) -> News:
        """Ask for a place; returns whom to tell what."""
        asked = (session, job)
        if asked in self._running or asked in self._line:
            return []
        if len(self._running) >= self._places and self._waiting(session) >= self._most:
            return [(session, {"job": "refused", "id": job, "waiting": self._most})]
        before = self._positions()
        self._line.append(asked)
        return self._moved(before)

    def done(self, session: str, job: int | str) -> News:
        """Free a place, or leave the queue."""
        return self._without(lambda held: held == (session, job))

    def drop(self, session: str) -> News:
        """Free all places of a session that ended."""
        return self._without(lambda held: held[0] == session)

    def _waiting(self, session: str) -> int:
        return sum(held[0] == session for held in self._line)

    def _positions(self) -> dict[tuple[str, int | str], int]:
        return {held: place for place, held in enumerate(self._line, start=1)}

    def _without(self, leaves: Callable[[tuple[str, int | str]], bool]) -> News:
        before = self._positions()
        self._running = [held for held in self._running if not leaves(held)]
        self._line = [held for held in self._line if not leaves(held)]
        return self._moved(before)

    def _moved(self, before: dict[tuple[str, int | str], int]) -> News:
        """Give free places to the first in the queue; tell all whose position changed."""
        news: News = []
        while self._line and len(self._running) < self._places:
            first = self._line.pop(0)
            self._running.append(first)
            news.append((first[0], {"job": "go", "id": first[1]}))
        for held, place in self._positions().items():
            if before.get(held) != place:
                news.append((held[0], {"job": "wait", "id": held[1], "position": place}))
        return news


@dataclass(eq=False)
class Session:
    """One session: a process, the channel to it, its folder and the websockets that look at it."""

    sid: str
    folder: Path
    process: BaseProcess
    channel: Channel
    clients: dict[int, Client | None] = field(default_factory=dict)
    ready: bool = False
    shown: bool = False
    busy: bool = False
    ending: asyncio.Task[None] | None = None
    timer: asyncio.TimerHandle | None = None
    uploading: asyncio.Lock = field(default_factory=asyncio.Lock)
    numbers: count[int] = field(default_factory=lambda: count(1))

    def enter(self) -> int | None:
        """Take a number for a websocket, or None when there are too many."""
        if self.ending or len(self.clients) >= WEBSOCKETS:
            return None
        number = next(self.numbers)
        self.clients[number] = None
        return number

    async def tell(self, **note: object) -> None:
        """Send a note to the process; lost when the session is ending."""
        with suppress(ConnectionError):
            await self.channel.send_note(**note)


class Sessions:
    """All sessions, and one process ahead of the next, begun when the last one shows its page.

    Parameters
    ----------
    settings : GatewaySettings
    session_main : callable
        What runs in the process: called with its end of the channel and its settings, it returns
        when the other end is gone.
    busy_linger : float
        Seconds that a session without a browser may finish its work.
    """

    def __init__(
        self, settings: GatewaySettings, session_main: SessionMain, *, busy_linger: float = 3600.0
    ) -> None:
        self._settings, self._main, self._busy_linger = settings, session_main, busy_linger
        self.folder = Path(tempfile.mkdtemp(prefix="isovary-"))
        self._cache = self.folder / "cache"
        self._cache.mkdir(mode=0o700)
        self._jobs = Jobs(settings.jobs)
        self._open: dict[str, Session] = {}
        self._gone: deque[str] = deque(maxlen=_REMEMBERED)
        self._spare: Session | None = None
        self._closing = False
        self._door = asyncio.Lock()
        self._tasks: set[asyncio.Task[Any]] = set()

    async def start(self) -> None:
        """Begin the spare."""
        await self._renew()

    def find(self, sid: str) -> Session | None:
        """Return an open session."""
        return self._open.get(sid)

    def is_gone(self, sid: str) -> bool:
        """Say whether a session was open once."""
        return sid in self._gone

    async def open(self) -> Session | None:
        """Open a session, or return None when all are taken."""
        async with self._door:
            if self._closing or len(self._open) >= self._settings.sessions:
                return None
            session, self._spare = self._spare or await self._begin(), None
            self._open[session.sid] = session
        self._rest(session)
        if session.shown:
            self._later(self._renew())
        return session

    async def join(self, session: Session, number: int, client: Client) -> None:
        """Connect a websocket that has a number."""
        if session.ending:
            raise ConnectionError("the session has ended")
        session.clients[number] = client
        if session.timer:
            session.timer.cancel()
        await session.channel.send(Kind.OPENED, number)

    async def leave(self, session: Session, number: int) -> None:
        """Forget a websocket; the last one leaves the session to linger."""
        if session.clients.pop(number, None) is not None:
            with suppress(ConnectionError):
                await session.channel.send(Kind.CLOSED, number)
        self._rest(session)

    def finish(self, session: Session, code: int = 1001) -> None:
        """Begin to end a session; its websockets close with ``code``."""
        if session.ending is None:
            session.ending = asyncio.ensure_future(self._end(session, code))

    async def close(self) -> None:
        """End all sessions and remove every folder."""
        self._closing = True
        async with self._door:
            last = [*self._open.values(), *([self._spare] if self._spare else [])]
            self._spare = None
        for session in last:
            self.finish(session)
        await asyncio.gather(*(session.ending for session in last if session.ending))
        while self._tasks:
            await asyncio.wait(self._tasks)
        await asyncio.to_thread(shutil.rmtree, self.folder, ignore_errors=True)

    def _later(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.ensure_future(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _begin(self) -> Session:
        """Start a process."""
        folder = self.folder / secrets.token_hex(8)
        for path in (folder, folder / "in", folder / "out"):
            path.mkdir(mode=0o700)
        settings = SessionSettings(
            folder, self._cache, roots=self._settings.roots, result=self._settings.result
        )
        ours, theirs = socket.socketpair()
        process = get_context("spawn").Process(
            target=_enter, args=(self._main, theirs, settings), name="isovary session"
        )
        with theirs:
            process.start()
        session = Session(secrets.token_hex(16), folder, process, await Channel.on(ours))
        self._later(self._listen(session))
        return session

    async def _renew(self) -> None:
        async with self._door:
            room = len(self._open) < self._settings.sessions
            if room and self._spare is None and not self._closing:
                self._spare = await self._begin()

    def _rest(self, session: Session) -> None:
        """End a session later, unless somebody looks at it by then."""
        if session.timer:
            session.timer.cancel()
        if not session.clients and session.ending is None:
            loop = asyncio.get_running_loop()
            session.timer = loop.call_later(
                self._settings.linger, self._rested, session, loop.time()
            )

    def _rested(self, session: Session, since: float) -> None:
        loop = asyncio.get_running_loop()
        left = since + self._busy_linger - loop.time()
        if session.clients:
            return
        if session.busy and left > 0:
            pause = min(left, self._settings.linger)
            session.timer = loop.call_later(pause, self._rested, session, since)
        else:
            self.finish(session)

    async def _listen(self, session: Session) -> None:
        """Take what a process sends, until it is gone."""
        try:
            while (frame := await session.channel.receive()) is not None:
                await self._take(session, frame)
        except Exception:
            _log.exception("a session sent what nobody understands, and is ended")
        if session.ending is None:
            _log.warning("a session ended by itself")
        self.finish(session, 1011)

    async def _take(self, session: Session, frame: Frame) -> None:
        client = session.clients.get(frame.client)
        if frame.kind == Kind.NOTE:
            self._noted(session, frame.note)
        elif frame.kind == Kind.MESSAGE and client is not None:
            try:
                await asyncio.wait_for(client.send_bytes(frame.payload), _PATIENCE)
            except (TimeoutError, ConnectionError):
                self._later(_closed(client, 1008))
        elif frame.kind == Kind.CLOSED and client is not None:
            self._later(_closed(client, 1000))

    def _noted(self, session: Session, note: dict[str, Any]) -> None:
        session.ready |= "ready" in note
        if "shown" in note:  # until then it has the processors for itself
            session.shown = True
            self._later(self._renew())
        if "busy" in note:
            session.busy = bool(note["busy"])
            if session.timer and not session.busy:
                self._rest(session)
        if note.get("job") in ("ask", "done"):
            step = self._jobs.ask if note["job"] == "ask" else self._jobs.done
            self._tell(step(session.sid, note["id"]))

    def _tell(self, news: News) -> None:
        known = self._open | ({self._spare.sid: self._spare} if self._spare else {})
        for sid, note in news:
            if sid in known:
                self._later(known[sid].tell(**note))

    async def _end(self, session: Session, code: int) -> None:
        if session.timer:
            session.timer.cancel()
        if self._spare is session:
            self._spare = None
        if self._open.pop(session.sid, None):
            self._gone.append(session.sid)
            self._later(self._renew())
        self._tell(self._jobs.drop(session.sid))
        session.channel.close()
        clients = [client for client in session.clients.values() if client]
        await asyncio.gather(
            _stopped(session.process, _STEP if session.ready else 0.0),
            *(_closed(client, code) for client in clients),
        )
        await asyncio.to_thread(shutil.rmtree, session.folder, ignore_errors=True)


def _enter(session_main: SessionMain, end: socket.socket, settings: SessionSettings) -> None:
    """Run a session, apart from the terminal: Ctrl-C is the gateway's to answer."""
    if hasattr(os, "setpgid"):
        os.setpgid(0, 0)
    else:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    session_main(end, settings)


async def _closed(client: Client, code: int) -> None:
    with suppress(ConnectionError, TimeoutError, RuntimeError):
        await asyncio.wait_for(client.close(code=code), _STEP)


async def _stopped(process: BaseProcess, patience: float) -> None:
    """See that a process, whose channel was closed, ends; ask it twice more if it does not."""
    ways: tuple[tuple[float, Callable[[], None]], ...]
    ways = (patience, process.terminate), (_STEP, process.kill)
    for seconds, ask in ways:
        if await _exits(process, seconds):
            break
        ask()
    await _exits(process, _STEP)
    _sweep(process)
    process.join(0)
    if process.exitcode not in (0, None, -signal.SIGTERM):
        _log.warning("the process of a session ended with %s", process.exitcode)


async def _exits(process: BaseProcess, seconds: float) -> bool:
    loop = asyncio.get_running_loop()
    until = loop.time() + seconds
    while not wait([process.sentinel], 0):
        if loop.time() > until:
            return False
        await asyncio.sleep(0.01)
    return True


def _sweep(process: BaseProcess) -> None:
    """End what the process may have left; it is not yet reaped, so its group is still its own."""
    if hasattr(os, "killpg") and process.pid:
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, signal.SIGKILL)
