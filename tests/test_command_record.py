"""What a result says of the command that made it: enough to make it again."""

from __future__ import annotations

import os
import shlex
import signal
import subprocess
import sys
import time
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest
from conftest import ELLIPSOID_ISOVALUE, ellipsoid_field

from isovary.cli import app, compare_files, mesh_file
from isovary.cli._record import command_line, file_facts

COMPARE = [
    "'a b.vti' b.vti --isovalue 0.05 -o out",
    "a.vti 'it''s.vti' --isovalue -2e-7 -o out --no-align --area-weighted --groups auto",
    "a.npy b.npy --isovalue 1 -o o --spacing 0.1 0.2 0.3 --origin -1 -1e-3 0 --accuracy 5%",
    "a.vti b.vti --isovalue 1 -o o --array s[3] --through m1.vti m2.vti --order 1 --groups 5",
]


def given(words: list[str]) -> dict[str, object]:
    """What the application hands to the command, files by their whole paths."""
    _, bound, _ = app.parse_args(words, exit_on_error=False, print_error=False)
    bound.apply_defaults()

    def whole(value):
        if isinstance(value, list | tuple):
            return [whole(part) for part in value]
        return value.resolve() if isinstance(value, Path) else value

    return {name: whole(value) for name, value in bound.arguments.items()}


@pytest.mark.parametrize("text", COMPARE)
def test_the_recorded_command_says_the_same(text, tmp_path, monkeypatch):
    """Oracle: algebra. Read again, in another folder, it gives the same arguments."""
    monkeypatch.chdir(tmp_path)
    first = given(["compare", *shlex.split(text)])
    again = shlex.split(command_line("compare", compare_files, first))
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert again[0] == "isovary"
    assert given(again[1:]) == first
    assert "--pairs" not in again  # a default


def test_words_that_look_like_options():
    """Oracle: algebra. An array called -x is no option."""
    words = ["compare", "a.vti", "b.vti", "--isovalue", "1", "-o", "o", "--array=-x"]
    first = given(words)
    assert given(shlex.split(command_line("compare", compare_files, first))[1:]) == first


def test_a_link_keeps_its_name(tmp_path):
    """Oracle: data. What it points to may have no suffix to be read by."""
    (tmp_path / "store").touch()
    (tmp_path / "run.vti").symlink_to(tmp_path / "store")
    said = command_line("info", lambda file, /: None, {"file": tmp_path / "run.vti"})
    assert said.endswith("/run.vti")


def test_a_mesh_command_says_the_same(tmp_path, monkeypatch):
    """Oracle: algebra. As above."""
    monkeypatch.chdir(tmp_path)
    words = ["mesh", "f.npz", "--isovalue", "1", "-o", "o", "--edge-length", "0.25", "--order", "1"]
    first = given(words)
    assert given(shlex.split(command_line("mesh", mesh_file, first))[1:]) == first


def test_file_facts(tmp_path):
    """Oracle: peer. The digest is that of the whole file's bytes, as sha256sum prints it."""
    path = tmp_path / "f.bin"
    path.write_bytes(b"abc" * 100_000)
    facts = file_facts(path, "rho")
    assert facts == {
        "path": str(path.resolve()),
        "array": "rho",
        "sha256": sha256(b"abc" * 100_000).hexdigest(),
    }


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_a_stopped_command_leaves_nothing(tmp_path):
    """Oracle: data. SIGTERM while the results are written: no folder, no half-written one."""
    field = ellipsoid_field(samples=15)
    path = tmp_path / "f.npz"
    np.savez(path, rho=field.values, spacing=field.spacing, origin=field.origin)
    words = ["mesh", path, "--isovalue", ELLIPSOID_ISOVALUE, "-o", tmp_path / "out"]
    command = [sys.executable, "-m", "isovary", *map(str, words)]
    running = subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL)
    deadline = time.monotonic() + 120
    while len(os.listdir(tmp_path)) == 1 and time.monotonic() < deadline:
        assert running.poll() is None, running.stderr.read()
        time.sleep(0.002)
    running.send_signal(signal.SIGTERM)
    running.communicate(timeout=120)
    assert running.returncode == 128 + signal.SIGTERM
    assert os.listdir(tmp_path) == ["f.npz"]
