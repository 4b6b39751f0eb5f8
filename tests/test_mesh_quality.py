"""The mesh report: numbers of meshes whose quality is known, and faults that must be named."""

from __future__ import annotations

import json

import numpy as np
import pytest
from conftest import ELLIPSOID_ISOVALUE, ellipsoid_field

import isovary as iv
from isovary.geometry import with_midpoints
from isovary.quality import mesh_quality
from isovary.view._tessellate import lattice

CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0.5, 3**0.5 / 2, 0]])
ONE = np.array([[0, 1, 2]])
TETRAHEDRON = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
TETRAHEDRON_POINTS = np.array([[0.0, 0, 0], [0, 1, 0], [1, 0, 0], [0, 0, 1]])


def ball_field(low=-1.5, high=1.5) -> iv.ScalarField:
    """The unit sphere is the isosurface at -1; the spline is exact for the quadratic."""
    box = ((low, -1.5, -1.5), (high, 1.5, 1.5))  # low and high along x
    return iv.ScalarField.from_function(lambda p: -(p**2).sum(axis=-1), box, (13, 13, 13))


@pytest.mark.parametrize(
    ("apex", "quality", "angles"),
    [([0.5, 3**0.5 / 2, 0], 1.0, [60, 60, 60]), ([0, 1, 0], 2 * 2**0.5 - 2, [90, 45, 45])],
    ids=["equilateral", "right"],
)
def test_one_triangle(apex, quality, angles):
    """Oracle: analytic. r = (2 - sqrt 2) / 2 and R = sqrt 2 / 2 of the isosceles right one."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], apex])
    found = mesh_quality(iv.Surface(points, ONE))
    assert found.quality[0] == pytest.approx(quality, abs=1e-14)
    np.testing.assert_allclose(found.angles[0], angles, atol=1e-12)
    sides = [np.linalg.norm(points[i] - points[j]) for i, j in ((0, 1), (0, 2), (1, 2))]
    np.testing.assert_allclose(found.edge_lengths, sides, atol=1e-15)
    assert (found.vertices, found.nodes, found.triangles, found.order) == (3, 3, 1, 1)
    assert found.topology == iv.Topology(1, 1, 1, 0)
    assert found.clean


def test_scale_and_numbering_do_not_matter():
    """Oracle: symmetry. Quality and angles of a mesh scaled, turned and renumbered are the same."""
    surface = iv.icosphere(2)
    order = np.random.default_rng(1).permutation(len(surface.points))
    turn = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    other = iv.Surface(1e6 * (surface.points @ turn.T)[order], np.argsort(order)[surface.triangles])
    first, second = mesh_quality(surface), mesh_quality(other)
    for name in ("quality", "angles", "jacobians"):
        np.testing.assert_allclose(getattr(second, name), getattr(first, name), rtol=1e-9)
    assert second.clean


def test_icosphere():
    """Oracle: analytic. 10 4^s + 2 vertices, 20 4^s triangles, a sphere; the icosahedron's edge."""
    found = mesh_quality(iv.icosphere(2, order=2))
    assert (found.vertices, found.nodes, found.triangles, found.order) == (162, 642, 320, 2)
    assert found.topology == iv.Topology(1, 0, 2, 0)
    assert found.area == pytest.approx(4 * np.pi, rel=1e-3)
    assert found.clean
    twenty = mesh_quality(iv.icosphere(0, order=1))
    np.testing.assert_allclose(twenty.edge_lengths, 1 / np.sin(2 * np.pi / 5), rtol=1e-12)
    np.testing.assert_allclose(twenty.angles, 60, atol=1e-9)


@pytest.mark.parametrize("midpoint", [0.5, 0.4, 0.25, 0.1])
def test_a_folded_triangle(midpoint):
    """Oracle: analytic. x(s) = 4 m s (1 - s) + s (2 s - 1): x' runs from 4 m - 1 to 3 - 4 m."""
    points, triangles = with_midpoints(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), ONE)
    points[triangles[0, 3]] = [midpoint, 0, 0]
    found = mesh_quality(iv.Surface(points, triangles))
    ratio = (4 * midpoint - 1) / (3 - 4 * midpoint)
    assert found.jacobians[0] == pytest.approx(ratio, abs=1e-12)
    folded = midpoint <= 0.25
    assert any("folded" in fault for fault in found.faults) == folded
    assert found.clean == (not folded)


def test_a_triangle_turned_against_its_normals():
    """Oracle: algebra. A flat triangle has no bad Jacobian, but faces away from the normals."""
    down = np.tile([0.0, 0, -1], (3, 1))
    found = mesh_quality(iv.Surface(CORNERS, ONE, down))
    np.testing.assert_allclose(found.facing, -1)
    assert found.faults == ("1 triangles folded or turned over",)


def test_distance_of_flat_triangles_to_the_sphere():
    """Oracle: analytic. The icosahedron's faces lie at its inradius rho from the centre.

    At the radius r the distance is |g| / |grad g| = (1 - r^2) / (2 r), 0 at the vertices.
    """
    found = mesh_quality(iv.icosphere(0, order=1), ball_field(), -1.0)
    rho = (3 * np.sqrt(3) + np.sqrt(15)) / 12 / np.sin(2 * np.pi / 5)
    np.testing.assert_allclose(found.element_distances, (1 - rho**2) / (2 * rho), rtol=1e-9)
    assert found.distances.max() < 1e-14
    places, small = lattice(100)
    face = iv.icosphere(0, order=1)
    inside = places[small].mean(axis=1) @ face.points[face.triangles[0]]
    r = np.linalg.norm(inside, axis=1)
    rms = np.sqrt(np.mean(((1 - r**2) / (2 * r)) ** 2))
    assert found.surface_distance == pytest.approx(rms, rel=1e-3)


@pytest.mark.parametrize(("order", "rate"), [(1, 2), (2, 4)])
def test_the_surface_approaches_the_sphere(order, rate):
    """Oracle: order. Flat triangles err with h^2, curved ones with h^4 (a symmetric midpoint).

    The sagitta h^2 / 6 of an equilateral triangle with edge h bounds the flat ones.
    """
    found = [mesh_quality(iv.icosphere(s, order=order), ball_field(), -1.0) for s in (2, 3)]
    size = [q.edge_lengths.max() for q in found]
    for measure in ("surface_distance", "element_distances"):
        away = [np.max(getattr(q, measure)) for q in found]
        assert np.log(away[0] / away[1]) / np.log(size[0] / size[1]) == pytest.approx(rate, abs=0.4)
    if order == 1:
        assert found[1].element_distances.max() <= 1.05 * size[1] ** 2 / 6


def test_distance_outside_of_the_box():
    """Oracle: analytic. (1.7, 0, 0) lies 0.2 beyond the face, which is (1.5^2 - 1) / 3 away."""
    ball = iv.icosphere(1)
    grown = mesh_quality(iv.Surface(1.7 * ball.points, ball.triangles), ball_field(), -1.0)
    tip = int(ball.points[:, 0].argmax())
    assert ball.points[tip, 0] == pytest.approx(1)
    assert grown.distances[tip] == pytest.approx(np.hypot(1.25 / 3, 0.2))
    assert np.isfinite(grown.element_distances).all()


@pytest.mark.parametrize(("low", "high"), [(0.3, 1.5), (-1.5, -0.3)])
def test_rim_on_the_box(low, high):
    """Oracle: analytic. The rim lies on the face; a cap cut elsewhere has a rim inside the box."""
    field = ball_field(low, high)
    cap = iv.marching_cubes(field, -1.0, vertices=200)
    found = mesh_quality(cap, field, -1.0)
    assert found.rim_distances.max() < 1e-12
    assert found.clean
    above = cap.corners[(np.abs(cap.points[cap.corners, 0]) > 0.6).all(axis=1)]
    used, inverse = np.unique(above, return_inverse=True)
    smaller = iv.Surface(cap.points[used], inverse.reshape(-1, 3))
    inside = mesh_quality(smaller, field, -1.0)
    assert inside.rim_distances.min() > 0.2
    assert [fault.split(" ", 1)[1] for fault in inside.faults] == ["nodes on rims inside the box"]
    assert mesh_quality(smaller).clean  # without the field nobody knows


TORN = {
    "edges with more than two triangles": (
        np.vstack([TETRAHEDRON_POINTS, [[-1, -1, 0.5]]]),
        np.vstack([TETRAHEDRON, [[0, 1, 4]]]),
    ),
    "edges whose triangles face opposite sides": (
        TETRAHEDRON_POINTS,
        np.vstack([TETRAHEDRON[:3], TETRAHEDRON[3:, ::-1]]),
    ),
    "vertices where parts of the surface only touch": (
        np.vstack([TETRAHEDRON_POINTS, -TETRAHEDRON_POINTS[1:]]),
        np.vstack([TETRAHEDRON, np.array([0, 4, 5, 6])[TETRAHEDRON[:, ::-1]]]),
    ),
}


@pytest.mark.parametrize("fault", TORN)
def test_what_is_no_manifold_is_not_clean(fault):
    """Oracle: algebra. A fin, a face turned round, two tetrahedra tip to tip: each is named."""
    found = mesh_quality(iv.Surface(*TORN[fault]))
    assert found.tears[fault] > 0
    assert not found.clean
    assert any(fault in words for words in found.faults)
    assert not found.summary()["clean"]
    assert "NO" in str(found)
    whole = mesh_quality(iv.Surface(TETRAHEDRON_POINTS, TETRAHEDRON))
    assert not any(whole.tears.values())


def test_an_edge_with_two_midpoints_is_a_crack():
    """Oracle: algebra. Two six-node triangles that share corners but no midpoint do not join."""
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    points, triangles = with_midpoints(square, np.array([[0, 1, 2], [0, 2, 3]]))
    assert mesh_quality(iv.Surface(points, triangles)).clean
    shared = triangles[1, 3]
    triangles[1, 3] = len(points)
    cracked = mesh_quality(
        iv.Surface(np.vstack([points, points[shared] + [0, 0, 0.01]]), triangles)
    )
    assert cracked.faults == ("1 edges with several midpoints",)


def test_a_sliver_is_not_clean():
    """Oracle: analytic. Sides 1, l, l have the quality (2 l - 1) / l^2."""
    found = mesh_quality(iv.Surface(np.array([[0.0, 0, 0], [1, 0, 0], [0.5, 0.05, 0]]), ONE))
    side = np.hypot(0.5, 0.05)
    assert found.quality[0] == pytest.approx((2 * side - 1) / side**2)
    assert found.faults == ("1 triangles of a quality below 0.3, worst 0.02",)


def test_edges_against_the_sizing():
    """Oracle: symmetry. A wish of the edges' own lengths, times any factor, is fulfilled by all."""
    surface, field = iv.icosphere(1), ball_field()
    found = mesh_quality(surface, field, -1.0)
    ratios = found.edge_lengths / np.sqrt(np.mean(found.edge_lengths**2))
    np.testing.assert_allclose(found.edge_ratios, ratios, rtol=1e-12)

    def own(points, field, isovalue):
        assert np.linalg.norm(points, axis=1) == pytest.approx(1)  # on the curved edge
        return 7 * found.edge_lengths

    exact = mesh_quality(surface, field, -1.0, sizing=own)
    np.testing.assert_allclose(exact.edge_ratios, 1, rtol=1e-12)


def test_edges_and_curvature():
    """Oracle: analytic. A sphere curves the same everywhere: NaN; graded edges follow, to -1."""
    assert np.isnan(mesh_quality(iv.icosphere(2), ball_field(), -1.0).size_curvature_correlation)
    field = ellipsoid_field()
    equal, graded = (
        mesh_quality(
            iv.marching_cubes(field, ELLIPSOID_ISOVALUE, vertices=300, sizing=sizing),
            field,
            ELLIPSOID_ISOVALUE,
            sizing=sizing,
        )
        for sizing in (iv.uniform_sizing, iv.curvature_sizing)
    )
    assert abs(equal.size_curvature_correlation) < 0.3
    assert graded.size_curvature_correlation < -0.85


def test_summary_is_plain_json():
    """Oracle: algebra. Strict JSON; what needs the field is null without one, never 0."""
    summary = json.loads(json.dumps(mesh_quality(iv.icosphere(1)).summary(), allow_nan=False))
    assert summary["distance_to_isosurface"] == {"nodes": None, "elements": None, "rms": None}
    assert summary["edge_over_wish"] is None
    assert summary["size_curvature_correlation"] is None
    assert summary["vertices"] == 42
    assert summary["clean"] is True
    known = mesh_quality(iv.icosphere(1), ball_field(), -1.0).summary()
    assert known["distance_to_isosurface"]["elements"] > 0
    json.dumps(known, allow_nan=False)


def test_wrong_arguments():
    """Oracle: algebra. The error names what is missing, or what the sizing returned."""
    surface, field = iv.icosphere(1), ball_field()
    with pytest.raises(iv.ArgumentError, match="A03"):
        mesh_quality(surface, field)
    with pytest.raises(iv.ArgumentError, match="A03"):
        mesh_quality(surface, sizing=iv.uniform_sizing)
    with pytest.raises(iv.ArgumentError, match="120 positive lengths"):
        mesh_quality(surface, field, -1.0, sizing=lambda p, f, v: np.zeros(len(p)))
    with pytest.raises(iv.FieldError, match="I02"):
        mesh_quality(surface, field, 7.0)
