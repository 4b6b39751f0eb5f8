"""The page in a real browser: a server of its own, tabs, waits, and pictures of the views."""

from __future__ import annotations

import io
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from urllib.parse import urlsplit

import numpy as np
import pytest

BROWSER = shutil.which("chromium") or shutil.which("chromium-browser")
SWITCHES = [
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
]
PATIENCE = 120.0  # seconds, on a machine that is busy
VIEWS = ("base", "perturbed", "change", "groups")

needs_browser = pytest.mark.skipif(BROWSER is None, reason="needs Chromium (apt install chromium)")

_OWN_WORDS = """
const Real = window.WebSocket;
window.sockets = [];
window.WebSocket = class extends Real {
  constructor(...given) { super(...given); window.sockets.push(this); }
};
"""
_CAMERAS = """() => Object.fromEntries(Object.entries(window.trame.refs)
  .filter(([name, view]) => name.startsWith("view_") && view && view.getCamera
    && document.getElementById(name).offsetParent)
  .map(([name, view]) => [name.slice(5), view.getCamera()]))"""
_BARE = ".iso-caption, .iso-hover { visibility: hidden !important }"


@contextmanager
def serving(folder, result=None):
    """Run ``isovary view`` in a folder, and give its address."""
    given = [] if result is None else [str(result)]
    command = [sys.executable, "-m", "isovary", "view", *given, "--port", "0", "--no-browser"]
    with subprocess.Popen(
        command,
        cwd=folder,
        env=os.environ | {"OMP_NUM_THREADS": "1", "PYTHONUNBUFFERED": "1"},
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            yield re.search(r"http\S+", process.stdout.readline())[0]
        finally:
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=PATIENCE)


class World:
    """A server and a browser, and what all tabs said and asked for."""

    def __init__(self, browser, address):
        self.browser, self.address = browser, address
        parts = urlsplit(address)
        self.origin = f"{parts.scheme}://{parts.netloc}"
        self.complaints, self.requests, self.answers = [], [], []

    def context(self, width=1100, height=700, **options):
        """A browser of somebody else: cookies and window of its own."""
        size = {"width": width, "height": height}
        context = self.browser.new_context(viewport=size, color_scheme="light", **options)
        context.add_init_script(_OWN_WORDS)
        context.set_default_timeout(1000 * PATIENCE)
        return context

    def tab(self, context, address=None, ready="[role=tab]"):
        """Open the page, and wait until something is there."""
        page = context.new_page()
        page.on("console", self._said)
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.on("request", lambda request: self.requests.append(request.url))
        page.on("websocket", lambda opened: self.requests.append(opened.url))
        page.on("response", lambda answer: self.answers.append(answer))
        page.goto(address or self.address)
        page.wait_for_selector(ready)
        return page

    def _said(self, message):
        place = urlsplit(message.location["url"]).path
        trame_asks = " 405 " in message.text and re.fullmatch(r"/s/[^/]+/?(paraview/?)?", place)
        refused = " 4" in message.text and "/upload/" in place  # shown by the page itself
        too_early = "without a current renderer" in message.text  # vtk.js, before its first scene
        if message.type == "error" and not (trame_asks or refused or too_early):
            self.complaints.append(f"{message.text} ({place})")


@contextmanager
def browsing(folder, result=None):
    """A world, for the tests of a file."""
    sync_playwright = pytest.importorskip("playwright.sync_api").sync_playwright
    with serving(folder, result) as address, sync_playwright() as play:
        browser = play.chromium.launch(executable_path=BROWSER, args=SWITCHES)
        yield World(browser, address)
        browser.close()


def check_manners(world):
    """Nobody complained, nobody but the server was asked, and its policy names nobody else."""
    assert not world.complaints, world.complaints
    own = {world.origin.replace("http", scheme) for scheme in ("http", "ws", "wss")}
    asked = {f"{u.scheme}://{u.netloc}" for u in map(urlsplit, world.requests) if u.netloc}
    assert world.origin in asked
    assert asked <= own
    pages = [a for a in world.answers if a.headers.get("content-type", "").startswith("text/html")]
    policies = {a.headers.get("content-security-policy") for a in pages if a.ok}
    assert policies
    for policy in policies:
        rules = dict(rule.split(maxsplit=1) for rule in policy.split(";") if rule.strip())
        assert rules["default-src"] in ("'none'", "'self'")
        hosts = set(re.findall(r"(?:\w+:)?//[^\s;]+|\*", policy))
        assert hosts <= own, policy
        assert "'unsafe-inline'" not in rules["script-src"]


def until(page, expression, argument=None, seconds=PATIENCE):
    """Wait until an expression of the page is true."""
    page.wait_for_function(expression, arg=argument, timeout=1000 * seconds)


def state(page, *names):
    """Variables of the page: one, or several as a list."""
    found = page.evaluate("names => names.map(name => window.trame.state.get(name))", list(names))
    return found[0] if len(names) == 1 else found


def until_state(page, **wanted):
    """Wait until variables of the page have values."""
    told = {name: json.dumps(value) for name, value in wanted.items()}
    until(
        page,
        "wanted => window.trame && Object.entries(wanted).every(([name, value]) =>"
        " JSON.stringify(window.trame.state.get(name)) === value)",
        {name: value.replace(", ", ",").replace(": ", ":") for name, value in told.items()},
    )


def where(page):
    """The address as it stands now: Playwright's own is told of it later."""
    return page.evaluate("location.href")


def slider(page, name):
    """The handle of a slider, by the words that a screen reader says."""
    return page.get_by_role("slider", name=name)


def cameras(page):
    """Position, focal point and view up of each view that is shown, by its name."""
    kept = ("position", "focalPoint", "viewUp")
    found = page.evaluate(_CAMERAS)
    return {view: np.array([camera[key] for key in kept]) for view, camera in found.items()}


def view_box(page, view):
    return page.locator(f"#view_{view}").bounding_box()


def pixels(page, view):
    """The picture of a view without words (height, width, 3), whole numbers up to 255."""
    from PIL import Image

    shot = page.locator(f"#view_{view}").screenshot(style=_BARE)
    return np.asarray(Image.open(io.BytesIO(shot)).convert("RGB")).astype(int)


def settled(page, view):
    """The picture of a view once it stands still and shows something."""
    end, before = time.monotonic() + PATIENCE, pixels(page, view)
    while time.monotonic() < end:
        page.wait_for_timeout(150)
        now = pixels(page, view)
        if now.shape == before.shape and (now == before).all() and now.std() > 1:
            return now
        before = now
    raise AssertionError(f"{view}: expected a picture that stands still, got one that moves")


def difference(one, other):
    """The part of the pixels that clearly differ."""
    if one.shape != other.shape:
        return 1.0
    return float((np.abs(one - other).max(axis=2) > 12).mean())


def until_picture(page, view, true):
    """Wait until a picture of a view is as it should be, and return it."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        now = settled(page, view)
        if true(now):
            return now
    raise AssertionError(f"{view}: the picture never was as expected")


def until_changed(page, view, before, least=0.002):
    """Wait until a view has another picture, and return it."""
    return until_picture(page, view, lambda now: difference(now, before) > least)


def saturation(picture):
    """How colourful each pixel is, 0 to 255."""
    return picture.max(axis=2) - picture.min(axis=2)


def drag(page, view, across, down):
    """Turn a view by its middle."""
    box = view_box(page, view)
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + across, y + down, steps=6)
    page.mouse.up()


def click_at(page, view, across=0.5, down=0.5):
    """Click at a place of a view, given as shares of its width and height."""
    box = view_box(page, view)
    page.mouse.click(box["x"] + across * box["width"], box["y"] + down * box["height"])


def saved(page, click, path):
    """The bytes of what a click downloads, left at a path."""
    with page.expect_download() as told:
        click()
    told.value.save_as(path)
    return path.read_bytes()


def table(page, selector):
    """The texts of a table's body, row by row."""
    return page.eval_on_selector_all(
        f"{selector} tbody tr",
        "rows => rows.map(row => [...row.cells].map(cell => cell.textContent.trim()))",
    )


def until_table(page, selector, rows):
    """Wait until a table's body has these texts."""
    until(
        page,
        "([selector, rows]) =>"
        " JSON.stringify([...document.querySelectorAll(selector + ' tbody tr')]"
        ".map(row => [...row.cells].map(cell => cell.textContent.trim()))) === rows",
        [selector, json.dumps(rows, separators=(",", ":"), ensure_ascii=False)],
    )
