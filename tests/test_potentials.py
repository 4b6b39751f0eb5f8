"""The Born-Mayer potential: spheres, saddles and boxes whose answers are known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

import isovary as iv
from isovary.potentials import born_mayer
from isovary.topology_change import topology_change

THREE = np.array([(0.0, 0.0, 0.0), (1.7, 0.0, 0.0), (0.85, 1.45, 0.0)])
REACH, NEAR = 0.3, 0.85  # their decay length, and the isosurface's distance from them
LEVEL = float(np.exp(-NEAR / REACH))
SLAB = (-0.9, -0.6, -0.5), (2.6, 2.05, 0.5)
CUBE = (-2.0, -2.0, -2.0), (2.0, 2.0, 2.0)
OFF = np.array([0.013, 0.021, -0.017])  # no saddle lies on a sample


def near(points):
    """Nearly the distance to the nearest of the three atoms, by logarithms of sums."""
    away = np.linalg.norm(points[..., None, :] - THREE, axis=-1)
    return -REACH * np.logaddexp.reduce(-away / REACH, axis=-1)


def potential(**options):
    """Two unequal atoms in a cube, unless told otherwise."""
    given = {"atoms": [(-0.7, 0.1, 0.0), (0.7, 0.2, 0.3)], "strength": [2.0, 0.7]}
    return born_mayer(**given | {"decay": [2.5, 3.5], "bounds": CUBE, "shape": (33,) * 3} | options)


def scattered(rng, count):
    """Places, strengths and decays of atoms, all different."""
    places = rng.uniform(-1, 1, size=(count, 3)) * [2.0, 1.0, 0.3]
    return places, rng.uniform(0.5, 4, count), rng.uniform(1.5, 3, count)


# ------------------------------------------------------------------ values


def test_samples_are_the_sum_over_the_atoms():
    """Oracle: algebra. Distances 5, 12 and 13 by Pythagoras, and 0 at an atom."""
    field = born_mayer(
        [(0, 0, 0), (3, 4, 12)],
        strength=[3.0, 7.0],
        decay=[0.2, 0.1],
        bounds=((-3, -4, -12), (3, 4, 12)),
        shape=(5, 5, 7),
    )
    assert field.values[4, 4, 3] == pytest.approx(3 * np.exp(-1.0) + 7 * np.exp(-1.2), rel=1e-14)
    assert field.values[4, 4, 6] == pytest.approx(3 * np.exp(-2.6) + 7, rel=1e-14)
    assert field.values[2, 2, 3] == pytest.approx(3 + 7 * np.exp(-1.3), rel=1e-14)
    np.testing.assert_allclose(field.spacing, [1.5, 2, 4], rtol=1e-15)
    np.testing.assert_array_equal(field.origin, [-3, -4, -12])
    assert field.logarithmic
    assert field.name == "Born-Mayer potential"


def test_atoms_add_up():
    """Oracle: algebra. The sum of the atoms' own potentials; linear in the strengths."""
    both = potential()
    atoms = [(-0.7, 0.1, 0.0), (0.7, 0.2, 0.3)]
    first = potential(atoms=atoms[:1], strength=2.0, decay=2.5)
    second = potential(atoms=atoms[1:], strength=[0.7], decay=[3.5])
    np.testing.assert_allclose(both.values, first.values + second.values, rtol=1e-14)
    turned = potential(atoms=atoms[::-1], strength=[0.7, 2.0], decay=[3.5, 2.5])
    np.testing.assert_allclose(turned.values, both.values, rtol=1e-14)
    np.testing.assert_allclose(potential(strength=[6.0, 2.1]).values, 3 * both.values, rtol=1e-14)


def test_one_number_serves_all_atoms():
    """Oracle: algebra. The same as the number once per atom."""
    each = potential(strength=[0.9, 0.9], decay=[3.0, 3.0])
    np.testing.assert_array_equal(potential(strength=0.9, decay=3).values, each.values)


def test_other_units_change_nothing():
    """Oracle: algebra. Lengths times s, decays by s: the same samples, the box s times larger."""
    places, strengths, decays = scattered(np.random.default_rng(4409), 4)
    small = born_mayer(places, strength=strengths, decay=decays, shape=(20, 19, 18))
    large = born_mayer(10 * places, strength=strengths, decay=decays / 10, shape=(20, 19, 18))
    np.testing.assert_allclose(large.values, small.values, rtol=1e-12)
    np.testing.assert_allclose(large.bounds, 10 * np.array(small.bounds), rtol=1e-12)


# ------------------------------------------------------------------ isosurfaces


def test_one_atoms_isosurface_is_a_sphere():
    """Oracle: analytic, order. Radius ln(A / v) / B. The cubic spline errs by h^4 / 384 times the
    fourth derivative along each axis, of the distance at most -3 / r^3, and by 6 / r^3 for two
    axes across: by h^4 / (64 r^3).
    """
    isovalue, radius = 2 * float(np.exp(-4)), 4 / 3
    cells, errors = np.array([24, 36, 54]), []
    for count in cells:
        box, shape = (OFF - 1.6, OFF + 1.6), (count + 1,) * 3
        field = born_mayer([OFF + 0.03], strength=2.0, decay=3.0, bounds=box, shape=shape)
        sphere = iv.marching_cubes(field, isovalue, vertices=300)
        assert iv.topology(sphere.triangles) == iv.Topology(1, 0, 2, 0)
        found = np.linalg.norm(sphere.points - OFF - 0.03, axis=1)
        errors.append(np.abs(found - radius).max())
    bounds = (3.2 / cells) ** 4 / (64 * radius**3)
    assert (errors < 1.05 * bounds).all(), errors / bounds
    assert np.polyfit(np.log(cells), np.log(errors), 1)[0] < -3.7, errors


def test_two_equal_atoms_merge():
    """Oracle: analytic. At v = 2 A exp(-B d / 2), midway.

    Of log V the fourth derivatives at the saddle are -2 B^4 along and -3 B / (d / 2)^3 across:
    the spline errs by at most h^4 / 384 times their sum.
    """
    strength, decay, distance = 1.3, 2.0, 1.6
    exact = 2 * strength * np.exp(-decay * distance / 2)
    ends = OFF + np.array([(-distance / 2, 0, 0), (distance / 2, 0, 0)])
    box = (-2.4, -1.6, -1.6), (2.4, 1.6, 1.6)
    pair = born_mayer(ends, strength=strength, decay=decay, bounds=box, shape=(61, 41, 41))
    one, two = (iv.topology(iv.contour(pair, part * exact).triangles) for part in (0.99, 1.01))
    assert (one, two) == (iv.Topology(1, 0, 2, 0), iv.Topology(2, 0, 4, 0))
    found = topology_change(lambda isovalue: (pair, isovalue), 0.8 * exact, 1.25 * exact)
    bends = 2 * decay**4 + 2 * 3 * decay / (distance / 2) ** 3
    assert found.parameter == pytest.approx(exact, rel=0.08**4 / 384 * bends)
    np.testing.assert_allclose(found.place, OFF, atol=1e-3)


def test_a_box_cuts_the_isosurface_open():
    """Oracle: peer. Around three equal atoms the box holds four parts of the outside, by SciPy's
    labels of the formula on a fine grid; to each belongs a disk of the isosurface, its rim on the
    box. Euler number 4.
    """
    axes = [np.linspace(low, high, 90) for low, high in zip(*SLAB, strict=True)]
    outside = near(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)) > NEAR
    assert ndimage.label(outside)[1] == 4
    assert ndimage.label(~outside)[1] == 1
    field = born_mayer(THREE, strength=1.0, decay=1 / REACH, bounds=SLAB, shape=(71, 54, 21))
    surface = iv.marching_cubes(field, LEVEL, vertices=400)
    found = iv.topology(surface.triangles)
    assert (found.components, found.boundary_loops, found.euler) == (4, 4, 4)
    rim = surface.points[iv.rim_nodes(surface.triangles)]
    off = np.minimum(np.abs(rim - SLAB[0]), np.abs(rim - SLAB[1])).min(axis=1)
    assert off.max() < 1e-10
    bend = 2 / REACH**3  # of ln cosh, midway between atoms, the largest
    assert np.abs(near(surface.points) - NEAR).max() < 0.05**4 / 384 * 2 * bend


def test_a_moved_molecule_moves_its_potential():
    """Oracle: symmetry. Turned, mirrored and sampled anew: the same at the moved places, as far as
    the spline knows; a quarter turn of a cube turns the samples themselves.
    """
    turn = np.linalg.qr(np.random.default_rng(913).normal(size=(3, 3)))[0]
    motion = iv.RigidMotion(turn, [3.0, -2.0, 0.4])
    here = born_mayer(THREE, strength=[1.0, 1.3, 0.75], decay=1 / REACH)
    there = born_mayer(motion.apply(THREE), strength=[1.0, 1.3, 0.75], decay=1 / REACH)
    points = iv.contour(here, LEVEL).points
    known = here.value(points)
    midway = 2 / REACH**4 * 0.075**4 / 384  # error of log V between atoms, where it bends most
    np.testing.assert_allclose(there.value(motion.apply(points)), known, rtol=2 * midway)
    atoms = np.array([(-0.7, 0.1, 0.0), (0.7, 0.2, 0.3)])
    quarter = potential(atoms=atoms @ [[0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    np.testing.assert_allclose(quarter.values, np.rot90(potential().values), rtol=1e-13)


def test_the_cusp_is_blunt():
    """Oracle: analytic. The tip is cut off, by less than the distance to the nearest sample, which
    is right; ten cells away the spline of the distance errs by h^4 / (64 r^3), as if all were
    smooth.
    """
    spacing, rng = 0.1, np.random.default_rng(38)
    ways = rng.normal(size=(300, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    for place in rng.uniform(-0.05, 0.05, size=(3, 3)):
        field = born_mayer([place], strength=2.0, decay=3.0, bounds=CUBE, shape=(41,) * 3)
        tip = -np.log(field.value(place) / 2) / 3
        assert 0 < tip < np.linalg.norm(place)
        away = -np.log(field.value(place + 10 * spacing * ways) / 2) / 3
        assert np.abs(away - 1).max() < 1.2 * spacing**4 / 64  # r = 1


# ------------------------------------------------------------------ the box and its samples


def test_the_default_box():
    """Oracle: algebra. Balls around two atoms, (ln(2 A / v) + 1) / B: at v = 4 exp(-2) of radius
    3 - ln 2 and (3 + ln 1.5) / 2, without an isovalue 6 - ln 2 and (6 + ln 1.5) / 2; samples at
    most 1 / (4 max B) = 1/8 apart.
    """
    atoms = [(0.0, 0.0, 0.0), (1.0, -2.0, 0.2)]
    given = born_mayer(atoms, strength=[1, 3], decay=[1, 2], isovalue=4 * float(np.exp(-2)))
    one, two = 3 - np.log(2), (3 + np.log(1.5)) / 2
    box = [(-one, -2 - two, -one), (1 + two, one, one)]
    np.testing.assert_allclose(given.bounds, box, rtol=1e-12)
    cells = np.ceil(8 * np.subtract(box[1], box[0]))
    assert given.values.shape == tuple(cells.astype(int) + 1)
    bare = born_mayer(atoms, strength=[1, 3], decay=[1, 2], shape=(9, 10, 11))
    far = 6 - np.log(2)
    np.testing.assert_allclose(bare.bounds, [(-far,) * 3, (far,) * 3], rtol=1e-12)
    assert bare.values.shape == (9, 10, 11)


@pytest.mark.parametrize("count", [1, 2, 7])
def test_the_default_box_holds_the_isosurface(count):
    """Oracle: analytic. On the faces V is at most the isovalue / e: the isosurface is closed."""
    rng = np.random.default_rng([611, count])
    places, strengths, decays = scattered(rng, count)
    for part in (0.3, 0.02):
        isovalue = part * float(strengths.sum())
        shape = 40, 30, 28
        field = born_mayer(places, strength=strengths, decay=decays, isovalue=isovalue, shape=shape)
        faces = [np.take(field.values, end, axis=axis) for axis in range(3) for end in (0, -1)]
        highest = max(face.max() for face in faces)
        assert highest < isovalue / np.e * (1 + 1e-12)
        if count == 1:
            assert highest > 0.95 * isovalue / np.e  # no larger than need be


# ------------------------------------------------------------------ arguments


@pytest.mark.parametrize(
    ("options", "code", "text"),
    [
        ({"atoms": [0.0, 0.0, 0.0]}, "A03", "atoms"),
        ({"atoms": np.zeros((2, 2))}, "A03", "atoms"),
        ({"atoms": np.zeros((0, 3))}, "A03", "atoms.*at least one"),
        ({"atoms": [(0, 0, 0), (0, np.nan, 0)]}, "A02", r"atoms.*\[1\]"),
        ({"atoms": [(np.inf, 0, 0), (0, 0, 0)]}, "A02", r"atoms.*\[0\]"),
        ({"strength": [1.0, 2.0, 3.0]}, "A03", "strength: expected one number or 2"),
        ({"strength": [1.0]}, "A03", "strength"),
        ({"strength": [1.0, 0.0]}, "A02", "strength.*leave out"),
        ({"strength": -1.0}, "A02", "strength"),
        ({"strength": np.inf}, "A02", "strength"),
        ({"decay": [[1.0, 2.0]]}, "A03", "decay"),
        ({"decay": 0.0}, "A02", "decay"),
        ({"decay": [1.0, -2.0]}, "A02", "decay"),
        ({"decay": np.nan}, "A02", "decay"),
        ({"isovalue": 0.1}, "A02", "isovalue: expected None beside bounds"),
        ({"isovalue": 2.7, "bounds": None}, "A02", "isovalue: expected between 0 and 2.7"),
        ({"isovalue": 0.0, "bounds": None}, "A02", "isovalue"),
        ({"isovalue": np.nan, "bounds": None}, "A02", "isovalue"),
        ({"bounds": ((0, 0), (1, 1))}, "A03", "bounds"),
        ({"bounds": ((0, 0, 0), (1, 1, 0))}, "A02", "bounds"),
        ({"bounds": ((0, 0, 0), (1, 1, np.inf))}, "A02", "bounds"),
        ({"bounds": ((1, 1, 1), (0, 0, 0))}, "A02", "bounds: expected low below high.*swap"),
        ({"bounds": ((0, 0, 0), (1, 1, np.nan))}, "A02", "bounds: expected finite"),
        ({"isovalue": -1.0, "bounds": None}, "A02", "isovalue.*positive everywhere"),
        ({"isovalue": 9.0, "bounds": None}, "A02", "isovalue.*nowhere above"),
        ({"atoms": "abc"}, "A03", "atoms: expected numbers, got 'abc'"),
        ({"strength": "abc"}, "A03", "strength: expected numbers"),
        ({"bounds": ((0, 0), (1, 1, 1))}, "A03", "bounds: expected numbers"),
        ({"bounds": ((300, 0, 0), (301, 1, 1))}, "A02", "bounds.*underflows"),
        ({"shape": (9, 9)}, "A03", "shape"),
        ({"shape": (9, 9, 3)}, "A03", "shape"),
        ({"shape": (9, 9, 9.0)}, "A03", "shape"),
        ({"atoms": [(0, 0, 0), (90, 90, 0)], "bounds": None, "shape": None}, "A02", "shape.* x "),
    ],
)
def test_wrong_arguments_are_refused(options, code, text):
    """Oracle: algebra. Each is told by name, with its code."""
    with pytest.raises(iv.ArgumentError, match=f"^{text}") as caught:
        potential(**options)
    assert caught.value.code == code


def test_what_is_just_right_is_taken():
    """Oracle: algebra. Four samples, atoms at one place, atoms outside the box."""
    assert potential(shape=(4, 4, 4)).values.shape == (4, 4, 4)
    assert potential(shape=np.array([4, 5, 6])).values.shape == (4, 5, 6)
    twice = potential(atoms=np.zeros((2, 3)), strength=1.0, decay=2.0)
    once = potential(atoms=np.zeros((1, 3)), strength=2.0, decay=2.0)
    np.testing.assert_allclose(twice.values, once.values, rtol=1e-15)
    far = potential(atoms=[(5.0, 0, 0), (0, 7.0, 0)], strength=1.0, decay=1.0)
    assert far.values[32, 16, 16] == pytest.approx(np.exp(-3.0) + np.exp(-(53**0.5)), rel=1e-14)


def test_arguments_stay_as_they_are():
    """Oracle: algebra. Nothing is written to what was given, nor does the field hold on to it."""
    given = {
        "atoms": np.array([(-0.7, 0.1, 0.0), (0.7, 0.2, 0.3)]),
        "strength": np.array([2.0, 0.7]),
        "decay": np.array([2.5, 3.5]),
        "bounds": np.array(CUBE),
        "shape": np.array([9, 9, 9]),
    }
    before = {name: value.copy() for name, value in given.items()}
    field = born_mayer(**given)
    for name, value in given.items():
        np.testing.assert_array_equal(value, before[name])
    kept = field.values.copy()
    for value in given.values():
        value[...] = 5
    np.testing.assert_array_equal(field.values, kept)
    np.testing.assert_array_equal(field.origin, CUBE[0])
