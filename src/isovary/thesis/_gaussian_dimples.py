"""Dimples of a sphere by a formula: radius 1 - sum depth exp(-(angle / width)^2)."""

from __future__ import annotations

from itertools import product

import numpy as np
from matplotlib.axes import Axes

from ..geometry import Bools, Floats
from ..records import Surface
from ._drawing import draw_line

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


def ring_around(tip: Floats, angle: float) -> Floats:
    """Points (k, 3) of the unit sphere at an angle from one of it; radians."""
    around = np.linspace(0, 2 * np.pi, 181)
    first = np.cross(tip, np.eye(3)[int(np.abs(tip).argmin())])
    first /= np.linalg.norm(first)
    second = np.cross(tip, first)
    ring = np.cos(around)[:, None] * first + np.sin(around)[:, None] * second
    return np.asarray(np.cos(angle) * tip + np.sin(angle) * ring)


def draw_region(axes: Axes, tips: Floats, depth: float, width: float, towards: Floats) -> None:
    """Dashed lines around the true :func:`region`, as far as a viewer sees them."""
    for tip in tips:
        ring = ring_around(tip, width * _TENTH)
        ring[ring @ towards < 0.05 * np.linalg.norm(towards)] = np.nan
        draw_line(axes, (1 - depth / 10) * ring, towards)


def region(sphere: Surface, tips: Floats, width: float) -> Bools:
    """Nodes (n,) where a dimple has more than a tenth of its depth."""
    return np.asarray(angles(sphere, tips).min(axis=1) < width * _TENTH)
