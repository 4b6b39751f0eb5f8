"""Colours: OKLab, embedded rows, groups that keep theirs, and readers who miss cones."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.distance import pdist

from isovary import color
from isovary.errors import ArgumentError

# IEC 61966-2-1: CIE XYZ to linear sRGB.
XYZ_TO_LINEAR = np.array(
    [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]]
)


def encoded(light):
    size = np.abs(light)
    curved = 1.055 * size ** (1 / 2.4) - 0.055
    return np.sign(light) * np.where(size <= 0.0031308, 12.92 * size, curved)


@pytest.mark.parametrize(
    ("xyz", "lab"),
    [
        ((0.950, 1.000, 1.089), (1.000, 0.000, 0.000)),
        ((1.000, 0.000, 0.000), (0.450, 1.236, -0.019)),
        ((0.000, 1.000, 0.000), (0.922, -0.671, 0.263)),
        ((0.000, 0.000, 1.000), (0.153, -1.415, -0.449)),
    ],
)
def test_the_published_pairs(xyz, lab):
    """Oracle: data. Ottosson's table of XYZ and OKLab, three digits; sRGB has four."""
    rgb = encoded(XYZ_TO_LINEAR @ xyz)
    np.testing.assert_allclose(color.srgb_to_oklab(rgb), lab, atol=2e-3)


def test_red_is_where_css_has_it():
    """Oracle: data. CSS Color 4: #ff0000 is oklab(0.628 0.225 0.126)."""
    np.testing.assert_allclose(color.srgb_to_oklab([1, 0, 0]), [0.628, 0.225, 0.126], atol=5e-4)


def test_there_and_back():
    """Oracle: algebra. Both ways give the same colours, in the gamut and outside; greys stay."""
    rgb = np.random.default_rng(1).uniform(-0.2, 1.2, (500, 3))
    np.testing.assert_allclose(color.oklab_to_srgb(color.srgb_to_oklab(rgb)), rgb, atol=1e-6)
    greys = np.repeat(np.linspace(0, 1, 11)[:, None], 3, axis=1)
    np.testing.assert_allclose(color.srgb_to_oklab(greys)[:, 1:], 0, atol=1e-7)
    np.testing.assert_allclose(color.srgb_to_oklab([1, 1, 1]), [1, 0, 0], atol=1e-6)


def test_colors_are_as_far_apart_as_the_points():
    """Oracle: symmetry. Nothing clipped: one factor for all distances, and a shift changes none."""
    points = np.random.default_rng(2).standard_normal((80, 3)) * [3.0, 2.0, 1.0]
    colors = color.embedding_colors(points, clipped=0)
    ratio = pdist(color.srgb_to_oklab(colors)) / pdist(points)
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-6)
    np.testing.assert_allclose(color.embedding_colors(7 * points + 5, clipped=0), colors, atol=1e-9)


@pytest.mark.parametrize("axes", [(5, 1, 1), (1, 5, 1), (1, 1, 5), (1, 1, 0), (0, 0, 1)])
def test_colors_use_what_a_screen_can_show(axes):
    """Oracle: algebra. All in the gamut and legible; larger by a hundredth, one is not."""
    points = np.random.default_rng(3).uniform(-1, 1, (200, 3)) * axes
    colors = color.embedding_colors(points, clipped=0)
    lab = color.srgb_to_oklab(colors)
    assert colors.min() >= 0
    assert colors.max() <= 1
    assert lab[:, 0].min() >= 0.45 - 1e-9
    assert lab[:, 0].max() <= 0.85 + 1e-9
    grey = np.array([0.65, 0, 0])
    larger = grey + 1.01 * (lab - grey)
    rgb = color.oklab_to_srgb(larger)
    inside = rgb.min() >= 0 and rgb.max() <= 1
    assert not (inside and larger[:, 0].min() >= 0.45 and larger[:, 0].max() <= 0.85)


def test_axes_have_their_meaning():
    """Oracle: data. First axis a, second b, third lightness, around the grey of L = 0.65."""
    for axis, place in enumerate([1, 2, 0]):
        points = np.zeros((3, 3))
        points[:, axis] = [-1, 0, 1]
        lab = color.srgb_to_oklab(color.embedding_colors(points, clipped=0))
        others = [i for i in range(3) if i != place]
        np.testing.assert_allclose(lab[1], [0.65, 0, 0], atol=1e-6)
        np.testing.assert_allclose(lab[:, others], lab[[1] * 3][:, others], atol=1e-6)
        assert lab[0, place] < lab[1, place] < lab[2, place]


def test_a_few_far_points_do_not_make_the_others_alike():
    """Oracle: analytic. One of 1000 points is 1000 away: it changes the others' span by 1 %."""
    points = np.random.default_rng(4).uniform(-1, 1, (1000, 3))
    alone = np.ptp(color.srgb_to_oklab(color.embedding_colors(points)), axis=0)
    points[0] = 1000.0
    spoilt = np.ptp(color.srgb_to_oklab(color.embedding_colors(points)), axis=0)
    np.testing.assert_allclose(spoilt, alone, rtol=0.02)
    rare = np.zeros((1000, 3))
    rare[0] = 1.0  # all quantiles are 0: then nothing is clipped
    colors = color.embedding_colors(rare)
    assert np.linalg.norm(np.diff(color.srgb_to_oklab(colors[:2]), axis=0)) > 0.1


def test_unknown_points_get_the_given_colour():
    """Oracle: algebra. Grey #6b6b6b by default; equal points share the middle grey."""
    points = np.ones((4, 3))
    points[2, 1] = np.nan
    colors = color.embedding_colors(points)
    np.testing.assert_allclose(colors[2], [0x6B / 255] * 3)
    np.testing.assert_allclose(color.srgb_to_oklab(colors[0]), [0.65, 0, 0], atol=1e-6)
    np.testing.assert_array_equal(
        color.embedding_colors(points, unknown=[1, 0, 0.5])[2], [1, 0, 0.5]
    )
    assert color.embedding_colors(np.empty((0, 3))).shape == (0, 3)


def seen_by(rgb, deficiency):
    """Machado, Oliveira, Fernandes (2009), severity 1: rows of the matrices as they print them."""
    matrix = {
        "protan": "0.152286 1.052583 -0.204868 0.114503 0.786281 0.099216 "
        "-0.003882 -0.048116 1.051998",
        "deutan": "0.367322 0.860646 -0.227968 0.280085 0.672501 0.047413 "
        "-0.011820 0.042940 0.968881",
        "tritan": "1.255528 -0.076749 -0.178779 -0.078411 0.930809 0.147602 "
        "0.004733 0.691367 0.303900",
    }[deficiency]
    light = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    seen = light @ np.array(matrix.split(), dtype=float).reshape(3, 3).T
    return encoded(np.clip(seen, 0, 1))


@pytest.mark.parametrize("deficiency", ["protan", "deutan", "tritan"])
def test_missing_cones_as_published(deficiency):
    """Oracle: data. The published matrices; greys stay grey."""
    rgb = np.random.default_rng(5).random((50, 3))
    found = color.color_blind(rgb, deficiency)
    np.testing.assert_allclose(found, seen_by(rgb, deficiency), atol=1e-4)
    np.testing.assert_allclose(color.color_blind([0.5] * 3, deficiency), 0.5, atol=1e-5)


@pytest.mark.parametrize("reader", ["all", "protan", "deutan", "tritan"])
def test_groups_can_be_told_apart(reader):
    """Oracle: data. 0.02 is just noticeable; 8 groups and the neutral grey keep three times it."""
    neutral = np.full((1, 3), 0xD5 / 255)
    colors = np.vstack([color.group_colors(8), neutral])
    seen = colors if reader == "all" else seen_by(colors, reader)
    assert pdist(color.srgb_to_oklab(seen)).min() > 0.06


def test_group_colors_stay_when_groups_are_added():
    """Oracle: algebra. The first colours are those of fewer groups; all 19 differ by 0.06."""
    many = color.group_colors(19)
    for count in (0, 1, 7, 8, 12):
        np.testing.assert_array_equal(color.group_colors(count), many[:count])
    assert pdist(color.srgb_to_oklab(many)).min() > 0.06
    np.testing.assert_allclose(many[1] * 255, [0xE6, 0x9F, 0x00])
    many[:] = 0
    assert color.group_colors(19)[-1].any()


def test_groups_follow_what_they_hold_most_of():
    """Oracle: analytic. 6 and 5 of 11 rows: the 6 stay, though to swap would match 10 rows."""
    coarse = [0] * 11 + [1] * 5
    fine = [0] * 6 + [1] * 5 + [0] * 5
    np.testing.assert_array_equal(color.nested_order(coarse, fine), [0, -1])
    weights = [1.0] * 6 + [2.0] * 5 + [1.0] * 5
    np.testing.assert_array_equal(color.nested_order(coarse, fine, weights=weights), [1, 0])


def test_unknown_rows_match_nothing():
    """Oracle: algebra. -1 on either side is left out; a group without common rows is new."""
    np.testing.assert_array_equal(color.nested_order([0, 0, -1, -1], [-1, 1, 0, 0]), [-1, 0])
    assert color.nested_order([], []).shape == (0,)


def test_a_family_keeps_its_colors():
    """Oracle: algebra. Random splits under random names: the larger part keeps its colour."""
    rng = np.random.default_rng(6)
    labels = [np.repeat([0, 1], [300, 200])]
    for count in range(2, 9):
        fine = labels[-1].copy()
        largest = np.bincount(fine).argmax()
        inside = np.flatnonzero(fine == largest)
        fine[inside[: len(inside) // 3]] = count
        labels.append(rng.permutation(count + 1)[fine])
    colors = color.nested_colors(labels)
    for step in range(1, len(labels)):
        before, after = colors[step - 1][labels[step - 1]], colors[step][labels[step]]
        kept = (before == after).all(axis=1)
        largest = np.bincount(labels[step - 1]).max()
        assert (~kept).sum() == largest // 3  # the newcomer only
        assert len(np.unique(colors[step], axis=0)) == len(colors[step])
    assert [len(found) for found in colors] == list(range(2, 10))
    assert color.nested_colors([]) == []


def test_a_newcomer_takes_no_color_that_was_just_given_up():
    """Oracle: algebra. Group 1 ends; the new one shares no row with it and gets a third colour."""
    first, second = color.nested_colors([[0, 0, 1, 1, -1], [0, 0, -1, -1, 1]])
    np.testing.assert_array_equal(second[0], first[0])
    np.testing.assert_array_equal(second[1], color.group_colors(3)[2])


@pytest.mark.parametrize(
    ("call", "code"),
    [
        (lambda: color.srgb_to_oklab([1.0, 2.0]), "A03"),
        (lambda: color.oklab_to_srgb(1.0), "A03"),
        (lambda: color.color_blind([1.0, 1, 1], "all"), "A02"),
        (lambda: color.embedding_colors(np.ones((3, 2))), "A03"),
        (lambda: color.embedding_colors(np.ones((3, 3)), clipped=0.5), "A02"),
        (lambda: color.embedding_colors(np.ones((3, 3)), unknown="#12"), "A03"),
        (lambda: color.embedding_colors(np.ones((3, 3)), unknown=[1, 2]), "A03"),
        (lambda: color.group_colors(-1), "A02"),
        (lambda: color.nested_order([0, 1], [0]), "A03"),
        (lambda: color.nested_order([0.5, 1], [0, 1]), "A03"),
        (lambda: color.nested_order([0, 1], [0, 1], weights=[1, 0]), "A02"),
    ],
)
def test_wrong_arguments_are_refused(call, code):
    """Oracle: data. Each with its stable code."""
    with pytest.raises(ArgumentError, match=code):
        call()
