"""A result's nodes as a table of text."""

from __future__ import annotations

import csv
import os
from pathlib import Path

import numpy as np

from ..errors import FileError

_PLAIN = (
    "change_norm",
    "noise_norm",
    "significant",
    "group",
    "strain",
    "kind_of_change",
    "normal_displacement",
    "displacement",
    "deformation",
    "partner",
    "partner_found",
    "rim_distance",
)


def export_csv(folder: str | os.PathLike[str], path: str | os.PathLike[str], *, full: bool) -> int:
    """Write a row for each node of a result's base surface: node, x, y, z, then its values.

    Parameters
    ----------
    folder : path
        What ``compare`` wrote.
    path : path
        The CSV file, which does not exist yet; it is there once it is whole.
    full : bool
        Also both signatures, the change and its noise floor at every time: 4 T columns more,
        named ``hks_change[0.25]`` with the time in brackets.

    Returns
    -------
    int
        Number of nodes.

    Raises
    ------
    FileError
        F01 if the folder holds no result, W02 for a file that exists, W07 if it cannot be written.
    """
    target = Path(path)
    if target.exists():
        raise FileError(
            "W02", f"csv: expected a new file, got {target}, which exists; name another"
        )
    names, columns = _table(Path(folder), full)
    beside = target.with_name(f".{target.name}.{os.getpid()}")
    try:
        with beside.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(names)
            writer.writerows(zip(*(column.tolist() for column in columns), strict=True))
        beside.replace(target)
    except OSError as error:
        raise FileError("W07", f"csv: expected a file to write, got {target}: {error}") from error
    finally:
        beside.unlink(missing_ok=True)
    return len(columns[0])


def _table(folder: Path, full: bool) -> tuple[list[str], list[np.ndarray]]:
    """Names and values (n,) of the columns."""
    import pyvista as pv

    path = folder / "change.vtu"
    if not path.is_file():
        raise FileError(
            "F01", f"result: expected a folder with change.vtu, got {folder}; run isovary compare"
        )
    grid = pv.read(path)
    names, columns = ["node"], [np.arange(grid.n_points)]

    def add(name: str, values: np.ndarray, parts: list[str]) -> None:
        rows = np.asarray(values).reshape(grid.n_points, -1)
        names.extend([name] if not parts else [f"{name}{part}" for part in parts])
        columns.extend(rows.T)

    add("", grid.points, ["x", "y", "z"])
    arrays = grid.point_data
    for name in _PLAIN:
        if name in arrays:
            add(name, arrays[name], ["_x", "_y", "_z"] if arrays[name].ndim == 2 else [])
    if full:
        axis = grid.field_data["times" if "times" in grid.field_data else "columns"]
        for name in arrays:
            if name not in _PLAIN and arrays[name].ndim == 2:
                add(name, arrays[name], [f"[{value:.6g}]" for value in axis])
    return names, columns
