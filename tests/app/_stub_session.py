"""A session's process without a page: it answers each message with the same message.

A few words are commands instead, so that a test can look and act inside.
"""

from __future__ import annotations

import asyncio
import json
import os
import signal
import socket
import time

from isovary.app._channel import Channel, Kind
from isovary.app._settings import SessionSettings


def main(end: socket.socket, settings: SessionSettings) -> None:
    asyncio.run(_serve(end, settings))


async def _serve(end: socket.socket, settings: SessionSettings) -> None:
    channel = await Channel.on(end)
    await channel.send_note(ready=True, shown=True)
    heard: list[object] = []
    while (frame := await channel.receive()) is not None:
        if frame.kind == Kind.NOTE:
            heard.append(frame.note)
        elif frame.kind == Kind.MESSAGE:
            answer = await _answer(frame.payload, heard, channel, settings)
            await channel.send(Kind.MESSAGE, frame.client, answer)


async def _answer(
    word: bytes, heard: list[object], channel: Channel, settings: SessionSettings
) -> bytes:
    if word == b"folder":
        return str(settings.folder).encode()
    if word == b"pid":
        return str(os.getpid()).encode()
    if word == b"heard":
        return json.dumps(heard).encode()
    if word.startswith(b"note "):
        await channel.send_note(**json.loads(word[5:]))
        return b"told"
    if word == b"rubbish":
        await channel.send(Kind.NOTE, payload=b"{")
    if word == b"die":
        os._exit(3)
    if word == b"deaf":
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        await channel.send(Kind.MESSAGE, 1, b"from now on")
        time.sleep(600)
    return word
