"""How far the rims of an open surface reach: a dashed line on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..comparison import Comparison
from ..geometry import Bools, Floats, node_components, rim_nodes, shape_functions
from ..records import Surface
from ..signature import diffusion_radius
from ._camera import Camera
from ._scene import Strokes
from ._tessellate import Pieces, lattice

_DASH = 0.02  # of the size
_WIDTH = 0.75
_LIFT = 4e-3  # of the size, towards the viewer
_DARK, _LIGHT = 0.1, 1.0
"""Dashes of both, one after the other, are seen on every colour."""


@dataclass(frozen=True, eq=False)
class RimBand:
    """The line (segments (s, 2, 3)) at the distance ``radius`` from the rims of a surface.

    ``farthest`` is the largest distance of a node: below the radius there is no line.
    """

    radius: float
    farthest: float
    lines: Floats

    @property
    def words(self) -> str:
        """What lies between the rim and the line."""
        if self.farthest <= self.radius:
            return f"rim shows everywhere (2√t = {self.radius:.2g})"
        return f"rim shows within 2√t = {self.radius:.2g} of it"

    def strokes(self, camera: Camera) -> Strokes:
        """The line in dark and white dashes, lifted towards the viewer."""
        size = float((camera.high - camera.low).max())
        dark = dashed(self.lines, _DASH * size)
        colors = np.where(dark[:, None], _DARK, _LIGHT) * np.ones(3)
        return Strokes(self.lines + _LIFT * size * camera.axes[2], colors, _WIDTH)


def rim_band(result: Comparison, pieces: Pieces, split: int, node: int | None) -> RimBand | None:
    """Where the rims show in a node's signature at the time at which it changed most.

    Parameters
    ----------
    result : Comparison
    pieces : Pieces
        Of the base, with ``split`` parts along an edge.
    split : int
    node : int or None
        The marked node.

    Returns
    -------
    RimBand or None
        None for a node of a closed component, without one, and for signatures not over times.
    """
    if node is None or not (result.topology.boundary_loops and result.methods.kind.per_time):
        return None
    parts, rims = node_components(result.base.triangles), rim_nodes(result.base.triangles)
    if parts[node] not in parts[rims]:
        return None
    time = result.columns[int(np.nanargmax(np.abs(result.change[node])))]
    radius, distance = float(diffusion_radius(time)), result.rim_distance
    distance = np.where(np.isin(parts, parts[rims]), distance, distance.max() + radius)
    lines = contour(pieces, at_corners(result.base, split, distance), radius)
    return RimBand(radius, float(distance.max()), lines)


def at_corners(surface: Surface, split: int, values: Floats) -> Floats:
    """Node values (n,) at the points (p,) of the pieces, by the elements' shape functions."""
    shape = shape_functions(lattice(split)[0], surface.order)
    there: Floats = np.einsum("pi,mi->mp", shape, values[surface.triangles]).ravel()
    return there


def contour(pieces: Pieces, values: Floats, level: float) -> Floats:
    r"""Segments (s, 2, 3) on which values (p,), linear on each piece, equal a level.

    ::

               above
              /     \
        ...  x-------x  ...    x: one on each edge whose ends lie on different sides
            /         \
        below---------below
    """
    height = values[pieces.triangles] - level
    above = height > 0
    i, j = np.array([0, 1, 2]), np.array([1, 2, 0])
    crossed = above[:, i] != above[:, j]
    part = height[:, i] / np.where(crossed, height[:, i] - height[:, j], 1.0)
    corners = pieces.points[pieces.triangles]
    places = corners[:, i] + part[..., None] * (corners[:, j] - corners[:, i])
    segments: Floats = places[crossed].reshape(-1, 2, 3)
    return segments


def dashed(lines: Floats, length: float) -> Bools:
    """Which segments (s,) lie in the odd dashes of a length along each line, the first ones in.

    Segments are of one line where their ends agree to a millionth of the dash.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components, dijkstra

    if len(lines) == 0:
        return np.empty(0, dtype=bool)
    keys = np.round(lines.reshape(-1, 3) / (1e-6 * length))
    names = np.unique(keys, axis=0, return_inverse=True)[1].reshape(-1, 2)
    steps = np.maximum(np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1), 1e-9 * length)
    count = int(names.max()) + 1
    graph = coo_array((steps, (names[:, 0], names[:, 1])), shape=(count, count)).tocsr()
    starts = np.unique(connected_components(graph, directed=False)[1], return_index=True)[1]
    along = dijkstra(graph, directed=False, indices=starts, min_only=True)
    dark: Bools = np.floor(along[names].mean(axis=1) / length) % 2 == 0
    return dark
