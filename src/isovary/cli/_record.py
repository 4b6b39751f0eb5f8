"""What a result says of the command that made it: the files that went in, and how to repeat it."""

from __future__ import annotations

import inspect
import os
import shlex
from collections.abc import Callable, Mapping, Sequence
from hashlib import file_digest
from pathlib import Path


def file_facts(path: Path, array: str) -> dict[str, str]:
    """Where a file lies, the name of the field in it, and the digest of the whole file.

    Parameters
    ----------
    path : path
    array : str
        Of an ``.npy`` file, which has none, its own name.

    Returns
    -------
    dict
        ``path``, ``array`` and ``sha256``, as ``sha256sum`` prints it.
    """
    with path.open("rb") as file:
        digest = file_digest(file, "sha256").hexdigest()
    return {"path": str(path.resolve()), "array": array, "sha256": digest}


def another(out: Path) -> Path:
    """A folder beside the given one, so that a repeated run does not replace the first."""
    return out.with_name(out.name + "-again")


def command_line(name: str, function: Callable[..., object], given: Mapping[str, object]) -> str:
    """The words that call a command again from any folder, without the defaults of this version.

    Parameters
    ----------
    name : str
        Of the command.
    function : callable
        What it calls: positional-only arguments are words, all others options.
    given : mapping
        The value of each argument.

    Returns
    -------
    str
        For a POSIX shell.

    Examples
    --------
    >>> def mesh(field: Path, /, *, order: int = 2, align: bool = True): ...
    >>> command_line("mesh", mesh, {"field": Path("/a b.vti"), "order": 1, "align": False})
    "isovary mesh '/a b.vti' --order 1 --no-align"
    """
    words = ["isovary", name]
    for argument in inspect.signature(function).parameters.values():
        value = given[argument.name]
        if argument.kind is argument.POSITIONAL_ONLY:
            words.append(_word(value))
        elif value != argument.default or isinstance(value, Path):
            words += _option(argument.name.replace("_", "-"), value)
    return shlex.join(words)


def _option(name: str, value: object) -> list[str]:
    if isinstance(value, bool):
        return [f"--{name}" if value else f"--no-{name}"]
    values = value if isinstance(value, Sequence) and not isinstance(value, str) else [value]
    if values and isinstance(values[0], Sequence) and not isinstance(values[0], str):
        return [word for part in values for word in _option(name, part)]
    words = [_word(part) for part in values]
    if isinstance(value, str) and value.startswith("-"):
        return [f"--{name}={value}"]
    return [f"--{name}", *words]


def _word(value: object) -> str:
    return os.path.abspath(value) if isinstance(value, Path) else str(value)
