"""Rigid alignment: known motions are found, and none is made up."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest
from conftest import ELLIPSOID_ISOVALUE, ellipsoid_field

import isovary as iv
from isovary.alignment import Alignment, _align, align
from isovary.alignment._align import _field_feet, _mesh_feet
from isovary.data import water_pair
from isovary.level_sets import MovedField
from isovary.projection import outward_normals, project
from isovary.rigid_motion import RigidMotion

CENTRES = np.array([[0.0, 0.0, 0.0], [1.5, 0.0, 0.0], [0.0, 1.2, 0.2], [0.3, 0.2, 1.0]])
WIDTHS = np.array([0.8, 0.6, 0.5, 0.4])
ISOVALUE = float(np.exp(-1))


@dataclass(frozen=True)
class Blobs:
    """Sum of Gaussians by its formula, a LevelSet; four of different width look the same nowhere.

    ``dents`` are (place, width, depth), taken off the logarithm.
    """

    centres: np.ndarray = field(default_factory=CENTRES.copy)
    widths: np.ndarray = field(default_factory=WIDTHS.copy)
    box: tuple = ()
    dents: tuple = ()

    @property
    def reach(self) -> float:
        return float(self.widths.max())

    @property
    def bounds(self):
        if self.box:
            return np.array(self.box[0]), np.array(self.box[1])
        return self.centres.min(axis=0) - 3 * self.reach, self.centres.max(axis=0) + 3 * self.reach

    @property
    def spacing(self):
        return np.full(3, self.reach / 4)

    @property
    def rounding(self) -> float:
        return 1e-15

    def level_set(self, points, isovalue):
        offsets = np.asarray(points)[:, None] - self.centres
        logs = -0.5 * (offsets**2).sum(axis=2) / self.widths**2
        top = logs.max(axis=1, keepdims=True)
        parts = np.exp(logs - top)
        total = parts.sum(axis=1)
        level = top[:, 0] + np.log(total) - np.log(isovalue)
        parts = (parts / total[:, None])[..., None]
        gradient = -(parts * offsets / self.widths[:, None] ** 2).sum(axis=1)
        for place, width, depth in self.dents:
            away = points - np.array(place)
            dent = depth * np.exp(-0.5 * (away**2).sum(axis=1) / width**2)
            level = level - dent
            gradient = gradient + dent[:, None] * away / width**2
        low, high = self.bounds
        inside = ((points >= low - 1e-9 * self.reach) & (points <= high + 1e-9 * self.reach)).all(1)
        return np.where(inside, level, np.nan), gradient

    def moved(self, motion):
        return Blobs(motion.apply(self.centres), self.widths)

    def sampled(self, samples=31):
        def value(points):
            return np.exp(self.level_set(points.reshape(-1, 3), 1.0)[0]).reshape(points.shape[:-1])

        return iv.ScalarField.from_function(
            value, self.bounds, (samples,) * 3, name="blobs", logarithmic=True
        )

    def mesh(self, vertices=150, order=2):
        rough = iv.marching_cubes(self.sampled(21), ISOVALUE, vertices=vertices, order=order)
        points = project(rough.points, self, ISOVALUE)
        return iv.Surface(points, rough.triangles, outward_normals(points, self, ISOVALUE))


def turn(axis, degrees) -> np.ndarray:
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.radians(degrees)
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


MIRROR = np.diag([1.0, 1.0, -1.0])
MOTIONS = {
    "shift": RigidMotion(translation=[0.2, -0.3, 0.1]),
    "turn by 5": RigidMotion(turn((1, 2, 3), 5), [0.1, 0.2, -0.1]),
    "turn by 60": RigidMotion(turn((3, -1, 1), 60), [0.5, 0.0, 1.0]),
    "turn by 110": RigidMotion(turn((-1, 2, 2), 110)),
    "turn by 170": RigidMotion(turn((1, 1, -2), 170), [-1.0, 2.0, 0.3]),
    "far away": RigidMotion(turn((0, 1, 1), 40), [70.0, -20.0, 45.0]),
    "mirror": RigidMotion(MIRROR),
    "mirror and turn": RigidMotion(MIRROR @ turn((2, 0, 1), 77), [3.0, 1.0, 0.0]),
}


def error(found: Alignment, made: RigidMotion, base: iv.Surface) -> float:
    """Largest distance of a node from where it was after there and back."""
    there_and_back = found.motion.apply(made.apply(base.points))
    return float(np.linalg.norm(there_and_back - base.points, axis=1).max())


def longest_edge(surface: iv.Surface) -> float:
    edges = surface.points[surface.triangles] - surface.points[surface.triangles[:, [1, 2, 0]]]
    return float(np.linalg.norm(edges, axis=2).max())


@pytest.fixture(scope="module")
def base() -> iv.Surface:
    return Blobs().mesh()


@pytest.fixture(scope="module")
def rough() -> iv.Surface:
    return iv.marching_cubes(Blobs().sampled(21), ISOVALUE, vertices=150, order=1)


@pytest.mark.parametrize("name", MOTIONS)
def test_a_moved_formula_comes_back_to_rounding(base, rough, name):
    """Oracle: analytic. The motion that moved the surface, undone; distances reach 1e-12."""
    motion = MOTIONS[name]
    found = align(base, motion.surface(rough), Blobs().moved(motion), ISOVALUE)
    assert found.motion.mirrored == motion.mirrored
    size = 1 + np.abs(motion.translation).max()
    assert error(found, motion, base) < 1e-10 * size
    assert found.rms_after < 1e-11 * size
    assert found.share > 1 - 1e-12
    assert found.held == ()


@pytest.mark.parametrize("name", ["turn by 5", "turn by 170", "mirror and turn"])
def test_a_moved_field_comes_back_to_its_splines_error(base, name):
    """Oracle: analytic. Sampled on a grid of its own: off by little more than the surface is."""
    motion = MOTIONS[name]
    formula = Blobs().moved(motion)
    sampled = formula.sampled()
    level, slope = sampled.level_set(motion.apply(base.points), ISOVALUE)
    off = np.abs(level) / np.linalg.norm(slope, axis=1)
    assert 1e-8 < off.max() < 1e-2
    perturbed = iv.marching_cubes(sampled, ISOVALUE, vertices=150, order=1)
    found = align(base, perturbed, sampled, ISOVALUE)
    assert found.motion.mirrored == motion.mirrored
    assert error(found, motion, base) < 5 * off.max()
    assert found.rms_after < off.max()


def test_a_field_without_values_in_its_corners_will_do(rough):
    """Oracle: algebra. A turned spline is unknown in the corners of its upright box."""
    sampled, motion = Blobs().sampled(), MOTIONS["turn by 60"]
    own = iv.marching_cubes(sampled, ISOVALUE, vertices=150)
    found = align(own, motion.surface(rough), MovedField(sampled, motion), ISOVALUE)
    assert error(found, motion, own) < 1e-10


@pytest.mark.parametrize("name", ["turn by 170", "mirror and turn"])
def test_without_a_field_it_is_as_accurate_as_the_mesh(base, name):
    """Oracle: order. Flat triangles with edges h miss a surface of curvature k by h^2 k / 8."""
    motion = MOTIONS[name]
    perturbed = motion.surface(Blobs().mesh(vertices=600, order=1))
    limit = longest_edge(perturbed) ** 2 / WIDTHS.min() / 8
    found = align(base, perturbed)
    assert found.motion.mirrored == motion.mirrored
    assert error(found, motion, base) < limit
    assert found.rms_after < limit


def test_the_same_surface_is_not_moved_at_all(base, rough):
    """Oracle: algebra. The identity, exactly, also on the spline where rounding leaves 1e-15."""
    sampled = Blobs().sampled()
    own = iv.marching_cubes(sampled, ISOVALUE, vertices=150)
    for surface, perturbed_field in ((base, Blobs()), (own, sampled)):
        found = align(surface, rough, perturbed_field, ISOVALUE)
        assert found.motion.is_identity
        assert found.rms_before == found.rms_after < 1e-12
        assert found.share == 0
    assert align(base, base).motion.is_identity
    hardly = RigidMotion(translation=[1e-13, 0.0, 0.0]).surface(base)
    assert align(hardly, rough, Blobs(), ISOVALUE).motion.is_identity


def test_growth_is_no_motion():
    """Oracle: symmetry. A larger ellipsoid about the same centre: no motion lowers the distance.

    The distance itself is about 1 % of a semi-axis, 1 to 2, along the normals.
    """
    base = iv.marching_cubes(ellipsoid_field((1.0, 1.4, 2.0)), ELLIPSOID_ISOVALUE, vertices=200)
    grown = ellipsoid_field((1.01, 1.414, 2.02))
    perturbed = iv.marching_cubes(grown, ELLIPSOID_ISOVALUE, vertices=150, order=1)
    found = align(base, perturbed, grown, ELLIPSOID_ISOVALUE)
    assert found.motion.is_identity
    assert found.share == 0
    assert 0.01 < found.rms_before < 0.02


def test_distances_are_weighted_by_area():
    """Oracle: analytic. A torus (1, r) grown by e: e (cos u + r), whose mean square is 1/2 + 2 r^2.

    The area per angle u is as 1 + r cos u; by nodes alone it were 1/2 + r^2.
    """
    torus = iv.torus(1.0, 0.5, (40, 20))
    grown = iv.Surface(1.01 * torus.points, torus.triangles, torus.normals)
    found = align(torus, grown)
    assert found.motion.is_identity
    assert found.rms_before == pytest.approx(0.01, rel=0.03)


def test_feet_are_straight_below():
    """Oracle: analytic. The nearest point of an ellipsoid to p + 0.2 n is p.

    Straight above or below by less than the least radius of curvature, 1/2.
    """
    axes = np.array([1.0, 1.4, 2.0])
    sphere = iv.icosphere(2).points
    field = ellipsoid_field(tuple(axes), samples=41)
    level, slope = field.level_set(axes * sphere, ELLIPSOID_ISOVALUE)
    np.testing.assert_allclose(level, 0, atol=1e-9)
    normals = -slope / np.linalg.norm(slope, axis=1, keepdims=True)
    mesh = _mesh_feet(iv.marching_cubes(field, ELLIPSOID_ISOVALUE, vertices=150, order=1))
    feet = _field_feet(mesh, field, ELLIPSOID_ISOVALUE)
    for height in (0.2, -0.2):
        found = feet(axes * sphere + height * normals)
        np.testing.assert_allclose(found.points, axes * sphere, atol=1e-3)
        np.testing.assert_allclose(found.normals, normals, atol=2e-3)


def test_a_point_where_the_field_has_no_slope_has_a_foot():
    """Oracle: symmetry. From the middle of a ball every foot lies a radius, root of 2, away."""
    ball, sphere = Blobs(np.zeros((1, 3)), np.ones(1)), iv.icosphere(1, order=1)
    mesh = _mesh_feet(iv.Surface(np.sqrt(2) * sphere.points, sphere.triangles))
    found = _field_feet(mesh, ball, ISOVALUE)(np.array([[0.0, 0.0, 0.0], [1.0, 1.2, 0.0]]))
    np.testing.assert_allclose(np.linalg.norm(found.points, axis=1), np.sqrt(2), atol=1e-3)
    assert np.isfinite(found.normals).all()


def test_a_dent_is_shared_out_by_least_squares(base):
    """Oracle: algebra. Squares of what was, of what is left and of what the motion makes add up.

    A 2 % dent holds by its size: a motion of more than the dent's depth would not pay.
    """
    centre = base.points.mean(axis=0)
    size = float(np.linalg.norm(base.points - centre, axis=1).mean())
    dented = Blobs(dents=((tuple(base.points[17]), 0.4, 0.04),))
    level, slope = dented.level_set(base.points, ISOVALUE)
    depth = np.abs(level) / np.linalg.norm(slope, axis=1)
    assert 0.01 * size < depth.max() < 0.03 * size
    found = align(base, dented.mesh(100, 1), dented, ISOVALUE)
    move = base.points - found.motion.inverse.apply(base.points)
    areas = iv.geometry.node_areas(base.points, base.triangles)
    along = np.einsum("nd,nd->n", move, base.normals)
    made = np.sqrt(areas @ along**2 / areas.sum())
    assert 0 < made < found.rms_before
    assert found.rms_after**2 + made**2 == pytest.approx(found.rms_before**2, rel=0.05)
    assert np.linalg.norm(move, axis=1).max() < depth.max()
    assert not found.motion.mirrored


def trimer(first=0.95, second=0.95, bump=0.0) -> Blobs:
    """A large blob with two small ones at an angle of 104 degrees; ``bump`` above the plane."""
    half = np.radians(52)
    arms = [[first * np.sin(half), first * np.cos(half), 0.0]]
    arms += [[-second * np.sin(half), second * np.cos(half), bump]]
    return Blobs(np.array([[0.0, 0.0, 0.0], *arms]), np.array([0.8, 0.5, 0.5]))


def test_a_symmetric_surface_is_not_turned_into_its_likeness():
    """Oracle: symmetry. Arms of 0.95 and 0.96, the first pulled to 1.00: change places? No.

    Changing places, by a half turn or a mirror, would leave 4/5 of the distance.
    """
    before, after = trimer(0.95, 0.96), trimer(1.0, 0.96)
    found = align(before.mesh(), after.mesh(100, 1), after, ISOVALUE)
    assert not found.motion.mirrored
    assert found.motion.angle < 5
    swapped = trimer(0.96, 1.0)
    flipped = align(before.mesh(), swapped.mesh(100, 1), swapped, ISOVALUE)
    assert flipped.motion.angle < 5


def test_an_arm_out_of_plane_is_mirrored_only_if_that_explains_it():
    """Oracle: symmetry. Up or down is a mirror image, up or up a little farther is none."""
    up = Blobs(np.vstack([trimer().centres, [0.1, 0.3, 0.4]]), np.array([0.8, 0.5, 0.4, 0.6]))
    down = Blobs(up.centres * [1, 1, -1], up.widths)
    farther = Blobs(up.centres * [1, 1, 1.1], up.widths)
    base = up.mesh()
    assert align(base, down.mesh(100, 1), down, ISOVALUE).motion.mirrored
    assert not align(base, farther.mesh(100, 1), farther, ISOVALUE).motion.mirrored


@pytest.mark.parametrize("name", ["turn by 60", "mirror and turn"])
def test_a_pose_is_found_through_a_change(base, name):
    """Oracle: symmetry. A dented copy is brought back as the dent alone would be, wherever it is.

    The motions agree to what the stop leaves, 1e-4 of the distance times ten.
    """
    motion = MOTIONS[name]
    place = base.points[17]
    here = Blobs(dents=((tuple(place), 0.4, 0.04),))
    there = Blobs(motion.apply(CENTRES), WIDTHS, dents=((tuple(motion.apply(place)), 0.4, 0.04),))
    rough = here.mesh(100, 1)
    still = align(base, rough, here, ISOVALUE)
    found = align(base, motion.surface(rough), there, ISOVALUE)
    both = found.motion.apply(motion.apply(base.points))
    np.testing.assert_allclose(both, still.motion.apply(base.points), atol=1e-3 * still.rms_after)
    assert found.rms_after == pytest.approx(still.rms_after, rel=1e-6)


def test_the_nearest_of_equal_poses_is_meant():
    """Oracle: symmetry. Three equal arms turned by 100 degrees look as turned by -20."""
    angles = np.radians([0, 120, 240])
    arms = np.stack([np.cos(angles), np.sin(angles), np.zeros(3)], axis=1)
    star = Blobs(np.vstack([[0.0, 0.0, 0.3], arms]), np.array([0.7, 0.5, 0.5, 0.5]))
    motion = RigidMotion(turn((0, 0, 1), 100), [0.1, 0.0, 0.0])
    rough = star.mesh(100, 1)
    found = align(star.mesh(), motion.surface(rough), star.moved(motion), ISOVALUE)
    np.testing.assert_allclose(found.motion.rotation, turn((0, 0, 1), 20), atol=1e-9)
    assert not found.motion.mirrored


def test_the_nearest_pose_is_meant_even_if_another_one_is_met_first():
    """Oracle: symmetry. Half turns keep an ellipsoid: the least of the four turns is 90 degrees."""
    axes, rotation = (1.0, 1.4, 2.0), turn((1, 2, 0), 90)
    flips = [np.diag(s) for s in ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1))]
    least = min(RigidMotion(flip @ rotation.T).angle for flip in flips)
    assert least == pytest.approx(90)
    base = iv.marching_cubes(ellipsoid_field(axes), ELLIPSOID_ISOVALUE, vertices=200)
    turned = ellipsoid_field(axes, turn=rotation)
    perturbed = iv.marching_cubes(turned, ELLIPSOID_ISOVALUE, vertices=150, order=1)
    found = align(base, perturbed, turned, ELLIPSOID_ISOVALUE)
    assert found.motion.angle == pytest.approx(least, abs=0.01)


@pytest.mark.parametrize("degrees", [20, 60, 80])
def test_a_spheroid_is_tilted_and_not_spun(degrees):
    """Oracle: symmetry. A tilt that brings the axis back has that angle; any spin makes it more.

    On the way the axis need not go straight, which may spin it by a degree or two.
    """
    axes, tilt = (1.0, 1.0, 2.0), turn((1, 2, 0), degrees)
    base = iv.marching_cubes(ellipsoid_field(axes), ELLIPSOID_ISOVALUE, vertices=200)
    tilted = ellipsoid_field(axes, turn=tilt)
    perturbed = iv.marching_cubes(tilted, ELLIPSOID_ISOVALUE, vertices=150, order=1)
    found = align(base, perturbed, tilted, ELLIPSOID_ISOVALUE)
    axis = found.motion.turn(tilt[:, 2])
    assert abs(axis[2]) > np.cos(np.radians(0.01))
    assert degrees - 0.01 < found.motion.angle < degrees + 2


@pytest.mark.parametrize("with_field", [True, False])
def test_a_sphere_is_shifted_and_not_turned(with_field):
    """Oracle: symmetry. Nothing tells a turn of a sphere: none is made up.

    Its radius is the root of 2; flat triangles with edges h miss it by h^2 / 8 of the curvature.
    """
    one = Blobs(np.zeros((1, 3)), np.ones(1))
    motion = RigidMotion(turn((1, 2, 3), 60), [0.5, -0.3, 0.2])
    base, other = one.mesh(), motion.surface(one.mesh(100, 1))
    extra = (one.moved(motion), ISOVALUE) if with_field else ()
    found = align(base, other, *extra)
    assert found.motion.angle < 0.1
    centre = found.motion.apply([[0.5, -0.3, 0.2]])
    limit = 1e-9 if with_field else longest_edge(other) ** 2 / np.sqrt(2) / 8
    np.testing.assert_allclose(centre, 0, atol=limit)


def half_sphere(depth: float) -> iv.ScalarField:
    def value(p):
        r = np.linalg.norm(p, axis=-1)
        cosine = p[..., 2] / np.maximum(r, 1e-9)
        return 1 - depth * np.exp(-2 * (1 - cosine) / 0.35**2) - r

    return iv.ScalarField.from_function(value, ((-1.5, -1.5, 0), (1.5, 1.5, 1.5)), (31, 31, 16))


@pytest.mark.parametrize("with_field", [True, False])
def test_a_turn_that_nothing_shows_is_not_made_up(with_field):
    """Oracle: symmetry. A dimpled half sphere may turn about its centre by any angle: none is told.

    Rounding of the sampled sphere would else be fitted by a turn of 200 degrees.
    """
    base = iv.marching_cubes(half_sphere(0.0), 0.0, vertices=300)
    dimpled = half_sphere(0.03)
    perturbed = iv.marching_cubes(dimpled, 0.0, vertices=300)
    found = align(base, perturbed, *((dimpled, 0.0) if with_field else ()))
    assert found.motion.angle < 1
    assert np.linalg.norm(found.motion.translation) < 0.01
    assert found.held == (("z",) if with_field else ())


SLAB = ((-3.0, -3.0, -0.3), (4.0, 4.0, 0.7))


@pytest.mark.parametrize(
    ("rotation", "shift"),
    [
        (turn((0, 0, 1), 6), (0.1, -0.2, 0.0)),
        (turn((0, 0, 1), 75), (0.3, 0.3, 0.0)),
        (turn((0, 0, 1), -160), (0.0, 0.4, 0.0)),
        (np.diag([-1.0, 1.0, 1.0]) @ turn((0, 0, 1), 50), (0.2, 0.0, 0.0)),
    ],
)
def test_a_surface_cut_at_z_moves_within_the_faces(rotation, shift):
    """Oracle: analytic. Turns about z, mirrors along x and shifts in x, y keep the faces."""
    motion = RigidMotion(rotation, shift)
    formula = Blobs(motion.apply(CENTRES), WIDTHS, box=SLAB)
    base = Blobs(box=SLAB).mesh()
    perturbed = motion.surface(Blobs(box=SLAB).mesh(100, 1))
    found = align(base, perturbed, formula, ISOVALUE)
    assert found.held == ("z",)
    assert error(found, motion, base) < 1e-9
    assert found.motion.mirrored == motion.mirrored
    np.testing.assert_array_equal(found.motion.rotation[2], [0, 0, 1])
    np.testing.assert_array_equal(found.motion.rotation[:, 2], [0, 0, 1])
    assert found.motion.translation[2] == 0


def test_held_faces_allow_no_other_motion():
    """Oracle: algebra. A tilt and a shift across the face do not come back, what remains does."""
    motion = RigidMotion(turn((1, 0, 0), 4), [0.1, 0.0, 0.05])
    tilted = Blobs(motion.apply(CENTRES), WIDTHS, box=SLAB)
    found = align(Blobs(box=SLAB).mesh(), tilted.mesh(100, 1), tilted, ISOVALUE)
    np.testing.assert_array_equal(found.motion.rotation[2], [0, 0, 1])
    assert found.motion.translation[2] == 0
    assert found.motion.translation[0] == pytest.approx(-0.1, abs=0.03)
    assert 0 < found.rms_after < found.rms_before


@pytest.mark.parametrize(
    ("low", "held", "free"),
    [
        ((-0.2, -3.0, -0.3), ("x", "z"), [False, True, False]),
        ((-0.2, -0.2, -0.3), ("x", "y", "z"), [False, False, False]),
    ],
)
def test_faces_across_two_axes_leave_one_shift_and_three_none(low, held, free):
    """Oracle: analytic. A shift that the faces allow is found to rounding; nothing else moves."""
    shift = 0.1 * np.array(free)
    box = (low, (4.0, 4.0, 0.7))
    base = Blobs(box=box).mesh()
    perturbed = Blobs(CENTRES + np.array([0, 0.1, 0]), WIDTHS, box=box)
    found = align(base, perturbed.mesh(100, 1), perturbed, ISOVALUE)
    assert found.held == held
    np.testing.assert_array_equal(found.motion.rotation, np.eye(3))
    np.testing.assert_allclose(found.motion.translation, -shift, atol=1e-9)
    assert found.motion.is_identity == (not any(free))


def test_water_is_brought_back_from_anywhere(monkeypatch):
    """Oracle: symmetry. One arm grew by 5 %: little to move, and the same from another frame.

    A quarter turn about x, in which the grid's samples change places and the spline stays. What
    is left does not depend on the frame; the motions agree to what the stop leaves.
    """
    before, after = (iv.read_field(path) for path in water_pair())
    base = iv.marching_cubes(before, 0.05, vertices=250)
    perturbed = iv.marching_cubes(after, 0.05, vertices=150, order=1)
    found = align(base, perturbed, after, 0.05)
    assert not found.motion.mirrored
    assert found.motion.angle < 5
    assert 0 < found.rms_after < found.rms_before
    moved = iv.ScalarField(
        after.values[:, :, ::-1].transpose(0, 2, 1),
        after.spacing[[0, 2, 1]],
        [5.0, -7.0, 2.0],
        logarithmic=after.logarithmic,
    )
    first, top = after.origin, after.bounds[1][2]
    motion = RigidMotion(
        [[1, 0, 0], [0, 0, -1], [0, 1, 0]], [5.0 - first[0], -7.0 + top, 2.0 - first[1]]
    )
    for some in (16, 150, _align._SAMPLES):  # nodes that try the poses: they do not decide alone
        monkeypatch.setattr(_align, "_SAMPLES", some)
        again = align(base, motion.surface(perturbed), moved, 0.05)
        there = again.motion.apply(motion.apply(base.points))
        limit = 1e-2 * found.rms_after
        np.testing.assert_allclose(there, found.motion.apply(base.points), atol=limit)
        assert again.rms_after == pytest.approx(found.rms_after, rel=1e-6)


@pytest.mark.parametrize("scale", [1e-9, 1e9])
def test_the_unit_of_length_does_not_matter(base, rough, scale):
    """Oracle: symmetry. The same turn, and every length times the scale."""
    motion = MOTIONS["turn by 60"]
    plain = align(base, motion.surface(rough), Blobs().moved(motion), ISOVALUE)
    longer = RigidMotion(motion.rotation, scale * motion.translation)
    scaled = [
        iv.Surface(scale * s.points, s.triangles, s.normals) for s in (base, motion.surface(rough))
    ]
    found = align(*scaled, Blobs(longer.apply(scale * CENTRES), scale * WIDTHS), ISOVALUE)
    np.testing.assert_allclose(found.motion.rotation, plain.motion.rotation, atol=1e-10)
    np.testing.assert_allclose(
        found.motion.translation, scale * plain.motion.translation, atol=1e-10 * scale
    )
    assert found.rms_before == pytest.approx(scale * plain.rms_before, rel=1e-9)


def test_the_same_call_gives_the_same_bits(base, rough):
    """Oracle: algebra. No chance, no state: two calls agree bit by bit, and change nothing."""
    dented = Blobs(dents=((tuple(base.points[17]), 0.4, 0.04),)).moved(MOTIONS["turn by 170"])
    moved = MOTIONS["turn by 170"].surface(rough)
    one, two = (align(base, moved, dented, ISOVALUE) for _ in range(2))
    np.testing.assert_array_equal(one.motion.rotation, two.motion.rotation)
    np.testing.assert_array_equal(one.motion.translation, two.motion.translation)
    assert (one.rms_before, one.rms_after) == (two.rms_before, two.rms_after)


def test_a_field_needs_its_isovalue(base):
    """Oracle: data. Code A02, and what to give."""
    with pytest.raises(iv.ArgumentError, match=r"field, isovalue: expected both.*A02"):
        align(base, base, Blobs())
    with pytest.raises(iv.ArgumentError, match="A02"):
        align(base, base, isovalue=ISOVALUE)


def test_share_is_of_squares():
    """Oracle: algebra. Half of the distance left: three quarters of its square explained."""
    motion = RigidMotion(translation=[1.0, 0.0, 0.0])
    assert Alignment(motion, 2.0, 1.0, ()).share == 0.75
    assert Alignment(RigidMotion(), 2.0, 2.0, ()).share == 0
