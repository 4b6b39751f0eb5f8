"""What every mesher promises: field, isovalue -> Surface on the isosurface."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from conftest import ELLIPSOID_ISOVALUE, ellipsoid_field

import isovary as iv
from isovary.geometry import triangle_quality

MESHERS = {
    "marching_cubes": iv.marching_cubes,
    "flat": partial(iv.marching_cubes, order=1),
    "raw": partial(iv.marching_cubes, vertices=None),
}
CLOSED = iv.Topology(components=1, boundary_loops=0, euler=2, genus=0)


@pytest.mark.parametrize("mesher", MESHERS.values(), ids=MESHERS)
def test_nodes_lie_on_the_isosurface_with_its_normals(mesher):
    """Oracle: analytic. x^2 + y^2 + z^2/4 = 1, and normals along (x, y, z/4), outward."""
    surface = mesher(ellipsoid_field(), ELLIPSOID_ISOVALUE)
    x = surface.points
    np.testing.assert_allclose((x**2 / [1, 1, 4]).sum(axis=1), 1, atol=1e-11)
    exact = x / [1, 1, 4]
    exact /= np.linalg.norm(exact, axis=1, keepdims=True)
    np.testing.assert_allclose(surface.normals, exact, atol=1e-10)
    assert iv.topology(surface.triangles) == CLOSED


@pytest.mark.parametrize("mesher", MESHERS.values(), ids=MESHERS)
def test_triangles_face_outward(mesher):
    """Oracle: analytic. The volume 8 pi / 3 by the divergence theorem, positive for outward."""
    surface = mesher(ellipsoid_field(), ELLIPSOID_ISOVALUE)
    a, b, c = (surface.points[surface.corners[:, k]] for k in range(3))
    volume = np.einsum("nd,nd->", a, np.cross(b, c)) / 6
    assert volume == pytest.approx(8 * np.pi / 3, rel=0.02)


@pytest.mark.parametrize("wanted", [120, 500, 1500])
def test_number_of_vertices_and_quality(wanted):
    """Oracle: data. Within 15 % of the wanted number; no slivers (marching cubes leaves 0.00)."""
    surface = iv.marching_cubes(ellipsoid_field(), ELLIPSOID_ISOVALUE, vertices=wanted)
    count = len(np.unique(surface.corners))
    assert count == pytest.approx(wanted, rel=0.15)
    quality = triangle_quality(surface.points, surface.corners)
    assert quality.min() > 0.35
    assert quality.mean() > 0.93


def test_the_mesh_is_reproducible():
    """Oracle: symmetry. The same input gives the same bits."""
    first, second = (iv.marching_cubes(ellipsoid_field(), ELLIPSOID_ISOVALUE) for _ in range(2))
    np.testing.assert_array_equal(first.points, second.points)
    np.testing.assert_array_equal(first.triangles, second.triangles)


@pytest.mark.parametrize("scale", [1e-9, 1e9])
def test_units_do_not_matter(scale):
    """Oracle: symmetry. A box in nanometres or gigametres gives the same mesh, scaled."""
    field = ellipsoid_field()
    other = iv.ScalarField(
        field.values, scale * field.spacing, scale * field.origin, logarithmic=True
    )
    first = iv.marching_cubes(field, ELLIPSOID_ISOVALUE, vertices=300)
    second = iv.marching_cubes(other, ELLIPSOID_ISOVALUE, vertices=300)
    assert second.area / scale**2 == pytest.approx(first.area, rel=1e-4)


def test_far_origin():
    """Oracle: symmetry. UTM-like coordinates of 1e6 cost digits of position, not the shape."""
    field = ellipsoid_field()
    far = iv.ScalarField(field.values, field.spacing, field.origin + 1e6, logarithmic=True)
    surface = iv.marching_cubes(far, ELLIPSOID_ISOVALUE, vertices=300)
    local = surface.points - 1e6
    np.testing.assert_allclose((local**2 / [1, 1, 4]).sum(axis=1), 1, atol=1e-8)


def test_anisotropic_spacing():
    """Oracle: analytic. Area of the 1:1:2 spheroid, 21.478435, from a grid of unequal spacing."""
    field = iv.ScalarField.from_function(
        lambda p: np.exp(-0.5 * (p**2 / [1, 1, 4]).sum(axis=-1)),
        ((-1.5, -1.6, -2.5), (1.5, 1.6, 2.5)),
        (31, 20, 27),
        logarithmic=True,
    )
    surface = iv.marching_cubes(field, ELLIPSOID_ISOVALUE, vertices=800)
    assert surface.area == pytest.approx(21.478435, rel=1e-5)


def test_isovalue_equal_to_samples():
    """Oracle: analytic. An integer field cut at an integer: still closed, manifold, Euler 2."""
    axis = np.arange(-8, 9)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    diamond = iv.ScalarField(10 - np.abs(x) - np.abs(y) - np.abs(z))
    surface = iv.contour(diamond, 4.0)
    assert iv.topology(surface.triangles) == CLOSED
    assert triangle_quality(surface.points, surface.triangles).min() > 0


def test_surface_cut_by_the_box():
    """Oracle: analytic. A sphere cut at x = 0.3 keeps one rim, on the face to rounding."""
    field = iv.ScalarField.from_function(
        lambda p: -(p**2).sum(axis=-1), ((0.3, -1.5, -1.5), (1.5, 1.5, 1.5)), (13, 31, 31)
    )
    surface = iv.marching_cubes(field, -1.0, vertices=400)
    assert iv.topology(surface.triangles) == iv.Topology(1, 1, 1, 0)
    from isovary.geometry import edges_of

    edges, _, counts = edges_of(surface.triangles)
    rim = surface.points[np.unique(edges[counts == 1])]
    assert np.abs(rim[:, 0] - 0.3).max() < 1e-10
    np.testing.assert_allclose((surface.points**2).sum(axis=1), 1, atol=1e-10)
    assert surface.area == pytest.approx(2 * np.pi * 0.7, rel=1e-3)  # Archimedes: 2 pi r h


def test_rim_corners_stay_corners():
    """Oracle: analytic. A tilted plane through a box: its four corners lie on the box's edges."""
    box = ((-1.0, -1.0, -1.0), (1.0, 1.2, 1.0))
    field = iv.ScalarField.from_function(
        lambda p: 0.1 * p[..., 0] - 0.2 * p[..., 1] - p[..., 2], box, (12, 13, 14)
    )
    surface = iv.marching_cubes(field, 0.0, vertices=150)
    for x in (-1.0, 1.0):
        for y in (-1.0, 1.2):
            corner = np.array([x, y, 0.1 * x - 0.2 * y])
            assert np.linalg.norm(surface.points - corner, axis=1).min() < 1e-9
    assert surface.area == pytest.approx(2 * 2.2 * np.sqrt(1 + 0.01 + 0.04), rel=1e-9)


def test_several_components():
    """Oracle: analytic. Two unit spheres: two components, area 8 pi."""
    field = iv.ScalarField.from_function(
        lambda p: np.maximum(
            1 - np.linalg.norm(p - np.array([1.6, 0, 0]), axis=-1),
            1 - np.linalg.norm(p + np.array([1.6, 0, 0]), axis=-1),
        ),
        ((-3, -1.5, -1.5), (3, 1.5, 1.5)),
        (61, 31, 31),
    )
    surface = iv.marching_cubes(field, 0.0, vertices=800)
    assert iv.topology(surface.triangles) == iv.Topology(2, 0, 4, 0)
    assert surface.area == pytest.approx(8 * np.pi, rel=1e-3)


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
    ],
)
def test_wrong_arguments(isovalue, options, code, text):
    """Oracle: algebra. The error names the argument, what was expected and what it got."""
    with pytest.raises(iv.IsovaryError, match=code) as caught:
        iv.marching_cubes(ellipsoid_field(), isovalue, **options)
    assert text in str(caught.value)
