"""The room of the thesis's experiments: they are found, their settings hold, the page is whole."""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from importlib.resources import files

import pytest
from matplotlib.figure import Figure

import isovary as iv
from isovary.thesis import (
    Experiment,
    Finding,
    Outcome,
    Verdict,
    experiment,
    experiments,
    settings_of,
)
from isovary.thesis._gallery import make_gallery


def test_every_experiment_has_its_settings():
    """Oracle: data. Each has a file; what is small is among what is full; each number says why."""
    room = files("isovary.thesis")
    for found in experiments():
        text = room.joinpath(f"fig_{found.number.replace('.', '_')}.toml").read_text("utf-8")
        read = tomllib.loads(text)
        assert set(read) == {"full", "small"}, found.number
        assert set(read["small"]) <= set(read["full"]), found.number
        full = text.split("[full]")[1].split("[small]")[0]
        lines = [line for line in full.splitlines() if "=" in line]
        assert [line for line in lines if "#" not in line] == [], found.number


def test_experiments_are_found_by_their_figures():
    """Oracle: algebra. In the thesis's order, each figure once; another number is refused."""
    numbers = [number for found in experiments() for number in (found.number, *found.also)]
    assert len(set(numbers)) == len(numbers)
    order = [[int(part) for part in found.number.split(".")] for found in experiments()]
    assert order == sorted(order)
    for number in numbers:
        assert number in (experiment(number).number, *experiment(number).also)
    with pytest.raises(iv.ArgumentError, match=r"figure: expected one of .*4\.3.*got 9\.9"):
        experiment("9.9")


def test_small_settings_lie_over_the_full_ones():
    """Oracle: data. The file of figure 4.3, read by hand."""
    found = experiment("4.3")
    assert settings_of(found)["pairs"][-1] == 500
    assert settings_of(found, small=True)["pairs"][-1] == 200
    assert settings_of(found, small=True)["dimple_alpha"] == 5.0


def test_the_page_has_every_claim(tmp_path):
    """Oracle: algebra. Two made-up experiments: their claims, numbers, verdicts and pictures."""

    def run(_):
        claims = (
            Finding("Water is wet", "1.2", "wet by 3 %", Verdict.CONFIRMED, {"wet": 0.03}),
            Finding("Fire is cold", "1.3", "it is 900 degrees", Verdict.REFUTED),
        )
        return Outcome(claims, Figure((1, 1)))

    made = [Experiment("4.3", "Elements", run), Experiment("4.3", "Again", run, ("9.9",))]
    text = make_gallery(made, tmp_path).read_text("utf-8")
    assert "4 claims: 2 confirmed, 2 refuted." in text
    assert text.count("| Water is wet | wet by 3 % | ✔ confirmed |") == 2
    assert "## 4.3 (with 9.9): Again" in text
    assert (tmp_path / "figure-4.3.png").stat().st_size > 0
    record = json.loads((tmp_path / "summary.json").read_text())["experiments"]["4.3"]
    assert record["findings"][0]["numbers"] == {"wet": 0.03}
    assert record["settings"]["times"] == 100


def test_the_command_lists_and_refuses(tmp_path):
    """Oracle: data. Without a figure the list; with a wrong one exit code 2 and no folder."""

    def isovary(*words):
        command = [sys.executable, "-m", "isovary", "thesis", *words]
        return subprocess.run(
            command, capture_output=True, text=True, cwd=tmp_path, timeout=120, check=False
        )

    listed = isovary()
    assert listed.returncode == 0
    assert len(listed.stdout.splitlines()) == len(experiments())
    assert isovary("7.7").returncode == 2
    assert isovary("all", "4.3").returncode == 2
    assert list(tmp_path.iterdir()) == []
