"""All experiments in one page: each figure with its claims, measurements and verdicts."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict
from pathlib import Path

from ..io._writing import write_summary
from ._records import Experiment, Outcome, Verdict
from ._register import settings_of

_SIGNS = {
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
) -> Path:
    """Run experiments one after another, draw their figures, and write ``gallery.md`` beside them.

    ``summary.json`` has the settings, numbers and verdicts of each, and the versions.

    Parameters
    ----------
    chosen : sequence of Experiment
    folder : path
        Exists.
    small : bool
        With the small settings.
    tell : callable, optional
        Called with the experiment at work and the part done.

    Returns
    -------
    path
        Of the page.
    """
    outcomes, seconds = [], []
    for place, experiment in enumerate(chosen):
        if tell:
            tell(f"figure {experiment.number}: {experiment.title}", place / len(chosen))
        start = time.perf_counter()
        outcome = experiment.run(settings_of(experiment, small=small))
        outcome.figure.savefig(folder / picture_name(experiment))
        outcomes.append(outcome)
        seconds.append(time.perf_counter() - start)
    page = folder / "gallery.md"
    page.write_text(gallery(chosen, outcomes, seconds), encoding="utf-8")
    records = {
        experiment.number: {
            "title": experiment.title,
            "settings": settings_of(experiment, small=small),
            "findings": [asdict(finding) for finding in outcome.findings],
            "seconds": round(spent, 3),
        }
        for experiment, outcome, spent in zip(chosen, outcomes, seconds, strict=True)
    }
    write_summary({"experiments": records}, folder)
    return page


def gallery(
    chosen: Sequence[Experiment], outcomes: Sequence[Outcome], seconds: Sequence[float]
) -> str:
    """The page in Markdown: a table of all claims, then each figure with its own."""
    findings = [finding for outcome in outcomes for finding in outcome.findings]
    counts = Counter(finding.verdict for finding in findings)
    said = ", ".join(f"{counts[verdict]} {verdict.value}" for verdict in Verdict if counts[verdict])
    table = "\n".join(
        f"| [{experiment.number}](#figure-{experiment.number.replace('.', '-')}) "
        f"| {finding.claim} | {finding.measured} | {_SIGNS[finding.verdict]} |"
        for experiment, outcome in zip(chosen, outcomes, strict=True)
        for finding in outcome.findings
    )
    parts = "\n".join(_part(*entry) for entry in zip(chosen, outcomes, seconds, strict=True))
    return (
        "# The thesis, checked\n\n"
        f"{len(findings)} claims: {said}.\n\n"
        "| figure | the thesis says | measured here | verdict |\n| --- | --- | --- | --- |\n"
        f"{table}\n{parts}"
    )


def _part(experiment: Experiment, outcome: Outcome, seconds: float) -> str:
    also = f" (with {', '.join(experiment.also)})" if experiment.also else ""
    lines = "\n".join(_lines(outcome))
    return (
        f"\n(figure-{experiment.number.replace('.', '-')})=\n"
        f"## {experiment.number}{also}: {experiment.title}\n\n"
        f"![{experiment.title}]({picture_name(experiment)})\n\n{lines}\n\n{seconds:.0f} s\n"
    )


def _lines(outcome: Outcome) -> Iterable[str]:
    for finding in outcome.findings:
        yield (
            f"- **{_SIGNS[finding.verdict]}** ({finding.where}): *{finding.claim}.* "
            f"{finding.measured}"
        )
