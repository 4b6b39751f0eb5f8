"""What every way of carrying promises: the base mesh on the perturbed isosurface."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import ELLIPSOID_ISOVALUE, ellipsoid_field

import isovary as iv


def test_identical_fields_move_nothing(ellipsoid):
    """Oracle: algebra. Distance exactly 0, points bit for bit the same."""
    carried, match = iv.carry(ellipsoid, ellipsoid_field(), ELLIPSOID_ISOVALUE)
    assert (match.distance == 0).all()
    np.testing.assert_array_equal(carried.points, ellipsoid.points)


@pytest.mark.parametrize("radius", [0.7, 0.99, 1.0001, 1.25])
def test_sphere_to_sphere(radius):
    """Oracle: analytic. Along a unit sphere's normals the distance is radius - 1, both ways."""
    ball = iv.ScalarField.from_function(
        lambda p: -(p**2).sum(axis=-1), ((-2, -2, -2), (2, 2, 2)), (21, 21, 21)
    )
    sphere = iv.icosphere(2)
    carried, match = iv.carry(sphere, ball, -(radius**2))
    np.testing.assert_allclose(match.distance, radius - 1, atol=1e-12)
    np.testing.assert_allclose(carried.points, radius * sphere.points, atol=1e-12)
    np.testing.assert_allclose(carried.normals, sphere.points, atol=1e-10)
    np.testing.assert_array_equal(carried.triangles, sphere.triangles)
    assert match.found.all()


def test_distance_is_the_rays_root(ellipsoid):
    """Oracle: analytic. The quadratic equation of a ray and an ellipsoid gives the distance."""
    axes = np.array([1.08, 0.95, 2.1])
    shift = np.array([0.03, -0.02, 0.05])
    field = ellipsoid_field(tuple(axes), shift=tuple(shift))
    carried, match = iv.carry(ellipsoid, field, ELLIPSOID_ISOVALUE)
    p, d = (ellipsoid.points - shift) / axes, ellipsoid.normals / axes
    a, b, c = (d * d).sum(1), 2 * (p * d).sum(1), (p * p).sum(1) - 1
    exact = (-b + np.sqrt(b * b - 4 * a * c)) / (2 * a)
    np.testing.assert_allclose(match.distance, exact, atol=1e-9)
    np.testing.assert_allclose(field.value(carried.points), ELLIPSOID_ISOVALUE, rtol=1e-12)


def test_a_second_sheet_facing_the_other_way_is_not_taken():
    """Oracle: analytic. Between two nested shells the inner wall of the outer shell is refused.

    The field is high for r < 1 and again for 1.15 < r < 1.6. From r = 0.97 the
    fall at r = 1 is right, the rise at 1.15 faces the other way; from r = 1.12,
    nearer to the rise, still the fall at r = 1 is taken.
    """

    def shells(p):
        r = np.linalg.norm(p, axis=-1)
        return np.where(r < 1.075, 1 - r, np.minimum(r - 1.15, 1.6 - r))

    field = iv.ScalarField.from_function(shells, ((-2, -2, -2), (2, 2, 2)), (121, 121, 121))
    for start in (0.97, 1.12):
        sphere = iv.Surface(
            start * iv.icosphere(1).points, iv.icosphere(1).triangles, iv.icosphere(1).points
        )
        _, match = iv.carry(sphere, field, 0.0)
        np.testing.assert_allclose(match.distance, 1 - start, atol=2e-3)


def test_nodes_without_a_root_are_told_and_the_mesh_stays_whole():
    """Oracle: analytic. With a short reach the far cap of a shifted sphere finds no partner."""
    shift = 0.12
    ball = iv.ScalarField.from_function(
        lambda p: -((p - [0, 0, shift]) ** 2).sum(axis=-1), ((-2, -2, -2), (2, 2, 2)), (21, 21, 21)
    )
    sphere = iv.icosphere(3)
    z = sphere.points[:, 2]
    # |(1 + s) x - shift e_z| = 1 for s
    exact = shift * z + np.sqrt(1 - shift**2 * (1 - z**2)) - 1
    reach = 0.115
    carried, match = iv.carry(sphere, ball, -1.0, reach=reach)
    cell = ball.spacing[0] / 3  # the search ends at a whole number of steps
    assert not match.found[np.abs(exact) > reach + cell].any()
    assert match.found[np.abs(exact) < reach].all()
    lost = ~match.found
    assert np.isnan(match.distance[lost]).all()
    np.testing.assert_allclose(np.linalg.norm(carried.points - [0, 0, shift], axis=1), 1, atol=1e-9)


def test_too_far_apart_is_an_error():
    """Oracle: analytic. A sphere of radius 0.3 is out of reach of one of radius 1.5."""
    ball = iv.ScalarField.from_function(
        lambda p: -(p**2).sum(axis=-1), ((-2, -2, -2), (2, 2, 2)), (21, 21, 21)
    )
    with pytest.raises(iv.CorrespondenceError, match=r"C02") as caught:
        iv.carry(iv.icosphere(1), ball, -(0.3**2), reach=0.5)
    assert "got 100%" in str(caught.value)
    with pytest.raises(iv.ArgumentError, match="reach: expected a positive length, got 0"):
        iv.carry(iv.icosphere(1), ball, -1.0, reach=0.0)
