"""Long runs of the page: their place in the gateway's queue, their end, and what is told of it."""

from __future__ import annotations

import asyncio

import pytest
from stubs import StubGateway, in_loop, settled, stub_jobs

from isovary.app import _jobs
from isovary.app._jobs import Failed, Finished, Progress
from isovary.app._turns import Turns
from isovary.app._work import Work
from isovary.errors import ArgumentError, RunError


class Line:
    """A gateway that answers when the test says so."""

    def __init__(self):
        self.notes, self.positions, self.error = [], [], None
        self.turns = Turns(self.send)

    async def send(self, **note):
        if self.error is not None:
            raise self.error
        self.notes.append(note)

    @property
    def jobs(self):
        return [(note["job"], note["id"]) for note in self.notes if "job" in note]

    @property
    def busy(self):
        return [note["busy"] for note in self.notes if "busy" in note]

    def go(self, number):
        self.turns.noted({"job": "go", "id": number})

    def hold(self, until):
        """A run that works until an event is set."""

        async def run():
            async with self.turns.turn(self.positions.append):
                await until.wait()

        return asyncio.ensure_future(run())


@in_loop
async def test_the_position_is_told_until_there_is_a_place():
    """Oracle: definition. Each position that the gateway tells, in order; then the work begins."""
    line, end = Line(), asyncio.Event()
    run = line.hold(end)
    await settled()
    assert line.jobs == [("ask", 1)]
    for position in (3, 2, 1):
        line.turns.noted({"job": "wait", "id": 1, "position": position})
    assert line.positions == [3, 2, 1]
    end.set()
    await settled()
    assert not run.done()  # without a place nothing begins
    line.go(1)
    await run
    assert line.jobs == [("ask", 1), ("done", 1)]


@in_loop
async def test_answers_go_to_the_run_that_asked():
    """Oracle: definition. The second run's place is not the first one's; other notes pass."""
    line, end = Line(), asyncio.Event()
    first, second = line.hold(end), line.hold(end)
    await settled()
    assert line.jobs == [("ask", 1), ("ask", 2)]
    end.set()
    for other in ({}, {"uploaded": {}}, {"job": "go", "id": 9}, {"job": "go"}):
        line.turns.noted(other)
    line.go(2)
    await second
    assert not first.done()
    line.go(1)
    line.go(1)  # told twice, or late
    await first
    line.go(1)


@in_loop
async def test_too_many_runs_are_refused_in_words():
    """Oracle: definition. W11 with the number that may wait, and the place in line is given up."""
    line = Line()
    run = line.hold(asyncio.Event())
    await settled()
    line.turns.noted({"job": "refused", "id": 1, "waiting": 3})
    with pytest.raises(RunError, match="expected at most 3 that wait") as told:
        await run
    assert told.value.code == "W11"
    assert line.busy[-1] is False
    line.turns.noted({"job": "refused", "id": 1, "waiting": 3})


@in_loop
async def test_busy_as_long_as_something_waits_or_works():
    """Oracle: definition. Busy before the first asks, and free only after the last has ended."""
    line, ends = Line(), [asyncio.Event(), asyncio.Event()]
    assert line.notes == []
    runs = [line.hold(end) for end in ends]
    await settled()
    assert line.notes[0] == {"busy": True}
    line.go(1)
    ends[0].set()
    await runs[0]
    assert False not in line.busy  # the second one waits
    line.go(2)
    await settled()
    assert False not in line.busy  # and works
    ends[1].set()
    await runs[1]
    assert line.busy[-1] is False
    assert line.busy.count(False) == 1


@pytest.mark.parametrize("placed", [False, True])
@in_loop
async def test_a_run_that_is_given_up_leaves_the_line(placed):
    """Oracle: definition. Cancelled while it waits, or works: its place is free, nothing busy."""
    line = Line()
    run = line.hold(asyncio.Event())
    await settled()
    if placed:
        line.go(1)
        await settled()
    run.cancel()
    await asyncio.wait({run})
    assert run.cancelled()
    assert line.jobs[-1] == ("done", 1)
    assert line.busy[-1] is False


@in_loop
async def test_a_gateway_that_has_gone_is_no_error_at_the_end():
    """Oracle: definition. The work has ended well, although nobody can be told."""
    line, end = Line(), asyncio.Event()
    run = line.hold(end)
    await settled()
    line.go(1)
    line.error = BrokenPipeError()
    end.set()
    await run


@in_loop
async def test_an_error_of_the_work_is_not_lost_with_the_gateway():
    """Oracle: definition. What the work raised comes out, not the broken connection."""
    line = Line()

    async def run():
        async with line.turns.turn(line.positions.append):
            line.error = ConnectionResetError()
            raise ArgumentError("A02", "x: expected 1, got 2")

    task = asyncio.ensure_future(run())
    await settled()
    line.go(1)
    with pytest.raises(ArgumentError):
        await task


class Told:
    """What a part of the page is told of its run."""

    def __init__(self):
        self.done, self.failed, self.stages, self.positions = [], [], [], []

    def start(self, work, function=len, *arguments):
        work.start(
            function,
            arguments,
            done=self.done.append,
            failed=self.failed.append,
            progress=lambda event: self.stages.append(event.stage),
            waiting=self.positions.append,
        )

    @property
    def ended(self):
        return self.done + self.failed


@pytest.fixture
def jobs(monkeypatch):
    return stub_jobs(monkeypatch)


@in_loop
async def test_progress_then_the_value(jobs):
    """Oracle: definition. The function with its arguments; its stages, its value, nothing else."""
    gateway, told = StubGateway(), Told()
    work = Work(gateway.turns)
    assert not work.running
    told.start(work, len, "abc")
    assert work.running
    await settled()
    assert (jobs[0].function, jobs[0].arguments) == (len, ("abc",))
    jobs[0].tell(Progress("one", 0.1, 1.0, None))
    jobs[0].tell(Progress("two", 0.2, 1.0, None))
    await settled()
    assert told.stages == ["one", "two"]
    assert not told.ended
    jobs[0].tell(Finished(3, 1.0))
    await settled()
    assert (told.done, told.failed) == ([3], [])
    assert not work.running
    assert gateway.notes[-1] == {"busy": False}


@in_loop
async def test_a_failure_is_told_in_its_own_words(jobs):
    """Oracle: definition. The job's message, once, and no value."""
    told, work = Told(), Work(StubGateway().turns)
    told.start(work)
    await settled()
    jobs[0].tell(Failed("field: expected finite values, got none [I01]"))
    await settled()
    assert told.failed == ["field: expected finite values, got none [I01]"]
    assert told.done == []


@in_loop
async def test_without_a_place_nothing_starts(jobs):
    """Oracle: definition. The position is passed on, the process waits for its place."""
    line, told = Line(), Told()
    work = Work(line.turns)
    told.start(work)
    await settled()
    line.turns.noted({"job": "wait", "id": 1, "position": 2})
    assert (told.positions, jobs) == ([2], [])
    line.turns.noted({"job": "refused", "id": 1, "waiting": 3})
    await settled()
    assert jobs == []
    assert "[W11]" in told.failed[0]


@in_loop
async def test_another_run_ends_the_one_before(jobs):
    """Oracle: definition. The first is ended and silent, also where its answer was on its way."""
    gateway, first, second = StubGateway(), Told(), Told()
    work = Work(gateway.turns)
    first.start(work)
    await settled()
    jobs[0].tell(Finished("late", 1.0))
    second.start(work)
    await settled()
    assert not jobs[0].running
    jobs[1].tell(Finished("value", 1.0))
    await settled()
    assert first.ended == []
    assert second.done == ["value"]
    assert gateway.notes[-1] == {"busy": False}
    given_up = [note["id"] for note in gateway.notes if note.get("job") == "done"]
    assert sorted(given_up) == [1, 2]


@in_loop
async def test_cancel_returns_when_the_run_has_ended(jobs, monkeypatch):
    """Oracle: definition. It waits for the job's last word, and neither done nor failed follow."""
    told, work = Told(), Work(StubGateway().turns)
    await work.cancel()  # nothing runs
    told.start(work)
    await settled()
    job, asked = jobs[0], []
    monkeypatch.setattr(job, "cancel", lambda: asked.append(True))  # it takes its time
    ending = asyncio.ensure_future(work.cancel())
    await settled()
    assert asked
    assert not ending.done()
    assert work.running
    job.tell(_jobs.Cancelled())
    await ending
    assert not work.running
    assert told.ended == []
    told.start(work)  # and another one may follow
    await settled()
    jobs[1].tell(Finished(1, 1.0))
    await settled()
    assert told.done == [1]


@in_loop
async def test_cancelled_while_it_waits_starts_no_process(jobs):
    """Oracle: definition. No job, no word; the place that comes too late is left."""
    line, told = Line(), Told()
    work = Work(line.turns)
    told.start(work)
    await settled()
    await work.cancel()
    line.go(1)
    await settled()
    assert (jobs, told.ended) == ([], [])
    assert line.jobs[-1] == ("done", 1)


@in_loop
async def test_unexpected_errors_are_told_in_plain_words(jobs, monkeypatch, caplog):
    """Oracle: definition. No name of an exception, no path for the reader; the log has all."""
    told, gateway = Told(), StubGateway()

    def broken(*_):
        raise KeyError("/secret/path")

    monkeypatch.setattr(_jobs, "start", broken)
    told.start(Work(gateway.turns))
    await settled()
    assert told.done == []
    (words,) = told.failed
    assert "KeyError" not in words
    assert "secret" not in words
    assert "terminal" in words
    assert "/secret/path" in caplog.text
    assert gateway.notes[-1] == {"busy": False}


@in_loop
async def test_what_cannot_be_sent_to_a_process_is_told():
    """Oracle: definition. The job's own refusal, A03, in its own words."""
    told = Told()
    told.start(Work(StubGateway().turns), lambda progress: None)
    await settled()
    assert told.failed
    assert told.failed[0].endswith("[A03]")


@pytest.mark.parametrize("note", ["busy", "job"])
@in_loop
async def test_a_run_given_up_while_it_asks_leaves_the_line(note):
    """Oracle: definition. Also while the channel is slow: what was asked for is given back."""
    notes, slow = [], asyncio.Event()

    async def send(**sent):
        notes.append(sent)  # written, and then the channel waits for the other end
        if note in sent and sent.get(note) in (True, "ask"):
            await slow.wait()

    turns = Turns(send)

    async def run():
        async with turns.turn(lambda _: None):
            raise AssertionError

    task = asyncio.ensure_future(run())
    await settled()
    task.cancel()
    await asyncio.wait({task})
    slow.set()
    asked = [n for n in notes if n.get("job") == "ask"]
    assert len([n for n in notes if n.get("job") == "done"]) >= len(asked)
    assert notes[-1] == {"busy": False}
