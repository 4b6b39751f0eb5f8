"""How fast is the page in the browser, and how many can use it at once?

The page of ``isovary view`` runs in a process of its own, on 127.0.0.1. A client in this process
does as a browser does: it opens the address with its secret, keeps the cookie, connects the
websocket, and fetches every array that a view names and that it does not hold. A slider has
answered when the view it changes has come and its new arrays are here. Chromium is started for
the first paint and for changed pixels. The result is the shipped pair of fields at 10 000 nodes.
"""

from __future__ import annotations

import argparse
import asyncio
import hashlib
import os
import re
import secrets
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any

import aiohttp
import msgpack
import numpy as np
import psutil
from measured_page import write_page

from isovary.data import water_pair
from isovary.geometry import Floats

PAGE = Path(__file__).parents[1] / "docs" / "page-speed.md"
VERTICES = 2500
SESSIONS, SECONDS, PAUSE, LINGER = 20, 120.0, 2.0, 3.0
MOVES = 30
SAMPLES = 64, 256
COUNTS = range(2, 13)
VIEWS_OF = {
    "count": {"groups"},
    "factor": {"change"},
    "column": {"base", "perturbed"},
}
WORDS = {"count": "number of groups", "factor": "threshold", "column": "scale"}
SWITCHES = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader"]
SWITCHES += ["--enable-unsafe-swiftshader", "--no-first-run", "--disable-background-networking"]
_ARRIVE = re.compile(r"trigger\(\W*(\w+)\W*\[window\.isovary\.arrival\(\)\]")
_HEAD = 12  # bytes before each message: its number, where the part begins, its length


# A client that does as a browser ------------------------------------------------------


@dataclass
class Move:
    """What one change of a slider cost."""

    seconds: float
    messages: int
    received: int


@dataclass(eq=False)
class Client:
    """One page: what it holds, and what it waits for."""

    http: aiohttp.ClientSession
    socket: Any = None
    sid: str = ""
    state: dict[str, Any] = field(default_factory=dict)
    arrays: dict[str, bytes] = field(default_factory=dict)
    shown: dict[str, dict[str, str]] = field(default_factory=dict)
    news: asyncio.Event = field(default_factory=asyncio.Event)
    pushed: dict[str, int] = field(default_factory=dict)
    refused: list[str] = field(default_factory=list)
    messages: int = 0
    received: int = 0

    async def open(self, address: str) -> None:
        """Open the address, connect, and take the state and the views' arrays."""
        async with self.http.get(address) as answer:
            assert answer.status == 200, await answer.text()
            page = str(answer.url)
        origin = address.split("/?")[0]
        self.sid = page.split("/s/")[1].split("/")[0]
        self.socket = await self.http.ws_connect(
            f"{origin}/s/{self.sid}/ws", origin=origin, max_msg_size=0, compress=0
        )
        self._names: dict[str, str] = {}
        self._answers: dict[str, asyncio.Future[Any]] = {}
        self._reader = asyncio.ensure_future(self._read())
        self._tasks: set[asyncio.Task[None]] = set()
        await self.call("wslink.hello", {"secret": "wslink-secret"}, head="system:c0")
        self._merge((await self.call("trame.state.get"))["state"])
        found = _ARRIVE.search(str(self.state))
        assert found is not None
        arrival = {"link": "", "dark": False, "narrow": False}
        await self.call("trame.trigger", found[1], [arrival], {})

    async def call(self, method: str, *args: Any, head: str = "rpc:c0") -> Any:
        """Call a method over there, and wait for its answer."""
        number = f"{head}:{len(self._answers)}"
        words = {"wslink": "1.0", "id": number, "method": method, "args": list(args), "kwargs": {}}
        body = msgpack.packb(words)
        self._answers[number] = asyncio.get_running_loop().create_future()
        head_bytes = secrets.token_bytes(4) + (0).to_bytes(4, "little")
        await self.socket.send_bytes(head_bytes + len(body).to_bytes(4, "little") + body)
        return await asyncio.wait_for(self._answers[number], 60.0)

    async def set(self, **values: Any) -> None:
        """Move sliders."""
        self.state |= values  # what a page sets itself does not come back to it
        changes = [{"key": key, "value": value} for key, value in values.items()]
        await self.call("trame.state.update", changes)

    async def press(self, button: str) -> None:
        """Press a button, by its id in the page."""
        found = re.search(rf"id=\"{button}\"[^>]*trigger\(\W*(\w+)", str(self.state))
        assert found is not None, button
        await self.call("trame.trigger", found[1], [], {})

    async def until(self, done: Callable[[], bool], seconds: float = 120.0) -> None:
        """Wait until something is so."""
        async with asyncio.timeout(seconds):
            while not done():
                self.news.clear()
                await self.news.wait()

    async def move(self, views: set[str], **values: Any) -> Move:
        """Move a slider, and wait for the views that it changes with their arrays."""
        self.pushed.clear()
        messages, received = self.messages, self.received
        begin = time.perf_counter()
        asked = asyncio.ensure_future(self.set(**values))
        await self.until(lambda: views <= self.pushed.keys() and self.complete(views))
        seconds = time.perf_counter() - begin
        await asked
        return Move(seconds, self.messages - messages, self.received - received)

    def complete(self, views: set[str]) -> bool:
        """Whether all arrays of views are here."""
        return all(self.arrays.get(name) for v in views for name in self.shown.get(v, {}).values())

    async def close(self) -> None:
        """Go."""
        self._reader.cancel()
        await self.socket.close()
        await self.http.close()

    async def _read(self) -> None:
        parts: dict[bytes, bytearray] = {}
        async for message in self.socket:
            data = message.data
            self.messages, self.received = self.messages + 1, self.received + len(data)
            whole = parts.setdefault(data[:4], bytearray())
            whole += data[_HEAD:]
            if len(whole) == int.from_bytes(data[8:12], "little"):
                self._take(msgpack.unpackb(bytes(parts.pop(data[:4]))))

    def _take(self, told: dict[str, Any]) -> None:
        kind, _, rest = told["id"].partition(":")
        if kind == "publish" and rest.startswith("trame.state.topic"):
            self._merge(told["result"])
        elif kind == "publish" and rest.startswith("trame.vtk.delta"):
            self._scene(told["result"])
        elif "error" in told:
            self._answers[told["id"]].set_exception(RuntimeError(str(told["error"])))
        elif told["id"] in self._answers:
            self._answers[told["id"]].set_result(told.get("result"))
        self.news.set()

    def _merge(self, state: dict[str, Any]) -> None:
        self.state |= state
        for name in state:
            if name.startswith("scene_view_") and state[name]:
                self._names[state[name]["id"]] = name.removeprefix("scene_view_")
                self._scene(state[name], new=False)

    def _scene(self, scene: dict[str, Any], new: bool = True) -> None:
        name = self._names[scene["id"]]
        if new:
            self.pushed[name] = self.pushed.get(name, 0) + 1
        self.shown[name] = dict(hashes(scene))
        for digest in self.shown[name].values():
            if digest not in self.arrays:
                self.arrays[digest] = b""
                task = asyncio.ensure_future(self._fetch(digest))
                self._tasks.add(task)
                task.add_done_callback(self._tasks.discard)

    async def _fetch(self, digest: str) -> None:
        try:
            content = await self.call("viewport.geometry.array.get", digest, True)
        except RuntimeError as error:  # a view that was replaced meanwhile
            self.refused.append(f"{digest}: {error}")
            del self.arrays[digest]
            return
        assert digest.startswith(hashlib.md5(content).hexdigest()), "another array came"
        self.arrays[digest] = content
        self.news.set()


def hashes(scene: Any) -> Iterator[tuple[str, str]]:
    """Names and hashes of the arrays that a scene needs."""
    if isinstance(scene, dict):
        if "hash" in scene:
            yield f"{scene['name']}", scene["hash"]
        for value in scene.values():
            yield from hashes(value)
    elif isinstance(scene, list):
        for value in scene:
            yield from hashes(value)


async def arrive(address: str) -> Client:
    """A new page with its result."""
    jar = aiohttp.CookieJar(unsafe=True)  # else no cookie of an address without a name
    client = Client(aiohttp.ClientSession(cookie_jar=jar))
    await client.open(address)
    return client


async def arrive_ready(address: str) -> Client:
    """A new page whose result is shown, all groups found."""
    client = await arrive(address)
    await client.until(lambda: bool(client.state.get("has_result")))
    await client.until(lambda: client.complete(set(client.shown)))
    for count in COUNTS:
        await client.set(count=count)
        await client.until(lambda: not client.state["count_words"])
    return client


# The server ---------------------------------------------------------------------------


@contextmanager
def serving(result: Path | None, log: Path) -> Iterator[tuple[psutil.Process, str]]:
    """A server of this script, with a short linger; its process and its address."""
    words = [sys.executable, __file__, "--serve", str(result or "")]
    with started(words, log) as (process, address):
        yield process, address


@contextmanager
def started(words: Sequence[str], log: Path) -> Iterator[tuple[psutil.Process, str]]:
    """Run a server until the end of the block; its process and the address it prints."""
    with log.open("w") as out:
        server = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=out, text=True)
    try:
        assert server.stdout is not None
        line = server.stdout.readline()
        yield psutil.Process(server.pid), line.split()[1]
    finally:
        server.terminate()
        server.wait(30)


def serve(result: str) -> None:
    """Be the server."""
    from isovary.app._gateway import run
    from isovary.app._settings import GatewaySettings

    settings = GatewaySettings(
        token=secrets.token_urlsafe(32),
        linger=LINGER,
        result=Path(result).resolve() if result else None,
    )
    run(settings, False, lambda line: print(line, flush=True))


def tree(process: psutil.Process) -> list[psutil.Process]:
    """A process and all below it."""
    return [process, *process.children(recursive=True)]


def memory(process: psutil.Process) -> float:
    """Memory of a process tree in MB, without the files it maps, which others may share."""
    total = 0
    for one in tree(process):
        with _gone_is_well():
            told = one.memory_info()
            total += told.rss - told.shared
    return total / 1e6


def cpu(process: psutil.Process) -> float:
    """Seconds of CPU of the processes of a tree that live."""
    total = 0.0
    for one in tree(process):
        with _gone_is_well():
            total += sum(one.cpu_times()[:2])
    return total


@contextmanager
def _gone_is_well() -> Iterator[None]:
    with suppress(psutil.NoSuchProcess):
        yield


# What is measured ---------------------------------------------------------------------


@dataclass
class Row:
    """One line of the table."""

    what: str
    wanted: str
    measured: str
    load: float = field(default_factory=lambda: os.getloadavg()[0])

    def line(self) -> str:
        """The line."""
        return f"| {self.what} | {self.wanted} | {self.measured} | {self.load:.1f} |\n"


def summary(seconds: Sequence[float]) -> str:
    """Median, 95th percentile and most, in ms."""
    middle, high = np.percentile(seconds, [50, 95])
    return f"{1e3 * middle:.0f} / {1e3 * high:.0f} / {1e3 * max(seconds):.0f} ms"


def values(slider: str, random: Random, client: Client) -> Any:
    """A value of a slider other than the one it has."""
    choices: Sequence[float] = {
        "count": list(COUNTS),
        "factor": [k / 2 for k in range(21)],
        "column": range(int(client.state["column_last"]) + 1),
    }[slider]
    return random.choice([x for x in choices if x != client.state[slider]])


async def sliders(address: str) -> list[Row]:
    """Time each slider alone."""
    client, random, rows = await arrive_ready(address), Random(0), []
    await asyncio.sleep(8.0)  # until the process ahead of the next session stands
    for slider, views in VIEWS_OF.items():
        moves = []
        for _ in range(MOVES):
            value = values(slider, random, client)
            moves.append(await client.move(views, **{slider: value}))
            await asyncio.sleep(0.1)
        taken, bytes_each = (
            [getattr(move, name) for move in moves] for name in ("seconds", "received")
        )
        told = f"{summary(taken)}; {statistics.median(bytes_each) / 1e3:.0f} kB"
        rows.append(Row(f"{WORDS[slider]}, 10 000 nodes", "200 ms", told))
    await client.close()
    return rows


def blobs(samples: int) -> Floats:
    """Three soft balls in a box, sampled."""
    x, y, z = np.meshgrid(*3 * [np.linspace(-1, 1, samples, dtype=np.float32)], indexing="ij")
    centers = (-0.3, 0.0, 0.0), (0.3, 0.2, 0.0), (0.1, -0.3, 0.2)
    values: Floats = sum(
        np.exp(-((x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2) / 0.15) for a, b, c in centers
    )
    return values


async def previews(address: str, folder: Path) -> list[Row]:
    """Time the isovalue's slider with two fields of each size."""
    rows = []
    for samples, wanted in zip(SAMPLES, ("300 ms", "1000 ms"), strict=True):
        np.save(folder / "field.npy", blobs(samples))
        client = await arrive(address)
        await client.until(lambda c=client: c.state.get("part") == "compare")
        for role in ("base", "perturbed"):
            await upload(client, address, role, folder / "field.npy")
            told = f"{role}_facts"
            await client.until(lambda c=client, t=told: c.state[t] not in ("", "reading…"))
        await asyncio.sleep(8.0)
        moves = [
            await client.move({"base", "perturbed"}, isovalue=f"{value:.4f}")
            for value in np.linspace(0.4, 0.9, 15)
        ]
        kilobytes = statistics.median(move.received for move in moves) / 1e3
        told = f"{summary([move.seconds for move in moves])}; {kilobytes:.0f} kB"
        rows.append(Row(f"isovalue, two fields of {samples}^3", wanted, told))
        await client.close()
    return rows


async def cancels(address: str) -> list[Row]:
    """Time the end of a comparison that would take a minute, each time at another stage."""
    client, taken, stages = await arrive(address), [], []
    await client.until(lambda: client.state.get("part") == "compare")
    await client.press("demo")
    await client.until(lambda: bool(client.state["ready_to_run"]))
    await client.set(wanted_vertices="6000")
    for pause in np.linspace(0.0, 12.0, 9):
        await client.press("run")
        await client.until(lambda: client.state["stage"] not in ("", *_BEFORE))
        await asyncio.sleep(pause)
        stages.append(client.state["stage"])
        begin = time.perf_counter()
        await client.press("cancel")
        await client.until(lambda: client.state["stage_words"] == "cancelled")
        taken.append(time.perf_counter() - begin)
    await client.close()
    seen = f"from Cancel to the word, in {', '.join(dict.fromkeys(stages))}"
    return [Row(seen, "2000 ms", summary(taken))]


_BEFORE = "starting", "waiting", "stopping"  # the run itself tells no stage yet


async def upload(client: Client, address: str, role: str, path: Path) -> None:
    """Send a field's file."""
    origin = address.split("/?")[0]
    with path.open("rb") as file:
        async with client.http.post(
            f"{origin}/s/{client.sid}/upload/{role}?name={path.name}",
            data=file,
            headers={"Origin": origin, "Content-Type": "application/octet-stream"},
        ) as answer:
            assert answer.status == 200, await answer.text()


@dataclass
class User:
    """One of many, with values of its own."""

    client: Client
    random: Random
    moves: dict[str, list[float]] = field(default_factory=dict)
    seen: dict[tuple[Any, ...], str] = field(default_factory=dict)

    async def use(self, until: float) -> None:
        """Move a slider every two seconds; each answer must be of what was asked here."""
        await asyncio.sleep(PAUSE * self.random.random())
        clock, number = asyncio.get_running_loop().time, 0
        while clock() < until:
            begin = clock()
            slider = list(VIEWS_OF)[number % 3]
            value = values(slider, self.random, self.client)
            move = await self.client.move(VIEWS_OF[slider], **{slider: value})
            self.moves.setdefault(slider, []).append(move.seconds)
            await self._check()
            number += 1
            await asyncio.sleep(max(0.0, PAUSE - (clock() - begin)))

    async def _check(self) -> None:
        """What came must be what this one asked for, not another; the words come last."""
        state, shown = self.client.state, self.client.shown
        own = {"at": state["column"], "groups": state["count"], "noise": state["factor"]}
        await self.client.until(lambda: linked(state["link"], own), 10.0)
        keys = {"groups": ("count",), "change": ("factor",), "base": ("column",)}
        for view, names in keys.items():
            key = (view, *(state[name] for name in names))
            assert self.seen.setdefault(key, shown[view]["colors"]) == shown[view]["colors"], key


def linked(link: str, own: dict[str, float]) -> bool:
    """Whether an address keeps these values."""
    kept = dict(pair.split("=") for pair in link.split("&"))
    return all(float(kept[name]) == value for name, value in own.items())


async def crowd(process: psutil.Process, address: str) -> list[Row]:
    """Time twenty sessions together; one comes first, until all groups are found."""
    first = await arrive_ready(address)
    await first.close()
    await asyncio.sleep(LINGER + 10.0)
    before, count = memory(process), len(tree(process))
    begin = time.perf_counter()
    clients = [await arrive_ready(address) for _ in range(SESSIONS)]
    opened = time.perf_counter() - begin
    await asyncio.sleep(8.0)
    during = memory(process)
    users = [User(client, Random(number)) for number, client in enumerate(clients)]
    assert len({client.sid for client in clients}) == SESSIONS
    theirs, begin = cpu(process), time.perf_counter()
    own = sum(psutil.Process().cpu_times()[:2])
    until = asyncio.get_running_loop().time() + SECONDS
    await asyncio.gather(*(user.use(until) for user in users))
    passed, theirs = time.perf_counter() - begin, cpu(process) - theirs
    own, load = sum(psutil.Process().cpu_times()[:2]) - own, os.getloadavg()[0]
    seen: dict[tuple[Any, ...], str] = {}
    for user in users:
        for key, digest in user.seen.items():
            assert seen.setdefault(key, digest) == digest, key
    for client in clients:
        await client.close()
    await asyncio.sleep(LINGER + 20.0)
    after, left = memory(process), len(tree(process))
    taken = [second for user in users for part in user.moves.values() for second in part]
    name = f"{SESSIONS} sessions, {len(taken)} moves"
    rows = [Row(name, "95 %: 300 ms", summary(taken), load)]
    for slider, words in WORDS.items():
        rows.append(
            Row(
                f"of these {words}",
                "",
                summary([second for user in users for second in user.moves.get(slider, [])]),
                load,
            )
        )
    rows.append(Row("opened one after the other", "", f"{opened / SESSIONS:.1f} s each", load))
    told = f"server {theirs / passed:.2f}, clients {own / passed:.2f} cores"
    rows.append(Row("CPU meanwhile", "", told, load))
    rows.append(Row("answers of another session", "0", "0 (each was checked)", load))
    refused = [words for client in clients for words in client.refused]
    rows.append(Row("arrays named, but gone when asked for", "0", f"{len(refused)}", load))
    told = (
        f"{before:.0f} MB before, {during:.0f} MB, {after:.0f} MB after ({after / before - 1:+.1%})"
    )
    rows.append(Row(f"memory, {count} processes before, {left} after", "within 5 %", told, load))
    return rows


_DRAWN = """() => [...document.querySelectorAll('.iso-view canvas')].length >= 4 &&
  ['base', 'perturbed', 'change', 'groups'].every(name => {
    const view = window.trame && window.trame.refs['view_' + name];
    return view && view.getCamera && window.trame.state.get('has_result')})"""


def painted(result: Path, log: Path) -> list[Row]:
    """Time the first paint and the surface in Chromium: from the start, and once it stands."""
    from playwright.sync_api import sync_playwright

    rows = []
    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path="/usr/bin/chromium", args=SWITCHES)
        begin = time.perf_counter()
        words = [sys.executable, "-m", "isovary", "view", str(result), "--port", "0"]
        with started([*words, "--no-browser"], log) as (_, address):
            printed = time.perf_counter() - begin
            for what in ("from the start of the command", "the page again, server up"):
                begin = begin if "start" in what else time.perf_counter()
                rows += _painted_once(browser, address, begin, what)
                time.sleep(25.0)
        browser.close()
    rows.insert(0, Row("address printed", "", f"{printed:.2f} s"))
    return rows


def _painted_once(browser: Any, address: str, begin: float, what: str) -> list[Row]:
    page = browser.new_context(viewport={"width": 1366, "height": 768}).new_page()
    page.set_default_timeout(120_000)
    opened = time.perf_counter() - begin
    page.goto(address, wait_until="commit")
    page.wait_for_function("performance.getEntriesByName('first-contentful-paint').length")
    origin, paint, clock = page.evaluate(
        "[performance.timeOrigin, performance.getEntriesByName('first-contentful-paint')[0]"
        ".startTime, Date.now()]"
    )
    first = time.perf_counter() - begin - (clock - origin - paint) / 1e3
    page.wait_for_selector("text=Above the noise")
    page.wait_for_function(_DRAWN)
    words = time.perf_counter() - begin
    _wait_for_surface(page)
    surface = time.perf_counter() - begin
    page.context.close()
    load = os.getloadavg()[0]
    told = f"{first:.2f} s; words {words:.2f} s; surface {surface:.2f} s (opened at {opened:.2f} s)"
    return [Row(f"first paint, {what}", "3 s", told, load)]


def _wait_for_surface(page: Any) -> None:
    """Until the middle of the first view is not the background."""
    import io

    from PIL import Image

    box = page.locator("#view_base").bounding_box()
    x, y = box["x"] + box["width"] / 2 - 20, box["y"] + box["height"] / 2 - 20
    for _ in range(100):
        shot = page.screenshot(clip={"x": x, "y": y, "width": 40, "height": 40})
        colors = np.asarray(Image.open(io.BytesIO(shot)).convert("RGB")).reshape(-1, 3)
        if np.ptp(colors.mean(axis=0)) > 8 or colors.std() > 8:
            return
    raise TimeoutError("no surface was drawn")


def table(rows: Sequence[Row]) -> str:
    """All lines."""
    head = "| what | wanted | measured | load |\n| --- | --- | --- | --- |\n"
    return head + "".join(row.line() for row in rows)


def result_of(folder: Path) -> Path:
    """A result with 10 000 nodes."""
    base, perturbed = map(str, water_pair())
    words = [sys.executable, "-m", "isovary", "compare", base, perturbed, "--isovalue", "0.05"]
    words += ["--vertices", str(VERTICES), "--order", "2", "-o", str(folder / "result")]
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
    return folder / "result"


def measure(result: Path, folder: Path, parts: Sequence[str]) -> dict[str, str]:
    """Measure these parts, one after the other; a table for each."""
    log, found = folder / "log", {}
    if "paint" in parts:
        found["paint"] = table(painted(result, log))
    if "sliders" in parts:
        with serving(result, log) as (_, address):
            found["sliders"] = table(asyncio.run(sliders(address)))
    if "preview" in parts:
        with serving(None, log) as (_, address):
            found["preview"] = table(asyncio.run(previews(address, folder)))
    if "cancel" in parts:
        with serving(None, log) as (_, address):
            found["cancel"] = table(asyncio.run(cancels(address)))
    if "crowd" in parts:
        with serving(result, log) as (process, address):
            found["crowd"] = table(asyncio.run(crowd(process, address)))
    return found


PARTS = "paint", "sliders", "preview", "cancel", "crowd"


def main() -> None:
    """Serve, or measure."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--serve", help=argparse.SUPPRESS)
    options.add_argument("--result", type=Path, help="instead of a new one")
    options.add_argument("--parts", nargs="+", choices=PARTS, default=PARTS)
    given = options.parse_args()
    if given.serve is not None:
        serve(given.serve)
        return
    with tempfile.TemporaryDirectory() as name:
        tables = measure(given.result or result_of(Path(name)), Path(name), given.parts)
    for part, words in tables.items():
        print(f"{part}\n\n{words}")
        write_page(PAGE, "page.py", {part: words})


if __name__ == "__main__":
    main()
