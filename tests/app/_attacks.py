"""Requests that the gateway refuses, each with the status of the refusal.

``{SID}``, ``{OTHER}``, ``{TOKEN}`` and other words in braces are filled in by the test.
"""

from __future__ import annotations

import io
import zipfile
from dataclasses import dataclass, field


def zipped() -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("bomb", bytes(1_000_000))
    return stream.getvalue()


_NPY = b"\x93NUMPY\x01\x00" + bytes(120)


@dataclass
class Attack:
    """A request, and the status that refuses it."""

    what: str
    status: int
    line: str = "GET /s/{SID}/"
    headers: dict[str, str | None] = field(default_factory=dict)
    body: bytes = b""


OWN = {"Origin": "http://{HOST}"}
SOCKET = {
    **OWN,
    "Connection": "Upgrade",
    "Upgrade": "websocket",
    "Sec-WebSocket-Version": "13",
    "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA==",
}
WS = "GET /s/{SID}/ws"
POST = "POST /s/{SID}/upload/base?name=a.npy"
CHUNKED = {**OWN, "Transfer-Encoding": "chunked"}

# Keys
KEYS = [
    Attack("no cookie and no token", 401, headers={"Cookie": None}),
    Attack("a wrong token", 401, "GET /?token=" + "x" * 43, {"Cookie": None}),
    Attack("a wrong token beside the right cookie", 401, "GET /?token=" + "x" * 43),
    Attack("a token of another length", 401, "GET /?token=x", {"Cookie": None}),
    Attack("the right token with a letter more", 401, "GET /?token={TOKEN}x", {"Cookie": None}),
    Attack("an empty token", 401, "GET /?token=", {"Cookie": None}),
    Attack("the token twice", 401, "GET /?token={TOKEN}&token=x"),
    Attack("a token that is not ASCII", 401, "GET /?token=%C3%BC%00", {"Cookie": None}),
    Attack("the token elsewhere than at /", 401, "GET /s/{SID}/?token={TOKEN}", {"Cookie": None}),
    Attack("the token itself as cookie", 401, headers={"Cookie": "{NAME}={TOKEN}"}),
    Attack("the cookie of another start", 401, headers={"Cookie": "{NAME}=" + "0" * 64}),
    Attack("the cookie under another port's name", 401, headers={"Cookie": "isovary-1={TOKEN}"}),
    Attack("a websocket without cookie", 401, WS, {**SOCKET, "Cookie": None}),
    Attack("an upload without cookie", 401, POST, {**OWN, "Cookie": None}, b"x"),
]
# Other pages in the same browser
PAGES = [
    Attack("a websocket from another page", 403, WS, {**SOCKET, "Origin": "http://evil.example"}),
    Attack("a websocket without Origin", 403, WS, {**SOCKET, "Origin": None}),
    Attack("a websocket with Origin null", 403, WS, {**SOCKET, "Origin": "null"}),
    Attack("an upload from another page", 403, POST, {"Origin": "http://evil.example"}, b"x"),
    Attack("an upload without Origin", 403, POST, {}, b"x"),
    Attack("an upload with Origin null", 403, POST, {"Origin": "null"}, b"x"),
    Attack("Origin with another port", 403, WS, {**SOCKET, "Origin": "http://127.0.0.1:{NEXT}"}),
    Attack("Origin with our name in front", 403, WS, {**SOCKET, "Origin": "http://{HOST}.evil"}),
    Attack(
        "Origin by another of our names", 403, WS, {**SOCKET, "Origin": "http://localhost:{PORT}"}
    ),
    Attack("a foreign Origin on GET", 403, headers={"Origin": "http://evil.example"}),
    Attack("a picture or script on another site", 403, headers={"Sec-Fetch-Site": "cross-site"}),
    Attack("a page on another port", 403, "GET /", {"Sec-Fetch-Site": "same-site"}),
    Attack(
        "a frame on another site, with the token",
        403,
        "GET /?token={TOKEN}",
        {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate", "Sec-Fetch-Dest": "iframe"},
    ),
    Attack(
        "a link on another site, without the token",
        403,
        "GET /",
        {
            "Sec-Fetch-Site": "cross-site",
            "Sec-Fetch-Mode": "navigate",
            "Sec-Fetch-Dest": "document",
        },
    ),
]
# Names that are made to mean 127.0.0.1
NAMES = [
    Attack("Host of another site", 421, headers={"Host": "evil.example"}),
    Attack("Host of another site, our port", 421, headers={"Host": "evil.example:{PORT}"}),
    Attack("Host that begins like ours", 421, headers={"Host": "127.0.0.1.evil.example:{PORT}"}),
    Attack("Host with another port", 421, headers={"Host": "127.0.0.1:{NEXT}"}),
    Attack("Host without the port", 421, headers={"Host": "127.0.0.1"}),
    Attack("Host of another spelling of the address", 421, headers={"Host": "2130706433:{PORT}"}),
    Attack("Host 0.0.0.0", 421, headers={"Host": "0.0.0.0:{PORT}"}),
    Attack("no Host", 400, headers={"Host": None}),
    Attack("two Hosts", 400, headers={"Host": "{HOST}\r\nHost: evil.example"}),
    Attack("the same Host twice", 400, headers={"Host": "{HOST}\r\nHost: {HOST}"}),
    Attack("another site in the request line", 421, "GET http://evil.example/s/{SID}/"),
]
# Paths
PATHS = [
    Attack(".. in the path", 404, "GET /s/{SID}/../../../../etc/passwd"),
    Attack("%2e%2e in the path", 404, "GET /s/{SID}/%2e%2e/%2e%2e/%2e%2e/etc/passwd"),
    Attack("%2e%2e%2f in the path", 404, "GET /s/{SID}/%2e%2e%2f%2e%2e%2fetc/passwd"),
    Attack("%252e%252e in the path", 404, "GET /s/{SID}/%252e%252e/%252e%252e/etc/passwd"),
    Attack("a backslash in the path", 404, "GET /s/{SID}/..%5c..%5cetc%5cpasswd"),
    Attack("a NUL in the path", 404, "GET /s/{SID}/index.html%00.png"),
    Attack("a bare NUL in the request line", 400, "GET /s/{SID}/a\0b"),
    Attack("an absolute path", 404, "GET /s/{SID}//etc/passwd"),
    Attack("out of our own static files", 404, "GET /s/{SID}/__isovary/../_locks.py"),
    Attack("a file of dots", 404, "GET /s/{SID}/.gitignore"),
    Attack(".. in a download", 404, "GET /s/{SID}/files/..%2fin"),
    Attack("%252e in a download", 404, "GET /s/{SID}/files/%252e%252e%252fin"),
    Attack("a backslash in a download", 404, "GET /s/{SID}/files/..%5cin"),
    Attack("a NUL in a download", 404, "GET /s/{SID}/files/result.vtp%00"),
    Attack("an absolute download", 404, "GET /s/{SID}/files/%2fetc%2fpasswd"),
    Attack("the folder as download", 404, "GET /s/{SID}/files/."),
    Attack("a hidden download", 404, "GET /s/{SID}/files/.hidden"),
    Attack("a link that leads out", 404, "GET /s/{SID}/files/link.vtp"),
    Attack("a link to a neighbour", 404, "GET /s/{SID}/files/inside.vtp"),
    Attack("CRLF in a download's name", 404, "GET /s/{SID}/files/a%0d%0aSet-Cookie:%20x=1"),
]
# Sessions
SESSIONS = [
    Attack("an unknown session", 404, "GET /s/AAAAAAAAAAAAAAAAAAAAAA/"),
    Attack("a guess of one letter", 404, "GET /s/a/"),
    Attack("an empty session", 404, "GET /s//"),
    Attack("a session's start", 404, "GET /s/{SID}x/"),
    Attack("a websocket of an unknown session", 404, "GET /s/x/ws", SOCKET),
    Attack("an upload to an unknown session", 404, "POST /s/x/upload/base?name=a.npy", OWN, b"x"),
    Attack("a download of another session", 404, "GET /s/{OTHER}/files/result.vtp"),
    Attack("more sessions than allowed", 503, "GET /"),
]
# Uploads
FORM = {**OWN, "Content-Type": "multipart/form-data; boundary=b"}
UPLOADS = [
    Attack("Content-Length above the limit", 413, POST, {**OWN, "Content-Length": "100001"}),
    Attack("an immense Content-Length", 413, POST, {**OWN, "Content-Length": "9" * 18}),
    Attack(
        "chunks beyond the limit",
        413,
        POST,
        CHUNKED,
        b"186A0\r\n" + bytes(100_000) + b"\r\n1\r\nx\r\n0\r\n\r\n",
    ),
    Attack("a chunk size that overflows", 400, POST, CHUNKED, b"F" * 17 + b"\r\nabc"),
    Attack("a chunk size that is none", 400, POST, CHUNKED, b"-5\r\nabc\r\n0\r\n\r\n"),
    Attack("a zip bomb named .vti", 415, "POST /s/{SID}/upload/base?name=a.vti", OWN, zipped()),
    Attack("a body that is said to be gzip", 415, POST, {**OWN, "Content-Encoding": "gzip"}, _NPY),
    Attack("content of another kind", 415, POST, OWN, b"<script>alert(1)</script>"),
    Attack("an ending that is not taken", 415, "POST /s/{SID}/upload/base?name=a.html", OWN, b"x"),
    Attack(
        "a script in the file's name",
        415,
        "POST /s/{SID}/upload/base?name=%3Cscript%3Ealert(1)%3C/script%3E.vti",
        OWN,
        b"x",
    ),
    Attack("a file without a name", 400, "POST /s/{SID}/upload/base", OWN, b"x"),
    Attack("a name of control characters", 400, "POST /s/{SID}/upload/base?name=%0d%0a", OWN, b"x"),
    Attack("an empty file", 415, POST, {**OWN, "Content-Length": "0"}),
    Attack("an unknown role", 404, "POST /s/{SID}/upload/other?name=a.npy", OWN, b"x"),
    Attack("a role that leads out", 404, "POST /s/{SID}/upload/..%2fout?name=a.npy", OWN, b"x"),
    Attack(
        "a form that is none",
        400,
        POST,
        FORM,
        b"no boundary at all",
    ),
    Attack("a form without boundary", 400, POST, {**OWN, "Content-Type": "multipart/x"}, b"x"),
    Attack(
        "a form whose part has an immense header",
        400,
        POST,
        FORM,
        b"--b\r\nX: " + b"x" * 60_000 + b"\r\n\r\nx\r\n--b--\r\n",
    ),
    Attack(
        "a form whose part has a hundred headers",
        400,
        POST,
        FORM,
        b"--b\r\n" + b"X: y\r\n" * 200 + b"\r\nx\r\n--b--\r\n",
    ),
]
# Requests that two readers could understand differently, or that are too much
SHAPES = [
    Attack("Content-Length and Transfer-Encoding", 400, POST, CHUNKED | {"Content-Length": "5"}),
    Attack("two Content-Lengths", 400, POST, {**OWN, "Content-Length": "1\r\nContent-Length: 2"}),
    Attack("a signed Content-Length", 400, POST, {**OWN, "Content-Length": "+1"}),
    Attack("a space before the colon", 400, headers={"Transfer-Encoding ": "chunked"}),
    Attack("a folded header", 400, headers={"A": "b\r\n c"}),
    Attack("an unknown Transfer-Encoding", 400, POST, {**OWN, "Transfer-Encoding": "xchunked"}),
    Attack("a giant header", 431, headers={"A": "x" * 100_000}),
    Attack("headers that are too long together", 431, headers=dict.fromkeys("ABCD", "{LONG}")),
    Attack("too many headers", 431, headers={f"A{i}": "x" for i in range(200)}),
    Attack("an address that is too long", 414, "GET /s/{SID}/?{LONG}"),
    Attack("TRACE", 405, "TRACE /s/{SID}/", OWN),
    Attack("PUT", 405, "PUT /s/{SID}/files/result.vtp", OWN, b"x"),
    Attack("DELETE", 405, "DELETE /s/{SID}/files/result.vtp", OWN),
    Attack(
        "OPTIONS from another page", 403, "OPTIONS /s/{SID}/", {"Origin": "http://evil.example"}
    ),
    Attack("POST on a page", 405, "POST /s/{SID}/", OWN, b"x"),
    Attack("GET on an upload", 405, "GET /s/{SID}/upload/base"),
    Attack("no websocket at its place", 426, WS, OWN),
    Attack("a websocket of an old version", 426, WS, {**SOCKET, "Sec-WebSocket-Version": "0"}),
    Attack("bytes that are no HTTP", 400, "\x16\x03\x01"),
]
ATTACKS = [*KEYS, *PAGES, *NAMES, *PATHS, *SESSIONS, *UPLOADS, *SHAPES]
