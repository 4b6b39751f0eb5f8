"""Exact answers, from theory or solved independently of isovary."""

from __future__ import annotations

from functools import cache
from itertools import count as naturals

import numpy as np
from scipy.linalg import eigh
from scipy.special import jn_zeros, jnp_zeros
from threadpoolctl import threadpool_limits

one_thread = threadpool_limits.wrap(limits=1, user_api="blas")  # small matrices: faster so

# ------------------------------------------------------------------ sphere and hemisphere


def sphere_eigenvalues(count: int) -> np.ndarray:
    """l (l + 1), each 2 l + 1 times, on the unit sphere."""
    shells = range(int(np.sqrt(count)) + 1)
    return np.concatenate([[degree * (degree + 1)] * (2 * degree + 1) for degree in shells])[:count]


def sphere_signature(times: np.ndarray, degrees: int = 200) -> np.ndarray:
    """HKS of the unit sphere, the same at every point: sum (2 l + 1) / (4 pi) exp(-l (l + 1) t)."""
    return sphere_kernel(np.ones(1), times, degrees)[0]


def sphere_kernel(cosine: np.ndarray, times: np.ndarray, degrees: int = 200) -> np.ndarray:
    """Heat kernel (n, T) of the unit sphere between points at the angle arccos(cosine).

    sum (2 l + 1) / (4 pi) exp(-l (l + 1) t) P_l(cosine): the addition theorem.
    """
    degree = np.arange(degrees)[:, None]
    terms = (2 * degree + 1) / (4 * np.pi) * np.exp(-degree * (degree + 1) * np.asarray(times))
    return np.polynomial.legendre.legval(cosine, terms).T


def hemisphere_eigenvalues(count: int, dirichlet: bool) -> np.ndarray:
    """l (l + 1): l + 1 harmonics are even across the equator (natural boundary), l are odd."""
    shells = [[d * (d + 1)] * (d if dirichlet else d + 1) for d in range(count + 1)]
    return np.concatenate(shells)[:count]


def hemisphere_signature(heights: np.ndarray, times: np.ndarray, sign: int) -> np.ndarray:
    """HKS (n, T) of the upper hemisphere at heights z: k(x, x) + sign k(x, image of x).

    The image of x below the equator is at the cosine x . image = 1 - 2 z^2; sign is +1 for
    the natural, -1 for the Dirichlet boundary.
    """
    image = sphere_kernel(1 - 2 * np.asarray(heights) ** 2, times)
    return sphere_signature(times) + sign * image


# ------------------------------------------------------------------ spheroids


def spheroid_area(half_axis: float) -> float:
    """Area of the spheroid with semi-axes 1, 1, half_axis: its meridian turned round."""
    x, weight = np.polynomial.legendre.leggauss(400)
    return float(2 * np.pi * weight @ np.sqrt(x**2 + half_axis**2 * (1 - x**2)))


@one_thread
def spheroid_eigenvalues(half_axis: float, count: int) -> np.ndarray:
    """Smallest eigenvalues of the spheroid with semi-axes 1, 1, half_axis; see _meridian_modes.

    Orders m are taken until the smallest eigenvalue of one, which grows with m, comes too late.
    """
    values = np.empty(0)
    for order in naturals():
        found = _meridian_modes(half_axis, order)[0]
        if len(values) >= count and found[0] > values[count - 1]:
            return values[:count]
        values = np.sort(np.append(values, np.repeat(found, 1 if order == 0 else 2)))
    raise AssertionError


@one_thread
def spheroid_signature(half_axis: float, heights: np.ndarray, times: np.ndarray) -> np.ndarray:
    """HKS (n, T) of the spheroid with semi-axes 1, 1, half_axis at points of given heights z.

    The angle phi drops out: cos^2 + sin^2 = 1. Right to 1e-8 for t >= 0.046 and semi-axes
    1, 1, 2: the orders left out have exp(-lambda t) < 1e-14, and the 80 functions of each
    order resolve eigenvalues far above the 600 where exp(-lambda t) is 1e-12.
    """
    signature = np.zeros((len(heights), len(times)))
    for order in naturals():
        values, coefficients = _meridian_modes(half_axis, order)
        if values[0] * np.min(times) > 32:
            return signature
        basis = _legendre(order, len(values), np.asarray(heights) / half_axis)[0]
        squares = (basis @ coefficients) ** 2 / (2 * np.pi if order == 0 else np.pi)
        signature += squares @ np.exp(-np.outer(values, times))
    raise AssertionError


@cache
def _meridian_modes(
    half_axis: float, order: int, terms: int = 80, nodes: int = 200
) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues and coefficients of the meridian's functions of one order m.

    Separation of variables, u = P(s) exp(i m phi) with r = sin s, z = half_axis cos s,
    leaves a one-dimensional problem for each m: minimize the integral over s of
    (P'^2 / metric^2 + m^2 P^2 / r^2) metric r against that of P^2 metric r, with metric the
    meridian's length per s. Galerkin in the associated Legendre functions of order m, which
    carry the pole's zero and solve the case of the sphere, by Gauss-Legendre quadrature in
    x = cos s (r ds = dx).
    """
    x, weight = np.polynomial.legendre.leggauss(nodes)
    root = np.sqrt(1 - x**2)
    metric = np.sqrt(x**2 + half_axis**2 * root**2)
    basis, slope = _legendre(order, terms, x)
    stiffness = (slope.T * (weight / metric)) @ slope
    stiffness += (basis.T * (weight * metric * order**2 / root**2)) @ basis
    mass = (basis.T * (weight * metric)) @ basis
    values, coefficients = eigh(stiffness, mass)
    return values, coefficients


def _legendre(order: int, terms: int, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Associated Legendre functions of degrees m, ..., m + terms - 1 and their d/ds, x = cos s.

    Normalized to 1 over x in [-1, 1]; three-term recurrence in the degree, which is stable.
    The slopes are not defined at the poles, and not asked for there.
    """
    root = np.sqrt(np.maximum(1 - x**2, 0))
    first = np.full_like(x, np.sqrt(0.5))
    for m in range(1, order + 1):
        first = first * root * np.sqrt((2 * m + 1) / (2 * m))
    values, slopes = [np.zeros_like(x), first], []
    before = 0.0
    for degree in range(order, order + terms):
        # sin s dP/ds = l cos s P_l - (2 l + 1) a_l P_(l-1), a_l as below
        slope = degree * x * values[-1] - (2 * degree + 1) * before * values[-2]
        slopes.append(np.divide(slope, root, out=np.zeros_like(x), where=root > 0))
        after = np.sqrt(((degree + 1) ** 2 - order**2) / (4 * (degree + 1) ** 2 - 1))
        values.append((x * values[-1] - before * values[-2]) / after)
        before = after
    return np.stack(values[1:-1], axis=1), np.stack(slopes, axis=1)


# ------------------------------------------------------------------ products and disks


def _sums(first: np.ndarray, second: np.ndarray, count: int) -> np.ndarray:
    """Smallest sums of an eigenvalue of each factor of a product surface."""
    return np.sort(np.add.outer(first, second).ravel())[:count]


def _circle(length: float, count: int) -> np.ndarray:
    """(2 pi k / length)^2 for all integers k."""
    return (2 * np.pi * np.arange(-count, count + 1) / length) ** 2


def _interval(length: float, count: int, dirichlet: bool = False) -> np.ndarray:
    """(pi k / length)^2: cosines from k = 0 (natural boundary), sines from k = 1 (Dirichlet)."""
    return (np.pi * np.arange(int(dirichlet), count + 1) / length) ** 2


def flat_torus_eigenvalues(width: float, height: float, count: int) -> np.ndarray:
    """Fourier series on a rectangle with opposite sides glued."""
    return _sums(_circle(width, count), _circle(height, count), count)


def cylinder_eigenvalues(radius: float, height: float, count: int, dirichlet: bool) -> np.ndarray:
    """Fourier series around, cosine or sine series along."""
    around, along = _circle(2 * np.pi * radius, count), _interval(height, count, dirichlet)
    return _sums(around, along, count)


def rectangle_eigenvalues(
    width: float, height: float, count: int, dirichlet: bool = False
) -> np.ndarray:
    """Cosine (or sine) series along both sides: of a flat sheet and of a rolled one."""
    return _sums(_interval(width, count, dirichlet), _interval(height, count, dirichlet), count)


def disk_eigenvalues(radius: float, count: int, dirichlet: bool) -> np.ndarray:
    """Squared zeros of J_m (Dirichlet) or of J_m' (natural boundary; and 0) over radius^2."""
    zeros = jn_zeros if dirichlet else jnp_zeros
    found = [np.repeat(zeros(m, count), 1 if m == 0 else 2) for m in range(count)]
    if not dirichlet:
        found.append(np.zeros(1))
    return np.sort(np.concatenate(found) ** 2)[:count] / radius**2


# ------------------------------------------------------------------ torus


@one_thread
def torus_eigenvalues(ring: float, tube: float, count: int, harmonics: int = 40) -> np.ndarray:
    """Smallest eigenvalues of the embedded torus.

    u = P(a) exp(i m phi) with a the angle around the tube and r = ring + tube cos a the
    distance from the axis leaves, for each m, a periodic problem: the integral of
    P'^2 r / tube + m^2 P^2 tube / r against that of P^2 tube r. Galerkin in real Fourier
    harmonics by the trapezoidal rule, both of exponential accuracy.
    """
    angle = 2 * np.pi * np.arange(8 * harmonics) / (8 * harmonics)
    wave = np.arange(1, harmonics + 1)
    cosine, sine = np.cos(np.outer(angle, wave)), np.sin(np.outer(angle, wave))
    basis = np.hstack([np.ones((len(angle), 1)), cosine, sine])
    slope = np.hstack([np.zeros((len(angle), 1)), -wave * sine, wave * cosine])
    r = ring + tube * np.cos(angle)
    mass = (basis.T * (tube * r)) @ basis
    values = []
    for order in range(count):
        stiffness = (slope.T * (r / tube)) @ slope
        stiffness += (basis.T * (order**2 * tube / r)) @ basis
        found = eigh(stiffness, mass, eigvals_only=True)[:count]
        values.append(np.repeat(found, 1 if order == 0 else 2))
    return np.sort(np.concatenate(values))[:count]


def torus_curvature(ring: float, tube: float, points: np.ndarray) -> np.ndarray:
    """Gaussian curvature cos a / (tube (ring + tube cos a)) at points of the torus."""
    distance = np.hypot(points[:, 0], points[:, 1])
    return (distance - ring) / (tube**2 * distance)
