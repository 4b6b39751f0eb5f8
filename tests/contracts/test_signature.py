"""What every signature promises."""

from __future__ import annotations

import numpy as np
import pytest

import isovary as iv

METHODS = {"heat_kernel_signature": iv.heat_kernel_signature}


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
def test_signs_and_rotations_do_not_matter(method, sphere_pairs):
    """Oracle: symmetry. Signs, and rotations within a repeated eigenvalue, change nothing."""
    rng = np.random.default_rng(29)
    vectors = sphere_pairs.vectors * rng.choice([-1, 1], len(sphere_pairs.values))
    turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    vectors[:, 1:4] = vectors[:, 1:4] @ turn
    values = sphere_pairs.values.copy()
    values[1:4] = values[1:4].mean()
    pairs, other = (
        iv.Eigenpairs(values, v, sphere_pairs.residuals, sphere_pairs.area)
        for v in (sphere_pairs.vectors, vectors)
    )
    times = iv.diffusion_times(pairs, 20)
    signature = method(pairs, times)
    assert signature.shape == (len(vectors), 20)
    np.testing.assert_allclose(method(other, times), signature, rtol=1e-12)


def test_times_are_those_of_sun_et_al(sphere_pairs):
    """Oracle: analytic. From 4 ln 10 / lambda_100 to 4 ln 10 / lambda_2 = 2 ln 10, logarithmic."""
    times = iv.diffusion_times(sphere_pairs)
    assert len(times) == 100
    assert times[-1] == pytest.approx(2 * np.log(10), rel=1e-4)
    assert times[0] == pytest.approx(4 * np.log(10) / sphere_pairs.values[-1], rel=1e-14)
    np.testing.assert_allclose(np.diff(np.log(times)), np.log(times[1] / times[0]), rtol=1e-9)


def test_large_times_tend_to_one_over_the_area(sphere_pairs):
    """Oracle: analytic. All heat is spread evenly: HKS -> 1 / (4 pi)."""
    late = iv.heat_kernel_signature(sphere_pairs, [50.0])
    np.testing.assert_allclose(late, 1 / sphere_pairs.area, rtol=1e-9)


def test_change_is_divided_by_the_bases_mean_signature(sphere_pairs):
    """Oracle: algebra. A signature 1 % smaller everywhere changes by its share of the mean."""
    times = iv.diffusion_times(sphere_pairs, 30)
    signature = iv.heat_kernel_signature(sphere_pairs, times)
    scale = iv.heat_trace_scale(sphere_pairs, times)
    change = iv.signature_difference(signature, 0.99 * signature, scale)
    np.testing.assert_allclose(change, 0.01 * signature / scale, rtol=1e-9)
    np.testing.assert_allclose(change, 0.01, rtol=0.01)  # a sphere: the mean is everywhere
    halved = iv.signature_difference(signature, 0.99 * signature, scale, parameter_step=2.0)
    np.testing.assert_allclose(halved, change / 2)


def test_wrong_shapes_are_refused():
    """Oracle: algebra. Unequal shapes, weights of zero, a step of zero."""
    two = np.ones((3, 2))
    for arguments, step, code in (
        ((two, two[:2], np.ones(2)), 1.0, "A03"),
        ((two, two, np.ones(3)), 1.0, "A03"),
        ((two, two, np.zeros(2)), 1.0, "A02"),
        ((two, two, np.ones(2)), 0.0, "A02"),
    ):
        with pytest.raises(iv.ArgumentError, match=code):
            iv.signature_difference(*arguments, parameter_step=step)
