"""Meshes matched so that lengths change least: held to isometries whose maps are known."""

from __future__ import annotations

import numpy as np
import pytest

import isovary as iv
from isovary.correspondence import audit, isometric_match
from isovary.geometry import linear_triangles, rim_nodes

AXES = np.array([1.0, 1.3, 1.7])
WIDTH, HEIGHT = 2.0, 1.3


def turn_about(axis, angle):
    """Rotation matrix by Rodrigues' formula."""
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def moved(surface, turn, shift=(0.0, 0.0, 0.0), factor=1.0):
    points = factor * surface.points @ turn.T + np.array(shift)
    return iv.Surface(points, surface.triangles, surface.normals @ turn.T)


def partners(match, surface):
    return iv.interpolate(match, surface, surface.points)


def flattened(points, bend):
    """Material coordinates (n, 2) of places on a sheet rolled to the radius 1 / bend."""
    x, y, z = points.T
    return np.column_stack([np.arctan2(x, z + 1 / bend) / bend, y])


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("radius", [5.0, 2.0, 1.0])
def test_a_rolled_sheet_is_unrolled(radius, order):
    """Oracle: analytic. Rolling keeps all lengths, so it is the map; chords of flat triangles
    are shorter than their arcs by (h / radius)^2 / 24, curved ones err so within a cell only.
    Rays and closest points land elsewhere: at asin(x) or atan(x) on the radius 1.
    """
    flat = iv.sheet(WIDTH, HEIGHT, (16, 10), order=order)
    rolled = iv.sheet(WIDTH, HEIGHT, (19, 9), bend=1 / radius, order=order)
    match = isometric_match(flat, rolled)
    there = partners(match, rolled)
    cell = HEIGHT / 9
    short = (cell / radius) ** 2 / 24 * (1 if order == 1 else cell)
    error = flattened(there, 1 / radius) - flat.points[:, :2]
    assert np.abs(error).max() < short
    assert iv.distortion(flat, there).strain < 2 * (cell / radius) ** 2 / 24 < 1e-2
    offset = there - flat.points
    np.testing.assert_allclose(np.abs(match.distance), np.linalg.norm(offset, axis=1), atol=1e-12)
    assert match.distance.max() < short  # the axis is below: negative but at the middle
    assert match.distance.min() < -0.4 / radius  # 1 - cos(1) = 0.46 at the ends on the radius 1
    if radius == 1.0:
        nearest = partners(iv.closest_point(flat, rolled), rolled)
        assert np.abs(flattened(nearest, 1.0) - flat.points[:, :2]).max() > 0.2


@pytest.fixture(scope="module")
def signatures():
    """Pairs and heat kernel signatures of sheets, by counts and bend, at one set of times."""

    def of(counts, bend, times=None):
        surface = iv.sheet(WIDTH, HEIGHT, counts, bend=bend)
        pairs = iv.eigenpairs(iv.fem(surface), 100)
        times = iv.diffusion_times(pairs) if times is None else times
        return surface, iv.heat_kernel_signature(pairs, times), pairs, times

    return of


@pytest.mark.parametrize(
    ("radii", "counts", "others"),
    [((2.0, 1.0), (20, 14), (18, 16)), ((5.0,), (32, 22), (36, 20))],
)
def test_an_isometry_changes_no_signature(signatures, radii, counts, others):
    """Oracle: analytic. The heat kernel knows lengths only: no change, but for the noise of two
    meshes, which flat against flat shows alone; along rays points slide past each other.
    """
    flat, before, pairs, times = signatures(counts, 0.0)
    scale = iv.heat_trace_scale(pairs, times)

    def change(method, other, after):
        carried = iv.interpolate(method(flat, other), other, after)
        return iv.signature_difference(before, carried, scale)

    noise = change(iv.normal_rays, *signatures(others, 0.0, times)[:2])
    for radius in radii:
        rolled, after, _, _ = signatures(others, 1 / radius, times)
        matched = change(isometric_match, rolled, after)
        along_rays = change(iv.normal_rays, rolled, after)
        found = np.isfinite(along_rays[:, 0])
        assert 0.8 < found.mean() < 1
        assert np.isfinite(matched).all()
        rms = [np.sqrt((part[found] ** 2).mean()) for part in (matched, along_rays)]
        assert rms[1] > 10 * rms[0]
        assert np.sqrt((matched**2).mean()) < 1.1 * np.sqrt((noise**2).mean())


def ellipsoid_pair(level, order):
    """The icosphere's ellipsoid, and one turned and shifted, meshed by marching cubes."""
    turn, shift = turn_about((1, 2, 1.5), np.radians(10)), np.array([0.1, -0.05, 0.08])
    field = iv.ScalarField.from_function(
        lambda p: -((((p - shift) @ turn) / AXES) ** 2).sum(axis=-1),
        ((-3.0,) * 3, (3.0,) * 3),
        (9, 9, 9),
    )
    base = iv.ellipsoid(AXES, level, order=order)
    other = iv.marching_cubes(field, -1.0, vertices={2: 150, 3: 600}[level])
    if order == 1:
        other = iv.Surface(other.points, linear_triangles(other.triangles))
    return base, other, base.points @ turn.T + shift


@pytest.mark.parametrize(("order", "least"), [(1, 1.7), (2, 2.5)])
def test_a_turned_and_shifted_ellipsoid_is_found(order, least):
    """Oracle: analytic, order. The map is the motion; flat meshes find it to h^2, curved ones to
    more. The first edges are about 0.4 long; the strain of the closest points is over 10 %.
    """
    errors = []
    for level in (2, 3):
        base, other, exact = ellipsoid_pair(level, order)
        match = isometric_match(base, other)
        there = partners(match, other)
        errors.append(np.sqrt(((there - exact) ** 2).sum(axis=1).mean()))
        assert match.found.all()
        assert iv.distortion(base, there).strain < 0.01
    assert errors[0] < 0.4**2 / 8  # the height of an arc over its chord
    assert np.log2(errors[0] / errors[1]) > least
    closest = partners(iv.closest_point(base, other), other)
    assert iv.distortion(base, closest).strain > 0.1


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize(
    "surface",
    [lambda order: iv.ellipsoid(AXES, 2, order=order),
     lambda order: iv.sheet(WIDTH, HEIGHT, (8, 5), bend=0.5, order=order),
     lambda order: iv.disk(1.0, 4, order=order)],
    ids=["ellipsoid", "sheet", "disk"],
)  # fmt: skip
def test_a_surface_is_its_own_partner(surface, order):
    """Oracle: algebra. The identity strains nothing, so nothing moves."""
    same = surface(order)
    match = isometric_match(same, same)
    np.testing.assert_allclose(partners(match, same), same.points, atol=1e-13)
    np.testing.assert_allclose(match.distance, 0, atol=1e-13)


@pytest.mark.parametrize(("order", "freedom"), [(1, 0.5), (2, 1e-3)])
@pytest.mark.parametrize("factor", [1.0, 1.1])
def test_a_sphere_does_not_turn(order, freedom, factor):
    """Oracle: symmetry. All turns strain alike: it stays where the rays led, factor * x. Only
    facets tell turns apart, by less than the edges (0.3) are long.
    """
    base = iv.icosphere(2, order=order)
    other = moved(iv.icosphere(3, order=order), turn_about((1, 0.3, -0.7), 1.0), factor=factor)
    there = partners(isometric_match(base, other), other)
    assert np.abs(there - factor * base.points).max() < freedom * 0.3


@pytest.mark.parametrize("order", [1, 2])
def test_rims_slide_along_rims(order):
    """Oracle: analytic. A tilted tube: its ends go to the ends, turned about its own axis by
    any angle. Rims lie in planes; on them lengths are right but for chords, h^2 / 24 = 0.2 %.
    """
    base = iv.cylinder(0.5, 2.0, (16, 8), order=order)
    tilt, shift = turn_about((1, 0.2, 0.1), 0.3), np.array([0.1, 0.2, 0.1])
    other = moved(iv.cylinder(0.5, 2.0, (20, 11), order=order), tilt, shift)
    match = isometric_match(base, other)
    there = partners(match, other)
    back = (there - shift) @ tilt
    rim = rim_nodes(base.triangles)
    np.testing.assert_allclose(back[rim, 2], base.points[rim, 2], atol=1e-12)
    assert (match.barycentric[rim].min(axis=1) == 0).all()
    assert np.abs(back[:, 2] - base.points[:, 2]).max() < 0.02
    assert iv.distortion(base, there).strain < (2e-2 if order == 1 else 1e-3)


def test_corners_without_partners_slide():
    """Oracle: analytic. A square onto a disk, which has no corners: its rim goes to the polygon
    of 42 sides between the radii cos(pi / 42) and 1, its inside to the inside.
    """
    side = 1.7
    square = iv.sheet(side, side, (9, 9), order=1)
    square = iv.Surface(square.points - [0, side / 2, 0], square.triangles)
    disk = iv.disk(1.0, 7, order=1)
    match = isometric_match(square, disk)
    distance = np.linalg.norm(partners(match, disk), axis=1)
    on_rim = np.isin(np.arange(len(distance)), rim_nodes(square.triangles))
    assert match.found.all()
    assert distance[on_rim].min() > np.cos(np.pi / 42) - 1e-12
    assert distance[on_rim].max() < 1 + 1e-12
    assert distance[~on_rim].max() < 0.95  # the next ring is at 6 / 7, cells are 0.19
    assert not audit(square, disk, match).turned.any()


@pytest.mark.parametrize("order", [1, 2])
def test_a_folded_start_is_smoothed(order):
    """Oracle: analytic. A sheet shifted and turned in its plane by a third of its size: closest
    points heap up on its rim; the map is the motion, its strain 0, corners go to corners.
    """
    base = iv.sheet(WIDTH, HEIGHT, (12, 8), order=order)
    turn, shift = turn_about((0.1, 0.2, 1), 0.6), np.array([0.6, 0.2, 0.1])
    other = moved(iv.sheet(WIDTH, HEIGHT, (13, 9), order=order), turn, shift)
    np.testing.assert_allclose(
        partners(isometric_match(base, other), other), base.points @ turn.T + shift, atol=1e-6
    )


def test_a_start_can_be_given():
    """Oracle: symmetry. On a sphere all turns strain alike: it stays where the start turned it.
    A useless start, all on one point, is replaced; one of another base is refused with A03.
    """
    sphere, turn = iv.icosphere(2), turn_about((1, 2, 3), 0.5)
    start = iv.closest_point(moved(sphere, turn), sphere)
    there = partners(isometric_match(sphere, sphere, start=start), sphere)
    np.testing.assert_allclose(there, sphere.points @ turn.T, atol=1e-3)
    one = np.zeros(len(sphere.points), dtype=int)
    collapsed = iv.Correspondence(one, np.full((len(one), 3), 1 / 3), one + 1.0, one)
    replaced = isometric_match(sphere, sphere, start=collapsed)
    np.testing.assert_allclose(partners(replaced, sphere), sphere.points, atol=1e-3)
    with pytest.raises(iv.ArgumentError, match="A03"):
        isometric_match(iv.icosphere(1), sphere, start=start)


def test_far_surfaces_are_reached_by_way_of_others():
    """Oracle: analytic. A sheet turned in its plane by 90 degrees: other corners are nearer, so
    at once it is strained; in four steps, from the last image's closest points, it is found.
    """
    base = iv.sheet(WIDTH, HEIGHT, (8, 5), order=1)
    base = iv.Surface(base.points - [0, HEIGHT / 2, 0], base.triangles)
    image, start = base, None
    for part in (1, 2, 3, 4):
        turn = turn_about((0, 0, 1), part * np.pi / 8)
        other = moved(iv.sheet(WIDTH, HEIGHT, (9, 6), order=1), np.eye(3), (0, -HEIGHT / 2, 0))
        other = moved(other, turn)
        if part > 1:
            start = iv.closest_point(image, other)
        match = isometric_match(base, other, start=start)
        image = iv.Surface(partners(match, other), base.triangles)
    np.testing.assert_allclose(image.points, base.points @ turn.T, atol=1e-6)
    at_once = partners(isometric_match(base, other), other)
    assert iv.distortion(base, at_once).strain > 0.1


def test_another_topology_is_refused():
    """Oracle: algebra. A sheet is no tube: C01, and both are named."""
    sheet, tube = iv.sheet(WIDTH, HEIGHT, (4, 3)), iv.cylinder(1.0, HEIGHT, (8, 3))
    with pytest.raises(iv.CorrespondenceError, match=r"1 boundary loop.*2 boundary loop") as raised:
        isometric_match(sheet, tube)
    assert raised.value.code == "C01"


def test_a_surface_inside_out_is_refused():
    """Oracle: algebra. Every map onto a surface that faces the other way turns all over: C05."""
    base = iv.sheet(WIDTH, HEIGHT, (6, 4), order=1)
    with pytest.raises(iv.CorrespondenceError, match=r"48 at best") as raised:
        isometric_match(base, iv.Surface(base.points, base.triangles[:, [0, 2, 1]]))
    assert raised.value.code == "C05"
