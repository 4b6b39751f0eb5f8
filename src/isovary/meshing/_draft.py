"""A mesh in the making: flat triangles near an isosurface, and what holds its rims on the box."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..errors import MeshError
from ..geometry import Bools, Floats, Ints, rim_nodes
from ..scalar_field import ScalarField

_ON_FACE = 1e-6  # of a sample's distance: the contourer's single precision


@dataclass(frozen=True, eq=False)
class Draft:
    """Vertices, triangles, and the coordinates that may not change.

    Parameters
    ----------
    points : array (n, 3)
    triangles : array (m, 3)
    held : array (n, 3) of bool
        Coordinates that a face of the box fixes: none inside, one on a rim, two at a rim's
        corner on an edge of the box.
    normals : array (n, 3)
        Unit normals of the field's level sets, towards smaller values.
    """

    points: Floats
    triangles: Ints
    held: Bools
    normals: Floats

    @property
    def rank(self) -> Ints:
        """How a vertex may move (n,): 0 in the surface, 1 along a rim, 2 not at all."""
        rank: Ints = np.minimum(self.held.sum(axis=1), 2)
        return rank


def draft(points: Floats, triangles: Ints, field: ScalarField, isovalue: float) -> Draft:
    """A draft whose rims are put exactly onto the faces of the box, all points near the surface."""
    low, high = field.bounds
    rim = rim_nodes(triangles)
    held = np.zeros(points.shape, dtype=bool)
    near = _ON_FACE * field.spacing
    on_low, on_high = (np.abs(points[rim] - face) < near for face in (low, high))
    held[rim] = on_low | on_high
    if not held[rim].any(axis=1).all():
        lost = points[rim][~held[rim].any(axis=1)][0]
        raise MeshError(
            "M12", f"rims: expected on the faces of the box, got one at {lost.round(6).tolist()}"
        )
    points = points.copy()
    points[rim] = np.where(on_low, low, np.where(on_high, high, points[rim]))
    normals = np.zeros_like(points)
    return settled(Draft(points, triangles, held, normals), field, isovalue)


def held_between(points: Floats, held: Bools, i: Ints, j: Ints) -> Bools:
    """Coordinates (k, 3) that hold the middle of a rim edge i j: of one face that holds both."""
    same: Bools = held[i] & held[j] & (points[i] == points[j])
    return same


def settled(draft: Draft, field: ScalarField, isovalue: float) -> Draft:
    """One Newton step towards the isosurface, within the faces that hold a point, and normals."""
    low, high = field.bounds
    level, gradient = field.level_set(draft.points, isovalue)
    free = np.where(draft.held, 0.0, gradient)
    square = (free**2).sum(axis=1)
    some = square > 0
    step = -np.where(some, level, 0.0)[:, None] / np.where(some, square, 1.0)[:, None] * free
    length = np.linalg.norm(step, axis=1, keepdims=True)
    longest = float(field.spacing.min())
    step *= longest / np.maximum(length, longest)
    points = np.where(draft.held, draft.points, np.clip(draft.points + step, low, high))
    slope = np.maximum(np.linalg.norm(gradient, axis=1, keepdims=True), np.finfo(float).tiny)
    return replace(draft, points=points, normals=-gradient / slope)


def tangential(draft: Draft, vectors: Floats) -> Floats:
    """The parts of vectors (n, 3) that lie in the surface and in the faces that hold a point."""
    across = np.where(draft.held, 0.0, draft.normals)
    square = np.maximum((across**2).sum(axis=1), np.finfo(float).tiny)
    vectors = np.where(draft.held, 0.0, vectors)
    vectors = vectors - ((vectors * across).sum(axis=1) / square)[:, None] * across
    return np.where((draft.rank == 2)[:, None], 0.0, vectors)


def moved(draft: Draft, step: Floats, field: ScalarField, isovalue: float) -> Draft:
    """Vertices moved by the tangential part of ``step``, where no triangle is turned over."""
    low, high = field.bounds
    step = tangential(draft, step)
    result = settled(
        replace(draft, points=np.clip(draft.points + step, low, high)), field, isovalue
    )
    fresh = _inward(result) & ~_inward(draft)
    if fresh.any():  # their vertices stay where they were
        back = np.unique(draft.triangles[fresh])
        points, normals = result.points.copy(), result.normals.copy()
        points[back], normals[back] = draft.points[back], draft.normals[back]
        result = replace(result, points=points, normals=normals)
    return result


def _inward(draft: Draft) -> Bools:
    """Mask (m,) of the triangles that face towards greater field values."""
    a, b, c = draft.points[draft.triangles].transpose(1, 0, 2)
    facing = np.cross(b - a, c - a)
    inward: Bools = (facing * draft.normals[draft.triangles].sum(axis=1)).sum(axis=1) <= 0
    return inward
