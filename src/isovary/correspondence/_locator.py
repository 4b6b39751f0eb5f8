"""Search on a surface's triangles with VTK, refined on its curved elements."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..geometry import (
    LINEAR_PIECES,
    Floats,
    Ints,
    linear_triangles,
    node_places,
    shape_functions,
    shape_gradients,
)
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


def to_parent(surface: Surface, piece: Ints, barycentric: Floats) -> tuple[Ints, Floats]:
    """Triangle and barycentric coordinates of a place given in a flat piece."""
    if surface.order == 1:
        return piece, barycentric
    nodes = np.array(LINEAR_PIECES)[piece % 4]
    places = node_places(2)[nodes]
    return piece // 4, np.einsum("nk,nkb->nb", barycentric, places)


def position(surface: Surface, triangle: Ints, barycentric: Floats) -> Floats:
    """Points (n, 3) on the curved elements."""
    weights = shape_functions(barycentric, surface.order)
    points: Floats = np.einsum("ni,nid->nd", weights, surface.points[surface.triangles[triangle]])
    return points


def tangents_at(surface: Surface, triangle: Ints, barycentric: Floats) -> Floats:
    """Tangents (n, 3, 2) of the curved elements."""
    gradients = shape_gradients(barycentric, surface.order)
    tangents: Floats = np.einsum(
        "nik,nid->ndk", gradients, surface.points[surface.triangles[triangle]]
    )
    return tangents


def step_within(barycentric: Floats, move: Floats) -> Floats:
    """Barycentric coordinates after a local step (n, 2), kept inside the triangle."""
    moved = barycentric + np.column_stack([-move.sum(axis=1), move])
    moved = np.clip(moved, 0.0, None)
    inside: Floats = moved / moved.sum(axis=1, keepdims=True)
    return inside


def flat_barycentric(corners: Floats, points: Floats) -> Floats:
    """Barycentric coordinates (n, 3) of points put onto flat triangles (n, 3, 3), in [0, 1]."""
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    offset = points - corners[:, 0]
    a = np.einsum("nd,nd->n", first, first)
    b = np.einsum("nd,nd->n", first, second)
    c = np.einsum("nd,nd->n", second, second)
    u = np.einsum("nd,nd->n", offset, first)
    v = np.einsum("nd,nd->n", offset, second)
    determinant = a * c - b * b
    local = np.column_stack([c * u - b * v, a * v - b * u]) / determinant[:, None]
    return step_within(np.tile([1.0, 0.0, 0.0], (len(points), 1)), local)
