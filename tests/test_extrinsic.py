"""Two surfaces seen from outside: distances, volumes, kinds of change."""

from __future__ import annotations

import json

import numpy as np
import pytest

import isovary as iv
from isovary.extrinsic import (
    HausdorffDistance,
    Kind,
    enclosed_volume,
    extrinsic_summary,
    hausdorff_distance,
    kinds_of_change,
)
from isovary.rigid_motion import RigidMotion

TURN = np.linalg.qr(np.random.default_rng(4).standard_normal((3, 3)))[0]
TURN *= np.linalg.det(TURN)  # no mirror


def moved(surface, factor=1.0, shift=(0, 0, 0), turn=None):
    turn = np.eye(3) if turn is None else turn
    return iv.Surface(factor * surface.points @ turn.T + np.array(shift), surface.triangles)


# ------------------------------------------------------------------ Hausdorff distance


def vtk_hausdorff(first, second):
    """Both one-sided distances, from points to cells, by VTK's own filter."""
    import pyvista
    from vtkmodules.vtkFiltersModeling import vtkHausdorffDistancePointSetFilter

    measure = vtkHausdorffDistancePointSetFilter()
    for port, surface in enumerate((first, second)):
        mesh = pyvista.PolyData.from_regular_faces(surface.points, surface.triangles)
        measure.SetInputData(port, mesh)
    measure.SetTargetDistanceMethodToPointToCell()
    measure.Update()
    return tuple(measure.GetRelativeDistance())


@pytest.mark.parametrize(
    ("base", "perturbed"),
    [
        (iv.icosphere(3, order=1), moved(iv.icosphere(2, order=1), 1.1, turn=TURN)),
        (iv.torus(1.0, 0.4, (9, 30), order=1), moved(iv.icosphere(2, order=1), 0.8, (0.3, 0, 0))),
        (iv.sheet(1.0, 1.0, (3, 4), order=1), iv.sheet(2.0, 1.0, (7, 5), bend=1.5, order=1)),
    ],
    ids=["spheres", "torus and sphere", "flat and rolled sheet"],
)
def test_hausdorff_distance_against_vtk(base, perturbed):
    """Oracle: peer. vtkHausdorffDistancePointSetFilter, from points to cells."""
    found = hausdorff_distance(base, perturbed)
    expected = vtk_hausdorff(base, perturbed)
    np.testing.assert_allclose(
        (found.from_base, found.from_perturbed), expected, rtol=1e-12, atol=1e-12
    )
    assert found.largest == max(found.from_base, found.from_perturbed)


@pytest.mark.parametrize("order", [1, 2])
def test_hausdorff_distance_of_spheres(order):
    """Oracle: analytic. Radius 1 in one of 1.3 that is shifted by 0.1: 0.4 one way and the other.

    Nodes lie on the spheres; the triangles between them leave the smaller one by less than
    their edges squared over 8 (flat), a hundredth of that (curved).
    """
    base, other = (
        iv.icosphere(3, order=order),
        moved(iv.icosphere(3, order=order), 1.3, (0, 0, 0.1)),
    )
    found = hausdorff_distance(base, other)
    sag = 1.3 * 0.16**2 / (6 if order == 1 else 600)
    assert 0.4 - sag < found.from_base < 0.4 + 1e-12
    assert 0.4 - 1e-12 < found.from_perturbed < 0.4 + sag


def test_hausdorff_distance_has_two_sides():
    """Oracle: analytic. A sphere in two: 0 one way, 4 - 1 - 0.5 and the far side's 1 back."""
    base = iv.icosphere(2)
    island = moved(base, 0.5, (4, 0, 0))
    both = iv.Surface(
        np.concatenate([base.points, island.points]),
        np.concatenate([base.triangles, island.triangles + len(base.points)]),
    )
    found = hausdorff_distance(base, both)
    assert found.from_base < 1e-15
    np.testing.assert_allclose(found.from_perturbed, 3.5, rtol=2e-3)
    assert found.largest == found.from_perturbed
    assert hausdorff_distance(both, base) == HausdorffDistance(
        found.from_perturbed, found.from_base
    )


# ------------------------------------------------------------------ volume


@pytest.mark.parametrize(("order", "rate"), [(1, 2), (2, 4)])
def test_volume_of_a_sphere_converges(order, rate):
    """Oracle: order. 4 pi / 3 with the order 2 of chords, 4 of parabolas; edges halve."""
    errors = [
        abs(enclosed_volume(iv.icosphere(k, order=order)) / (4 / 3 * np.pi) - 1) for k in (2, 3, 4)
    ]
    np.testing.assert_allclose(np.log2(errors[:-1]) - np.log2(errors[1:]), rate, atol=0.2)
    assert errors[-1] < (3e-3 if order == 1 else 3e-6)


def test_volume_of_curved_elements_is_exact():
    """Oracle: algebra. A quadratic map of a six-node box: its volume by polynomial integration.

    (x, y, z) -> (x + a y^2, y, z + b x y) has the Jacobian 1: the unit cube's volume stays.
    """
    corners = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)], dtype=float)
    from scipy.spatial import ConvexHull

    hull = ConvexHull(corners)
    triangles = hull.simplices.copy()
    a, b, c = (corners[triangles[:, k]] for k in range(3))
    inward = (np.cross(b - a, c - a) * hull.equations[:, :3]).sum(axis=1) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    cube = iv.Surface(corners, triangles)
    assert enclosed_volume(cube) == pytest.approx(1.0, rel=1e-14)
    x, y, z = cube.quadratic().points.T
    bent = np.stack([x + 0.3 * y**2, y, z - 0.7 * x * y], axis=1)
    assert enclosed_volume(iv.Surface(bent, cube.quadratic().triangles)) == pytest.approx(
        1.0, rel=1e-13
    )


def test_volume_of_moved_turned_and_nested_surfaces():
    """Oracle: symmetry. Far away the same; inside out its negative; a cavity is taken off."""
    sphere = iv.icosphere(2)
    volume = enclosed_volume(sphere)
    # a millionth of a millionth of the shift is what its coordinates leave out
    assert enclosed_volume(moved(sphere, 2.0, (1e6, 2e6, 0), TURN)) == pytest.approx(
        8 * volume, rel=1e-9
    )
    order = [0, 2, 1, 5, 4, 3]
    inside_out = iv.Surface(sphere.points, sphere.triangles[:, order])
    assert enclosed_volume(inside_out) == pytest.approx(-volume, rel=1e-13)
    shell = iv.Surface(
        np.concatenate([2 * sphere.points, sphere.points]),
        np.concatenate([sphere.triangles, sphere.triangles[:, order] + len(sphere.points)]),
    )
    assert enclosed_volume(shell) == pytest.approx(7 * volume, rel=1e-13)


def test_an_open_surface_encloses_nothing():
    """Oracle: algebra. A hemisphere, and a sphere without one triangle: NaN, never a number."""
    sphere = iv.icosphere(1, order=1)
    assert np.isnan(enclosed_volume(iv.hemisphere(4)))
    assert np.isnan(enclosed_volume(iv.Surface(sphere.points, sphere.triangles[1:])))
    flipped = sphere.triangles.copy()
    flipped[0] = flipped[0, ::-1]
    assert np.isnan(enclosed_volume(iv.Surface(sphere.points, flipped)))


# ------------------------------------------------------------------ kinds of change


def kind(moved=0.0, deformed=0.0, strain=0.0, floor=0.0, significant=False, found=True, **options):
    numbers = [np.array([float(v)]) for v in (moved, deformed, strain, floor)]
    masks = [np.array([v]) for v in (significant, found)]
    return Kind(kinds_of_change(*numbers, *masks, **{"size": 2.0, **options})[0])


def test_each_kind_of_change():
    """Oracle: analytic. By hand, for a size of 2: lengths count from 0.02, strains from 0.01."""
    assert kind() is Kind.UNCHANGED
    assert kind(moved=0.02, deformed=0.02, strain=0.01) is Kind.UNCHANGED  # not above
    assert kind(moved=0.021) is Kind.MOVED
    assert kind(moved=0.021, deformed=0.021) is Kind.BENT
    assert kind(deformed=0.021) is Kind.BENT
    assert kind(moved=0.021, deformed=0.021, strain=0.011) is Kind.STRETCHED
    assert kind(strain=0.011) is Kind.STRETCHED
    assert kind(significant=True) is Kind.NEW_SHAPE
    assert kind(1.0, 1.0, 1.0, 0.0, True) is Kind.NEW_SHAPE
    assert kind(1.0, 1.0, 1.0, 0.0, True, False) is Kind.UNKNOWN
    assert kind(found=False) is Kind.UNKNOWN


def test_the_noise_of_the_strain_and_the_thresholds():
    """Oracle: analytic. Twice the floor, if that is above 1 %; thresholds of one's own."""
    assert kind(strain=0.1, floor=0.05) is Kind.UNCHANGED
    assert kind(strain=0.101, floor=0.05) is Kind.STRETCHED
    assert kind(strain=0.011, floor=0.001) is Kind.STRETCHED
    assert kind(strain=0.011, least_strain=0.02) is Kind.UNCHANGED
    assert kind(moved=0.021, least_move=0.02) is Kind.UNCHANGED
    assert kind(deformed=0.021, size=3.0) is Kind.UNCHANGED


def test_unknown_numbers_make_unknown_kinds():
    """Oracle: algebra. A NaN that a rule needs is -1, unless a rule before it holds."""
    nan = np.nan
    for name in ("moved", "deformed", "strain", "floor"):
        assert kind(**{name: nan}) is Kind.UNKNOWN
        assert kind(**{name: nan}, significant=True) is Kind.NEW_SHAPE
    assert kind(moved=nan, deformed=1.0) is Kind.BENT
    assert kind(deformed=nan, moved=1.0) is Kind.UNKNOWN
    assert kind(deformed=nan, strain=1.0) is Kind.STRETCHED
    assert kind(strain=nan, moved=1.0, deformed=1.0) is Kind.UNKNOWN


def test_kinds_of_many_nodes_and_their_words():
    """Oracle: analytic. One node of each kind, in the order of the codes, and what it is called."""
    yes, no = True, False
    codes = kinds_of_change(
        np.array([0, 0, 1, 1, 1, 1.0]),
        np.array([0, 0, 0, 1, 1, 1.0]),
        np.array([0, 0, 0, 0, 1, 1.0]),
        np.zeros(6),
        np.array([no, no, no, no, no, yes]),
        np.array([no, yes, yes, yes, yes, yes]),
        size=1.0,
    )
    assert codes.dtype == np.int64
    assert codes.tolist() == [-1, 0, 1, 2, 3, 4]
    words = ["unknown", "unchanged", "moved rigidly", "bent", "stretched", "new shape"]
    assert [Kind(c).words for c in codes] == words


def test_kinds_refuse_what_does_not_fit():
    """Oracle: algebra. A03 for shapes and masks that are none, A02 for sizes and thresholds."""
    zero, mask = np.zeros(3), np.zeros(3, dtype=bool)
    for arrays in (
        (zero, zero, zero, zero[:2], mask, mask),
        (zero[:, None],) * 4 + (mask[:, None],) * 2,
        (zero, zero, zero, zero, mask, zero),
    ):
        with pytest.raises(iv.ArgumentError, match="A03"):
            kinds_of_change(*arrays, size=1.0)
    for options in ({"size": 0.0}, {"size": np.inf}, {"size": 1.0, "least_move": -1.0}):
        with pytest.raises(iv.ArgumentError, match="A02"):
            kinds_of_change(zero, zero, zero, zero, mask, mask, **options)


# ------------------------------------------------------------------ summary


def test_summary_of_a_grown_and_moved_sphere():
    """Oracle: analytic. Radius 1 to 1.2, shifted by 0.5: areas, volumes, distances."""
    base = iv.icosphere(3)
    motion = RigidMotion(TURN, [0.5, 0.0, 0.0])
    grown = moved(base, 1.2)
    other = motion.surface(grown)
    match = iv.normal_rays(base, other)
    said = extrinsic_summary(base, other, match, motion=motion.inverse)
    assert said["perturbed_area"] / said["base_area"] == pytest.approx(1.44, rel=1e-12)
    assert said["perturbed_volume"] / said["base_volume"] == pytest.approx(1.728, rel=1e-12)
    assert said["hausdorff_distance"] == pytest.approx(0.7, abs=2e-3)  # nodes 0.08 apart
    assert said["hausdorff_distance_aligned"] == pytest.approx(0.2, abs=1e-5)
    assert said["hausdorff_distance"] == max(
        said["hausdorff_from_base"], said["hausdorff_from_perturbed"]
    )
    # along the ray at the angle u to the shift: 0.5 u + sqrt(1.44 - 0.25 (1 - u^2)) - 1
    u = np.linspace(-1, 1, 2001)
    mean = np.mean(0.5 * u + np.sqrt(1.44 - 0.25 * (1 - u**2)) - 1)
    assert said["normal_displacement_mean"] == pytest.approx(mean, abs=1e-3)
    assert said["normal_displacement_largest_size"] == pytest.approx(0.7, abs=2e-3)
    assert said["normal_displacement_mean_size"] > said["normal_displacement_mean"]


def test_summary_of_open_surfaces_without_partners():
    """Oracle: algebra. Volumes, alignment and displacements are unknown: None, never 0."""
    base = iv.sheet(1.0, 1.0, (4, 4))
    other = moved(base, 1.0, (0, 0, 0.5))
    match = iv.normal_rays(base, other, reach=0.1)
    said = extrinsic_summary(base, other, match)
    assert json.loads(json.dumps(said, allow_nan=False)) == said
    unknown = {name for name, value in said.items() if value is None}
    assert unknown == {
        "base_volume",
        "perturbed_volume",
        "hausdorff_distance_aligned",
        "normal_displacement_mean",
        "normal_displacement_mean_size",
        "normal_displacement_largest_size",
    }
    assert said["hausdorff_distance"] == pytest.approx(0.5, rel=1e-12)
