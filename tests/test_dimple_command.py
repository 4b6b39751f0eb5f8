"""``isovary dimple``: what lands in the folder equals what Python makes."""

from __future__ import annotations

import json
import shlex
import subprocess
import sys

import numpy as np
import pytest
import pyvista as pv

import isovary as iv

DIMPLES = ["--center", 0, 0, 1, "--center", 0, 0, -1, "--radius", 0.7]


def isovary(*words, cwd=None):
    command = [sys.executable, "-m", "isovary", *map(str, words)]
    return subprocess.run(
        command, capture_output=True, text=True, timeout=300, check=False, cwd=cwd
    )


def test_a_sphere_gets_its_dimples(tmp_path):
    """Oracle: data. Nodes and displacements are those of isovary.dimple, one node for one."""
    options = [*DIMPLES, "--alpha", 3, "--charge", -1, "--subdivisions", 3]
    done = isovary("dimple", "sphere", *options, "-o", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    grid = pv.read(tmp_path / "out" / "mesh.vtu")
    sphere = iv.icosphere(3)
    made = iv.dimple(sphere, [[0, 0, 1], [0, 0, -1]], 0.7, alpha=-3.0)
    np.testing.assert_allclose(grid.points, made.points, atol=1e-12)
    moved = grid.point_data["displacement"]
    np.testing.assert_allclose(moved, made.points - sphere.points, atol=1e-12)
    assert moved[:, 2].max() > 0.05  # drawn out at both poles
    assert moved[:, 2].min() < -0.05
    original = pv.read(tmp_path / "out" / "original.vtu")
    np.testing.assert_allclose(original.points, sphere.points, atol=1e-12)
    assert (original.cells == grid.cells).all()
    assert (tmp_path / "out" / "displacement.png").stat().st_size > 10_000
    assert "docs/dimples.md" in done.stdout
    assert "clean       yes" in done.stdout


def test_what_runs_through_itself_is_not_clean(tmp_path):
    """Oracle: analytic. A point that goes in at z = 1 and ends below z = -1 passed the far side."""
    words = ["--center", 0, 0, 1, "--radius", 0.8, "--steps", 200, "--order", 1]
    done = isovary("dimple", "sphere", *words, "-o", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert pv.read(tmp_path / "out" / "mesh.vtu").points[:, 2].min() < -1.2
    assert "M08" in done.stdout
    assert "M11" in done.stdout
    assert "clean       NO" in done.stdout
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["mesh"]["clean"] is False
    assert "run through others" in summary["mesh"]["faults"][0]
    assert [note[-5:] for note in summary["notes"]] == ["[M11]", "[M08]"]


def test_a_file_gets_a_dimple_and_the_command_repeats_it(tmp_path):
    """Oracle: data. The recorded command, run elsewhere, gives the same nodes, elsewhere."""
    flat = iv.ellipsoid((1, 1, 2), 3, order=1)
    faces = np.column_stack([np.full(len(flat.triangles), 3), flat.triangles])
    pv.PolyData(flat.points, faces.ravel()).save(tmp_path / "shape.vtp")
    words = ["dimple", "shape.vtp", "--center", 0, 0, 2, "--radius", 0.8, "-o", "out"]
    done = isovary(*words, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    first = pv.read(tmp_path / "out" / "mesh.vtu").points.copy()
    assert first[:, 2].max() < 1.99
    choices = json.loads((tmp_path / "out" / "summary.json").read_text())["choices"]
    again = isovary(*shlex.split(choices["command"])[1:])
    assert again.returncode == 0, again.stderr
    np.testing.assert_array_equal(pv.read(tmp_path / "out-again" / "mesh.vtu").points, first)


@pytest.mark.parametrize(
    ("words", "code", "text"),
    [
        (["cube.vtp", *DIMPLES], 1, "F01"),
        (["sphere", "--center", 0, 0, 5, "--radius", 0.7], 2, "A02"),
        (["sphere", *DIMPLES, "--subdivisions", 9], 2, "subdivisions: expected 2 to 7, got 9"),
        (["sphere", "--center", 0, 0, 1, "--radius", -1], 2, "radius"),
        (["sphere", "--center", 0, 0, 1, "--radius", "nan"], 2, "radius"),
        (["sphere", *DIMPLES, "--steps", 2.5], 2, "steps: expected a whole number, got 2.5"),
        (["sphere", *DIMPLES, "--steps", 0], 2, "steps: expected a whole number from 1"),
        (["sphere", *DIMPLES, "--charge", "nan"], 2, "charge"),
        (["cube", *DIMPLES], 2, "shape: expected sphere, ellipsoid, torus or a surface file"),
        (["Sphere", *DIMPLES], 2, "did you mean sphere?"),
        (["a.vtp", *DIMPLES, "--subdivisions", 6], 2, "subdivisions: expected none for a file"),
        (["a.vtp", *DIMPLES, "--order", 1], 2, "order: expected none for a file"),
    ],
)
def test_what_cannot_be_done_is_told(tmp_path, words, code, text):
    """Oracle: data. Exit codes; nothing is written."""
    done = isovary("dimple", *words, "-o", "out", cwd=tmp_path)
    assert done.returncode == code
    assert text in done.stderr
    assert list(tmp_path.iterdir()) == []
    if text not in ("F01", "A02"):
        assert "%" not in done.stderr  # wrong numbers are told before the work


def test_a_folder_is_no_file(tmp_path):
    """Oracle: data. A folder dimpled.vtu would be taken for a file by whoever sees it."""
    done = isovary("dimple", "sphere", *DIMPLES, "-o", "dimpled.vtu", cwd=tmp_path)
    assert done.returncode == 2
    assert "out: expected a folder" in done.stderr
    assert list(tmp_path.iterdir()) == []
