"""How strong a projectile must be for a dimple of a given depth."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..deform import dimple
from ..errors import ArgumentError, MeshError
from ..notes import noted_warnings
from ..records import Surface

_STRONGEST = 60.0
_CLOSE = 1e-3  # relative to the depth
_HALVINGS = 24


def strength_for(
    surface: Surface, center: ArrayLike, radius: float, depth: float, **numbers: Any
) -> float:
    """The ``alpha`` of :func:`isovary.dimple` at which the tip moves by a depth.

    Parameters
    ----------
    surface, center, radius, **numbers
        As of :func:`isovary.dimple`: ``charge``, ``decay``, ``steps``.
    depth : float
        How far the node moves that moves farthest; length.

    Raises
    ------
    ArgumentError
        A02 for a depth that no strength up to 60 reaches before triangles turn over.

    Notes
    -----
    Cost: about ten dimples, 0.5 s for 10 000 nodes: the strength is found by halving.

    Examples
    --------
    Of dimples of alpha 5 the depth is 0.143 radii on a flat surface; on a sphere of radius 1
    a little less:

    >>> from isovary.shapes import icosphere
    >>> sphere = icosphere(4)
    >>> bool(4.5 < strength_for(sphere, sphere.points[0], 0.5, 0.0715) < 5.5)
    True
    """

    def reached(alpha: float) -> float:
        with noted_warnings():  # of the dimple that is made, the reader will be told
            moved = dimple(surface, center, radius, alpha=alpha, **numbers).points
        return float(np.linalg.norm(moved - surface.points, axis=1).max())

    if not 0 < depth < np.inf:
        raise ArgumentError(
            "A02", f"depth: expected a positive length that is finite, got {depth:g}"
        )
    low, high = 0.0, _STRONGEST
    for _ in range(_HALVINGS):
        alpha = (low + high) / 2
        try:
            found = reached(alpha)
        except MeshError:  # triangles turn over: too strong for this mesh
            found = np.inf
        if abs(found - depth) <= _CLOSE * depth:
            return alpha
        low, high = (alpha, high) if found < depth else (low, alpha)
        if high - low < _CLOSE * high:
            break  # it jumps past the depth: there triangles turn over
    raise ArgumentError(
        "A02",
        f"depth: expected a length that a projectile reaches here, got {depth:g}; take a larger "
        "radius, a finer mesh or a smaller depth",
    )
