"""Surfaces that leave the box, and the last step of every mesher."""

from __future__ import annotations

import re
from functools import cache

import numpy as np
import pytest

import isovary as iv
from isovary.errors import MeshError
from isovary.geometry import (
    edges_of,
    jacobian_ratios,
    rim_nodes,
    triangle_quality,
    with_midpoints,
)
from isovary.meshing._draft import Draft, draft, held_between, settled
from isovary.meshing._edits import edges_with_sides
from isovary.meshing._finish import _nodes, finished
from isovary.meshing._moves import centroid_step, truss_step
from isovary.meshing._remesh import split_edges
from isovary.potentials import born_mayer
from isovary.projection import project

MESHERS = {"marching_cubes": iv.marching_cubes, "distmesh": iv.distmesh, "particles": iv.particles}
every_mesher = pytest.mark.parametrize("mesher", MESHERS)


def ball(low, high, shape) -> iv.ScalarField:
    """-|x|^2, which the spline reproduces: the isosurface at -1 is the unit sphere."""
    return iv.ScalarField.from_function(lambda p: -(p**2).sum(axis=-1), (low, high), shape)


@cache
def molecule() -> iv.ScalarField:
    """Born-Mayer repulsion of three atoms in a box so low that it cuts them above and below."""
    atoms = [(0, 0, 0), (1.7, 0, 0), (0.85, 1.45, 0)]
    box = ((-0.9, -0.6, -0.5), (2.6, 2.05, 0.5))
    return born_mayer(atoms, strength=1.0, decay=1 / 0.3, bounds=box, shape=(36, 27, 11))


def on_face(points: np.ndarray, field: iv.ScalarField) -> np.ndarray:
    """Distance of each point to the nearest face."""
    low, high = field.bounds
    return np.minimum(np.abs(points - low), np.abs(points - high)).min(axis=1)


def check_rims(surface: iv.Surface, field: iv.ScalarField, isovalue: float) -> None:
    """Rim nodes on a face and all on the isosurface, no other node on a face, nothing folded."""
    rim = rim_nodes(surface.triangles)
    assert on_face(surface.points[rim], field).max() < 1e-10
    level, gradient = field.level_set(surface.points, isovalue)
    assert (np.abs(level) / np.linalg.norm(gradient, axis=1)).max() < 1e-10
    inside = np.setdiff1d(np.arange(len(surface.points)), rim)
    assert on_face(surface.points[inside], field).min() > 1e-6
    assert jacobian_ratios(surface.points, surface.triangles).min() > 0
    assert edges_of(surface.triangles)[2].max() == 2


def rim_edge_lengths(surface: iv.Surface) -> np.ndarray:
    edges, _, counts = edges_of(surface.triangles)
    i, j = edges[counts == 1].T
    return np.linalg.norm(surface.points[i] - surface.points[j], axis=1)


# ------------------------------------------------------------------ rims


@every_mesher
def test_sphere_cut_by_a_face(mesher):
    """Oracle: analytic. Cut at x = 0.3: the rim is a circle of radius sqrt(0.91), its edges are
    chords of about the edge length everywhere.
    """
    field = ball((0.3, -1.5, -1.5), (1.5, 1.5, 1.5), (13, 31, 31))
    surface = MESHERS[mesher](field, -1.0, vertices=400)
    check_rims(surface, field, -1.0)
    assert iv.topology(surface.triangles) == iv.Topology(1, 1, 1, 0)
    lengths = rim_edge_lengths(surface)
    assert lengths.sum() == pytest.approx(2 * np.pi * 0.91**0.5, rel=0.005)
    assert lengths.std() < 0.15 * lengths.mean()
    edges, _, _ = edges_of(surface.triangles)
    i, j = edges.T
    every = np.linalg.norm(surface.points[i] - surface.points[j], axis=1)
    assert lengths.mean() == pytest.approx(every.mean(), rel=0.2)


@every_mesher
def test_sphere_cut_by_three_faces(mesher):
    """Oracle: analytic. Beyond x = 0.2, y = 0.3, z = -0.1: three corners on the box's edges, the
    rest of the rim on arcs of circles; area by the angles between the cuts (Gauss and Bonnet).
    """
    cut = np.array([0.2, 0.3, -0.1])
    field = ball(cut, (1.3, 1.3, 1.3), (12, 11, 15))
    surface = MESHERS[mesher](field, -1.0, vertices=300)
    check_rims(surface, field, -1.0)
    corners = np.sqrt(1 - (cut**2).sum() + cut**2)
    for axis in range(3):
        corner = np.where(np.arange(3) == axis, corners[axis], cut)
        assert np.linalg.norm(surface.points - corner, axis=1).min() < 1e-9
    area = 2 * np.pi
    for i, j in ((0, 1), (1, 2), (2, 0)):  # exterior angles, then the arcs' geodesic curvature
        a, b = cut[i], cut[j]
        area -= np.arccos(-a * b / np.sqrt((1 - a**2) * (1 - b**2)))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        radius = np.sqrt(1 - cut[i] ** 2)
        angle = np.pi / 2 - np.arcsin(cut[j] / radius) - np.arcsin(cut[k] / radius)
        area -= cut[i] * angle
    assert surface.area == pytest.approx(area, rel=1e-4)


@every_mesher
def test_rim_corners_stay_corners(mesher):
    """Oracle: analytic. A tilted plane through a box: its four corners lie on the box's edges,
    its rims are straight, its area is that of the parallelogram.
    """
    box = ((-1.0, -1.0, -1.0), (1.0, 1.2, 1.0))
    field = iv.ScalarField.from_function(
        lambda p: 0.1 * p[..., 0] - 0.2 * p[..., 1] - p[..., 2], box, (12, 13, 14)
    )
    surface = MESHERS[mesher](field, 0.0, vertices=150)
    check_rims(surface, field, 0.0)
    for x in (-1.0, 1.0):
        for y in (-1.0, 1.2):
            corner = np.array([x, y, 0.1 * x - 0.2 * y])
            assert np.linalg.norm(surface.points - corner, axis=1).min() < 1e-12
    assert surface.area == pytest.approx(2 * 2.2 * np.sqrt(1 + 0.01 + 0.04), rel=1e-9)
    lengths = rim_edge_lengths(surface)
    assert lengths.sum() == pytest.approx(4 * np.sqrt(1.01) + 4.4 * np.sqrt(1.04), rel=1e-9)
    assert lengths.std() < 0.2 * lengths.mean()


@pytest.mark.parametrize("vertices", [300, 1000])
@every_mesher
def test_molecule_cut_above_and_below(mesher, vertices):
    """Oracle: data. Three atoms' ring with two rims outside and two inside, or as contoured: the
    rims exact, no sliver.
    """
    field, isovalue = molecule(), float(np.exp(-0.85 / 0.3))
    surface = MESHERS[mesher](field, isovalue, vertices=vertices)
    check_rims(surface, field, isovalue)
    expected = iv.topology(iv.contour(field, isovalue).triangles)
    assert iv.topology(surface.triangles) == expected
    assert len(np.unique(surface.corners)) == pytest.approx(vertices, rel=0.02)
    quality = triangle_quality(surface.points, surface.corners)
    assert quality.min() >= 0.3
    assert quality.mean() >= 0.9
    lengths = rim_edge_lengths(surface)
    assert lengths.max() < 4 * lengths.min()


@pytest.mark.parametrize("isovalue", [0.0, 0.3])
@every_mesher
def test_gyroid(mesher, isovalue):
    """Oracle: symmetry. A whole period is cut by the box with rims that meet in its edges: a
    sound mesh or an error that says where.
    """
    field = iv.ScalarField.from_function(
        lambda p: (np.sin(p) * np.cos(np.roll(p, -1, axis=-1))).sum(axis=-1),
        ((0, 0, 0), (2 * np.pi,) * 3),
        (25, 25, 25),
    )
    try:
        surface = MESHERS[mesher](field, isovalue, vertices=500)
    except MeshError as error:
        surface, message = None, str(error)
    if surface is None:
        assert re.search(r"\[-?\d[^\]]*,[^\]]*,[^\]]*\]", message), message
    else:
        check_rims(surface, field, isovalue)
        assert len(np.unique(surface.corners)) == pytest.approx(500, rel=0.02)


def test_points_stay_where_they_are_held():
    """Oracle: analytic. Held coordinates are kept to the last bit; those on faces if none is."""
    field = ball((0.3, -1.5, -1.5), (1.5, 1.5, 1.5), (13, 31, 31))
    points = np.array([[0.3, 0.8, 0.4], [0.5, 0.6, 0.7], [0.9, 0.2, 0.1]])
    held = np.array([[True, False, False], [False, True, True], [False, False, False]])
    found = project(points, field, -1.0, held=held)
    np.testing.assert_array_equal(found[held], points[held])
    np.testing.assert_allclose((found**2).sum(axis=1), 1, atol=1e-12)
    assert (found[~held] != points[~held]).all()
    free = project(points, field, -1.0, held=np.zeros((3, 3), dtype=bool))
    assert free[0, 0] > 0.3
    assert project(points, field, -1.0)[0, 0] == 0.3


def test_rims_inside_the_box_are_refused():
    """Oracle: algebra. A rim that lies on no face has no box to be held by: M12 says where."""
    sphere = iv.icosphere(2, order=1)
    field = ball((-1.5, -1.5, -1.5), (1.5, 1.5, 1.5), (13, 13, 13))
    with pytest.raises(MeshError, match="M12"):
        draft(sphere.points, sphere.triangles[1:], field, -1.0)


def test_edges_between_rims_leave_the_face():
    """Oracle: algebra. Of a sphere cut by a face, four vertices on the rim and one at the pole:
    the middle of a rim edge stays on the face, that of an edge from rim to rim does not.
    """
    field = ball((0.3, -1.5, -1.5), (1.5, 1.5, 1.5), (13, 31, 31))
    angle = np.radians([0, 50, 110, 230])
    rim = np.stack([np.full(4, 0.3), 0.91**0.5 * np.cos(angle), 0.91**0.5 * np.sin(angle)], axis=1)
    points = np.concatenate([rim, [[1.0, 0, 0]]])
    start = draft(points, np.array([[0, 1, 2], [0, 2, 4], [2, 3, 4], [3, 0, 4]]), field, -1.0)
    edges = edges_with_sides(start.triangles)
    for ends, held in (([0, 1], True), ([0, 2], False), ([0, 4], False)):
        excess = np.where((edges.ends == ends).all(axis=1), 1.0, 0.0)
        more = split_edges(start, excess, edges, 9)
        assert len(more.points) == 6
        assert more.held[5].tolist() == [held, False, False]
        placed = settled(settled(more, field, -1.0), field, -1.0)
        assert (placed.points[5, 0] == 0.3) == held
    points, triangles, _ = _nodes(start, field, -1.0, 2)
    inside = np.setdiff1d(np.arange(len(points)), rim_nodes(triangles))
    assert on_face(points[inside], field).min() > 1e-6


# ------------------------------------------------------------------ moves


def test_graded_rims_rest():
    """Oracle: algebra. Edges as long as they shall be, 1 and 1.5: their common end stays."""
    points = np.array([[-1.0, 0, 0], [0, 0, 0], [1.5, 0, 0], [-0.4, 1, 0], [0.7, 1, 0]])
    triangles = np.array([[0, 1, 3], [1, 4, 3], [1, 2, 4]])
    held = np.zeros((5, 3), dtype=bool)
    held[:, 1] = True
    up = np.tile([0.0, 0, 1], (5, 1))
    lengths = np.array([0.75, 1.25, 1.75, 1.0, 1.5])
    step = centroid_step(Draft(points, triangles, held, up), lengths)
    np.testing.assert_allclose(step[1], 0, atol=1e-12)


def test_middles_are_held_by_common_faces():
    """Oracle: algebra. Of two corners on opposite faces and one common one, the common one."""
    points = np.array([[0.0, 0, 0.5], [0, 1, 0.5], [0, 0.4, 0.2]])
    held = np.array([[True, True, False], [True, True, False], [True, False, False]])
    found = held_between(points, held, np.array([0, 0]), np.array([1, 2]))
    assert found.tolist() == [[True, False, False], [True, False, False]]


@pytest.mark.parametrize("move", [centroid_step, truss_step])
def test_vertices_move_to_where_edges_shall_be_short(move):
    """Oracle: symmetry. The middle of a hexagon rests, or goes towards the shorter edges; a
    truss pushes with all bars longer than their share.
    """
    surface = iv.disk(1.0, 1, order=1)
    rim = np.arange(len(surface.points)) > 0
    held = np.column_stack([np.zeros_like(rim), np.zeros_like(rim), rim])
    hexagon = Draft(surface.points, surface.triangles, held, surface.normals)
    even = move(hexagon, np.ones(7))
    np.testing.assert_allclose(even[0], 0, atol=1e-12)
    graded = move(hexagon, 2.0 ** -surface.points[:, 0])
    assert graded[0, 0] > 0.02
    np.testing.assert_allclose(graded[0, 1:], 0, atol=1e-12)


def test_a_vertex_near_the_rim_is_pushed_back():
    """Oracle: symmetry. A vertex close to a rim edge has a bar to its mirror image behind it:
    the step leads away from the rim.
    """
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0.5, 0.1, 0], [0, 1, 0], [1, 1, 0]])
    triangles = np.array([[0, 1, 2], [1, 4, 2], [4, 3, 2], [3, 0, 2]])
    rim = np.arange(5) != 2
    held = np.column_stack([rim, rim, rim])
    up = np.tile([0.0, 0, 1], (5, 1))
    near = truss_step(Draft(points, triangles, held, up), np.full(5, 0.8))[2]
    assert near[1] > 0.05
    assert abs(near[0]) < 1e-12


# ------------------------------------------------------------------ the last step


def coarse(field: iv.ScalarField, points: np.ndarray, triangles: np.ndarray) -> Draft:
    return draft(np.asarray(points, dtype=float), triangles, field, -1.0)


@pytest.mark.parametrize("seed", [1, 3])
def test_coarse_curved_triangles_are_refined(seed):
    """Oracle: analytic. A tetrahedron on the 1:1:3 spheroid bends too much for its four curved
    triangles: it gets more, none distorted, and stays a sphere.
    """
    field = iv.ScalarField.from_function(
        lambda p: -(p**2 / [1, 1, 9]).sum(axis=-1), ((-2, -2, -4), (2, 2, 4)), (9, 9, 29)
    )
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    turn[0] *= np.sign(np.linalg.det(turn))
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) / 3**0.5
    triangles = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
    start = coarse(field, corners @ turn * [1, 1, 3], triangles)
    nodes, six = with_midpoints(start.points, triangles)
    assert jacobian_ratios(project(nodes, field, -1.0), six).min() < 0.1
    topology = iv.topology(triangles)
    surface = finished(start, field, -1.0, 2, topology)
    assert len(np.unique(surface.corners)) > 4
    assert iv.topology(surface.triangles) == topology
    assert jacobian_ratios(surface.points, surface.triangles).min() > 0.1
    np.testing.assert_allclose((surface.points**2 / [1, 1, 9]).sum(axis=1), 1, atol=1e-9)


def test_triangles_that_stay_folded_are_refused():
    """Oracle: analytic. Triangles that all face inward cannot be mended: M03 names a place; and
    a mesh of another topology is refused before, M12.
    """
    field = ball((-1.5, -1.5, -1.5), (1.5, 1.5, 1.5), (13, 13, 13))
    sphere = iv.icosphere(1, order=1)
    topology = iv.topology(sphere.triangles)
    inward = coarse(field, sphere.points, sphere.triangles[:, ::-1])
    for order in (1, 2):
        with pytest.raises(MeshError, match="M03") as caught:
            finished(inward, field, -1.0, order, topology)
        place = re.search(r"near \[(.*?)\]", str(caught.value))
        assert place is not None
        assert np.linalg.norm([float(x) for x in place[1].split(",")]) == pytest.approx(1, abs=0.2)
    other = iv.Topology(2, 0, 4, 0)
    with pytest.raises(MeshError, match="M12"):
        finished(coarse(field, sphere.points, sphere.triangles), field, -1.0, 2, other)


@pytest.mark.parametrize("logarithmic", [False, True])
def test_the_logarithm_is_recommended_where_it_suits(logarithmic):
    """Oracle: analytic. A Gaussian is a quadratic in the logarithm, which its spline reproduces:
    the error of folded triangles says so, unless it is the logarithm already.
    """
    steep = iv.ScalarField.from_function(
        lambda p: np.exp(-4 * (p**2).sum(axis=-1)),
        ((-2, -2, -2), (2, 2, 2)),
        (13, 13, 13),
        logarithmic=logarithmic,
    )
    sphere = iv.icosphere(1, order=1)
    level = float(np.exp(-4.0))
    inward = draft(sphere.points, sphere.triangles[:, ::-1], steep, level)
    with pytest.raises(MeshError, match="M03") as caught:
        finished(inward, steep, level, 1, iv.topology(sphere.triangles))
    assert ("isovary.better_interpolation" in str(caught.value)) != logarithmic


def test_a_vertex_pulled_across_its_neighbours_is_mended():
    """Oracle: analytic. The sphere's area, 4 pi; within the ring of neighbours, and across it."""
    field = ball((-1.5, -1.5, -1.5), (1.5, 1.5, 1.5), (13, 13, 13))
    sphere = iv.icosphere(2, order=1)
    topology = iv.topology(sphere.triangles)
    ends = edges_of(sphere.triangles)[0]
    ring = ends[(ends == 0).any(axis=1)].sum(axis=1)
    for neighbour, share in ((ring[0], 0.5), (ring[1], 0.9), (ring[2], 1.6), (ring[3], 2.5)):
        points = sphere.points.copy()
        points[0] += share * (points[neighbour] - points[0])
        pulled = coarse(field, points, sphere.triangles)
        surface = finished(pulled, field, -1.0, 2, topology, judged=False)
        assert jacobian_ratios(surface.points, surface.triangles).min() > 0.1
        assert surface.area == pytest.approx(4 * np.pi, rel=0.01)
