"""The application that the commands register with, and how it ends."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Annotated, Literal

from cyclopts import App, CycloptsError, Parameter, Token
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from .. import __version__
from ..errors import ArgumentError, IsovaryError
from ..io._atomic import stop

app = App(
    name="isovary",
    help="Intrinsic change of isosurfaces between simulation runs.",
    version=__version__,
    default_parameter=Parameter(negative_iterable=()),
    suppress_keyboard_interrupt=False,  # main() tells of it
)
_errors = Console(stderr=True, highlight=False)
_output = Console(highlight=False)


def _whole(_kind: type, tokens: Sequence[Token]) -> int:
    """A whole number; others are refused, not cut."""
    try:
        return int(tokens[0].value)
    except ValueError:
        raise ValueError(f"expected a whole number, got {tokens[0].value}") from None


def _whole_or_auto(kind: type, tokens: Sequence[Token]) -> int | str:
    return "auto" if tokens[0].value == "auto" else _whole(kind, tokens)


Whole = Annotated[int, Parameter(converter=_whole)]
WholeOrAuto = Annotated[int | Literal["auto"], Parameter(converter=_whole_or_auto)]
WholeOrNone = Annotated[int | None, Parameter(converter=_whole)]


def main() -> None:
    """Run the command line; never returns."""
    signal.signal(signal.SIGTERM, stop)  # so that half-written folders go away
    try:
        app(exit_on_error=False, print_error=False)
    except CycloptsError as error:
        _fail(f"{error}\nTry: isovary --help", 2)
    except IsovaryError as error:
        words = "\n".join([str(error), *getattr(error, "__notes__", ())])
        _fail(words, 2 if isinstance(error, ArgumentError) else 1)
    except KeyboardInterrupt:
        _fail("stopped; nothing was written", 130)
    sys.exit(0)


def say(line: str) -> None:
    """One line of the output, as it is."""
    _output.print(line, markup=False, soft_wrap=True)


def _fail(message: str, code: int) -> None:
    _errors.print(f"isovary: {message}", markup=False, soft_wrap=True)
    sys.exit(code)


@contextmanager
def progress() -> Iterator[Callable[[str, float], None]]:
    """A bar with the stage and the time left on a terminal, a line a stage elsewhere."""
    if not _errors.is_terminal:
        yield lambda stage, done: _errors.print(f"{done:4.0%}  {stage}")
        return
    columns = (
        BarColumn(),
        TextColumn("{task.percentage:3.0f}%  {task.description}"),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=_errors, transient=True) as bar:
        task = bar.add_task("starting", total=1.0)
        yield lambda stage, done: bar.update(task, description=stage, completed=done)
