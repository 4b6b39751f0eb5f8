"""The map that changes lengths least: held to maps that are known, and to isometries."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from scipy.special import ellipe

import isovary as iv
from isovary.carrying import _isometrically, carry_isometrically
from isovary.carrying._along_normals import faces_held
from isovary.carrying._isometrically import field_ground
from isovary.geometry import rim_nodes
from isovary.sliding import _aim, facing

AXES = np.array([1.0, 1.3, 1.7])


def turn_about(axis, angle):
    """Rotation matrix by Rodrigues' formula."""
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def ellipsoid_field(scale=1.0, turn=None, shift=(0.0, 0.0, 0.0)):
    """A quadratic, which the spline reproduces: no error but the mesh's."""
    turn = np.eye(3) if turn is None else turn
    return iv.ScalarField.from_function(
        lambda p: -((((p - np.array(shift)) @ turn) / (scale * AXES)) ** 2).sum(axis=-1),
        ((-3.0,) * 3, (3.0,) * 3),
        (9, 9, 9),
    )


@pytest.fixture(scope="module")
def bases():
    return {
        count: iv.marching_cubes(ellipsoid_field(), -1.0, vertices=count) for count in (150, 600)
    }


def test_stretches_of_a_plane_map():
    """Oracle: analytic. Simple shear by g: stretches r and 1/r with r - 1/r = g; area kept."""
    sheet = iv.sheet(2.0, 1.0, (4, 3))
    shear = 0.5
    moved = sheet.points + shear * sheet.points[:, [1]] * [1.0, 0, 0]
    found = iv.distortion(sheet, moved)
    large = (shear + np.sqrt(shear**2 + 4)) / 2
    np.testing.assert_allclose(found.stretches, np.tile([large, 1 / large], (24, 1)), rtol=1e-12)
    np.testing.assert_allclose(found.area_strain, 0, atol=1e-12)
    np.testing.assert_allclose(found.angle_strain, large**2 - 1, rtol=1e-12)
    np.testing.assert_allclose(found.at_nodes(sheet.triangles), large - 1, rtol=1e-12)
    green = np.array([[0, shear], [shear, shear**2]]) / 2
    assert found.strain == pytest.approx(np.linalg.norm(green), rel=1e-12)


def test_rolling_a_sheet_strains_nothing():
    """Oracle: convergence. An isometry; gradients of quadratic elements see it to order 2."""

    def strain(count):
        flat = iv.sheet(2.0, 1.0, (count, count // 2))
        x, y, _ = flat.points.T
        return iv.distortion(flat, np.column_stack([np.sin(x), y, 1 - np.cos(x)])).strain

    coarse, fine = strain(8), strain(16)
    assert np.log2(coarse / fine) == pytest.approx(2, abs=0.1)
    assert fine < 1e-3


def test_unknown_places_are_unknown_strains():
    """Oracle: algebra. NaN at a node: its triangles NaN, the others as before."""
    sphere = iv.icosphere(2)
    points = 1.1 * sphere.points
    points[7] = np.nan
    found = iv.distortion(sphere, points)
    touched = (sphere.triangles == 7).any(axis=1)
    assert np.isnan(found.stretches[touched]).all()
    np.testing.assert_allclose(found.stretches[~touched], 1.1, rtol=1e-6)
    assert np.isnan(iv.distortion(sphere, np.full_like(points, np.nan)).strain)


def test_a_rigid_motion_is_found(bases):
    """Oracle: analytic. The map is the motion itself, the strain 0; along normals it is 10 %."""
    turn, shift = turn_about((1, 2, 1.5), 0.25), np.array([0.2, -0.1, 0.1])
    base, there = bases[600], ellipsoid_field(turn=turn, shift=shift)
    carried, match = carry_isometrically(base, [there], -1.0)
    exact = base.points @ turn.T + shift
    np.testing.assert_allclose(carried.points, exact, atol=3e-6)
    np.testing.assert_allclose(
        match.distance, ((exact - base.points) * base.normals).sum(axis=1), atol=3e-6
    )
    assert iv.distortion(base, carried.points).strain < 1e-6
    assert iv.distortion(base, iv.carry(base, there, -1.0)[0].points).strain > 0.1


def test_a_scaled_ellipsoid_maps_by_scaling(bases):
    """Oracle: analytic, convergence. With equal strain everywhere scaling is stationary on any
    closed surface: the integral of div(move) vanishes. The map converges to it with order > 2.
    """
    errors = {}
    for count, base in bases.items():
        carried, _ = carry_isometrically(base, [ellipsoid_field(1.1)], -1.0)
        errors[count] = np.abs(carried.points - 1.1 * base.points).max()
        strain = iv.distortion(base, carried.points).strain
        assert strain == pytest.approx((1.1**2 - 1) / np.sqrt(2), rel=1e-4)
    assert errors[600] < 3e-5
    assert np.log(errors[150] / errors[600]) / np.log(2) > 2


@pytest.mark.filterwarnings("ignore:.*C05")  # in steps, if far
@pytest.mark.parametrize("scale", [0.5, 0.7, 1.6])
def test_what_shrinks_does_not_wrinkle(bases, scale):
    """Oracle: analytic. A scaled copy is the least strained by scaling, whatever the scale; the
    Green strain alone would be lower with triangles collapsed, below 1 / sqrt(2).
    """
    base = bases[150]
    carried, _ = carry_isometrically(base, [ellipsoid_field(), ellipsoid_field(scale)], -1.0)
    np.testing.assert_allclose(carried.points, scale * base.points, atol=1e-6)


def bar(twist, a=1.0, b=0.6, half=4.0):
    """An elliptic bar along z, turned by ``twist`` radians per length, cut by the box."""

    def value(p):
        c, s = np.cos(twist * p[..., 2]), np.sin(twist * p[..., 2])
        u, v = c * p[..., 0] + s * p[..., 1], c * p[..., 1] - s * p[..., 0]
        return 1 - (u / a) ** 2 - (v / b) ** 2

    box = ((-1.5, -1.5, -half), (1.5, 1.5, half))
    return iv.ScalarField.from_function(value, box, (41, 41, 33))


def test_a_twisted_bar_slips_as_bredt_says():
    """Oracle: analytic. A thin tube of section area A and girth P, twisted by t per length, has
    the shear t h(s) + w'(s) + d, h the distance of the tangent from the axis, w the warping and
    d the slip along the girth per length. None is left with d = -2 A t / P (Bredt): to first
    order the twisted bar is an isometric image. Rims slide within their faces.
    """
    twist, a, b = 0.05, 1.0, 0.6
    base = iv.marching_cubes(bar(0.0), 0.0, vertices=500)
    carried, _ = carry_isometrically(base, [bar(twist)], 0.0)
    strained = iv.distortion(base, carried.points)
    centre_z = base.points[base.corners].mean(axis=1)[:, 2]
    middle = np.abs(centre_z) < 1.5
    assert strained.size[middle].max() < 2 * twist**2
    along = iv.carry(base, bar(twist), 0.0)[0]
    assert iv.distortion(base, along.points).size[middle].max() > 0.4 * twist
    area, girth = np.pi * a * b, 4 * a * ellipe(1 - (b / a) ** 2)
    x, y, z = base.points.T
    round_ = np.column_stack([-a * y / b, b * x / a, 0 * x])
    round_ /= np.linalg.norm(round_, axis=1, keepdims=True)
    turned = np.column_stack([-twist * z * y, twist * z * x, 0 * z])  # the twist itself
    slip = ((carried.points - base.points - turned) * round_).sum(axis=1)
    inner = np.abs(z) < 2
    rate = np.polyfit(z[inner], slip[inner], 1)[0]
    assert rate == pytest.approx(-2 * area * twist / girth, rel=0.02)
    rim = rim_nodes(base.triangles)
    np.testing.assert_array_equal(carried.points[rim, 2], base.points[rim, 2])
    assert np.abs(bar(twist).value(carried.points)).max() < 1e-9


@pytest.mark.parametrize(
    ("radius", "shift"),
    [(1.05, (0, 0, 0)), (1.3, (0, 0, 0)), (1.0, (0, 0.2, 0)), (1.0, (-0.1, 0, 0))],
)
def test_a_rim_slides_in_its_face(radius, shift):
    """Oracle: analytic. A sphere that a face cuts obliquely, grown or shifted: the rim moves far
    more than the sphere, within its face, the nodes nearby follow and no triangle turns over.
    """

    def cut(radius, shift):
        return iv.ScalarField.from_function(
            lambda p: -(((p - np.array(shift)) / radius) ** 2).sum(axis=-1),
            ((-0.8, -1.6, -1.6), (1.6, 1.6, 1.6)),
            (21, 33, 33),
        )

    base = iv.marching_cubes(cut(1.0, (0, 0, 0)), -1.0, vertices=400)
    rim = rim_nodes(base.triangles)
    for carried, match in (
        iv.carry(base, cut(radius, shift), -1.0),
        carry_isometrically(base, [cut(radius, shift)], -1.0),
    ):
        assert match.found.all()
        out = np.linalg.norm(carried.points - np.array(shift), axis=1)
        np.testing.assert_allclose(out, radius, atol=1e-9)
        np.testing.assert_array_equal(carried.points[rim, 0], base.points[rim, 0])
        turn = (carried.points[rim] - shift)[:, 1:]
        ring = np.sqrt(radius**2 - (0.8 + shift[0]) ** 2)
        np.testing.assert_allclose(np.linalg.norm(turn, axis=1), ring, atol=1e-9)
        assert (facing(carried.points, carried.triangles, carried.normals) > 0).all()
    if shift == (0, 0.2, 0):  # within the face: an isometry, but for a turn about x
        assert iv.distortion(base, carried.points).strain < 1e-6


def test_a_corner_of_a_rim_stays_on_its_edge():
    """Oracle: analytic. A cylinder's quarter cut by three faces: corners on edges do not slide."""
    base = iv.marching_cubes(quarter(1.0), 0.0, vertices=200)
    carried, _ = carry_isometrically(base, [quarter(1.1)], 0.0)
    for axis, face in ((0, 0.3), (1, 0.2), (2, 0.0), (2, 1.0)):
        on = np.abs(base.points[:, axis] - face) < 1e-9
        assert on.any()
        np.testing.assert_array_equal(carried.points[on, axis], base.points[on, axis])


def test_a_sphere_does_not_turn():
    """Oracle: symmetry. Any turn is as good: the nodes of a grown sphere move straight out."""
    base = iv.icosphere(3)
    ball = iv.ScalarField.from_function(
        lambda p: -(p**2).sum(axis=-1), ((-2, -2, -2), (2, 2, 2)), (9, 9, 9)
    )
    carried, _ = carry_isometrically(base, [ball], -1.21)
    np.testing.assert_allclose(carried.points, 1.1 * base.points, atol=1e-5)


def dented(depth):
    def value(p):
        r = np.linalg.norm(p, axis=-1)
        cosine = p[..., 2] / np.maximum(r, 1e-9)
        return 1 - depth * np.exp(-2 * (1 - cosine) / 0.35**2) - r

    return iv.ScalarField.from_function(value, ((-1.8,) * 3, (1.8,) * 3), (41, 41, 41))


def test_the_strain_is_least():
    """Oracle: symmetry, algebra. No rim of ours: any other slide of the nodes strains more."""
    base = iv.marching_cubes(dented(0.0), 0.0, vertices=300)
    field = dented(0.1)
    carried, _ = carry_isometrically(base, [field], 0.0)
    least = iv.distortion(base, carried.points).strain
    assert least < 0.8 * iv.distortion(base, iv.carry(base, field, 0.0)[0].points).strain
    rng = np.random.default_rng(5)
    smooth = base.points @ rng.standard_normal((3, 12))
    for size in (1e-3, 1e-2):
        for way in np.sin(smooth).T.reshape(4, 3, -1):
            moved = iv.project(carried.points + size * way.T, field, 0.0)
            assert iv.distortion(base, moved).strain > least


def quarter(radius):
    """A cylinder's quarter: its rim has corners on edges of the box."""
    return iv.ScalarField.from_function(
        lambda p: radius - np.hypot(p[..., 0], p[..., 1]),
        ((0.3, 0.2, 0), (2, 2, 1)),
        (35, 37, 21),
    )


@pytest.mark.parametrize("order", [1, 2])
def test_the_gradient_is_the_aims(order):
    """Oracle: algebra. Central differences along random moves, with rims and corners held; the
    matrix is symmetric and nowhere negative, and a step by it goes down.
    """
    base, field = iv.marching_cubes(quarter(1.0), 0.0, vertices=200, order=order), quarter(1.1)
    start = iv.carry(base, field, 0.0)[0].points
    ground = field_ground(field, 0.0, faces_held(base.points, quarter(1.0)))
    aim = _aim(base, ground(start).points)
    rng = np.random.default_rng(6)
    away = 0.003 * rng.standard_normal(base.points.shape)
    here = ground(start + np.einsum("ndc,nec,ne->nd", *2 * [ground(start).frames], away))
    gradient, matrix = aim.equations(here)
    for _ in range(3):
        way = np.einsum("ndc,nc->nd", here.frames, rng.standard_normal((len(start), 2)))
        ends = [aim.energy(ground(here.points + size * way).points) for size in (1e-6, -1e-6)]
        assert np.vdot(gradient, way) == pytest.approx((ends[0] - ends[1]) / 2e-6, rel=1e-5)
    dense = matrix.toarray()
    np.testing.assert_allclose(dense, dense.T, atol=1e-14 * abs(dense).max())
    assert np.linalg.eigvalsh(dense)[0] > -1e-13 * abs(dense).max()
    still = (here.frames == 0).all(axis=(1, 2))
    assert still.sum() == 4  # the corners
    np.testing.assert_array_equal(gradient[still], 0)


def test_tiny_changes_are_followed_to_their_end():
    """Oracle: algebra. The least strain's map is smooth in the change: a hundredth of a change
    slides points a hundredth as far, though the first, damped steps are short.
    """

    def softly(depth):
        def value(p):
            local = p / [1.0, 1.05, 1.1]
            r = np.linalg.norm(local, axis=-1)
            cosine = local @ [0.48, 0.6, 0.64] / np.maximum(r, 1e-9)
            return 1 - depth * np.exp(-2 * (1 - cosine) / 0.6**2) - r

        return iv.ScalarField.from_function(value, ((-1.5,) * 3, (1.5,) * 3), (33, 33, 33))

    base = iv.marching_cubes(softly(0.05), 0.0, vertices=300)
    depths = 0.05 + np.array([1e-3, 1e-5])
    large, small = (carry_isometrically(base, [softly(d)], 0.0)[0] for d in depths)
    ways = [s.points - base.points for s in (large, small)]
    assert np.abs(100 * ways[1] - ways[0]).max() < 0.05 * np.abs(ways[0]).max()


def joined(centers):
    return iv.ScalarField.from_function(
        lambda p: sum(np.exp(-((p - c) ** 2).sum(axis=-1) / 0.6) for c in centers),
        ((-2.2,) * 3, (3.2,) * 3),
        (37,) * 3,
    )


def test_where_it_starts_does_not_matter():
    """Oracle: symmetry. A rigid motion of the perturbed field changes no strain: of four atoms
    that moved far the same map is found from either place.
    """
    centers = np.array([(0.0, 0, 0), (1, 0, 0), (0, 1.1, 0), (0, 0.1, 1.2)])
    moved = centers + 0.15 * np.random.default_rng(1).standard_normal((4, 3))
    base = iv.marching_cubes(joined(centers), 0.4, vertices=300)
    turned = iv.MovedField(joined(moved), iv.RigidMotion(turn_about((1, 2, 3), 0.1), [0.1, 0, 0]))
    here = carry_isometrically(base, [joined(moved)], 0.4)[0].points
    there = carry_isometrically(base, [turned], 0.4)[0].points
    there = turned.motion.inverse.apply(there)
    edge = np.linalg.norm(np.diff(base.points[base.corners[:, :2]], axis=1), axis=2).mean()
    assert np.linalg.norm(here - there, axis=1).max() < 3e-3 * edge


def test_what_could_turn_freely_stays():
    """Oracle: symmetry. A dent grows deeper on a sphere: no point turns about the dent's axis,
    though hardly more than the mesh would hold it.
    """
    base, field = iv.marching_cubes(dented(0.05), 0.0, vertices=300), dented(0.1)
    carried, _ = carry_isometrically(base, [field], 0.0)
    turned = np.cross(base.points, carried.points)[:, 2] / (base.points[:, :2] ** 2).sum(axis=1)
    assert abs(np.median(turned)) < 0.005
    far = base.points[:, 2] < 0
    np.testing.assert_allclose(carried.points[far], base.points[far], atol=0.01)


@pytest.mark.parametrize("longer", [1.005, 1.02])
def test_it_goes_on_until_nothing_moves(bases, longer):
    """Oracle: algebra. Where nothing slides freely a second slide finds nothing to move."""
    there = ellipsoid_field(turn=np.diag([1 / longer, 1.0, 1.0]))
    first, _ = carry_isometrically(bases[600], [there], -1.0)
    again, _ = carry_isometrically(bases[600], [there], -1.0, start=first)
    along, _ = iv.carry(bases[600], there, -1.0)
    slid, moved = (np.linalg.norm(s.points - first.points, axis=1).max() for s in (along, again))
    assert moved < 1e-4 * slid


def test_far_apart_it_goes_in_steps():
    """Oracle: data. A sphere that becomes a rod 3 times as long: no single step, and it is told."""

    def rod(length):
        return iv.ScalarField.from_function(
            lambda p: -((p / [1.0, 1.0, length]) ** 2).sum(axis=-1),
            ((-1.5, -1.5, -3.5), (1.5, 1.5, 3.5)),
            (9, 9, 15),
        )

    base = iv.marching_cubes(rod(1.0), -1.0, vertices=150)
    with pytest.raises(iv.CorrespondenceError, match=r"C05|C02"):
        carry_isometrically(base, [rod(3.0)], -1.0)
    with pytest.warns(UserWarning, match="C05"):
        carried, _ = carry_isometrically(base, [rod(1.0), rod(3.0)], -1.0)
    assert (facing(carried.points, carried.triangles, carried.normals) > 0).all()
    members = [rod(k) for k in (1.0, 1.4, 1.9, 2.4, 3.0)]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        there, _ = carry_isometrically(base, members, -1.0)
    ways = [iv.distortion(base, surface.points).strain for surface in (carried, there)]
    assert ways[0] == pytest.approx(ways[1], rel=1e-3)  # the least strain knows no way


def test_a_step_that_arrives_is_followed_by_a_longer_one(monkeypatch):
    """Oracle: algebra. On a way whose first half allows steps of 1/8 and the rest of 1/2 at most:
    each step is tried at twice the one before, and halved."""
    gone = []

    def step(base, current, field, isovalue, held, settled):
        part = getattr(field, "part", 1.0)
        before = gone[-1] if gone else 0.0
        if part - before > (0.125 if before < 0.5 else 0.5):
            raise iv.CorrespondenceError("C05", "too far")
        gone.append(part)
        return current

    monkeypatch.setattr(_isometrically, "_step", step)
    fields = [ellipsoid_field(), ellipsoid_field(1.1)]
    with pytest.warns(UserWarning, match="in 6 steps"):
        carry_isometrically(iv.icosphere(1), fields, -1.0)
    assert gone == [0.125, 0.25, 0.375, 0.5, 0.75, 1.0]


def test_a_folded_start_is_an_error():
    """Oracle: algebra. Two nodes exchanged: triangles turned over are told, not slid."""
    base = iv.icosphere(2, order=1)
    points = base.points.copy()
    points[[0, 40]] = points[[40, 0]]
    from isovary.sliding import check_facing

    with pytest.raises(iv.CorrespondenceError, match="C05"):
        check_facing(points, base.triangles, points)


def test_no_field_is_an_error():
    """Oracle: algebra. Nothing to go to."""
    with pytest.raises(iv.ArgumentError, match="A02"):
        carry_isometrically(iv.icosphere(1), [], 0.0)
