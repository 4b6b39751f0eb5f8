"""Long work in a child process, for a caller whose event loop must never wait.

One thread of the caller's process starts the child, reads its pipe and ends it; the loop hears
of it through :meth:`Job.events`. The child has a thread, too, that reads the other direction:
a word to stop, or the end of the pipe when the caller's process has died, however it did.
"""

from __future__ import annotations

import asyncio
import atexit
import inspect
import logging
import os
import pickle
import shutil
import signal
import tempfile
import threading
import time
import warnings
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

from ..errors import ArgumentError
from ._job_child import GRACE, child, tidy, traces, unexpected

_SPARE = 0.2  # seconds after that, before the parent ends it
_ENOUGH = 0.02  # of the work, before the rest is estimated
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Progress:
    """How far the work is: its stage, the part done (0 to 1), seconds so far and left.

    ``seconds_left`` is None as long as nothing can be said; ``notes`` are the warnings so far.
    """

    stage: str
    done: float
    seconds: float
    seconds_left: float | None
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Finished:
    """What the function returned, after how many seconds, and what it warned of."""

    value: Any
    seconds: float
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Failed:
    """Why there is no result, in words for the reader of the page."""

    message: str
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Cancelled:
    """The work was ended on request; nothing of it is left."""


Event = Progress | Finished | Failed | Cancelled
"""What :meth:`Job.events` gives; all but Progress are the last."""


def start(function: Callable[..., Any], *args: Any, **kwargs: Any) -> Job:
    """Run a function in a child process of its own.

    The function is called with ``progress=``, a callable (stage, part done). An argument that it
    calls ``out`` is its output folder: if the work does not finish, hidden siblings that
    :func:`isovary.io._atomic.write_folder` left there are removed. Temporary files of the child
    lie in a folder of their own, which goes with it.

    Parameters
    ----------
    function : callable
        Importable by its name.
    *args, **kwargs
        What it is called with; picklable, as is what it returns.

    Returns
    -------
    Job
        Under way; to be asked from the running loop only.

    Raises
    ------
    ArgumentError
        A03 if the function or its arguments cannot be sent to another process.

    Notes
    -----
    Cost: 0.5 s until the function begins, in which the loop goes on.
    """
    name = getattr(function, "__qualname__", repr(function))
    try:
        payload = pickle.dumps((function, args, kwargs))
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise ArgumentError(
            "A03",
            f"function: expected one that can be imported, with arguments that can be pickled, "
            f"got {name} ({error}); define it in a module",
        ) from None
    return Job(name, payload, _output_of(function, args, kwargs))


def _output_of(
    function: Callable[..., Any], args: tuple[Any, ...], kwargs: Mapping[str, Any]
) -> Path | None:
    try:
        given = inspect.signature(function).bind_partial(*args, **kwargs).arguments
    except (TypeError, ValueError):
        return None
    out = given.get("out", given.get("kwargs", {}).get("out"))
    return None if out is None else Path(out).resolve()


class Job:
    """Work under way in a child process, made by :func:`start`."""

    def __init__(self, name: str, payload: bytes, out: Path | None) -> None:
        self._name, self._payload, self._out = name, payload, out
        self._loop = asyncio.get_running_loop()
        self._history: list[Event] = []
        self._listeners: list[asyncio.Queue[Event]] = []
        self._wake, self._waker = get_context("spawn").Pipe(duplex=False)
        self._cancelled = threading.Event()
        self._thread = threading.Thread(target=self._attend, name=f"job {name}", daemon=True)
        _alive.add(self)
        self._thread.start()

    async def events(self) -> AsyncIterator[Event]:
        """What has happened, a word for each stage, and what happens, to the end.

        May be asked several times and at any time, as by a page that lost its connection.
        """
        queue: asyncio.Queue[Event] = asyncio.Queue()
        for event in self._history:
            queue.put_nowait(event)
        self._listeners.append(queue)
        try:
            while True:
                event = await queue.get()
                yield event
                if not isinstance(event, Progress):
                    return
        finally:
            self._listeners.remove(queue)

    async def wait(self) -> Finished | Failed | Cancelled:
        """The last event."""
        async for event in self.events():
            if not isinstance(event, Progress):
                return event
        raise AssertionError("events end with one that is no progress")

    def cancel(self) -> None:
        """End the child and all its children within 2 s; returns at once, and may be repeated."""
        if not self._cancelled.is_set():
            self._cancelled.set()
            with suppress(OSError):
                self._waker.send(None)

    @property
    def running(self) -> bool:
        """Whether there is more to come."""
        return not self._history or isinstance(self._history[-1], Progress)

    def _hear(self, event: Event) -> None:
        """Take in an event, in the loop."""
        last = self._history[-1] if self._history else None
        if isinstance(last, Progress) and isinstance(event, Progress) and last.stage == event.stage:
            self._history.pop()
        self._history.append(event)
        for queue in self._listeners:
            queue.put_nowait(event)

    def _say(self, event: Event) -> None:
        """Hand an event to the loop, from the thread."""
        with suppress(RuntimeError):  # the loop is closed: nobody listens
            self._loop.call_soon_threadsafe(self._hear, event)

    def _attend(self) -> None:
        """All that may take time: start the child, hear it out, end it, tidy up."""
        before = traces(self._out)
        scratch = tempfile.mkdtemp(prefix="isovary-job-")
        try:
            final = self._run(scratch)
            if not isinstance(final, Finished):
                tidy(self._out, before)
        except Exception as error:  # no reader of the page should wait for ever
            _log.exception("job %s", self._name)
            final = Failed(unexpected(type(error).__name__))
        finally:
            shutil.rmtree(scratch, ignore_errors=True)
            _alive.discard(self)
        self._say(final)

    def _run(self, scratch: str) -> Finished | Failed | Cancelled:
        context = get_context("spawn")
        ours, theirs = context.Pipe()
        process = context.Process(
            target=child, args=(theirs, self._payload, scratch, self._out), name=self._name
        )
        began = time.monotonic()
        try:
            process.start()
        finally:
            theirs.close()
        assert process.pid is not None
        self._family = _Family(process.pid)
        notes: list[str] = []
        final: Finished | Failed | None = None
        try:
            final = self._listen(ours, process, notes, began)
        finally:
            process.join(_SPARE if self._cancelled.is_set() else GRACE)
            if final is None or process.is_alive():
                self._family.end()
                process.join(_SPARE)
            ours.close()
        code = process.exitcode
        if self._cancelled.is_set() and not isinstance(final, Finished):
            return Cancelled()
        return final or Failed(_death(code), tuple(notes))

    def _listen(
        self, pipe: Connection, process: Any, notes: list[str], began: float
    ) -> Finished | Failed | None:
        """Hear the child out: its last word, or None if it went without one, or should."""
        deadline = None
        while deadline is None or time.monotonic() < deadline:
            ready = wait([pipe, self._wake], 0.2)
            if self._wake in ready and deadline is None:
                self._wake.recv()
                deadline = time.monotonic() + GRACE + _SPARE
                self._family.look()
                with suppress(OSError):
                    pipe.send("stop")
            if pipe in ready:
                try:
                    word, content = pipe.recv()
                except (EOFError, OSError):
                    return None
                final = self._take(word, content, notes, time.monotonic() - began)
                if final is not None:
                    return final
            elif process.exitcode is not None and not pipe.poll():
                return None
        return None

    def _take(
        self, word: str, content: Any, notes: list[str], seconds: float
    ) -> Finished | Failed | None:
        """One word of the child's."""
        if word == "progress":
            stage, done = content
            left = seconds * (1 - done) / done if done >= _ENOUGH else None
            self._say(Progress(stage, done, seconds, left, tuple(notes)))
        elif word == "note":
            notes.append(content)
        elif word == "log":
            _log.warning("job %s: %s", self._name, content)
        elif word == "failed":
            return Failed(content, tuple(note for note in notes if note not in content))
        elif word == "finished":
            return Finished(pickle.loads(content), seconds, tuple(notes))
        return None


_alive: set[Job] = set()


def _end_all() -> None:
    """Leave no child behind, and none to wait for, when the interpreter ends."""
    jobs = list(_alive)
    for job in jobs:
        job.cancel()
    for job in jobs:
        job._thread.join(2 * (GRACE + _SPARE))


atexit.register(_end_all)  # after multiprocessing's own, so that it runs before


class _Family:
    """A child and its children, which are ended together even when the child has gone first."""

    def __init__(self, pid: int) -> None:
        self.pid = pid
        self.members: set[Any] = set()

    def look(self) -> None:
        """Note who is there."""
        import psutil

        with suppress(psutil.Error):
            child = psutil.Process(self.pid)
            self.members |= {child, *child.children(recursive=True)}

    def end(self) -> None:
        """Kill all that is left, and give the children's children a moment to be gone."""
        import psutil

        self.look()
        for member in self.members:
            with suppress(psutil.Error):
                member.kill()
        if os.name == "posix":  # those that were started meanwhile
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self.pid, signal.SIGKILL)
        others = [member for member in self.members if member.pid != self.pid]
        psutil.wait_procs(others, timeout=_SPARE)


def _death(code: int | None) -> str:
    if code is None:
        return "The process that did the work could not be ended."
    if code >= 0:
        return f"The process that did the work ended by itself, with exit code {code}."
    try:
        name = signal.Signals(-code).name
    except ValueError:
        name = f"signal {-code}"
    why = "; perhaps the memory ran out" if name == "SIGKILL" else ", as in a crash"
    return f"The process that did the work was ended by {name}{why}; try again, or a smaller field."


def compare_files_job(
    base_path: str | os.PathLike[str],
    perturbed_path: str | os.PathLike[str],
    isovalue: float,
    options: Mapping[str, object],
    out: str | os.PathLike[str],
    progress: Callable[[str, float], None],
) -> Path:
    """Do what ``isovary compare`` does: read, compare, write the result folder.

    Parameters
    ----------
    base_path, perturbed_path : path
        Field files.
    isovalue : float
        In the fields' unit.
    options : mapping
        Further options of the command by their names in Python (``perturbed_array``), with its
        values (``"k-medians"``).
    out : path
        The result folder.
    progress : callable
        Called with the stage and the part done.

    Returns
    -------
    Path
        The folder; what a reader must know has been warned of.

    Raises
    ------
    IsovaryError
        A02 for an option that the command does not have, or a word that it does not take; what
        reading, comparing and writing raise.
    """
    from ..cli._compare import compare_as_asked, completed

    own = {"base": base_path, "perturbed": perturbed_path, "isovalue": isovalue, "out": out}
    result = compare_as_asked(completed({**options, **own}), progress)
    for note in result.notes:
        warnings.warn(note, UserWarning, stacklevel=2)
    return Path(out)
