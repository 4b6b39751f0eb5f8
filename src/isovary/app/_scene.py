"""One view of the page: a surface, its colours and a few lines, as vtk.js draws them.

Nothing is drawn here: the scene is described to the browser, which draws it. No OpenGL is
needed. Only what changed is sent, so new colours are three bytes a triangle.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import vtkmodules.vtkInteractionStyle
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401 the classes behind vtkRenderingCore
from numpy.typing import NDArray
from trame_vtk.modules.vtk.serializers import registry
from trame_vtk.modules.vtk.serializers.helpers import get_array_description
from trame_vtk.modules.vtk.serializers.utils import reference_id, wrap_id
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonDataModel import vtkFieldData
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper, vtkRenderer, vtkRenderWindow

from ..geometry import Floats
from ._painting import Drawn

BACKGROUND = {False: (1.0, 1.0, 1.0), True: (0.086, 0.098, 0.114)}
"""Behind the surfaces, in the light and in the dark theme."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles (t, 3) between points (p, 3) with unit normals (p, 3)."""

    points: NDArray[Any]
    normals: NDArray[Any]
    triangles: NDArray[Any]

    @property
    def center(self) -> Floats:
        """The middle of its bounding box."""
        middle: Floats = (self.points.min(axis=0) + self.points.max(axis=0)) / 2
        return middle

    @property
    def reach(self) -> float:
        """The distance of its farthest point from there."""
        return float(np.linalg.norm(self.points - self.center, axis=1).max())


class _Mapper(vtkPolyDataMapper):
    """Holds what it draws as the arrays that the browser takes, by what they are."""

    def __init__(self) -> None:
        self.arrays = vtkFieldData()  # as long as they are here trame-vtk keeps them for browsers

    def take(self, name: str, values: np.ndarray, dtype: type) -> None:
        """Draw these values instead of those before."""
        array = numpy_to_vtk(np.ascontiguousarray(values, dtype=dtype), deep=True)
        array.SetName(name)
        self.arrays.AddArray(array)

    def take_cells(self, name: str, cells: np.ndarray) -> None:
        """The same for cells (m, k): before the corners of each stands their number."""
        counted = np.column_stack([np.full(len(cells), cells.shape[1]), cells])
        self.take(name, counted.ravel(), np.int32)


class Scene:
    """What one view shows: a surface, and lines upon it."""

    def __init__(self) -> None:
        self.window = vtkRenderWindow()
        self._renderer = vtkRenderer()
        self.window.AddRenderer(self._renderer)
        self._surface, self._lines = _Mapper(), _Mapper()
        self._actor, self._line_actor = _actor(self._surface), _actor(self._lines)
        self._surface.SetScalarModeToUseCellData()
        self._surface.SetColorModeToDirectScalars()
        self._lines.SetScalarVisibility(False)
        self._line_actor.GetProperty().SetLineWidth(3)
        self._line_actor.GetProperty().SetLighting(False)
        for actor in (self._actor, self._line_actor):
            self._renderer.AddActor(actor)
        self.dark(False)

    def dark(self, dark: bool) -> None:
        """Set the background and the lines' colour of the light or the dark theme."""
        self._renderer.SetBackground(*BACKGROUND[dark])
        self._line_actor.GetProperty().SetColor(*((1, 1, 1) if dark else (0, 0, 0)))

    def show(self, mesh: Mesh, colors: np.ndarray) -> None:
        """Show a surface, with a colour (t, 3) in bytes for each triangle."""
        self._surface.take("points", mesh.points, np.float32)
        self._surface.take("Normals", mesh.normals, np.float32)
        self._surface.take_cells("polys", mesh.triangles)
        self._actor.VisibilityOn()
        self.paint(colors)

    def clear(self) -> None:
        """Show nothing."""
        self._actor.VisibilityOff()
        self._line_actor.VisibilityOff()

    def paint(self, colors: np.ndarray) -> None:
        """Colour each triangle anew: (t, 3) in bytes."""
        self._surface.take("colors", colors, np.uint8)

    def draw_lines(self, ends: Floats) -> None:
        """Draw strokes (s, 2, 3) in the lines' colour, instead of those before."""
        self._lines.take("points", ends.reshape(-1, 3), np.float32)
        self._lines.take_cells("lines", np.arange(2 * len(ends)).reshape(-1, 2))
        self._line_actor.SetVisibility(len(ends) > 0)

    def look(self, camera: dict[str, list[float]]) -> None:
        """Set the camera that a browser starts with."""
        own = self._renderer.GetActiveCamera()
        own.SetPosition(*camera["position"])
        own.SetFocalPoint(*camera["focalPoint"])
        own.SetViewUp(*camera["viewUp"])


def camera_at(mesh: Mesh, direction: Floats, up: Floats) -> dict[str, list[float]]:
    """Where a camera stands that sees the whole mesh from a direction (3,).

    The view angle is 30 degrees; the mesh's bounding sphere fills eight tenths of it.
    """
    away = mesh.reach / np.sin(np.radians(15.0)) / 0.8
    return {
        "position": [float(x) for x in mesh.center + away * np.asarray(direction)],
        "focalPoint": [float(x) for x in mesh.center],
        "viewUp": [float(x) for x in up],
        "centerOfRotation": [float(x) for x in mesh.center],
    }


def describe_plainly() -> None:
    """Make trame-vtk describe these mappers by their arrays, each hashed and sent only once."""
    registry.register_instance_serializer("vtkMapper", _described_mapper)


def _described_mapper(parent: Any, mapper: Any, name: str, context: Any, _depth: int) -> Any:
    """A mapper and what it draws, as vtk.js's synchronizer expects them."""
    if not mapper.arrays.HasArray("points"):
        return None
    data = f"{name}-dataset"
    return {
        "parent": reference_id(parent),
        "id": name,
        "type": registry.class_name(mapper),
        "properties": {
            "scalarVisibility": mapper.GetScalarVisibility(),
            "colorByArrayName": "colors",
            "arrayAccessMode": 1,
            "colorMode": mapper.GetColorMode(),
            "scalarMode": mapper.GetScalarMode(),
            "interpolateScalarsBeforeMapping": 0,
        },
        "calls": [["setInputData", [wrap_id(data)]]],
        "dependencies": [_described_data(mapper, data, context)],
    }


def _described_data(mapper: _Mapper, name: str, context: Any) -> dict[str, Any]:
    described = {
        kind: get_array_description(mapper.arrays.GetArray(kind), context)
        for kind in ("points", "Normals", "colors", "polys", "lines")
        if mapper.arrays.HasArray(kind)
    }
    kinds = {"points": "vtkPoints", "polys": "vtkCellArray", "lines": "vtkCellArray"}
    properties: dict[str, Any] = {
        kind: described[kind] | {"vtkClass": js} for kind, js in kinds.items() if kind in described
    }
    fields = {"Normals": ("pointData", "setNormals"), "colors": ("cellData", "setScalars")}
    properties["fields"] = [
        described[kind] | {"location": place, "registration": setter}
        for kind, (place, setter) in fields.items()
        if kind in described
    ]
    return {
        "parent": reference_id(mapper),
        "id": name,
        "type": "vtkPolyData",
        "properties": properties,
    }


def _actor(mapper: _Mapper) -> vtkActor:
    actor = vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetAmbient(0.25)
    actor.GetProperty().SetDiffuse(0.8)
    actor.GetProperty().SetSpecular(0.05)
    actor.VisibilityOff()
    return actor


def mesh_of(drawn: Drawn) -> Mesh:
    """The triangles of a surface that is drawn."""
    return Mesh(drawn.points, drawn.normals, drawn.triangles)
