"""What is said of dimples that are probably not what was meant, and of surfaces in themselves."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
import vtk

from isovary import Surface, dimple
from isovary.crossings import crossing_pairs, run_through
from isovary.deform import Projectile, Region, shoot
from isovary.shapes import disk, icosphere, sheet

UP = np.array([0.0, 0.0, 1.0])


def told(surface, *where, **numbers):
    """Texts of the warnings of a dimple."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        dimple(surface, *where, **numbers)
    return [str(warning.message) for warning in caught]


@pytest.mark.parametrize("scale", [1.0, 1e-6])
def test_crossings_are_those_of_another_program(scale):
    """Oracle: VTK's vtkTriangle, over all pairs of 120 random triangles of very different size.

    VTK's has a tolerance with a unit; ours has none, so that the scale changes nothing.
    """
    rng = np.random.default_rng(3)
    sizes = 2.0 ** rng.integers(-5, 1, (120, 1, 1))
    middles = 0.5 * rng.normal(size=(120, 1, 3))
    points = (middles + sizes * rng.normal(size=(120, 3, 3))).reshape(-1, 3)
    triangles = np.arange(360).reshape(120, 3)
    corners = points[triangles].tolist()
    known = {
        (i, j)
        for i in range(120)
        for j in range(i + 1, 120)
        if vtk.vtkTriangle.TrianglesIntersect(*corners[i], *corners[j])
    }
    assert len(known) > 100
    found = crossing_pairs(scale * points, triangles, np.arange(120))
    assert {tuple(pair) for pair in found.tolist()} == known
    some = crossing_pairs(scale * points, triangles, np.arange(0, 120, 7))
    assert {tuple(pair) for pair in some.tolist()} == {
        p for p in known if 0 in (p[0] % 7, p[1] % 7)
    }


def test_neighbours_and_flat_parts_do_not_cross():
    """Oracle: algebra. A plane, in any direction, and a sphere: nothing runs through another."""
    flat = sheet(1.0, 1.0, (9, 9), order=1)
    tilt = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    for points in (flat.points, flat.points @ tilt, 1e3 + flat.points @ tilt):
        assert len(crossing_pairs(points, flat.triangles, np.arange(len(flat.triangles)))) == 0
    ball = icosphere(3, order=1)
    assert len(crossing_pairs(ball.points, ball.triangles, np.arange(len(ball.triangles)))) == 0


def test_touching_is_no_passing():
    """Oracle: algebra. A tip that ends on a face, at any angle: rounding may put it behind."""
    rng = np.random.default_rng(5)
    flat = np.array([[0, 0, 0], [3, 0, 0], [0, 3, 0], [1, 1, 0], [1, 1.2, 1], [1.3, 1, 1]], float)
    for _ in range(100):
        points = flat @ np.linalg.qr(rng.normal(size=(3, 3)))[0] + rng.normal(size=3)
        assert len(crossing_pairs(points, np.array([[0, 1, 2], [3, 4, 5]]), np.array([0, 1]))) == 0


@pytest.mark.parametrize("order", [1, 2])
def test_a_dimple_out_through_the_far_side_is_told(order):
    """Oracle: analytic. A point that goes in at z = 1 and ends below z = -1 passed the far side."""
    ball = icosphere(5, order=order)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        made = dimple(ball, UP, 0.8, alpha=250.0)
    assert made.points[:, 2].min() < -1.2
    codes = [str(warning.message)[-5:] for warning in caught]
    assert codes == ["[M11]", "[M08]"]
    assert all(warning.filename == __file__ for warning in caught)
    assert run_through(ball, made) > 0


def test_a_deep_dimple_that_stays_inside_runs_through_nothing():
    """Oracle: analytic. The tip ends above the far side: it is deep, but in itself it is sound."""
    texts = told(icosphere(4), UP, 0.8, alpha=30.0)
    assert not any("M08" in text for text in texts)


def test_what_ran_through_itself_before_is_not_told():
    """Oracle: algebra. Two balls that cross each other far from the dimple, both within reach."""
    ball = icosphere(3)
    shift = np.array([1.0, 0.03, 0.07])
    both = Surface(
        np.concatenate([ball.points, ball.points + shift]),
        np.concatenate([ball.triangles, ball.triangles + len(ball.points)]),
    )
    assert told(both, [-1, 0, 0], 0.7) == []
    near = shoot(both, Projectile([9, 0, 0], [9, 0, 0]), Region([0.5, 0, 0.866], 0.5), alpha=1e-3)
    assert run_through(both, near) == 0


@pytest.mark.parametrize(
    ("where", "numbers", "text"),
    [
        (
            ([0, 0, 1.3], 0.8),
            {},
            r"center: expected on the surface, got 0.3 off it.*\[0.0, 0.0, 1.0",
        ),
        (
            (UP, 1e-3),
            {},
            r"radius: expected several edges of the mesh, got one within which 1 node",
        ),
        ((UP, 10.0), {}, "radius: expected a part of the surface within it, got all 2562 nodes"),
        ((UP, 0.8), {"charge": 0.0}, "alpha, charge: expected a force, got none"),
        ((UP, 0.8), {"steps": 100}, r"expected a depth below the radius, got 1\.56"),
    ],
)
def test_doubtful_numbers_are_told(where, numbers, text):
    """Oracle: data. Each by what is wrong with it, under one code."""
    with pytest.warns(UserWarning, match=text) as caught:
        dimple(icosphere(4, order=1), *where, **numbers)
    assert str(caught[0].message).endswith("[M11]")


def test_a_centre_next_to_the_surface_is_not_told():
    """Oracle: analytic. 0.1 radii off, the force is exp(-0.0816) 0.99^2 = 0.903; 0.12, 0.865."""
    flat = disk(1.2, 24)
    assert told(flat, [0, 0, 0.1], 1.0) == []
    assert "0.12 off it" in told(flat, [0, 0, 0.12], 1.0)[0]


def test_two_doubts_are_one_warning():
    """Oracle: data. Notes keep the first warning of a code: all doubts must stand in it."""
    texts = told(icosphere(4, order=1), [[0, 0, 1.3], -UP], [0.8, 1e-3])
    assert len(texts) == 1
    assert "off it" in texts[0]
    assert "1 node" in texts[0]
