"""The command line's ways to align, carry and refine: each arrives where it should."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest
from conftest import ELLIPSOID_ISOVALUE, ellipsoid_field
from cyclopts import CycloptsError

import isovary as iv
from isovary.cli import app, view_result
from isovary.cli._compare import _part


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


@pytest.mark.parametrize(
    ("command", "option"),
    [
        *(("compare", name) for name in ("vertices", "eigenpairs", "times", "groups", "seed")),
        ("compare", "noise-meshes"),
        ("mesh", "vertices"),
        ("view", "port"),
    ],
)
@pytest.mark.parametrize("value", ["2.5", "2e2", "many"])
def test_a_whole_number_is_not_cut(command, option, value):
    """Oracle: algebra. 2.5 is neither 2 nor 3: it is refused by the option's name."""
    files = {"compare": ["a", "b"], "mesh": ["a"], "view": []}[command]
    words = [command, *files, f"--{option}", value]
    if files:
        words += ["--isovalue", "1", "-o", "out"]
    with pytest.raises(CycloptsError, match=f"--{option}: expected a whole number.*{value}"):
        app.parse_args(words, exit_on_error=False, print_error=False)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"port": 65536}, "port: expected 0 to 65535, got 65536"),
        ({"sessions": 0}, "sessions: expected 1 or more, got 0"),
        ({"jobs": -1}, "jobs: expected 1 or more, got -1"),
    ],
)
def test_a_page_that_could_serve_nobody_is_not_started(given, words):
    """Oracle: definition. Told before a server runs."""
    with pytest.raises(iv.ArgumentError, match=words) as caught:
        view_result(**given, browser=False)
    assert caught.value.code == "A02"


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


def test_change_below_the_smallest_scale_is_told():
    """Oracle: analytic. A ripple finer than what few pairs resolve: its change is largest at the
    smallest time; with a smooth change it is not.
    """

    def ball(ripple, growth):
        def value(p):
            r = np.linalg.norm(p, axis=-1)
            wave = np.sin(9 * p[..., 0]) * np.sin(9 * p[..., 1]) * np.sin(9 * p[..., 2])
            return 1 + growth * p[..., 2] ** 2 - r + ripple * wave

        return iv.ScalarField.from_function(value, ((-1.5,) * 3, (1.5,) * 3), (49, 49, 49))

    options = {"vertices": 500, "pairs": 100, "times": 12}
    fine = iv.compare(ball(0.0, 0.0), ball(0.02, 0.0), 0.0, **options)
    smooth = iv.compare(ball(0.0, 0.0), ball(0.0, 0.05), 0.0, **options)
    assert any("S07" in note for note in fine.notes)
    assert not any("S07" in note for note in smooth.notes)


def test_a_blend_lives_where_both_fields_do():
    """Oracle: algebra. The box of a blend is what both boxes hold."""
    fields = [
        iv.ScalarField.from_function(lambda p: p[..., 0], (low, high), (5, 5, 5))
        for low, high in (((0, 0, 0), (2, 3, 4)), ((1, -1, 1), (3, 2, 3)))
    ]
    low, high = iv.BlendedField(*fields, 0.3).bounds
    np.testing.assert_allclose(low, [1, 0, 1])
    np.testing.assert_allclose(high, [2, 2, 3])
    turn = iv.RigidMotion([[0, -1, 0], [1, 0, 0], [0, 0, 1]], [0, 0, 1])
    low, high = iv.MovedField(fields[0], turn).bounds
    np.testing.assert_allclose(low, [-3, 0, 1])
    np.testing.assert_allclose(high, [0, 2, 5])
