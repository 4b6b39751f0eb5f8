"""Search on the flat pieces of a surface's triangles, with VTK."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..geometry import Floats, Ints, linear_triangles
from ..records import Surface

if TYPE_CHECKING:
    from vtkmodules.vtkCommonDataModel import vtkStaticCellLocator


def build_locator(surface: Surface) -> vtkStaticCellLocator:
    """VTK locator over the surface's flat pieces (four for each six-node triangle)."""
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData, vtkStaticCellLocator

    pieces = linear_triangles(surface.triangles)
    points = vtkPoints()
    points.SetData(numpy_to_vtk(surface.points, deep=True))
    offsets = np.arange(0, 3 * len(pieces) + 1, 3, dtype=np.int64)
    cells = vtkCellArray()
    cells.SetData(
        numpy_to_vtkIdTypeArray(offsets, deep=True),
        numpy_to_vtkIdTypeArray(pieces.ravel(), deep=True),
    )
    mesh = vtkPolyData()
    mesh.SetPoints(points)
    mesh.SetPolys(cells)
    locator = vtkStaticCellLocator()
    locator.SetDataSet(mesh)
    locator.BuildLocator()
    return locator


def nearest_pieces(points: Floats, surface: Surface) -> Ints:
    """The flat piece (n,) nearest to each point."""
    from vtkmodules.vtkCommonCore import reference
    from vtkmodules.vtkCommonDataModel import vtkGenericCell

    locator = build_locator(surface)
    cell, number, part, square = vtkGenericCell(), reference(0), reference(0), reference(0.0)
    found = np.empty(len(points), dtype=np.int64)
    place = [0.0, 0.0, 0.0]
    for row, point in enumerate(points):
        locator.FindClosestPoint(point.tolist(), place, cell, number, part, square)  # type: ignore[call-overload]
        found[row] = int(number)
    return found


def pieces_on_lines(
    starts: Floats, ends: Floats, surface: Surface, tolerance: float
) -> tuple[Ints, Ints]:
    """Line and flat piece of every crossing, and of what misses by less than the tolerance."""
    from vtkmodules.vtkCommonCore import vtkIdList, vtkPoints

    locator = build_locator(surface)
    cells, places = vtkIdList(), vtkPoints()
    lines, pieces = [], []
    for row in range(len(starts)):
        locator.IntersectWithLine(starts[row], ends[row], tolerance, places, cells)
        count = cells.GetNumberOfIds()
        lines += [row] * count
        pieces += [cells.GetId(i) for i in range(count)]
        cells.Reset()
        places.Reset()
    return np.array(lines, dtype=np.int64), np.array(pieces, dtype=np.int64)
