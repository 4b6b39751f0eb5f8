"""Who may talk to the gateway: the checks that every request passes before anything is done.

A page on 127.0.0.1 is not private by itself: any web site that is open in the same browser can
send requests there, and a name that an attacker owns can be made to mean 127.0.0.1. So the
name by which the gateway is called (Host), the page that calls (Origin, Sec-Fetch-Site) and the
secret (token, then cookie) must all be right.
"""

from __future__ import annotations

import base64
import hashlib
import hmac
import html
import logging
import re
import secrets
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from urllib.parse import urlsplit

from aiohttp import web

_log = logging.getLogger("isovary.app")

LONGEST_TARGET = 4096
"""Bytes of the longest address that is read."""
LONGEST_HEADERS = 16 * 1024
"""Bytes of all headers together."""

_UPLOAD = re.compile(r"/s/[^/]+/upload/[^/]+")
_LOOPBACK = ("127.0.0.1", "::1", "localhost")
_OWN_SITE = ("same-origin", "none")
_FAULT = "something went wrong here; the terminal tells more"


class Refused(Exception):  # noqa: N818 - it is an answer, not a fault of ours
    """A request that is answered with a status and a short plain text."""

    def __init__(self, status: int, text: str, **headers: str) -> None:
        super().__init__(status, text)
        self.status, self.text, self.headers = status, text, headers

    def answer(self) -> web.Response:
        """The response that says so."""
        return web.Response(status=self.status, text=f"{self.text}\n", headers=self.headers)


def new_token() -> str:
    """Return a fresh secret of 256 random bits, 43 letters long.

    Examples
    --------
    >>> len(new_token()), new_token() == new_token()
    (43, False)
    """
    return secrets.token_urlsafe(32)


def is_loopback(host: str) -> bool:
    """Say whether an address is reached from this computer only.

    Examples
    --------
    >>> is_loopback("127.0.0.1"), is_loopback("0.0.0.0")
    (True, False)
    """
    return host in _LOOPBACK


def hosts_of(host: str, port: int, further: tuple[str, ...] = ()) -> frozenset[str]:
    """Return the values of the Host header by which the gateway may be called.

    Parameters
    ----------
    host, port : str, int
        Where the gateway listens; all addresses (``0.0.0.0``, ``::``) name none of themselves.
    further : tuple of str
        Other names, with their port, or without one: then with this port and with the default.

    Examples
    --------
    >>> sorted(hosts_of("127.0.0.1", 8080, ("lab.example",)))
    ['127.0.0.1:8080', 'lab.example', 'lab.example:8080', 'localhost:8080']
    """
    names = {"::1": ["[::1]", "localhost"], "0.0.0.0": ["127.0.0.1", "localhost"]}
    names["::"] = ["127.0.0.1", "localhost", "[::1]"]
    names["127.0.0.1"] = names["localhost"] = names["0.0.0.0"]
    own = names.get(host, [f"[{host}]" if ":" in host else host])
    found = {f"{name}:{port}" for name in own} | (set(own) if port == 80 else set())
    for name in further:
        has_port = re.search(r":\d+$", name) and not name.endswith("]")
        found |= {name} if has_port else {name, f"{name}:{port}"}
    return frozenset(found)


def script_hashes(page: str) -> tuple[str, ...]:
    """Return what a Content-Security-Policy calls the scripts that stand inside a page.

    Examples
    --------
    >>> script_hashes("<script src='a.js'></script><script>1</script>")
    ("'sha256-a4ayc/80/OGda4BO/1o/V0etpOqiLx1JwB5S3beHW0s='",)
    """
    inside = re.findall(r"<script>(.*?)</script>", page, re.DOTALL)
    digests = [hashlib.sha256(script.encode()).digest() for script in inside]
    return tuple(f"'sha256-{base64.b64encode(digest).decode()}'" for digest in digests)


@dataclass(frozen=True)
class Locks:
    """The checks of one gateway.

    Parameters
    ----------
    token : str
        The secret.
    port : int
        Where the gateway listens; gives the cookie its name.
    hosts : frozenset of str
        As of `hosts_of`.
    scripts : tuple of str
        As of `script_hashes`, of the page.
    """

    token: str
    port: int
    hosts: frozenset[str]
    scripts: tuple[str, ...] = ()

    @property
    def cookie(self) -> str:
        """Name of the cookie."""
        return f"isovary-{self.port}"

    @property
    def key(self) -> str:
        """Value of the cookie: made from the token, so that the token is stored nowhere."""
        return hmac.new(self.token.encode(), b"isovary cookie", hashlib.sha256).hexdigest()

    def check(self, request: web.Request) -> None:
        """Let a request pass.

        Raises
        ------
        Refused
            With status 400, 401, 403, 405, 414, 421 or 431.
        """
        _check_size(request)
        host = self._check_host(request)
        _check_origin(request, host)
        self._check_site(request)
        _check_method(request)
        if not (self.has_token(request) if _asks_with_token(request) else self._has_key(request)):
            raise Refused(401, _CLOSED)

    def has_token(self, request: web.Request) -> bool:
        """Say whether the address carries the token, once."""
        given = request.query.getall("token", [])
        return request.path == "/" and len(given) == 1 and _same(given[0], self.token)

    def _has_key(self, request: web.Request) -> bool:
        return _same(request.cookies.get(self.cookie, ""), self.key)

    def _check_host(self, request: web.Request) -> str:
        given = request.headers.getall("Host", [])
        if len(given) != 1:
            raise Refused(400, "expected one Host header")
        called = {given[0]}
        if "://" in request.raw_path.split("?")[0] and not request.raw_path.startswith("/"):
            called.add(urlsplit(request.raw_path).netloc)
        if not called <= self.hosts:
            raise Refused(421, "this is not the server of that name; use the address printed")
        return given[0]

    def _check_site(self, request: web.Request) -> None:
        if request.headers.get("Sec-Fetch-Site", "none") in _OWN_SITE:
            return
        mode, goal = (request.headers.get(f"Sec-Fetch-{name}") for name in ("Mode", "Dest"))
        if not ((mode, goal) == ("navigate", "document") and self.has_token(request)):
            raise Refused(403, "another site may not use this page; open its address by yourself")

    def headers(self, host: str | None) -> dict[str, str]:
        """Return the headers that every answer carries, for a Host that was checked."""
        sockets = f" ws://{host} wss://{host}" if host else ""
        rules = {
            "default-src": "'self'",
            "script-src": " ".join(["'self' 'unsafe-eval'", *self.scripts]),
            "style-src": "'self' 'unsafe-inline'",
            "img-src": "'self' data: blob:",
            "connect-src": f"'self'{sockets} data: blob:",
            "font-src": "'self' data:",
            "worker-src": "'self' blob:",
            "object-src": "'none'",
            "frame-ancestors": "'none'",
            "base-uri": "'self'",
            "form-action": "'self'",
        }
        return {
            "Content-Security-Policy": "; ".join(f"{name} {rule}" for name, rule in rules.items()),
            "X-Content-Type-Options": "nosniff",
            "X-Frame-Options": "DENY",
            "Referrer-Policy": "no-referrer",
            "Cross-Origin-Opener-Policy": "same-origin",
            "Cross-Origin-Resource-Policy": "same-origin",
            "Server": "isovary",
        }


_CLOSED = """isovary: this page is locked.

Open it with the address printed in the terminal where isovary runs; it ends in ?token=..."""


def _same(given: str, right: str) -> bool:
    """Compare in a time that tells nothing."""
    return hmac.compare_digest(given.encode("utf-8", "replace"), right.encode())


def _asks_with_token(request: web.Request) -> bool:
    return request.path == "/" and "token" in request.query


def is_websocket(request: web.Request) -> bool:
    """Say whether a request wants a websocket."""
    return "Upgrade" in request.headers or request.path.endswith("/ws")


def _check_size(request: web.Request) -> None:
    if len(request.raw_path) > LONGEST_TARGET:
        raise Refused(414, "the address is too long")
    if sum(len(name) + len(value) for name, value in request.raw_headers) > LONGEST_HEADERS:
        raise Refused(431, "the headers are too long")


def _check_origin(request: web.Request, host: str) -> None:
    given = request.headers.getall("Origin", [])
    needed = is_websocket(request) or request.method not in ("GET", "HEAD")
    own = (f"http://{host}", f"https://{host}")
    if len(given) > 1 or (given and given[0] not in own) or (needed and not given):
        raise Refused(403, "the request does not come from this page")


def _check_method(request: web.Request) -> None:
    allowed = ("POST",) if _UPLOAD.fullmatch(request.rel_url.raw_path) else ("GET", "HEAD")
    if request.method not in allowed:
        raise Refused(405, f"expected {' or '.join(allowed)}", Allow=", ".join(allowed))


def page(title: str, text: str, link: str = "", status: int = 200) -> web.Response:
    """Return a page of one paragraph, with a link to the start, or to what ``link`` names.

    Examples
    --------
    >>> "<b>" in page("a <b> title", "text").text
    False
    """
    title, text, link = (html.escape(part) for part in (title, text, link))
    way = f'<p><a href="{link}">Start anew</a></p>' if link else ""
    body = (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width"><meta name="color-scheme" '
        f'content="light dark"><title>{title}</title></head><body style="font: 1rem/1.5 '
        f'sans-serif; margin: 15vh auto; max-width: 34rem; padding: 0 1rem"><h1>{title}</h1>'
        f"<p>{text}</p>{way}</body></html>"
    )
    return web.Response(status=status, text=body, content_type="text/html")


def forwarding_page(target: str) -> web.Response:
    """Return a page that goes on to an address of ours by itself.

    A browser that came from another site sends no ``SameSite=Strict`` cookie along a redirect,
    but does when a page of ours leads on.
    """
    goal = html.escape(target)
    body = (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        f'<meta http-equiv="refresh" content="0; url={goal}"><title>isovary</title></head>'
        f'<body><p><a href="{goal}">Go on</a></p></body></html>'
    )
    return web.Response(text=body, content_type="text/html")


_Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


def install(app: web.Application, locks: Locks) -> None:
    """Put the checks before, and the headers on, everything that an application answers."""

    @web.middleware
    async def locked(request: web.Request, handler: _Handler) -> web.StreamResponse:
        try:
            locks.check(request)
            return await handler(request)
        except Refused as refused:
            return refused.answer()
        except web.HTTPException as error:
            return Refused(error.status, error.reason.lower()).answer()
        except web.RequestPayloadError:
            return Refused(400, "the body of the request is broken").answer()
        except ConnectionError:
            raise
        except Exception:
            _log.exception("a request failed: %s %r", request.method, request.path)
            return Refused(500, _FAULT).answer()

    async def seal(request: web.Request, response: web.StreamResponse) -> None:
        host = request.headers.get("Host")
        response.headers.update(locks.headers(host if host in locks.hosts else None))
        response.headers.setdefault("Cache-Control", "no-store")

    app.middlewares.append(locked)
    app.on_response_prepare.append(seal)


def protocol(locks: Locks) -> type[web.RequestHandler]:
    """Return aiohttp's reader of requests, but with plain answers to what it cannot read."""

    class Reader(web.RequestHandler):
        __slots__ = ()

        def handle_error(
            self,
            request: web.BaseRequest,
            status: int = 500,
            exc: BaseException | None = None,
            message: str | None = None,
        ) -> web.StreamResponse:
            if request.writer.output_size > 0:
                raise ConnectionError("the answer has begun already")
            if status == 500:
                _log.error("a request failed", exc_info=exc)
            status, text = _unreadable(status, exc)
            answer = Refused(status, text).answer()
            answer.headers.update({**locks.headers(None), "Cache-Control": "no-store"})
            answer.force_close()
            return answer

    return Reader


def _unreadable(status: int, fault: BaseException | None) -> tuple[int, str]:
    """Status and text for a request that could not be read."""
    if status == 500:
        return 500, _FAULT
    if type(fault).__name__ == "LineTooLong":
        return 431, "the address or a header is too long"
    return (431, "too many headers") if "Too many headers" in str(fault) else (400, "bad request")
