"""Edge lengths that a mesh should have, and the curvature that they follow."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from conftest import ELLIPSOID_ISOVALUE, ellipsoid_field
from scipy.sparse.csgraph import floyd_warshall

import isovary as iv
from isovary.geometry import edges_of
from isovary.meshing._curvature import section_curvatures
from isovary.meshing._draft import Draft
from isovary.meshing._sizing_field import (
    SizingField,
    _growth_limit,
    _vertex_count,
    sizing_field,
)

ISOVALUE = -1.0


def as_draft(surface):
    """A closed surface as the meshers hold it."""
    held = np.zeros(surface.points.shape, dtype=bool)
    return Draft(surface.points, surface.triangles, held, surface.normals)


@pytest.fixture(scope="module")
def ball() -> iv.ScalarField:
    """-|x|^2, which the spline reproduces: the isosurface at -1 is the unit sphere."""
    return iv.ScalarField.from_function(
        lambda p: -(p**2).sum(axis=-1), ((-1.5, -1.4, -1.3), (1.3, 1.4, 1.5)), (15, 15, 15)
    )


# ------------------------------------------------------------------ curvature


def test_curvatures_of_quadrics():
    """Oracle: analytic. Ellipsoid x^2 + y^2 / 4 + z^2 / 9 = 1 at its poles: a / b^2 and a / c^2;
    a plane 0; the saddle z = x y at its middle -1 and 1, outward being up.
    """
    field = iv.ScalarField.from_function(
        lambda p: -(p**2 / [1, 4, 9]).sum(axis=-1), ((-4, -4, -4), (4, 4, 4)), (9, 9, 9)
    )
    found = iv.principal_curvatures([[1, 0, 0], [0, 2, 0], [0, 0, 3]], field)
    np.testing.assert_allclose(found, [[1 / 9, 1 / 4], [2 / 9, 2], [3 / 4, 3]], rtol=1e-9)
    box = ((-1, -1, -1), (1, 1, 1))
    plane = iv.ScalarField.from_function(lambda p: p @ [1.0, 2.0, 3.0], box, (5, 5, 5))
    np.testing.assert_allclose(iv.principal_curvatures([[0.1, 0.2, 0.3]], plane), 0, atol=1e-12)
    saddle = iv.ScalarField.from_function(
        lambda p: p[..., 0] * p[..., 1] - p[..., 2], box, (5, 5, 5)
    )
    np.testing.assert_allclose(iv.principal_curvatures([[0, 0, 0]], saddle), [[-1, 1]], atol=1e-11)


def test_curvatures_of_sphere_and_cylinder(ball):
    """Oracle: analytic. 1 / r and 1 / r at any radius; 0 and 1 / r; negative inside a bubble."""
    points = np.random.default_rng(5).normal(size=(40, 3))
    points *= 0.9 / np.linalg.norm(points, axis=1, keepdims=True)
    np.testing.assert_allclose(iv.principal_curvatures(points, ball), 1 / 0.9, rtol=1e-7)
    bubble = iv.ScalarField(-ball.values, ball.spacing, ball.origin)
    np.testing.assert_allclose(iv.principal_curvatures(points, bubble), -1 / 0.9, rtol=1e-7)
    rod = iv.ScalarField.from_function(
        lambda p: -(p[..., 1] ** 2) - p[..., 2] ** 2, ((-1, -1, -1), (1, 1, 1)), (6, 7, 8)
    )
    found = iv.principal_curvatures([[0.3, 0.3, 0.4], [-0.2, 0, -0.5]], rod)
    np.testing.assert_allclose(found, [[0, 2], [0, 2]], atol=1e-9)


def test_curvatures_of_a_torus():
    """Oracle: convergence order. cos(a) / (R + r cos(a)) and 1 / r; the spline's second
    derivatives err with the square of the samples' distance.
    """
    ring, tube = 1.0, 0.4
    a, b = np.random.default_rng(9).uniform(0, 2 * np.pi, (2, 200))
    out = ring + tube * np.cos(a)
    points = np.stack([out * np.cos(b), out * np.sin(b), tube * np.sin(a)], axis=1)
    exact = np.stack([np.cos(a) / out, np.full_like(a, 1 / tube)], axis=1)
    errors = []
    for samples in (31, 61):
        field = iv.ScalarField.from_function(
            lambda p: -((np.hypot(p[..., 0], p[..., 1]) - ring) ** 2) - p[..., 2] ** 2,
            ((-1.5, -1.5, -0.5), (1.5, 1.5, 0.5)),
            (samples, samples, samples // 3),
        )
        errors.append(np.abs(iv.principal_curvatures(points, field) - exact).max())
    assert errors[1] < 0.01
    assert np.log2(errors[0] / errors[1]) > 1.5, errors


# ------------------------------------------------------------------ sizing functions


def test_uniform_and_nonuniform_lengths(ball):
    """Oracle: analytic. One length; or one that grows by the ratio from one side to the other."""
    low, high = ball.bounds
    points = np.array([low, (low + high) / 2, high])
    assert iv.uniform_sizing(points, ball, ISOVALUE, length=0.3).tolist() == [0.3] * 3
    for axis in range(3):
        lengths = iv.nonuniform_sizing(points, ball, ISOVALUE, length=0.1, ratio=9, axis=axis)
        np.testing.assert_allclose(lengths, [0.1, 0.3, 0.9], rtol=1e-12)


def test_lengths_by_curvature():
    """Oracle: analytic. angle / sqrt((k1^2 + k2^2) / 2) of a spheroid's pole and equator; a plane
    takes the longest, and limits are kept.
    """
    field = iv.ScalarField.from_function(
        lambda p: -(p**2 / [1, 1, 4]).sum(axis=-1), ((-3, -3, -3), (3, 3, 3)), (13, 13, 13)
    )
    points = np.array([[0, 0, 2.0], [1, 0, 0]])
    sized = partial(iv.curvature_sizing, points, field, ISOVALUE)
    exact = 1.2 / np.array([2, np.sqrt((1 + 1 / 16) / 2)])
    np.testing.assert_allclose(sized(angle=1.2), exact, rtol=1e-8)
    np.testing.assert_allclose(sized(angle=1.2, longest=1.0), [0.6, 1.0], rtol=1e-8)
    np.testing.assert_allclose(sized(angle=1e-3), 0.25)
    plane = iv.ScalarField.from_function(lambda p: p[..., 0], ((0, 0, 0), (1, 2, 2)), (5, 5, 5))
    np.testing.assert_allclose(iv.curvature_sizing([[0.5, 1, 1]], plane, 0.5), 3 / 4)
    for shortest, longest in ((0.0, 1.0), (2.0, 1.0), (np.nan, 1.0)):
        with pytest.raises(iv.ArgumentError, match="A02"):
            sized(shortest=shortest, longest=longest)


# ------------------------------------------------------------------ number of vertices


@pytest.mark.parametrize(
    ("points", "triangles"),
    [
        (
            [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]],
            [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]],
        ),
        (iv.icosphere(0, order=1).points, iv.icosphere(0, order=1).triangles),
        (iv.disk(1.0, 1, order=1).points, iv.disk(1.0, 1, order=1).triangles),
        ([[0, 0, 0], [1, 0, 0], [0.5, 0.75**0.5, 0]], [[0, 1, 2]]),
    ],
    ids=["tetrahedron", "icosahedron", "hexagon", "triangle"],
)
def test_number_of_vertices_of_equilateral_triangles(points, triangles):
    """Oracle: analytic. Euler's formula: meshes of equilateral triangles count themselves."""
    surface = iv.Surface(points, triangles)
    length = np.linalg.norm(surface.points[triangles[0][0]] - surface.points[triangles[0][1]])
    found = _vertex_count(surface)(np.full(len(surface.points), length))
    assert found == pytest.approx(len(surface.points), rel=1e-12)


def test_number_of_vertices_of_a_sphere(ball):
    """Oracle: analytic. 4 pi of equilateral triangles: V = 8 pi / (sqrt(3) h^2) + 2."""
    fine = iv.icosphere(4, order=1)
    for length in (0.1, 0.2, 0.5):
        sizing = partial(iv.uniform_sizing, length=length)
        sizes = sizing_field(as_draft(fine), ball, ISOVALUE, sizing, None, 0.3)
        assert sizes.vertices == pytest.approx(8 * np.pi / 3**0.5 / length**2 + 2, rel=0.01)
        np.testing.assert_allclose(sizes.lengths, length)


@pytest.mark.parametrize("vertices", [50, 1000, 20000])
def test_lengths_are_scaled_to_the_number_of_vertices(ball, vertices):
    """Oracle: analytic. Whatever their unit; the shape of the sizing stays."""
    fine = iv.icosphere(4, order=1)
    for length in (1e-7, 1.0, 1e7):
        sizing = partial(iv.uniform_sizing, length=length)
        sizes = sizing_field(as_draft(fine), ball, ISOVALUE, sizing, vertices, 0.3)
        assert sizes.vertices == vertices
        exact = np.sqrt(8 * np.pi / 3**0.5 / (vertices - 2))
        np.testing.assert_allclose(sizes.lengths, exact, rtol=0.007)
    graded = partial(iv.nonuniform_sizing, ratio=2.0, axis=2)
    sizes = sizing_field(as_draft(fine), ball, ISOVALUE, graded, vertices, 2.0)
    ratio = sizes.lengths / graded(fine.points, ball, ISOVALUE)
    assert np.ptp(ratio) < 0.01 * ratio.mean() or vertices == 50
    assert _vertex_count(fine)(sizes.lengths) == pytest.approx(vertices, rel=0.012)


# ------------------------------------------------------------------ limits


@pytest.mark.parametrize("growth", [0.1, 0.4, 0.8])
@pytest.mark.parametrize(
    "fine",
    [iv.icosphere(1, order=1), iv.cylinder(0.5, 1.0, (9, 5), order=1), iv.disk(1.0, 4, order=1)],
    ids=["sphere", "cylinder", "disk"],
)
def test_growth_limit(fine, growth):
    """Oracle: algebra. min over j of h_j + growth * way, with the ways of Floyd and Warshall."""
    lengths = np.random.default_rng(17).uniform(0.01, 1, len(fine.points))
    count = len(fine.points)
    ways = np.full((count, count), np.inf)
    for i, j in edges_of(fine.triangles)[0]:
        ways[i, j] = ways[j, i] = np.linalg.norm(fine.points[i] - fine.points[j])
    ways = floyd_warshall(ways)
    exact = [min(lengths[j] + growth * ways[i, j] for j in range(count)) for i in range(count)]
    limited = _growth_limit(fine, growth)(lengths)
    np.testing.assert_allclose(limited, np.minimum(exact, lengths), rtol=1e-12)
    assert (limited < lengths).any()
    np.testing.assert_allclose(_growth_limit(fine, growth)(limited), limited, rtol=1e-12)


@pytest.mark.parametrize("vertices", [None, 12, 2000])
def test_never_longer_than_the_radius_of_curvature(vertices):
    """Oracle: analytic. On the 1:1:2 spheroid 1 / q, q = 1 / sqrt(x^2 + y^2 + z^2 / 16)."""
    fine = iv.ellipsoid((1, 1, 2), 4, order=1)
    field = ellipsoid_field()
    sizing = partial(iv.uniform_sizing, length=50.0)
    sizes = sizing_field(as_draft(fine), field, ELLIPSOID_ISOVALUE, sizing, vertices, 10.0)
    radius = np.sqrt((fine.points**2 / [1, 1, 16]).sum(axis=1))
    assert (sizes.lengths <= radius * (1 + 1e-6)).all()
    if vertices != 2000:
        np.testing.assert_allclose(sizes.lengths, radius, rtol=1e-6)
        least = _vertex_count(fine)(radius)
        assert sizes.vertices == round(least)


def test_curvature_below_the_samples_is_not_resolved():
    """Oracle: algebra. Half the samples' distance is the least that curvature asks for."""
    field = iv.ScalarField.from_function(
        lambda p: -(p[..., :2] ** 2).sum(axis=-1), ((-1, -1, 0), (1, 1, 4)), (4, 4, 7)
    )
    fine = iv.cylinder(0.1, 4.0, (12, 40), order=1)  # of a radius below the distance, 2 / 3
    sizing = partial(iv.uniform_sizing, length=50.0)
    sizes = sizing_field(as_draft(fine), field, -0.01, sizing, None, 10.0)
    np.testing.assert_allclose(sizes.lengths, 1 / 3)


# ------------------------------------------------------------------ between the vertices


@pytest.mark.parametrize("scale", [1e-12, 1.0, 1e3, 1e12])
def test_lengths_between_the_vertices(scale):
    """Oracle: algebra. A vertex has its own length; between, weights 1 / distance^2 of three."""
    points = scale * np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [50, 50, 0]])
    sizes = SizingField(points, scale * np.array([1.0, 2, 3, 99]), 12)
    np.testing.assert_allclose(sizes.at(points), sizes.lengths, rtol=1e-12)
    found = sizes.at(scale * np.array([[0.5, 0, 0], [0.25, 0, 0]]))
    near = [
        (4 * 1 + 4 * 2 + 0.8 * 3) / 8.8,
        (16 * 1 + 16 / 9 * 2 + 16 / 17 * 3) / (16 + 16 / 9 + 16 / 17),
    ]
    np.testing.assert_allclose(found, scale * np.array(near), rtol=1e-12)


# ------------------------------------------------------------------ rims


@pytest.mark.parametrize("radius", [1.0, 2.5])
def test_plane_sections_of_a_sphere(radius):
    """Oracle: analytic. A plane at the distance d cuts a circle of radius sqrt(r^2 - d^2)."""
    field = iv.ScalarField.from_function(
        lambda p: -(p**2).sum(axis=-1), ((-3, -3, -3), (3, 3, 3)), (13, 13, 13)
    )
    distance, angle = 0.6 * radius, np.linspace(0, 6, 7)
    ring = 0.8 * radius
    points = np.stack([ring * np.cos(angle), ring * np.sin(angle), 0 * angle + distance], axis=1)
    found = section_curvatures(points, field, np.tile([0.0, 0, 1], (7, 1)))
    np.testing.assert_allclose(found, 1 / ring, rtol=1e-9)


def test_every_component_gets_its_vertices():
    """Oracle: analytic. On a ball smaller than a cell edges are its radius, as on larger ones."""
    field = iv.ScalarField.from_function(
        lambda p: -(p**2).sum(axis=-1), ((-1, -1, -1), (1, 1, 1)), (4, 4, 4)
    )
    sphere = iv.icosphere(4, order=1)
    fine = as_draft(iv.Surface(0.1 * sphere.points, sphere.triangles))
    sizing = partial(iv.uniform_sizing, length=50.0)
    sizes = sizing_field(fine, field, -0.01, sizing, None, 10.0)
    np.testing.assert_allclose(sizes.lengths, 0.1, rtol=2e-3)
