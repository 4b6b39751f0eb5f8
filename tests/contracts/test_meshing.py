"""What every mesher promises: field, isovalue -> Surface on the isosurface.

A new mesher is added to MESHERS, a new sizing function to SIZINGS.
"""

from __future__ import annotations

import warnings
from functools import cache, partial

import numpy as np
import oracles
import pytest
from conftest import ELLIPSOID_ISOVALUE, ellipsoid_field

import isovary as iv
from isovary.geometry import (
    edges_of,
    jacobian_ratios,
    node_components,
    rim_nodes,
    triangle_quality,
)

MESHERS = {"marching_cubes": iv.marching_cubes, "distmesh": iv.distmesh, "particles": iv.particles}
SIZINGS = {
    "uniform": iv.uniform_sizing,
    "curvature": iv.curvature_sizing,
    "nonuniform": partial(iv.nonuniform_sizing, axis=2),
}
KINDS = {  # every way to call a mesher
    **MESHERS,
    "flat": partial(iv.marching_cubes, order=1),
    "raw": lambda field, isovalue, vertices: iv.marching_cubes(field, isovalue, remeshed=False),
}
CLOSED = iv.Topology(components=1, boundary_loops=0, euler=2, genus=0)
BOX = ((-1.5, -1.43, -1.37), (1.44, 1.52, 1.49))

every_mesher = pytest.mark.parametrize("mesher", MESHERS)
every_sizing = pytest.mark.parametrize("sizing", SIZINGS)


@cache
def spheroid(mesher: str, sizing: str, vertices: int = 1000) -> iv.Surface:
    """x^2 + y^2 + z^2 / 4 = 1, of a logarithmic field."""
    return MESHERS[mesher](
        ellipsoid_field(), ELLIPSOID_ISOVALUE, vertices=vertices, sizing=SIZINGS[sizing]
    )


@cache
def sphere(mesher: str, vertices: int = 1000) -> iv.Surface:
    return MESHERS[mesher](ball(), -1.0, vertices=vertices)


def ball(box=BOX, shape=(16, 16, 16)) -> iv.ScalarField:
    """-|x|^2, which the spline reproduces: the isosurface at -1 is the unit sphere."""
    return iv.ScalarField.from_function(lambda p: -(p**2).sum(axis=-1), box, shape)


def two_balls(radius: float) -> iv.ScalarField:
    """Signed distance from a unit sphere and from a smaller one beside it."""
    return iv.ScalarField.from_function(
        lambda p: np.maximum(
            1 - np.linalg.norm(p, axis=-1), radius - np.linalg.norm(p - [2, 0, 0], axis=-1)
        ),
        ((-1.31, -1.25, -1.28), (2.69, 1.35, 1.32)),
        (61, 41, 41),
    )


def vertices_of(surface: iv.Surface) -> int:
    return len(np.unique(surface.corners))


def edge_lengths(surface: iv.Surface) -> tuple[np.ndarray, np.ndarray]:
    """Corner edges and their lengths."""
    edges, _, _ = edges_of(surface.triangles)
    i, j = edges.T
    return edges, np.linalg.norm(surface.points[i] - surface.points[j], axis=1)


def mean_edge_lengths(surface: iv.Surface) -> np.ndarray:
    """Mean length of the edges at each vertex; vertices come first among the nodes."""
    edges, lengths = edge_lengths(surface)
    ends = edges.ravel()
    return np.bincount(ends, np.repeat(lengths, 2)) / np.bincount(ends)


def volume(surface: iv.Surface) -> float:
    """By the divergence theorem: positive for triangles that face outward."""
    a, b, c = (surface.points[surface.corners[:, k]] for k in range(3))
    return float(np.einsum("nd,nd->", a, np.cross(b, c)) / 6)


# ------------------------------------------------------------------ the isosurface


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_nodes_lie_on_the_isosurface_with_its_normals(kind):
    """Oracle: analytic. x^2 + y^2 + z^2/4 = 1, normals along (x, y, z/4), volume 8 pi / 3."""
    surface = kind(ellipsoid_field(), ELLIPSOID_ISOVALUE, vertices=500)
    check_spheroid(surface)


@every_sizing
@every_mesher
def test_sized_nodes_lie_on_the_isosurface_with_its_normals(mesher, sizing):
    """Oracle: analytic. The same for every sizing."""
    check_spheroid(spheroid(mesher, sizing))


def check_spheroid(surface: iv.Surface) -> None:
    x = surface.points
    np.testing.assert_allclose((x**2 / [1, 1, 4]).sum(axis=1), 1, atol=1e-9)
    exact = x / [1, 1, 4]
    exact /= np.linalg.norm(exact, axis=1, keepdims=True)
    np.testing.assert_allclose(surface.normals, exact, atol=1e-9)
    assert iv.topology(surface.triangles) == CLOSED
    assert volume(surface) == pytest.approx(8 * np.pi / 3, rel=0.03)
    assert jacobian_ratios(surface.points, surface.triangles).min() > 0


@every_mesher
def test_order_of_the_surface(mesher):
    """Oracle: convergence order. The unit sphere's area: flat triangles err with h^2, six-node
    triangles with h^4, and h^2 with one over the number of vertices.
    """
    counts = np.array([100, 300, 1000])
    curved = [sphere(mesher, count) for count in counts]
    flat = [iv.Surface(s.points[: vertices_of(s)], s.corners) for s in curved]
    for surfaces, order in ((flat, 1), (curved, 2)):
        errors = [abs(surface.area - 4 * np.pi) for surface in surfaces]
        slope = np.polyfit(np.log(counts), np.log(errors), 1)[0]
        assert slope == pytest.approx(-order, abs=0.15), (order, errors)
    same = MESHERS[mesher](ball(), -1.0, vertices=100, order=1)
    assert same.order == 1
    np.testing.assert_array_equal(same.points, flat[0].points)


@every_mesher
def test_anisotropic_spacing(mesher):
    """Oracle: analytic. Area of the 1:1:2 spheroid from a grid of unequal spacing."""
    field = iv.ScalarField.from_function(
        lambda p: np.exp(-0.5 * (p**2 / [1, 1, 4]).sum(axis=-1)),
        ((-1.5, -1.6, -2.5), (1.5, 1.6, 2.5)),
        (31, 20, 27),
        logarithmic=True,
    )
    surface = MESHERS[mesher](field, ELLIPSOID_ISOVALUE, vertices=500)
    assert surface.area == pytest.approx(oracles.spheroid_area(2.0), rel=4e-5)


def test_isovalue_equal_to_samples():
    """Oracle: analytic. An integer field cut at an integer: still closed, manifold, Euler 2."""
    axis = np.arange(-8, 9)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    diamond = iv.ScalarField(10 - np.abs(x) - np.abs(y) - np.abs(z))
    surface = iv.contour(diamond, 4.0)
    assert iv.topology(surface.triangles) == CLOSED
    assert triangle_quality(surface.points, surface.triangles).min() > 0


# ------------------------------------------------------------------ number and quality


@pytest.mark.parametrize("wanted", [60, 300, 1000])
@every_mesher
def test_number_of_vertices_of_a_closed_surface(mesher, wanted):
    """Oracle: algebra. Within half a per cent of the wanted number."""
    assert vertices_of(sphere(mesher, wanted)) == pytest.approx(wanted, rel=0.005)


@every_sizing
@every_mesher
def test_number_and_quality_of_a_sized_mesh(mesher, sizing):
    """Oracle: data. The wanted number of triangles close to equilateral ones."""
    check_quality(spheroid(mesher, sizing), 1000)


@every_mesher
def test_quality_of_the_sphere(mesher):
    """Oracle: data. The same for the sphere."""
    check_quality(sphere(mesher, 1000), 1000)


def test_quality_of_a_finer_mesh():
    """Oracle: data. The same for 3 000 vertices."""
    check_quality(spheroid("marching_cubes", "uniform", 3000), 3000)


@every_mesher
def test_coarse_mesh_of_fine_data(mesher):
    """Oracle: analytic. 10 000 triangles of marching cubes leave 60 vertices, if so many are
    asked: the data's grid does not show.
    """
    fine = ball(((-1.2,) * 3, (1.21, 1.22, 1.23)), (48, 48, 48))
    surface = MESHERS[mesher](fine, -1.0, vertices=60)
    check_quality(surface, 60)
    assert surface.area == pytest.approx(4 * np.pi, rel=1e-3)


def check_quality(surface: iv.Surface, wanted: int) -> None:
    assert vertices_of(surface) == pytest.approx(wanted, rel=0.005)
    quality = triangle_quality(surface.points, surface.corners)
    assert quality.mean() >= 0.95
    assert quality.min() >= 0.5


@every_mesher
def test_number_of_vertices_of_an_open_surface(mesher):
    """Oracle: analytic. A sphere cut at x = 0.3: one rim, area 2 pi 0.7 (Archimedes)."""
    half = ball(((0.3, -1.5, -1.5), (1.5, 1.5, 1.5)), (13, 31, 31))
    surface = MESHERS[mesher](half, -1.0, vertices=400)
    assert iv.topology(surface.triangles) == iv.Topology(1, 1, 1, 0)
    assert vertices_of(surface) == pytest.approx(400, rel=0.02)
    rim = surface.points[rim_nodes(surface.triangles)]
    assert np.abs(rim[:, 0] - 0.3).max() < 1e-10
    np.testing.assert_allclose((surface.points**2).sum(axis=1), 1, atol=1e-9)
    assert surface.area == pytest.approx(2 * np.pi * 0.7, rel=1e-3)


# ------------------------------------------------------------------ components


@every_mesher
def test_several_components(mesher):
    """Oracle: analytic. Spheres of radius 1 and 0.4: vertices in the proportion 1 : 0.16."""
    surface = MESHERS[mesher](two_balls(0.4), 0.0, vertices=600)
    assert iv.topology(surface.triangles) == iv.Topology(2, 0, 4, 0)
    assert surface.area == pytest.approx(4 * np.pi * 1.16, rel=1e-3)
    on_small = surface.points[:, 0] > 1.3
    assert len(np.unique(node_components(surface.triangles)[on_small])) == 1
    small = np.intersect1d(np.flatnonzero(on_small), surface.corners)
    assert len(small) == pytest.approx(596 * 0.16 / 1.16 + 2, rel=0.1)


@every_mesher
def test_a_tiny_component_stays_with_few_vertices(mesher):
    """Oracle: analytic. Edges as long as the radius give a sphere 8 pi / sqrt(3) + 2 vertices."""
    with pytest.warns(UserWarning, match="M15"):
        surface = MESHERS[mesher](two_balls(0.2), 0.0, vertices=20)
    assert iv.topology(surface.triangles) == iv.Topology(2, 0, 4, 0)
    assert vertices_of(surface) == pytest.approx(2 * (8 * np.pi / 3**0.5 + 2), rel=0.2)


# ------------------------------------------------------------------ sizing


@every_mesher
def test_size_follows_curvature(mesher):
    """Oracle: analytic. Curvatures of the spheroid: q around, q^3 / 4 along the meridian, with
    q = 1 / sqrt(x^2 + y^2 + z^2 / 16).
    """
    surface = spheroid(mesher, "curvature")
    sizes = mean_edge_lengths(surface)
    x = surface.points[: len(sizes)]
    q = 1 / np.sqrt((x**2 / [1, 1, 16]).sum(axis=1))
    bend = np.sqrt((q**2 + (q**3 / 4) ** 2) / 2)
    assert np.corrcoef(np.log(sizes), np.log(bend))[0, 1] <= -0.9
    assert np.ptp(np.log(sizes)) > 0.8 * np.log(bend.max() / bend.min())


@every_mesher
def test_nonuniform_ratio_is_met(mesher):
    """Oracle: analytic. log of the edge length rises by log 4 over the box's 5.6."""
    surface = spheroid(mesher, "nonuniform")
    edges, lengths = edge_lengths(surface)
    height = surface.points[edges, 2].mean(axis=1)
    slope = np.polyfit(height, np.log(lengths), 1)[0]
    assert slope * 5.6 == pytest.approx(np.log(4), rel=0.1)


@pytest.mark.parametrize("length", [0.12, 0.2, 0.4])
@every_mesher
def test_lengths_are_met_where_no_number_is_asked(mesher, length):
    """Oracle: analytic. The mean edge of the sphere is as long as asked, the number follows."""
    sizing = partial(iv.uniform_sizing, length=length)
    surface = MESHERS[mesher](ball(), -1.0, sizing=sizing)
    assert edge_lengths(surface)[1].mean() == pytest.approx(length, rel=0.05)
    assert vertices_of(surface) == pytest.approx(8 * np.pi / 3**0.5 / length**2 + 2, rel=0.03)


@pytest.mark.parametrize("growth", [0.15, 0.4])
@every_mesher
def test_edges_grow_no_faster_than_asked(mesher, growth):
    """Oracle: analytic. Lengths that jump at the equator grow with the distance from it, which
    is the latitude on the unit sphere.
    """
    short, long = 0.12, 0.6

    def jump(points, field, isovalue):
        return np.where(points[:, 2] < 0, short, long)

    surface = MESHERS[mesher](ball(), -1.0, sizing=jump, growth=growth)
    sizes = mean_edge_lengths(surface)
    height = surface.points[: len(sizes), 2]
    latitude = np.maximum(np.arcsin(np.clip(height, -1, 1)), 0)
    ratio = sizes / np.minimum(short + growth * latitude, long)
    assert ratio.min() > 0.6
    assert ratio.max() < 1.4
    # what is wanted at the two ends of an edge differs by growth of its length
    assert np.median(ratio[height > 0]) == pytest.approx(1, abs=growth / 2)
    edges, lengths = edge_lengths(surface)
    steps = np.abs(np.diff(sizes[edges], axis=1)[:, 0]) / lengths
    assert np.percentile(steps, 95) < growth + 0.1  # the mesh's own unevenness


@pytest.mark.parametrize(
    "lengths",
    [
        lambda points: np.full(len(points), np.nan),
        lambda points: np.full(len(points), np.inf),
        lambda points: np.full(len(points), -1.0),
        lambda points: np.zeros(len(points)),
        lambda points: np.ones(len(points) + 1),
        lambda points: np.ones((len(points), 1)),
        lambda points: 1.0,
    ],
    ids=["NaN", "inf", "negative", "zero", "one more", "column", "scalar"],
)
@every_mesher
def test_sizing_must_return_positive_lengths(mesher, lengths):
    """Oracle: algebra. A03 names the sizing and what it returned."""
    with pytest.raises(iv.ArgumentError, match="A03") as caught:
        MESHERS[mesher](ball(), -1.0, sizing=lambda points, field, isovalue: lengths(points))
    assert "sizing: expected a function that returns" in str(caught.value)


# ------------------------------------------------------------------ symmetries


@every_sizing
@every_mesher
def test_the_mesh_is_reproducible(mesher, sizing):
    """Oracle: symmetry. The same input gives the same bits."""
    first, second = (spheroid.__wrapped__(mesher, sizing, 150) for _ in range(2))
    np.testing.assert_array_equal(first.points, second.points)
    np.testing.assert_array_equal(first.triangles, second.triangles)


@pytest.mark.parametrize(
    ("sizing", "scale"),
    [("uniform", 2.0**-30), ("uniform", 2.0**30), ("curvature", 2.0**-30), ("nonuniform", 2.0**30)],
)
@every_mesher
def test_units_do_not_matter(mesher, sizing, scale):
    """Oracle: symmetry. A box a thousand million times smaller or larger gives the same mesh,
    scaled: to the last bit, for a power of two.
    """
    field = ellipsoid_field()
    other = iv.ScalarField(
        field.values, scale * field.spacing, scale * field.origin, logarithmic=True
    )
    first = spheroid(mesher, sizing, 200)
    second = MESHERS[mesher](other, ELLIPSOID_ISOVALUE, vertices=200, sizing=SIZINGS[sizing])
    np.testing.assert_array_equal(second.triangles, first.triangles)
    np.testing.assert_allclose(second.points / scale, first.points, rtol=0, atol=1e-12)


@every_mesher
def test_far_origin(mesher):
    """Oracle: symmetry. UTM-like coordinates of 1e6 cost digits of position, not the shape."""
    field = ellipsoid_field()
    far = iv.ScalarField(field.values, field.spacing, field.origin + 1e6, logarithmic=True)
    surface = MESHERS[mesher](far, ELLIPSOID_ISOVALUE, vertices=300)
    local = surface.points - 1e6
    np.testing.assert_allclose((local**2 / [1, 1, 4]).sum(axis=1), 1, atol=1e-8)
    assert vertices_of(surface) == pytest.approx(300, rel=0.005)


# ------------------------------------------------------------------ interpolation and arguments


def test_interpolation_is_chosen_by_measurement():
    """Oracle: analytic. A Gaussian is a quadratic in the logarithm; a distance is not positive."""
    gauss = ellipsoid_field()
    errors = iv.interpolation_errors(gauss, ELLIPSOID_ISOVALUE)
    assert errors["logarithmic"] < 1e-9 < errors["plain"]
    assert iv.better_interpolation(gauss, ELLIPSOID_ISOVALUE).logarithmic
    signed = iv.ScalarField.from_function(
        lambda p: 1 - np.linalg.norm(p, axis=-1), ((-2, -2, -2), (2, 2, 2)), (21, 21, 21)
    )
    assert list(iv.interpolation_errors(signed, 0.0)) == ["plain"]
    assert not iv.better_interpolation(signed, 0.0).logarithmic


@pytest.mark.parametrize(
    ("isovalue", "options", "code", "text"),
    [
        (2.0, {}, "I02", "isovalue: expected a value inside the range"),
        (ELLIPSOID_ISOVALUE, {"order": 3}, "A02", "order: expected 1 or 2, got 3"),
        (ELLIPSOID_ISOVALUE, {"vertices": 11}, "A02", "at least 12, got 11"),
        (ELLIPSOID_ISOVALUE, {"growth": 0.0}, "A02", "growth: expected a positive number, got 0"),
        (ELLIPSOID_ISOVALUE, {"growth": np.nan}, "A02", "growth: expected a positive number"),
    ],
)
@every_mesher
def test_wrong_arguments(mesher, isovalue, options, code, text):
    """Oracle: algebra. The error names the argument, what was expected and what it got."""
    with pytest.raises(iv.IsovaryError, match=code) as caught:
        MESHERS[mesher](ellipsoid_field(), isovalue, **options)
    assert text in str(caught.value)


@every_mesher
def test_progress_rises(mesher):
    """Oracle: algebra. Parts done between 0 and 1, each greater than the one before."""
    calls: list[tuple[str, float]] = []
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        MESHERS[mesher](
            ball(), -1.0, vertices=200, progress=lambda name, part: calls.append((name, part))
        )
    assert len(calls) > 3
    parts = np.array([part for _, part in calls])
    assert (np.diff(parts) > 0).all()
    assert parts.min() >= 0
    assert parts.max() <= 1
    assert all(isinstance(name, str) and name for name, _ in calls)
