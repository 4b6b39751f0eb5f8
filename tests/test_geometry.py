"""Geometry of flat and curved triangles."""

from __future__ import annotations

from math import factorial

import numpy as np
import pytest

import isovary as iv
from isovary import geometry


def test_quadrature_is_exact_to_degree_six():
    """Oracle: analytic. Mean of b0^i b1^j b2^k over a triangle is 2 i! j! k! / (i + j + k + 2)!."""
    b, w = geometry.quadrature()
    for i in range(7):
        for j in range(7 - i):
            for k in range(7 - i - j):
                exact = 2 * factorial(i) * factorial(j) * factorial(k) / factorial(i + j + k + 2)
                found = w @ (b[:, 0] ** i * b[:, 1] ** j * b[:, 2] ** k)
                assert found == pytest.approx(exact, rel=1e-13), (i, j, k)


@pytest.mark.parametrize("order", [1, 2])
def test_shape_functions_interpolate_and_differentiate(order):
    """Oracle: algebra. N_i(x_j) = delta_ij, sum 1, and gradients equal central differences."""
    places = geometry.node_places(order)
    np.testing.assert_allclose(geometry.shape_functions(places, order), np.eye(len(places)), atol=0)
    b = np.random.default_rng(83).dirichlet(np.ones(3), 20)
    np.testing.assert_allclose(geometry.shape_functions(b, order).sum(axis=1), 1, atol=1e-14)
    step = 1e-6
    for k, direction in enumerate(([-1, 1, 0], [-1, 0, 1])):
        ahead, behind = (
            geometry.shape_functions(b + sign * step * np.array(direction), order)
            for sign in (1, -1)
        )
        slope = (ahead - behind) / (2 * step)
        np.testing.assert_allclose(geometry.shape_gradients(b, order)[..., k], slope, atol=1e-9)


@pytest.mark.parametrize(("order", "expected"), [(1, 2), (2, 4)])
def test_sphere_area_converges(order, expected):
    """Oracle: order. Flat triangles err with h^2, curved six-node ones with h^4."""
    errors = [abs(iv.icosphere(s, order=order).area - 4 * np.pi) for s in (2, 3, 4)]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert (np.abs(orders - expected) < 0.2).all(), orders


def test_topology_of_known_surfaces():
    """Oracle: analytic. Euler characteristic 2 - 2 g - b for each connected piece."""
    sphere = iv.icosphere(1).corners
    assert str(iv.topology(sphere)).endswith("genus 0, Euler characteristic 2")
    two = np.vstack([sphere, sphere + sphere.max() + 1])
    assert iv.topology(two) == iv.Topology(2, 0, 4, 0)
    disk = iv.topology(np.delete(sphere, 0, axis=0))
    assert disk == iv.Topology(1, 1, 1, 0)
    n, m = 5, 4
    i, j = (a.ravel() for a in np.meshgrid(np.arange(n), np.arange(m), indexing="ij"))
    corner = [(i + a) % n * m + (j + b) % m for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
    torus = np.vstack([np.stack([corner[k] for k in t], 1) for t in ((0, 1, 2), (0, 2, 3))])
    assert iv.topology(torus) == iv.Topology(1, 0, 0, 1)


def test_curved_normals_are_second_order():
    """Oracle: order. Averaged element normals of the curved sphere approach the exact ones."""
    errors = []
    for subdivisions in (2, 3, 4):
        sphere = iv.icosphere(subdivisions)
        normals = geometry.node_normals(sphere.points, sphere.triangles)
        errors.append(np.linalg.norm(normals - sphere.points, axis=1).max())
    assert (np.log2(np.divide(errors[:-1], errors[1:])) > 1.8).all(), errors
