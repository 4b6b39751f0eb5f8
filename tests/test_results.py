"""What lands in the result folder, and how the command line behaves."""

from __future__ import annotations

import json
import subprocess
import sys
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
from conftest import ELLIPSOID_ISOVALUE, ellipsoid_field

import isovary as iv

FILES = {
    "change.vtu",
    "perturbed.vtu",
    "both.png",
    "change.vtp",
    "details.png",
    "mesh_quality.png",
    "overview.png",
    "report.html",
    "summary.json",
}
QUICK = ["--vertices", "200", "--eigenpairs", "60", "--times", "20"]
ISOVALUE = ["--isovalue", str(ELLIPSOID_ISOVALUE)]


def write_field(path: Path, field: iv.ScalarField) -> Path:
    np.savez(path, rho=field.values, spacing=field.spacing, origin=field.origin)
    return path


@pytest.fixture(scope="module")
def files(tmp_path_factory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("fields")
    base = write_field(folder / "base.npz", ellipsoid_field())
    return base, write_field(
        folder / "perturbed.npz", ellipsoid_field((1.0, 1.03, 2.0), shift=(0.02, 0.0, 0.0))
    )


def isovary(*words) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "isovary", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)


@pytest.fixture(scope="module")
def run(files, tmp_path_factory) -> tuple[Path, subprocess.CompletedProcess[str]]:
    out = tmp_path_factory.mktemp("run") / "out"
    return out, isovary("compare", *files, *ISOVALUE, "-o", out, *QUICK)


@pytest.fixture(scope="module")
def result(files) -> iv.Comparison:
    fields = [iv.read_field(path) for path in files]
    return iv.compare(*fields, ELLIPSOID_ISOVALUE, vertices=200, pairs=60, times=20)


def test_compare_writes_everything(run):
    """Oracle: algebra. Exit code 0, exactly the promised files, nothing left beside the folder."""
    out, process = run
    assert process.returncode == 0, process.stderr
    assert {path.name for path in out.iterdir()} == FILES
    assert [path.name for path in out.parent.iterdir()] == ["out"]
    for stage in ("reading", "meshing", "eigenpairs of the base", "overview picture", "report"):
        assert stage in process.stderr
    assert "noise floor" in process.stdout


def test_data_files_hold_the_comparison(run, result):
    """Oracle: data. What a viewer reads equals the arrays of the same comparison in Python."""
    grid = pv.read(run[0] / "change.vtu")
    assert set(grid.celltypes) == {pv.CellType.QUADRATIC_TRIANGLE}
    np.testing.assert_array_equal(grid.points, result.base.points)
    np.testing.assert_array_equal(grid.cells.reshape(-1, 7)[:, 1:], result.base.triangles)
    expected = {
        "hks_base": result.base_signature,
        "hks_perturbed": result.perturbed_signature,
        "hks_change": result.change,
        "noise_floor": result.noise_floor,
        "change_norm": result.change_norm,
        "significant": result.significant,
        "group": result.clusters.labels,
        "partner": result.perturbed_in_place.points,
        "displacement": result.perturbed_in_place.points - result.base.points,
        "deformation": result.perturbed.points - result.base.points,
        "strain": result.strain,
        "kind_of_change": result.kinds,
        "partner_found": np.ones(len(result.base.points)),
    }
    for name, values in expected.items():
        np.testing.assert_allclose(grid.point_data[name], values, atol=1e-9, err_msg=name)
    np.testing.assert_allclose(grid.field_data["times"], result.times, rtol=1e-12)
    page = (Path(__file__).parents[1] / "docs" / "files.md").read_text("utf-8")
    assert [name for name in grid.point_data if f"`{name}`" not in page] == []
    moved = pv.read(run[0] / "perturbed.vtu")
    np.testing.assert_allclose(moved.points, result.perturbed_in_place.points, atol=1e-12)
    assert np.abs(moved.points - result.perturbed.points).max() > 1e-3  # it was aligned
    strains = iv.distortion(result.base, result.perturbed.points)
    np.testing.assert_allclose(grid.cell_data["area_strain"], strains.area_strain, atol=1e-12)
    np.testing.assert_allclose(grid.cell_data["angle_strain"], strains.angle_strain, atol=1e-12)
    flat = pv.read(run[0] / "change.vtp")
    assert flat.is_all_triangles
    assert flat.n_cells == 4 * len(result.base.triangles)
    np.testing.assert_allclose(flat.point_data["change_norm"], result.change_norm, atol=1e-9)


def test_summary_is_enough_to_repeat_the_run(run, result, files):
    """Oracle: algebra. Plain JSON with versions, choices, counts, noise and the stage timings."""
    text = (run[0] / "summary.json").read_text()
    summary = json.loads(text, parse_constant=pytest.fail)
    assert summary["isovary"] == iv.__version__
    assert {"python", "numpy", "scipy", "vtk"} <= set(summary["versions"])
    choices = summary["choices"]
    assert (choices["vertices"], choices["pairs"], choices["times"]) == (200, 60, 20)
    assert [file["path"] for file in choices["files"]] == [str(file.resolve()) for file in files]
    assert choices["files"][0]["sha256"] == sha256(files[0].read_bytes()).hexdigest()
    assert choices["base"]["sha256"] == result.choices["base"]["sha256"]
    assert summary["counts"]["nodes"] == len(result.base.points)
    assert sum(summary["counts"]["by_group"]) == summary["counts"]["significant"]
    meshes = summary["mesh"]
    assert {meshes[name]["triangles"] for name in ("base", "perturbed")} == {
        len(result.base.triangles)
    }
    assert meshes["base"]["clean"]
    worst = {name: meshes[name]["quality"]["min"] for name in meshes}
    assert min(worst.values()) > 0.3
    assert worst["base"] != worst["perturbed"]  # the carried mesh is another
    for mesh in meshes.values():
        assert mesh["distance_to_isosurface"]["nodes"] < 1e-9
    assert summary["change"]["relative_noise"] == pytest.approx(result.relative_noise, rel=1e-6)
    assert summary["extrinsic"]["base_area"] == pytest.approx(21.478435, rel=1e-3)
    stages = {"reading", "meshing", "eigenpairs of the base", "overview picture", "report"}
    assert stages <= set(summary["timings_seconds"])


def test_a_second_run_replaces_the_first_and_only_that(run, result, tmp_path):
    """Oracle: algebra. An earlier result is replaced; the user's own folder is refused, W02."""
    mine = tmp_path / "mine"
    mine.mkdir()
    (mine / "thesis.tex").write_text("years of work")
    with pytest.raises(iv.RunError, match="W02"):
        result.save(mine)
    assert [path.name for path in mine.iterdir()] == ["thesis.tex"]


def test_output_is_checked_before_the_work(files, tmp_path):
    """Oracle: algebra. A foreign folder is refused before the files are even read."""
    (tmp_path / "thesis.tex").write_text("years of work")
    process = isovary("compare", *files, *ISOVALUE, "-o", tmp_path)
    assert process.returncode == 1
    assert "W02" in process.stderr
    assert "reading" not in process.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="no file size limits")
def test_full_disk_is_an_error_of_ours(result, tmp_path):
    """Oracle: algebra. Writing past a limit on the file size ends with W06, nothing left behind."""
    import resource
    import signal

    old = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, old[1]))
    try:
        with pytest.raises(iv.RunError, match="W06"):
            result.save(tmp_path / "out")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, old)
        signal.signal(signal.SIGXFSZ, handler)
    assert list(tmp_path.iterdir()) == []


def test_missing_spacing_is_noted(tmp_path):
    """Oracle: data. An .npz without spacing: the note stands in the summary and on the terminal."""
    field = ellipsoid_field()
    np.savez(tmp_path / "a.npz", rho=field.values)
    out = tmp_path / "out"
    process = isovary("compare", *[tmp_path / "a.npz"] * 2, *ISOVALUE, "-o", out, *QUICK)
    assert process.returncode == 0, process.stderr
    assert "I07" in process.stdout
    assert any("I07" in note for note in json.loads((out / "summary.json").read_text())["notes"])


def test_equal_surfaces_by_name(files, tmp_path):
    """Oracle: algebra. The command line says so when nothing changed at all."""
    process = isovary("compare", files[0], files[0], *ISOVALUE, "-o", tmp_path / "out", *QUICK)
    assert process.returncode == 0, process.stderr
    assert "The two isosurfaces are identical" in process.stdout


@pytest.mark.parametrize(
    ("words", "code", "text"),
    [
        (["compare"], 2, "BASE"),
        (["compare", "a.npz", "b.npz", "-o", "x"], 2, "isovalue"),
        (["compare", "a.npz", "b.npz", "--isovalue", "much", "-o", "x"], 2, "much"),
        (["compare", "a.npz", "b.npz", *ISOVALUE, "-o", "x", "--order", "3"], 2, "3"),
        (["walk"], 2, "walk"),
        (["info", "nowhere.npz"], 1, "F01"),
        (["compare", "nowhere.npz", "b.npz", *ISOVALUE, "-o", "x"], 1, "F01"),
    ],
)
def test_exit_codes(words, code, text):
    """Oracle: algebra. 2 for wrong usage, 1 for data that cannot be compared; and why."""
    process = isovary(*words)
    assert process.returncode == code, process.stderr
    assert text in process.stderr
    assert "Traceback" not in process.stderr


def test_data_that_cannot_be_compared(files, tmp_path):
    """Oracle: algebra. A wrong isovalue ends with 1 and the range; nothing is written."""
    out = tmp_path / "out"
    process = isovary("compare", *files, "--isovalue", "7", "-o", out)
    assert process.returncode == 1
    assert "I02" in process.stderr
    assert "quantiles" in process.stderr
    assert list(tmp_path.iterdir()) == []
    process = isovary("compare", *files, *ISOVALUE, "-o", out, "--vertices", "20")
    assert process.returncode == 2
    assert "M09" in process.stderr


def test_info_tells_what_a_file_holds(files):
    """Oracle: analytic. Range and box of the known field, topology and area of its isosurface."""
    process = isovary("info", files[0], *ISOVALUE)
    assert process.returncode == 0, process.stderr
    assert "25 x 25 x 25" in process.stdout
    assert "-2.8 -2.8 -2.8  to  2.8 2.8 2.8" in process.stdout
    assert "genus 0, Euler characteristic 2, area about 2" in process.stdout


def test_python_m_isovary_and_version():
    """Oracle: algebra. The version of the package."""
    assert isovary("--version").stdout.strip() == iv.__version__
