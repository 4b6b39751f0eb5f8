"""The discretization held to exact answers."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import ELLIPSOID_ISOVALUE, ellipsoid_field
from oracles import sphere_eigenvalues, sphere_signature, spheroid_eigenvalues

import isovary as iv


def spread(signature, exact):
    """Standard deviation over the nodes relative to the exact value, for each time."""
    return signature.std(axis=0) / exact


@pytest.mark.parametrize(("order", "expected"), [(1, 2), (2, 4)])
def test_sphere_eigenvalues_converge(order, expected):
    """Oracle: order. lambda_1..24 of the icosphere: order 2 for linear, 4 for curved quadratic."""
    exact = sphere_eigenvalues(25)[1:]
    errors = []
    for subdivisions in (2, 3, 4):
        values = iv.eigenpairs(iv.fem(iv.icosphere(subdivisions, order=order)), 25).values[1:]
        errors.append(np.abs(values / exact - 1).mean())
    slope = -np.polyfit([0, 1, 2], np.log2(errors), 1)[0]
    assert abs(slope - expected) < 0.25, f"fitted order {slope:.2f}, errors {errors}"


@pytest.mark.parametrize("axis", [2.0, 1.5, 0.5])
def test_spheroid_eigenvalues(axis):
    """Oracle: analytic. Separation of variables; meshes made from a sampled field, order 4."""
    field = ellipsoid_field((1.0, 1.0, axis), samples=31)
    exact = spheroid_eigenvalues(axis, 30)
    sizes, errors = [], []
    for vertices in (300, 800, 2000):
        surface = iv.marching_cubes(field, ELLIPSOID_ISOVALUE, vertices=vertices)
        found = iv.eigenpairs(iv.fem(surface), 30).values[:30]  # a copy of the last is added
        sizes.append(len(surface.points))
        errors.append(np.abs(found[1:] / exact[1:] - 1).max())
    order = -2 * np.polyfit(np.log(sizes), np.log(errors), 1)[0]  # h ~ nodes^(-1/2)
    assert abs(order - 4) < 0.5, f"fitted order {order:.2f}, errors {errors}"
    assert errors[-1] < 1e-4


def test_sphere_signature_at_ten_thousand_nodes():
    """Oracle: analytic. HKS = sum (2l+1)/(4 pi) exp(-l(l+1)t): spread at most 6e-5, median 5e-7."""
    pairs = iv.eigenpairs(iv.fem(iv.icosphere(4)), 300)
    times = iv.diffusion_times(pairs)
    exact = sphere_signature(times)
    signature = iv.heat_kernel_signature(pairs, times)
    found = spread(signature, exact)
    assert signature.shape == (10242, 100)
    assert found.max() <= 6e-5
    assert np.median(found) <= 5e-7
    assert np.abs(signature.mean(axis=0) / exact - 1).max() <= 2e-4


def test_heat_trace_is_the_integral_of_the_signature(sphere_pairs):
    """Oracle: algebra. integral HKS = sum exp(-lambda t), since phi^T mass phi = 1; to 1e-10."""
    laplacian = iv.fem(iv.icosphere(3))
    times = iv.diffusion_times(sphere_pairs)
    squares = ((laplacian.mass @ sphere_pairs.vectors) * sphere_pairs.vectors).sum(axis=0)
    integral = squares @ np.exp(-np.outer(sphere_pairs.values, times))
    trace = iv.heat_trace_scale(sphere_pairs, times) * sphere_pairs.area
    np.testing.assert_allclose(integral, trace, rtol=1e-10)


@pytest.mark.parametrize("scale", [1e-12, 1e-6, 1e6, 1e12])
def test_scaling(scale, ellipsoid):
    """Oracle: symmetry. Lengths by s: lambda by s^-2, HKS by s^-2 at times s^2 t; relative 1e-8."""
    grown = iv.Surface(scale * ellipsoid.points, ellipsoid.triangles)
    pairs, other = (iv.eigenpairs(iv.fem(surface), 60) for surface in (ellipsoid, grown))
    np.testing.assert_allclose(other.values[1:] * scale**2, pairs.values[1:], rtol=1e-8)
    times = iv.diffusion_times(pairs)
    first = iv.heat_kernel_signature(pairs, times)
    second = iv.heat_kernel_signature(other, scale**2 * times)
    np.testing.assert_allclose(second * scale**2, first, rtol=1e-8)


def test_rigid_motion_mirror_and_renumbering(ellipsoid):
    """Oracle: symmetry. The HKS does not see them; relative 1e-8."""
    rng = np.random.default_rng(4711)
    turn = np.linalg.qr(rng.standard_normal((3, 3)))[0] @ np.diag([1, 1, -1])
    order = rng.permutation(len(ellipsoid.points))
    shuffled = np.argsort(order)[ellipsoid.triangles][rng.permutation(len(ellipsoid.triangles))]
    rolled = shuffled[:, [1, 2, 0, 4, 5, 3]]
    moved = iv.Surface(ellipsoid.points[order] @ turn.T + [3.0, -1.0, 2.0], rolled)
    pairs, other = (iv.eigenpairs(iv.fem(surface), 60) for surface in (ellipsoid, moved))
    times = iv.diffusion_times(pairs)
    first = iv.heat_kernel_signature(pairs, times)[order]
    np.testing.assert_allclose(iv.heat_kernel_signature(other, times), first, rtol=1e-8)
