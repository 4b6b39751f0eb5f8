"""What an experiment is, and what it finds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from matplotlib.figure import Figure

Settings = Mapping[str, Any]
"""The numbers of an experiment, by name: its TOML file."""


class Verdict(StrEnum):
    """What the numbers say of a claim."""

    CONFIRMED = "confirmed"
    IN_PART = "confirmed in part"
    REFUTED = "refuted"
    OPEN = "not decidable from the text"


@dataclass(frozen=True)
class Finding:
    """A claim of the thesis, and what is measured of it.

    Parameters
    ----------
    claim : str
        What the thesis says, in a sentence that can be true or false.
    where : str
        Its section or figure.
    measured : str
        What is found here, in a sentence with its numbers and units.
    verdict : Verdict
    numbers : mapping
        The numbers that decide, by name: what tests assert.
    """

    claim: str
    where: str
    measured: str
    verdict: Verdict
    numbers: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Outcome:
    """Findings and the figure that shows them.

    Parameters
    ----------
    findings : tuple of Finding
        At least one.
    figure : matplotlib.figure.Figure
        Belongs to no window.
    """

    findings: tuple[Finding, ...]
    figure: Figure


@dataclass(frozen=True)
class Experiment:
    """One figure, or figures that belong together.

    Parameters
    ----------
    number : str
        The figure's, ``4.3``, or the section's if it has no figure, ``4.1.5``.
    title : str
        What is looked at.
    run : callable
        Settings -> Outcome; chance only from ``settings["seed"]``.
    also : tuple of str
        Further figures that it shows.
    """

    number: str
    title: str
    run: Callable[[Settings], Outcome]
    also: tuple[str, ...] = ()

    @property
    def heading(self) -> str:
        """``Figure 4.3`` or ``Section 4.1.5``."""
        return headed(self.number)

    @property
    def short(self) -> str:
        """``4.3`` or ``Section 4.1.5``: figures are not called so in a list of them."""
        return self.heading.removeprefix("Figure ")

    @property
    def listed(self) -> str:
        """All its numbers: ``4.11, 4.12`` or ``Section 4.1.5``."""
        return ", ".join((self.short, *self.also))


def headed(numbers: str) -> str:
    """Numbers as in ``4.13 to 4.16`` after what they number: three parts are a section's."""
    kind = "Section" if numbers.split()[0].count(".") == 2 else "Figure"
    return f"{kind} {numbers}"
