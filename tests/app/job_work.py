"""What test_jobs.py runs in child processes: a module of its own, quick to import."""

from __future__ import annotations

import os
import subprocess
import sys
import time
import warnings

import numpy as np

from isovary.errors import FieldError
from isovary.io._atomic import write_folder


def add(a, b, progress):
    progress("adding", 0.5)
    progress("looking", 1.0)
    return a + b


def at_half(progress):
    time.sleep(1.0)
    progress("half", 0.5)
    return os.getpid(), os.environ["TMPDIR"]


def refuse(progress):
    error = FieldError("I02", "isovalue: expected 1, got 2")
    error.add_note("note: it was noisy")
    raise error


def divide(progress):
    return 1 / 0


def warn(progress):
    warnings.warn("samples: expected many, got few [I08]", UserWarning, stacklevel=2)
    warnings.warn("samples: expected many, got few [I08]", UserWarning, stacklevel=2)
    warnings.warn("something of another library", UserWarning, stacklevel=2)
    progress("warned", 0.5)


def give_up(how, progress):
    if how == "exit":
        os._exit(3)
    os.kill(os.getpid(), 9)


def wait_for_child(out, progress):
    """Write half of a folder, and let a child of its own hold on to it."""
    with write_folder(out) as folder:
        (folder / "half.txt").write_text("half")
        child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
        progress(f"{os.getpid()} {child.pid}", 0.5)
        child.wait()


def cannot_hear(out, progress):
    """A single call that does not come back for a long time, and no handler can run meanwhile."""
    with write_folder(out) as folder:
        (folder / "half.txt").write_text("half")
        progress(f"{os.getpid()}", 0.5)
        9 ** (9**8)  # a call that keeps the interpreter to itself


def solve_long(out, progress):
    with write_folder(out) as folder:
        (folder / "half.txt").write_text("half")
        matrix = np.random.default_rng(1).random((5000, 5000))
        progress(f"{os.getpid()}", 0.5)
        np.linalg.eig(matrix)


def between_renames(out, progress):
    """As killed between the two renames: the older result aside, the new one not yet there."""
    out.rename(out.with_name(f".{out.name}.{'0' * 12}.old"))
    out.with_name(f".{out.name}.{'0' * 12}.part").mkdir()
    os.kill(os.getpid(), 9)


def give_up_in(out, progress):
    with write_folder(out):
        os._exit(1)


def tidy_up(path, progress):
    """Long work that cleans up behind itself when it is asked to go."""
    try:
        progress("waiting", 0.5)
        time.sleep(60)
    finally:
        path.write_text("tidied")


def tell_often(progress):
    for part in range(4):
        progress("one", part / 10)
        time.sleep(0.1)
    progress("two", 0.9)
