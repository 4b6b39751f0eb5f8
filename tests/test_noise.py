"""Noise floor: its algebra on known errors, and true errors that it must bound."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from conftest import ELLIPSOID_ISOVALUE, ellipsoid_field
from scipy.integrate import quad

import isovary as iv
from isovary.noise import _beside, _noise_of_samples

BOX = ((-2.0, -2.0, -2.0), (2.0, 2.0, 2.0))


def vertices(surface):
    return len(np.unique(surface.corners))


@pytest.mark.parametrize("order", [1, 2])
def test_floor_is_extrapolated_by_the_meshes_refinement(order):
    """Oracle: algebra. With r times fewer vertices and a difference d: twice d / (r^order - 1)."""
    fine, coarse = (
        iv.marching_cubes(ellipsoid_field(), ELLIPSOID_ISOVALUE, vertices=count, order=order)
        for count in (400, 320)
    )
    ratio = vertices(fine) / vertices(coarse)
    assert 1.1 < ratio < 2
    change, other = np.full((len(fine.points), 2), 0.3), np.full((len(coarse.points), 2), 0.1)
    floor = iv.noise_floor(fine, change, coarse, other)
    np.testing.assert_allclose(floor, 2 * 0.2 / (ratio**order - 1))
    first = iv.noise_floor(fine, change, coarse, other, order=1)
    np.testing.assert_allclose(first, 2 * 0.2 / (ratio - 1))


def test_unknown_nodes_do_not_dilute_the_floor(ellipsoid):
    """Oracle: algebra. Where half of the nodes are NaN, the floor is that of the rest.

    More than twice the vertices count as twice: two errors of 0.2 / (2^2 - 1).
    """
    coarse = iv.marching_cubes(ellipsoid_field(), ELLIPSOID_ISOVALUE, vertices=150)
    assert vertices(ellipsoid) > 2 * vertices(coarse)
    change = np.full((len(ellipsoid.points), 1), 0.3)
    change[ellipsoid.points[:, 2] > 0] = np.nan
    floor = iv.noise_floor(ellipsoid, change, coarse, np.full((len(coarse.points), 1), 0.1))
    known = np.isfinite(floor)
    np.testing.assert_allclose(floor[known], 2 * 0.2 / 3)
    assert known[ellipsoid.points[:, 2] <= 0].all()
    assert not known.all()


def test_the_coarse_mesh_is_not_blamed_for_interpolation(ellipsoid):
    """Oracle: algebra. Exact values at the nodes of both meshes: only the finer is interpolated.

    A sum of squares of the coordinates is interpolated within h^3 of the finer mesh's edges;
    its floor is at most that of the same values interpolated the other way.
    """
    coarse = iv.marching_cubes(ellipsoid_field(), ELLIPSOID_ISOVALUE, vertices=100)

    def wave(surface):
        return np.cos(4 * surface.points[:, 2:])

    floor = iv.noise_floor(ellipsoid, wave(ellipsoid), coarse, wave(coarse))
    there = iv.interpolate(iv.closest_point(ellipsoid, coarse), coarse, wave(coarse))
    gap = np.sqrt(np.mean((wave(ellipsoid) - there) ** 2))
    assert (floor > 0).all()
    assert np.sqrt(np.mean(floor**2)) < 0.5 * (2 / 3) * gap


def test_pairs_left_out_by_weyls_law(ellipsoid):
    """Oracle: analytic. Integrals of x t exp(-x t), the change of exp(-x t) as all x grow alike."""
    last, times, gap = (12.0, 15.0), np.array([0.1, 0.4, 1.0]), 0.01
    change = np.ones((len(ellipsoid.points), 3))
    floor = iv.truncation_floor(ellipsoid, change, change - gap, last, times)
    for time, column in zip(times, floor.T, strict=True):
        beyond, between = (
            quad(lambda x, t=time: x * t * np.exp(-x * t), low, high)[0]
            for low, high in ((15.0, np.inf), last)
        )
        np.testing.assert_allclose(column, 2 * gap * beyond / between, rtol=1e-6)


@pytest.mark.parametrize("logarithmic", [False, True])
def test_size_of_white_noise(logarithmic):
    """Oracle: data. Noise of known size on a smooth field is found to 10 %, and none where none is.

    About 2 000 samples lie near the isosurface; differences along three axes share them, and
    the median knows their size to 1.2 / sqrt(2000), some 3 %, and more as they overlap.
    """
    smooth = replace(ellipsoid_field(samples=33), logarithmic=logarithmic)
    rough = 0.003 * np.random.default_rng(5).standard_normal(smooth.values.shape)
    values = smooth.values * np.exp(rough) if logarithmic else smooth.values + rough
    noisy = replace(smooth, values=values)
    near = _beside(smooth.values > ELLIPSOID_ISOVALUE)
    splined = [np.log(f.values) if logarithmic else f.values for f in (noisy, smooth)]
    found = [_noise_of_samples(values, near) for values in splined]
    assert found[0] == pytest.approx(0.003, rel=0.1)
    assert found[1] < 3e-6


def atoms(centers, softness=0.3):
    """Exponentials that decay from 1 at a distance of 0.9 from each center."""

    def value(points):
        away = [np.linalg.norm(points - np.array(center), axis=-1) for center in centers]
        return sum(np.exp((0.9 - distance) / softness) for distance in away)

    return value


def dimpled(depth):
    """An ellipsoid with a dimple of a depth on its upper end."""

    def value(points):
        local = points / np.array([1.0, 1.2, 1.3])
        distance = np.linalg.norm(local, axis=-1)
        cosine = local[..., 2] / np.maximum(distance, 1e-9)
        return 2 - distance - depth * np.exp(-2 * (1 - cosine) / 0.7**2)

    return value


def sampled(value, samples):
    return iv.ScalarField.from_function(value, BOX, (samples,) * 3)


THREE = [(-0.5, 0, 0), (0.5, 0.1, 0), (0, 0.5, 0.4)]
PAIRS = {
    "atoms moved": (atoms(THREE), atoms([*THREE[:2], (0.02, 0.52, 0.43)])),
    "dimple deepened": (dimpled(0.1), dimpled(0.13)),
}


def true_change(values, result):
    """The change at a result's nodes and times: more vertices, samples and pairs."""
    logarithmic = result.choices["interpolation"] == "logarithmic"
    base, perturbed = (replace(sampled(v, 51), logarithmic=logarithmic) for v in values)
    first = iv.marching_cubes(base, 1.0, vertices=750)
    path = [base, iv.MovedField(perturbed, result.motion)]
    second, _ = iv.carry_isometrically(first, path, 1.0)
    more = iv.eigenpairs(iv.fem(first), 75)
    other = iv.eigenpairs(iv.fem(second), len(more.values), start=more)
    before, after = (iv.heat_kernel_signature(pairs, result.times) for pairs in (more, other))
    change = iv.signature_difference(before, after, iv.heat_trace_scale(more, result.times))
    return iv.interpolate(iv.closest_point(result.base, first), first, change)


def test_floor_bounds_the_error():
    """Oracle: convergence. At 90 % of nodes and times, against five times the vertices.

    The floor is two standard errors, 95 %. On one small mesh it may be several percent fewer by
    chance, even by the processor's rounding, which makes another mesh; so six are counted
    together. Nor is it so wide that it means nothing: ten times the error in the median.
    """
    below = []
    for name, order in (("atoms moved", 2), ("dimple deepened", 2), ("dimple deepened", 1)):
        values = PAIRS[name]
        fields = [sampled(value, 26) for value in values]
        for vertices in (130, 150):
            result = iv.compare(*fields, 1.0, vertices=vertices, pairs=50, order=order)
            error = np.abs(result.change - true_change(values, result))
            below.append((error <= result.noise_floor).mean())
            assert np.median(result.noise_floor / error) <= 10
    assert np.mean(below) >= 0.9


def test_little_noise_behind_a_larger_error_of_the_spline():
    """Oracle: symmetry. White noise far below the error of every other sample is no change."""
    field = sampled(PAIRS["atoms moved"][0], 25)
    rough = 0.001 * np.random.default_rng(11).standard_normal(field.values.shape)
    noisy = replace(field, values=field.values + rough)
    result = iv.compare(field, noisy, 1.0, vertices=150, pairs=50)
    assert result.change_norm.max() > 1e-5
    assert result.significant.mean() < 0.01
