"""What carrying needs of a field: its level set function, in place, moved or blended."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from .errors import ArgumentError
from .geometry import Floats
from .rigid_motion import RigidMotion


class LevelSet(Protocol):
    """A function whose zero is an isosurface: a ScalarField, a moved or a blended one."""

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """Opposite corners (low, high) of a box that holds all of the field."""

    @property
    def spacing(self) -> Floats:
        """Distances (3,) below which the field has no details; length."""

    @property
    def rounding(self) -> float:
        """Error that rounding leaves in :meth:`level_set`."""

    def level_set(self, points: ArrayLike, isovalue: float) -> tuple[Floats, Floats]:
        """Values (n,), positive inside and NaN outside the box, and gradients (n, 3)."""


@dataclass(frozen=True, eq=False)
class MovedField:
    """A field carried along by a rigid motion: its isosurfaces are moved, nothing is resampled.

    F'(x) = F(T^-1 x) for the motion T.

    Parameters
    ----------
    field : LevelSet
    motion : RigidMotion

    Examples
    --------
    The isosurface x = 1 of the field x, moved by 2 along x, lies at x = 3:

    >>> from isovary.scalar_field import ScalarField
    >>> ramp = ScalarField.from_function(
    ...     lambda p: p[..., 0], bounds=((0, 0, 0), (3, 3, 3)), shape=(4, 4, 4))
    >>> moved = MovedField(ramp, RigidMotion(translation=[2, 0, 0]))
    >>> level, gradient = moved.level_set([[3.0, 1.0, 1.0]], 1.0)
    >>> level.round(12).tolist(), gradient.round(12)[0, 0].tolist()
    ([0.0], 1.0)
    """

    field: LevelSet
    motion: RigidMotion

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """Upright box around the moved one."""
        low, high = self.field.bounds
        ends = np.stack([low, high])
        corners = np.array(
            [[ends[i, 0], ends[j, 1], ends[k, 2]] for i, j, k in np.ndindex(2, 2, 2)]
        )
        moved = self.motion.apply(corners)
        return moved.min(axis=0), moved.max(axis=0)

    @property
    def spacing(self) -> Floats:
        """The smallest of the field's, along every axis."""
        return np.full(3, self.field.spacing.min())

    @property
    def rounding(self) -> float:
        """As of the field."""
        return self.field.rounding

    def level_set(self, points: ArrayLike, isovalue: float) -> tuple[Floats, Floats]:
        """As :meth:`ScalarField.level_set`, at moved places, with turned gradients."""
        level, gradient = self.field.level_set(self.motion.inverse.apply(points), isovalue)
        return level, self.motion.turn(gradient)


@dataclass(frozen=True, eq=False)
class BlendedField:
    """Two fields mixed: (1 - part) times the level set function of one plus part times the other's.

    Parameters
    ----------
    first, second : LevelSet
        Of like unit; outside of either box the blend is NaN.
    part : float
        0 is the first, 1 the second.

    Raises
    ------
    ArgumentError
        A02 for a part outside [0, 1].

    Examples
    --------
    Half way from the plane x = 1 to the plane x = 3:

    >>> from isovary.scalar_field import ScalarField
    >>> def plane(place):
    ...     return ScalarField.from_function(
    ...         lambda p: place - p[..., 0], bounds=((0, 0, 0), (4, 4, 4)), shape=(5, 5, 5))
    >>> half = BlendedField(plane(1.0), plane(3.0), 0.5)
    >>> half.level_set([[2.0, 1.0, 1.0]], 0.0)[0].round(9).tolist()
    [0.0]
    """

    first: LevelSet
    second: LevelSet
    part: float

    def __post_init__(self) -> None:
        if not 0 <= self.part <= 1:
            raise ArgumentError("A02", f"part: expected a number in [0, 1], got {self.part}")

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """The part of space that both boxes hold."""
        (low, high), (other_low, other_high) = self.first.bounds, self.second.bounds
        return np.maximum(low, other_low), np.minimum(high, other_high)

    @property
    def spacing(self) -> Floats:
        """The finer of both."""
        finer: Floats = np.minimum(self.first.spacing, self.second.spacing)
        return finer

    @property
    def rounding(self) -> float:
        """The larger of both."""
        return max(self.first.rounding, self.second.rounding)

    def level_set(self, points: ArrayLike, isovalue: float) -> tuple[Floats, Floats]:
        """Mixed values (n,) and gradients (n, 3)."""
        parts = ((1 - self.part, self.first), (self.part, self.second))
        mixed = [(weight, *field.level_set(points, isovalue)) for weight, field in parts if weight]
        level: Floats = np.sum([weight * value for weight, value, _ in mixed], axis=0)
        slope: Floats = np.sum([weight * gradient for weight, _, gradient in mixed], axis=0)
        return level, slope


def moved(field: LevelSet, motion: RigidMotion) -> LevelSet:
    """The field carried along by a motion; the field itself where nothing moves."""
    return field if motion.is_identity else MovedField(field, motion)
