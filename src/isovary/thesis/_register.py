"""Experiments and their settings, found by the names of their files."""

from __future__ import annotations

import re
import tomllib
from difflib import get_close_matches
from functools import cache
from importlib import import_module
from importlib.resources import files

from ..errors import ArgumentError
from ._records import Experiment, Settings

_PREFIX = re.compile(r"^(fig(ure)?|sec(tion)?)\W*", re.IGNORECASE)


def experiments() -> tuple[Experiment, ...]:
    """All experiments, in the thesis's order."""
    return tuple(_found())


@cache
def _found() -> tuple[Experiment, ...]:
    names = [file.name for file in files(__package__).iterdir()]
    modules = sorted(name[1:-3] for name in names if name.startswith("_fig_"))
    found = [import_module(f"{__package__}._{module}").EXPERIMENT for module in modules]
    return tuple(sorted(found, key=lambda e: _order(e.number)))


def _order(number: str) -> list[int]:
    return [int(part) for part in number.split(".")]


def experiment(number: str) -> Experiment:
    """The experiment of a figure.

    Parameters
    ----------
    number : str
        For example ``4.12``, which is shown together with 4.11; ``fig4.12`` and ``Figure 4.12``
        are the same.

    Raises
    ------
    ArgumentError
        A02 if there is none.
    """
    plain = _PREFIX.sub("", number.strip())
    for found in _found():
        if plain in (found.number, *found.also):
            return found
    known = [name for e in _found() for name in (e.number, *e.also)]
    close = [name for name in known if name.startswith(f"{plain.rstrip('.')}.")]
    close = close or get_close_matches(plain, known, 3, 0.6)
    meant = f"; did you mean {' or '.join(close)}? `" if close else "; `"
    raise ArgumentError(
        "A02",
        f"figure: expected one of {', '.join(known)}, got {number}{meant}isovary thesis` lists "
        "them with their titles",
    )


@cache
def _seconds() -> dict[str, dict[str, float]]:
    return tomllib.loads(files(__package__).joinpath("seconds.toml").read_text("utf-8"))


def expected_seconds(chosen: Experiment, *, small: bool = False) -> float:
    """About how long an experiment takes, measured once on one core of a shared machine."""
    return _seconds()["small" if small else "full"].get(chosen.number, float("nan"))


def settings_of(chosen: Experiment, *, small: bool = False) -> Settings:
    """The numbers of an experiment: ``[full]`` of its file, with those of ``[small]`` over them.

    Parameters
    ----------
    chosen : Experiment
    small : bool
        Coarse meshes and few pairs, for a look and for the tests.
    """
    name = f"fig_{chosen.number.replace('.', '_')}.toml"
    read = tomllib.loads(files(__package__).joinpath(name).read_text("utf-8"))
    settings: Settings = {**read["full"], **(read["small"] if small else {})}
    return settings
