"""The dimple maker: each particle on its own orbit, known from mechanics, whatever the mesh."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import ELLIPSOID_ISOVALUE, ellipsoid_field
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from isovary import ArgumentError, MeshError, Surface, marching_cubes
from isovary.deform import Projectile, Region, dimple, shoot
from isovary.geometry import jacobian_ratios, linear_triangles, node_normals
from isovary.rigid_motion import RigidMotion
from isovary.shapes import disk, ellipsoid, hemisphere, icosphere, sheet

TIME = 0.2
ORIGIN = np.zeros(3)
UP = np.array([0.0, 0.0, 1.0])


def orbit(rest, projectile, region, alpha):
    """Where a particle arrives: its equation of motion, solved to 1e-11 without isovary."""
    s = np.linalg.norm(rest - region.center) / region.radius
    window = np.exp(-((s / region.decay) ** 2)) * max(1 - s**2, 0) ** 2 if s < 1 else 0.0
    strength = alpha * region.charge * projectile.charge * region.radius**3 * window
    duration = projectile.steps * projectile.dt

    def motion(time, state):
        place = projectile.start + time / duration * (projectile.end - projectile.start)
        away = state[:3] - place
        return np.concatenate([state[3:], strength * away / np.linalg.norm(away) ** 3])

    start = np.concatenate([rest, np.zeros(3)])
    solved = solve_ivp(motion, (0, duration), start, "DOP853", rtol=1e-11, atol=1e-13)
    return solved.y[:3, -1]


def depth_on_axis(alpha):
    """Of a dimple of radius 1, inward: by the equation of motion."""
    end = orbit(ORIGIN, Projectile(UP, UP / 2), Region(ORIGIN, 1.0), alpha)
    return -end[2]


def order_of(steps, errors):
    return -np.polyfit(np.log(steps), np.log(errors), 1)[0]


# ------------------------------------------------------------------ the motion itself

SPHERES = {
    "icosphere 3": lambda: icosphere(3),
    "icosphere 4": lambda: icosphere(4),
    "icosphere 4, flat": lambda: icosphere(4, order=1),
    "marching cubes": lambda: marching_cubes(
        ellipsoid_field((1, 1, 1)), ELLIPSOID_ISOVALUE, vertices=600
    ),
}


@pytest.mark.parametrize("sphere", SPHERES.values(), ids=SPHERES.keys())
@pytest.mark.parametrize("center", [[0, 0, 1], [0.6, 0, -0.8]])
def test_the_depth_is_the_same_on_every_mesh(sphere, center):
    """Oracle: analytic. alpha 5, sigma 0.35 on the unit sphere: 0.143, and by the orbit.

    The deepest node tells it within 6 %, where the centre is not a node.
    """
    pushed = dimple(sphere(), center, 1.0, alpha=5.0)
    depth = 1 - np.linalg.norm(pushed.points, axis=1).min()
    assert depth == pytest.approx(0.143, rel=0.06)
    assert depth == pytest.approx(depth_on_axis(5.0), rel=0.06)


@pytest.mark.parametrize(
    ("alpha", "depth"),
    [(1, 0.030), (3, 0.088), (5, 0.143), (9, 0.246), (-1, -0.031), (-3, -0.098), (-5, -0.171)],
)
def test_depths_of_the_docstring(alpha, depth):
    """Oracle: analytic. The orbit of the particle at the centre; 20 steps err by at most 1.5 %."""
    flat = disk(1.5, 6)
    node = int(np.linalg.norm(flat.points, axis=1).argmin())
    moved = dimple(flat, ORIGIN, 1.0, alpha=alpha).points[node]
    assert moved[:2] == pytest.approx(0, abs=1e-15)
    assert -moved[2] == pytest.approx(depth, abs=6e-4)
    assert -moved[2] == pytest.approx(depth_on_axis(alpha), rel=0.015)


def test_every_particle_follows_its_equation_of_motion():
    """Oracle: order. The orbits of all nodes, oblique flight, as the steps shrink: order 1."""
    sphere = icosphere(2, order=1)
    region = Region(sphere.points[3] * 1.01, 0.9, decay=0.5, charge=-2.0)
    start, end = 2 * sphere.points[3], 1.4 * sphere.points[3] + [0.2, 0.1, 0.0]
    steps = np.array([10, 20, 40])
    errors = []
    for count in steps:
        projectile = Projectile(start, end, -0.7, int(count), TIME / count)
        moved = shoot(sphere, projectile, region, alpha=6.0).points
        exact = np.array([orbit(rest, projectile, region, 6.0) for rest in sphere.points])
        errors.append(np.abs(moved - exact).max())
    assert np.abs(exact - sphere.points).max() > 0.1
    assert errors[-1] < 2e-3
    assert order_of(steps, errors) == pytest.approx(1, abs=0.1)


@pytest.mark.parametrize("order", [1, 2])
def test_a_projectile_far_away(order):
    """Oracle: analytic. Its force is the same everywhere: the shape is that of the window.

    a = alpha / r^2 gives the way a t^2 / 2 without error of time, so the sheet z = 0 becomes
    z = -a t^2 / 2 exp(-(s / sigma)^2) (1 - s^2)^2, with the normal of this graph.
    """
    flat = sheet(2.4, 2.4, (12, 12), order=order)
    middle = flat.points.mean(axis=0)
    height = 1e5 * UP
    projectile = Projectile(middle + height, middle + height, steps=10, dt=0.02)
    moved = shoot(flat, projectile, Region(middle, 1.0, decay=0.4), alpha=30 * 1e10)
    x, y, _ = (flat.points - middle).T
    s2 = x**2 + y**2
    inside, decay = np.maximum(1 - s2, 0), np.exp(-s2 / 0.16)
    z = -0.6 * decay * inside**2
    slope = 0.6 * decay * (2 * inside**2 / 0.16 + 4 * inside)
    normals = np.stack([-slope * x, -slope * y, np.ones_like(x)], axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    assert np.abs(moved.points - flat.points - z[:, None] * UP).max() < 1e-5
    assert np.abs(moved.normals - normals).max() < 2e-5
    assert np.abs(normals[:, 2]).min() < 0.8


def test_normals_are_those_of_the_elements_on_fine_meshes():
    """Oracle: order. Those of curved elements err by O(h^2)."""
    errors = []
    for level in (2, 3, 4):
        flight, region = Projectile(2.5 * UP, 1.8 * UP), Region(UP, 1.6)
        moved = shoot(icosphere(level), flight, region, alpha=-1.0)
        away = moved.normals - node_normals(moved.points, moved.triangles)
        errors.append(np.sqrt((away**2).sum(axis=1).mean()))
    assert order_of([1, 2, 4], errors) == pytest.approx(2, abs=0.25)
    assert np.linalg.norm(moved.normals, axis=1) == pytest.approx(1, abs=1e-12)


@pytest.mark.parametrize("alpha", [5.0, -5.0])
def test_refinements_share_their_particles(alpha):
    """Oracle: algebra. Particles do not interact: a vertex of two meshes ends at one place."""
    meshes = [icosphere(n, order=order) for n in (2, 3, 4) for order in (1, 2)]
    center = meshes[0].points[7]
    moved = [dimple(mesh, center, 0.9, alpha=alpha) for mesh in meshes]
    for surface in moved[1:]:
        for name in ("points", "normals"):
            shared = getattr(surface, name)[: len(meshes[0].points)]
            assert np.abs(shared - getattr(moved[0], name)).max() < 1e-15


# ------------------------------------------------------------------ symmetry


def test_a_turned_surface_has_the_turned_dimple():
    """Oracle: symmetry. Turn and shift everything, or the result."""
    body, top = ellipsoid([1.0, 1.0, 1.5], 3), np.array([0.0, 0.0, 1.5])
    motion = RigidMotion(Rotation.random(rng=731).as_matrix(), [3.0, -2.0, 0.5])
    there = dimple(motion.surface(body), motion.apply(top), 0.8, alpha=4.0)
    back = motion.inverse.surface(there)
    here = dimple(body, top, 0.8, alpha=4.0)
    assert np.abs(back.points - here.points).max() < 1e-14
    assert np.abs(back.normals - here.normals).max() < 1e-13


def test_opposite_dimples_are_mirror_images():
    """Oracle: symmetry. x -> -x maps the icosphere onto itself, and two dimples on one another."""
    sphere = icosphere(3)
    keys = {tuple(p): i for i, p in enumerate(sphere.points.round(9) + 0.0)}
    opposite = [keys[tuple(p)] for p in -sphere.points.round(9) + 0.0]
    centers = sphere.points[[5, opposite[5]]]
    moved = dimple(sphere, centers, 0.8, alpha=[6.0, 6.0])
    assert np.abs(moved.points + moved.points[opposite]).max() < 1e-14
    assert np.linalg.norm(moved.points[5]) < 0.9


@pytest.mark.parametrize("factor", [1e-3, 7.0])
def test_scaling(factor):
    """Oracle: symmetry. Surface, region and flight scaled alike: so is the result."""
    sphere = icosphere(2)
    large = Surface(factor * sphere.points, sphere.triangles, sphere.normals)
    moved = dimple(large, factor * UP, factor * 0.8, alpha=3.0)
    assert moved.points / factor == pytest.approx(dimple(sphere, UP, 0.8, alpha=3.0).points)


def test_equal_signs_repel():
    """Oracle: analytic. Coulomb: repelled inward or attracted outward; signs multiply."""
    sphere = icosphere(3)
    node = 4
    tip = sphere.points[node]

    def radius(particles, projectile, alpha):
        flight = Projectile(2 * tip, 1.5 * tip, projectile)
        moved = shoot(sphere, flight, Region(tip, 0.8, charge=particles), alpha=alpha)
        return float(np.linalg.norm(moved.points[node]))

    inward = radius(1.0, 1.0, 2.0)
    assert inward < 0.99
    assert radius(-1.0, -1.0, 2.0) == radius(2.0, 0.5, 2.0) == inward
    assert radius(1.0, -1.0, 2.0) == radius(-1.0, 1.0, 2.0) == radius(1.0, 1.0, -2.0) > 1.01
    assert np.linalg.norm(dimple(sphere, tip, 0.8, alpha=2.0).points[node]) < 0.99
    assert np.linalg.norm(dimple(sphere, tip, 0.8, alpha=-2.0).points[node]) > 1.01


# ------------------------------------------------------------------ what moves and what stays


@pytest.mark.parametrize("order", [1, 2])
def test_outside_the_region_nothing_changes(order):
    """Oracle: algebra. Bit for bit, points and normals; all nodes inside move."""
    sphere = icosphere(3, order=order)
    center = np.array([0.6, -0.8, 0.0])
    moved = dimple(sphere, center, 0.7)
    outside = np.linalg.norm(sphere.points - center, axis=1) >= 0.7
    assert 0 < outside.sum() < len(outside)
    assert (moved.points[outside] == sphere.points[outside]).all()
    assert (moved.normals[outside] == sphere.normals[outside]).all()
    assert (moved.points[~outside] != sphere.points[~outside]).any(axis=1).all()
    assert (moved.triangles == sphere.triangles).all()
    assert moved.order == order


@pytest.mark.parametrize("order", [1, 2])
def test_the_other_side_of_a_plate_stays(order):
    """Oracle: algebra. A thin body, both sides within the radius: only the centre's side moves."""
    plate = ellipsoid([1.0, 1.0, 0.05], 4, order=order)
    moved = dimple(plate, [0, 0, 0.05], 0.6)
    below = plate.points[:, 2] < 0
    near = np.linalg.norm(plate.points[below], axis=1) < 0.5
    assert near.sum() > 100
    assert (moved.points[below] == plate.points[below]).all()
    assert np.abs(moved.points - plate.points).max() > 0.08


def test_another_component_stays():
    """Oracle: algebra. Of two sheets 0.1 apart, both within the radius, the nearest moves.

    By about 0.143 radii of 0.8, so that it runs through the other, and that is told.
    """
    flat = sheet(2.0, 2.0, (8, 8))
    count = len(flat.points)
    both = Surface(
        np.concatenate([flat.points, flat.points - [0, 0, 0.1]]),
        np.concatenate([flat.triangles, flat.triangles + count]),
    )
    with pytest.warns(UserWarning, match=r"runs through itself.*\[M08\]"):
        moved = dimple(both, flat.points.mean(axis=0) - [0, 0, 0.03], 0.8).points
    assert (moved[count:] == both.points[count:]).all()
    assert np.abs(moved[:count] - both.points[:count]).max() > 0.05


def test_large_triangles_hang_together_inside_the_region():
    """Oracle: analytic. A way within the radius leads over the edge 1-2, whose ends are outside."""
    points = [[-0.5, 0, 0], [0, -2, 0], [0, 2, 0], [0.5, 0, 0]]
    kite = Surface(points, [[0, 1, 2], [1, 3, 2]])
    region = Region(points[0], 1.2)
    far = Projectile([-0.5, 0, 1.2], [-0.5, 0, 0.6])
    moved = shoot(kite, far, region).points
    assert (moved[[1, 2]] == kite.points[[1, 2]]).all()
    assert np.linalg.norm(moved[3] - kite.points[3]) > 0
    assert moved[3] == pytest.approx(orbit(kite.points[3], far, region, 5.0), abs=1e-4)


def test_what_hangs_together_beyond_the_radius_only_is_apart():
    """Oracle: analytic. A narrow strip bent to a V: its far arm is reached round the tip at x = 3.

    All edges lie on lines that pass near the centre, but do not reach so far themselves.
    """
    along = np.concatenate([np.linspace(0, 3, 13), np.linspace(2.75, 0, 12)])
    below = np.where(np.arange(25) < 13, 0, (along - 3) / 15)
    arms = zip(along, below, strict=True)
    points = np.array([[x + 20 * y, y, z] for x, z in arms for y in (0.0, 0.02)])
    cells = [(2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1) for k in range(24)]
    strip = Surface(points, [t for a, b, c, d in cells for t in ((a, b, c), (a, c, d))])
    with pytest.warns(UserWarning, match=r"7 node\(s\) moved.*\[M11\]"):
        moved = dimple(strip, ORIGIN, 1.0, alpha=0.05).points
    assert (moved[26:] == points[26:]).all()
    assert (moved[:7] != points[:7]).any(axis=1).all()
    with pytest.warns(UserWarning, match=r"18 node\(s\) moved.*\[M11\]"):
        tip = dimple(strip, [3, 0, 0], 1.0, alpha=0.05).points
    assert (tip[[22, 26]] != points[[22, 26]]).any(axis=1).all()


def test_nodes_on_a_rim_move_as_others_do():
    """Oracle: algebra. Half a sphere has the half of the dimple that a whole sphere has."""
    half = hemisphere(8)
    low = Surface(half.points * [1, 1, -1], half.triangles[:, [0, 2, 1, 5, 4, 3]], -half.normals)
    center = [1.0, 0.0, 0.0]
    flight, region = Projectile([1.8, 0, 0], [1.4, 0, 0]), Region(center, 0.8)
    upper = shoot(half, flight, region).points
    lower = shoot(low, flight, region).points
    rim = half.points[:, 2] == 0
    assert rim.sum() > 40
    assert np.abs(upper * [1, 1, -1] - lower).max() < 1e-15
    assert np.abs(upper[rim, 2]).max() == 0
    assert np.linalg.norm(upper[rim], axis=1).min() < 0.9


# ------------------------------------------------------------------ several dimples

CUBE = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / 3**0.5


def test_disjoint_dimples_commute():
    """Oracle: algebra. Eight with regions apart, in two orders, at once or one by one: the same."""
    sphere = icosphere(3)
    alphas = np.array([3.0, -2.0, 4.0, -4.0, 1.0, 2.0, 5.0, -3.0])
    radii = np.linspace(0.3, 0.5, 8)
    at_once = dimple(sphere, CUBE, radii, alpha=alphas)
    backward = dimple(sphere, CUBE[::-1], radii[::-1], alpha=alphas[::-1])
    one_by_one = sphere
    for center, radius, alpha in zip(CUBE, radii, alphas, strict=True):
        one_by_one = dimple(one_by_one, center, radius, alpha=alpha)
    for other in (backward, one_by_one):
        assert (other.points == at_once.points).all()
        assert (other.normals == at_once.normals).all()
    assert ((at_once.points != sphere.points).any(axis=1).sum()) > 500


def test_dimples_that_overlap_are_made_in_their_order():
    """Oracle: algebra. The second acts on the surface that the first one left."""
    sphere, centers = icosphere(3), np.array([[0, 0, 1], [0.6, 0, 0.8]])
    first = dimple(sphere, centers[0], 0.8, alpha=-2.0)
    second = dimple(first, centers[1], 0.5, alpha=3.0)
    at_once = dimple(sphere, centers, [0.8, 0.5], alpha=[-2.0, 3.0])
    swapped = dimple(sphere, centers[::-1], [0.5, 0.8], alpha=[3.0, -2.0])
    assert (at_once.points == second.points).all()
    assert np.abs(at_once.points - swapped.points).max() > 1e-5


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("center", [[0.36, 0.48, 0.8], [-0.8, 0.6, 0.0]])
def test_the_flight_follows_the_normal_between_nodes(center, order):
    """Oracle: analytic. On a sphere it comes along the radius, though the centre is no node.

    The nearest node's normal would lie 2 degrees beside it, and the tip 4e-3.
    """
    sphere, center = icosphere(4, order=order), np.array(center)
    moved = dimple(sphere, center, 0.6, alpha=-6.0).points
    radial = Projectile(1.6 * center, 1.3 * center)
    exact = shoot(sphere, radial, Region(center, 0.6), alpha=-6.0).points
    assert np.abs(moved - exact).max() < 1e-4


# ------------------------------------------------------------------ inverted elements


@pytest.mark.parametrize("order", [1, 2])
def test_too_strong_a_projectile(order):
    """Oracle: analytic. At alpha = -20 the particle on the axis falls through the projectile."""
    sphere = icosphere(2, order=order)
    with pytest.raises(MeshError, match="turned over by the projectile") as caught:
        dimple(sphere, sphere.points[0], 1.0, alpha=-20.0)
    assert caught.value.code == "M03"


@pytest.mark.parametrize(("start", "alpha"), [(ORIGIN, 5.0), (-UP, 1e-9)])
def test_a_projectile_that_hits_a_node(start, alpha):
    """Oracle: analytic. The force is infinite there, though 20 steps may lead over the place."""
    flat = disk(1.2, 4)
    assert (np.linalg.norm(flat.points, axis=1) < 1e-15).any()
    with pytest.raises(MeshError, match="turned over") as caught:
        shoot(flat, Projectile(start, -start), Region(ORIGIN, 1.0), alpha=alpha)
    assert caught.value.code == "M03"


@pytest.mark.parametrize("order", [1, 2])
def test_no_triangle_of_a_plane_is_turned_over(order):
    """Oracle: algebra. A flight within a flat sheet: areas keep their sign, or it raises.

    In a plane a surface cannot lean over: the particles near the projectile overtake others.
    """
    flat = sheet(2.0, 2.0, (16, 16), order=order)
    middle = flat.points.mean(axis=0)
    place = middle + np.array([0.6, 0.013, 0])
    raised = []
    for alpha in (2.0, 8.0, 60.0):
        try:
            moved = shoot(flat, Projectile(place, place), Region(middle, 0.5), alpha=alpha)
        except MeshError:
            raised.append(alpha)
            continue
        corners = moved.points[linear_triangles(moved.triangles)]
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        assert (across[:, 2] > 0).all()
    assert raised
    assert 2.0 not in raised


@pytest.mark.parametrize(("order", "alpha"), [(1, 500.0), (2, 200.0)])
def test_a_mesh_too_coarse_for_the_dimple(order, alpha):
    """Oracle: analytic. The particles' motion is smooth, as a fine mesh shows: 8 times the rings.

    With three rings a flat triangle faces away from the surface at its own corners, or a curved
    one bends by more than a right angle.
    """
    with pytest.raises(MeshError, match="or the mesh finer") as caught:
        dimple(disk(1.2, 3, order=order), ORIGIN, 1.0, alpha=alpha)
    assert caught.value.code == "M03"
    with pytest.warns(UserWarning, match=r"expected a depth below the radius.*\[M11\]"):
        fine = dimple(disk(1.2, 24, order=order), ORIGIN, 1.0, alpha=alpha)
    assert jacobian_ratios(fine.points, fine.triangles).min() > 0.3


def test_a_surface_may_lean_over():
    """Oracle: analytic. A steep dimple overhangs (the normals turn below the horizon): no fault."""
    flat = disk(1.2, 16)
    with pytest.warns(UserWarning, match=r"expected a depth below the radius.*\[M11\]"):
        moved = dimple(flat, ORIGIN, 1.0, alpha=200.0)
    assert moved.normals[:, 2].min() < -0.1


def test_a_step_too_long_is_halved():
    """Oracle: algebra. The warning names the smaller steps; the result is theirs, bit for bit."""
    flat, region = disk(1.2, 20, order=1), Region(ORIGIN, 1.0)
    with pytest.warns(UserWarning, match=r"expected 1 .* took 2 smaller .*\[M03\]"):
        halved = shoot(flat, Projectile(UP, UP / 2, steps=1, dt=TIME), region, alpha=50.0)
    asked = shoot(flat, Projectile(UP, UP / 2, steps=2, dt=TIME / 2), region, alpha=50.0)
    assert (halved.points == asked.points).all()


def test_triangles_that_were_broken_before_are_no_fault():
    """Oracle: algebra. A triangle without area cannot be turned over; the others are moved."""
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0.5, 0]]
    needle = Surface(points, [[0, 1, 2], [0, 2, 3]], normals=[UP] * 4)
    with pytest.warns(UserWarning, match=r"all 4 nodes within 2.*\[M11\]"):
        moved = dimple(needle, ORIGIN, 2.0)
    assert moved.points[0, 2] < -0.2


# ------------------------------------------------------------------ arguments


def test_arguments_are_not_changed():
    """Oracle: algebra. Neither the surface nor the arrays; records keep copies."""
    sphere = icosphere(2)
    points, normals = sphere.points.copy(), sphere.normals.copy()
    center, radii, alphas = np.array([[0.0, 0, 1], [0, 1, 0]]), np.full(2, 0.5), np.full(2, 3.0)
    kept = [array.copy() for array in (center, radii, alphas)]
    dimple(sphere, center, radii, alpha=alphas)
    for array, copy in zip((center, radii, alphas), kept, strict=True):
        assert (array == copy).all()
    assert (sphere.points == points).all()
    assert (sphere.normals == normals).all()
    region = Region(center[0], 0.5)
    center[0] = 7
    assert region.center.tolist() == [0, 0, 1]


@pytest.mark.parametrize(
    ("call", "code", "text"),
    [
        (lambda s: dimple(s, [0, 1], 0.5), "A03", "center: expected shape"),
        (lambda s: dimple(s, np.zeros((0, 3)), 0.5), "A03", "center: expected shape"),
        (lambda s: dimple(s, [0, 0, np.nan], 0.5), "A02", "center: expected finite"),
        (lambda s: dimple(s, [0, 0, 3], 0.5), "A02", "center: expected a node within the radius"),
        (lambda s: dimple(s, UP, 0.0), "A02", "radius: expected positive"),
        (lambda s: dimple(s, UP, [0.5, 0.5]), "A03", "radius: expected a number"),
        (lambda s: dimple(s, CUBE, 0.3, alpha=[1.0]), "A03", "alpha: expected a number"),
        (lambda s: dimple(s, UP, 0.5, alpha=np.inf), "A02", "alpha: expected finite"),
        (lambda s: dimple(s.points, UP, 0.5), "A03", "surface: expected a Surface, got ndarray"),
        (lambda s: shoot(None, None, None), "A03", "surface: expected a Surface, got NoneType"),
        (lambda s: Region([[0, 0, 1]], 0.5), "A03", "center: expected shape"),
        (lambda s: Region(UP, -1.0), "A02", "radius: expected positive"),
        (lambda s: Region(UP, 1.0, decay=0.0), "A02", "decay: expected positive"),
        (lambda s: Region(UP, 1.0, charge=np.nan), "A02", "charge: expected finite"),
        (lambda s: Projectile(UP[:2], UP), "A03", "start: expected shape"),
        (lambda s: Projectile(UP, [0, 0, np.inf]), "A02", "end: expected finite"),
        (lambda s: Projectile(UP, UP, np.inf), "A02", "charge: expected finite"),
        (lambda s: Projectile(UP, UP, steps=0), "A02", "steps: expected a whole number"),
        (lambda s: Projectile(UP, UP, steps=1.5), "A02", "steps: expected a whole number"),
        (lambda s: Projectile(UP, UP, steps=np.inf), "A02", "steps: expected a whole number"),
        (lambda s: Projectile(UP, UP, dt=0.0), "A02", "dt: expected positive"),
        (lambda s: Projectile(UP, UP, dt=np.inf), "A02", "dt: expected positive"),
    ],
)
def test_bad_arguments(call, code, text):
    """Oracle: algebra. Each names the argument and carries its code."""
    with pytest.raises(ArgumentError, match="^" + text) as caught:
        call(icosphere(1))
    assert caught.value.code == code
