"""``isovary thesis``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from ..errors import ArgumentError
from ..io._atomic import check_output, write_folder
from ._app import app, progress, say

if TYPE_CHECKING:
    from ..thesis import Experiment, Outcome

_OUT = Path("isovary-thesis")


@app.command(name="thesis")
def thesis_figures(
    *figures: str,
    out: Annotated[Path, Parameter(name=["--out", "-o"])] = _OUT,
    small: bool = False,
) -> None:
    """Check the thesis: list its experiments, or run some and draw their figures.

    Ctrl-C ends it after the figures that are finished: these are kept.

    Parameters
    ----------
    figures
        Numbers of figures, such as 4.11, or of a section, 4.1.5; or all. Without any, a list is
        printed, with about how long each takes.
    out
        Folder for the figures and gallery.md; an earlier result in it is replaced.
    small
        Coarse meshes and few eigenpairs: seconds instead of minutes, and not for quoting.
    """
    from ..thesis import experiment, experiments
    from ..thesis._gallery import COARSE, make_gallery

    if not figures:
        if small or out != _OUT:
            raise ArgumentError(
                "A02", "figures: expected numbers, or all, beside --small or --out, got none"
            )
        _list()
        return
    if "all" in figures and len(figures) > 1:
        raise ArgumentError("A02", f"figures: expected all alone, got {' '.join(figures)}")
    chosen = experiments() if figures == ("all",) else [experiment(number) for number in figures]
    chosen = list(dict.fromkeys(chosen))
    check_output(out)
    with progress() as tell, write_folder(out) as folder:
        outcomes = make_gallery(chosen, folder, small=small, tell=tell)
    _say_verdicts(chosen, outcomes)
    if small:
        say(COARSE)
    if len(outcomes) < len(chosen):
        left = " ".join(found.number for found in chosen[len(outcomes) :])
        say(f"stopped: {len(outcomes)} of {len(chosen)} figures are kept, left out: {left}")
    say(f"open            {out / 'gallery.md'}")


def _list() -> None:
    from ..thesis import experiments
    from ..thesis._register import expected_seconds

    for found in experiments():
        say(f"{found.listed:<24} {found.title:<56} {expected_seconds(found):>4.0f} s")
    say("run some with   isovary thesis 4.3 5.1 -o OUT, everything with   isovary thesis all")
    say("a coarse look   --small, 2 to 12 s each: not for quoting")


def _say_verdicts(chosen: Sequence[Experiment], outcomes: Sequence[Outcome]) -> None:
    """A line for each claim; the measured numbers are in the page."""
    from ..thesis._gallery import SIGNS

    for found, outcome in zip(chosen, outcomes, strict=False):
        say(f"{found.heading}: {found.title}")
        for finding in outcome.findings:
            say(f"  {SIGNS[finding.verdict]:<30}{finding.claim}")
