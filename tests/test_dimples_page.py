"""The recipe of docs/dimples.md runs as it is written, in place and from the command's files."""

from __future__ import annotations

import doctest
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import isovary as iv
from isovary.view import displacement_figure

PAGE = Path(__file__).parents[1] / "docs" / "dimples.md"


def test_the_recipe_runs():
    """Oracle: geometry. Where the dimple is: the page's own numbers are checked as doctests."""
    failed, ran = doctest.testfile(str(PAGE), module_relative=False, report=False)
    assert ran > 12
    assert failed == 0


def test_the_commands_files_are_the_recipes_surfaces(tmp_path):
    """Oracle: data. The line in the page writes what the page makes in place, node for node."""
    line = next(row for row in PAGE.read_text("utf-8").splitlines() if row.startswith("isovary d"))
    words = [sys.executable, "-m", *line.split()]
    done = subprocess.run(
        words, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr
    base, made = (
        iv.read_surface(tmp_path / "dimpled" / f"{name}.vtu") for name in ("original", "mesh")
    )
    sphere = iv.icosphere(3)
    np.testing.assert_allclose(base.points, sphere.points, atol=1e-12)
    dimpled = iv.dimple(sphere, [0, 0, 1], 0.8, alpha=9.0)
    np.testing.assert_allclose(made.points, dimpled.points, atol=1e-12)
    assert (base.triangles == made.triangles).all()


def test_comparing_surface_files_points_here(tmp_path):
    """Oracle: data. A surface is no field: the error says so, and names the page that exists."""
    path = tmp_path / "mesh.vtu"
    path.write_text("<VTKFile/>")
    with pytest.raises(iv.FileError, match=r"that is a surface.*docs/dimples\.md .*\[F04\]"):
        iv.read_field(path)
    assert PAGE.name == "dimples.md"


def test_the_picture_tells_how_far_and_where():
    """Oracle: data. The heading's number is the largest displacement; both colours' ends are it."""
    base = iv.icosphere(2)
    points = base.points.copy()
    top = points[:, 2].argmax()
    points[top] *= 1.25
    moved = iv.Surface(points, base.triangles)
    figure = displacement_figure(base, moved, "a ball")
    words = [text.get_text() for text in figure.texts]
    assert words[0] == "Moved outward by 0.25 at most, 0.12 of the size"
    assert "1 of 642 nodes moved" in words[1]
    bar = next(axes for axes in figure.axes if "displacement" in axes.get_xlabel())
    assert bar.get_xlim() == pytest.approx((-0.25, 0.25))
    still = displacement_figure(base, base)
    assert still.texts[0].get_text() == "Nothing moved"
    assert not any("displacement" in axes.get_xlabel() for axes in still.axes)
