"""Exact answers, from theory or solved independently of isovary."""

from __future__ import annotations

import numpy as np


def sphere_eigenvalues(count: int) -> np.ndarray:
    """l (l + 1), each 2 l + 1 times, on the unit sphere."""
    shells = range(int(np.sqrt(count)) + 1)
    return np.concatenate([[degree * (degree + 1)] * (2 * degree + 1) for degree in shells])[:count]


def sphere_signature(times: np.ndarray, degrees: int = 200) -> np.ndarray:
    """HKS of the unit sphere, the same at every point: sum (2 l + 1) / (4 pi) exp(-l (l + 1) t)."""
    degree = np.arange(degrees)[:, None]
    terms = (2 * degree + 1) / (4 * np.pi) * np.exp(-degree * (degree + 1) * times)
    return terms.sum(axis=0)


def spheroid_eigenvalues(half_axis: float, count: int, nodes: int = 400) -> np.ndarray:
    """Smallest eigenvalues of the spheroid with semi-axes 1, 1, half_axis.

    Separation of variables, u = P(s) exp(i m phi) with r = sin s, z = half_axis cos s,
    leaves a one-dimensional problem for each m, solved by Gauss-Legendre collocation of
    its weak form in Legendre polynomials (times sin^m, which carries the pole's zero).
    """
    x, weight = np.polynomial.legendre.leggauss(nodes)
    root = np.sqrt(1 - x**2)  # sin s, with x = cos s
    metric = np.sqrt(x**2 + half_axis**2 * root**2)  # ds of the meridian per unit of s
    degree = 40
    values = []
    for order in range(12):
        basis = np.polynomial.legendre.legvander(x, degree) * (root**order)[:, None]
        slope = np.polynomial.legendre.legvander(x, degree) * 0.0
        for k in range(degree + 1):
            unit = np.zeros(degree + 1)
            unit[k] = 1
            poly = np.polynomial.legendre.legval(x, unit)
            derivative = np.polynomial.legendre.legval(x, np.polynomial.legendre.legder(unit))
            # d/ds = -sin s d/dx; d/dx root^m = -m x root^(m-2)
            slope[:, k] = -root * derivative * root**order + order * x * poly * root ** (order - 1)
        # integral over s of (u_s^2 / metric^2 + m^2 u^2 / r^2) metric r, ds = dx / root
        stiffness = (slope.T * (weight / metric)) @ slope
        stiffness += (basis.T * (weight * metric * order**2 / root**2)) @ basis
        mass = (basis.T * (weight * metric)) @ basis
        from scipy.linalg import eigh

        scale = 1 / np.sqrt(np.diag(mass))
        found = eigh(stiffness * np.outer(scale, scale), mass * np.outer(scale, scale))[0]
        values += list(found[:count]) * (1 if order == 0 else 2)
    return np.sort(values)[:count]
