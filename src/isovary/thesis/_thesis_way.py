"""What the thesis does and isovary does not: flat triangles, and its scaling as it is printed."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ..geometry import Bools, Floats, edges_of
from ..records import Surface
from ._steps import Signed


def flattened(surface: Surface) -> Surface:
    """The same triangles, flat: the corners alone, with their normals."""
    corners, places = np.unique(surface.corners, return_inverse=True)
    triangles = places.reshape(surface.corners.shape)
    return Surface(surface.points[corners], triangles, surface.normals[corners])


def printed_change(base: Signed, perturbed: Signed) -> Floats:
    """Difference (n, T) times the sum of the base's signature over its nodes, as printed."""
    printed: Floats = (base.signature - perturbed.signature) * base.signature.sum(axis=0)
    return printed


def patches(surface: Surface, marked: Bools) -> int:
    """Number of connected pieces of the marked nodes, neighbours in a triangle's corners."""
    edges = edges_of(surface.corners)[0]
    inside = edges[marked[edges].all(axis=1)]
    count = len(surface.points)
    graph = coo_array((np.ones(len(inside)), inside.T), shape=(count, count))
    pieces = connected_components(graph, directed=False)[1]
    vertices = np.unique(surface.corners)
    return len(np.unique(pieces[vertices[marked[vertices]]]))
