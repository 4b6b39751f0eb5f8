"""Child process that lets VTK parse an image file: a crash ends here, not in the caller.

Run as a script: ``python _vti_child.py FILE ARRAY OUTPUT.npy``; prints a JSON report.
It imports nothing of isovary, and of VTK only the XML readers.
"""

from __future__ import annotations

import json
import sys
from typing import Any


def main(path: str, array: str, output: str) -> dict[str, Any]:
    """Save one point array, indexed x, y, z, and report VTK's log."""
    import numpy as np
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkOutputWindow, vtkStringOutputWindow
    from vtkmodules.vtkIOXML import vtkXMLImageDataReader

    log = vtkStringOutputWindow()
    vtkOutputWindow.SetInstance(log)
    reader = vtkXMLImageDataReader()
    reader.SetFileName(path)
    reader.UpdateInformation()
    reader.GetCellDataArraySelection().DisableAllArrays()
    reader.GetPointDataArraySelection().DisableAllArrays()
    reader.GetPointDataArraySelection().EnableArray(array)
    reader.Update()
    image = reader.GetOutput()
    data = image.GetPointData().GetArray(array)
    report = {
        "log": log.GetOutput().strip() or _failure(reader.GetErrorCode()),
        "count": 0 if data is None else data.GetNumberOfTuples(),
    }
    if data is not None and report["count"] == image.GetNumberOfPoints() and not report["log"]:
        values = vtk_to_numpy(data)
        values = values.reshape(image.GetDimensions()[::-1])
        np.save(output, values.transpose(2, 1, 0), allow_pickle=False)
    return report


def _failure(code: int) -> str:
    return f"error code {code}" if code else ""


if __name__ == "__main__":
    print(json.dumps(main(*sys.argv[1:])))
