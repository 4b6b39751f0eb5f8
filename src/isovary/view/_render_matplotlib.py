"""The same scene drawn by matplotlib alone: pieces painted from the back to the front."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection

from ..geometry import Floats
from ._camera import Camera
from ._scene import AMBIENT, DIFFUSE, Scene, Strokes
from ._tessellate import Pieces


class _Layer(NamedTuple):
    """Triangles (k, 3, 3) with colours (k, 3) and widths (k,) of their edges.

    ``corners`` are right, up and towards the viewer.
    """

    corners: Floats
    colors: Floats
    widths: Floats


def draw(axes: Axes, scene: Scene, camera: Camera) -> None:
    """Draw a scene into axes whose limits are lengths in the camera's plane."""
    layers = [_painted(scene.pieces, scene.colors, camera)]
    layers += [_stroked(strokes, camera) for strokes in scene.strokes]
    if scene.second is not None:
        layers.append(_painted(scene.second.pieces, scene.second.colors, camera))
    corners, colors, widths = (np.concatenate(parts) for parts in zip(*layers, strict=True))
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


def _painted(pieces: Pieces, colors: Floats, camera: Camera) -> _Layer:
    """Pieces in the light of a lamp at the viewer."""
    light = AMBIENT + DIFFUSE * np.abs(pieces.facing @ camera.axes[2])
    corners = camera.project(pieces.points)[pieces.triangles]
    seen = np.clip(colors * light[:, None], 0.0, 1.0)
    return _Layer(corners, seen, np.full(len(corners), 0.4))


def _stroked(strokes: Strokes, camera: Camera) -> _Layer:
    ends = camera.project(strokes.ends.reshape(-1, 3)).reshape(-1, 2, 3)
    return _Layer(ends[:, [0, 1, 1]], strokes.colors, np.full(len(ends), strokes.width))
