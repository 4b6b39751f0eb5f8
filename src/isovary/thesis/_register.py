"""Experiments and their settings, found by the names of their files."""

from __future__ import annotations

import tomllib
from functools import cache
from importlib import import_module
from importlib.resources import files

from ..errors import ArgumentError
from ._records import Experiment, Settings


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
        For example ``4.12``, which is shown together with 4.11.

    Raises
    ------
    ArgumentError
        A02 if there is none.
    """
    for found in _found():
        if number in (found.number, *found.also):
            return found
    known = ", ".join(number for e in _found() for number in (e.number, *e.also))
    raise ArgumentError("A02", f"figure: expected one of {known}, got {number}")


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
