"""A result as a table of text."""

from __future__ import annotations

import csv

import numpy as np
import pytest

import isovary as iv
from isovary.io._export import export_csv
from isovary.io._results import save


def ball(radius):
    return iv.ScalarField.from_function(
        lambda p: radius - np.linalg.norm(p, axis=-1), ((-1.5,) * 3, (1.5,) * 3), (17,) * 3
    )


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ISOVARY_NO_OPENGL", "1")
        result = iv.compare(ball(1.0), ball(1.02), 0.0, vertices=60, pairs=30, times=6)
        return result, save(result, tmp_path_factory.mktemp("export") / "out")


def read(path):
    with path.open(newline="", encoding="utf-8") as file:
        names, *rows = csv.reader(file)
    return names, np.array(rows, dtype=float)


def test_every_node_has_its_row(saved, tmp_path):
    """Oracle: algebra. The numbers in the text are the comparison's, to the last digit stored."""
    result, folder = saved
    path = tmp_path / "nodes.csv"
    assert export_csv(folder, path, full=True) == len(result.base.points)
    names, rows = read(path)
    table = dict(zip(names, rows.T, strict=True))
    np.testing.assert_array_equal(table["node"], np.arange(len(rows)))
    np.testing.assert_allclose(
        np.column_stack([table[k] for k in "xyz"]), result.base.points, rtol=1e-12
    )
    np.testing.assert_allclose(table["change_norm"], result.change_norm, rtol=1e-12)
    np.testing.assert_array_equal(table["group"], result.clusters.labels)
    for k, time in enumerate(result.times):
        np.testing.assert_allclose(
            table[f"hks_change[{time:.6g}]"], result.change[:, k], rtol=1e-12
        )
        np.testing.assert_allclose(
            table[f"noise_floor[{time:.6g}]"], result.noise_floor[:, k], rtol=1e-12
        )
    assert list(tmp_path.iterdir()) == [path]  # nothing left beside it


def test_by_default_the_table_is_short(saved, tmp_path):
    """Oracle: algebra. No column for single times."""
    export_csv(saved[1], tmp_path / "nodes.csv", full=False)
    names, rows = read(tmp_path / "nodes.csv")
    assert rows.shape[1] == len(names) < 30
    assert not any("[" in name for name in names)


def test_nothing_is_overwritten(saved, tmp_path):
    """Oracle: data. A file of one's own stays; a folder that is not there is told."""
    path = tmp_path / "nodes.csv"
    path.write_text("precious")
    with pytest.raises(iv.FileError, match="W02"):
        export_csv(saved[1], path, full=False)
    assert path.read_text() == "precious"
    with pytest.raises(iv.FileError, match="W07"):
        export_csv(saved[1], tmp_path / "nowhere" / "nodes.csv", full=False)


def test_no_result_is_an_error(tmp_path):
    """Oracle: data. A folder without a result: F01, and no file."""
    with pytest.raises(iv.FileError, match="F01"):
        export_csv(tmp_path, tmp_path / "nodes.csv", full=False)
    assert list(tmp_path.iterdir()) == []
