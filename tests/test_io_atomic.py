"""Result folders are whole or not there."""

from __future__ import annotations

import errno
import os
import signal
import stat
from pathlib import Path

import pytest

from isovary.errors import RunError
from isovary.io import _atomic
from isovary.io._atomic import write_folder

SUMMARY = '{"isovary": "0.1"}'


def _write(out: Path, text: str) -> None:
    with write_folder(out) as folder:
        (folder / "sub").mkdir()
        (folder / "sub" / "change.txt").write_text(text)
        (folder / "summary.json").write_text(SUMMARY)


def _names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_new_folder_appears_whole(tmp_path: Path) -> None:
    """Oracle: algebra. What was written is what stands there, and nothing else does."""
    with write_folder(tmp_path / "deep" / "out") as folder:
        assert folder.parent == tmp_path / "deep"
        assert not (tmp_path / "deep" / "out").exists()
        (folder / "summary.json").write_text(SUMMARY)
    assert _names(tmp_path / "deep") == ["out"]
    assert (tmp_path / "deep" / "out" / "summary.json").read_text() == SUMMARY


def test_permissions_follow_the_umask(tmp_path: Path) -> None:
    """Oracle: peer. The folder has the rights that a plain mkdir gives."""
    (tmp_path / "plain").mkdir()
    _write(tmp_path / "out", "x")
    modes = [stat.S_IMODE((tmp_path / name).stat().st_mode) for name in ("plain", "out")]
    assert modes[0] == modes[1]


def test_older_result_is_replaced(tmp_path: Path) -> None:
    """Oracle: algebra. The second result stands alone: no file of the first survives."""
    _write(tmp_path / "out", "first")
    (tmp_path / "out" / "stale.txt").write_text("stale")
    _write(tmp_path / "out", "second")
    assert _names(tmp_path) == ["out"]
    assert _names(tmp_path / "out") == ["sub", "summary.json"]
    assert (tmp_path / "out" / "sub" / "change.txt").read_text() == "second"


def test_empty_folder_and_symlink_are_replaced(tmp_path: Path) -> None:
    """Oracle: algebra. An empty folder is filled through a link, and the link stays."""
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "real")
    _write(tmp_path / "link", "x")
    assert (tmp_path / "link").is_symlink()
    assert _names(tmp_path / "real") == ["sub", "summary.json"]


@pytest.mark.parametrize("error", [ValueError("no"), KeyboardInterrupt()])
def test_exception_leaves_the_old_result(tmp_path: Path, error: BaseException) -> None:
    """Oracle: algebra. After a fault the parent folder is as it was before."""
    _write(tmp_path / "out", "first")
    with pytest.raises(type(error)), write_folder(tmp_path / "out") as folder:  # noqa: PT012
        (folder / "summary.json").write_text(SUMMARY)
        raise error
    assert _names(tmp_path) == ["out"]
    assert (tmp_path / "out" / "sub" / "change.txt").read_text() == "first"


@pytest.mark.parametrize(
    ("name", "text"),
    [("thesis.txt", "mine"), ("summary.json", '{"other": 1}'), ("summary.json", '{"isov')],
)
def test_foreign_folder_is_kept(tmp_path: Path, name: str, text: str) -> None:
    """Oracle: algebra. A folder of somebody else is refused at the start, untouched."""
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / name).write_text(text)
    with (
        pytest.raises(RunError, match="expected a new or empty folder") as caught,
        write_folder(tmp_path / "out"),
    ):
        pytest.fail("the body must not run")
    assert caught.value.code == "W02"
    assert (tmp_path / "out" / name).read_text() == text
    assert _names(tmp_path) == ["out"]


def test_file_and_current_folder_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Oracle: algebra. Neither a file nor the folder one stands in is swapped away."""
    (tmp_path / "out").write_text("a file")
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    for out, text in ((tmp_path / "out", "did not write"), (Path("."), "the current folder")):
        with pytest.raises(RunError, match=text) as caught, write_folder(out):
            pytest.fail("the body must not run")
        assert caught.value.code == "W02"


def test_folder_filled_meanwhile_keeps_both(tmp_path: Path) -> None:
    """Oracle: algebra. A finished result is never lost, nor is what appeared in its place."""
    with (  # noqa: PT012
        pytest.raises(RunError, match="new result is kept in") as caught,
        write_folder(tmp_path / "out") as folder,
    ):
        (folder / "summary.json").write_text(SUMMARY)
        (tmp_path / "out").mkdir()
        (tmp_path / "out" / "mine.txt").write_text("mine")
    assert caught.value.code == "W02"
    assert (tmp_path / "out" / "mine.txt").read_text() == "mine"
    assert (folder / "summary.json").read_text() == SUMMARY


@pytest.mark.parametrize("failing", [0, 1])
def test_failed_rename_restores_the_old_result(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failing: int
) -> None:
    """Oracle: algebra. Whichever rename fails, the old result stands and the new one is kept."""
    _write(tmp_path / "out", "first")
    rename, calls = Path.rename, []

    def broken(self: Path, target: Path) -> Path:
        calls.append(self.name)
        if len(calls) == failing + 1:
            raise OSError(errno.EIO, "input/output error")
        return rename(self, target)

    monkeypatch.setattr(Path, "rename", broken)
    with pytest.raises(RunError, match="input/output error") as caught:
        _write(tmp_path / "out", "second")
    assert caught.value.code == "W07"
    assert (tmp_path / "out" / "sub" / "change.txt").read_text() == "first"
    (kept,) = tmp_path.glob(".out.*.part")
    assert (kept / "sub" / "change.txt").read_text() == "second"


@pytest.mark.parametrize(
    ("method", "call", "left"),
    [("mkdir", 0, "first"), ("rename", 0, "first"), ("rename", 1, "second")],
)
def test_a_stop_right_after_a_step_leaves_one_result(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, method: str, call: int, left: str
) -> None:
    """Oracle: algebra. SIGTERM may arrive as soon as a folder is made or moved."""
    _write(tmp_path / "out", "first")
    real, calls = getattr(Path, method), []

    def stopped(self: Path, *given: object, **options: object) -> None:
        real(self, *given, **options)
        if self.name.endswith(".part") or method == "rename":
            calls.append(self.name)
            if len(calls) == call + 1:
                raise SystemExit(143)

    monkeypatch.setattr(Path, method, stopped)
    with pytest.raises(SystemExit):
        _write(tmp_path / "out", "second")
    assert _names(tmp_path) == ["out"]
    assert (tmp_path / "out" / "sub" / "change.txt").read_text() == left


def test_full_disk_has_its_code(tmp_path: Path) -> None:
    """Oracle: algebra. ENOSPC in the body becomes W06 and leaves nothing behind."""
    with pytest.raises(RunError, match="No space left") as caught, write_folder(tmp_path / "out"):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    assert caught.value.code == "W06"
    assert _names(tmp_path) == []


def test_unwritable_parent_fails_at_the_start(tmp_path: Path) -> None:
    """Oracle: algebra. A parent that is a file cannot take a folder, whoever runs the test."""
    (tmp_path / "file").write_text("")
    with pytest.raises(RunError) as caught, write_folder(tmp_path / "file" / "out"):
        pytest.fail("the body must not run")
    assert caught.value.code == "W07"


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="rights do not bind root")
def test_read_only_parent_fails_at_the_start(tmp_path: Path) -> None:
    """Oracle: algebra. Without the right to write there is an error before any work."""
    tmp_path.chmod(0o500)
    try:
        with pytest.raises(RunError, match="ermission") as caught, write_folder(tmp_path / "out"):
            pytest.fail("the body must not run")
    finally:
        tmp_path.chmod(0o700)
    assert caught.value.code == "W07"


def test_everything_is_synced_before_the_move(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Oracle: algebra. Two files, two folders and the parent: five syncs, the parent's last."""
    synced: list[int] = []
    monkeypatch.setattr(os, "fsync", lambda fd: synced.append(os.fstat(fd).st_ino))
    _write(tmp_path / "out", "x")
    assert len(synced) == 5
    assert synced[-1] == tmp_path.stat().st_ino
    assert (tmp_path / "out" / "sub" / "change.txt").stat().st_ino in synced


def test_a_stop_before_the_move_leaves_the_old_result(tmp_path, monkeypatch):
    """Oracle: algebra. Between the last check of the place and the first rename."""
    _write(tmp_path / "out", "first")
    real = _atomic._check_replaceable

    def stopped(target: Path, kept: str = "") -> None:
        real(target, kept)
        if kept:
            raise SystemExit(143)

    monkeypatch.setattr(_atomic, "_check_replaceable", stopped)
    with pytest.raises(SystemExit):
        _write(tmp_path / "out", "second")
    assert _names(tmp_path) == ["out"]
    assert (tmp_path / "out" / "sub" / "change.txt").read_text() == "first"


def test_what_appears_between_the_renames_costs_no_result(tmp_path, monkeypatch):
    """Oracle: algebra. The new result is kept under its own name, and so is the old one."""
    _write(tmp_path / "out", "first")
    rename = Path.rename

    def overtaken(self: Path, target: Path) -> Path:
        if self.suffix == ".part":
            target.mkdir()
            (target / "mine.txt").write_text("mine")
        return rename(self, target)

    monkeypatch.setattr(Path, "rename", overtaken)
    with pytest.raises(RunError) as caught:
        _write(tmp_path / "out", "second")
    assert caught.value.code == "W07"
    texts = {path.read_text() for path in tmp_path.rglob("change.txt")}
    assert texts == {"first", "second"}
    assert (tmp_path / "out" / "mine.txt").read_text() == "mine"


def test_a_stop_is_heard_once(monkeypatch):
    """Oracle: definition. From the first signal on, neither it nor Ctrl-C stops the cleaning up."""
    ignored = {}
    monkeypatch.setattr(signal, "signal", ignored.__setitem__)
    with pytest.raises(SystemExit) as caught:
        _atomic.stop(signal.SIGTERM, None)
    assert caught.value.code == 128 + signal.SIGTERM
    assert ignored == dict.fromkeys((signal.SIGTERM, signal.SIGINT), signal.SIG_IGN)
