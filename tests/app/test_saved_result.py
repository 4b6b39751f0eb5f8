"""A saved comparison read back: all that was in it, or an error that says what is wrong."""

from __future__ import annotations

import pickle
import shutil
from dataclasses import replace

import numpy as np
import pytest
from saved_folder import dented_ball, edit_summary, folder_of, half_lost, with_signature

import isovary as iv
from isovary.app._saved_result import read_result
from isovary.errors import CorrespondenceError, FileError
from isovary.io._results import _change_grid
from isovary.io._writing import curved_grid, write_vtk


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return folder_of(dented_ball(), tmp_path_factory.mktemp("saved") / "out")


@pytest.fixture
def copy(whole, tmp_path):
    return shutil.copytree(whole, tmp_path / "out")


@pytest.mark.parametrize("made", [dented_ball, half_lost])
def test_everything_comes_back(made, tmp_path):
    """Oracle: inverse. What was saved and read is the comparison, to the last bit."""
    result = made()
    saved = read_result(folder_of(result, tmp_path / "out"))
    there = result.base.points + result.displacement
    there[~result.correspondence.found] = np.nan
    pairs = [
        (saved.base.points, result.base.points),
        (saved.base.triangles, result.base.triangles),
        (saved.perturbed.points, result.perturbed_in_place.points),
        (saved.perturbed.triangles, result.perturbed.triangles),
        (saved.partners, there),
        (saved.base_signature, result.base_signature),
        (saved.perturbed_signature, result.perturbed_signature),
        (
            saved.perturbed_own_signature,
            iv.heat_kernel_signature(result.perturbed_pairs, result.times),
        ),
        (saved.change, result.change),
        (saved.noise_floor, result.noise_floor),
        (saved.columns, result.times),
        (saved.found, result.correspondence.found),
        (saved.distance, result.correspondence.distance),
        (saved.strain, result.strain),
        (saved.kind_of_change, result.kinds),
        (saved.significant, result.significant),
        (saved.labels, result.clusters.labels),
    ]
    for number, (read, wrote) in enumerate(pairs):
        np.testing.assert_array_equal(read, wrote, err_msg=str(number))
    assert saved.kind == result.methods.kind
    assert saved.same_mesh
    assert saved.count == len(result.clusters.centers)
    np.testing.assert_array_equal(saved.known, np.isfinite(result.change_norm))
    assert (saved.base.normals * result.base.normals).sum(axis=1).min() > 0.99


def test_it_passes_to_another_process(whole):
    """Oracle: inverse. A pickled result is the same, and its kind still knows its times."""
    saved = read_result(whole)
    again = pickle.loads(pickle.dumps(saved))
    np.testing.assert_array_equal(again.change, saved.change)
    assert again.kind.per_time


@pytest.mark.parametrize(
    "signature", [iv.wave_kernel_signature, iv.scale_invariant_heat_kernel_signature]
)
def test_other_signatures_have_other_columns(signature, tmp_path):
    """Oracle: data. The axis and the columns are the signature's own."""
    result = with_signature(signature)
    saved = read_result(folder_of(result, tmp_path / "out"))
    assert saved.kind.axis == result.methods.kind.axis
    assert not saved.kind.per_time
    np.testing.assert_array_equal(saved.columns, result.columns)
    assert saved.change.shape[1] == len(result.columns)


def test_a_mesh_of_its_own_is_told(tmp_path):
    """Oracle: data. The perturbed surface's triangles in another order are another mesh."""
    result = dented_ball()
    other = iv.Surface(result.perturbed.points, np.roll(result.perturbed.triangles, 1, axis=0))
    saved = read_result(folder_of(replace(result, perturbed=other), tmp_path / "out"))
    assert not saved.same_mesh


def test_no_folder_and_no_result(tmp_path):
    """Oracle: data. What is no result is refused before any grid is read."""
    for path, code in [(tmp_path / "none", "F01"), (tmp_path, "F04")]:
        with pytest.raises(FileError) as told:
            read_result(path)
        assert told.value.code == code
    (tmp_path / "file").write_text("x")
    with pytest.raises(FileError, match="expected a folder of results, got a file"):
        read_result(tmp_path / "file")


def _write(name, content):
    return lambda folder: (folder / name).write_bytes(content)


def _cut(name, part):
    def cut(folder):
        data = (folder / name).read_bytes()
        (folder / name).write_bytes(data[: int(part * len(data))])

    return cut


def _flip(folder):
    """One letter of the compressed change is another."""
    path = folder / "change.vtu"
    text = path.read_text()
    at = text.index('Name="hks_change"')
    at = text.index("\n", at) + 400
    path.write_text(text[:at] + ("A" if text[at] != "A" else "B") + text[at + 1 :])


def _rename(before, after):
    def rename(folder):
        path = folder / "change.vtu"
        path.write_text(path.read_text().replace(f'Name="{before}"', f'Name="{after}"'))

    return rename


def _summary(**more):
    return lambda folder: edit_summary(folder, lambda summary: summary.update(more))


def _fewer_columns(folder):
    grid = _change_grid(dented_ball())
    grid.point_data["noise_floor"] = grid.point_data["noise_floor"][:, :-1]
    write_vtk(grid, folder / "change.vtu")


def _odd_groups(folder):
    grid = _change_grid(dented_ball())
    grid.point_data["group"] = grid.point_data["group"] - 5
    write_vtk(grid, folder / "change.vtu")


def _flat_cells(folder):
    path = folder / "perturbed.vtu"
    write_vtk(curved_grid(dented_ball().perturbed), path)


DAMAGE = {
    "no summary": (lambda folder: (folder / "summary.json").unlink(), "F04"),
    "no change": (lambda folder: (folder / "change.vtu").unlink(), "F04"),
    "no perturbed": (lambda folder: (folder / "perturbed.vtu").unlink(), "F01"),
    "empty change": (_write("change.vtu", b""), "F02"),
    "empty summary": (_write("summary.json", b""), "F02"),
    "text for change": (_write("change.vtu", b"no XML"), "F03"),
    "half a change": (_cut("change.vtu", 0.5), "F03"),
    "half a perturbed": (_cut("perturbed.vtu", 0.9), "F03"),
    "half a summary": (_cut("summary.json", 0.5), "F06"),
    "bytes for summary": (_write("summary.json", b"\xff\xfe{"), "F06"),
    "deep summary": (_write("summary.json", b"[" * 100_000), "F06"),
    "list for summary": (_write("summary.json", b"[]"), "F04"),
    "another program's": (_write("summary.json", b'{"program": "x"}'), "F04"),
    "another command's": (_write("summary.json", b'{"isovary": "0.1.0"}'), "F04"),
    "another version": (_summary(isovary="99.1"), "F04"),
    "a version without numbers": (_summary(isovary=""), "F04"),
    "other counts": (_summary(counts={"nodes": 3}), "C09"),
    "no counts": (_summary(counts=None), "F04"),
    "flipped letter": (_flip, "F06"),
    "no noise": (_rename("noise_floor", "noise"), "F09"),
    "no signature": (_rename("hks_base", "hks"), "F09"),
    "no times": (_rename("times", "time"), "F09"),
    "fewer columns": (_fewer_columns, "F09"),
    "odd groups": (_odd_groups, "F09"),
    "no signature of the perturbed": (_flat_cells, "F09"),
    "a DOCTYPE": (_write("change.vtu", b"<!DOCTYPE x []><VTKFile></VTKFile>"), "F12"),
}


@pytest.mark.parametrize("name", DAMAGE)
def test_damage_is_told(name, copy):
    """Oracle: data. Each damaged folder ends in an error with its code, and says what to do."""
    damage, code = DAMAGE[name]
    damage(copy)
    with pytest.raises((FileError, CorrespondenceError)) as told:
        read_result(copy)
    assert told.value.code == code
    assert "expected" in told.value.message
    assert "got" in told.value.message


def test_files_of_two_results_are_told(copy, tmp_path):
    """Oracle: data. A perturbed grid with other times belongs to another result."""
    other = replace(dented_ball(), times=2 * dented_ball().times)
    shutil.copy(folder_of(other, tmp_path / "other") / "perturbed.vtu", copy)
    with pytest.raises(CorrespondenceError, match="files of two results") as told:
        read_result(copy)
    assert told.value.code == "C09"
