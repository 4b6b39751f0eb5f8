"""VTK image files (.vti): header checked here, data parsed by VTK in a child process."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import FileError
from ._checks import Samples, choose
from ._child import run_child
from ._vti_header import (
    BYTES,
    Header,
    check_lengths,
    check_pieces,
    check_room,
    extent,
    image_shape,
    numbers,
    read_header,
)

_CHILD = Path(__file__).with_name("_vti_child.py")


def read_vti(path: Path, array: str | None) -> Samples:
    """Samples of a point array with one component of a VTK image file."""
    header = read_header(path)
    shape = image_shape(path, header)
    name = choose(path, array, _scalars(path, header, array))
    check_room(path, header, header.named("PointData")[name], math.prod(shape))
    check_pieces(path, header, shape)
    check_lengths(path, header)
    spacing, origin = _grid(path, header)
    values = _parse(path, name)
    if values.shape != shape:
        raise FileError("F06", f"{path}: expected shape {shape}, got {values.shape} from VTK")
    return Samples(values, spacing if "Spacing" in header.image else None, origin, name)


def _grid(path: Path, header: Header) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Spacing, and the position of the first sample."""
    image = header.image
    direction = numbers(path, image, "Direction", "1 0 0 0 1 0 0 0 1")
    if not np.array_equal(direction, np.eye(3).ravel()):
        raise FileError(
            "F14",
            f"{path}: direction: expected the identity, got {direction.tolist()}; "
            "resample the image onto axes along x, y and z",
        )
    spacing = numbers(path, image, "Spacing", "1 1 1")
    first = extent(path, image, "WholeExtent")[:, 0]
    return spacing, numbers(path, image, "Origin", "0 0 0") + spacing * first


def _scalars(path: Path, header: Header, array: str | None) -> list[str]:
    """Names of the point arrays of numbers with one component."""
    points, cells = header.named("PointData"), header.named("CellData")
    names = [
        name
        for name, attributes in points.items()
        if attributes.get("NumberOfComponents", "1") == "1" and attributes.get("type") in BYTES
    ]
    if array in names or (names and array not in cells):
        return names
    if cells and (array in cells or not points):
        raise FileError(
            "F09",
            f"{path}: expected point data, got cell data {list(cells)[:5]}; convert it, "
            "for example with ParaView's filter Cell Data to Point Data",
        )
    others = ", ".join(map(repr, points)) or "none"
    raise FileError(
        "F09",
        f"{path}: expected a point array of numbers with one component, got {others}; "
        "write the magnitude or one component",
    )


def _parse(path: Path, name: str) -> NDArray[Any]:
    """The array [x, y, z] as VTK reads it; FileError F06 with VTK's complaints."""
    with tempfile.TemporaryDirectory(prefix="isovary-") as folder:
        output = Path(folder) / "values.npy"
        report = run_child(_CHILD, path, name, str(output))
        if report["log"] or not output.exists():
            got = " ".join(report["log"].split())[:500] or f"{report['count']} values"
            raise FileError(
                "F06", f"{path}: expected VTK to read array {name!r}, got: {got}; write it again"
            )
        values: NDArray[Any] = np.load(output, allow_pickle=False)
        return values
