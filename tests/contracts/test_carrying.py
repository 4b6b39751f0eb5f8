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


def test_carried_normals_are_the_perturbed_fields(ellipsoid):
    """Oracle: analytic. Gradient of the shifted ellipsoid at the carried points, not the base's."""
    axes, shift = np.array([1.1, 0.9, 2.2]), np.array([0.05, 0.03, -0.04])
    field = ellipsoid_field(tuple(axes), shift=tuple(shift))
    carried, _ = iv.carry(ellipsoid, field, ELLIPSOID_ISOVALUE)
    exact = (carried.points - shift) / axes**2
    exact /= np.linalg.norm(exact, axis=1, keepdims=True)
    np.testing.assert_allclose(carried.normals, exact, atol=1e-9)
    assert np.abs(carried.normals - ellipsoid.normals).max() > 0.05


def plane(height=0.0):
    """Four nodes at a height, normals along z."""
    corners = np.array([[0.0, 0, height], [1, 0, height], [1, 1, height], [0, 1, height]])
    return iv.Surface(corners, [[0, 1, 2], [0, 2, 3]])


def falling_through(*roots):
    """A field of z alone with these roots, on samples 0.2 apart."""
    return iv.ScalarField.from_function(
        lambda p: -np.prod([p[..., 2] - root for root in roots], axis=0),
        ((-0.5, -0.5, -1.0), (1.5, 1.5, 1.0)),
        (5, 5, 11),
    )


@pytest.mark.parametrize(("up", "down"), [(0.06, 0.03), (0.03, 0.06)])
def test_the_nearer_of_two_roots_within_one_step_wins(up, down):
    """Oracle: analytic. A cubic falls at -down and at +up, and rises in between."""
    field = falling_through(-down, 0.5 * (up - down), up)
    _, match = iv.carry(plane(0.5 * (up - down)), field, 0.0)
    middle = 0.5 * (up - down)
    exact = up - middle if up - middle < middle + down else -down - middle
    np.testing.assert_allclose(np.abs(match.distance), abs(exact), atol=1e-12)
    shifted = 0.3 * min(up, down) * (1 if up < down else -1)
    _, match = iv.carry(plane(middle + shifted), field, 0.0)
    exact = up - middle - shifted if shifted > 0 else -down - middle - shifted
    np.testing.assert_allclose(match.distance, exact, atol=1e-12)


def test_a_node_on_a_rising_root_goes_on():
    """Oracle: analytic. At z = 0 the field rises; the falls at -0.3 and 0.4 face the right way."""
    _, match = iv.carry(plane(), falling_through(-0.3, 0.0, 0.4), 0.0, reach=0.9)
    np.testing.assert_allclose(match.distance, -0.3, atol=1e-12)


def test_rim_nodes_stay_on_their_face_and_find_partners():
    """Oracle: analytic. A sphere cut at x = -0.4 grows by 5 %: its rim moves in the face."""

    def cut(radius):
        return iv.ScalarField.from_function(
            lambda p: -((p / radius) ** 2).sum(axis=-1),
            ((-0.4, -1.6, -1.6), (1.6, 1.6, 1.6)),
            (21, 33, 33),
        )

    base = iv.marching_cubes(cut(1.0), -1.0, vertices=300)
    carried, match = iv.carry(base, cut(1.05), -1.0)
    rim = np.abs(base.points[:, 0] + 0.4) < 1e-10
    assert rim.sum() > 20
    assert match.found[rim].all()
    assert np.abs(carried.points[rim, 0] + 0.4).max() < 1e-10
    np.testing.assert_allclose(np.linalg.norm(carried.points, axis=1), 1.05, atol=1e-9)
    exact = np.sqrt(1.05**2 - 0.16) - np.sqrt(1 - 0.16)
    np.testing.assert_allclose(match.distance[rim], exact, atol=1e-9)


def test_a_mesh_turned_over_is_refused():
    """Oracle: analytic. A node sent sideways past its neighbours turns triangles over: C05."""
    sphere = iv.icosphere(2)
    normals = sphere.normals.copy()
    normals[0] = np.cross(normals[0], [0.3, 0.5, 0.8])  # a node sent sideways, far
    normals[0] += 0.6 * sphere.normals[0]
    normals[0] /= np.linalg.norm(normals[0])
    ball = iv.ScalarField.from_function(
        lambda p: -(p**2).sum(axis=-1), ((-2, -2, -2), (2, 2, 2)), (21, 21, 21)
    )
    skewed = iv.Surface(sphere.points, sphere.triangles, normals)
    with pytest.raises(iv.CorrespondenceError, match="C05"):
        iv.carry(skewed, ball, -(1.5**2))


@pytest.mark.parametrize(("offset", "amplitude"), [(300.0, 1.0), (101325.0, 10.0), (1e6, 1.0)])
def test_an_offset_does_not_move_identical_fields(offset, amplitude):
    """Oracle: algebra. Pressure or temperature on top of a large constant: exactly no move."""
    field = iv.ScalarField.from_function(
        lambda p: offset + amplitude * np.exp(-(p**2).sum(axis=-1)),
        ((-2, -2, -2), (2, 2, 2)),
        (33, 33, 33),
    )
    isovalue = offset + 0.4 * amplitude
    base = iv.marching_cubes(field, isovalue, vertices=300)
    carried, match = iv.carry(base, field, isovalue)
    assert (match.distance == 0).all()
    np.testing.assert_array_equal(carried.points, base.points)


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
