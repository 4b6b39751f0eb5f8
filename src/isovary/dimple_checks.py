"""What a dimple is asked before it is made, and what is said of it afterwards."""

from __future__ import annotations

import warnings
from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike

from .crossings import run_through
from .errors import ArgumentError
from .geometry import Floats, frozen
from .records import Surface

_WEAK = 0.9  # of the force at a centre on the surface: less is told
_FEWEST = 20  # nodes: the dimple's inner half, 0.24 radii, has a twentieth of them


def warn_of_crossings(before: Surface, after: Surface) -> None:
    """Warn, where the caller of the caller stands, if a surface runs through itself [M08]."""
    count = run_through(before, after)
    if count:
        warnings.warn(
            f"dimple: expected a surface that nowhere runs through itself, got one where {count} "
            "pieces of triangles do; make alpha, charge or steps smaller [M08]",
            UserWarning,
            stacklevel=3,
        )


def doubts(
    before: Surface, after: Surface, center: Floats, radius: float, decay: float, place: Floats
) -> Iterator[str]:
    """Why a dimple is probably not what was meant; ``place`` of the surface is next to the centre.

    The force falls by exp(-(s / decay radius)^2) (1 - (s / radius)^2)^2 at s from the centre.
    """
    way = np.linalg.norm(after.points - before.points, axis=1)
    off = float(np.linalg.norm(center - place))
    count, share = int((way > 0).sum()), off / radius
    if np.exp(-((share / decay) ** 2)) * (1 - share**2) ** 2 < _WEAK:
        yield (
            f"center: expected on the surface, got {off:.3g} off it, which weakens the dimple; the "
            f"nearest place is {place.round(4).tolist()}"
        )
    if count == 0:
        yield "alpha, charge: expected a force, got none: nothing moves"
    elif count == len(way):
        yield (
            f"radius: expected a part of the surface within it, got all {count} nodes within "
            f"{radius:g}"
        )
    elif count < _FEWEST:
        yield (
            f"radius: expected several edges of the mesh, got one within which {count} node(s) "
            "moved, too few to show the dimple; choose a larger radius or a finer mesh"
        )
    if way.max() > radius:
        yield (
            f"dimple: expected a depth below the radius, got {way.max():.3g}, "
            f"{way.max() / radius:.1f} radii; choose a smaller alpha or charge, or fewer "
            "steps, which are the time that the force acts"
        )


def check_surface(surface: object) -> None:
    """ArgumentError A03 for what is no Surface."""
    if not isinstance(surface, Surface):
        raise ArgumentError(
            "A03",
            f"surface: expected a Surface, got {type(surface).__name__}; make one by "
            "read_surface(file) or Surface(points, triangles)",
        )


def as_point(name: str, values: ArrayLike) -> Floats:
    """A point (3,); ArgumentError A03 for another shape, A02 if it is not finite."""
    point = frozen(values)
    if point.shape != (3,):
        raise ArgumentError("A03", f"{name}: expected shape (3,), got {point.shape}")
    if not np.isfinite(point).all():
        raise ArgumentError("A02", f"{name}: expected finite, got {point.tolist()}")
    return point


def one_each(name: str, values: ArrayLike, count: int) -> Floats:
    """A number for each of (count,), given as one or as many; ArgumentError A03 for others."""
    found = np.asarray(values, dtype=float)
    if found.shape not in ((), (count,)):
        raise ArgumentError(
            "A03", f"{name}: expected a number or shape ({count},), got {found.shape}"
        )
    return np.broadcast_to(found, (count,))


def check_finite(name: str, value: float) -> None:
    """ArgumentError A02 for NaN or infinity."""
    if not np.isfinite(value):
        raise ArgumentError("A02", f"{name}: expected finite, got {value}")


def check_positive(name: str, value: float) -> None:
    """ArgumentError A02 for what is not positive and finite."""
    if not (np.isfinite(value) and value > 0):
        raise ArgumentError("A02", f"{name}: expected positive and finite, got {value}")
