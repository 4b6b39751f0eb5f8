"""``isovary mesh``: what lands in the folder, what it says, how it ends."""

from __future__ import annotations

import json
from functools import partial
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
from conftest import ELLIPSOID_ISOVALUE, ellipsoid_field
from matplotlib.figure import Figure

import isovary as iv
from isovary import cli
from isovary.io._meshes import save_mesh
from isovary.quality import mesh_quality
from isovary.view import mesh_quality_figure
from isovary.view._camera import choose_camera

FILES = {"mesh.vtu", "mesh.vtp", "mesh_quality.png", "summary.json"}
ISOVALUE = ["--isovalue", str(ELLIPSOID_ISOVALUE)]


def run(capsys, monkeypatch, *words) -> tuple[int, str, str]:
    """Exit code, output and errors of the command line."""
    monkeypatch.setattr("isovary.cli._app.app", partial(cli.app, list(map(str, words))))
    with pytest.raises(SystemExit) as ended:
        cli.main()
    said = capsys.readouterr()
    return int(ended.value.code or 0), said.out, said.err


@pytest.fixture(scope="module")
def field(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("fields") / "rho.npz"
    made = ellipsoid_field()
    np.savez(path, rho=made.values, spacing=made.spacing, origin=made.origin)
    return path


@pytest.fixture
def no_picture(monkeypatch):
    """An empty picture, drawn at once."""
    monkeypatch.setattr("isovary.view.mesh_quality_figure", lambda *_: Figure())


@pytest.mark.parametrize("order", [1, 2])
def test_the_files_hold_the_mesh(field, tmp_path, capsys, monkeypatch, order):
    """Oracle: data. What a viewer reads equals the mesh made in Python, cell by cell."""
    out = tmp_path / "out"
    words = ["mesh", field, *ISOVALUE, "-o", out, "--vertices", 150, "--order", order]
    code, said, told = run(capsys, monkeypatch, *words)
    assert code == 0, told
    assert {path.name for path in out.iterdir()} == FILES
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    rho = iv.better_interpolation(iv.read_field(field), ELLIPSOID_ISOVALUE)
    surface = iv.marching_cubes(rho, ELLIPSOID_ISOVALUE, vertices=150, order=order)
    quality = mesh_quality(surface, rho, ELLIPSOID_ISOVALUE)
    grid = pv.read(out / "mesh.vtu")
    np.testing.assert_array_equal(grid.points, surface.points)
    width = surface.triangles.shape[1]
    np.testing.assert_array_equal(grid.cells.reshape(-1, width + 1)[:, 1:], surface.triangles)
    np.testing.assert_array_equal(grid.point_data["normals"], surface.normals)
    np.testing.assert_array_equal(grid.cell_data["quality"], quality.quality)
    np.testing.assert_array_equal(grid.cell_data["jacobian"], quality.jacobians)
    np.testing.assert_array_equal(grid.cell_data["distance"], quality.element_distances)
    flat, pieces = pv.read(out / "mesh.vtp"), 1 if order == 1 else 4
    assert flat.is_all_triangles
    np.testing.assert_array_equal(flat.cell_data["quality"], quality.quality.repeat(pieces))
    assert f"mean {quality.quality.mean():.3f}, worst {quality.quality.min():.2g}" in said
    assert "clean       yes" in said
    page = (Path(__file__).parents[1] / "docs" / "files.md").read_text("utf-8")
    names = [*grid.point_data, *grid.cell_data, *quality.summary()["distance_to_isosurface"]]
    assert [name for name in names if f"`{name}`" not in page] == []


def test_summary_is_enough_to_repeat_the_run(field, tmp_path, capsys, monkeypatch, no_picture):
    """Oracle: algebra. Every choice, the digest of the samples, the quality and the timings."""
    out = tmp_path / "out"
    words = ["mesh", field, *ISOVALUE, "-o", out, "--mesher", "distmesh", "--sizing", "curvature"]
    code, _, told = run(capsys, monkeypatch, *words, "--growth", 0.2, "--vertices", 150)
    assert code == 0, told
    summary = json.loads((out / "summary.json").read_text(), parse_constant=pytest.fail)
    choices = summary["choices"]
    assert summary["isovary"] == iv.__version__
    digest = sha256(field.read_bytes()).hexdigest()
    assert choices["files"] == [{"path": str(field.resolve()), "array": "rho", "sha256": digest}]
    assert choices["samples"]["sha256"] == sha256(iv.read_field(field).values.tobytes()).hexdigest()
    assert choices["isovalue"] == ELLIPSOID_ISOVALUE
    assert choices["interpolation"] == "logarithmic"
    assert (choices["mesher"], choices["sizing"]) == ("distmesh", "curvature_sizing")
    assert (choices["vertices"], choices["growth"], choices["order"]) == (150, 0.2, 2)
    assert summary["mesh"]["vertices"] == pytest.approx(150, rel=0.2)
    assert summary["mesh"]["size_curvature_correlation"] < -0.5
    assert summary["mesh"]["clean"]
    assert {"reading", "meshing", "mesh quality", "mesh picture"} <= set(summary["timings_seconds"])


def test_notes_are_shown_and_recorded(tmp_path, capsys, monkeypatch, no_picture):
    """Oracle: data. A file without spacing: I07 on the terminal and in the summary."""
    np.savez(tmp_path / "a.npz", rho=ellipsoid_field().values)
    out = tmp_path / "out"
    words = ["mesh", tmp_path / "a.npz", *ISOVALUE, "-o", out, "--vertices", 100]
    code, said, told = run(capsys, monkeypatch, *words)
    assert code == 0, told
    assert "I07" in said
    assert any("I07" in note for note in json.loads((out / "summary.json").read_text())["notes"])


@pytest.mark.parametrize(
    ("words", "code", "text"),
    [
        (["mesh"], 2, "FIELD"),
        (["mesh", "nowhere.npz", *ISOVALUE, "-o", "x"], 1, "F01"),
        (["mesh", "nowhere.npz", *ISOVALUE, "-o", "x", "--mesher", "magic"], 2, "magic"),
        (["mesh", "FIELD", "--isovalue", "7", "-o", "x"], 1, "I02"),
        (["mesh", "FIELD", *ISOVALUE, "-o", "x", "--vertices", "5"], 2, "A02"),
        (["mesh", "FIELD", *ISOVALUE, "-o", "x", "--growth", "0"], 2, "A02"),
        (["mesh", "FIELD", *ISOVALUE, "-o", "."], 1, "W02"),
    ],
)
def test_exit_codes(field, tmp_path, capsys, monkeypatch, words, code, text):
    """Oracle: algebra. 2 for wrong usage, 1 for data that cannot be meshed; nothing is written."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "thesis.tex").write_text("years of work")
    done, _, told = run(capsys, monkeypatch, *(field if w == "FIELD" else w for w in words))
    assert done == code
    assert text in told
    assert "Traceback" not in told
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_a_torn_mesh_is_never_called_clean(tmp_path, monkeypatch):
    """Oracle: algebra. Three triangles at an edge: the summary and the picture's heading say so."""
    monkeypatch.setenv("ISOVARY_NO_OPENGL", "1")
    points = np.array([[0.0, 0, 0], [0, 0, 1], [1, 0, 0], [-0.5, 0.8, 0], [-0.5, -0.8, 0]])
    fan = iv.Surface(points, [[0, 1, 2], [0, 1, 3], [0, 1, 4]], np.tile([0.0, 0, 1], (5, 1)))
    quality = mesh_quality(fan)
    save_mesh(fan, quality, tmp_path / "out")
    mesh = json.loads((tmp_path / "out" / "summary.json").read_text())["mesh"]
    assert mesh["clean"] is False
    assert any("more than two triangles" in fault for fault in mesh["faults"])
    words = [text.get_text() for text in mesh_quality_figure(fan, quality).texts]
    assert any("not clean: 1 edges with more than two triangles" in text for text in words)


def test_the_picture_marks_the_worst_triangle(monkeypatch):
    """Oracle: analytic. A vertex pushed aside makes one triangle thin: the ring is there."""
    monkeypatch.setenv("ISOVARY_NO_OPENGL", "1")
    cameras = []

    def watched(*arguments):
        cameras.append(choose_camera(*arguments))
        return cameras[-1]

    monkeypatch.setattr("isovary.view._mesh_quality.choose_camera", watched)
    ball = iv.icosphere(2, order=1)
    points = ball.points.copy()
    i, j, k = ball.triangles[7]
    points[i] += 0.7 * ((points[j] + points[k]) / 2 - points[i])
    surface = iv.Surface(points, ball.triangles)
    quality = mesh_quality(surface)
    assert quality.quality.argmin() == 7
    figure = quality.plot(surface)
    rings = [line for line in figure.axes[0].lines if line.get_marker() == "o"]
    middle = cameras[0].project(points[[i, j, k]].mean(axis=0))[:2]
    np.testing.assert_allclose(np.ravel(rings[0].get_data()), middle, atol=1e-12)
    assert any("○ worst triangle" in text.get_text() for text in figure.texts)
