"""Noisy volumes, integers and masks: what smoothing does, and when its lack is noticed."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import isovary as iv

SLOPE = iv.ScalarField.from_function(lambda p: p[..., 0], ((0, 0, 0), (20, 6, 6)), (21, 7, 7))


def notices(field, isovalue) -> set[str]:
    """Codes of the warnings with which an isosurface is meshed."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        iv.marching_cubes(field, isovalue, vertices=200)
    return {str(warning.message)[-4:-1] for warning in caught}


def test_outermost_samples_are_repeated():
    """Oracle: algebra. The sampled Gaussian's weights on 0, 1, 2, ... inside and 0 outside."""
    place = np.arange(-8, 9)
    weights = np.exp(-(place**2) / 2 / 2.0**2)
    expected = (weights / weights.sum() * np.maximum(place, 0)).sum()
    assert SLOPE.smoothed(2.0).values[0, 3, 3] == pytest.approx(expected, rel=1e-12)
    assert SLOPE.smoothed(2.0).values[10, 3, 3] == pytest.approx(10, rel=1e-12)


def test_widths_add_in_squares():
    """Oracle: analytic. Variances of convolved Gaussians add: 0.9^2 + 1.2^2 = 1.5^2."""
    bell = iv.ScalarField.from_function(
        lambda p: np.exp(-(p**2).sum(axis=-1) / 20), ((-9, -9, -9), (9, 9, 9)), (19, 19, 19)
    )
    twice = bell.smoothed(0.9).smoothed(1.2)
    assert twice.smoothing == pytest.approx(1.5)
    inside = (slice(6, -6),) * 3  # the ends of the box are another matter
    np.testing.assert_allclose(twice.values[inside], bell.smoothed(1.5).values[inside], atol=1e-3)
    assert bell.smoothing == 0
    assert "smoothed by 1.5" in repr(twice)


def test_widths_are_lengths():
    """Oracle: analytic. Along each axis x^2 grows by the variance, whatever the spacing."""
    field = iv.ScalarField.from_function(
        lambda p: (p**2).sum(axis=-1), ((-4, -4, -4), (4, 4, 4)), (17, 33, 41)
    )
    middle = tuple(count // 2 for count in field.values.shape)
    assert field.smoothed(0.5).values[middle] == pytest.approx(3 * 0.5**2, rel=2e-3)


def test_a_ball_shrinks():
    """Oracle: analytic. A sphere of radius r in its distance moves inward by width^2 / r."""
    field = iv.ScalarField.from_function(
        lambda p: 1 - np.linalg.norm(p - 0.013, axis=-1), ((-2,) * 3, (2,) * 3), (41, 41, 41)
    )
    area = iv.marching_cubes(field.smoothed(0.15), 0.0, vertices=300).area
    assert np.sqrt(area / 4 / np.pi) == pytest.approx(1 - 0.15**2, abs=1e-3)


def test_masks_and_integers_are_noticed():
    """Oracle: algebra. Samples beside the surface equal the next ones: I08; not when smoothed."""
    distance = iv.ScalarField.from_function(
        lambda p: 6.3 - np.linalg.norm(p - 0.2, axis=-1), ((-9,) * 3, (9,) * 3), (19, 19, 19)
    ).values
    mask = iv.ScalarField((distance > 0).astype(np.uint8))
    integers = iv.ScalarField(np.round(distance / 2))
    assert "I08" in notices(mask, 0.5)
    assert "I08" in notices(integers, 0.5)
    assert notices(mask.smoothed(1.2), 0.5) == set()


@pytest.mark.parametrize(
    ("function", "isovalue", "samples"),
    [
        (lambda p: p[..., 2], 0.1, 13),
        (lambda p: -(p[..., :2] ** 2).sum(axis=-1), -1.0, 9),
        (lambda p: -(p**2).sum(axis=-1), -1.0, 9),
        (lambda p: -(p**2).sum(axis=-1), -1.0, 16),
    ],
    ids=["plane", "cylinder", "coarse ball", "ball"],
)
def test_smooth_fields_on_symmetric_grids_are_not(function, isovalue, samples):
    """Oracle: algebra. Few values, but none that repeats behind the surface."""
    field = iv.ScalarField.from_function(function, ((-2,) * 3, (2,) * 3), (samples,) * 3)
    assert "I08" not in notices(field, isovalue)


@pytest.mark.parametrize("width", [0.0, -1.0, np.nan, np.inf, "a", [1.0, 2.0]])
def test_wrong_widths(width):
    """Oracle: algebra. A02, with what was got."""
    with pytest.raises(iv.ArgumentError, match="width: expected a positive length"):
        SLOPE.smoothed(width)


def noisy_ball(seed, radius=1.0, dent=0.0):
    """A ball's distance with white noise of 0.03, smoothed by two samples' distances."""
    box, shape = ((-1.6,) * 3, (1.6,) * 3), (33, 33, 33)

    def distance(p):
        away = np.linalg.norm(p - np.array([0.0, 0.0, 1.0]), axis=-1)
        return radius - np.linalg.norm(p, axis=-1) - dent * np.exp(-((away / 0.5) ** 2))

    clean = iv.ScalarField.from_function(distance, box, shape)
    noise = 0.03 * np.random.default_rng(seed).standard_normal(shape)
    return iv.ScalarField(clean.values + noise, clean.spacing, clean.origin).smoothed(0.2)


@pytest.mark.parametrize("seed", [1, 5])
def test_two_smoothed_measurements_of_one_ball_have_not_changed(seed):
    """Oracle: symmetry. One ball, two draws of noise, smoothed: what differs is noise."""
    pair = noisy_ball(seed), noisy_ball(seed + 1)
    result = iv.compare(*pair, 0.0, vertices=250, pairs=60, times=20)
    assert result.significant.mean() < 0.01


def test_a_dent_stands_out_of_smoothed_noise():
    """Oracle: analytic. A dent of 0.3 in such a ball: its floor is marked, and changed most."""
    pair = noisy_ball(1), noisy_ball(2, dent=0.3)
    result = iv.compare(*pair, 0.0, vertices=250, pairs=60, times=20)
    angle = np.arccos(result.base.points[:, 2] / np.linalg.norm(result.base.points, axis=1))
    assert result.significant[angle < 0.2].all()
    assert angle[np.nanargmax(result.change_norm)] < 0.3
