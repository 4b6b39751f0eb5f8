"""All experiments in one page: each figure with its claims, measurements and verdicts."""

from __future__ import annotations

import shlex
import time
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path

from matplotlib.figure import Figure

from .. import __version__
from ..io._writing import write_summary
from ._records import Experiment, Outcome, Verdict
from ._register import expected_seconds, settings_of

COARSE = "coarse run (--small): not for quoting"

SIGNS = {
    Verdict.CONFIRMED: "✔ confirmed",
    Verdict.IN_PART: "◐ confirmed in part",
    Verdict.REFUTED: "✘ refuted",
    Verdict.OPEN: "? not decidable from the text",
}


def picture_name(experiment: Experiment) -> str:
    """Of the file with its figure."""
    return f"figure-{experiment.number}.png"


def make_gallery(
    chosen: Sequence[Experiment],
    folder: Path,
    *,
    small: bool = False,
    tell: Callable[[str, float], None] | None = None,
) -> list[Outcome]:
    """Run experiments one after another, draw their figures, and write ``gallery.md`` beside them.

    ``summary.json`` has the settings, numbers and verdicts of each, and the versions. When the
    user interrupts, what is finished is written; nothing finished, the interrupt goes on.

    Parameters
    ----------
    chosen : sequence of Experiment
    folder : path
        Exists.
    small : bool
        With the small settings; pictures, page and summary say so.
    tell : callable, optional
        Called with the experiment at work and the part done.

    Returns
    -------
    list of Outcome
        Of the experiments that were finished, in their order.
    """
    outcomes: list[Outcome] = []
    seconds: list[float] = []
    try:
        for place, experiment in enumerate(chosen):
            if tell:
                about = expected_seconds(experiment, small=small)
                words = f"{place + 1} of {len(chosen)}, about {about:.0f} s"
                tell(f"{experiment.heading}: {experiment.title} ({words})", place / len(chosen))
            start = time.perf_counter()
            outcome = experiment.run(settings_of(experiment, small=small))
            if small:
                _mark_coarse(outcome.figure)
            outcome.figure.savefig(folder / picture_name(experiment))
            outcomes.append(outcome)
            seconds.append(time.perf_counter() - start)
    except KeyboardInterrupt:
        if not seconds:
            raise
        del outcomes[len(seconds) :]
    _write(chosen[: len(seconds)], outcomes, seconds, folder, small)
    return outcomes


def _mark_coarse(figure: Figure) -> None:
    """Say in the picture that its numbers are not to be quoted."""
    top = 1 - 0.03 / figure.get_size_inches()[1]
    figure.text(0.98, top, COARSE, size=8.5, weight="bold", color="#b2182b", ha="right", va="top")


def _write(
    chosen: Sequence[Experiment],
    outcomes: Sequence[Outcome],
    seconds: Sequence[float],
    folder: Path,
    small: bool,
) -> None:
    """The page and the summary of what is finished."""
    page = gallery(chosen, outcomes, seconds, small=small)
    (folder / "gallery.md").write_text(page, encoding="utf-8")
    records = {
        experiment.number: {
            "title": experiment.title,
            "settings": settings_of(experiment, small=small),
            "findings": [asdict(finding) for finding in outcome.findings],
            "seconds": round(spent, 3),
        }
        for experiment, outcome, spent in zip(chosen, outcomes, seconds, strict=True)
    }
    coarse = {"coarse": small, "note": COARSE if small else None}
    write_summary(coarse | {"experiments": records}, folder)


def gallery(
    chosen: Sequence[Experiment],
    outcomes: Sequence[Outcome],
    seconds: Sequence[float],
    *,
    small: bool = False,
) -> str:
    """The page in Markdown: a table of all claims, then each figure with its own."""
    findings = [finding for outcome in outcomes for finding in outcome.findings]
    counts = Counter(finding.verdict for finding in findings)
    said = ", ".join(f"{counts[verdict]} {verdict.value}" for verdict in Verdict if counts[verdict])
    table = "\n".join(
        f"| [{experiment.short}](#figure-{experiment.number.replace('.', '-')}) "
        f"| {finding.claim} | {finding.measured} | {SIGNS[finding.verdict]} |"
        for experiment, outcome in zip(chosen, outcomes, strict=True)
        for finding in outcome.findings
    )
    parts = "\n".join(_part(*entry) for entry in zip(chosen, outcomes, seconds, strict=True))
    return (
        f"{_intro(chosen, small)}"
        f"{len(findings)} claims: {said}.\n\n"
        "| figure | the thesis says | measured here | verdict |\n| --- | --- | --- | --- |\n"
        f"{table}\n{parts}"
    )


def _intro(chosen: Sequence[Experiment], small: bool) -> str:
    """Title, what the page is, and what made it when."""
    words = ["isovary", "thesis", *(experiment.number for experiment in chosen)]
    command = shlex.join([*words, "--small"] if small else words)
    warning = f"**{COARSE[0].upper()}{COARSE[1:]}.**\n\n" if small else ""
    return (
        f"# The thesis, checked\n\n{warning}"
        "What N. Saquib's thesis *Visualizing Intrinsic Isosurface Variation Due to Uncertainty "
        "Through Heat Kernel Signatures* (University of Utah, 2013) claims, what is measured of "
        "it here, and what follows from that: a claim is confirmed, confirmed in part, refuted, "
        "or cannot be decided from the text.\n\n"
        f"Made by isovary {__version__} on {datetime.now(UTC):%Y-%m-%d} with `{command}`.\n\n"
    )


def _part(experiment: Experiment, outcome: Outcome, seconds: float) -> str:
    also = f" (with {', '.join(experiment.also)})" if experiment.also else ""
    lines = "\n".join(_lines(outcome))
    return (
        f"\n(figure-{experiment.number.replace('.', '-')})=\n"
        f"## {experiment.heading}{also}: {experiment.title}\n\n"
        f"![{experiment.title}]({picture_name(experiment)})\n\n{lines}\n\n{seconds:.0f} s\n"
    )


def _lines(outcome: Outcome) -> Iterable[str]:
    for finding in outcome.findings:
        yield (
            f"- **{SIGNS[finding.verdict]}** ({finding.where}): *{finding.claim}.* "
            f"{finding.measured}"
        )
