"""Exact spectrum and heat kernel signature of a spheroid, and fields whose isosurface it is."""

from __future__ import annotations

from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import cache
from itertools import count

import numpy as np

from ..geometry import Floats
from ..scalar_field import ScalarField

_TERMS, _NODES = 64, 160  # of a meridian's series, of its quadrature: right to 1e-9 for 300 pairs
_GONE = 32.0  # modes that have decayed to exp(-32) count no more
_TURN = 4 * np.log(10)


@dataclass(frozen=True, eq=False)
class Spheroid:
    """Semi-axes 1, 1, half_axis with its exact signature on a meridian.

    Parameters
    ----------
    half_axis : float
        Along z, over that along x and y; the sphere is 1.
    times : array (T,)
        Those that the exact eigenvalues give to a number of pairs; length^2.
    angles : array (c,)
        Of places from pole to pole, at the middles of equal steps: z = half_axis cos(angle).
    areas : array (c,)
        Share of the surface around each; their sum is 1.
    rows : array (c, T)
        Exact HKS there; 1/length^2.
    """

    half_axis: float
    times: Floats
    angles: Floats
    areas: Floats
    rows: Floats

    @property
    def length(self) -> float:
        """Of the mean HKS vector, in L2 over the times: the unit of all norms."""
        return float(np.linalg.norm(self.areas @ self.rows))

    def at(self, points: Floats) -> Floats:
        """Exact HKS (n, T) at points on the spheroid, or near it."""
        from scipy.interpolate import CubicSpline

        found: Floats = CubicSpline(self.angles, self.rows)(self._angle(points))
        return found

    def shares(self, points: Floats) -> Floats:
        """Share (c,) of the points that lie around each place of the meridian."""
        places = (self._angle(points) / np.pi * len(self.angles)).astype(int)
        counts = np.bincount(places.clip(0, len(self.angles) - 1), minlength=len(self.angles))
        return counts / len(points)

    def _angle(self, points: Floats) -> Floats:
        radius = np.hypot(points[:, 0], points[:, 1])
        angle: Floats = np.arctan2(radius, points[:, 2] / self.half_axis)
        return angle


def spheroid(half_axis: float, pairs: int, samples: int, places: int = 1200) -> Spheroid:
    """The exact signature, at the times that a number of exact eigenpairs gives."""
    with _one_thread():
        return _spheroid(half_axis, pairs, samples, places)


def _spheroid(half_axis: float, pairs: int, samples: int, places: int) -> Spheroid:
    values = eigenvalues(half_axis, pairs)
    times = np.geomspace(_TURN / values[-1], _TURN / values[1], samples)
    angles = (np.arange(places) + 0.5) * np.pi / places
    areas = np.sin(angles) * _metric(half_axis, angles)
    rows = np.zeros((places, samples))
    for order in count():
        found, coefficients = _modes(half_axis, order)
        if found[0] * times[0] > _GONE:
            break
        squares = (_series(order, angles)[0] @ coefficients) ** 2
        rows += squares @ np.exp(-np.outer(found, times)) / (np.pi * (2 if order == 0 else 1))
    return Spheroid(half_axis, times, angles, areas / areas.sum(), rows)


def _one_thread() -> AbstractContextManager[object]:
    """Faster for small matrices than to share them among threads."""
    from threadpoolctl import threadpool_limits

    limits: AbstractContextManager[object] = threadpool_limits(limits=1, user_api="blas")
    return limits


def eigenvalues(half_axis: float, pairs: int) -> Floats:
    """The smallest exact eigenvalues (pairs,), repeated ones repeated."""
    values = np.empty(0)
    for order in count():
        found = _modes(half_axis, order)[0]
        if len(values) >= pairs and found[0] > values[pairs - 1]:
            break
        values = np.sort(np.append(values, np.repeat(found, 1 if order == 0 else 2)))
    return values[:pairs]


def spheroid_field(half_axis: float, spacing: float) -> ScalarField:
    """Samples of 1 - x^2 - y^2 - (z / half_axis)^2: the spheroid is where it is 0."""
    reach = np.array([1.0, 1.0, half_axis]) + 3.3 * spacing  # the grid is not symmetric to it
    counts = np.ceil(2 * reach / spacing).astype(int) + 1
    low = -reach
    stretch = np.array([1.0, 1.0, half_axis])
    return ScalarField.from_function(
        lambda p: 1 - ((p / stretch) ** 2).sum(axis=-1),
        bounds=(low, low + spacing * (counts - 1)),
        shape=(int(counts[0]), int(counts[1]), int(counts[2])),
    )


def _metric(half_axis: float, angle: Floats) -> Floats:
    """Length of the meridian per angle."""
    metric: Floats = np.hypot(np.cos(angle), half_axis * np.sin(angle))
    return metric


@cache
def _modes(half_axis: float, order: int) -> tuple[Floats, Floats]:
    """Eigenvalues and coefficients of the functions P(angle) cos(order phi), by Galerkin's method.

    The integral of P'^2 r / g + order^2 P^2 g / r against that of P^2 g r, with r = sin(angle)
    the distance to the axis and g the metric.
    """
    from scipy.linalg import eigh

    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    angle, weights = np.pi / 2 * (nodes + 1), np.pi / 2 * weights
    radius, metric = np.sin(angle), _metric(half_axis, angle)
    basis, slope = _series(order, angle)
    stiffness = (slope.T * (weights * radius / metric)) @ slope
    stiffness += (basis.T * (weights * order**2 * metric / radius)) @ basis
    values, coefficients = eigh(stiffness, (basis.T * (weights * metric * radius)) @ basis)
    return values, coefficients


def _series(order: int, angle: Floats) -> tuple[Floats, Floats]:
    """Cosines, sines or sin(angle) times sines, and their slopes: each order's parity at a pole."""
    k = np.arange(_TERMS) + (order > 0)
    wave = np.outer(angle, k)
    cosine, sine = np.cos(wave), np.sin(wave)
    if order == 0:
        return cosine, -k * sine
    if order % 2 == 1:
        return sine, k * cosine
    lift = np.sin(angle)[:, None]
    return lift * sine, lift * k * cosine + np.cos(angle)[:, None] * sine
