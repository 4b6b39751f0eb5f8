"""Child process that lets VTK parse a mesh: a crash ends here, not in the caller.

Run as a script: ``python _surface_child.py FILE SUFFIX OUTPUT.npz``; prints a JSON report.
It imports nothing of isovary, and of VTK only what the format needs.
"""

from __future__ import annotations

import importlib
import json
import sys
from collections import Counter
from typing import Any

import numpy as np

READERS = {
    ".vtp": ("vtkIOXML", "vtkXMLPolyDataReader"),
    ".vtu": ("vtkIOXML", "vtkXMLUnstructuredGridReader"),
    ".vtk": ("vtkIOLegacy", "vtkGenericDataObjectReader"),
    ".ply": ("vtkIOPLY", "vtkPLYReader"),
    ".stl": ("vtkIOGeometry", "vtkSTLReader"),
    ".obj": ("vtkIOGeometry", "vtkOBJReader"),
    ".off": ("vtkIOGeometry", "vtkOFFReader"),
}
TRIANGLE, STRIP, POLYGON, PIXEL, QUAD, CURVED = 5, 6, 7, 8, 9, 22
FLAT = {TRIANGLE, STRIP, POLYGON, PIXEL, QUAD}
THIN = {1, 2, 3, 4}  # vertices and lines


def main(path: str, suffix: str, output: str) -> dict[str, Any]:
    """Save points and triangles, and report VTK's log and the cells that were found."""
    from vtkmodules.vtkCommonCore import vtkOutputWindow, vtkStringOutputWindow

    log = vtkStringOutputWindow()
    vtkOutputWindow.SetInstance(log)
    data, code = _read(path, suffix)
    said = _said(log) or (f"error code {code}" if code else "")
    kind = "nothing" if data is None else data.GetClassName()
    report: dict[str, Any] = {"log": said, "kind": kind}
    if not said and kind in ("vtkPolyData", "vtkUnstructuredGrid"):
        report |= _save(data, output)
        report["log"] = _said(log)
    return report


def _said(log: Any) -> str:
    """VTK's messages, but for its norm of arrays with NaN, which it writes and cannot read."""
    messages = log.GetOutput().strip().split("\n\n")
    return "\n\n".join(text for text in messages if "InformationKey element" not in text).strip()


def _read(path: str, suffix: str) -> tuple[Any, int]:
    module, name = READERS[suffix]
    reader = getattr(importlib.import_module(f"vtkmodules.{module}"), name)()
    reader.SetFileName(path)
    if suffix == ".stl":
        reader.SetMerging(False)  # merging is ours, so that it can be counted
    if module == "vtkIOXML":
        reader.UpdateInformation()
        reader.GetPointDataArraySelection().DisableAllArrays()
        reader.GetCellDataArraySelection().DisableAllArrays()
    reader.Update()
    return reader.GetOutput(), reader.GetErrorCode()


def _save(data: Any, output: str) -> dict[str, Any]:
    """Points and triangles to ``output``; what the cells are, and how many were split."""
    points = _points(data)
    types, sizes, nodes = _cells(data)
    outside = nodes[(nodes < 0) | (nodes >= len(points))]
    report: dict[str, Any] = {
        "points": len(points),
        "cells": _names(types),
        "thin": int(np.isin(types, list(THIN)).sum()),
        "outside": outside[:1].tolist(),
        "short": int((sizes[~np.isin(types, list(THIN))] < 3).sum()),
    }
    faces = ~np.isin(types, list(THIN))
    kinds = set(types[faces].tolist())
    if outside.size or report["short"] or not kinds or not (kinds <= FLAT or kinds == {CURVED}):
        return report | {"refused": bool(kinds)}
    nodes, sizes, types = nodes[np.repeat(faces, sizes)], sizes[faces], types[faces]
    if kinds == {CURVED}:
        triangles, split, lost = nodes.reshape(-1, 6), 0, 0
    else:
        triangles, lost = _triangles(points, types, sizes, nodes)
        split = int((types != TRIANGLE).sum())
    np.savez(output, points=points, triangles=triangles.astype(np.int64))
    return report | {"refused": False, "split": split, "lost": lost}


def _points(data: Any) -> Any:
    from vtkmodules.util.numpy_support import vtk_to_numpy

    if data.GetPoints() is None:
        return np.zeros((0, 3))
    return vtk_to_numpy(data.GetPoints().GetData()).astype(np.float64)


def _cells(data: Any) -> tuple[Any, Any, Any]:
    """VTK type and number of nodes of each cell, and all their nodes."""
    if data.GetClassName() == "vtkPolyData":
        groups = [
            _group(data.GetVerts(), {1: 1}, 2),
            _group(data.GetLines(), {2: 3}, 4),
            _group(data.GetPolys(), {3: TRIANGLE, 4: QUAD}, POLYGON),
            _group(data.GetStrips(), {}, STRIP),
        ]
    else:
        count = data.GetNumberOfCells()
        types = np.array([data.GetCellType(i) for i in range(count)], dtype=np.int64)
        groups = [(types, *_group(data.GetCells(), {}, 0)[1:])] if count else []
    joined = [np.concatenate(parts) for parts in zip(*groups, strict=True)]
    return (joined[0], joined[1], joined[2]) if joined else (np.zeros(0, np.int64),) * 3


def _group(array: Any, by_size: dict[int, int], other: int) -> tuple[Any, Any, Any]:
    from vtkmodules.util.numpy_support import vtk_to_numpy

    if array is None or array.GetNumberOfCells() == 0:
        return (np.zeros(0, np.int64),) * 3
    array.ConvertTo64BitStorage()
    sizes = np.diff(vtk_to_numpy(array.GetOffsetsArray()))
    types = np.full(len(sizes), other, dtype=np.int64)
    for size, kind in by_size.items():
        types[sizes == size] = kind
    return types, sizes, vtk_to_numpy(array.GetConnectivityArray())


def _triangles(points: Any, types: Any, sizes: Any, nodes: Any) -> tuple[Any, int]:
    """Corners of the triangles of flat faces, and how many of them VTK did not make."""

    def of(kind: int) -> Any:
        return nodes[np.repeat(types == kind, sizes)]

    whole = [of(TRIANGLE).reshape(-1, 3), _halves(points, of(QUAD).reshape(-1, 4))]
    whole.append(_halves(points, of(PIXEL).reshape(-1, 4)[:, [0, 1, 3, 2]]))  # rows side by side
    many = [_cut(points, sizes[types == kind], of(kind), kind) for kind in (POLYGON, STRIP)]
    expected = int((sizes[(types == POLYGON) | (types == STRIP)] - 2).sum())
    return np.concatenate([*whole, *many]), expected - sum(map(len, many))


def _halves(points: Any, quads: Any) -> Any:
    """Two triangles for each quad, cut along the diagonal that lies inside, else the shorter."""
    corners = points[quads]
    first, second = corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]
    normal = np.cross(first, second)
    ways = [quads[:, [0, 1, 2, 0, 2, 3]], quads[:, [1, 2, 3, 1, 3, 0]]]
    worth = []
    for way in ways:
        a, b, c = np.moveaxis(points[way.reshape(-1, 2, 3)], 2, 0)
        worth.append((np.cross(b - a, c - a) * normal[:, None]).sum(axis=-1).min(axis=1) > 0)
    shorter = (first**2).sum(axis=1) <= (second**2).sum(axis=1)
    take_first = np.where(worth[0] == worth[1], shorter, worth[0])
    return np.where(take_first[:, None], ways[0], ways[1]).reshape(-1, 3)


def _cut(points: Any, sizes: Any, nodes: Any, kind: int) -> Any:
    """Triangles into which VTK cuts polygons or strips."""
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
    from vtkmodules.vtkFiltersCore import vtkTriangleFilter

    if len(sizes) == 0:
        return np.zeros((0, 3), dtype=np.int64)
    corners, cells, mesh, cutter = vtkPoints(), vtkCellArray(), vtkPolyData(), vtkTriangleFilter()
    corners.SetData(numpy_to_vtk(points, deep=True))
    offsets = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
    ids = np.ascontiguousarray(nodes, dtype=np.int64)
    cells.SetData(*(numpy_to_vtkIdTypeArray(part, deep=True) for part in (offsets, ids)))
    mesh.SetPoints(corners)
    (mesh.SetStrips if kind == STRIP else mesh.SetPolys)(cells)
    cutter.SetInputData(mesh)
    cutter.Update()
    polys = cutter.GetOutput().GetPolys()
    polys.ConvertTo64BitStorage()
    return vtk_to_numpy(polys.GetConnectivityArray()).reshape(-1, 3)


def _names(types: Any) -> dict[str, int]:
    """How many cells there are of each type, by VTK's name."""
    from vtkmodules import vtkCommonDataModel

    try:
        name = vtkCommonDataModel.vtkCellTypeUtilities.GetClassNameFromTypeId
    except AttributeError:  # before VTK 9.6
        name = vtkCommonDataModel.vtkCellTypes.GetClassNameFromTypeId
    return {str(name(kind)): count for kind, count in Counter(types.tolist()).items()}


if __name__ == "__main__":
    print(json.dumps(main(*sys.argv[1:])))
