r"""Flat triangles cut where one label ends and the next begins, so that borders have no teeth.

::

    2 (group 1)              2
    | \                      | \
    |   \                    |___\      the border runs where both
    |     \                  |     \    groups are equally near
    0------1 (group 0)       0------1
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry import Floats, Ints, linear_triangles
from ..records import Surface
from . import _paint as paint

NO_GROUP, NOT_KNOWN = -1, -2
_SAME_PLACE = 1e-6  # of the size: places nearer than this are one


@dataclass(frozen=True, eq=False)
class BorderPieces:
    """The pieces of the triangles that a border crosses, on a surface of n nodes.

    Parameters
    ----------
    corners : array (p, 3)
        Nodes of the triangle that each further point lies in: corner n + i of a piece is point i.
    weights : array (p, 3)
        Its barycentric coordinates there.
    triangles : array (q, 3)
        Turning as the whole ones; below n stand nodes.
    labels : array (q,)
        Group of each piece, :data:`NO_GROUP` or :data:`NOT_KNOWN`.
    """

    corners: Ints
    weights: Floats
    triangles: Ints
    labels: Ints

    def points(self, nodes: Floats) -> Floats:
        """Where the further points (p, 3) lie, given the nodes' places (n, 3)."""
        places: Floats = np.einsum("pi,pid->pd", self.weights, nodes[self.corners])
        return places


def no_pieces() -> BorderPieces:
    """Nothing that is cut."""
    none = np.empty((0, 3), np.int64)
    return BorderPieces(none, np.empty((0, 3)), none, np.empty(0, np.int64))


def node_labels(samples: paint.Samples) -> Ints:
    """Group of each node, :data:`NO_GROUP`, or :data:`NOT_KNOWN` without a partner."""
    labels: Ints = np.where(samples.known > 0, samples.groups, NOT_KNOWN)
    return labels


def group_pieces(surface: Surface, samples: paint.Samples) -> BorderPieces:
    """Every flat triangle whose corners are of different groups, cut along the borders.

    Distances to the groups' centers, and what tells that a node is in a group, are taken as
    linear within a triangle. Beside a node that is unknown each corner owns what is nearest.

    Parameters
    ----------
    surface : Surface
    samples : Samples
        At its nodes.

    Returns
    -------
    BorderPieces

    Notes
    -----
    Cost: 0.1 ms a border triangle.
    """
    labels = node_labels(samples)
    triangles = linear_triangles(surface.triangles)
    border = triangles[(labels[triangles] != labels[triangles[:, :1]]).any(axis=1)]
    places: list[tuple[Ints, Floats]] = []
    corners, owners = [], []
    for triangle in border:
        for label, polygon in _parts(triangle, labels, samples):
            first = len(places)
            places.extend((triangle, weights) for weights in polygon)
            corners += [(first, first + k, first + k + 1) for k in range(1, len(polygon) - 1)]
            owners += [label] * (len(polygon) - 2)
    if not places:
        return no_pieces()
    return _joined(places, np.array(corners), np.array(owners), surface.points)


def _parts(triangle: Ints, labels: Ints, samples: paint.Samples) -> list[tuple[int, list[Floats]]]:
    """Each label's polygon within a triangle, by the barycentric coordinates of its corners."""
    own = labels[triangle]
    if (own == NOT_KNOWN).any():
        halves = {k: [_half(i, k) for i in range(3) if i != k] for k in range(3)}
        return [(int(own[k]), _clipped(halves[k])) for k in range(3)]
    inside = samples.group_margin[triangle]
    scores = samples.scores[triangle]
    parts = [(NO_GROUP, _clipped([-inside]))]
    for group in range(scores.shape[1]):
        others = [scores[:, other] - scores[:, group] for other in range(scores.shape[1])]
        del others[group]
        parts.append((group, _clipped([inside, *others])))
    return [(label, polygon) for label, polygon in parts if len(polygon) > 2]


def _half(low: int, high: int) -> Floats:
    """Corner values of a function that is positive nearer to ``high`` than to ``low``."""
    values = np.zeros(3)
    values[low], values[high] = -1.0, 1.0
    return values


def _clipped(halves: list[Floats]) -> list[Floats]:
    """The part of a triangle where functions, linear and given at its corners, are positive."""
    polygon = list(np.eye(3))
    for values in halves:
        kept: list[Floats] = []
        for here, there in zip(polygon, polygon[1:] + polygon[:1], strict=True):
            low, high = float(here @ values), float(there @ values)
            if low >= 0:
                kept.append(here)
            if low * high < 0:
                kept.append((high * here - low * there) / (high - low))
        polygon = kept
    return polygon


def _joined(
    places: list[tuple[Ints, Floats]], corners: Ints, labels: Ints, nodes: Floats
) -> BorderPieces:
    """The pieces with one point at each place, the nodes themselves where a corner is one."""
    triangles = np.array([triangle for triangle, _ in places])
    weights = np.array([weights for _, weights in places])
    number = triangles[np.arange(len(places)), weights.argmax(axis=1)]
    fresh = weights.max(axis=1) < 1
    points = np.einsum("pi,pid->pd", weights[fresh], nodes[triangles[fresh]])
    cell = _SAME_PLACE * float(np.ptp(nodes, axis=0).max())
    grid = np.round(points / cell).astype(np.int64)
    _, first, same = np.unique(grid, axis=0, return_index=True, return_inverse=True)
    number[fresh] = len(nodes) + same.ravel()
    return BorderPieces(triangles[fresh][first], weights[fresh][first], number[corners], labels)
