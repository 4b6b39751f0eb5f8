"""The child's side of a job: run a function, tell of it, and go when it should."""

from __future__ import annotations

import _thread
import os
import pickle
import re
import shutil
import signal
import tempfile
import threading
import time
import traceback
import warnings
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from ..errors import IsovaryError
from ..io._atomic import stop

GRACE = 0.9  # seconds that the child has to end by itself
_NICE = 5  # so that the pages stay quick on a computer that is busy
_SHORTEST = 0.05  # seconds between two words on one stage
_CODE = re.compile(r"\[[A-Z]\d\d\]$")


def child(pipe: Connection, payload: bytes, scratch: str, out: Path | None) -> None:
    """Run the function, and tell the parent of it."""
    if hasattr(os, "setsid"):  # a group of its own, which is ended as one
        os.setsid()
        os.nice(_NICE)
    signal.signal(signal.SIGTERM, stop)  # so that half-written folders go away
    for variable in ("TMPDIR", "TEMP", "TMP"):
        os.environ[variable] = scratch
    tempfile.tempdir = scratch
    watcher = threading.Thread(target=_watch, args=(pipe, scratch, out, traces(out)), daemon=True)
    watcher.start()
    lock = threading.Lock()

    def tell(word: str, content: object) -> None:
        with lock, suppress(OSError):  # the parent has gone: the watcher ends the work
            pipe.send((word, content))

    _hear_warnings(tell)
    try:
        function, args, kwargs = pickle.loads(payload)
        value = function(*args, progress=_teller(tell), **kwargs)
        tell("finished", pickle.dumps(value))
    except IsovaryError as error:
        tell("failed", "\n".join([str(error), *getattr(error, "__notes__", ())]))
    except Exception as error:
        tell("log", traceback.format_exc())
        tell("failed", unexpected(type(error).__name__))
    except SystemExit:  # as said by stop
        _end_children()
        shutil.rmtree(scratch, ignore_errors=True)
        raise


def _end_children() -> None:
    """Kill this process's own children, and theirs."""
    import psutil

    with suppress(psutil.Error):
        for member in psutil.Process().children(recursive=True):
            with suppress(psutil.Error):
                member.kill()


def _watch(pipe: Connection, scratch: str, out: Path | None, before: set[Path]) -> None:
    """End this process when the parent says so, or has gone; in the hard way if it must be."""
    with suppress(EOFError, OSError):
        pipe.recv()
    main = threading.main_thread().ident
    if os.name == "posix" and main is not None:
        signal.pthread_kill(main, signal.SIGTERM)  # also wakes it where it waits
    else:
        _thread.interrupt_main(signal.SIGTERM)
    time.sleep(GRACE)
    _end_children()
    tidy(out, before)
    shutil.rmtree(scratch, ignore_errors=True)
    if os.name == "posix":
        os.killpg(os.getpid(), signal.SIGKILL)
    os._exit(1)


def _teller(tell: Callable[[str, object], None]) -> Callable[[str, float], None]:
    """The ``progress`` of the function, which may be called as often as it likes."""
    last: list[Any] = [None, 0.0]

    def progress(stage: str, done: float) -> None:
        now = time.monotonic()
        if stage != last[0] or done >= 1 or now - last[1] >= _SHORTEST:
            last[:] = stage, now
            tell("progress", (str(stage), min(max(float(done), 0.0), 1.0)))

    return progress


def _hear_warnings(tell: Callable[[str, object], None]) -> None:
    """Warnings of isovary, which end in a code, become notes; the others go to the log."""
    known: set[str] = set()

    def show(message: Warning | str, category: type[Warning], *_: object, **__: object) -> None:
        text = str(message)
        if text not in known:
            known.add(text)
            ours = category is UserWarning and _CODE.search(text)
            tell("note" if ours else "log", text)

    warnings.simplefilter("always", UserWarning)
    warnings.showwarning = show


def traces(out: Path | None) -> set[Path]:
    """Hidden siblings of an output folder: what is being written, and what is being replaced."""
    if out is None or not out.parent.is_dir():
        return set()
    pattern = re.compile(rf"\.{re.escape(out.name)}\.[0-9a-f]{{12}}\.(part|old)")
    return {path for path in out.parent.iterdir() if pattern.fullmatch(path.name)}


def tidy(out: Path | None, before: set[Path]) -> None:
    """Remove what a killed child left beside its output; an older result goes back to its place."""
    for path in traces(out) - before:
        if path.suffix == ".old" and out is not None and not out.exists():
            with suppress(OSError):
                path.rename(out)
                continue
        shutil.rmtree(path, ignore_errors=True)


def unexpected(kind: str) -> str:
    if kind == "MemoryError":
        return "The work needed more memory than there is; take a smaller field or fewer vertices."
    return f"The work ended in an unexpected {kind}; the log of the server says where."
