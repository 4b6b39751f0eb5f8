"""The gateway, attacked and used over real connections on 127.0.0.1.

The clients of `_gate` are written by hand from RFC 9112 and RFC 6455; the session behind the
gateway is the stand-in of `_stub_session`.
"""

from __future__ import annotations

import asyncio
import functools
import gc
import gzip
import io
import json
import os
import re
import signal
import socket
import subprocess
import sys
import urllib.parse
from pathlib import Path

import numpy as np
import pytest
from _attacks import ATTACKS, POST
from _gate import Gate, Websocket, is_alive, running, until

from isovary.app import _gateway
from isovary.app._sessions import Jobs, Sessions
from isovary.app._settings import GatewaySettings
from isovary.errors import ArgumentError

UPLOAD = 100_000
PAGE = Path(__file__).parents[2] / "docs" / "web-safety.md"


def npy() -> bytes:
    stream = io.BytesIO()
    np.save(stream, np.zeros((4, 4, 4)))
    return stream.getvalue()


class World:
    """A gateway with two open sessions, and so with no room for a third."""

    def __init__(self, gate) -> None:
        self.gate, self.a, self.b = gate, gate.open(), gate.open()
        with Websocket(gate, self.a) as page:
            self.folder = Path(page.ask(b"folder").decode())
        out = self.folder / "out"
        (out / "result.vtp").write_bytes(b"of a")
        (out / ".hidden").write_bytes(b"x")
        (out / "link.vtp").symlink_to("/etc/passwd")
        (out / "inside.vtp").symlink_to(out / "result.vtp")
        (out / "a\r\nSet-Cookie: x=1").write_bytes(b"x")

    def filled(self, text: str) -> str:
        """Put what is only known now into a line of the table."""
        gate = self.gate
        words = {"PORT": gate.port, "SID": self.a, "OTHER": self.b, "TOKEN": gate.token}
        words |= {"HOST": gate.host, "COOKIE": gate.cookie, "LONG": "x" * 5000}
        words |= {"NAME": gate.cookie.split("=")[0], "NEXT": gate.port + 1}
        return re.sub(r"\{(\w+)\}", lambda found: str(words[found[1]]), text)


@pytest.fixture(scope="module")
def world():
    with running(sessions=2, upload=UPLOAD) as gate:
        yield World(gate)


@pytest.mark.parametrize("attack", ATTACKS, ids=lambda attack: attack.what)
def test_an_attack_is_refused(world, attack):
    """Oracle: theory. The status that RFC 9110, 9112, 6585 or 6455 give the refusal.

    ====  ==========================================================================
    400   a message that breaks the grammar: RFC 9112, 3.2 (Host) and 6 (body)
    401   the key is missing or wrong: RFC 9110, 15.5.2
    403   the key is right, but another page calls: 15.5.4
    404   nothing is there, or it is not told: 15.5.5
    405   the method does not fit, with Allow: 15.5.6
    413   the content is too large: 15.5.14
    414   the address is too long: 15.5.15
    415   the content, or its coding, is not taken: 15.5.16
    421   a name that is not ours: 15.5.20
    426   only a websocket is spoken there: 15.5.22
    431   the headers are too large: RFC 6585, 5
    503   there is no room at present: RFC 9110, 15.6.4
    ====  ==========================================================================
    """
    before = sorted(path.name for path in (world.folder / "in").iterdir())
    headers = {k: v and world.filled(v) for k, v in attack.headers.items()}
    answer = world.gate.ask(world.filled(attack.line), headers, attack.body)
    assert answer.status == attack.status, answer
    assert sorted(path.name for path in (world.folder / "in").iterdir()) == before
    text = answer.body.decode()
    assert "Traceback" not in text
    assert "aiohttp" not in text + str(answer.headers)
    assert "<script" not in text or answer.header("Content-Type").startswith("text/plain")
    assert (answer.header("Allow") is not None) == (attack.status == 405)
    assert answer.header("Set-Cookie") is None
    _assert_sealed(answer)


def _assert_sealed(answer):
    rules = answer.header("Content-Security-Policy")
    assert "default-src 'self'" in rules
    assert "frame-ancestors 'none'" in rules
    assert "'unsafe-inline'" not in rules.split("script-src")[1].split(";")[0]
    assert answer.header("X-Content-Type-Options") == "nosniff"
    assert answer.header("Referrer-Policy") == "no-referrer"
    assert answer.header("Cross-Origin-Opener-Policy") == "same-origin"
    assert answer.header("Cross-Origin-Resource-Policy") == "same-origin"


def test_the_page_on_safety_lists_the_same_attacks():
    """Oracle: data. Each row of docs/web-safety.md is an attack of the table, and none misses."""
    rows = re.findall(r"^\| ([^|]+) \| (\d{3}) \|$", PAGE.read_text("utf-8"), re.MULTILINE)
    assert rows == [(attack.what, str(attack.status)) for attack in ATTACKS]
    assert len(ATTACKS) == len({attack.what for attack in ATTACKS}) > 30


def test_a_websocket_speaks_binary_only(world):
    """Oracle: theory. RFC 6455, 7.4.1: code 1003 for data of a type that is not taken."""
    with Websocket(world.gate, world.a) as page:
        page.send(b"text", code=1)
        assert page.closing_code() == 1003


def test_a_giant_frame_is_not_read(world):
    """Oracle: theory. RFC 6455, 7.4.1: code 1009; the frame's head alone tells."""
    with Websocket(world.gate, world.a) as page:
        page.send(b"the start of it", length=_gateway.LONGEST_MESSAGE + 1)
        assert page.closing_code() == 1009


def test_a_broken_frame_closes_the_websocket(world):
    """Oracle: theory. RFC 6455, 5.2: reserved kinds fail the connection with 1002."""
    with Websocket(world.gate, world.a) as page:
        page.send(b"x", code=3)
        assert page.closing_code() == 1002


def test_a_fifth_websocket_is_refused(world):
    """Oracle: algebra. Four look at a session; the fifth waits until one of them leaves."""
    pages = [Websocket(world.gate, world.b) for _ in range(5)]
    assert [page.status for page in pages] == [101] * 4 + [503]
    pages[0].__exit__()

    def is_let_in() -> bool:
        pages.append(Websocket(world.gate, world.b))
        return pages[-1].status == 101

    until(is_let_in)
    for page in pages:
        page.__exit__()


def test_sessions_do_not_hear_each_other(world):
    """Oracle: algebra. What is sent in one session comes back there, and nowhere else."""
    with Websocket(world.gate, world.a) as a, Websocket(world.gate, world.b) as b:
        a.send(b"secret of a")
        b.send(b"secret of b")
        assert a.receive() == (2, b"secret of a")
        assert b.receive() == (2, b"secret of b")
        assert a.ask(b"pid") != b.ask(b"pid")
        assert a.ask(b"folder") != b.ask(b"folder")


def test_two_webpages_of_a_session_are_told_apart(world):
    """Oracle: algebra. The answer goes to the one that asked."""
    with Websocket(world.gate, world.a) as one, Websocket(world.gate, world.a) as two:
        assert one.ask(b"1") == b"1"
        assert two.ask(b"2") == b"2"
        assert one.ask(b"3") == b"3"


def test_a_message_passes_as_it_is(world):
    """Oracle: algebra. Every byte, and a length beyond each of the frame's three heads."""
    with Websocket(world.gate, world.a) as page:
        for size in (0, 1, 125, 126, 65536, 300_001, 10_000_000):
            sent = bytes(range(256)) * (size // 256) + bytes(size % 256)
            assert page.ask(sent) == sent


def test_the_right_token_opens(world):
    """Oracle: theory. RFC 9110, 15.4.4: 303 leads on; the cookie is out of reach of scripts."""
    answer = world.gate.ask(f"GET /?token={world.gate.token}&view=a%26b%0d%0a", {"Cookie": None})
    assert answer.status == 303
    assert answer.header("Location") == "/?view=a%26b%0D%0A"
    cookie = answer.header("Set-Cookie")
    assert cookie.split(";")[0] == world.gate.cookie
    assert {"HttpOnly", "SameSite=Strict", "Path=/"} <= set(cookie.split("; "))
    assert world.gate.token not in cookie


def test_a_link_with_the_token_opens_by_a_page(world):
    """Oracle: theory. A strict cookie is not sent along a redirect that another site began."""
    answer = world.gate.ask(
        f"GET /?token={world.gate.token}&view=%22%3E%3Cb%3E",
        {
            "Cookie": None,
            "Sec-Fetch-Site": "cross-site",
            "Sec-Fetch-Mode": "navigate",
            "Sec-Fetch-Dest": "document",
        },
    )
    assert answer.status == 200
    assert b"url=/?view=%22%3E%3Cb%3E" in answer.body
    assert answer.header("Set-Cookie").split(";")[0] == world.gate.cookie


def test_the_page_and_its_files(world):
    """Oracle: data. What the page names is there, with its kind, and its one script is allowed."""
    page = world.gate.ask(f"GET /s/{world.a}/")
    assert page.status == 200
    assert page.header("Content-Type") == "text/html; charset=utf-8"
    assert page.header("Cache-Control") == "no-store"
    named = re.findall(rb'(?:src|href)="([^".][^"]*\.\w+|\./[^"]+)"', page.body)
    assert len(named) >= 4
    kinds = {".js": "text/javascript", ".css": "text/css", ".png": "image/png"}
    for name in named:
        answer = world.gate.ask(f"GET /s/{world.a}/{name.decode().removeprefix('./')}")
        assert answer.status == 200
        assert answer.header("Content-Type").split(";")[0] == kinds[Path(name.decode()).suffix]
        assert "immutable" in answer.header("Cache-Control")
        assert answer.header("Content-Encoding") is None
        _assert_sealed(answer)
    assert page.header("Content-Security-Policy").count("'sha256-") == 1


def test_files_are_packed_where_the_browser_can_unpack(world):
    """Oracle: peer. gzip of the standard library unpacks to the plain file."""
    plain = world.gate.ask(f"GET /s/{world.a}/vue.global.js")
    packed = world.gate.ask(f"GET /s/{world.a}/vue.global.js", {"Accept-Encoding": "br, gzip"})
    assert packed.header("Content-Encoding") == "gzip"
    assert len(packed.body) < len(plain.body) / 2
    assert gzip.decompress(packed.body) == plain.body
    head = world.gate.ask(f"HEAD /s/{world.a}/vue.global.js")
    assert (head.status, head.body) == (200, b"")
    assert head.header("Content-Length") == str(len(plain.body))


def test_a_download_is_saved_and_not_shown(world):
    """Oracle: theory. RFC 6266: an attachment, its name quoted and once more in UTF-8."""
    name = "a;b=ü .vtp"
    (world.folder / "out" / name).write_bytes(b"content")
    answer = world.gate.ask(f"GET /s/{world.a}/files/{urllib.parse.quote(name)}")
    assert (answer.status, answer.body) == (200, b"content")
    assert answer.header("Content-Type") == "application/octet-stream"
    assert answer.header("Content-Disposition") == (
        "attachment; filename=\"a_b__ .vtp\"; filename*=UTF-8''a%3Bb%3D%C3%BC%20.vtp"
    )
    _assert_sealed(answer)


@pytest.mark.parametrize("shape", ["body", "header", "form"])
def test_an_upload_is_stored_under_another_name(shape):
    """Oracle: algebra. Every byte arrives; the name is told and not used."""
    with running(upload=UPLOAD, sessions=1) as gate:
        sid = gate.open()
        line, headers, body = (
            f"POST /s/{sid}/upload/perturbed",
            {"Origin": f"http://{gate.host}"},
            npy(),
        )
        if shape == "body":
            line += "?name=..%2F..%2F%3Cb%3E.npy"
        elif shape == "header":
            headers["X-File-Name"] = "..%2F..%2F%3Cb%3E.npy"
        else:
            headers["Content-Type"] = "multipart/form-data; boundary=b"
            start = b'--b\r\nContent-Disposition: form-data; name="f"; filename="<b>.npy"\r\n\r\n'
            body = start + body + b"\r\n--b--\r\n"
        answer = gate.ask(line, headers, body)
        assert (answer.status, json.loads(answer.body)) == (200, {"name": "<b>.npy"})
        assert answer.header("Content-Type").startswith("application/json")
        with Websocket(gate, sid) as page:
            folder = Path(page.ask(b"folder").decode())
            until(page.heard)
            (told,) = (note["uploaded"] for note in page.heard())
        (path,) = (folder / "in").iterdir()
        assert told == {"role": "perturbed", "name": "<b>.npy", "path": str(path)}
        assert path.read_bytes() == npy()
        assert re.fullmatch(r"[0-9a-f]{32}\.npy", path.name)
        assert path.stat().st_mode & 0o077 == 0


def test_uploads_together_are_limited():
    """Oracle: algebra. A folder takes four times the largest file: 4 x 1000 >= 5 x 640 + rest."""
    with running(upload=1000, sessions=1) as gate:
        sid = gate.open()
        assert len(npy()) == 640
        statuses = [gate.upload(sid, "a.npy", npy()).status for _ in range(7)]
        assert statuses == [200] * 6 + [413]


def test_a_file_that_is_cut_off_is_removed(world):
    """Oracle: algebra. The sender hangs up in a chunk: nothing stays."""
    folder = world.folder / "in"
    before = list(folder.iterdir())
    head = world.filled(
        POST + " HTTP/1.1\r\nHost: {HOST}\r\nCookie: {COOKIE}\r\nOrigin: http://{HOST}\r\n"
        "Transfer-Encoding: chunked\r\n\r\nFF\r\n"
    )
    with socket.create_connection(("127.0.0.1", world.gate.port)) as end:
        end.sendall(head.encode() + b"abc")
        until(lambda: len(list(folder.iterdir())) == len(before) + 1)
    until(lambda: list(folder.iterdir()) == before)


def test_the_address_cannot_lead_the_page_elsewhere():
    """Oracle: theory. trame's page takes the server's address from ?sessionURL; it is left out."""
    with running(sessions=1) as gate:
        bad = "sessionURL=ws://evil.example&sessionManagerURL=x&secret=x&application=x"
        answer = gate.ask(f"GET /?{bad}&view=1&token={gate.token}")
        assert answer.header("Location") == "/?view=1"
        sid, query = gate.ask(f"GET /?{bad}&view=1").header("Location").split("/")[2:]
        assert query == "?reconnect=auto&view=1"
        assert re.fullmatch("[0-9a-f]{32}", sid)  # 128 bits; trame writes addresses in lower case


def test_a_fault_of_ours_shows_no_trace(monkeypatch, caplog):
    """Oracle: algebra. The browser reads one sentence; the terminal has the rest."""

    def fail(*_):
        raise LookupError("a secret place")

    monkeypatch.setattr(_gateway, "_opened", fail)
    with running(sessions=1) as gate:
        answer = gate.ask(f"GET /s/{gate.open()}/files/a")
    assert answer.status == 500
    assert answer.body == b"something went wrong here; the terminal tells more\n"
    assert "a secret place" in caplog.text
    _assert_sealed(answer)


def test_a_session_lingers_and_resumes():
    """Oracle: algebra. A page that comes back in time finds its session, a later one does not."""
    with running(linger=0.5, sessions=1) as gate:
        sid = gate.open()
        with Websocket(gate, sid) as page:
            pid = int(page.ask(b"pid"))
            folder = Path(page.ask(b"folder").decode())
        with Websocket(gate, sid) as page:
            assert int(page.ask(b"pid")) == pid
        until(lambda: gate.ask(f"GET /s/{sid}/").status == 410)
        until(lambda: not is_alive(pid) and not folder.exists())
        with Websocket(gate, sid) as late:
            assert late.status == 410
        assert b'href="/"' in gate.ask(f"GET /s/{sid}/").body


def test_a_session_that_nobody_looks_at_ends():
    """Oracle: algebra. Without any websocket the time counts from the start."""
    with running(linger=0.1, sessions=1) as gate:
        sid = gate.open()
        until(lambda: gate.ask(f"GET /s/{sid}/").status == 410)


def test_a_busy_session_is_kept_until_it_is_done():
    """Oracle: algebra. Its own work outlives the page by more than the lingering, then ends."""
    with running(linger=0.1, sessions=2) as gate:
        busy, idle = gate.open(), gate.open()
        with Websocket(gate, idle), Websocket(gate, busy) as page:
            page.note(busy=True)
        until(lambda: gate.ask(f"GET /s/{idle}/").status == 410)
        with Websocket(gate, busy) as page:
            page.note(busy=False)
        until(lambda: gate.ask(f"GET /s/{busy}/").status == 410)


def test_a_busy_session_is_not_kept_for_ever(monkeypatch):
    """Oracle: algebra. Work that never ends is given its time, and no more."""
    short = functools.partial(_gateway.Sessions, busy_linger=0.2)
    monkeypatch.setattr(_gateway, "Sessions", short)
    with running(linger=0.1, sessions=1) as gate:
        sid = gate.open()
        with Websocket(gate, sid) as page:
            page.note(busy=True)
        until(lambda: gate.ask(f"GET /s/{sid}/").status == 410)


@pytest.mark.parametrize("way", [b"die", b"rubbish"])
def test_a_session_that_dies_closes_its_pages(way):
    """Oracle: theory. RFC 6455, 7.4.1: code 1011 for a condition that was not expected."""
    with running(sessions=1) as gate:
        sid = gate.open()
        with Websocket(gate, sid) as page:
            folder = Path(page.ask(b"folder").decode())
            page.send(way)
            assert page.closing_code() == 1011
        assert gate.ask(f"GET /s/{sid}/").status == 410
        until(lambda: not folder.exists())
        assert gate.open() != sid


def test_one_session_waits_ahead():
    """Oracle: algebra. Its process runs before it is asked for, and is the next to be taken."""
    with running(sessions=2) as gate:
        base, (first,) = _folders(gate)
        with Websocket(gate, gate.open()) as page:
            assert Path(page.ask(b"folder").decode()) == first
        until(lambda: len(_folders(gate)[1]) == 2)
        gate.open()
        assert len(_folders(gate)[1]) == 2  # the limit is reached: no further one
    assert not base.exists()


def _folders(gate):
    """The folder of the gateway in this process, and those of its sessions."""
    found = [
        s for s in gc.get_objects() if isinstance(s, Sessions) and s._settings is gate.settings
    ]
    folder = found[0].folder
    return folder, [path for path in folder.iterdir() if path.name != "cache"]


def test_long_runs_wait_for_each_other():
    """Oracle: algebra. One place, two sessions: first come, first served, and the queue moves."""
    with running(jobs=1, sessions=2) as gate:
        a, b = gate.open(), gate.open()
        with Websocket(gate, b) as second:
            with Websocket(gate, a) as first:
                first.note(job="ask", id=1)
                until(lambda: first.heard() == [{"job": "go", "id": 1}])
                first.note(job="ask", id=2)
                until(lambda: first.heard()[-1] == {"job": "wait", "id": 2, "position": 1})
                second.note(job="ask", id=7)
                until(lambda: second.heard() == [{"job": "wait", "id": 7, "position": 2}])
                first.note(job="done", id=1)
                until(lambda: first.heard()[-1] == {"job": "go", "id": 2})
                until(lambda: second.heard()[-1] == {"job": "wait", "id": 7, "position": 1})
                first.send(b"die")
            until(lambda: second.heard()[-1] == {"job": "go", "id": 7})


def test_a_session_cannot_fill_the_queue():
    """Oracle: algebra. Three of its runs wait; the next is refused, one of another session not."""
    jobs = Jobs(places=1, waiting=3)
    assert jobs.ask("a", 0) == [("a", {"job": "go", "id": 0})]
    places = [jobs.ask("a", i)[0][1]["position"] for i in (1, 2, 3)]
    assert places == [1, 2, 3]
    assert jobs.ask("a", 4) == [("a", {"job": "refused", "id": 4, "waiting": 3})]
    assert jobs.ask("b", 4) == [("b", {"job": "wait", "id": 4, "position": 4})]
    assert jobs.ask("a", 1) == []
    assert jobs.done("a", 2) == [
        ("a", {"job": "wait", "id": 3, "position": 2}),
        ("b", {"job": "wait", "id": 4, "position": 3}),
    ]
    assert jobs.drop("a") == [("b", {"job": "go", "id": 4})]
    assert jobs.done("b", 5) == []


def test_nothing_is_left_behind_at_the_end():
    """Oracle: algebra. Also a session that hears nothing ends, and all folders are gone."""
    with running(sessions=1) as gate, Websocket(gate, gate.open()) as page:
        pid = int(page.ask(b"pid"))
        base, folders = _folders(gate)
        assert folders
        assert page.ask(b"deaf") == b"from now on"
    assert not is_alive(pid)
    assert not base.exists()


PROGRAM = """
import secrets, sys
sys.path.insert(0, {here!r})
import _stub_session
from isovary.app import _gateway
from isovary.app._settings import GatewaySettings

if __name__ == "__main__":
    _gateway._session.main = _stub_session.main
    _gateway.serve.__kwdefaults__["session_main"] = _stub_session.main
    settings = GatewaySettings(token=secrets.token_urlsafe(32), sessions=1)
    _gateway.run(settings, False, lambda line: print(line, flush=True))
"""


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_everything(tmp_path, number):
    """Oracle: algebra. The process ends with 0, says nothing, and its folders are removed."""
    program = tmp_path / "program.py"
    program.write_text(PROGRAM.format(here=str(Path(__file__).parent)))
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    child = subprocess.Popen(
        [sys.executable, str(program)],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    with child:
        address = child.stdout.readline().removeprefix("Open ").strip()
        gate = Gate(address, GatewaySettings(token=address.split("token=")[1]))
        with Websocket(gate, gate.open()) as page:
            pid = int(page.ask(b"pid"))
            assert list(tmp_path.glob("isovary-*"))
            os.killpg(child.pid, number) if number == signal.SIGINT else child.send_signal(number)
            assert page.closing_code() == 1001
        assert child.wait(10) == 0
        assert (child.stdout.read(), child.stderr.read()) == ("Ctrl-C ends it\n", "")
    assert not is_alive(pid)
    assert not list(tmp_path.glob("isovary-*"))


def test_the_browser_is_started_without_the_token(monkeypatch):
    """Oracle: algebra. Other users see how a program was started; the page it opens leads on."""
    seen = []

    async def serve(settings, *, started):
        started(f"http://127.0.0.1:1/?token={settings.token}&a=1")
        until(lambda: seen)

    def show(way):
        path = Path(urllib.parse.urlparse(way).path)
        seen.append((way, path.read_text(), path.stat().st_mode & 0o777))

    monkeypatch.setattr(_gateway, "serve", serve)
    monkeypatch.setattr(_gateway.webbrowser, "open", show)
    _gateway.run(GatewaySettings(token="t" * 43), True, lambda line: None)
    ((way, text, mode),) = seen
    assert way.startswith("file:///")
    assert "t" * 43 not in way
    assert f"url=http://127.0.0.1:1/?token={'t' * 43}&amp;a=1" in text
    assert mode == 0o600


def test_it_does_not_start_unsafely():
    """Oracle: algebra. A short token, and a port that somebody has, are said at once."""
    with running(sessions=1) as gate:
        for settings in (
            GatewaySettings(token="x" * 42),
            GatewaySettings(token="x" * 43, port=70_000),
            GatewaySettings(token="x" * 43, port=gate.port),
        ):
            with pytest.raises(ArgumentError) as caught:
                asyncio.run(_gateway.serve(settings, started=lambda address: None))
            assert caught.value.code == "A02"
