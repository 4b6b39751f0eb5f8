"""The particle mesher: its energy, its descent, its triangles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from conftest import ELLIPSOID_ISOVALUE, ellipsoid_field

import isovary as iv
from isovary.geometry import edges_of, rim_nodes, triangle_areas, triangle_quality
from isovary.meshing import _particle_energy as energy
from isovary.meshing import _particles as inner
from isovary.meshing import _triangulation as joining
from isovary.meshing._draft import Draft
from isovary.meshing._particles import particles
from isovary.meshing._start import start

SPHERE = iv.Topology(components=1, boundary_loops=0, euler=2, genus=0)
PLANE = iv.ScalarField.from_function(  # z = 0; the factor makes the samples differ
    lambda p: -p[..., 2] * (1.05 + p[..., 0]), ((-1.0, -1.0, -0.5), (1.0, 1.2, 0.5)), (11, 12, 6)
)


def ground_of(field, isovalue, vertices, sizing=None):
    mesh, sizes, expected = start(field, isovalue, vertices, sizing, 0.3, 2)
    return energy.ground_of(mesh, sizes.lengths, 100_000, field, isovalue), sizes, expected


def on_plane(points):
    """Free particles on the plane z = 0."""
    up = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    held = np.zeros(points.shape, dtype=bool)
    draft = Draft(points, np.empty((0, 3), dtype=np.int64), held, up)
    return energy.Cloud(draft, np.zeros(len(points), dtype=np.int64))


def mean_edges(surface):
    """Mean length of the edges at each vertex, and the vertices' points."""
    vertices, corners = np.unique(surface.corners, return_inverse=True)
    points = surface.points[vertices]
    i, j = edges_of(corners.reshape(-1, 3))[0].T
    ends, length = np.append(i, j), np.tile(np.linalg.norm(points[i] - points[j], axis=1), 2)
    return np.bincount(ends, length) / np.bincount(ends), points


def test_kernel():
    """Oracle: analytic. phi(1/2) = 1 - pi/4 as cot(pi/4) = 1; phi(1/3) with cot(pi/6) = sqrt(3).

    The derivative is -pi/2 cot^2, of which -pi/2 is at 1/2; both vanish from 1 on.
    """
    value, slope = energy.kernel(np.array([1 / 3, 0.5, 1.0, 1.7]))
    expected = [np.sqrt(3) - np.pi / 3, 1 - np.pi / 4, 0, 0]
    np.testing.assert_allclose(value, expected, atol=1e-15)
    np.testing.assert_allclose(slope, [-1.5 * np.pi, -np.pi / 2, 0, 0], atol=1e-14)
    s, step = np.linspace(0.1, 0.95, 18), 1e-6
    ahead, behind = energy.kernel(s + step)[0], energy.kernel(s - step)[0]
    np.testing.assert_allclose(energy.kernel(s)[1], (ahead - behind) / (2 * step), rtol=1e-7)


def test_a_hexagonal_packing_is_at_rest():
    """Oracle: symmetry. No force at a point of sixfold symmetry; six pairs at 1/sqrt(3).

    Two neighbours at 30 degrees to the normal push with |phi'| / (sqrt(3) h) each.
    """
    ground, _, _ = ground_of(PLANE, 0.0, 300)
    h = float(ground.lengths[0])
    i, j = (k.ravel() for k in np.meshgrid(np.arange(-4, 5), np.arange(-4, 5)))
    lattice = h * np.stack([i + j / 2, j * np.sqrt(3) / 2, 0.0 * i], axis=1)
    state = energy.state_of(on_plane(lattice), ground)
    inside = np.linalg.norm(lattice, axis=1) < 2.5 * h
    angle = np.pi / 2 / np.sqrt(3)
    np.testing.assert_allclose(
        state.energies[inside], 6 * (1 / np.tan(angle) + angle - np.pi / 2), rtol=1e-9
    )
    assert np.abs(state.gradient[inside]).max() * h < 1e-9
    pushed = np.pi / 2 / np.tan(angle) ** 2 / h  # on the patch's edge two neighbours lack
    assert np.abs(state.gradient[:, 1]).max() == pytest.approx(pushed)


def test_a_rim_repels():
    """Oracle: analytic. At the distance d phi(2 d / (sqrt(3) h)), half of that in the total."""
    ground, _, _ = ground_of(PLANE, 0.0, 300)
    h = float(ground.lengths[0])
    near = np.sqrt(3) / 4 * h  # phi(1/2) = 1 - pi/4
    points = np.array([[1 - near, 0.1, 0], [0.0, 1.2 - near, 0], [0.0, 0.0, 0]])
    state = energy.state_of(on_plane(points), ground)
    np.testing.assert_allclose(state.energies, [1 - np.pi / 4, 1 - np.pi / 4, 0], atol=1e-9)
    assert state.energy == pytest.approx(1 - np.pi / 4)
    assert state.gradient[0, 0] * h == pytest.approx(np.pi / 2 / np.sqrt(3))


def test_only_particles_on_one_sheet_see_each_other():
    """Oracle: algebra. Opposite normals or other components: no energy. Else 2 phi(1/2) / 2."""
    ground, _, _ = ground_of(PLANE, 0.0, 300)
    points = np.array([[0.0, 0, 0], [np.sqrt(3) / 2 * ground.lengths[0], 0, 0]])
    cloud = on_plane(points)
    assert energy.state_of(cloud, ground).energy == pytest.approx(1 - np.pi / 4)
    turned = replace(cloud.draft, normals=cloud.draft.normals * [[1], [-1]])
    assert energy.state_of(replace(cloud, draft=turned), ground).energy == 0
    assert energy.state_of(replace(cloud, parts=np.array([0, 1])), ground).energy == 0


def test_gradient_of_the_energy():
    """Oracle: finite differences. With lengths that change with the place, and walls at rims."""
    ground, _, _ = ground_of(PLANE, 0.0, 300, iv.nonuniform_sizing)
    h = float(ground.lengths.mean())
    points = np.random.default_rng(3).uniform([-1, -1, 0], [1, 1.2, 0], (250, 3))
    cloud = on_plane(points)
    cloud = cloud[energy.first_apart(cloud, np.full(250, 0.6 * h))]
    state, step = energy.state_of(cloud, ground), 1e-6 * h
    x, y = cloud.draft.points[:, :2].T
    assert (np.minimum(1 - np.abs(x), 1.1 - np.abs(y - 0.1)) < h / 2).sum() > 10
    for which in range(0, len(cloud.parts), 6):
        for axis in (0, 1):
            energies = []
            for side in (step, -step):
                moved = cloud.draft.points.copy()
                moved[which, axis] += side
                other = replace(cloud, draft=replace(cloud.draft, points=moved))
                energies.append(energy.state_of(other, ground).energy)
            slope = (energies[0] - energies[1]) / (2 * step)
            assert slope * h == pytest.approx(state.gradient[which, axis] * h, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("sizing", [iv.uniform_sizing, iv.curvature_sizing])
def test_energy_never_rises(sizing):
    """Oracle: algebra. Each step lowers it; at rest a particle has the packing's, within 3 %."""
    field = ellipsoid_field()
    ground, sizes, _ = ground_of(field, ELLIPSOID_ISOVALUE, 300, sizing)
    state = energy.state_of(inner._scattered(ground, 300, np.random.default_rng(1)), ground)
    state = inner._controlled(state, ground, sizes.vertices, 0)
    rested, history = energy.relaxed(state, ground, field, ELLIPSOID_ISOVALUE, 60)
    assert len(history) > 20
    assert (np.diff(history) < 0).all()
    assert history[0] == state.energy
    assert history[-1] == rested.energy == energy.state_of(rested.cloud, ground).energy
    assert rested.energies.mean() == pytest.approx(energy.IDEAL_ENERGY, rel=0.03)
    assert history[-1] < 0.9 * history[0]


def test_particles_far_too_crowded_go_to_the_holes():
    """Oracle: algebra. Thirty doubled, thirty missing in one place: the number, and rest again."""
    field = ellipsoid_field()
    ground, _, _ = ground_of(field, ELLIPSOID_ISOVALUE, 300)
    state = energy.state_of(inner._scattered(ground, 300, np.random.default_rng(1)), ground)
    state = inner._controlled(state, ground, 300, 0)
    assert len(state.lengths) == 300
    state, _ = energy.relaxed(state, ground, field, ELLIPSOID_ISOVALUE, 60)
    assert inner._misplaced(state) == 0
    order = np.argsort(state.cloud.draft.points[:, 2])
    near = ground.tree.query(state.cloud.draft.points[order[:30]], [20])[1][:, 0]
    spoilt = inner._on(ground, near)
    points = np.concatenate([state.cloud.draft.points[order[:-30]], spoilt.draft.points])
    normals = np.concatenate([state.cloud.draft.normals[order[:-30]], spoilt.draft.normals])
    held = np.zeros(points.shape, dtype=bool)
    draft = Draft(points, spoilt.draft.triangles, held, normals)
    spoilt = energy.state_of(energy.Cloud(draft, np.zeros(300, dtype=np.int64)), ground)
    swaps = inner._misplaced(spoilt)
    assert swaps >= 30
    mended = inner._controlled(spoilt, ground, 300, swaps)
    mended, _ = energy.relaxed(mended, ground, field, ELLIPSOID_ISOVALUE, 60)
    assert len(mended.lengths) == 300
    assert inner._misplaced(mended) == 0


@pytest.mark.parametrize("wanted", [60, 300])
def test_number_quality_and_place(wanted):
    """Oracle: data. As many vertices as wanted, on x^2 + y^2 + z^2/4 = 1, good triangles."""
    surface = particles(ellipsoid_field(), ELLIPSOID_ISOVALUE, vertices=wanted)
    assert len(np.unique(surface.corners)) == wanted
    assert iv.topology(surface.triangles) == SPHERE
    np.testing.assert_allclose((surface.points**2 / [1, 1, 4]).sum(axis=1), 1, atol=1e-11)
    quality = triangle_quality(surface.points, surface.corners)
    assert quality.min() > 0.5
    assert quality.mean() > 0.95
    assert surface.area == pytest.approx(21.478435, rel=0.02 / wanted**0.5)


def test_the_mesh_is_reproducible():
    """Oracle: symmetry. The same seed gives the same bits, another seed another mesh."""
    first, second, other = (
        particles(ellipsoid_field(), ELLIPSOID_ISOVALUE, vertices=100, order=1, rng=rng)
        for rng in (5, 5, 6)
    )
    np.testing.assert_array_equal(first.points, second.points)
    np.testing.assert_array_equal(first.triangles, second.triangles)
    assert np.abs(first.points - other.points).max() > 0.01


def test_density_follows_the_sizing():
    """Oracle: analytic. On a plane edges are as long as asked for: growing fourfold with x."""
    surface = particles(PLANE, 0.0, vertices=400, sizing=iv.nonuniform_sizing, order=1)
    length, points = mean_edges(surface)
    inside = (np.abs(points[:, 0]) < 0.8) & (np.abs(points[:, 1] - 0.1) < 0.9)
    line = np.polyfit(points[inside, 0], np.log(length[inside]), 1)
    assert line[0] == pytest.approx(np.log(4) / 2, rel=0.05)
    field = ellipsoid_field()
    surface = particles(field, ELLIPSOID_ISOVALUE, vertices=300, sizing=iv.curvature_sizing)
    length, points = mean_edges(surface)
    bend = np.sqrt((iv.meshing.principal_curvatures(points, field) ** 2).mean(axis=1))
    assert np.corrcoef(np.log(length), np.log(bend))[0, 1] < -0.98


def test_rims_stay_on_the_faces_of_the_box():
    """Oracle: analytic. Three atoms cut by a box; rim on its faces, at rims' corners its edges."""
    atoms = np.array([(0, 0, 0), (1.7, 0, 0), (0.85, 1.45, 0)])

    def level(p):
        distance = np.linalg.norm(p[..., None, :] - atoms, axis=-1)
        return 0.3 * np.log(np.exp(-distance / 0.3).sum(axis=-1))

    box = (np.array([-0.9, -0.6, -0.5]), np.array([2.6, 2.05, 0.5]))
    field = iv.ScalarField.from_function(level, box, (36, 27, 11))
    _, _, expected = ground_of(field, -0.85, 300)
    surface = particles(field, -0.85, vertices=300)
    assert iv.topology(surface.triangles) == expected
    assert expected.boundary_loops > 0
    rim = surface.points[rim_nodes(surface.triangles)]
    off = np.minimum(np.abs(rim - box[0]), np.abs(rim - box[1])).min(axis=1)
    assert off.max() < 1e-10
    quality = triangle_quality(surface.points, surface.corners)
    assert quality.min() > 0.5
    assert quality.mean() > 0.95


def test_corners_of_rims_are_vertices():
    """Oracle: analytic. A tilted plane through a box: corners on the box's edges, exact area."""
    field = iv.ScalarField.from_function(
        lambda p: 0.1 * p[..., 0] - 0.2 * p[..., 1] - p[..., 2],
        ((-1.0, -1.0, -1.0), (1.0, 1.2, 1.0)),
        (12, 13, 14),
    )
    surface = particles(field, 0.0, vertices=150)
    assert len(np.unique(surface.corners)) == 150
    for x in (-1.0, 1.0):
        for y in (-1.0, 1.2):
            corner = np.array([x, y, 0.1 * x - 0.2 * y])
            assert np.linalg.norm(surface.points - corner, axis=1).min() < 1e-9
    assert surface.area == pytest.approx(2 * 2.2 * np.sqrt(1 + 0.01 + 0.04), rel=1e-9)


def test_two_spheres_that_nearly_touch():
    """Oracle: analytic. A gap of 0.06, a quarter of an edge: two components of area 4 pi each."""
    centres = np.array([[-1.03, 0, 0], [1.03, 0, 0]])
    field = iv.ScalarField.from_function(
        lambda p: 1 - np.linalg.norm(p[..., None, :] - centres, axis=-1).min(axis=-1),
        ((-3, -1.5, -1.5), (3, 1.5, 1.5)),
        (61, 31, 31),
    )
    surface = particles(field, 0.0, vertices=300)
    assert iv.topology(surface.triangles) == iv.Topology(2, 0, 4, 0)
    side = np.sign(surface.points[surface.corners][..., 0])
    assert (side == side[:, :1]).all()
    areas = triangle_areas(surface.points, surface.triangles)
    for which in (-1, 1):
        assert areas[side[:, 0] == which].sum() == pytest.approx(4 * np.pi, rel=2e-3)


def test_a_thin_sheet_has_two_sides():
    """Oracle: analytic. A slab thinner than an edge, cut by the box: two sides of equal area."""
    field = iv.ScalarField.from_function(
        lambda p: (0.1**2 - p[..., 2] ** 2) * (1.05 + p[..., 0]),
        ((-1, -1, -0.5), (1, 1, 0.5)),
        (11, 11, 41),
    )
    surface = particles(field, 0.0, vertices=200)
    assert iv.topology(surface.triangles) == iv.Topology(2, 2, 2, 0)
    np.testing.assert_allclose(np.abs(surface.points[:, 2]), 0.1, atol=1e-9)
    assert surface.area == pytest.approx(8.0, rel=1e-9)


@pytest.mark.parametrize("count", [40, 300])
def test_triangles_on_a_sphere_are_the_convex_hull(count):
    """Oracle: scipy. Delaunay triangles of points on a sphere bound their convex hull."""
    from scipy.spatial import ConvexHull, cKDTree

    sphere = iv.icosphere(5, order=1)
    k = np.arange(count) + 0.5
    z, turn = 1 - 2 * k / count, k * np.pi * (3 - np.sqrt(5))
    radius = np.sqrt(1 - z**2)
    spiral = np.stack([radius * np.cos(turn), radius * np.sin(turn), z], axis=1)
    spiral += 0.3 / np.sqrt(count) * np.random.default_rng(2).standard_normal((count, 3))
    points = spiral / np.linalg.norm(spiral, axis=1, keepdims=True)
    held = np.zeros(sphere.points.shape, dtype=bool)
    fine = Draft(sphere.points, sphere.triangles, held, sphere.points)
    seeds = cKDTree(fine.points).query(points)[1]
    assert len(np.unique(seeds)) == count
    triangles = joining.triangulated(points, points, seeds, fine)
    assert joining.is_sound(triangles, count)
    hull = ConvexHull(points).simplices
    assert {*map(frozenset, triangles.tolist())} == {*map(frozenset, hull.tolist())}
    a, b, c = points[triangles].transpose(1, 0, 2)
    assert (np.einsum("nd,nd->n", a, np.cross(b, c)) > 0).all()


def test_icosphere_vertices_give_the_icosphere():
    """Oracle: algebra. Its vertices, on its own refinement, are joined as they were."""
    coarse, sphere = iv.icosphere(1, order=1), iv.icosphere(4, order=1)
    from scipy.spatial import cKDTree

    held = np.zeros(sphere.points.shape, dtype=bool)
    fine = Draft(sphere.points, sphere.triangles, held, sphere.points)
    distance, seeds = cKDTree(fine.points).query(coarse.points)
    assert distance.max() < 1e-12
    triangles = joining.triangulated(coarse.points, coarse.points, seeds, fine)
    expected = {*map(frozenset, coarse.triangles.tolist())}
    assert {*map(frozenset, triangles.tolist())} == expected


def test_sound_triangulations():
    """Oracle: algebra. A tetrahedron is; with a turned triangle or a shared tip it is not."""
    tetrahedron = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
    assert joining.is_sound(tetrahedron, 4)
    assert joining.is_sound(tetrahedron[1:], 4)  # open: three rim edges
    assert not joining.is_sound(tetrahedron, 5)  # a point without triangle
    turned = np.concatenate([tetrahedron[:3], tetrahedron[3:, ::-1]])
    assert not joining.is_sound(turned, 4)
    other = np.where(tetrahedron == 0, 0, tetrahedron + 3)
    assert not joining.is_sound(np.concatenate([tetrahedron, other]), 7)
    assert joining.is_sound(np.concatenate([tetrahedron, tetrahedron + 4]), 8)


def test_refined_chords():
    """Oracle: algebra. A fan over a hexagon on a face: the middles of its chords are not held."""
    angle = np.arange(6) * np.pi / 3
    points = np.stack([np.cos(angle), np.sin(angle), np.full(6, -0.5)], axis=1)
    fan = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]])
    held = np.tile([False, False, True], (6, 1))
    mesh = Draft(points, fan, held, np.tile([0.0, 0.0, 1.0], (6, 1)))
    fine, _ = joining.refined(mesh, np.full(6, 0.9), 1.0, 10_000, PLANE, -0.1)
    np.testing.assert_array_equal(np.flatnonzero(fine.rank), rim_nodes(fine.triangles))


def test_refined_mesh():
    """Oracle: analytic. Edges as short as asked for, half a sphere's area, its one rim kept."""
    disc = iv.ScalarField.from_function(
        lambda p: 1 - (p**2).sum(axis=-1), ((-1.4, -1.4, 0.0), (1.4, 1.4, 1.4)), (15, 15, 8)
    )
    mesh, _, expected = start(disc, 0.0, 50, None, 0.3, 2)
    lengths = np.where(mesh.points[:, 0] > 0, 0.1, 0.4)
    fine, finer = joining.refined(mesh, lengths, 1.0, 10_000, disc, 0.0)
    i, j = edges_of(fine.triangles)[0].T
    way = np.linalg.norm(fine.points[i] - fine.points[j], axis=1)
    assert (way <= (finer[i] + finer[j]) / 2 + 1e-12).all()
    assert iv.topology(fine.triangles) == expected == iv.Topology(1, 1, 1, 0)
    assert joining.is_sound(fine.triangles, len(fine.points))
    np.testing.assert_allclose(np.linalg.norm(fine.points, axis=1), 1, atol=1e-3)
    rim = rim_nodes(fine.triangles)
    assert (fine.points[rim, 2] == 0).all()
    assert (fine.rank[rim] == 1).all()
    assert (fine.rank > 0).sum() == len(rim)
    assert triangle_areas(fine.points, fine.triangles).sum() == pytest.approx(2 * np.pi, rel=0.01)


def test_refined_rims():
    """Oracle: algebra. A square of two triangles: what is cut from its diagonal is not held."""
    points = np.array([[-1, -1, 0], [1, -1, 0], [1, 1.2, 0], [-1, 1.2, 0]])
    held = np.tile([True, True, False], (4, 1))
    up = np.tile([0.0, 0.0, 1.0], (4, 1))
    square = Draft(points, np.array([[0, 1, 2], [0, 2, 3]]), held, up)
    fine, _ = joining.refined(square, np.full(4, 0.6), 1.0, 10_000, PLANE, 0.0)
    x, y = fine.points[:, :2].T
    on_face = np.stack([np.isclose(np.abs(x), 1), np.isclose(np.abs(y - 0.1), 1.1)], axis=1)
    assert len(fine.points) > 20
    np.testing.assert_array_equal(fine.held[:, :2], on_face)
    assert triangle_areas(fine.points, fine.triangles).sum() == pytest.approx(4.4)


def test_progress_and_order():
    """Oracle: algebra. Flat triangles have as many nodes as vertices; progress is told."""
    told = []
    surface = particles(
        ellipsoid_field(),
        ELLIPSOID_ISOVALUE,
        vertices=60,
        order=1,
        progress=lambda name, done: told.append((name, done)),
    )
    assert len(surface.points) == 60
    assert surface.triangles.shape == (116, 3)  # by Euler's formula: 2 V - 4
    assert told[0] == ("particles", 0.0)
    assert all(0 <= done <= 1 for _, done in told)


@pytest.mark.parametrize(
    ("isovalue", "options", "code", "text"),
    [
        (2.0, {}, "I02", "isovalue: expected a value inside the range"),
        (ELLIPSOID_ISOVALUE, {"order": 3}, "A02", "order: expected 1 or 2, got 3"),
        (ELLIPSOID_ISOVALUE, {"vertices": 11}, "A02", "at least 12, got 11"),
    ],
)
def test_wrong_arguments(isovalue, options, code, text):
    """Oracle: algebra. The error names the argument, what was expected and what it got."""
    with pytest.raises(iv.IsovaryError, match=code) as caught:
        particles(ellipsoid_field(), isovalue, **options)
    assert text in str(caught.value)


def test_a_triangulation_that_fails(monkeypatch):
    """Oracle: algebra. Cells that do not fit together are an error with the number of vertices."""
    monkeypatch.setattr(inner, "_seeds", lambda cloud, fine: np.full(len(cloud.parts), -1))
    with pytest.raises(iv.MeshError, match="M12") as caught:
        particles(ellipsoid_field(), ELLIPSOID_ISOVALUE, vertices=60)
    assert "60 vertices; ask for more" in str(caught.value)


def test_more_vertices_than_wanted_are_announced():
    """Oracle: algebra. A sphere takes more than 12 to be resolved, and says so."""
    with pytest.warns(UserWarning, match="M15"):
        surface = particles(ellipsoid_field((1, 1, 1)), ELLIPSOID_ISOVALUE, vertices=12)
    assert len(np.unique(surface.corners)) > 12
