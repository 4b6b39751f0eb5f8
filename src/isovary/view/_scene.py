"""What a renderer gets: coloured small triangles, and lines over them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.colors import to_rgb

from ..geometry import Floats
from ..records import Surface
from ._camera import Camera
from ._tessellate import Pieces, edge_lines

AMBIENT, DIFFUSE = 0.58, 0.46
"""Light of a lamp at the viewer: mild, so that colours can be read off the colour bar."""

LINE_COLOR = "#404040"


@dataclass(frozen=True, eq=False)
class Strokes:
    """Line segments (s, 2, 3) with a colour (s, 3) each; width in points."""

    ends: Floats
    colors: Floats
    width: float


@dataclass(frozen=True, eq=False)
class Scene:
    """Pieces of surface with a colour (q, 3) each, thin grey line segments (s, 2, 3) over them.

    Perhaps also a band of strokes, and the pieces of a second scene.
    """

    pieces: Pieces
    colors: Floats
    lines: Floats | None = None
    band: Strokes | None = None
    second: Scene | None = None

    @property
    def strokes(self) -> list[Strokes]:
        """All lines, those of the mesh first."""
        drawn = [] if self.band is None else [self.band]
        if self.lines is not None:
            grey = np.tile(to_rgb(LINE_COLOR), (len(self.lines), 1))
            drawn.insert(0, Strokes(self.lines, grey, 0.3))
        return [strokes for strokes in drawn if len(strokes.ends)]


def mesh_lines(surface: Surface, camera: Camera, lift: float, split: int = 4) -> Floats:
    """The element edges that face the viewer, lifted towards him (s, 2, 3)."""
    points, normals = edge_lines(surface, split)
    points = points + lift * camera.axes[2]
    front = normals @ camera.axes[2] > 0
    both = front[:, :-1] & front[:, 1:]
    ends: Floats = points[:, [[i, i + 1] for i in range(split)]][both]
    return ends
