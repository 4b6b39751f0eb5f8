"""What every result folder is written with: VTK files, plain JSON, versions, timed stages."""

from __future__ import annotations

import json
import math
import platform
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..geometry import linear_triangles
from ..levels import Progress
from ..records import Surface

if TYPE_CHECKING:
    import pyvista as pv

_PACKAGES = (
    "numpy",
    "scipy",
    "vtk",
    "pyvista",
    "robust_laplacian",
    "matplotlib",
    "plotly",
)
_VTK_TRIANGLE, _VTK_QUADRATIC_TRIANGLE = 5, 22


@contextmanager
def stage(
    name: str, done: float, timings: dict[str, float], progress: Progress | None
) -> Iterator[None]:
    """Tell that a stage begins and time its body."""
    if progress:
        progress(name, done)
    start = time.perf_counter()
    yield
    timings[name] = time.perf_counter() - start


def curved_grid(surface: Surface) -> pv.UnstructuredGrid:
    """The surface with its true cells: six-node triangles for order 2."""
    import pyvista as pv

    cell = _VTK_TRIANGLE if surface.order == 1 else _VTK_QUADRATIC_TRIANGLE
    return pv.UnstructuredGrid({cell: surface.triangles}, surface.points)


def flat_triangles(surface: Surface) -> pv.PolyData:
    """The surface in flat triangles over the same nodes: four for each curved one."""
    import pyvista as pv

    pieces = linear_triangles(surface.triangles)
    faces = np.hstack([np.full((len(pieces), 1), 3), pieces])
    return pv.PolyData(surface.points, faces=faces.ravel())


def write_vtk(data: pv.DataSet, path: Path) -> None:
    """VTK makes the XML in memory and Python writes it: VTK's own writer crashes on a full disk."""
    from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter, vtkXMLUnstructuredGridWriter

    writer = vtkXMLPolyDataWriter() if path.suffix == ".vtp" else vtkXMLUnstructuredGridWriter()
    writer.SetInputData(data)
    writer.SetDataModeToBinary()
    writer.SetCompressorTypeToZLib()
    writer.WriteToOutputStringOn()
    writer.Write()
    path.write_text(writer.GetOutputString(), encoding="utf-8")


def write_summary(summary: dict[str, Any], folder: Path) -> None:
    """Write ``summary.json``, the last file: the versions, then the summary."""
    head = {
        "isovary": version("isovary"),
        "versions": {
            "python": platform.python_version(),
            "platform": platform.platform(),
            **{name: version(name) for name in _PACKAGES},
        },
    }
    text = json.dumps(_plain(head | summary), indent=2, allow_nan=False)
    (folder / "summary.json").write_text(text + "\n", encoding="utf-8")


def seconds(timings: dict[str, float]) -> dict[str, float]:
    """Timings to the millisecond."""
    return {name: round(value, 3) for name, value in timings.items()}


def _plain(value: Any) -> Any:
    """The value in JSON's own types; NaN and infinity become null."""
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
