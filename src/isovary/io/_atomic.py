"""Result folders that are whole or not there."""

from __future__ import annotations

import errno
import json
import os
import secrets
import shutil
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ..errors import RunError

_FULL = (errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC), errno.EFBIG)


@contextmanager
def write_folder(out: str | os.PathLike[str]) -> Iterator[Path]:
    """Write a folder beside its place and move it there when it is whole.

    The body writes into a temporary sibling folder. On a clean exit it is
    synced to disk and renamed to ``out``; an older result is first renamed aside
    and deleted last. On an exception the temporary folder is removed and
    ``out`` stays as it was. Write ``summary.json``, with a key ``"isovary"``, last:
    it marks the folder as one that a later run may replace.

    Parameters
    ----------
    out : path
        Folder to make; missing parents are made too. An existing one is replaced
        only if it is empty or was written by isovary.

    Yields
    ------
    Path
        The temporary folder.

    Raises
    ------
    RunError
        W02 if ``out`` holds something else (checked at the start and again before
        the move, where the new folder is kept under the name in the message), W06
        if the disk is full, W07 if the parent cannot be written (at the start).

    Notes
    -----
    Cost: one fsync a file. A kill between the two renames leaves both
    folders whole, as hidden siblings ``.OUT.*.old`` and ``.OUT.*.part``.

    Examples
    --------
    >>> import tempfile
    >>> parent = Path(tempfile.mkdtemp())
    >>> with write_folder(parent / "out") as folder:
    ...     _ = (folder / "summary.json").write_text('{"isovary": "0.1"}')
    >>> [path.name for path in parent.iterdir()]
    ['out']
    """
    target = check_output(out)
    token = secrets.token_hex(6)
    temporary = target.parent / f".{target.name}.{token}.part"
    moving = False
    try:
        _make(temporary)
        yield temporary
        _sync(temporary)
        moving = True
        _move(temporary, target, target.parent / f".{target.name}.{token}.old")
    except BaseException as error:  # also SystemExit, wherever it comes
        if moving and isinstance(error, RunError):
            raise  # it names the folder that is kept
        shutil.rmtree(temporary, ignore_errors=True)
        if isinstance(error, OSError) and error.errno in _FULL:
            raise RunError(
                "W06", f"{target}: expected room on the disk, got: {error.strerror}; free some"
            ) from error
        raise


def stop(number: int, _frame: object) -> None:
    """End as SystemExit, so that half-written folders go away: a handler of SIGTERM.

    Parameters
    ----------
    number : int
        The signal's number. It and Ctrl-C are ignored from then on, while things are cleaned up.
    """
    for ignored in (number, signal.SIGINT):
        signal.signal(ignored, signal.SIG_IGN)
    sys.exit(128 + number)


def check_output(out: str | os.PathLike[str]) -> Path:
    """The absolute path of a result folder, if results may go there; to be asked before the work.

    Parameters
    ----------
    out : path

    Returns
    -------
    Path

    Raises
    ------
    RunError
        W02 if the folder holds something else, W07 if its parent cannot be written.
    """
    target = Path(out).resolve()
    _check_replaceable(target)
    parent = next(folder for folder in target.parents if folder.exists())
    if not parent.is_dir() or not os.access(parent, os.W_OK):
        raise RunError(
            "W07",
            f"{parent}: expected a folder that can be written, got one that cannot; "
            "name another one or change its rights",
        )
    return target


def _check_replaceable(target: Path, kept: str = "") -> None:
    if not os.path.exists(target) or (_is_ours(target) and target != Path.cwd()):
        return
    got = "the current folder" if target == Path.cwd() else "something isovary did not write"
    raise RunError(
        "W02",
        f"{target}: expected a new or empty folder, or an earlier result, got {got}; "
        f"name another one or move it away{kept}",
    )


def _is_ours(target: Path) -> bool:
    try:
        if not any(target.iterdir()):
            return True
        summary = json.loads((target / "summary.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    return isinstance(summary, dict) and "isovary" in summary


def _make(folder: Path) -> None:
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        folder.mkdir()
    except OSError as error:
        raise RunError(
            "W07",
            f"{folder.parent}: expected a folder that can be written, got: {error.strerror}; "
            "name another one or change its rights",
        ) from None


def _sync(folder: Path) -> None:
    """Force every file, and where the system allows it every folder, onto the disk."""
    for root, _, names in os.walk(folder):
        for name in names:
            with (Path(root) / name).open("rb+") as stream:
                os.fsync(stream.fileno())
        _sync_entries(Path(root))


def _sync_entries(folder: Path) -> None:
    if os.name == "nt":  # Windows cannot sync a folder
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _move(temporary: Path, target: Path, aside: Path) -> None:
    kept = f"; the new result is kept in {temporary}"
    _check_replaceable(target, kept)
    try:
        if target.exists():
            target.rename(aside)
        temporary.rename(target)
    except OSError as error:
        raise RunError(
            "W07", f"{target}: expected to move the result there, got: {error.strerror}{kept}"
        ) from None
    finally:
        if temporary.exists():  # it did not arrive
            if aside.exists() and not target.exists():
                aside.rename(target)
        else:
            _sync_entries(target.parent)
            shutil.rmtree(aside, ignore_errors=True)
