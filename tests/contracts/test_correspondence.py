"""What every correspondence promises."""

from __future__ import annotations

import numpy as np
import pytest

import isovary as iv
from isovary.correspondence import audit
from isovary.geometry import (
    edges_of,
    linear_triangles,
    node_areas,
    shape_functions,
    tangents,
    triangle_areas,
)

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


def rays_at(targets, start=0.9):
    """A base of loose triangles whose nodes look from the origin's side at the given targets."""
    directions = targets / np.linalg.norm(targets, axis=1, keepdims=True)
    directions = directions[: len(directions) // 3 * 3]
    loose = np.arange(len(directions)).reshape(-1, 3)
    return iv.Surface(start * directions, loose, directions)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("off", [0, 1e-16, 1e-13, 1e-10, 1e-8, 1e-7, 1e-6])
def test_rays_at_corners_and_edges_hit_once(order, off):
    """Oracle: analytic. Aimed at, or just beside, each corner and edge midpoint: one hit each."""
    sphere = iv.icosphere(3, order=order)
    edges = edges_of(sphere.triangles)[0]
    targets = np.concatenate([sphere.points, sphere.points[edges].mean(axis=1)])
    beside = off * np.random.default_rng(1).standard_normal(targets.shape)
    match = iv.normal_rays(rays_at(targets + beside), sphere)
    assert match.found.all()
    assert (match.hits == 1).all()


def test_rays_beside_a_rim_miss():
    """Oracle: analytic. A millionth inside the edges of a triangle is a hit, outside none."""
    triangle = iv.Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    inside = np.array([[1e-7, 0.5, 0.1], [0.5, 1e-7, 0.1], [0.5, 0.5 - 1e-7, 0.1]])
    outside = np.array([[-1e-7, 0.5, 0.1], [0.5, -1e-7, 0.1], [0.5, 0.5 + 1e-7, 0.1]])
    for places, found in ((inside, True), (outside, False)):
        base = iv.Surface(places, [[0, 1, 2]], np.tile([0.0, 0.0, 1.0], (3, 1)))
        match = iv.normal_rays(base, triangle, reach=1.0)
        assert (match.found == found).all()
        assert (match.hits == found).all()


def test_the_reach_is_a_limit():
    """Oracle: analytic. Planes at 0.4 and at 0.4 + 1e-9 with a reach of 0.4, either way."""
    base = iv.Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    for height, found in ((0.4 - 1e-9, True), (0.4 + 1e-9, False)):
        for side in (1, -1):
            points = 3 * base.points - [1, 1, 0] + [0, 0, side * height]
            match = iv.normal_rays(base, iv.Surface(points, base.triangles), reach=0.4)
            assert (match.found == found).all()


def test_grazing_and_opposed_hits_are_none():
    """Oracle: analytic. Planes at 80, 88, 92 and 180 degrees to the ray; cos 87.1 is 0.05."""
    base = iv.Surface([[0, 0, 0.1], [0.1, 0, 0.1], [0, 0.1, 0.1]], [[0, 1, 2]])
    for degrees, found in ((80, True), (88, False), (92, False), (180, False)):
        c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        corners = np.array([[-9.0, -9, 0], [18, -9, 0], [-9, 18, 0]])
        turned = corners @ np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])
        match = iv.normal_rays(base, iv.Surface(turned, [[0, 1, 2]]), reach=50.0)
        assert (match.found == found).all()
        if found:  # the plane x sin + z cos = 0
            x = base.points[:, 0]
            np.testing.assert_allclose(match.distance, -s / c * x - 0.1, atol=1e-12)


def places_on(surface, count, rng):
    """Random places on curved elements, a third of them near edges, unit normals, weights."""
    triangle = rng.integers(len(surface.triangles), size=count)
    weights = rng.dirichlet([1, 1, 1], count)
    weights[::3, 0] *= 1e-4
    weights /= weights.sum(axis=1, keepdims=True)
    nodes = surface.triangles[triangle]
    shapes = shape_functions(weights, surface.order)
    places = np.einsum("ni,nid->nd", shapes, surface.points[nodes])
    columns = np.array(
        [
            tangents(surface.points, n[None], w[None])[0, 0]
            for n, w in zip(nodes, weights, strict=True)
        ]
    )
    normals = np.cross(columns[..., 0], columns[..., 1])
    return places, normals / np.linalg.norm(normals, axis=1, keepdims=True), weights


def test_rays_meet_curved_elements_where_they_meet_them():
    """Oracle: algebra. Rays through known places of an ellipsoid's elements: the same places."""
    ellipsoid = iv.ellipsoid((1.0, 0.7, 0.5), 2)
    rng = np.random.default_rng(5)
    places, normals, _ = places_on(ellipsoid, 1500, rng)
    tilted = normals + 0.3 * rng.uniform(-1, 1, normals.shape)
    tilted /= np.linalg.norm(tilted, axis=1, keepdims=True)
    distance = rng.uniform(-0.05, 0.05, len(places))
    start = places - distance[:, None] * tilted
    base = iv.Surface(start, np.arange(len(start)).reshape(-1, 3), tilted)
    match = iv.normal_rays(base, ellipsoid, reach=0.2)
    np.testing.assert_allclose(match.distance, distance, atol=1e-11)
    partners = iv.interpolate(match, ellipsoid, ellipsoid.points)
    np.testing.assert_allclose(partners, places, atol=1e-11)


def test_closest_point_beyond_the_edges_of_a_long_triangle():
    """Oracle: analytic. The foot on the edge x + 10 y = 10; the nearest corner; the inside."""
    triangle = iv.Surface([[0, 0, 0], [10, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    places = np.array([[9.0, 3.0, 0.0], [11.0, -1.0, 0.0], [2.0, 0.5, 7.0]])
    base = iv.Surface(places, [[0, 1, 2]], np.tile([0.0, 0.0, 1.0], (3, 1)))
    match = iv.closest_point(base, triangle)
    np.testing.assert_allclose(np.abs(match.distance), [29 / 101**0.5, 2**0.5, 7.0], rtol=1e-14)
    feet = iv.interpolate(match, triangle, triangle.points)
    expected = [places[0] - 29 / 101 * np.array([1, 10, 0]), [10, 0, 0], [2, 0.5, 0]]
    np.testing.assert_allclose(feet, expected, atol=1e-13)


def test_closest_point_on_flat_triangles_against_igl():
    """Oracle: peer. libigl's point_mesh_squared_distance, on a torus with long triangles."""
    igl = pytest.importorskip("igl")
    torus = iv.torus(1.0, 0.4, (9, 30), order=1)
    places = np.random.default_rng(2).uniform(-2, 2, (600, 3))
    base = iv.Surface(places, np.arange(600).reshape(-1, 3))
    match = iv.closest_point(base, torus)
    square, _, feet = igl.point_mesh_squared_distance(places, torus.points, torus.triangles)
    np.testing.assert_allclose(np.abs(match.distance), np.sqrt(square), atol=1e-12)
    np.testing.assert_allclose(iv.interpolate(match, torus, torus.points), feet, atol=1e-9)


def test_closest_point_on_curved_elements():
    """Oracle: analytic. Off a curved element along its normal, by little: that far away.

    At their edges the elements meet at small angles: another place may be nearer, none farther.
    """
    ellipsoid = iv.ellipsoid((1.0, 0.7, 0.5), 2)
    rng = np.random.default_rng(6)
    places, normals, weights = places_on(ellipsoid, 1500, rng)
    distance = rng.uniform(-0.05, 0.05, len(places))
    start = places + distance[:, None] * normals
    base = iv.Surface(start, np.arange(len(start)).reshape(-1, 3), normals)
    error = np.abs(distance) - np.abs(iv.closest_point(base, ellipsoid).distance)
    assert error.min() > -1e-12
    assert error[weights.min(axis=1) > 0.05].max() < 1e-12


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


def test_values_of_another_surface_are_refused():
    """Oracle: algebra. Wrong rows, and a match with a finer surface: A03."""
    small, fine = iv.icosphere(1), iv.icosphere(2)
    match = iv.normal_rays(small, fine)
    for surface, values in ((fine, small.points), (small, small.points), (fine, fine.points[:, 0])):
        with pytest.raises(iv.ArgumentError, match="A03"):
            iv.interpolate(match, surface, values)
    for pair in ((fine, fine), (small, small)):
        with pytest.raises(iv.ArgumentError, match="A03"):
            audit(*pair, match)


# ------------------------------------------------------------------ audit

TURN = np.linalg.qr(np.random.default_rng(4).standard_normal((3, 3)))[0]
TURN *= np.linalg.det(TURN)  # no mirror


def turned(surface, factor=1.0):
    return iv.Surface(factor * surface.points @ TURN.T, surface.triangles)


def joined(*surfaces):
    starts = np.cumsum([0] + [len(s.points) for s in surfaces[:-1]])
    return iv.Surface(
        np.concatenate([s.points for s in surfaces]),
        np.concatenate([s.triangles + k for s, k in zip(surfaces, starts, strict=True)]),
    )


def without(surface, dropped):
    nodes, triangles = np.unique(surface.triangles[~dropped], return_inverse=True)
    return iv.Surface(surface.points[nodes], triangles.reshape(-1, surface.triangles.shape[1]))


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("finer", [-1, 0, 1])
def test_spheres_of_other_meshes_cover_each_other(order, finer):
    """Oracle: analytic. A sphere seen from inside: all covered, nothing folded, no choice."""
    base, other = iv.icosphere(3), turned(iv.icosphere(3 + finer, order=order), 1.1)
    found = audit(base, other, iv.normal_rays(base, other))
    assert (found.base_coverage, found.perturbed_coverage) == (1.0, 1.0)
    assert (found.covered == 1).all()
    assert (found.lost, found.folded, found.several) == (0, 0.0, 0.0)
    assert found.faults == ()
    sag = 1.1 * 0.32**2 / 6  # of the coarsest flat triangles
    assert 0.1 - sag < found.distances[0] < found.distances[2] < 0.1 + 1e-3


@pytest.mark.parametrize("order", [1, 2])
def test_area_ratio_of_a_larger_sphere(order):
    """Oracle: analytic. Every triangle grows by (R / r)^2 = 2.25, and is half a radius away."""
    base = grown(iv.icosphere(2, order=order), 1.0)
    other = grown(base, 1.5)
    found = audit(base, other, iv.identity(base, other))
    np.testing.assert_allclose(found.area_ratios, 2.25, rtol=1e-12)
    rays = iv.Surface(base.points, base.triangles, base.points)
    found = audit(rays, other, iv.normal_rays(rays, other))
    np.testing.assert_allclose(found.area_ratios, 2.25, rtol=1e-12)
    np.testing.assert_allclose(found.distances, 0.5, rtol=1e-12)


def test_a_planted_hole_lowers_the_coverage_of_the_base():
    """Oracle: analytic. The cap z > 0.6, a fifth of the sphere, is cut off what is seen."""
    whole = iv.icosphere(4, order=1)
    high = whole.points[whole.triangles].mean(axis=1)[:, 2] > 0.6
    other = grown(without(whole, high), 1.1)
    base = iv.Surface(whole.points, whole.triangles, whole.points)
    match = iv.normal_rays(base, other)
    kept = np.isin(np.arange(len(whole.points)), whole.triangles[~high])
    np.testing.assert_array_equal(match.found, kept)
    assert np.isnan(match.distance[~kept]).all()
    assert np.isnan(iv.interpolate(match, other, other.points)[~kept]).all()
    found = audit(base, other, match)
    areas = node_areas(whole.points, whole.triangles)
    np.testing.assert_allclose(found.base_coverage, areas[kept].sum() / areas.sum())
    assert abs(1 - found.base_coverage - 0.2) < 0.03  # a row of triangles: 2 pi 0.8 0.08 / 4 pi
    assert found.perturbed_coverage == 1
    np.testing.assert_allclose(found.area_ratios, 1.21, rtol=1e-9)
    assert found.lost == found.lost_inside == (~kept).sum()
    assert "without a partner" in found.faults[0]


def test_a_planted_island_lowers_the_coverage_of_the_perturbed_surface():
    """Oracle: analytic. A sphere of half the radius beside the first: 1 of 1.25 areas is seen."""
    base = iv.icosphere(2)
    other = joined(grown(base, 1.1), grown(base, 0.55, (4, 0, 0)))
    found = audit(base, other, iv.normal_rays(base, other))
    assert found.base_coverage == 1
    np.testing.assert_allclose(found.perturbed_coverage, 0.8, rtol=1e-12)
    np.testing.assert_array_equal(found.covered, np.repeat([1.0, 0.0], len(base.triangles)))
    assert "20.00%" in " ".join(found.faults)


@pytest.mark.parametrize("gap", [0.1, 0.02])
def test_a_second_sheet_is_not_covered(gap):
    """Oracle: analytic. Of spheres of radius 1.05 and 1.05 + gap only the nearer is a partner."""
    base, radii = iv.icosphere(3), np.array([1.05, 1.05 + gap])
    inner, outer = (turned(iv.icosphere(3), radius) for radius in radii)
    found = audit(base, joined(inner, outer), iv.normal_rays(base, joined(inner, outer)))
    share = radii[0] ** 2 / (radii**2).sum()
    np.testing.assert_allclose(found.perturbed_coverage, share, rtol=1e-12)
    assert found.several == 1
    assert "several partners" in " ".join(found.faults)


def test_a_tentacle_between_the_rays_is_not_covered():
    """Oracle: algebra. What was pulled out of a sphere amid a base triangle, and it alone."""
    base, fine = iv.icosphere(2, order=1), iv.icosphere(5, order=1)
    axis = base.points[base.triangles[0]].mean(axis=0)
    near = fine.points @ axis / np.linalg.norm(axis) > np.cos(0.06)
    other = iv.Surface(fine.points * np.where(near, 2.0, 1.05)[:, None], fine.triangles)
    found = audit(base, other, iv.normal_rays(base, other))
    assert found.base_coverage == 1
    assert 3 < near.sum() < 20
    pulled = near[fine.triangles].any(axis=1)
    np.testing.assert_array_equal(found.covered == 0, pulled)
    areas = triangle_areas(other.points, other.triangles)
    np.testing.assert_allclose(
        1 - found.perturbed_coverage, areas[pulled].sum() / areas.sum(), rtol=1e-12
    )


@pytest.mark.parametrize("order", [1, 2])
def test_a_folded_map_is_counted(order):
    """Oracle: analytic. A sheet folded in its middle: half turned over, half covered."""
    sheet = iv.sheet(2.0, 1.0, (8, 4), order=order)
    points = sheet.points.copy()
    points[:, 0] = np.minimum(points[:, 0], -points[:, 0])
    match = iv.closest_point(iv.Surface(points, sheet.triangles), sheet)
    found = audit(sheet, sheet, match)
    np.testing.assert_allclose(found.folded, 0.5, rtol=1e-12)
    np.testing.assert_allclose(found.perturbed_coverage, 0.5, rtol=1e-12)
    right = sheet.points[sheet.corners].mean(axis=1)[:, 0] > 0
    np.testing.assert_array_equal(found.turned, right)
    np.testing.assert_allclose(found.area_ratios, 1.0, rtol=1e-9)
    assert "turned over" in " ".join(found.faults)


def test_a_collapsed_map_is_counted():
    """Oracle: analytic. Everything on one point: all folded, nothing covered, ratios 0."""
    sphere = iv.icosphere(1)
    count = len(sphere.points)
    match = iv.Correspondence(
        np.zeros(count), np.tile([0.2, 0.3, 0.5], (count, 1)), np.ones(count), np.ones(count)
    )
    found = audit(sphere, sphere, match)
    assert (found.folded, found.perturbed_coverage) == (1.0, 0.0)
    np.testing.assert_allclose(found.area_ratios, 0, atol=1e-25)


def test_misses_along_a_rim_are_told_from_holes():
    """Oracle: analytic. A sheet 2 wide over one 1 wide; then a base closed around its misses."""
    base, narrow = iv.sheet(2.0, 1.0, (8, 4)), iv.sheet(1.0, 1.0, (4, 4))
    beyond = np.abs(base.points[:, 0]) > 0.5
    match = iv.normal_rays(base, narrow)
    np.testing.assert_array_equal(match.found, ~beyond)
    found = audit(base, narrow, match)
    assert (found.lost, found.lost_inside) == (beyond.sum(), 0)
    np.testing.assert_allclose(found.base_coverage, 4.5 / 8)  # of 8 columns, and half of a half
    wide = iv.sheet(2.0, 1.0, (8, 8), order=1)
    middle = wide.points[wide.triangles].mean(axis=1) - [0, 0.5, 0]
    holed = without(wide, (np.abs(middle) < 0.25).all(axis=1))
    fine = iv.sheet(2.0, 1.0, (32, 32), order=1)
    amid = (np.abs(fine.points - [0, 0.5, 0])[:, :2] < 0.25 - 1e-9).all(axis=1)
    found = audit(fine, holed, iv.normal_rays(fine, holed))
    assert found.lost == found.lost_inside == amid.sum() == 7 * 15
    # six columns of cells: the middle one's nodes see the hole, the next the sheet, the rest none
    both = without(holed, np.abs(holed.points[holed.triangles].mean(axis=1)[:, 0]) > 0.5)
    coarse = iv.sheet(2.0, 1.0, (6, 8), order=1)
    found = audit(coarse, both, iv.normal_rays(coarse, both))
    assert (found.lost, found.lost_inside) == (3 + 4 * 9, 3)


def test_distances_are_quantiles_by_area():
    """Oracle: analytic. Of a sheet, the part within x of its left end is lifted by x^2 at most."""
    sheet = iv.sheet(1.0, 1.0, (100, 2), order=1)
    lift = (sheet.points[:, 0] + 0.5) ** 2
    lifted = iv.Surface(sheet.points + np.outer(lift, [0, 0, 1]), sheet.triangles)
    found = audit(sheet, lifted, iv.identity(sheet, lifted))
    np.testing.assert_allclose(found.distances, [0.25, 0.95**2, 1.0], atol=0.01)


def test_no_partners_at_all():
    """Oracle: algebra. Coverage 0; what has no value is NaN, in the summary None, and in words."""
    import json

    base = iv.icosphere(1)
    other = grown(base, 1.0, (9, 0, 0))
    found = audit(base, other, iv.normal_rays(base, other, reach=1.0))
    assert (found.base_coverage, found.perturbed_coverage, found.folded) == (0.0, 0.0, 0.0)
    assert np.isnan(found.distances).all()
    said = json.loads(json.dumps(found.summary(), allow_nan=False))
    assert said["distance"] is None
    assert said["area_ratio"] is None
    assert said["nodes_without_partner"] == len(base.points)
    assert len(said["faults"]) == 2


def test_a_carried_mesh_is_one_to_one():
    """Oracle: algebra. Each node is its own partner: everything covered, the areas' own ratios."""
    base, carried = iv.icosphere(2), iv.ellipsoid((1.2, 1.0, 0.9), 2)
    match = iv.identity(base, carried)
    found = audit(base, carried, match)
    assert (found.base_coverage, found.perturbed_coverage, found.faults) == (1.0, 1.0, ())
    flat = linear_triangles(base.triangles)
    ratios = triangle_areas(carried.points, flat) / triangle_areas(base.points, flat)
    np.testing.assert_allclose(found.area_ratios[[0, -1]], [ratios.min(), ratios.max()])
    assert found.summary()["area_ratio"]["largest"] == found.area_ratios[-1]
