"""Where the topology changes: critical parameters and places known in closed form."""

from __future__ import annotations

import numpy as np
import pytest

import isovary as iv
from isovary.families import blended, sweep_family
from isovary.potentials import born_mayer
from isovary.topology_change import _to_critical, topology_change

NOTHING = iv.Topology(0, 0, 0, 0)
SPHERE = iv.Topology(1, 0, 2, 0)
TWO = iv.Topology(2, 0, 4, 0)
TORUS = iv.Topology(1, 0, 0, 1)
OFF = np.array([0.013, 0.021, -0.017])  # no critical point lies on a sample


def field(function, high, shape, *, low=None):
    low = -np.asarray(high) if low is None else low
    return iv.ScalarField.from_function(function, (low, high), shape)


def atoms(distance, strength=1.0):
    """Two Born-Mayer atoms, strength exp(-r) each, with a saddle midway at OFF."""
    centers = [OFF + np.array([side * distance / 2, 0, 0]) for side in (-1, 1)]
    box = (-2.5, -1.7, -1.7), (2.5, 1.7, 1.7)
    return born_mayer(centers, strength=strength, decay=1.0, bounds=box, shape=(52, 36, 34))


def squares(center, box, shape):
    """-|x - center|^2: a quadratic, which the spline holds exactly."""
    return field(lambda p: -((p - np.array(center)) ** 2).sum(axis=-1), box[1], shape, low=box[0])


def bump(height):
    """A Gaussian of width 1 at OFF."""
    return field(
        lambda p: height * np.exp(-((p - OFF) ** 2).sum(axis=-1) / 2), (1.5,) * 3, (21,) * 3
    )


def test_two_atoms_part_as_the_isovalue_rises():
    """Oracle: analytic. At the saddle the density is 2 exp(-d / 2).

    The spline's error of log F, h^4 F'''' / 384 with F'''' = 2 for log cosh x at 0, is below
    5e-7 at h = 0.1.
    """
    pair = atoms(2.0)
    exact = 2 * np.exp(-1.0)
    found = topology_change(lambda isovalue: (pair, isovalue), 0.8 * exact, 1.25 * exact)
    assert found.parameter == pytest.approx(exact, rel=1e-6)
    assert (found.before, found.after) == (SPHERE, TWO)
    assert found.kind == "components join or part"
    assert found.refined
    np.testing.assert_allclose(found.place, OFF, atol=1e-4)


def test_two_atoms_part_as_they_move_away():
    """Oracle: analytic. At the isovalue v they part at the distance 2 ln(2 / v)."""
    isovalue = 2 * np.exp(-1.0)
    stages = []
    found = topology_change(
        lambda distance: (atoms(distance), isovalue),
        1.6,
        2.3,
        progress=lambda stage, done: stages.append(done),
    )
    assert found.parameter == pytest.approx(2.0, rel=1e-6)
    assert (found.before, found.after) == (SPHERE, TWO)
    assert found.kind == "components join or part"
    assert stages == sorted(stages)
    assert stages[-1] == 1
    low, high = found.bracket
    assert high - low == pytest.approx(0.7 / 1024)


def test_the_error_is_that_of_the_spline():
    """Oracle: order. The saddle's density is right to h^4, midway between samples."""
    errors = []
    for count in (12, 24, 48):
        scalar = field(
            lambda p: np.cosh(p[..., 0]) * np.exp(-(p[..., 1:] ** 2).sum(axis=-1)),
            (1.0, 1.6, 1.6),
            (count, 2 * count, 2 * count),
        )
        found = topology_change(lambda isovalue, f=scalar: (f, isovalue), 0.8, 1.2)
        assert found.kind == "components join or part"
        errors.append(abs(found.parameter - 1))
    assert (np.log2(np.divide(errors[:-1], errors[1:])) > 3.3).all(), errors
    assert errors[-1] < 1e-5


def test_a_hole_closes():
    """Oracle: analytic. (r^2 + z^2 + 1)^2 - 4 r^2, Cassini's ring, is 1 at its centre, a saddle."""

    def ring(p):
        x, y, z = np.moveaxis(p - OFF, -1, 0)
        return (x**2 + y**2 + z**2 + 1) ** 2 - 4 * (x**2 + y**2)

    scalar = field(ring, (1.7, 1.7, 1.0), (40, 40, 30))
    found = topology_change(lambda isovalue: (scalar, isovalue), 0.6, 1.3)
    assert (found.before, found.after) == (TORUS, SPHERE)
    assert found.kind == "a handle opens or closes"
    assert found.parameter == pytest.approx(1, abs=2e-5)  # 3 h^4 24 / 384, h = 0.087: 1e-5
    np.testing.assert_allclose(found.place, OFF, atol=1e-3)


def test_an_island_is_born_beside_another():
    """Oracle: analytic. A Gaussian's peak reaches the isovalue 1, less the other one's tail."""
    place = np.array([1.31, 0.04, -0.03])
    tail = 1.7 * np.exp(-(((2 * place) ** 2).sum()))

    def two(height):
        def bumps(p):
            first, second = (np.exp(-((p - s * place) ** 2).sum(axis=-1)) for s in (-1, 1))
            return 1.7 * first + height * second

        return field(bumps, (2.6, 1.5, 1.5), (44, 25, 25))

    found = topology_change(lambda height: (two(height), 1.0), 0.6, 1.4)
    assert (found.before, found.after) == (SPHERE, TWO)
    assert found.kind == "a component appears or vanishes"
    assert found.parameter == pytest.approx(1 - tail, abs=1e-4)  # h^4 3 12 / 384, h = 0.125: 2e-5
    np.testing.assert_allclose(found.place, place, atol=0.01)


def test_an_island_is_born_from_nothing():
    """Oracle: analytic. A single peak: below it there is no isosurface at all."""

    found = topology_change(lambda height: (bump(height), 2.0), 1.0, 3.0)
    assert (found.before, found.after) == (NOTHING, SPHERE)
    assert found.kind == "a component appears or vanishes"
    assert found.parameter == pytest.approx(2.0, rel=1e-5)


def test_a_pocket_opens_inside():
    """Oracle: analytic. At the common centre of a solid and its pocket the field is 1 - depth.

    Its second derivative there is 4 depth - 1: a minimum, a pocket's bottom, beyond 1/4.
    """

    def solid(depth):
        def value(p):
            square = ((p - OFF) ** 2).sum(axis=-1)
            return np.exp(-square / 2) - depth * np.exp(-2 * square)

        return field(value, (2.0,) * 3, (41,) * 3)

    found = topology_change(lambda depth: (solid(depth), 0.4), 0.4, 0.8)
    assert (found.before, found.after) == (SPHERE, TWO)
    assert found.kind == "a component appears or vanishes"
    assert found.parameter == pytest.approx(0.6, abs=1e-4)  # h^4 3 * 12 * 4 * 0.6 / 384: 2e-5
    np.testing.assert_allclose(found.place, OFF, atol=5e-3)


@pytest.mark.parametrize(
    ("low", "high", "exact", "place"),
    [
        (1.8, 2.3, 1.4**2, (0.1, 0.1, -1.3)),
        (3.0, 4.0, 1.4**2 + 1.3**2, (0.1, -1.2, -1.3)),
        (5.0, 7.0, 1.4**2 + 1.3**2 + 1.6**2, (-1.5, -1.2, -1.3)),
    ],
)
def test_a_ball_meets_a_face_an_edge_and_a_corner(low, high, exact, place):
    """Oracle: analytic. A growing ball at distances 1.4 and 1.3 and 1.6 from three faces.

    The other three faces are farther than 2.9 away. Quadratics are exact: so is the result.
    """
    box = ((-1.5, -1.2, -1.3), (3.1, 3.2, 3.0))
    scalar = squares((0.1, 0.1, 0.1), box, (40, 37, 36))
    found = topology_change(lambda square: (scalar, -square), low, high)
    assert found.kind == "the surface meets the box"
    assert found.before.boundary_loops != found.after.boundary_loops
    assert found.parameter == pytest.approx(exact, rel=1e-10)
    np.testing.assert_allclose(found.place, place, atol=1e-9)


def test_a_moving_ball_meets_the_box():
    """Oracle: analytic. A unit ball whose centre comes within 1 of the face x = 2."""
    box = ((-1.5, -1.4, -1.4), (2.0, 1.4, 1.4))
    found = topology_change(lambda x: (squares((x, 0.02, 0.03), box, (30, 24, 24)), -1.0), 0.5, 1.4)
    assert (found.before, found.after) == (SPHERE, iv.Topology(1, 1, 1, 0))
    assert found.kind == "the surface meets the box"
    assert found.parameter == pytest.approx(1, rel=1e-10)
    np.testing.assert_allclose(found.place, (2, 0.02, 0.03), atol=1e-9)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_saddle_between_open_sheets(sign):
    """Oracle: analytic. Two sheets of a hyperboloid join at 0; either side may be the inside."""
    scalar = field(
        lambda p: sign * ((p - OFF) ** 2 @ np.array([1.0, -1.0, -1.0])), (0.7, 1.2, 1.2), (15,) * 3
    )
    found = topology_change(lambda level: (scalar, sign * level), -0.2, 0.3)
    assert found.before == iv.Topology(1, 2, 0, 0)
    assert found.after == iv.Topology(2, 2, 2, 0)
    assert found.kind == "components join or part"
    assert found.parameter == pytest.approx(0, abs=1e-12)
    np.testing.assert_allclose(found.place, OFF, atol=1e-10)


def test_the_critical_point_must_change_what_the_contours_change():
    """Oracle: analytic. An island's peak, 1, lies between samples: its contour vanishes before.

    A saddle elsewhere has just that value, but passing it would part what it joins.
    """
    cell, place, top = 0.1, np.array([1.1, 0.0, 0.0]), np.array([0.05, 2.45, 0.05])
    seen = np.exp(-4 * 3 * (cell / 2) ** 2)  # at the samples around the peak

    def value(p):
        pair = sum(
            np.exp(3 * place[0] ** 2 - 3 * ((p - [0.05, 0, 0] - s * place) ** 2).sum(axis=-1))
            for s in (-1, 1)
        )
        return seen * pair / 2 + np.exp(-4 * ((p - top) ** 2).sum(axis=-1))

    scalar = field(value, (2.8, 3.3, 1.9), (57, 53, 39), low=(-2.8, -1.9, -1.9))
    found = topology_change(lambda isovalue: (scalar, isovalue), 0.9, 1.005)
    assert (found.before.components, found.after.components) == (2, 1)
    assert found.kind == "a component appears or vanishes"
    np.testing.assert_allclose(found.place, top, atol=0.01)
    assert found.parameter == pytest.approx(1, abs=3e-4)  # h^4 3 * 12 * 16 / 384: 1.5e-4


def test_of_two_critical_points_in_one_place_the_right_one_is_found():
    """Oracle: analytic. x^3 - 3 e^2 x - y^2 - z^2 peaks with 2 e^3 at x = -e, a saddle is at x = e.

    Midway between samples along y and z the contours lose the peak 0.005 too early, nearer to
    the saddle's value than to its own. The spline holds cubics exactly.
    """
    e = 0.1

    def value(p):
        x, y, z = np.moveaxis(p - [0, 0.05, 0.05], -1, 0)
        return x**3 - 3 * e**2 * x - y**2 - z**2

    scalar = field(value, (0.8, 1.0, 1.0), (17, 21, 21))
    found = topology_change(lambda isovalue: (scalar, isovalue), -0.005, 0.0025)
    assert (found.before.components, found.after.components) == (2, 1)
    assert found.kind == "a component appears or vanishes"
    assert found.parameter == pytest.approx(2 * e**3, abs=1e-12)
    np.testing.assert_allclose(found.place, (-e, 0.05, 0.05), atol=1e-9)


def test_the_grid_may_change_along_the_family():
    """Oracle: analytic. A peak reaches 2, sampled on one grid below and on another above."""

    def family(height):
        grid = (21,) * 3 if height < 2 else (22,) * 3
        return field(
            lambda p: height * np.exp(-((p - OFF) ** 2).sum(axis=-1) / 2), (1.5,) * 3, grid
        ), 2.0

    found = topology_change(family, 1.5, 2.5)
    assert found.refined
    assert found.parameter == pytest.approx(2, rel=1e-5)


def test_the_critical_point_is_where_the_contours_differ():
    """Oracle: analytic. Of two islands one, with its peak 1 between samples, vanishes first.

    The other's peak lies on a sample and just above the isovalue at which that happens.
    """
    cell, hidden, seen = 0.1, np.array([-0.95, 0.05, 0.05]), np.array([1.0, 0.0, 0.0])
    height = np.exp(-4 * 3 * (cell / 2) ** 2) + 0.005

    def value(p):
        return sum(
            peak * np.exp(-4 * ((p - place) ** 2).sum(axis=-1))
            for peak, place in ((1, hidden), (height, seen))
        )

    scalar = field(value, (2.0, 1.0, 1.0), (41, 21, 21))
    found = topology_change(lambda isovalue: (scalar, isovalue), 0.9, 1.01)
    assert found.before == TWO
    assert found.parameter == pytest.approx(1, abs=3e-4)  # h^4 3 * 12 * 16 / 384: 1.5e-4
    np.testing.assert_allclose(found.place, hidden, atol=0.01)
    short = topology_change(lambda isovalue: (scalar, isovalue), 0.9, height + 0.001)
    assert not short.refined  # the peak, 1, is beyond the range; the other island's is not it


def test_a_jump_is_bracketed_and_said_to_be_no_more():
    """Oracle: analytic. A family that leaps at 0.3 from one ball to two has no critical point."""

    def balls(*places):
        centers = [np.array([x, 0, 0]) for x in places]
        return field(
            lambda p: np.max([1 - 4 * ((p - c) ** 2).sum(axis=-1) for c in centers], axis=0),
            (2.0, 1.0, 1.0),
            (33, 17, 17),
        )

    one, two = balls(-1.0), balls(-1.0, 1.0)
    found = topology_change(lambda s: (one if s < 0.3 else two, 0.0), 0.0, 1.0)
    assert not found.refined
    assert found.bracket[0] < 0.3 <= found.bracket[1]
    assert found.parameter == pytest.approx(np.mean(found.bracket))
    assert np.isnan(found.place).all()
    assert found.kind == "a component appears or vanishes"


def test_a_plane_leaves_the_box():
    """Oracle: analytic. The plane x = v goes out through the face x = 1, all at once."""
    scalar = field(lambda p: p[..., 0], (1.0, 1.0, 1.0), (9, 9, 9))
    found = topology_change(lambda level: (scalar, level), 0.5, 1.5)
    assert (found.before.boundary_loops, found.after) == (1, NOTHING)
    assert found.kind == "the surface meets the box"
    assert (found.parameter, found.place[0]) == pytest.approx((1, 1), rel=1e-12)


def test_a_slope_without_curvature_is_not_critical():
    """Oracle: analytic. grad x = 1 everywhere, so no start arrives; on a face of the box all do."""
    scalar = field(lambda p: p[..., 0], (1.0, 1.0, 1.0), (9, 9, 9))
    starts = np.array([[0.1, 0.2, 0.3], [1.0, 0.2, 0.3]])
    held = np.array([[False, False, False], [True, False, False]])
    points, arrived = _to_critical(scalar, starts, held)
    assert arrived.tolist() == [False, True]
    np.testing.assert_array_equal(points[1], starts[1])


def test_of_several_changes_one_is_found():
    """Oracle: analytic. Two atoms part at 2 exp(-1) and vanish at their peaks, 1 + exp(-2)."""
    pair = atoms(2.0)
    found = topology_change(lambda isovalue: (pair, isovalue), 0.6, 1.05, tolerance=0.01)
    assert found.before == SPHERE
    assert found.parameter == pytest.approx(2 * np.exp(-1.0), rel=1e-6)
    assert found.bracket[1] - found.bracket[0] <= 0.01


def test_no_change_is_an_error():
    """Oracle: analytic. A ball stays a ball: A02 with both topologies; so for a wrong range."""
    scalar = squares((0, 0, 0), ((-1.5,) * 3, (1.5,) * 3), (13,) * 3)

    def family(level):
        return scalar, level

    with pytest.raises(iv.ArgumentError, match="A02") as caught:
        topology_change(family, -1.0, -0.5)
    assert str(caught.value).count("1 component(s), 0 boundary loop(s), genus 0") == 2
    for low, high, tolerance in ((1, -1, None), (0, 0, None), (np.nan, 1, None), (-1, 1, 0.0)):
        with pytest.raises(iv.ArgumentError, match="A02"):
            topology_change(family, low, high, tolerance=tolerance)


def test_a_blend_of_logarithms_is_a_power():
    """Oracle: analytic. Strengths 1 and 4 blend to 4^t: v = 2 4^t exp(-d / 2) at t = 1/4."""
    isovalue = 2 * 4**0.25 * np.exp(-1.0)
    mixed = blended(atoms(2.0), atoms(2.0, strength=4.0))
    found = topology_change(lambda part: (mixed(part), isovalue), 0.0, 0.6)
    assert (found.before, found.after) == (TWO, SPHERE)
    assert found.parameter == pytest.approx(0.25, abs=1e-6)
    half = mixed(0.5)
    assert half.logarithmic
    for part, strength in ((0, 1.0), (1, 4.0)):
        np.testing.assert_array_equal(mixed(part).values, atoms(2.0, strength=strength).values)
    np.testing.assert_allclose(half.values, 2 * atoms(2.0).values, rtol=1e-12)


def test_a_blend_needs_one_grid():
    """Oracle: algebra. Other shapes, places or kinds: A03; parts beyond 0 and 1: A02."""
    box = ((-1,) * 3, (1,) * 3)
    first = squares((0, 0, 0), box, (8, 8, 8))
    others = [
        squares((0, 0, 0), box, (8, 8, 9)),
        squares((0, 0, 0), ((-1,) * 3, (1, 1, 1.1)), (8, 8, 8)),
        iv.ScalarField(np.exp(first.values), first.spacing, first.origin, logarithmic=True),
    ]
    for other in others:
        with pytest.raises(iv.ArgumentError, match="A03"):
            blended(first, other)
    for part in (-0.1, 1.1, np.nan):
        with pytest.raises(iv.ArgumentError, match="A02"):
            blended(first, first)(part)


def test_a_sweep_passes_through_its_members():
    """Oracle: analytic. Heights 1, 1.5 and 3 at parameters 0, 1 and 3: peak 2 is at 5/3."""

    members = [bump(height) for height in (1.0, 1.5, 3.0)]
    family = sweep_family([0, 1, 3], members, 2.0)
    for parameter, member in zip((0, 1, 3), members, strict=True):
        scalar, isovalue = family(parameter)
        np.testing.assert_array_equal(scalar.values, member.values)
        assert isovalue == 2.0
    found = topology_change(family, 0, 3)
    assert found.parameter == pytest.approx(5 / 3, abs=2e-5)  # 2e-5 of the height, slope 3/4
    for parameter in (-0.1, 3.1, np.nan):
        with pytest.raises(iv.ArgumentError, match="A02"):
            family(parameter)
    with pytest.raises(iv.ArgumentError, match="A02"):
        sweep_family([0, 0, 3], members, 2.0)
    for count in (1, 2):
        with pytest.raises(iv.ArgumentError, match="A03"):
            sweep_family([0, 1, 3][:1], members[:count], 2.0)
