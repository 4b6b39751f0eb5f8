"""Rigid motions: a turn, perhaps with a mirror, and a shift."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from .errors import ArgumentError
from .geometry import Floats, frozen
from .records import Surface


@dataclass(frozen=True, eq=False, repr=False)
class RigidMotion:
    """The motion x -> rotation x + translation; it changes no length and no angle.

    Parameters
    ----------
    rotation : array (3, 3)
        Orthogonal; with determinant -1 the motion mirrors. Default: the identity.
    translation : array (3,)
        Length. Default 0.

    Raises
    ------
    ArgumentError
        A03 for wrong shapes, A02 for a rotation that is not orthogonal to 1e-9.

    Examples
    --------
    A quarter turn about z, then one length along x:

    >>> motion = RigidMotion([[0, -1, 0], [1, 0, 0], [0, 0, 1]], [1, 0, 0])
    >>> motion.apply([[2.0, 0.0, 5.0]]).tolist()
    [[1.0, 2.0, 5.0]]
    >>> motion.inverse.apply([[1.0, 2.0, 5.0]]).tolist()
    [[2.0, 0.0, 5.0]]
    >>> round(motion.angle, 9), motion.mirrored
    (90.0, False)
    """

    rotation: Floats = field(default_factory=lambda: np.eye(3))
    translation: Floats = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        object.__setattr__(self, "rotation", frozen(self.rotation))
        object.__setattr__(self, "translation", frozen(self.translation))
        if self.rotation.shape != (3, 3) or self.translation.shape != (3,):
            raise ArgumentError(
                "A03",
                "rotation, translation: expected shapes (3, 3) and (3,), got "
                f"{self.rotation.shape} and {self.translation.shape}",
            )
        error = float(np.abs(self.rotation @ self.rotation.T - np.eye(3)).max())
        if not error < 1e-9:
            raise ArgumentError(
                "A02", f"rotation: expected an orthogonal matrix, got one that errs by {error:.2g}"
            )

    def __repr__(self) -> str:
        shift = ", ".join(f"{v:.4g}" for v in self.translation)
        mirror = ", mirrored" if self.mirrored else ""
        return f"RigidMotion(turn {self.angle:.4g} degrees, shift ({shift}){mirror})"

    @property
    def inverse(self) -> RigidMotion:
        """The way back."""
        return RigidMotion(self.rotation.T, -self.rotation.T @ self.translation)

    def after(self, other: RigidMotion) -> RigidMotion:
        """First the other motion, then this one."""
        return RigidMotion(self.rotation @ other.rotation, self.apply(other.translation))

    @property
    def mirrored(self) -> bool:
        """Whether left and right change places."""
        return bool(np.linalg.det(self.rotation) < 0)

    @property
    def angle(self) -> float:
        """Angle of the turn (of its negative, if mirrored) in degrees, 0 to 180."""
        proper = self.rotation * (-1 if self.mirrored else 1)
        axis = proper[[2, 0, 1], [1, 2, 0]] - proper[[1, 2, 0], [2, 0, 1]]
        return float(np.degrees(np.arctan2(np.linalg.norm(axis), np.trace(proper) - 1)))

    @property
    def is_identity(self) -> bool:
        """Whether nothing moves at all."""
        return bool((self.rotation == np.eye(3)).all() and (self.translation == 0).all())

    def apply(self, points: ArrayLike) -> Floats:
        """Moved points (..., 3)."""
        moved: Floats = self.turn(points) + self.translation
        return moved

    def turn(self, vectors: ArrayLike) -> Floats:
        """Turned vectors (..., 3), such as normals."""
        turned: Floats = np.asarray(vectors, dtype=float) @ self.rotation.T
        return turned

    def surface(self, surface: Surface) -> Surface:
        """The surface moved, node by node; a mirror reverses the order within each triangle."""
        if self.is_identity:
            return surface
        order = [0, 2, 1, 5, 4, 3] if self.mirrored else [0, 1, 2, 3, 4, 5]
        triangles = surface.triangles[:, order[: surface.triangles.shape[1]]]
        return Surface(self.apply(surface.points), triangles, self.turn(surface.normals))
