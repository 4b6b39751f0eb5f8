"""The checks of a request, one by one and without a server."""

from __future__ import annotations

import base64
import hashlib

import pytest
from aiohttp.test_utils import make_mocked_request

from isovary.app._locks import (
    Locks,
    Refused,
    hosts_of,
    is_loopback,
    new_token,
    page,
    script_hashes,
)
from isovary.app._receiving import shown_name
from isovary.app._static import StaticFiles, files_of, page_folders

TOKEN = "t" * 43
LOCKS = Locks(TOKEN, 8080, hosts_of("127.0.0.1", 8080))


def status(target="/s/a/", method="GET", **headers):
    """Status with which a request is refused, or None."""
    sent = {"Host": "127.0.0.1:8080", "Cookie": f"{LOCKS.cookie}={LOCKS.key}"}
    sent |= {name.replace("_", "-"): value for name, value in headers.items()}
    sent = {name: value for name, value in sent.items() if value is not None}
    try:
        LOCKS.check(make_mocked_request(method, target, headers=sent))
    except Refused as refused:
        return refused.status
    return None


@pytest.mark.parametrize(
    ("host", "port", "further", "names"),
    [
        ("127.0.0.1", 1, (), {"127.0.0.1:1", "localhost:1"}),
        ("localhost", 1, (), {"127.0.0.1:1", "localhost:1"}),
        ("::1", 1, (), {"[::1]:1", "localhost:1"}),
        ("127.0.0.1", 80, (), {"127.0.0.1:80", "localhost:80", "127.0.0.1", "localhost"}),
        ("0.0.0.0", 1, (), {"127.0.0.1:1", "localhost:1"}),
        ("192.0.2.7", 1, (), {"192.0.2.7:1"}),
        ("2001:db8::7", 1, (), {"[2001:db8::7]:1"}),
        ("192.0.2.7", 1, ("a:9",), {"192.0.2.7:1", "a:9"}),
        ("192.0.2.7", 1, ("a",), {"192.0.2.7:1", "a", "a:1"}),
        ("192.0.2.7", 1, ("[2001:db8::7]",), {"192.0.2.7:1", "[2001:db8::7]", "[2001:db8::7]:1"}),
    ],
)
def test_the_names_of_the_gateway(host, port, further, names):
    """Oracle: theory. RFC 9110, 7.2: Host is the name and the port, the default one left out."""
    assert hosts_of(host, port, further) == names


def test_only_this_computer_is_loopback():
    """Oracle: theory. RFC 6890: 127.0.0.1 and ::1 lead nowhere else."""
    assert all(map(is_loopback, ["127.0.0.1", "::1", "localhost"]))
    assert not any(map(is_loopback, ["0.0.0.0", "::", "192.0.2.7", "127.0.0.1.example", ""]))


def test_the_right_request_passes():
    """Oracle: algebra. By each name, with its own Origin, as browsers send it."""
    assert status() is None
    assert status(method="HEAD") is None
    for host in ("127.0.0.1:8080", "localhost:8080"):
        for origin in (None, f"http://{host}", f"https://{host}"):
            assert status(Host=host, Origin=origin) is None
    for site in ("same-origin", "none", None):
        assert status(Sec_Fetch_Site=site) is None
    upload = {"target": "/s/a/upload/base", "method": "POST"}
    assert status(**upload, Origin="http://127.0.0.1:8080") is None
    assert status(f"/?token={TOKEN}", Cookie=None) is None
    assert status("http://localhost:8080/", Host="localhost:8080") is None


def test_a_link_with_the_token_may_come_from_anywhere():
    """Oracle: theory. Fetch metadata: a page that is opened is mode navigate, dest document."""
    link = {"Sec_Fetch_Site": "cross-site", "Sec_Fetch_Mode": "navigate"}
    target = f"/?token={TOKEN}"
    assert status(target, **link, Sec_Fetch_Dest="document", Cookie=None) is None
    assert status(target, **link, Sec_Fetch_Dest="iframe") == 403
    assert status(target, **link) == 403
    assert status("/", **link, Sec_Fetch_Dest="document") == 403
    assert status(f"/s/a/?token={TOKEN}", **link, Sec_Fetch_Dest="document") == 403


def test_the_first_check_that_fails_answers():
    """Oracle: algebra. Host before Origin before site before method before key."""
    wrong = {"Sec_Fetch_Site": "cross-site", "Origin": "null", "Host": "x", "Cookie": None}
    assert status(method="PUT", **wrong) == 421
    del wrong["Host"]
    assert status(method="PUT", **wrong) == 403
    own = "http://127.0.0.1:8080"
    assert status(method="PUT", Cookie=None, Origin=own) == 405
    assert status(Cookie=None) == 401


def test_the_key_differs_for_each_token_and_is_not_the_token():
    """Oracle: peer. HMAC written out: hash(outer key, hash(inner key, words)), RFC 2104."""
    key = TOKEN.encode().ljust(64, b"\0")
    inner = hashlib.sha256(bytes(byte ^ 0x36 for byte in key) + b"isovary cookie").digest()
    assert LOCKS.key == hashlib.sha256(bytes(byte ^ 0x5C for byte in key) + inner).hexdigest()
    other = Locks("u" * 43, 8080, LOCKS.hosts)
    assert status(Cookie=f"{LOCKS.cookie}={other.key}") == 401


def test_a_token_has_256_bits():
    """Oracle: theory. 43 letters of base64 hold 32 bytes and no fewer."""
    tokens = {new_token() for _ in range(100)}
    assert len(tokens) == 100
    assert {len(base64.urlsafe_b64decode(token + "=")) for token in tokens} == {32}


def test_the_policy_names_what_the_page_needs():
    """Oracle: theory. CSP 3: eval for Vue, its one script by hash, nothing of other hosts."""
    locks = Locks(TOKEN, 8080, LOCKS.hosts, script_hashes("<script>go()</script>"))
    policy = locks.headers("localhost:8080")["Content-Security-Policy"]
    rules = dict(rule.split(" ", 1) for rule in policy.split("; "))
    digest = base64.b64encode(hashlib.sha256(b"go()").digest()).decode()
    assert rules["script-src"] == f"'self' 'unsafe-eval' 'sha256-{digest}'"
    assert rules["connect-src"].split()[:3] == [
        "'self'",
        "ws://localhost:8080",
        "wss://localhost:8080",
    ]
    assert rules["object-src"] == rules["frame-ancestors"] == "'none'"
    assert rules["default-src"] == rules["base-uri"] == rules["form-action"] == "'self'"
    named = {word for rule in rules.values() for word in rule.split() if "//" in word}
    assert named == {"ws://localhost:8080", "wss://localhost:8080"}
    assert "*" not in policy


def test_a_page_shows_text_as_text():
    """Oracle: algebra. Markup in each part comes out escaped."""
    text = page("<i>", "<b>&", link='"><script>').text
    assert "<i>" not in text
    assert "<b>" not in text
    assert "<script>" not in text
    assert "&lt;b&gt;&amp;" in text


@pytest.mark.parametrize(
    ("given", "shown"),
    [
        ("a.vti", "a.vti"),
        ("/etc/passwd", "passwd"),
        ("..\\..\\a.vti", "a.vti"),
        ("a\r\nSet-Cookie: x.vti", "aSet-Cookie: x.vti"),
        ("a\u202eitv.exe", "aitv.exe"),
        ("\0", ""),
        ("/", ""),
        ("é ü.vti", "é ü.vti"),
        ("x" * 300 + ".vti", "x" * 196 + ".vti"),
    ],
)
def test_the_name_of_a_file_is_fit_to_be_shown(given, shown):
    """Oracle: algebra. The last part, without control and direction characters, 200 at most."""
    assert shown_name(given) == shown


def test_the_table_of_files_has_no_links_and_no_hidden_files(tmp_path):
    """Oracle: algebra. Of what lies there, only the plain files are in the table."""
    served, outside = tmp_path / "served", tmp_path / "outside"
    for folder in (served / "deep", served / ".git", outside):
        folder.mkdir(parents=True)
    for path in (served / "a.js", served / "deep" / "b.js", served / ".env", outside / "c.js"):
        path.write_text("1")
    (served / ".git" / "config").write_text("1")
    (served / "link.js").symlink_to(outside / "c.js")
    (served / "linked").symlink_to(outside)
    assert files_of({"": served, "x": served / "deep"}) == {
        "a.js": served / "a.js",
        "deep/b.js": served / "deep" / "b.js",
        "x/b.js": served / "deep" / "b.js",
    }


def test_the_page_needs_nothing_from_other_hosts():
    """Oracle: data. No style or page of the served files loads from elsewhere."""
    files = files_of(page_folders())
    assert {"index.html", "loading.tpl"} <= set(files)
    assert any(address.endswith("trame-vtk.js") for address in files)
    assert any(address.endswith("vuetify3.css") for address in files)
    for address, path in files.items():
        if address.endswith((".css", ".html", ".tpl")):
            text = path.read_text("utf-8")
            for start in ('src="http', 'href="http', "url(http", "url('http", 'url("http', '="//'):
                assert start not in text, (address, start)
    assert len(script_hashes(StaticFiles(page_folders()).index)) == 1
