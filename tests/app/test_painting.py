"""Colours of the page: those of the pictures, grey where unknown, neutral below the noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from matplotlib import colormaps
from matplotlib.colors import to_rgb
from saved_folder import dented_ball, folder_of, half_lost, noisy

from isovary import color
from isovary.app._painting import drawn, paint_change, paint_groups, paint_signature
from isovary.app._saved_result import read_result
from isovary.errors import ArgumentError
from isovary.geometry import triangle_areas
from isovary.records import Clusters, Surface
from isovary.shapes import icosphere
from isovary.view import _paint
from isovary.view._tessellate import at_pieces, tessellate

GREY = tuple(round(255 * part) for part in to_rgb(color.UNKNOWN))
NEUTRAL = tuple(round(255 * part) for part in to_rgb(color.NEUTRAL))


def is_color(painted, rgb):
    return (painted.colors == rgb).all(axis=1)


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    return read_result(folder_of(dented_ball(), tmp_path_factory.mktemp("painted") / "out"))


@pytest.fixture(scope="module")
def lost(tmp_path_factory):
    return read_result(folder_of(half_lost(), tmp_path_factory.mktemp("lost") / "out"))


@pytest.fixture(scope="module")
def shown(saved):
    return drawn(saved.base)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("most", [1, 1281, 20_481])
def test_a_sphere_is_drawn_whole(order, most):
    """Oracle: algebra. Closed, so V - E + F = 2, and on the sphere up to the elements' error."""
    ball = icosphere(2, order=order)
    shape = drawn(ball, most)
    assert shape.split == {1: 1, 1281: 2, 20_481: 8}[most]
    assert len(shape.triangles) == 320 * shape.split**2
    edges = {
        tuple(sorted(e))
        for t in shape.triangles.tolist()
        for e in zip(t, t[1:] + t[:1], strict=True)
    }
    assert len(shape.points) - len(edges) + len(shape.triangles) == 2
    assert shape.triangles.dtype == np.int32
    facing = np.cross(
        *(shape.points[shape.triangles[:, k]] - shape.points[shape.triangles[:, 0]] for k in (1, 2))
    )
    middles = shape.points[shape.triangles].mean(axis=1)
    assert ((facing * middles).sum(axis=1) > 0).all()
    np.testing.assert_allclose(np.linalg.norm(shape.normals, axis=1), 1, atol=1e-6)
    # the nearest node of the own element is at most half an element's longest edge away
    away = np.linalg.norm(ball.points[shape.nodes] - shape.points, axis=1)
    assert away.max() < 0.36 / order


def test_drawn_are_the_pieces_of_the_pictures(saved, shown):
    """Oracle: other package. The pictures' pieces, in their order, with points shared."""
    pieces = tessellate(saved.base, shown.split)
    there = shown.points[shown.triangles]
    np.testing.assert_allclose(there, pieces.points[pieces.triangles], atol=1e-6)
    area = triangle_areas(shown.points.astype(float), shown.triangles).sum()
    assert area == pytest.approx(pieces.areas.sum(), rel=1e-6)


def test_a_surface_whose_normals_point_inward_is_turned():
    """Oracle: symmetry. Turned over, its triangles are drawn as those of the other one."""
    ball = icosphere(1, order=2)
    inward = Surface(ball.points, ball.triangles[:, [0, 2, 1, 5, 4, 3]])
    shape = drawn(inward, 2000)
    assert ((shape.normals * shape.points).sum(axis=1) > 0).all()
    a, b, c = (shape.points[shape.triangles[:, k]] for k in range(3))
    assert ((np.cross(b - a, c - a) * a).sum(axis=1) > 0).all()


@pytest.mark.parametrize("made", [dented_ball, half_lost, noisy])
def test_the_default_state_has_the_colours_of_the_pictures(made, tmp_path):
    """Oracle: other package. The overview's own painter, piece by piece."""
    result = made()
    there = read_result(folder_of(result, tmp_path / "out"))
    shape = drawn(there.base)
    samples = _paint.piece_samples(result, shape.split)
    expected = _paint.paint_norm(samples, _paint.norm_limit(result))
    painted = paint_change(there, None, 2.0, shape)
    np.testing.assert_array_equal(painted.colors, np.round(255 * expected))
    assert painted.legend.high == pytest.approx(100 * _paint.norm_limit(result))
    expected = _paint.paint_groups(samples)
    painted = paint_groups(there, result.clusters, shape)
    np.testing.assert_array_equal(painted.colors, np.round(255 * expected))
    assert painted.legend.stops == tuple(
        "#%02x%02x%02x" % tuple(round(255 * x) for x in rgb)  # noqa: UP031
        for rgb in color.group_colors(len(result.clusters.centers))
    )


def test_unknown_is_grey(lost):
    """Oracle: data. Nodes with x > 0.2 have no partner: beyond an element's size all is grey."""
    shape = drawn(lost.base)
    middles = shape.points[shape.triangles].mean(axis=1)
    for painted in (
        paint_change(lost, None, 2.0, shape),
        paint_change(lost, None, 0.0, shape),
        paint_change(lost, 3, 2.0, shape),
        paint_groups(lost, half_lost().clusters, shape),
    ):
        grey = is_color(painted, GREY)
        assert grey[middles[:, 0] > 0.5].all()
        assert not grey[middles[:, 0] < -0.1].any()
        assert painted.legend.unknown == "no partner: unknown"
    assert not is_color(paint_signature(lost, "base", 3, shape), GREY).any()


def test_the_factor_is_a_threshold(saved, shown):
    """Oracle: limits. Nothing is neutral at 0, all is above every noise, less and less between."""
    for column in (None, 0, 19):
        neutral = [
            is_color(paint_change(saved, column, factor, shown), NEUTRAL).mean()
            for factor in (0.0, 2.0, 100.0, 1e12)
        ]
        assert neutral[0] == 0
        assert neutral[-1] == 1
        assert neutral == sorted(neutral)
    assert paint_change(saved, None, 0.0, shown).legend.neutral == ""
    assert (
        paint_change(saved, None, 1e12, shown).legend.neutral == "not above 1e+12 times the noise"
    )
    assert is_color(paint_groups(saved, dented_ball().clusters, shown, factor=1e12), NEUTRAL).all()


def test_zero_change_is_shown_by_a_factor_of_zero(saved, shown):
    """Oracle: limits. Without change and noise everything is known, and 0."""
    still = replace(saved, change=0 * saved.change, noise_floor=0 * saved.noise_floor)
    lowest = np.round(255 * np.array(colormaps["viridis"](0.0))[:3])
    assert is_color(paint_change(still, None, 0.0, shown), lowest).all()
    assert is_color(paint_change(still, None, 2.0, shown), NEUTRAL).all()


def test_the_change_of_a_column_has_its_sign(saved, shown):
    """Oracle: analytic. Red where base - perturbed is positive, blue where negative, by size."""
    column = int(np.abs(saved.change).max(axis=0).argmax())
    painted = paint_change(saved, column, 0.0, shown)
    inside = at_pieces(saved.base, shown.split, saved.change[:, column])
    limit = np.abs(saved.change).max()
    assert painted.legend.high == -painted.legend.low == pytest.approx(100 * limit)
    red = painted.colors[:, 0].astype(int) - painted.colors[:, 2]
    clear = np.abs(inside) > 0.05 * limit
    assert clear.any()
    np.testing.assert_array_equal(np.sign(red[clear]), np.sign(inside[clear]))


def test_both_signatures_have_one_scale(saved, shown):
    """Oracle: analytic. The ends of the scale are the smallest and largest of both surfaces."""
    column = 4
    both = [saved.base_signature[:, column], saved.perturbed_own_signature[:, column]]
    low, high = np.concatenate(both).min(), np.concatenate(both).max()
    other = drawn(saved.perturbed)
    for which, values, shape in (("base", both[0], shown), ("perturbed", both[1], other)):
        painted = paint_signature(saved, which, column, shape)
        assert (painted.legend.low, painted.legend.high) == (low, high)
        share = (at_pieces(shape.surface, shape.split, values) - low) / (high - low)
        expected = colormaps["viridis"](np.clip(share, 0, 1))[:, :3]
        np.testing.assert_array_equal(painted.colors, np.round(255 * expected))
    assert painted.legend.stops[0] == "#440154"  # viridis begins there
    assert painted.legend.stops[-1] == "#fde725"


def test_a_signature_that_hardly_varies_has_one_colour(saved, shown):
    """Oracle: limits. A ball's signature at large times is 1 / area: differences are rounding."""
    flat = 1 + 1e-9 * saved.base_signature
    own = np.ones_like(saved.perturbed_own_signature)
    still = replace(saved, base_signature=flat, perturbed_own_signature=own)
    painted = paint_signature(still, "base", 19, shown)
    assert len(np.unique(painted.colors, axis=0)) == 1
    assert painted.legend.low == painted.legend.high


def test_borders_run_where_two_centers_are_equally_near():
    """Oracle: brute force. Scores are mean absolute differences, as the groups were made."""
    result = dented_ball()
    rows, centers = result.change, result.clusters.centers
    expected = np.abs(rows[:, None] - centers[None]).mean(axis=2)
    scores = _paint.node_samples(result).scores
    np.testing.assert_allclose(scores, expected, rtol=1e-9, atol=1e-15)


def test_a_palette_of_ones_own(saved, shown):
    """Oracle: data. Swapped colours swap, where nothing is mixed."""
    clusters = dented_ball().clusters
    count = len(clusters.centers)
    assert count > 1
    palette = color.group_colors(count)
    before = paint_groups(saved, clusters, shown).colors
    after = paint_groups(saved, clusters, shown, palette=palette[::-1]).colors
    first, last = (np.round(255 * palette[k]) for k in (0, -1))
    np.testing.assert_array_equal((before == first).all(axis=1), (after == last).all(axis=1))
    assert (before == first).all(axis=1).any()


def test_wrong_calls_are_told(saved, shown):
    """Oracle: data. Each error has the code of the fault."""
    other = drawn(icosphere(0))
    clusters = dented_ball().clusters
    calls = [
        ("A02", lambda: paint_change(saved, 20, 2.0, shown)),
        ("A02", lambda: paint_change(saved, -1, 2.0, shown)),
        ("A02", lambda: paint_change(saved, None, -1.0, shown)),
        ("A02", lambda: paint_change(saved, None, np.nan, shown)),
        ("A02", lambda: paint_change(saved, None, np.inf, shown)),
        ("A02", lambda: paint_signature(saved, "base", 20, shown)),
        ("A02", lambda: paint_signature(saved, "both", 0, shown)),
        ("A02", lambda: paint_groups(saved, clusters, shown, factor=-1.0)),
        ("A02", lambda: drawn(saved.base, 0)),
        ("A03", lambda: paint_change(saved, None, 2.0, other)),
        ("A03", lambda: paint_signature(saved, "base", 0, other)),
        ("A03", lambda: paint_groups(saved, clusters, other)),
        ("A03", lambda: paint_groups(saved, clusters, shown, palette=np.ones((1, 3)))),
        ("A03", lambda: paint_groups(saved, Clusters([0], [[0.0]]), shown)),
    ]
    for number, (code, call) in enumerate(calls):
        with pytest.raises(ArgumentError) as told:
            call()
        assert told.value.code == code, number


def test_a_result_far_away_is_drawn_as_precisely_as_a_near_one():
    """Oracle: symmetry. Moved by 1e6 radii: the same points about the middle."""
    near = icosphere(3)
    far = Surface(near.points + 1e6, near.triangles)
    points = drawn(far).points.astype(float) - 1e6
    np.testing.assert_allclose(points, drawn(near).points, atol=1e-6)
