"""The command line's ways to align, carry and refine: each arrives where it should."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest
from conftest import ELLIPSOID_ISOVALUE, ellipsoid_field

import isovary as iv
from isovary.cli import _part


def write(path, stretch):
    field = ellipsoid_field((1.0, 1.0 + stretch, 2.0), samples=21)
    np.savez(path, s=field.values, spacing=field.spacing, origin=field.origin)
    return path


def run(*words):
    command = [sys.executable, "-m", "isovary", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)


def test_options_arrive(tmp_path):
    """Oracle: algebra. summary.json has each choice, and the members by their digests."""
    base, middle, last = (write(tmp_path / f"{k}.npz", 0.02 * k) for k in range(3))
    out = tmp_path / "out"
    small = ("--vertices", 200, "--eigenpairs", 60, "--times", 10)
    words = ("--isovalue", ELLIPSOID_ISOVALUE, "-o", out, "--no-align", "--through", middle)
    done = run("compare", base, last, *words, "--only-matching", "--noise-meshes", 2, *small)
    assert done.returncode == 0, done.stderr
    choices = json.loads((out / "summary.json").read_text())["choices"]
    assert choices["alignment"] == "off"
    assert choices["carrying"] == "isometric"
    assert choices["only_matching"] is True
    assert len(choices["noise_floor_vertices"]) == 2
    assert len(choices["through"]) == 1
    digests = {choices[k]["sha256"] for k in ("base", "perturbed")}
    assert choices["through"][0]["sha256"] not in digests


@pytest.mark.parametrize(("text", "part"), [("5%", 0.05), ("0.05", 0.05), (" 2.5 %", 0.025)])
def test_a_part_is_read(text, part):
    """Oracle: algebra. Percent or a number."""
    assert _part(text) == pytest.approx(part)


def test_a_part_that_is_none():
    """Oracle: algebra. A02 names the option."""
    with pytest.raises(iv.ArgumentError, match=r"accuracy: expected a part.*A02"):
        _part("fine")


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"accuracy": 5.0}, "accuracy: expected a part"),
        ({"accuracy": 0.05, "vertices": 300}, "accuracy: expected no vertices"),
        ({"noise_meshes": 0}, "noise_meshes: expected at least 1"),
    ],
)
def test_wrong_options_fail_before_the_work(options, text):
    """Oracle: algebra. The name, the bound and the value."""
    with pytest.raises(iv.ArgumentError, match=text) as caught:
        iv.compare(ellipsoid_field(), ellipsoid_field(), ELLIPSOID_ISOVALUE, **options)
    assert caught.value.code == "A02"


def test_a_member_that_is_no_field():
    """Oracle: algebra. The member's place is named."""
    with pytest.raises(iv.ArgumentError, match=r"through\[0\]: expected a ScalarField"):
        iv.compare(ellipsoid_field(), ellipsoid_field(), ELLIPSOID_ISOVALUE, through=["a.vti"])
