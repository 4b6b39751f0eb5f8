"""Waiting for a place among the long runs of all sessions."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager, suppress
from itertools import count
from typing import Any

from ..errors import RunError

Send = Callable[..., Awaitable[None]]


class Turns:
    """Asks the gateway for a place, and tells the position in its queue.

    Parameters
    ----------
    send : async callable
        Sends a note to the gateway.
    """

    def __init__(self, send: Send) -> None:
        self._send = send
        self._numbers = count(1)
        self._waiting: dict[int, tuple[asyncio.Future[None], Callable[[int], None]]] = {}

    @asynccontextmanager
    async def turn(self, waiting: Callable[[int], None]) -> AsyncIterator[None]:
        """Hold a place; ``waiting`` is called with the position while there is none.

        As long as it waits or works the session stays, even when its browser has gone.

        Raises
        ------
        RunError
            W11 if too many runs of this session wait already.
        """
        number, go = next(self._numbers), asyncio.get_running_loop().create_future()
        self._waiting[number] = go, waiting
        try:
            await self._send(busy=True)
            await self._send(job="ask", id=number)
            await go
            yield
        finally:
            del self._waiting[number]
            with suppress(ConnectionError):  # the gateway has gone, and the session goes, too
                await self._send(job="done", id=number)
                if not self._waiting:
                    await self._send(busy=False)

    def noted(self, note: dict[str, Any]) -> None:
        """Take the gateway's answer."""
        if "job" not in note or note.get("id") not in self._waiting:
            return
        go, waiting = self._waiting[note["id"]]
        if note["job"] == "wait":
            waiting(int(note["position"]))
        elif not go.done() and note["job"] == "go":
            go.set_result(None)
        elif not go.done():
            words = f"runs: expected at most {note['waiting']} that wait, got one more; wait"
            go.set_exception(RunError("W11", words))
