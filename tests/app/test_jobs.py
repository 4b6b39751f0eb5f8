"""Work in a child process: it is heard out, it can be ended, it leaves nothing behind."""

from __future__ import annotations

import asyncio
import json
import logging
import os
import shlex
import subprocess
import sys
import time
import warnings
from pathlib import Path

import psutil
import pytest
from job_work import (
    add,
    at_half,
    between_renames,
    cannot_hear,
    divide,
    give_up,
    give_up_in,
    refuse,
    solve_long,
    tell_often,
    tidy_up,
    wait_for_child,
    warn,
)

from isovary.app._jobs import Cancelled, Failed, Finished, Progress, compare_files_job, start
from isovary.cli import _compare
from isovary.data import water_pair
from isovary.errors import ArgumentError
from isovary.io._atomic import write_folder

SUMMARY = '{"isovary": "0.1"}'


async def heard(function, *args, **kwargs):
    return [event async for event in start(function, *args, **kwargs).events()]


def run(function, *args, **kwargs):
    return asyncio.run(heard(function, *args, **kwargs))


def alive(pid):
    """Whether a process runs; one that only waits to be counted by its new parent does not."""
    try:
        return psutil.Process(pid).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_value_and_stages_arrive_in_order():
    """Oracle: algebra. 2 + 3, after the two stages, in this order; and the last event is one."""
    *told, last = run(add, 2, b=3)
    assert [(event.stage, event.done) for event in told] == [("adding", 0.5), ("looking", 1.0)]
    assert isinstance(last, Finished)
    assert last.value == 5


def test_the_time_left_is_that_of_the_other_half():
    """Oracle: algebra. At one half as much is left as has passed; nothing can be said at 0."""
    told, last = run(at_half)
    assert told.seconds >= 1.0
    assert told.seconds_left == pytest.approx(told.seconds)
    pid, scratch = last.value
    assert pid != os.getpid()
    assert not Path(scratch).exists()  # the child's temporary files went with it


def test_reader_who_comes_later_hears_all_of_it():
    """Oracle: algebra. The stages and the end come again, for a page that was away."""

    async def twice():
        job = start(add, 1, 1)
        first = [event async for event in job.events()]
        assert not job.running
        return first, [event async for event in job.events()], await job.wait()

    first, again, last = asyncio.run(twice())
    assert first == again
    assert last == first[-1]
    assert len(first) == 3


def test_late_reader_hears_each_stage_once():
    """Oracle: algebra. Four words on the first stage, of which the last is kept."""

    async def twice():
        job = start(tell_often)
        first = [event async for event in job.events()]
        return first, [event async for event in job.events()]

    first, again = asyncio.run(twice())
    assert [event.done for event in first[:-1]] == [0.0, 0.1, 0.2, 0.3, 0.9]
    assert [event.done for event in again[:-1]] == [0.3, 0.9]
    assert first[-1] is again[-1]


def test_error_of_isovary_comes_with_its_notes():
    """Oracle: data. The text that the command line would print."""
    (last,) = run(refuse)
    assert last == Failed("isovalue: expected 1, got 2 [I02]\nnote: it was noisy")


def test_other_errors_say_their_kind_and_the_log_has_the_rest(caplog):
    """Oracle: data. One sentence without a path or line; the traceback in the log."""
    with caplog.at_level(logging.WARNING, logger="isovary.app._jobs"):
        (last,) = run(divide)
    assert "ZeroDivisionError" in last.message
    assert "\n" not in last.message
    assert ".py" not in last.message
    assert "return 1 / 0" in caplog.text


def test_warnings_become_notes_once():
    """Oracle: data. Those with a code, each once; the others are in the log only."""
    told, last = run(warn)
    assert told.notes == last.notes == ("samples: expected many, got few [I08]",)


@pytest.mark.skipif(os.name == "nt", reason="signals")
@pytest.mark.parametrize(("how", "text"), [("exit", "exit code 3"), ("kill", "SIGKILL")])
def test_child_that_dies_is_told(how, text):
    """Oracle: data. The exit code or the signal that ended it."""
    (last,) = run(give_up, how)
    assert isinstance(last, Failed)
    assert text in last.message


@pytest.mark.parametrize(("function", "args"), [(lambda progress: 1, ()), (add, (1, lambda: 0))])
def test_what_cannot_be_sent_is_refused_at_once(function, args):
    """Oracle: data. A lambda has no name that could be imported."""
    with pytest.raises(ArgumentError, match="can be imported") as caught:
        run(function, *args)
    assert caught.value.code == "A03"


def return_a_lambda(progress):
    return lambda: 0


def test_value_that_cannot_be_sent_back_fails():
    """Oracle: data. It ends, with words."""
    (last,) = run(return_a_lambda)
    assert isinstance(last, Failed)
    assert "unexpected" in last.message


@pytest.mark.parametrize("function", [wait_for_child, solve_long, cannot_hear])
def test_cancel_ends_all_at_once(tmp_path, function):
    """Oracle: data. Neither processes nor half-written folders are left; an older result is."""
    with write_folder(tmp_path / "out") as folder:
        (folder / "summary.json").write_text(SUMMARY)

    async def cancelled():
        job = start(function, tmp_path / "out")
        beats, pids = 0, []
        async for event in job.events():
            if isinstance(event, Progress):
                pids = [int(word) for word in event.stage.split()]
                await asyncio.sleep(0.3)
                assert len(names(tmp_path)) == 2
                job.cancel()
                job.cancel()
                began = time.monotonic()
                while job.running and beats < 4000:
                    await asyncio.sleep(0.01)
                    beats += 1
        return event, pids, time.monotonic() - began, beats

    event, pids, seconds, beats = asyncio.run(cancelled())
    assert event == Cancelled()
    assert seconds < 20.0  # of 60 that the work takes; benchmarks/page.py measures it
    assert beats > 0  # the loop went on
    assert not [pid for pid in pids if alive(pid)]
    assert names(tmp_path) == ["out"]
    assert names(tmp_path / "out") == ["summary.json"]


def test_cancelled_work_may_clean_up(tmp_path):
    """Oracle: algebra. Its finally clauses run, as those of write_folder do."""

    async def cancelled():
        job = start(tidy_up, tmp_path / "note.txt")
        async for _ in job.events():
            job.cancel()
        return await job.wait()

    assert asyncio.run(cancelled()) == Cancelled()
    assert (tmp_path / "note.txt").read_text() == "tidied"


def test_cancel_before_the_child_is_there():
    """Oracle: algebra. Cancelled, however early."""

    async def at_once():
        job = start(solve_long, "nowhere")
        job.cancel()
        return await job.wait()

    assert asyncio.run(at_once()) == Cancelled()
    assert not Path("nowhere").exists()


@pytest.mark.skipif(os.name == "nt", reason="signals")
def test_older_result_comes_back_if_killed_between_two_renames(tmp_path):
    """Oracle: algebra. What stood there before stands there again, alone."""
    with write_folder(tmp_path / "out") as folder:
        (folder / "summary.json").write_text(SUMMARY)
    (last,) = run(between_renames, tmp_path / "out")
    assert "SIGKILL" in last.message
    assert names(tmp_path) == ["out"]
    assert (tmp_path / "out" / "summary.json").read_text() == SUMMARY


def test_what_others_write_at_the_same_place_is_kept(tmp_path):
    """Oracle: algebra. A hidden folder that was there before the job is not the job's."""
    other = tmp_path / f".out.{'1' * 12}.part"
    other.mkdir()
    (last,) = run(give_up_in, tmp_path / "out")
    assert isinstance(last, Failed)
    assert names(tmp_path) == [other.name]


PARENT = """
import asyncio, sys
sys.path.insert(0, {folder!r})
from isovary.app._jobs import start
import job_work

async def main():
    job = start(job_work.wait_for_child, {out!r})
    async for event in job.events():
        print(event.stage, flush=True)

if __name__ == "__main__":
    asyncio.run(main())
"""


@pytest.mark.parametrize("how", ["kill", "terminate"])
def test_child_goes_when_its_parent_goes(tmp_path, how):
    """Oracle: data. Both processes are gone soon after the parent was killed, and their output."""
    script = tmp_path / "parent.py"
    script.write_text(PARENT.format(folder=str(Path(__file__).parent), out=str(tmp_path / "out")))
    parent = subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True)
    pids = [int(word) for word in parent.stdout.readline().split()]
    assert len(pids) == 2
    getattr(parent, how)()
    parent.wait(10)
    parent.stdout.close()
    deadline = time.monotonic() + 5
    while time.monotonic() < deadline and any(map(alive, pids)):
        time.sleep(0.05)
    assert not [pid for pid in pids if alive(pid)]
    assert names(tmp_path) == ["parent.py"]


def test_program_that_ends_does_not_wait_for_its_job(tmp_path):
    """Oracle: data. It ends with the exit code of a clean end, long before the child's 60 s."""
    script = tmp_path / "parent.py"
    text = PARENT.format(folder=str(Path(__file__).parent), out=str(tmp_path / "out"))
    script.write_text(text.replace("flush=True)", "flush=True)\n        return"))
    done = subprocess.run([sys.executable, str(script)], capture_output=True, timeout=20)
    assert done.returncode == 0, done.stderr
    assert done.stderr == b""
    assert not [pid for pid in map(int, done.stdout.split()) if alive(pid)]
    assert names(tmp_path) == ["parent.py"]


OPTIONS = {"order": 1, "vertices": 150, "eigenpairs": 40, "times": 10}


def test_compare_job_does_what_the_command_does(tmp_path, monkeypatch):
    """Oracle: data. Choices and the command that repeats them; its notes are warned of."""
    saved = []
    monkeypatch.setattr(_compare, "save", lambda result, out, progress: saved.append((result, out)))
    told = []
    out = tmp_path / "out"
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        pair = [str(path) for path in water_pair()]
        made = compare_files_job(
            *pair, 0.05, OPTIONS, str(out), progress=lambda *word: told.append(word)
        )
    ((result, where),) = saved
    assert made == where == out
    assert told[0] == ("reading", 0.0)
    assert len(result.base.points) == 150
    words = shlex.split(result.choices["command"])
    assert words[:4] == ["isovary", "compare", *pair]
    for option in (["--isovalue", "0.05"], ["--order", "1"], ["--vertices", "150"]):
        at = words.index(option[0])
        assert words[at : at + 2] == option
    assert [str(warning.message) for warning in caught] == list(result.notes)
    assert len(result.notes) > 0


@pytest.mark.slow
def test_compare_job_writes_its_folder(tmp_path):
    """Oracle: data. The folder is there, with one row for each vertex."""
    import pyvista as pv

    *told, last = run(compare_files_job, *water_pair(), 0.05, OPTIONS, tmp_path / "out")
    assert isinstance(last, Finished), last
    assert told[0].stage == "reading"
    choices = json.loads((last.value / "summary.json").read_text())["choices"]
    assert choices["order"] == 1
    assert pv.read(last.value / "change.vtu").n_points == 150
    assert names(tmp_path) == ["out"]


def test_options_that_the_command_does_not_have(tmp_path):
    """Oracle: data. A02 with what there is; nothing is written."""
    for options, text in (({"meshes": 1}, "eigenpairs"), ({"cluster": "k-means"}, "k-medians")):
        (last,) = run(compare_files_job, *water_pair(), 0.05, options, tmp_path / "out")
        assert text in last.message
        assert "[A02]" in last.message
    assert names(tmp_path) == []
