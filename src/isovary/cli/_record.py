"""What a result says of the command that made it: the files that went in, and how to repeat it."""

from __future__ import annotations

import inspect
import shlex
from collections.abc import Callable, Mapping, Sequence
from hashlib import file_digest
from pathlib import Path


def file_facts(path: Path, array: str) -> dict[str, str]:
    """Where a file lies, which of its arrays was read, and the digest of the whole file.

    Parameters
    ----------
    path : path
    array : str

    Returns
    -------
    dict
        ``path``, ``array`` and ``sha256``, as ``sha256sum`` prints it.
    """
    with path.open("rb") as file:
        digest = file_digest(file, "sha256").hexdigest()
    return {"path": str(path.resolve()), "array": array, "sha256": digest}


def command_line(name: str, function: Callable[..., object], given: Mapping[str, object]) -> str:
    """The words that call a command again from any folder, without its defaults.

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
        elif value != argument.default:
            words += _option(argument.name.replace("_", "-"), value)
    return shlex.join(words)


def _option(name: str, value: object) -> list[str]:
    if isinstance(value, bool):
        return [f"--{name}" if value else f"--no-{name}"]
    values = value if isinstance(value, Sequence) and not isinstance(value, str) else [value]
    if values and isinstance(values[0], Sequence) and not isinstance(values[0], str):
        return [word for part in values for word in _option(name, part)]
    return [f"--{name}", *map(_word, values)]


def _word(value: object) -> str:
    return str(value.resolve()) if isinstance(value, Path) else str(value)
