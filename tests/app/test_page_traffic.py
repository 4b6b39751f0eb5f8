"""What the page sends when a slider moves: the view it changes, and of that the new colours."""

from __future__ import annotations

import asyncio
import socket
from contextlib import suppress
from multiprocessing import get_context

import msgpack
import pytest
from saved_folder import folder_of, noisy

from isovary.app import _session
from isovary.app._channel import Channel, Kind
from isovary.app._settings import SessionSettings
from isovary.app._views import NAMES

PATIENCE = 60.0  # seconds, on a machine that is busy
QUIET = 0.5  # seconds without a message after which nothing more is on its way
HEAD = 12  # bytes before a message: its number, where the part begins, its length


class Page:
    """A browser's end of a session: what it holds, and what came."""

    def __init__(self, channel):
        self.channel, self.calls, self.came = channel, 0, []
        self.state, self.names, self.held = {}, {}, set()
        self.inbox = asyncio.Queue()
        self.reader = asyncio.ensure_future(self.read())

    async def call(self, method, *args):
        self.calls += 1
        number = f"{'system' if method == 'wslink.hello' else 'rpc'}:c0:{self.calls}"
        call = {"wslink": "1.0", "id": number, "method": method, "args": list(args)}
        body = msgpack.packb(call)
        head = self.calls.to_bytes(4, "little") + bytes(4) + len(body).to_bytes(4, "little")
        await self.channel.send(Kind.MESSAGE, 1, head + body)
        while True:
            told = await self.next()
            if told.get("id") == number:
                assert "error" not in told, told
                return told["result"]

    async def next(self, patience=PATIENCE):
        """The next message; each is short enough to come in one part."""
        told, size = await asyncio.wait_for(self.inbox.get(), patience)
        self.take(told, size)
        return told

    async def read(self):
        """Take what comes; no place is given for long runs, so no further groups are found."""
        while frame := await self.channel.receive():
            if frame.kind == Kind.MESSAGE:
                self.inbox.put_nowait((msgpack.unpackb(frame.payload[HEAD:]), len(frame.payload)))

    def take(self, told, size):
        topic = told["id"].partition(":")[2].rpartition(":")[0]
        if topic == "trame.state.topic":
            self.keep(told["result"])
        if topic == "trame.vtk.delta":
            self.came.append((self.names[told["result"]["id"]], told["result"], size))

    def keep(self, state):
        self.state |= state
        for key in state:
            if key.startswith("scene_view_") and state[key]:
                self.names[state[key]["id"]] = key.removeprefix("scene_view_")

    async def quiet(self):
        """Wait until nothing comes any more."""
        with suppress(TimeoutError):
            while True:
                await self.next(QUIET)

    async def open(self):
        await self.channel.send(Kind.OPENED, 1)
        await self.call("wslink.hello", {"secret": "wslink-secret"})
        self.keep((await self.call("trame.state.get"))["state"])
        while not self.state.get("has_result"):
            await self.next()
        await self.quiet()
        for name in NAMES:
            self.held |= set(dict(arrays(self.state[f"scene_view_{name}"])).values())

    async def move(self, key, value):
        """Move a slider; return by view the new arrays, by name, and the bytes of the words."""
        self.came.clear()
        changes = [{"key": key, "value": value}]
        await self.call("trame.state.update", changes)
        await self.quiet()
        found = {}
        for view, scene, size in self.came:
            fresh = {name: h for name, h in arrays(scene) if h not in self.held}
            sizes = {}
            for name, digest in fresh.items():
                sizes[name] = len(await self.call("viewport.geometry.array.get", digest, True))
            self.held |= set(fresh.values())
            assert view not in found, "a view was sent twice"
            found[view] = sizes, size
        return found


def arrays(scene):
    """Names and hashes of the arrays of a scene."""
    if isinstance(scene, dict):
        if "hash" in scene:
            yield scene["name"], scene["hash"]
        for value in scene.values():
            yield from arrays(value)
    elif isinstance(scene, list):
        for value in scene:
            yield from arrays(value)


def triangles(scene):
    """Number of triangles that a scene shows."""
    if isinstance(scene, dict):
        own = scene.get("polys", {}).get("size", 0) // 4  # a count and three corners each
        return own or max(map(triangles, scene.values()), default=0)
    return max(map(triangles, scene), default=0) if isinstance(scene, list) else 0


MOVES = ("column", 2), ("column", 2), ("factor", 9.5), ("mean", False), ("column", 3), ("count", 7)


@pytest.fixture(scope="module")
def traffic(tmp_path_factory):
    """The number of triangles, and what each of the moves sent."""
    folder = tmp_path_factory.mktemp("traffic")
    (folder / "out").mkdir()
    (folder / "cache").mkdir()
    result = folder_of(noisy(), folder / "result")
    settings = SessionSettings(folder, folder / "cache", result=result)
    ours, theirs = socket.socketpair()
    process = get_context("spawn").Process(target=_session.main, args=(theirs, settings))
    with theirs:
        process.start()

    async def run():
        page = Page(await Channel.on(ours))
        try:
            await page.open()
            count = triangles(page.state["scene_view_base"])
            return count, [await page.move(*move) for move in MOVES]
        finally:
            page.channel.close()

    try:
        return asyncio.run(run())
    finally:
        process.join(PATIENCE)
        process.kill()


def sent(traffic, move):
    """Of one of the moves, the new arrays of each view."""
    return {view: sizes for view, (sizes, _) in traffic[1][move].items()}


def test_scale_sends_the_colours_of_both_signatures(traffic):
    """Oracle: definition. The mean of the change has no scale; a colour is three bytes."""
    colors = {"colors": 3 * traffic[0]}
    assert traffic[0] > 0
    assert sent(traffic, 0) == {"base": colors, "perturbed": colors}


def test_same_value_again_sends_nothing(traffic):
    """Oracle: definition. A slider that stands still changes no view."""
    assert sent(traffic, 1) == {}


def test_threshold_sends_the_change_only(traffic):
    """Oracle: definition. The groups' colours do not depend on the threshold."""
    assert sent(traffic, 2) == {"change": {"colors": 3 * traffic[0]}}


def test_change_at_a_scale_follows_the_scale(traffic):
    """Oracle: definition. Of one scale instead of the mean, the change moves with it."""
    colors = {"colors": 3 * traffic[0]}
    assert sent(traffic, 3) == {"change": colors}
    assert sent(traffic, 4) == dict.fromkeys(("base", "perturbed", "change"), colors)


def test_count_not_yet_found_sends_no_array(traffic):
    """Oracle: definition. Until there are seven groups, the saved ones stay on the screen."""
    assert all(not sizes for sizes in sent(traffic, 5).values())


def test_words_about_a_view_are_short(traffic):
    """Oracle: bound. A view is described in less than 8 kB, however many triangles it has."""
    sizes = [size for move in traffic[1] for _, size in move.values()]
    assert sizes
    assert max(sizes) < 8000
