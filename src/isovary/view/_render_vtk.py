"""A scene drawn by VTK into an image, shown in matplotlib axes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyvista as pv
from matplotlib.axes import Axes

from ..geometry import Floats
from ._camera import Camera
from ._scene import AMBIENT, DIFFUSE, Scene

_FINER = 2  # pixels drawn for one shown, averaged: smooth edges on every driver
_PIXELS = 2.0  # shown for a point of a line's width
_LIGHT: dict[str, Any] = {"ambient": AMBIENT, "diffuse": DIFFUSE, "specular": 0.0}


def draw(axes: Axes, scene: Scene, camera: Camera) -> None:
    """Draw a scene into axes whose limits are lengths in the camera's plane."""
    window = (*axes.get_xlim(), *axes.get_ylim())
    box = axes.get_window_extent()
    pixels = (max(round(box.width), 1), max(round(box.height), 1))
    image = _image(scene, camera, window, pixels)
    axes.imshow(image, extent=window, aspect="auto", interpolation="antialiased")


def _image(
    scene: Scene, camera: Camera, window: tuple[float, ...], pixels: tuple[int, int]
) -> Floats:
    """RGB image (height, width, 3) of the window, white where nothing is."""
    with pv.vtk_verbosity("off"):  # without a screen VTK tries X first and complains
        return _shot(scene, camera, window, pixels)


def _shot(
    scene: Scene, camera: Camera, window: tuple[float, ...], pixels: tuple[int, int]
) -> Floats:
    size = [_FINER * n for n in pixels]
    plotter = pv.Plotter(off_screen=True, window_size=size, lighting="none")
    try:
        plotter.set_background("white")  # type: ignore[arg-type]
        plotter.add_light(pv.Light(light_type="headlight"))
        for drawn in [scene] if scene.second is None else [scene, scene.second]:
            mesh = _poly(drawn)
            plotter.add_mesh(mesh, scalars="color", rgb=True, **_LIGHT).prop.interpolation = "Phong"
        for strokes in scene.strokes:
            lines = pv.line_segments_from_points(strokes.ends.reshape(-1, 3))
            lines.cell_data["color"] = _bytes(strokes.colors)
            wide = _FINER * _PIXELS * strokes.width
            plotter.add_mesh(lines, scalars="color", rgb=True, line_width=wide, lighting=False)
        _aim(plotter, camera, window)
        image = np.asarray(plotter.screenshot(return_img=True), dtype=float) / 255
    finally:
        plotter.close()
    blocks = image.reshape(pixels[1], _FINER, pixels[0], _FINER, 3)
    shown: Floats = blocks.mean(axis=(1, 3))
    return shown


def _poly(scene: Scene) -> pv.PolyData:
    faces: Any = scene.pieces.triangles
    mesh: pv.PolyData = pv.PolyData.from_regular_faces(scene.pieces.points, faces)
    mesh.point_data.active_normals = scene.pieces.normals
    mesh.cell_data["color"] = _bytes(scene.colors)
    return mesh


def _bytes(colors: Floats) -> np.ndarray:
    return np.round(255 * colors).astype(np.uint8)


def _aim(plotter: pv.Plotter, camera: Camera, window: tuple[float, ...]) -> None:
    left, right, bottom, top = window
    depth = camera.high[2] - camera.low[2]
    middle = np.array([(left + right) / 2, (bottom + top) / 2, (camera.low + camera.high)[2] / 2])
    focus = middle @ camera.axes
    distance = 2 * (depth + right - left)
    plotter.camera.focal_point = focus
    plotter.camera.position = focus + distance * camera.axes[2]
    plotter.camera.up = camera.axes[1]
    plotter.camera.parallel_projection = True
    plotter.camera.parallel_scale = (top - bottom) / 2
    plotter.camera.clipping_range = (distance - 2 * depth, distance + 2 * depth)
