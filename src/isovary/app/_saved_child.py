"""Child process that lets VTK parse a grid with all its arrays: a crash ends here.

Run as a script: ``python _saved_child.py FILE OUTPUT.npz``; prints a JSON report.
It imports nothing of isovary, and of VTK only the XML reader.
"""

from __future__ import annotations

import json
import sys
from typing import Any

import numpy as np


def main(path: str, output: str) -> dict[str, Any]:
    """Save points, cells, and the arrays of points and field; report VTK's log and the cells."""
    from vtkmodules.vtkCommonCore import vtkOutputWindow, vtkStringOutputWindow
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

    log = vtkStringOutputWindow()
    vtkOutputWindow.SetInstance(log)
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(path)
    reader.Update()
    grid = reader.GetOutput()
    report: dict[str, Any] = {"log": _said(log), "points": grid.GetNumberOfPoints()}
    if reader.GetErrorCode() and not report["log"]:
        report["log"] = f"error code {reader.GetErrorCode()}"
    if report["log"] or not report["points"] or not grid.GetNumberOfCells():
        return report | {"cells": []}
    return report | _save(grid, output)


def _said(log: Any) -> str:
    """VTK's messages, but for its norm of arrays with NaN, which it writes and cannot read."""
    messages = log.GetOutput().strip().split("\n\n")
    return "\n\n".join(text for text in messages if "InformationKey element" not in text).strip()


def _save(grid: Any, output: str) -> dict[str, Any]:
    from vtkmodules.util.numpy_support import vtk_to_numpy

    cells = grid.GetCells()
    cells.ConvertTo64BitStorage()
    types = sorted({grid.GetCellType(i) for i in range(grid.GetNumberOfCells())})
    arrays = {
        "points": vtk_to_numpy(grid.GetPoints().GetData()).astype(np.float64),
        "nodes": vtk_to_numpy(cells.GetConnectivityArray()).astype(np.int64),
    }
    for kind, data in (("point", grid.GetPointData()), ("field", grid.GetFieldData())):
        for number in range(data.GetNumberOfArrays()):
            array = data.GetArray(number)
            if array is not None and array.GetName():
                arrays[f"{kind} {array.GetName()}"] = vtk_to_numpy(array)
    np.savez(output, **arrays)
    return {"cells": types, "count": grid.GetNumberOfCells()}


if __name__ == "__main__":
    print(json.dumps(main(*sys.argv[1:])))
