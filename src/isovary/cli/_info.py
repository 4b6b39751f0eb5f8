"""``isovary info``."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..geometry import topology
from ..io import read_field
from ..meshing import contour, interpolation_errors
from ..notes import noted_warnings
from ._app import app, say

_QUANTILES = (0.5, 0.9, 0.99)


@app.command
def info(
    file: Path,
    /,
    *,
    array: str | None = None,
    spacing: tuple[float, float, float] | None = None,
    origin: tuple[float, float, float] | None = None,
    isovalue: float | None = None,
) -> None:
    """Tell what a field file holds, and with --isovalue what its isosurface is like.

    Parameters
    ----------
    file
        Field file: .vti, .npy, .npz, .cube or .cube.gz.
    array
        Array to read, where the file holds several; "s[3]" takes index 3 of a 4-D array.
    spacing
        Distance of samples along x, y, z for .npy and .npz files.
    origin
        Position of the first sample for .npy and .npz files.
    isovalue
        Value of the isosurface to describe.
    """
    with noted_warnings() as notes:
        field = read_field(file, array, spacing=spacing, origin=origin)
    low, high = field.bounds
    rows = {
        "array": field.name,
        "samples": " x ".join(map(str, field.values.shape)),
        "spacing": _numbers(field.spacing),
        "box": f"{_numbers(low)}  to  {_numbers(high)}",
        "values": f"{field.values.min():.6g} to {field.values.max():.6g}",
        "quantiles": "  ".join(
            f"{q:.0%}: {v:.4g}"
            for q, v in zip(_QUANTILES, np.quantile(field.values, _QUANTILES), strict=True)
        ),
    }
    if isovalue is not None:
        surface = contour(field, isovalue)
        errors = interpolation_errors(field, isovalue)
        rows["isosurface"] = f"{topology(surface.triangles)}, area about {surface.area:.5g}"
        rows["half-grid error"] = ", ".join(f"{k} {v:.2g}" for k, v in errors.items()) + " (length)"
    for note in notes:
        say(f"note: {note}")
    for name, text in rows.items():
        say(f"{name:<16} {text}")


def _numbers(values: np.ndarray) -> str:
    return " ".join(f"{value:.6g}" for value in values)
