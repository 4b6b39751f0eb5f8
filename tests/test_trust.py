"""Can the answer be trusted? Nothing found where nothing is, and nothing matched that is none."""

from __future__ import annotations

import re

import numpy as np
import pytest
from oracles import sphere_signature

import isovary as iv
from isovary.data import water_pair
from isovary.potentials import born_mayer

DECAY_LENGTH, LEVEL = 0.3, float(np.exp(-0.85 / 0.3))
ATOMS = np.array([(0.0, 0.0, 0.0), (1.7, 0.0, 0.0), (0.85, 1.45, 0.0)])
SIZES = np.array([1.0, 1.3, 0.75])  # three unequal atoms: no symmetry but their plane's mirror


def turn(axis, angle):
    """Rotation matrix by Rodrigues' formula."""
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def molecule(motion=None, scale=1.0):
    """The atoms moved and sampled anew, on an upright grid that knows nothing of the motion."""
    atoms = scale * ATOMS if motion is None else motion.apply(scale * ATOMS)
    step = 0.1
    low = np.floor((atoms.min(axis=0) - 1.25) / step) * step + 0.037
    counts = np.ceil((atoms.max(axis=0) + 1.25 - low) / step).astype(int) + 1
    high = low + (counts - 1) * step
    decay = 1 / (DECAY_LENGTH * scale)
    return born_mayer(
        atoms, strength=SIZES, decay=decay, bounds=(low, high), shape=tuple(counts.tolist())
    )


def small(base, perturbed, isovalue=LEVEL, **options):
    return iv.compare(
        base, perturbed, isovalue, **{"vertices": 300, "pairs": 100, "times": 20} | options
    )


def rms(values):
    return np.sqrt(np.nanmean(values**2))


MOTIONS = {
    "shift": iv.RigidMotion(translation=[0.06, 0.11, 0.16]),
    "turn": iv.RigidMotion(turn((1, 2, 3), np.pi / 3)),
    "mirror": iv.RigidMotion(turn((3, -1, 2), 0.7) @ np.diag([-1.0, 1.0, 1.0])),
}


@pytest.mark.parametrize("name", MOTIONS)
def test_a_moved_molecule_has_not_changed(name):
    """Oracle: symmetry. Moved rigidly and sampled anew: no change, no strain; the way is found."""
    motion = MOTIONS[name]
    result = small(molecule(), molecule(motion))
    assert rms(result.change) < 1e-4
    assert not result.significant.any()
    assert result.distortion.strain < 1e-4
    there = result.base.points @ motion.rotation.T + motion.translation
    plane = np.diag([1.0, 1.0, -1.0])  # its own mirror: as good
    likewise = (result.base.points @ plane) @ motion.rotation.T + motion.translation
    moved = result.base.points + result.displacement
    assert min(np.abs(moved - there).max(), np.abs(moved - likewise).max()) < 1e-4


def test_a_scaled_molecule_has_not_changed_but_in_size():
    """Oracle: symmetry, analytic. By 1 %: all lengths by 1.01; at equal area nothing is left."""
    result = small(molecule(), molecule(scale=1.01))
    assert rms(result.unit_area_change) < 1e-4
    assert (iv.change_norm(result.unit_area_change) <= 2 * iv.change_norm(result.noise_floor)).all()
    assert result.significant.all()
    np.testing.assert_allclose(result.distortion.stretches, 1.01, atol=2e-4)


def tube(bend):
    """Distance, negative, to a segment of length 2 or to an arc of that length; 0.05 off."""

    def value(points):
        x, y, z = np.moveaxis(points, -1, 0)
        if bend == 0:
            near = np.stack([np.clip(x, -1, 1), 0 * y, 0 * z], axis=-1)
        else:
            angle = np.clip(np.arctan2(x, 1 / bend - z), -bend, bend)
            near = np.stack([np.sin(angle), 0 * y, 1 - np.cos(angle)], axis=-1) / bend
        return 0.05 - np.linalg.norm(points - near, axis=-1)

    box = ((-1.2, -0.12, -0.12), (1.2, 0.12, 0.24))
    return iv.ScalarField.from_function(value, box, (121, 21, 31))


def test_a_bent_tube_keeps_its_lengths():
    """Oracle: analytic. Bent to radius R the lengths of a thin tube of radius r change by r / R at
    most, 0.83 %; carried along normals it folds, and rays see more than ten times the change.
    """
    straight, bent = tube(0.0), tube(1 / 6)
    base = iv.marching_cubes(straight, 0.0, vertices=400)
    with pytest.raises(iv.CorrespondenceError, match="C05"):
        iv.carry(base, bent, 0.0)
    members = [straight, tube(1 / 18), tube(1 / 9), bent]
    carried, kept = iv.carry_isometrically(base, members, 0.0)
    found = iv.distortion(base, carried.points)
    assert found.strain < 0.05 / 6
    assert found.size.max() < 1.5 * 0.05 / 6
    other = iv.marching_cubes(bent, 0.0, vertices=400)

    def change(surface, match):
        here, there = (iv.eigenpairs(iv.fem(s), 60) for s in (base, surface))
        times = iv.diffusion_times(here, 20)
        after = iv.interpolate(match, surface, iv.heat_kernel_signature(there, times))
        before = iv.heat_kernel_signature(here, times)
        return iv.signature_difference(before, after, iv.heat_trace_scale(here, times))

    assert rms(change(carried, kept)) < rms(change(other, iv.normal_rays(base, other))) / 10


A, B, ISOVALUE = 1.0, 2.0, 0.2
OFF = np.array([0.013, 0.021, -0.017])  # no critical point lies on a sample
CRITICAL = 2 * np.log(2 * A / ISOVALUE) / B  # the density midway is 2 A exp(-B d / 2)


def density(*places, strengths=A, high=(2.6, 1.5, 1.5), shape=(61, 37, 37)):
    """A sum of Born-Mayer atoms, off the samples."""
    box = -np.array(high), high
    return born_mayer(np.array(places) + OFF, strength=strengths, decay=B, bounds=box, shape=shape)


def pair(distance):
    return density((-distance / 2, 0, 0), (distance / 2, 0, 0))


def test_two_atoms_that_join_are_told_with_where():
    """Oracle: analytic. Logarithms of the density midway mix linearly in the distance, so it
    crosses the isovalue at the part (d_c - d_0) / (d_1 - d_0), d_c = 2 ln(2 A / v) / B.
    """
    apart, near = CRITICAL + 0.13, CRITICAL - 0.21
    with pytest.raises(iv.CorrespondenceError, match="C01") as caught:
        small(pair(apart), pair(near), ISOVALUE)
    assert str(caught.value).count("merged") == 2
    note = " ".join(caught.value.__notes__)
    assert "components join or part" in note
    said = re.search(r"at (\S+) on the way .* near \((.*), (.*), (.*)\)", note)
    part, *place = (float(number) for number in said.groups())
    assert part == pytest.approx((CRITICAL - apart) / (near - apart), abs=1e-3)
    np.testing.assert_allclose(place, OFF, atol=1e-3)


@pytest.fixture(scope="module")
def changed_parts():
    """Two atoms that join, an island that comes, and a lone atom that grows by 5 %."""
    box = {"high": (3.2, 2.7, 1.3), "shape": (65, 55, 27)}
    joined, lone, island = CRITICAL / 2 - 0.1, (-1.7, 1.5, 0.0), (1.9, 1.6, 0.0)
    radius = np.log(A / ISOVALUE) / B
    apart = joined + 0.25
    base = density((-apart, -1.4, 0), (apart, -1.4, 0), lone, **box)
    grown = np.exp(0.05 * radius * B)
    after = density(
        (-joined, -1.4, 0),
        (joined, -1.4, 0),
        lone,
        island,
        strengths=[A, A, grown * A, 0.7 * A],
        **box,
    )
    return base, after


def test_what_came_and_joined_is_named(changed_parts):
    """Oracle: analytic. Component by component: two merged, one born; the lone atom is matched."""
    with pytest.raises(iv.CorrespondenceError, match="C01") as caught:
        small(*changed_parts, ISOVALUE)
    said = str(caught.value)
    assert said.count("merged") == 2
    assert said.count("born") == 1
    assert "lost" not in said


def test_only_what_matches_is_compared(changed_parts):
    """Oracle: analytic. The lone atom is a sphere but for its neighbours' tails, grown by 5 %; the
    rows of the others are unknown, and the coverage is its share of the nodes.
    """
    result = small(*changed_parts, ISOVALUE, only_matching=True)
    lone = result.base.points[:, 1] > 0
    assert 0.2 < lone.mean() < 0.5
    np.testing.assert_array_equal(result.correspondence.found, lone)
    assert np.isnan(result.change[~lone]).all()
    np.testing.assert_array_equal(np.isfinite(result.correspondence.distance), lone)
    assert np.isfinite(result.change[lone]).all()
    assert result.coverage == lone.mean()
    assert not result.significant[~lone].any()
    assert (result.clusters.labels[~lone] == -1).all()
    assert (result.kinds[~lone] == iv.Kind.UNKNOWN).all()
    assert 0.2 < result.audit.base_coverage < 0.5
    assert any("C01" in note and "born" in note for note in result.notes)
    radius = np.log(A / ISOVALUE) / B
    times = result.times / radius**2
    exact = 1 - sphere_signature(times / 1.05**2) / 1.05**2 / sphere_signature(times)
    np.testing.assert_allclose(result.change[lone] - exact, 0, atol=5e-3)  # the tails
    assert np.abs(exact).max() > 0.09


def dimpled(depth):
    """An ellipsoid of unequal axes with a dimple."""

    def value(points):
        local = points / [1.0, 1.2, 1.45]
        distance = np.linalg.norm(local, axis=-1)
        cosine = local @ [0.48, 0.6, 0.64] / np.maximum(distance, 1e-9)
        return 1 - depth * np.exp(-2 * (1 - cosine) / 0.6**2) - distance

    return iv.ScalarField.from_function(value, ((-1.8,) * 3, (1.8,) * 3), (37,) * 3)


def test_the_strain_errs_no_more_than_its_floor():
    """Oracle: convergence. Against a mesh of five times the vertices, at 95 % of the nodes; and
    as a whole the floor is not more than five times too wide.
    """
    fields = dimpled(0.05), dimpled(0.1)
    result = small(*fields, 0.0)
    fine = iv.marching_cubes(fields[0], 0.0, vertices=1500)
    path = [fields[0], iv.MovedField(fields[1], result.motion)]
    strain = iv.distortion(fine, iv.carry_isometrically(fine, path, 0.0)[0].points)
    there = iv.interpolate(
        iv.closest_point(result.base, fine), fine, strain.at_nodes(fine.triangles)[:, None]
    )
    error = np.abs(result.strain - there[:, 0])
    assert (result.strain_floor > error).mean() > 0.95
    assert 1 < rms(result.strain_floor) / rms(error) < 5


def armed(length, radius=0.35):
    """A ball with a straight arm, smoothly joined."""

    def value(points):
        ball = 1 - np.linalg.norm(points, axis=-1)
        along = np.clip(points[..., 2], 0, 1 + length - radius)
        feet = np.stack([0 * along, 0 * along, along], axis=-1)
        return np.logaddexp(8 * ball, 8 * (radius - np.linalg.norm(points - feet, axis=-1))) / 8

    return iv.ScalarField.from_function(value, ((-1.6,) * 3, (1.6, 1.6, 2.6)), (33, 33, 43))


def test_what_finds_no_partner_is_told():
    """Oracle: analytic. The closest points of a ball lie on no side of an arm that grew out of it:
    a cylinder of radius 0.35 and most of its length 0.9, of an area of 4 pi and some more.
    """
    options = {"vertices": 250, "pairs": 50, "times": 5, "align": False}
    fields = armed(0.1), armed(1.0)
    result = small(*fields, 0.0, correspondence=iv.closest_point, order=1, **options)
    part = float(re.search(r"([\d.]+)% of the perturbed surface is", " ".join(result.notes))[1])
    assert 0.5 < part / 100 / (2 * np.pi * 0.35 * 0.9 / (4.2 * np.pi)) < 1.5


def test_places_in_the_wrong_order_are_told():
    """Oracle: algebra. The partners of two neighbouring nodes exchanged."""

    def exchanged(base, perturbed):
        found = iv.closest_point(base, perturbed)
        order = np.arange(len(base.points))
        first, second = base.triangles[0, :2]
        order[[first, second]] = second, first
        return iv.Correspondence(
            found.triangle[order], found.barycentric[order], found.distance[order], found.hits
        )

    options = {"vertices": 250, "pairs": 50, "times": 5, "order": 1, "align": False}
    result = small(dimpled(0.05), dimpled(0.06), 0.0, correspondence=exchanged, **options)
    part = float(re.search(r"([\d.]+)% of the base is matched", " ".join(result.notes))[1])
    assert part == pytest.approx(100 * result.audit.folded, abs=0.06)
    assert 0 < part < 5  # the triangles around two of 250 nodes


@pytest.mark.slow
def test_the_mesh_is_refined_to_the_accuracy_asked_for():
    """Oracle: algebra. Doubled until the mesh's noise over the change is at most 2 %, no more."""
    base, perturbed = (iv.read_field(path) for path in water_pair())
    result = iv.compare(base, perturbed, 0.05, pairs=150, times=20, order=1, accuracy=0.02)
    sizes, noise = zip(*(row.values() for row in result.choices["refinement"]), strict=True)
    assert len(sizes) > 2
    assert np.isnan(noise[0])
    assert all(value > 0.02 for value in noise[1:-1])
    assert noise[-1] <= 0.02
    assert result.choices["noise_of_the_mesh"] == pytest.approx(noise[-1], rel=1e-12)
    np.testing.assert_allclose(np.array(sizes[1:]) / sizes[:-1], 2, rtol=0.1)
