"""Relaxations: where the vertices of a mesh should go to even out its edges."""

from __future__ import annotations

import numpy as np

from ..geometry import Floats, Ints
from ._draft import Draft
from ._edits import edges_with_sides

_PRESSURE = 1.2  # rest length of the truss's bars over the wanted one: all bars push
_TIME_STEP = 0.2  # of Euler's rule, for bars of unit stiffness


def truss_step(draft: Draft, lengths: Floats) -> Floats:
    """Steps (n, 3) of a truss whose bars push when shorter than 1.2 times the wanted length.

    ``0.2 sum max(L0 - L, 0) u`` over the bars at a vertex, u along each towards the vertex and
    ``L0 = 1.2 h sqrt(sum L^2 / sum h^2)``. A vertex opposite a rim edge has a bar to its mirror
    image beyond the rim, or it would be pushed through.

    References
    ----------
    P.-O. Persson and G. Strang, *A simple mesh generator in MATLAB*, SIAM Review 46 (2004)
    329-345, section 2.
    """
    points, count = draft.points, len(lengths)
    edges = edges_with_sides(draft.triangles)
    i, j = edges.ends.T
    bar = points[i] - points[j]
    wanted = (lengths[i] + lengths[j]) / 2
    scale = _PRESSURE * np.sqrt((bar**2).sum() / (wanted**2).sum())
    push = _pushes(bar, scale * wanted)
    force = summed(i, push, count) - summed(j, push, count)
    if edges.on_rim.any():
        a, b = points[edges.ends[edges.on_rim]].transpose(1, 0, 2)
        tip = edges.opposite[edges.on_rim, 0]
        along = ((points[tip] - a) * (b - a)).sum(axis=1) / ((b - a) ** 2).sum(axis=1)
        mirror = 2 * (points[tip] - a - along[:, None] * (b - a))
        force += summed(tip, _pushes(mirror, scale * lengths[tip]), count)
    steps: Floats = _TIME_STEP * force
    return steps


def _pushes(bar: Floats, rest: Floats) -> Floats:
    """Forces (k, 3) along bars shorter than their rest length."""
    length = np.maximum(np.linalg.norm(bar, axis=1), np.finfo(float).tiny)
    pushes: Floats = (np.maximum(rest - length, 0.0) / length)[:, None] * bar
    return pushes


def centroid_step(draft: Draft, lengths: Floats) -> Floats:
    """Steps (n, 3) to the centroid of the triangles around, dense where edges shall be short.

    The weight of a triangle is its area over the cube of the wanted length: then a mesh with just
    these lengths rests, since areas go as their squares and the ways to the triangles' centres as
    they themselves. On rims: the edges' lengths over the squares of the wanted ones, likewise.
    """
    points, triangles = draft.points, draft.triangles
    corners = points[triangles]
    areas = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    weight = areas / lengths[triangles].mean(axis=1) ** 3
    step = _weighted_mean(triangles, corners.mean(axis=1), weight, points)
    edges = edges_with_sides(triangles)
    if edges.on_rim.any():
        ends = edges.ends[edges.on_rim]
        i, j = ends.T
        distance = np.linalg.norm(points[i] - points[j], axis=1)
        along = _weighted_mean(
            ends, points[ends].mean(axis=1), distance / lengths[ends].mean(axis=1) ** 2, points
        )
        step = np.where((draft.rank > 0)[:, None], along, step)
    return step


def _weighted_mean(cells: Ints, centres: Floats, weight: Floats, points: Floats) -> Floats:
    """From each point to the weighted mean of its cells' centres; zero for a point on none."""
    width = cells.shape[1]
    total = np.bincount(cells.ravel(), np.repeat(weight, width), len(points))[:, None]
    sums = summed(cells.ravel(), np.repeat(weight[:, None] * centres, width, axis=0), len(points))
    mean: Floats = np.where(total > 0, sums / np.where(total > 0, total, 1) - points, 0.0)
    return mean


def summed(nodes: Ints, vectors: Floats, count: int) -> Floats:
    """Sum (count, 3) of the vectors (k, 3) at each node."""
    return np.stack([np.bincount(nodes, vectors[:, k], count) for k in range(3)], axis=1)
