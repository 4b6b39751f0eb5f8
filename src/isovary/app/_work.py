"""One long run at a time for a part of the page: its turn, its progress, its end."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable
from typing import Any

from ..errors import IsovaryError
from . import _jobs
from ._turns import Turns

_log = logging.getLogger(__name__)


class Work:
    """The long run of a part of the page; starting another one ends the one before.

    Parameters
    ----------
    turns : Turns
        Where it waits for its place.
    """

    def __init__(self, turns: Turns) -> None:
        self._turns = turns
        self._task: asyncio.Task[None] | None = None

    @property
    def running(self) -> bool:
        """Whether a run waits or is under way."""
        return self._task is not None and not self._task.done()

    def start(
        self,
        function: Callable[..., Any],
        arguments: tuple[Any, ...],
        *,
        done: Callable[[Any], None],
        failed: Callable[[str], None],
        progress: Callable[[_jobs.Progress], None] = lambda _: None,
        waiting: Callable[[int], None] = lambda _: None,
        first: Callable[[], Awaitable[None]] | None = None,
    ) -> None:
        """Run a function in a process of its own, once there is a place for it.

        Parameters
        ----------
        function, arguments
            As for :func:`isovary.app._jobs.start`.
        done, failed : callable
            Called at the end with the value, or with the reason; neither if it is cancelled.
        progress, waiting : callable
            Called with what is under way, and with the position in the queue.
        first : async callable, optional
            Called before it asks for its place.
        """
        self.stop()

        async def run() -> None:
            try:
                if first is not None:
                    await first()
                async with self._turns.turn(waiting):
                    await _attend(_jobs.start(function, *arguments), done, failed, progress)
            except IsovaryError as error:
                failed(str(error))
            except ConnectionError:  # the gateway has gone, and the session goes, too
                _log.info("a run of the page ended with its gateway")
            except Exception:
                _log.exception("a run of the page")
                failed("Something went wrong here; the terminal tells more.")

        self._task = asyncio.ensure_future(run())

    def stop(self) -> None:
        """Begin to end what runs."""
        if self._task is not None:
            self._task.cancel()

    async def cancel(self) -> None:
        """End what runs; returns when it has ended."""
        self.stop()
        if self._task is not None:
            await asyncio.wait({self._task})


async def _attend(
    job: _jobs.Job,
    done: Callable[[Any], None],
    failed: Callable[[str], None],
    progress: Callable[[_jobs.Progress], None],
) -> None:
    """Pass on what a job tells; end it if nobody listens any more."""
    try:
        async for event in job.events():
            _pass_on(event, done, failed, progress)
    finally:
        job.cancel()
        await asyncio.shield(job.wait())


def _pass_on(
    event: _jobs.Event,
    done: Callable[[Any], None],
    failed: Callable[[str], None],
    progress: Callable[[_jobs.Progress], None],
) -> None:
    if isinstance(event, _jobs.Progress):
        progress(event)
    elif isinstance(event, _jobs.Finished):
        done(event.value)
    elif isinstance(event, _jobs.Failed):
        failed(event.message)
