"""What every correspondence promises."""

from __future__ import annotations

import numpy as np
import pytest

import isovary as iv

METHODS = {"normal_rays": iv.normal_rays, "closest_point": iv.closest_point}


def grown(surface, factor=1.0, shift=(0, 0, 0)):
    return iv.Surface(factor * surface.points + np.array(shift), surface.triangles)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
def test_equal_surfaces_match_node_by_node(method, order):
    """Oracle: algebra. Distance 0, and any nodal function is given back."""
    sphere = iv.icosphere(2, order=order)
    match = method(sphere, sphere)
    assert match.found.all()
    np.testing.assert_allclose(match.distance, 0, atol=1e-12)
    values = np.random.default_rng(8).random((len(sphere.points), 2))
    np.testing.assert_allclose(iv.interpolate(match, sphere, values), values, atol=1e-9)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
def test_weights_and_partner_points(method, order):
    """Oracle: analytic. Weights in [0, 1] with sum 1; partners near the sphere of radius 1.1."""
    turn = np.linalg.qr(np.random.default_rng(3).standard_normal((3, 3)))[0]
    turned = iv.icosphere(2).points @ turn.T  # so that no ray meets a node
    base = iv.Surface(turned, iv.icosphere(2).triangles, turned)
    other = grown(iv.icosphere(3, order=order), 1.1)
    match = method(base, other)
    weights = match.barycentric[match.found]
    assert match.found.all()
    assert weights.min() >= 0
    assert weights.max() <= 1
    np.testing.assert_allclose(weights.sum(axis=1), 1, atol=1e-12)
    partner = iv.interpolate(match, other, other.points)
    sag = 1e-2 if order == 1 else 6e-5  # h^2 / 8 of flat triangles; a tenth of it: curved ones
    np.testing.assert_allclose(partner, 1.1 * base.points, atol=sag)
    np.testing.assert_allclose(match.distance, 0.1, atol=sag)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
def test_linear_functions_are_carried_exactly_over_flat_patches(method, order):
    """Oracle: algebra. A linear function on the plane z = 0.2 seen from z = 0."""
    n = 5
    i, j = (a.ravel() for a in np.meshgrid(*2 * [np.arange(n)], indexing="ij"))
    points = np.stack([i, j, 0 * i], axis=1).astype(float)
    a, b = (k.ravel() for k in np.meshgrid(*2 * [np.arange(n - 1)], indexing="ij"))
    corner = a * n + b
    triangles = np.vstack(
        [np.stack([corner, corner + n, corner + n + 1], 1),
         np.stack([corner, corner + n + 1, corner + 1], 1)]
    )  # fmt: skip
    if order == 2:
        from isovary.geometry import edges_of

        edges, of_triangle, _ = edges_of(triangles)
        triangles = np.hstack([triangles, of_triangle + len(points)])
        points = np.vstack([points, points[edges].mean(axis=1)])
    plane = iv.Surface(points + np.array([0, 0, 0.2]), triangles)
    rng = np.random.default_rng(55)
    places = np.column_stack([rng.uniform(0.1, 3.9, (12, 2)), np.zeros(12)])
    base = iv.Surface(places, np.arange(12).reshape(4, 3), np.tile([0.0, 0.0, 1.0], (12, 1)))
    match = method(base, plane)
    np.testing.assert_allclose(match.distance, 0.2, atol=1e-12)
    found = iv.interpolate(match, plane, (3 * points[:, :1] - 2 * points[:, 1:2] + 1))
    np.testing.assert_allclose(found[:, 0], 3 * places[:, 0] - 2 * places[:, 1] + 1, atol=1e-10)


def test_rays_go_both_ways_and_nearest_agreeing_hit_wins():
    """Oracle: analytic. Concentric spheres of radius 0.8 and 1.1: the nearer, outward one."""
    inner, outer = grown(iv.icosphere(3), 0.8), grown(iv.icosphere(3), 1.1)
    size = len(inner.points)
    both = iv.Surface(
        np.vstack([inner.points, outer.points]),
        np.vstack([inner.triangles, outer.triangles + size]),
    )
    match = iv.normal_rays(iv.icosphere(2), both, reach=0.5)
    np.testing.assert_allclose(match.distance, 0.1, atol=1e-4)
    assert (match.hits == 2).all()
    reversed_outer = iv.Surface(
        both.points,
        np.vstack([inner.triangles, (outer.triangles + size)[:, [0, 2, 1, 5, 4, 3]]]),
    )
    match = iv.normal_rays(iv.icosphere(2), reversed_outer, reach=0.5)
    np.testing.assert_allclose(match.distance, -0.2, atol=1e-4)
    assert (match.hits == 1).all()


def test_rays_through_corners_and_edges_do_not_leak():
    """Oracle: analytic. Rays aimed exactly at the corners and edge midpoints all hit, once."""
    base = iv.icosphere(2)
    match = iv.normal_rays(base, grown(base, 0.9))
    assert match.found.all()
    assert (match.hits == 1).all()


def test_a_miss_is_no_data():
    """Oracle: analytic. Past the reach nothing is found, and nothing is made up."""
    base = iv.icosphere(1)
    other = grown(base, 2.0)
    match = iv.normal_rays(base, other, reach=0.5)
    assert not match.found.any()
    assert np.isnan(iv.interpolate(match, other, other.points)).all()
    with pytest.raises(iv.ArgumentError, match="reach"):
        iv.normal_rays(base, other, reach=-1.0)


def test_identity_needs_one_mesh():
    """Oracle: algebra. Other triangles are refused with C09."""
    with pytest.raises(iv.CorrespondenceError, match="C09"):
        iv.identity(iv.icosphere(1), iv.icosphere(2))
