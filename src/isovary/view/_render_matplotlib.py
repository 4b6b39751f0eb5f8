"""The same scene drawn by matplotlib alone: pieces painted from the back to the front."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb

from ._camera import Camera
from ._scene import AMBIENT, DIFFUSE, LINE_COLOR, Scene


def draw(axes: Axes, scene: Scene, camera: Camera) -> None:
    """Draw a scene into axes whose limits are lengths in the camera's plane."""
    corners = camera.project(scene.pieces.points)[scene.pieces.triangles]
    light = AMBIENT + DIFFUSE * np.abs(scene.pieces.facing @ camera.axes[2])
    colors = np.clip(scene.colors * light[:, None], 0.0, 1.0)
    widths = np.full(len(corners), 0.4)
    if scene.lines is not None and len(scene.lines):
        ends = camera.project(scene.lines.reshape(-1, 3)).reshape(-1, 2, 3)
        corners = np.concatenate([corners, ends[:, [0, 1, 1]]])
        colors = np.concatenate([colors, np.tile(to_rgb(LINE_COLOR), (len(ends), 1))])
        widths = np.concatenate([widths, np.full(len(ends), 0.3)])
    order = corners[:, :, 2].mean(axis=1).argsort()
    axes.add_collection(
        PolyCollection(
            list(corners[order, :, :2]),
            facecolors=colors[order],
            edgecolors=colors[order],
            linewidths=widths[order],
            joinstyle="round",
            rasterized=True,
        ),
        autolim=False,
    )
