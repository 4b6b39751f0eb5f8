"""Dimples of a sphere by a formula: radius 1 - sum depth exp(-(angle / width)^2)."""

from __future__ import annotations

from itertools import product

import numpy as np

from ..geometry import Bools, Floats
from ..records import Surface

POLES = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
CORNERS = np.array(list(product((-1.0, 1.0), repeat=3))) / 3**0.5
"""Of a cube: eight places."""

_TENTH = np.log(10) ** 0.5  # widths: there a dimple has a tenth of its depth


def angles(sphere: Surface, tips: Floats) -> Floats:
    """Of each node from each tip (n, tips), radians."""
    return np.asarray(np.arccos(np.clip(sphere.points @ tips.T, -1, 1)))


def dimpled(sphere: Surface, tips: Floats, depth: float, width: float) -> Surface:
    """The unit sphere with a dimple at each tip (tips, 3)."""
    fall = np.exp(-((angles(sphere, tips) / width) ** 2)).sum(axis=1)
    return Surface(sphere.points * (1 - depth * fall)[:, None], sphere.triangles)


def region(sphere: Surface, tips: Floats, width: float) -> Bools:
    """Nodes (n,) where a dimple has more than a tenth of its depth."""
    return np.asarray(angles(sphere, tips).min(axis=1) < width * _TENTH)
