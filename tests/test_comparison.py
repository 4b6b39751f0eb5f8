"""The whole walk: what compare promises about change, noise, identity, rigid motion, topology."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from conftest import ELLIPSOID_ISOVALUE, ellipsoid_field
from oracles import sphere_signature, spheroid_signature

import isovary as iv
from isovary.data import water_pair

BOX = ((-1.6, -1.6, -1.6), (1.6, 1.6, 1.6))


def ball(radius, center=(0.0, 0.0, 0.0), samples=25):
    return iv.ScalarField.from_function(
        lambda p: -(((p - np.array(center)) / radius) ** 2).sum(axis=-1), BOX, (samples,) * 3
    )


def small(base, perturbed, isovalue, **options):
    return iv.compare(base, perturbed, isovalue, **{"vertices": 300, "pairs": 100} | options)


@pytest.fixture(scope="module")
def water() -> tuple[iv.ScalarField, iv.ScalarField]:
    base, perturbed = (iv.read_field(path) for path in water_pair())
    return base, perturbed


def test_grown_sphere_has_the_exact_change():
    """Oracle: analytic. Radius 1 to 1.1: (h(t) - h(t / 1.21) / 1.21) / w(t) at every node.

    h is the unit sphere's signature; 100 pairs are whole shells (l <= 9). Own
    times or weights of the perturbed sphere would make the change vanish.
    """
    result = small(ball(1.0), ball(1.1), -1.0, vertices=500)
    times = result.times
    exact = 1 - sphere_signature(times / 1.21) / 1.21 / sphere_signature(times)
    np.testing.assert_allclose(result.change, np.tile(exact, (len(result.change), 1)), atol=2e-3)
    assert np.abs(exact).max() > 0.06
    assert np.abs(result.unit_area_change).max() < 1e-3
    assert result.significant.all()
    assert len(result.base_pairs.values) == 100


def test_identical_fields_give_exactly_no_change(water):
    """Oracle: algebra. Change exactly 0, nothing significant, no groups, and a note."""
    for options in ({}, {"correspondence": iv.normal_rays, "order": 1}):
        result = small(water[0], water[0], 0.05, **options)
        assert (result.change == 0).all()
        assert not result.significant.any()
        assert (result.clusters.labels == -1).all()
        assert any("C06" in note for note in result.notes)


@pytest.mark.parametrize("isometric", [True, False])
def test_rigid_shift_is_taken_out(water, isometric):
    """Oracle: symmetry. The same shape at another origin: the shift is found, no change left."""
    base = water[0]
    shift = np.array([0.04, -0.02, 0.03])
    there = replace(base, origin=base.origin + shift)
    result = small(base, there, 0.05, isometric=isometric)
    np.testing.assert_allclose(result.motion.translation, -shift, atol=1e-6)
    assert result.alignment.share > 0.999
    assert any("taken out" in note for note in result.notes)
    assert np.sqrt((result.change**2).mean()) < 1e-6
    np.testing.assert_allclose(
        result.displacement, np.tile(shift, (len(result.change), 1)), atol=1e-5
    )
    surface = result.perturbed_in_place
    used = replace(there, logarithmic=True)
    assert np.abs(used.value(surface.points) / 0.05 - 1).max() < 1e-9


def test_a_motion_that_is_not_taken_out_is_told(water):
    """Oracle: symmetry. Without alignment, along normals, a shift looks like change: warned."""
    there = replace(water[0], origin=water[0].origin + np.array([0.04, -0.02, 0.03]))
    result = small(water[0], there, 0.05, align=False, isometric=False)
    assert result.motion.is_identity
    assert result.alignment.share > 0.999
    assert any("Align them" in note for note in result.notes)
    assert np.sqrt((result.change**2).mean()) > 1e-3


def test_a_local_dimple_is_found_where_it_is():
    """Oracle: analytic. A 2 % dimple at the north pole changes the pole, not the south pole."""

    def dimpled(depth):
        def value(p):
            r = np.linalg.norm(p, axis=-1)
            cosine = p[..., 2] / np.maximum(r, 1e-9)
            return 1 - depth * np.exp(-2 * (1 - cosine) / 0.35**2) - r

        return iv.ScalarField.from_function(value, BOX, (41, 41, 41))

    result = small(dimpled(0.0), dimpled(0.02), 0.0, vertices=600, pairs=150)
    z = result.base.points[:, 2]
    assert z[result.change_norm.argmax()] > 0.9
    early = np.abs(result.change[:, :20]).mean(axis=1)  # later, heat has seen the whole sphere
    assert early[z > 0.97].mean() > 50 * early[z < -0.5].mean()
    assert result.relative_noise < 0.05
    assert not any("rigid motion" in note for note in result.notes)


@pytest.mark.slow
def test_carried_beats_independent_meshes_on_real_data(water):
    """Oracle: convergence. Against a finer carried reference, evaluated in its own elements.

    Error of the scaled change relative to it (rms), 552 vertices, 300 pairs: at most
    3 % carried with order 2, at most 18 % with order 1; more than 100 % with independent
    flat meshes. See benchmarks/mesh_noise.py for the full comparison.
    """
    fine = iv.compare(*water, 0.05, vertices=1600)

    def error(**options):
        result = iv.compare(*water, 0.05, vertices=552, **options)
        scale = iv.heat_trace_scale(result.base_pairs, fine.times)
        before = iv.heat_kernel_signature(result.base_pairs, fine.times)
        there = iv.heat_kernel_signature(result.perturbed_pairs, fine.times)
        after = iv.interpolate(result.correspondence, result.perturbed, there)
        change = iv.signature_difference(before, after, scale)
        partner = iv.closest_point(result.base, fine.base)
        truth = iv.interpolate(partner, fine.base, fine.change)
        return np.sqrt(np.nanmean((change - truth) ** 2) / np.nanmean(truth**2))

    assert error() <= 0.03
    assert error(order=1) <= 0.18
    assert error(order=1, correspondence=iv.normal_rays) > 1.0


def test_noise_floor_bounds_the_error(water):
    """Oracle: convergence. The floor exceeds the error against a finer run at 95 % of the nodes."""
    fine = iv.compare(*water, 0.05, vertices=1200, pairs=150)
    coarse = iv.compare(*water, 0.05, vertices=400, pairs=150)
    partner = iv.closest_point(coarse.base, fine.base)
    scale = iv.heat_trace_scale(fine.base_pairs, coarse.times)
    change = iv.signature_difference(
        iv.heat_kernel_signature(fine.base_pairs, coarse.times),
        iv.heat_kernel_signature(fine.perturbed_pairs, coarse.times),
        scale,
    )
    truth = iv.interpolate(partner, fine.base, change)
    error = iv.change_norm(coarse.change - truth)
    floor = iv.change_norm(coarse.noise_floor)
    assert (error <= floor).mean() > 0.95
    assert floor.mean() < 20 * error.mean()  # and it is no wild exaggeration


def test_nothing_is_called_change_where_meshes_disagree():
    """Oracle: symmetry. One shape on two grids, meshed independently: noise, not change."""
    first = ellipsoid_field(samples=25)
    second = ellipsoid_field(samples=28)
    result = small(first, second, ELLIPSOID_ISOVALUE, order=1, correspondence=iv.normal_rays)
    assert result.change_norm.max() > 1e-4  # there is noise to be taken for change
    assert result.significant.mean() < 0.1
    assert result.relative_noise > 0.5
    carried = small(first, second, ELLIPSOID_ISOVALUE)
    assert carried.change_norm.max() < 1e-8  # the spline reproduces this field


def bumpy(samples, growth=0.0, noise=0.0):
    """A ball with bumps that no spline reproduces, on any number of samples."""

    def value(p):
        r = np.linalg.norm(p, axis=-1)
        return 1 + growth - r + 0.1 * np.sin(3 * p[..., 0]) * np.cos(4 * p[..., 1] + p[..., 2])

    field = iv.ScalarField.from_function(value, BOX, (samples,) * 3)
    rough = np.random.default_rng(23).standard_normal(field.values.shape)
    return replace(field, values=field.values + noise * rough)


@pytest.mark.parametrize("samples", [24, 32, 48])
def test_one_shape_on_two_grids_is_not_called_changed(samples):
    """Oracle: symmetry. The grids differ, the surface does not: the floor sees it."""
    result = small(bumpy(samples), bumpy(samples + 1), 0.0, vertices=400)
    assert result.change_norm.max() > 0  # there is something to be taken for change
    assert result.significant.mean() < 0.05
    grown = small(bumpy(samples), bumpy(samples + 1, growth=0.05), 0.0, vertices=400)
    assert grown.significant.mean() > 0.8


def test_noise_in_the_data_is_not_called_change():
    """Oracle: symmetry. White noise on the samples of one of two equal fields."""
    result = small(bumpy(32), bumpy(32, noise=0.003), 0.0, vertices=400)
    assert result.change_norm.max() > 1e-3
    assert result.significant.mean() < 0.05
    assert any("samples of the fields" in note for note in result.notes)


@pytest.mark.parametrize(("offset", "amplitude"), [(300.0, 1.0), (101325.0, 10.0)])
def test_identical_fields_with_an_offset(offset, amplitude):
    """Oracle: algebra. Pressure-like fields: exactly no change, whatever the constant on top."""
    field = iv.ScalarField.from_function(
        lambda p: offset + amplitude * np.exp(-((p / [1, 1.2, 0.9]) ** 2).sum(axis=-1)),
        BOX,
        (33, 33, 33),
    )
    result = small(field, field, offset + 0.4 * amplitude)
    assert (result.change == 0).all()


def test_groups_only_where_they_differ():
    """Oracle: analytic. Uniform growth changes every node alike: one group, not three."""
    result = small(ball(1.0), ball(1.05), -1.0)
    assert len(result.clusters.centers) == 1
    assert set(result.clusters.labels) == {0}


def test_topology_is_that_of_the_meshes():
    """Oracle: analytic. Two Gaussians joined by a neck thinner than a cell, and parted: C01."""

    def pair(width):
        centers = np.array([[-0.98, 0, 0], [0.98, 0, 0]])
        return iv.ScalarField.from_function(
            lambda p: sum(np.exp(-(((p - c) / width) ** 2).sum(axis=-1)) for c in centers),
            ((-2.6, -1.7, -1.7), (2.6, 1.7, 1.7)),
            (20, 20, 20),
        )

    neck = 2 * np.exp(-((0.98 / 0.8) ** 2))  # the value midway, for a width of 0.8
    with pytest.raises(iv.CorrespondenceError, match="C01"):
        small(pair(0.81), pair(0.79), neck, vertices=400)


def test_the_perturbed_uses_as_many_pairs_as_the_base():
    """Oracle: analytic. A sphere drops a cut shell; the ellipsoid it becomes must follow."""
    result = small(ball(1.0), ball(np.array([1.0, 1.1, 0.93])), -1.0, pairs=70)
    assert len(result.base_pairs.values) == 64
    assert len(result.perturbed_pairs.values) == 64
    assert any("S04" in note for note in result.notes)


def test_isovalue_outside_names_the_field(water):
    """Oracle: algebra. Base or perturbed, by role: both have the same name."""
    low = replace(water[1], values=water[1].values * 1e-4)
    with pytest.raises(iv.FieldError, match="I02") as caught:
        iv.compare(water[0], low, 0.05)
    assert str(caught.value).startswith("perturbed field: isovalue")


def test_different_topology_is_an_error():
    """Oracle: analytic. One ball against two: C01 with both named."""

    def two(p):
        away = [np.linalg.norm(p - np.array([s, 0, 0]), axis=-1) for s in (-0.8, 0.8)]
        return 0.6 - np.minimum(*away)

    pair = iv.ScalarField.from_function(two, BOX, (33, 33, 33))
    one = iv.ScalarField.from_function(
        lambda p: 0.6 - np.linalg.norm(p, axis=-1), BOX, (33, 33, 33)
    )
    with pytest.raises(iv.CorrespondenceError, match="C01") as caught:
        small(one, pair, 0.0)
    assert "base: 1 component(s)" in str(caught.value)
    assert "perturbed: 2 component(s)" in str(caught.value)


@pytest.mark.parametrize("isometric", [True, False])
def test_open_surface_is_told_and_its_rim_is_unknown_or_close(isometric):
    """Oracle: analytic. A sphere cut by the box: one rim, noted; no node is silently unchanged."""

    def cut(radius):
        return iv.ScalarField.from_function(
            lambda p: -((p / radius) ** 2).sum(axis=-1),
            ((-0.4, -1.6, -1.6), (1.6, 1.6, 1.6)),
            (21, 33, 33),
        )

    result = small(cut(1.0), cut(1.02), -1.0, isometric=isometric)
    assert result.topology.boundary_loops == 1
    assert any("I05" in note for note in result.notes)
    assert result.alignment.held == ("x",)
    found = result.correspondence.found
    rim = np.abs(result.base.points[:, 0] + 0.4) < 1e-9
    there = result.perturbed.points[found]
    np.testing.assert_allclose(np.linalg.norm(there, axis=1), 1.02, atol=1e-9)
    np.testing.assert_array_equal(result.perturbed.points[rim, 0], result.base.points[rim, 0])
    if not isometric:
        points = result.base.points[found]
        follow = (there * points).sum(axis=1) - 1  # what lies along the unit sphere's normal
        exact = np.where(rim[found], np.sqrt(1.02**2 - 0.16) - np.sqrt(0.84), follow)
        np.testing.assert_allclose(result.correspondence.distance[found], exact, atol=1e-9)
        np.testing.assert_allclose(exact[points[:, 0] > 0.2], 0.02, atol=1e-9)
    assert found[rim].all()
    assert np.isnan(result.change[~found]).all()
    assert found.mean() > 0.9


@pytest.mark.parametrize(
    ("options", "code", "text"),
    [
        ({"isovalue": 500.0}, "I02", "isovalue: expected a value inside the range"),
        ({"order": 3}, "A02", "order: expected 1 or 2, got 3"),
        ({"pairs": 9}, "A02", "pairs: expected at least 10, got 9"),
        ({"groups": 0}, "A02", "groups: expected at least 1, got 0"),
        ({"times": 1}, "A02", "times: expected at least 2, got 1"),
        ({"vertices": 121}, "M09", "vertices: expected at least 122 for 300 eigenpairs"),
    ],
)
def test_wrong_arguments_fail_before_the_work(water, options, code, text):
    """Oracle: algebra. The name, the bound and the value, at the edge of what is allowed."""
    with pytest.raises(iv.IsovaryError) as caught:
        iv.compare(*water, **{"isovalue": 0.05} | options)
    assert caught.value.code == code
    assert text in str(caught.value)


def test_progress_and_record(water):
    """Oracle: algebra. Progress rises from 0 to 1; the record names every choice."""
    seen = []
    result = small(*water, 0.05, progress=lambda stage, done: seen.append((stage, done)))
    done = [part for _, part in seen]
    assert seen[-1] == ("done", 1.0)
    assert done == sorted(done)
    assert {"meshing", "eigenpairs of the base", "groups"} <= {stage for stage, _ in seen}
    assert set(result.timings) == {stage for stage, _ in seen} - {"done"}
    assert result.choices["interpolation"] == "logarithmic"
    assert result.choices["correspondence"] == "carried"
    assert len(result.choices["base"]["sha256"]) == 64


def test_a_mesh_too_distorted_for_elements_is_replaced():
    """Oracle: analytic. A sphere drawn out to a spheroid of half axis 6: the carried triangles at
    its tips nearly fold, so it is meshed anew; its signature at the partners is the exact one.
    """

    def spheroid(half_axis):
        return iv.ScalarField.from_function(
            lambda p: -((p / [1, 1, half_axis]) ** 2).sum(axis=-1),
            ((-1.5, -1.5, -7), (1.5, 1.5, 7)),
            (13, 13, 29),
        )

    result = small(spheroid(1.0), spheroid(6.0), -1.0, vertices=200, times=20)
    assert any("M16" in note for note in result.notes)
    assert not np.array_equal(result.perturbed.triangles, result.base.triangles)
    height = (result.base.points + result.displacement)[:, 2]
    exact = spheroid_signature(6.0, height, result.times[8:])
    error = np.abs(result.perturbed_signature[:, 8:] / exact - 1)
    assert np.median(error) < 5e-3
    assert error.max() < 0.05
