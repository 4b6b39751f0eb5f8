"""What a planted fault is."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Fault:
    """One line made wrong: what is wrong, where, the text before and after, tests to run."""

    what: str
    file: str
    before: str
    after: str
    tests: tuple[str, ...]
