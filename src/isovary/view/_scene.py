"""What a renderer gets: coloured small triangles, and lines over them."""

from __future__ import annotations

from dataclasses import dataclass

from ..geometry import Floats
from ..records import Surface
from ._camera import Camera
from ._tessellate import Pieces, edge_lines

AMBIENT, DIFFUSE = 0.58, 0.46
"""Light of a lamp at the viewer: mild, so that colours can be read off the colour bar."""

LINE_COLOR = "#404040"


@dataclass(frozen=True, eq=False)
class Scene:
    """Pieces of surface with a colour (q, 3) each, and line segments (s, 2, 3)."""

    pieces: Pieces
    colors: Floats
    lines: Floats | None = None


def mesh_lines(surface: Surface, camera: Camera, lift: float, split: int = 4) -> Floats:
    """The element edges that face the viewer, lifted towards him (s, 2, 3)."""
    points, normals = edge_lines(surface, split)
    points = points + lift * camera.axes[2]
    front = normals @ camera.axes[2] > 0
    both = front[:, :-1] & front[:, 1:]
    ends: Floats = points[:, [[i, i + 1] for i in range(split)]][both]
    return ends
