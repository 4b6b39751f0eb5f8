"""What stands in for browser, gateway and child processes where parts of the page are tested."""

from __future__ import annotations

import asyncio
import functools
import logging
import threading

import numpy as np
from trame_server.state import State

from isovary.app import _jobs
from isovary.app._jobs import Cancelled, Failed, Finished, Progress
from isovary.app._settings import SessionSettings
from isovary.app._turns import Turns
from isovary.app._views import NAMES
from isovary.errors import IsovaryError

PATIENCE = 30.0  # seconds, on a machine that is busy


class _Loud(logging.Handler):
    """Raises what trame would only log: a listener of the state that failed."""

    def emit(self, record):
        if record.name in ("root", "trame_server.state"):
            raise AssertionError(self.format(record))


def in_loop(test):
    """Make a test of a coroutine function: it runs in a loop that keeps no fault to itself."""

    @functools.wraps(test)
    def run(*args, **kwargs):
        faults, loud = [], _Loud(logging.WARNING)

        async def watched():
            loop = asyncio.get_running_loop()
            loop.set_exception_handler(lambda _, context: faults.append(context))
            await asyncio.wait_for(test(*args, **kwargs), PATIENCE)

        logging.getLogger().addHandler(loud)
        try:
            asyncio.run(watched())
        finally:
            logging.getLogger().removeHandler(loud)
        assert not faults

    return run


async def settled():
    """Let everything run that waits for nothing but its turn in the loop."""
    for _ in range(50):
        await asyncio.sleep(0)


def held(result):
    """A function that answers when it is let go; when it was asked, and the leave to answer."""
    asked, answer = threading.Event(), threading.Event()

    def slow(*_, **__):
        asked.set()
        answer.wait(PATIENCE)
        return result

    return slow, asked, answer


class StubServer:
    """A server with trame's own state, and neither port nor browser."""

    def __init__(self, **state):
        self.state = State(ready=True)
        self.state.update(state)
        self.controller = self
        self.on_server_ready = set()

    def begin(self):
        """Take the state that the page was made with for known; nobody is told of it."""
        self.state.clean(*self.state.initial)

    def browser_sets(self, **values):
        """What a browser does when somebody moves a slider or types."""
        with self.state as state:
            state.update(values)


class StubViews:
    """What stands in the four views, and which calls put it there."""

    def __init__(self):
        self.meshes, self.colors, self.strokes, self.calls = {}, {}, {}, []

    def show(self, name, mesh, colors):
        assert len(colors) == len(mesh.triangles)
        self.calls.append("show")
        self.meshes[name], self.colors[name] = mesh, colors

    def clear(self, *names):
        self.calls.append("clear")
        for name in names:
            self.meshes.pop(name, None)
            self.strokes.pop(name, None)

    def paint(self, name, colors):
        assert len(colors) == len(self.meshes[name].triangles)
        self.calls.append("paint")
        self.colors[name] = colors

    def draw_lines(self, ends, names=NAMES):
        self.calls.append("draw_lines")
        self.strokes |= dict.fromkeys(names, ends)

    def __getattr__(self, name):
        return lambda *_, **__: self.calls.append(name)


class StubExploring:
    """The part of the page that a result goes to."""

    def __init__(self):
        self.told = []

    async def pause(self):
        self.told.append("pause")

    def find_groups(self):
        self.told.append("find_groups")

    async def open_result(self, folder):
        self.told.append(folder)


class StubJob:
    """A job without a process: the test says what it tells, and when."""

    def __init__(self, function, arguments):
        self.function, self.arguments = function, arguments
        self.history, self.heard = [], []

    def tell(self, event):
        self.history.append(event)
        for queue in self.heard:
            queue.put_nowait(event)

    def run(self):
        """Do the work, here and now."""
        try:
            self.tell(Finished(self.function(*self.arguments, progress=lambda *_: None), 0.0))
        except IsovaryError as error:
            self.tell(Failed(str(error)))

    async def events(self):
        queue = asyncio.Queue()
        for event in self.history:
            queue.put_nowait(event)
        self.heard.append(queue)
        event = None
        while event is None or isinstance(event, Progress):
            event = await queue.get()
            yield event

    async def wait(self):
        return [event async for event in self.events()][-1]

    def cancel(self):
        if self.running:
            self.tell(Cancelled())

    @property
    def running(self):
        return not self.history or isinstance(self.history[-1], Progress)


def stub_jobs(monkeypatch, *modules):
    """Start stubs instead of processes; the list of them, in order."""
    jobs = []

    def start(function, *arguments):
        jobs.append(StubJob(function, arguments))
        return jobs[-1]

    for module in (_jobs, *modules):
        monkeypatch.setattr(module, "start", start)
    return jobs


class StubGateway:
    """Gives every run its place at once, and keeps the notes that it got."""

    def __init__(self):
        self.notes = []
        self.turns = Turns(self.send)

    async def send(self, **note):
        self.notes.append(note)
        if note.get("job") == "ask":
            self.turns.noted({"job": "go", "id": note["id"]})


def settings_of(folder, **more):
    """The settings of a session in an empty folder."""
    for name in ("in", "out", "cache"):
        (folder / name).mkdir()
    return SessionSettings(folder, folder / "cache", **more)


def npy(path, values):
    """A field's file."""
    np.save(path, values)
    return path
