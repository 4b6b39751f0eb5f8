"""Dimples with a way back, and the commands that make them again."""

from __future__ import annotations

import os
import shlex
import warnings
from functools import partial

import numpy as np
import pytest
import pyvista as pv
from matplotlib.figure import Figure

import isovary as iv
from isovary.app._dimple_history import DimpleHistory, command, disc, python_script
from isovary.cli import app, main
from isovary.errors import ArgumentError, MeshError
from isovary.geometry import linear_triangles

WORDS = ("sphere", "--subdivisions", "3")
ALIKE = [([0, 0, 1], 0.7, {}), ([0, 1, 0], 0.7, {})]
OTHER = ([1 / 3, -1e-5, -0.94], 0.5, {"alpha": 3.0, "charge": -1.0, "decay": 0.3, "steps": 12})


def pushed(pushes, words=WORDS, surface=None):
    history = DimpleHistory.start(iv.icosphere(3) if surface is None else surface, words)
    for center, radius, numbers in pushes:
        history = history.push(center, radius, **numbers)
    return history


def test_push_is_a_dimple():
    """Oracle: peer. The points and normals of isovary.dimple; the first surface stays."""
    sphere = iv.icosphere(3)
    history = pushed([OTHER], surface=sphere)
    center, radius, numbers = OTHER
    made = iv.dimple(sphere, center, radius, **numbers)
    np.testing.assert_array_equal(history.current.points, made.points)
    np.testing.assert_array_equal(history.current.normals, made.normals)
    assert history.surfaces[0] is sphere
    assert np.abs(made.points - sphere.points).max() > 0.01


def test_pushes_of_equal_numbers_are_one_call():
    """Oracle: peer. Two centres in one call of isovary.dimple."""
    made = iv.dimple(iv.icosphere(3), [center for center, _, _ in ALIKE], 0.7)
    np.testing.assert_array_equal(pushed(ALIKE).current.points, made.points)


def test_the_way_back_and_forth():
    """Oracle: algebra. Undo and redo give the very surfaces; a push forgets what was undone."""
    start = pushed([])
    one, two = start.push([0, 0, 1], 0.7), start.push([0, 0, 1], 0.7).push([0, 1, 0], 0.5)
    assert (start.can_undo, start.can_redo) == (False, False)
    assert (two.can_undo, two.can_redo) == (True, False)
    back = two.undo()
    assert back.current is two.surfaces[1]
    np.testing.assert_array_equal(back.current.points, one.current.points)
    assert (back.can_undo, back.can_redo) == (True, True)
    assert back.redo().current is two.current
    assert back.undo().current is start.current
    assert back.undo().undo().current is start.current
    assert two.redo().current is two.current
    third = back.push([1, 0, 0], 0.6)
    assert not third.can_redo
    assert [push.radius for push in third.pushes] == [0.7, 0.6]
    assert len(two.pushes) == 2  # nothing was changed on the way


@pytest.mark.parametrize(
    ("center", "radius", "numbers", "error", "code"),
    [
        ([0, 0, 5], 0.7, {}, ArgumentError, "A02"),
        ([0, 0, 1], -1, {}, ArgumentError, "A02"),
        ([0, 0, 1], 0.7, {"alpha": np.nan}, ArgumentError, "A02"),
        ([0, 0], 0.7, {}, ArgumentError, "A03"),
        ([[0, 0, 1], [0, 1, 0]], 0.7, {}, ArgumentError, "A03"),
        ([0, 0, 1], 0.7, {"alpha": 4000.0}, MeshError, "M03"),
    ],
)
def test_errors_pass_and_leave_the_history(center, radius, numbers, error, code):
    """Oracle: data. The codes of isovary.dimple; the history goes on as if not asked."""
    history = pushed([ALIKE[0]])
    before = (history.pushes, history.surfaces, history.place)
    with pytest.raises(error) as caught:
        history.push(center, radius, **numbers)
    assert caught.value.code == code
    assert (history.pushes, history.surfaces, history.place) == before


@pytest.mark.parametrize(
    "words",
    [
        (),
        ("",),
        ("--order", "1"),
        ("sphere", "--order"),
        ("sphere", "--out", "3"),
        ("a.vtu", "x"),
        ("sphere", "--order", "; rm"),
        ("sphere", "--subdivisions", "²"),
    ],
)
def test_other_words_are_refused(words):
    """Oracle: data. A02 for what is no shape with its options."""
    with pytest.raises(ArgumentError, match="words") as caught:
        DimpleHistory.start(iv.icosphere(2), words)
    assert caught.value.code == "A02"


def test_commands_make_the_same_surface(tmp_path, monkeypatch, capsys):
    """Oracle: peer. What the command line writes has the same nodes; two lines for two kinds.

    What was taken back is in neither.
    """
    history = pushed([*ALIKE, OTHER]).push([1, 0, 0], 0.4).undo()
    text = command(history, tmp_path / "a b" / "out")
    assert len(text.splitlines()) == 2
    assert text.count("--center") == 3
    monkeypatch.setattr("isovary.view.mesh_quality_figure", lambda *_: Figure())
    for line in text.splitlines():
        words = shlex.split(line)
        assert words[:2] == ["isovary", "dimple"]
        monkeypatch.setattr("isovary.cli._app.app", partial(app, words[1:]))
        with pytest.raises(SystemExit) as ended:
            main()
        assert ended.value.code == 0, capsys.readouterr().err
    grid = pv.read(tmp_path / "a b" / "out" / "mesh.vtu")
    np.testing.assert_allclose(grid.points, history.current.points, rtol=0, atol=1e-12)
    assert np.abs(grid.points - pushed(ALIKE).current.points).max() > 0.01


def test_script_makes_the_same_surface():
    """Oracle: peer. The program run by itself; and the same of the other shapes."""
    history = pushed([*ALIKE, OTHER])
    names: dict[str, object] = {}
    exec(python_script(history), names)
    np.testing.assert_array_equal(names["surface"].points, history.current.points)
    shapes = {
        ("sphere",): iv.icosphere(4),
        ("ellipsoid", "--order", "1"): iv.ellipsoid((1, 1, 2), 4, order=1),
        ("torus", "--subdivisions", "2"): iv.torus(1.0, 0.4, (24, 10)),
    }
    for words, surface in shapes.items():
        exec(python_script(DimpleHistory.start(surface, words)), names)
        np.testing.assert_array_equal(names["surface"].points, surface.points)
        np.testing.assert_array_equal(names["surface"].triangles, surface.triangles)


def test_a_file_is_where_it_begins(tmp_path):
    """Oracle: peer. Command and script read the file by its whole path, whatever its name."""
    flat = iv.ellipsoid((1, 1, 2), 3, order=1)
    path = tmp_path / "it's a shape.vtp"
    faces = np.column_stack([np.full(len(flat.triangles), 3), flat.triangles])
    pv.PolyData(flat.points, faces.ravel()).save(path)
    surface = iv.read_surface(path)
    history = pushed([([0, 0, 2], 0.8, {})], (os.path.relpath(path),), surface)
    (line,) = command(history, tmp_path / "out").splitlines()
    assert shlex.split(line)[2] == str(path)
    names: dict[str, object] = {}
    exec(python_script(history), names)
    np.testing.assert_array_equal(names["surface"].points, history.current.points)


def test_notes_belong_to_the_surface_that_is_shown():
    """Oracle: data. A dimple that moves all nodes is told (M11) until it is taken back."""
    start = DimpleHistory.start(iv.icosphere(3), WORDS, ["repaired"])
    assert start.notes == ("repaired",)
    wide = start.push([0, 0, 1], 2.5)
    assert wide.notes[0] == "repaired"
    (doubt,) = wide.notes[1:]
    assert doubt.endswith("[M11]")
    assert wide.undo().notes == ("repaired",)
    assert wide.undo().redo().notes == wide.notes
    more = wide.push([0, 1, 0], 0.6)
    assert more.notes == wide.notes  # it is still in the surface
    assert more.undo().undo().push([0, 1, 0], 0.6).notes == ("repaired",)


def test_nothing_pushed_is_no_command():
    """Oracle: algebra. Without pushes there is nothing to make."""
    assert command(pushed([])) == ""
    assert python_script(pushed([])).splitlines()[-1] == "surface = iv.icosphere(3, order=2)"


def test_disc_on_a_sphere_is_a_circle():
    """Oracle: analytic. A chord r from the pole ends at the height 1 - r^2 / 2, less the flat
    triangles' depth: at most an eighth of the square of their edges, which are below 0.09."""
    sphere = iv.icosphere(4)
    for radius in (0.3, 1.0, 1.9):
        (line,) = disc(sphere, [0, 0, 1], radius)
        np.testing.assert_array_equal(line[0], line[-1])
        np.testing.assert_allclose(np.linalg.norm(line - [0, 0, 1], axis=1), radius, rtol=1e-12)
        assert np.abs(line[:, 2] - (1 - radius**2 / 2)).max() < 0.09**2 / 8
        around = np.unwrap(np.arctan2(line[:, 1], line[:, 0]))
        assert abs(around[-1] - around[0]) == pytest.approx(2 * np.pi)
        assert (np.diff(around) * np.sign(around[-1]) > 0).all() or len(line) > 10


def test_disc_shows_what_a_dimple_moves():
    """Oracle: peer. Nodes that isovary.dimple moved lie on one side of the line, others not."""
    torus = iv.torus(1.0, 0.4, (48, 20))
    center, radius = np.array([1.4, 0, 0]), 0.7
    (line,) = disc(torus, center, radius)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        moved = (iv.dimple(torus, center, radius).points != torus.points).any(axis=1)
    pieces = linear_triangles(torus.triangles)
    mixed = moved[pieces].any(axis=1) & ~moved[pieces].all(axis=1)
    assert len(line) - 1 == mixed.sum()  # one segment for each triangle that is moved in part


def test_other_side_of_a_thin_body_has_no_disc():
    """Oracle: analytic. A sheet 0.2 thick: one circle of radius 0.5 on top, none below."""
    ball = iv.icosphere(4)
    thin = iv.Surface(ball.points * [1, 1, 0.1], ball.triangles)
    (line,) = disc(thin, [0, 0, 0.1], 0.5)
    assert (line[:, 2] > 0).all()
    np.testing.assert_array_equal(line[0], line[-1])


def test_lines_of_a_ring_and_at_a_rim():
    """Oracle: analytic. A region around a tube has two borders; one at a rim ends there; a whole
    component none."""
    torus = iv.torus(1.0, 0.4, (48, 20))
    first, second = disc(torus, [1.4, 0, 0], 1.2)
    for line in (first, second):
        np.testing.assert_array_equal(line[0], line[-1])
    assert (np.sign(first[:, 1]) == -np.sign(second[0, 1])).all()
    flat = iv.disk(1.0, 16)
    (line,) = disc(flat, [1, 0, 0], 0.5)
    ends = np.linalg.norm(line[[0, -1]], axis=1)
    np.testing.assert_allclose(ends, 1.0, atol=0.01)
    # the arc about a point of the unit circle spans twice the angle with cosine r / 2
    length = np.linalg.norm(np.diff(line, axis=0), axis=1).sum()
    assert length == pytest.approx(0.5 * 2 * np.arccos(0.25), rel=0.01)
    assert disc(iv.icosphere(3), [0, 0, 1], 2.5) == ()


def test_disc_far_from_the_surface_is_refused():
    """Oracle: data. As a dimple there would be."""
    for center, radius in (([0, 0, 5], 1.0), ([0, 0, 1], -1.0), ([0, 0, np.nan], 1.0)):
        with pytest.raises(ArgumentError) as caught:
            disc(iv.icosphere(2), center, radius)
        assert caught.value.code == "A02"
