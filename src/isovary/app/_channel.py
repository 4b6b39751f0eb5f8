"""Frames on a socket: how the gateway and a session's process talk.

A frame is nine bytes, its length (u32, little endian), its kind (u8) and the number of the
client it belongs to (u32), and then its payload. One socket pair joins the gateway to each
session; no session has a port that anybody else could knock at.
"""

from __future__ import annotations

import asyncio
import json
import socket
import struct
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

_HEAD = struct.Struct("<IBI")

LONGEST = 64 * 1024 * 1024
"""Bytes of the longest frame that is taken."""


class Kind(IntEnum):
    """What a frame is."""

    OPENED = 1
    """A browser's websocket opened."""
    MESSAGE = 2
    """A message of a websocket, as it is."""
    CLOSED = 3
    """A websocket closed."""
    NOTE = 4
    """Something between gateway and session themselves, in JSON."""


@dataclass(frozen=True)
class Frame:
    """One frame; ``client`` is 0 where it belongs to none."""

    kind: Kind
    client: int
    payload: bytes

    @property
    def note(self) -> dict[str, Any]:
        """The payload of a note."""
        found: dict[str, Any] = json.loads(self.payload)
        return found


class Channel:
    """One end of the socket pair."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._reader, self._writer = reader, writer

    @classmethod
    async def on(cls, end: socket.socket) -> Channel:
        """The channel on a connected socket."""
        end.setblocking(False)
        return cls(*await asyncio.open_connection(sock=end, limit=2**20))

    async def send(self, kind: Kind, client: int = 0, payload: bytes = b"") -> None:
        """Send a frame; waits while the other end is slow.

        Raises
        ------
        ValueError
            For a payload longer than `LONGEST`, at which the other end would hang up.
        ConnectionError
            If the other end has gone.
        """
        if self._writer.is_closing():
            raise ConnectionResetError("the other end has gone")
        if len(payload) > LONGEST:
            raise ValueError(f"payload: expected at most {LONGEST} bytes, got {len(payload)}")
        self._writer.write(_HEAD.pack(len(payload), kind, client) + payload)
        await self._writer.drain()

    async def send_note(self, **note: object) -> None:
        """Send a note."""
        await self.send(Kind.NOTE, payload=json.dumps(note).encode())

    async def receive(self) -> Frame | None:
        """Return the next frame, or None when the other end is gone."""
        try:
            length, kind, client = _HEAD.unpack(await self._reader.readexactly(_HEAD.size))
            if length > LONGEST:
                return None
            return Frame(Kind(kind), client, await self._reader.readexactly(length))
        except (asyncio.IncompleteReadError, ConnectionError, ValueError):
            return None

    def close(self) -> None:
        """Hang up."""
        self._writer.close()
