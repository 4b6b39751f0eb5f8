"""Poses to start an alignment from: turns of a cube, principal axes, mirrors."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations, product
from typing import NamedTuple

import numpy as np

from ..geometry import Bools, Floats, node_areas
from ..records import Surface

_TURNS = 12  # about an axis that the box holds


@dataclass(frozen=True, eq=False)
class Sites:
    """Nodes (n, 3) of the base and their weights (n,), sum 1."""

    points: Floats
    weights: Floats

    def some(self, count: int) -> Sites:
        """Some of them, each for the same area."""
        ends = np.cumsum(self.weights)
        picked = np.searchsorted(ends, (np.arange(count) + 0.5) / count * ends[-1])
        chosen, times = np.unique(picked, return_counts=True)
        return Sites(self.points[chosen], times / count)


class Poses(NamedTuple):
    """Motions y -> turns y + shifts, (s, 3, 3) and (s, 3)."""

    turns: Floats
    shifts: Floats


def sites_of(surface: Surface) -> Sites:
    areas = node_areas(surface.points, surface.triangles)
    return Sites(surface.points, areas / areas.sum())


def exponential(vectors: Floats) -> Floats:
    """Rotation matrices (s, 3, 3) of rotation vectors (s, 3), by Rodrigues' formula."""
    angle = np.linalg.norm(vectors, axis=1)[:, None, None]
    x, y, z = vectors.T
    zero = np.zeros(len(vectors))
    cross = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)
    sine, cosine = np.sinc(angle / np.pi), np.sinc(angle / (2 * np.pi)) ** 2 / 2
    turns: Floats = np.eye(3) + sine * cross + cosine * (cross @ cross)
    return turns


def starts(base: Surface, perturbed: Surface, held: Bools) -> Poses:
    """Poses with the centroids on each other, as far as held faces let them."""
    (centre, axes), (other, other_axes) = _outline(base), _outline(perturbed)
    if not held.any():
        turns = np.concatenate([_cube_turns(), axes @ _flips() @ other_axes.T])
        turns = np.concatenate([turns, -turns])
    elif held.sum() == 1:
        angles = np.linspace(0, 2 * np.pi, _TURNS, endpoint=False)
        turns = exponential(np.outer(angles, held))
    else:
        turns = np.eye(3)[None]
    if held.any():
        turns = np.concatenate(
            [turns, np.diag(1.0 - 2 * (np.arange(3) == np.argmin(held))) @ turns]
        )
    return Poses(turns, np.where(held, 0.0, centre - turns @ other))


def _outline(surface: Surface) -> tuple[Floats, Floats]:
    """Centroid (3,) and principal axes (3, 3), in columns."""
    sites = sites_of(surface)
    centre = sites.weights @ sites.points
    offsets = sites.points - centre
    offsets /= np.abs(offsets).max()
    axes: Floats = np.linalg.eigh(np.einsum("n,ni,nj->ij", sites.weights, offsets, offsets))[1]
    return centre, axes * np.sign(np.linalg.det(axes))


def _flips() -> Floats:
    """The half turns (4, 3, 3) about the axes, and none."""
    flips: Floats = np.array([np.diag(s) for s in product((1.0, -1.0), repeat=3) if np.prod(s) > 0])
    return flips


def _cube_turns() -> Floats:
    """The turns (24, 3, 3) of a cube; none comes first."""
    signed = [
        np.diag(signs) @ np.eye(3)[list(order)]
        for order in permutations(range(3))
        for signs in product((1.0, -1.0), repeat=3)
    ]
    turns: Floats = np.array([turn for turn in signed if np.linalg.det(turn) > 0])
    return turns
