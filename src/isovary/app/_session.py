"""The process of one session: a trame server without a port, fed by the gateway.

Each browser session has a process of its own, so that sessions cannot see or slow each other,
and all memory is given back when the process ends.
"""

from __future__ import annotations

import asyncio
import socket
import sys
from collections.abc import Coroutine
from contextlib import suppress
from typing import Any

from ._channel import Channel, Kind
from ._settings import SessionSettings

_EXCEPTION = -32001  # wslink's code of a failed call


def main(end: socket.socket, settings: SessionSettings) -> None:
    """Run a session until the gateway hangs up."""
    from vtkmodules.vtkCommonCore import vtkLogger

    sys.argv = ["isovary"]  # trame reads options there
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)  # it misses a display; none is needed
    asyncio.run(_serve(end, settings))


async def _serve(end: socket.socket, settings: SessionSettings) -> None:
    from trame_server.core import Server

    from ._page import Page

    channel = await Channel.on(end)
    server = Server(name="isovary", client_type=None)
    page = Page(server, settings, channel.send_note)
    running = asyncio.ensure_future(
        server.start(
            backend="generic",
            exec_mode="coroutine",
            open_browser=False,
            show_connection_info=False,
            disable_logging=True,
        )
    )
    await server.ready
    await channel.send_note(ready=True)
    try:
        await _relay(channel, server._server["ws"], page)
    finally:
        await page.close()
        running.cancel()


async def _relay(channel: Channel, endpoint: Any, page: Any) -> None:
    """Pass messages between the browsers and trame, until the gateway hangs up."""
    endpoint.sendWrappedError = _without_traces(endpoint.sendWrappedError)
    browsers: dict[int, asyncio.Queue[bytes | None]] = {}
    while (frame := await channel.receive()) is not None:
        if frame.kind == Kind.OPENED:
            browsers[frame.client] = asyncio.Queue()
            _keep(_attend(channel, endpoint, frame.client, browsers[frame.client]))
        elif frame.kind == Kind.MESSAGE and frame.client in browsers:
            browsers[frame.client].put_nowait(frame.payload)
        elif frame.kind == Kind.CLOSED and frame.client in browsers:
            browsers.pop(frame.client).put_nowait(None)
        elif frame.kind == Kind.NOTE:
            _keep(page.noted(frame.note))


async def _attend(
    channel: Channel, endpoint: Any, client: int, messages: asyncio.Queue[bytes | None]
) -> None:
    """Hand the messages of one browser to trame, one after the other."""
    connection = await endpoint.connect()

    async def pass_on(_binary: bool, message: bytes) -> None:
        with suppress(ConnectionError):
            await channel.send(Kind.MESSAGE, client, message)

    connection.on_message(pass_on)
    try:
        while (message := await messages.get()) is not None:
            await connection.send(True, _Message(message))
    finally:  # also after a message that is none
        with suppress(ConnectionError):  # the gateway has gone
            await endpoint.disconnect(connection)
            await channel.send(Kind.CLOSED, client)


_tasks: set[asyncio.Task[None]] = set()  # asyncio itself keeps only weak references


def _keep(work: Coroutine[Any, Any, None]) -> None:
    task = asyncio.ensure_future(work)
    _tasks.add(task)
    task.add_done_callback(_tasks.discard)


class _Message:
    """A message as wslink expects it from its web server."""

    def __init__(self, data: bytes) -> None:
        self.data = data


def _without_traces(send: Any) -> Any:
    """Wrap wslink's sender of errors so that no stack trace reaches a browser."""

    async def plain(
        call: str, code: int, message: str, data: Any = None, client_id: Any = None
    ) -> None:
        await send(call, code, message, None if code == _EXCEPTION else data, client_id)

    return plain
