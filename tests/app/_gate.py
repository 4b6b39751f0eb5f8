"""A real gateway on 127.0.0.1, and clients that speak HTTP and websocket by hand."""

from __future__ import annotations

import asyncio
import base64
import json
import os
import secrets
import socket
import struct
import threading
import time
from collections.abc import Callable, Iterable
from contextlib import contextmanager
from dataclasses import dataclass, replace

import _stub_session
import numpy as np

from isovary.app import _gateway
from isovary.app._locks import Locks
from isovary.app._settings import GatewaySettings

PATIENCE = 10.0


@dataclass
class Answer:
    status: int
    headers: list[tuple[str, str]]
    body: bytes

    def header(self, name: str) -> str | None:
        return next((value for key, value in self.headers if key.lower() == name.lower()), None)


@dataclass
class Gate:
    address: str
    settings: GatewaySettings

    @property
    def port(self) -> int:
        return int(self.address.split(":")[2].split("/")[0])

    @property
    def token(self) -> str:
        return self.settings.token

    @property
    def host(self) -> str:
        return f"127.0.0.1:{self.port}"

    @property
    def cookie(self) -> str:
        locks = Locks(self.token, self.port, frozenset())
        return f"{locks.cookie}={locks.key}"

    def ask(self, line: str, headers: dict[str, str | None] | None = None, body=b"") -> Answer:
        """Send a request with the right Host and cookie, unless ``headers`` say otherwise."""
        sent = {"Host": self.host, "Cookie": self.cookie, "Connection": "close"}
        if body and "Transfer-Encoding" not in (headers or {}):
            sent["Content-Length"] = str(len(body))
        sent |= headers or {}
        lines = [f"{line} HTTP/1.1", *(f"{k}: {v}" for k, v in sent.items() if v is not None)]
        return self.raw("\r\n".join(lines).encode() + b"\r\n\r\n" + body)

    def raw(self, request: bytes) -> Answer:
        with socket.create_connection(("127.0.0.1", self.port), timeout=PATIENCE) as end:
            end.sendall(request)
            return _read_answer(end, request.startswith(b"HEAD"))

    def open(self) -> str:
        """Begin a session, and return its name."""
        answer = self.ask("GET /")
        assert answer.status == 303, answer
        return answer.header("Location").split("/")[2]

    def upload(self, sid: str, name: str, body: bytes, role: str = "base", **headers: str):
        sent = {"Origin": f"http://{self.host}", **headers}
        return self.ask(f"POST /s/{sid}/upload/{role}?name={name}", sent, body)


def _read_answer(end: socket.socket, is_head: bool) -> Answer:
    stream = end.makefile("rb")
    with stream:
        status = int(stream.readline().split()[1])
        headers = []
        while (line := stream.readline().strip()) != b"":
            name, value = line.decode("latin-1").split(": ", 1)
            headers.append((name, value))
        answer = Answer(status, headers, b"")
        length = 0 if status == 101 or is_head else int(answer.header("Content-Length"))
        answer.body = stream.read(length)
        return answer


class Websocket:
    """RFC 6455 by hand: what it sends need not be right."""

    def __init__(self, gate: Gate, sid: str, **headers: str | None) -> None:
        key = base64.b64encode(secrets.token_bytes(16)).decode()
        sent = {"Host": gate.host, "Cookie": gate.cookie, "Origin": f"http://{gate.host}"}
        sent |= {"Connection": "Upgrade", "Upgrade": "websocket", "Sec-WebSocket-Version": "13"}
        sent |= {"Sec-WebSocket-Key": key, **headers}
        lines = [f"GET /s/{sid}/ws HTTP/1.1", *(f"{k}: {v}" for k, v in sent.items() if v)]
        self._end = socket.create_connection(("127.0.0.1", gate.port), timeout=PATIENCE)
        self._end.sendall("\r\n".join(lines).encode() + b"\r\n\r\n")
        head = b""
        while b"\r\n\r\n" not in head and (byte := self._end.recv(1)):
            head += byte
        self.status = int(head.split()[1])

    def __enter__(self) -> Websocket:
        return self

    def __exit__(self, *_: object) -> None:
        self._end.close()

    def send(self, data: bytes, code: int = 2, length: int | None = None) -> None:
        """Send a frame; ``length`` is what its head claims."""
        mask, size = os.urandom(4), len(data) if length is None else length
        if size < 126:
            head = struct.pack("!BB", 0x80 | code, 0x80 | size)
        else:
            head = struct.pack("!BBQ", 0x80 | code, 0x80 | 127, size)
        hidden = np.frombuffer(data, np.uint8) ^ np.resize(np.frombuffer(mask, np.uint8), len(data))
        self._end.sendall(head + mask + hidden.tobytes())

    def receive(self) -> tuple[int, bytes]:
        """Return kind and content of the next frame; (8, code) at the end."""
        while True:
            first, size = self._read(2)
            if size == 126:
                (size,) = struct.unpack("!H", self._read(2))
            elif size == 127:
                (size,) = struct.unpack("!Q", self._read(8))
            data = self._read(size)
            if first & 15 != 9:
                return first & 15, data

    def ask(self, data: bytes) -> bytes:
        self.send(data)
        return self.receive()[1]

    def note(self, **note: object) -> None:
        assert self.ask(b"note " + json.dumps(note).encode()) == b"told"

    def heard(self) -> list[dict]:
        return json.loads(self.ask(b"heard"))

    def closing_code(self) -> int:
        """Read until the other side closes, and return its code."""
        while (frame := self.receive())[0] != 8:
            pass
        return struct.unpack("!H", frame[1][:2])[0]

    def _read(self, size: int) -> bytes:
        data = b""
        while len(data) < size:
            piece = self._end.recv(size - len(data))
            if not piece:
                raise ConnectionError("the other side is gone")
            data += piece
        return data


@contextmanager
def running(**settings: object) -> Iterable[Gate]:
    """Run a gateway in a thread."""
    told = GatewaySettings(token=secrets.token_urlsafe(32))
    told = replace(told, **settings)
    begun, kept = threading.Event(), {}

    async def serve() -> None:
        kept["loop"], kept["stop"] = asyncio.get_running_loop(), asyncio.Event()

        def started(address: str) -> None:
            kept["address"] = address
            begun.set()

        main = _stub_session.main
        await _gateway.serve(told, started=started, session_main=main, stop=kept["stop"])

    thread = threading.Thread(target=asyncio.run, args=(serve(),), daemon=True)
    thread.start()
    assert begun.wait(PATIENCE)
    try:
        yield Gate(kept["address"], told)
    finally:
        kept["loop"].call_soon_threadsafe(kept["stop"].set)
        thread.join(PATIENCE)
        assert not thread.is_alive()


def until(true: Callable[[], object], seconds: float = PATIENCE) -> None:
    """Wait for a condition."""
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end, "it never came true"
        time.sleep(0.02)


def is_alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True
