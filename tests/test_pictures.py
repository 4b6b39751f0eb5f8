from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgb
from pictures import ball, check_texts, compare, dented, field, words

import isovary as iv
from isovary.color import GROUP_COLORS, NEUTRAL, UNKNOWN, group_colors, srgb_to_oklab
from isovary.records import Clusters, Correspondence
from isovary.shapes import icosphere
from isovary.view import _both, _overview, _paint, details, overview
from isovary.view._camera import Camera
from isovary.view._dendrogram import cut_range, dendrogram_figure, leaf_groups, node_groups
from isovary.view._overview import prepare
from isovary.view._rim_band import at_corners, contour, dashed, rim_band
from isovary.view._tessellate import tessellate


@pytest.fixture(scope="module")
def result():
    """A ball that got a dimple."""
    return compare(field(ball), field(dented))


@pytest.fixture(scope="module")
def bowl():
    """An open surface, z = 0.3 x^2 cut by a box."""
    before, after = (field(lambda p, a=a: p[..., 2] - a * p[..., 0] ** 2) for a in (0.3, 0.33))
    return compare(before, after, order=1, vertices=300)


@pytest.fixture(autouse=True)
def no_opengl(monkeypatch):
    """Drawn by matplotlib, in few pieces."""
    monkeypatch.setenv("ISOVARY_NO_OPENGL", "1")
    monkeypatch.setattr(_overview, "_PIECES_WITHOUT_OPENGL", 5_000)


def _cylinder(around, levels):
    """Open, flat triangles, radius 1, z from -1 to 1."""
    turn, height = 2 * np.pi * np.arange(around) / around, np.linspace(-1, 1, levels)
    z, t = (part.ravel() for part in np.meshgrid(height, turn, indexing="ij"))
    i, j = (part.ravel() for part in np.mgrid[: levels - 1, :around])
    a, b = i * around + j, i * around + (j + 1) % around
    triangles = np.vstack(
        [np.column_stack([a, b, b + around]), np.column_stack([a, b + around, a + around])]
    )
    return iv.Surface(np.column_stack([np.cos(t), np.sin(t), z]), triangles)


def _hemisphere():
    """Curved, radius 1, from the pole to the equator: the disc of radius pi / 2 rolled up."""
    rings = 6
    turn = [2 * np.pi * np.arange(6 * k) / (6 * k) for k in range(1, rings + 1)]
    disc = np.vstack(
        [[0.0, 0.0], *(k * np.column_stack([np.cos(t), np.sin(t)]) for k, t in enumerate(turn, 1))]
    )
    from scipy.spatial import Delaunay

    corners = Delaunay(disc * (1 + 1e-9 * (disc**2).sum(axis=1, keepdims=True))).simplices
    flat = iv.Surface(np.column_stack([disc, np.zeros(len(disc))]), corners).quadratic()
    angle = np.linalg.norm(flat.points, axis=1) * np.pi / (2 * rings)
    around = np.arctan2(flat.points[:, 1], flat.points[:, 0])
    rim = np.isclose(np.linalg.norm(flat.points, axis=1), rings * np.cos(np.pi / (6 * rings)))
    angle[rim] = np.pi / 2
    up = np.column_stack(
        [np.cos(around) * np.sin(angle), np.sin(around) * np.sin(angle), np.cos(angle)]
    )
    return iv.Surface(up, flat.triangles)


def test_contour_on_a_cylinder():
    """Oracle: analytic. The nearest rim point lies straight above or below: 1 - |z| = distance.

    The distance is linear on each triangle, so the contour is exact: two polygons around.
    """
    surface = _cylinder(24, 9)
    pieces = tessellate(surface, 4)
    lines = contour(pieces, at_corners(surface, 4, iv.rim_distance(surface)), 0.3)
    np.testing.assert_allclose(np.abs(lines[..., 2]), 0.7, atol=1e-12)
    length = np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1).sum()
    assert length == pytest.approx(2 * 24 * 2 * np.sin(np.pi / 24), rel=1e-9)


def test_contour_on_a_hemisphere():
    """Oracle: analytic. A node at the latitude a is 2 sin(a / 2) from the equator."""
    surface = _hemisphere()
    distance = iv.rim_distance(surface)
    lines = contour(tessellate(surface, 8), at_corners(surface, 8, distance), 0.5)
    latitude = np.arcsin(lines[..., 2] / np.linalg.norm(lines, axis=-1))
    np.testing.assert_allclose(2 * np.sin(latitude / 2), 0.5, atol=0.005)
    length = np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1).sum()
    assert length == pytest.approx(2 * np.pi * np.cos(2 * np.arcsin(0.25)), rel=0.01)


def test_dashes_have_one_length():
    """Oracle: algebra. A straight line of 100 steps of 0.01 in dashes of 0.1: half is dark."""
    x = np.column_stack([np.linspace(0, 1, 101), np.zeros((101, 2))])
    lines = np.stack([x[:-1], x[1:]], axis=1)
    order = np.random.default_rng(31).permutation(100)
    dark = dashed(lines[order], 0.1)[np.argsort(order)].reshape(10, 10)
    assert dark.sum() == 50
    assert (dark == dark[:, :1]).all()
    assert len(dashed(np.empty((0, 2, 3)), 0.1)) == 0


def test_band_is_where_the_rim_shows(bowl):
    """Oracle: analytic. At 2 sqrt(t), t the time at which the marked node changed most, from
    the rim, measured in a straight line to many points of it.
    """
    view = prepare(bowl)
    time = bowl.times[np.abs(bowl.change[view.peak]).argmax()]
    assert view.band.radius == pytest.approx(2 * np.sqrt(time))
    assert bowl.rim_distance.max() > 0.5
    lines = contour(view.pieces, at_corners(bowl.base, view.split, bowl.rim_distance), 0.5)
    across, along = 1.6 - np.abs(lines.reshape(-1, 3)[:, :2]).T
    assert (np.minimum(across, along) <= 0.52).all()
    assert (along >= 0.48).all()
    assert replace(view.band, radius=0.5).words == "rim shows within 2√t = 0.5 of it"
    legend = words(overview(bowl)) + words(details(bowl))
    assert legend.count(view.band.words) == 2


def test_no_band_without_a_rim_or_times(result, bowl):
    """Oracle: algebra. Closed surfaces, signatures not over times and no change have none."""
    assert prepare(result).band is None
    assert "rim shows" not in words(overview(result))
    view = prepare(bowl)
    args = view.pieces, view.split
    assert rim_band(bowl, *args, view.peak) is not None
    assert rim_band(bowl, *args, None) is None
    kind = SimpleNamespace(per_time=False)
    assert rim_band(replace(bowl, methods=SimpleNamespace(kind=kind)), *args, view.peak) is None


def test_a_rim_that_shows_everywhere_has_no_line(bowl):
    """Oracle: algebra. Beyond the farthest node there is nothing to draw; the legend says so."""
    band = prepare(bowl).band
    far = replace(band, radius=1.01 * band.farthest, lines=band.lines[:0])
    assert far.words.startswith("rim shows everywhere")


def _soft(result, shares, labels):
    count = shares.shape[1]
    return replace(result, clusters=Clusters(labels, result.clusters.centers[:count], shares))


def test_memberships_mix_colours(result):
    """Oracle: algebra. One-hot memberships give the group's colour; halves the middle in OKLab;
    no group stays neutral, unknown stays unknown.
    """
    labels = np.arange(len(result.base.points)) % 2
    labels[:5] = -1
    shares = np.eye(2)[np.maximum(labels, 0)]
    shares[labels < 0] = np.nan
    result = replace(
        result, clusters=Clusters(labels, np.array([0.0, 1.0])[:, None] + 0 * result.times)
    )
    hard = _paint.paint_groups(_paint.node_samples(result))
    soft = _paint.node_samples(_soft(result, shares, labels))
    np.testing.assert_allclose(_paint.paint_groups(soft), hard, atol=1e-6)
    np.testing.assert_array_equal(hard[:5], np.tile(to_rgb(NEUTRAL), (5, 1)))
    half = replace(soft, memberships=np.full_like(shares, 0.5), known=np.arange(len(labels)) > 9)
    colors = _paint.paint_groups(half)
    middle = srgb_to_oklab([to_rgb(color) for color in GROUP_COLORS[:2]]).mean(axis=0)
    np.testing.assert_allclose(
        srgb_to_oklab(colors[10:]), np.tile(middle, (len(labels) - 10, 1)), atol=1e-6
    )
    np.testing.assert_array_equal(colors[:10], np.tile(to_rgb(UNKNOWN), (10, 1)))
    assert "mixed by membership" in words(overview(_soft(result, shares, labels)))


def test_both_have_one_scale_and_room(result):
    """Oracle: algebra. Equal limits, equal boxes, and both surfaces inside."""
    grown = replace(result.perturbed, points=1.3 * result.perturbed.points + [0.4, 0, 0])
    figure = _both.both(replace(result, perturbed=grown))
    stages = [axes for axes in figure.axes if axes.findobj(PolyCollection) and not axes.axison]
    assert len(stages) == 3
    assert len({(axes.get_xlim(), axes.get_ylim()) for axes in stages}) == 1
    assert {tuple(np.round(axes.get_position().size, 12)) for axes in stages} == {(0.31, 0.585)}
    (left, right), (low, high) = stages[0].get_xlim(), stages[0].get_ylim()
    assert (right - left) / (high - low) == pytest.approx(0.31 * 12.8 / (0.585 * 6.4))
    for axes in stages:
        for polygons in axes.findobj(PolyCollection):
            places = np.concatenate([path.vertices for path in polygons.get_paths()[::50]])
            assert (places >= [left, low]).all()
            assert (places <= [right, high]).all()
    assert "ISOVARY_NO_OPENGL" in words(figure)


def _moved(result, distance):
    old = result.correspondence
    partners = Correspondence(old.triangle, old.barycentric, distance, old.hits)
    return replace(result, correspondence=partners)


@pytest.mark.parametrize(
    ("share", "said"),
    [
        (0.03, "Largest displacement 0.06 (3 % of the size)"),
        (0.004, "Too small to see: largest displacement 0.4 % of the size"),
        (0.0, "Nothing moved"),
    ],
)
def test_heading_tells_how_much(result, share, said):
    """Oracle: algebra. The largest displacement over the largest extent, 2 for the unit ball."""
    distance = (
        share
        * np.ptp(result.base.points, axis=0).max()
        * np.cos(np.arange(len(result.base.points)))
    )
    assert _both.heading(_moved(result, distance)).startswith(said)


def test_overlay_tells_front_from_back(result):
    """Oracle: algebra. Seen from z: what moved out at x > 0 lies in front, in at x < 0 behind,
    and what moved by less than the least has the base's own colour; lost nodes are unknown.
    """
    x = result.base.points[:, 0]
    result = _moved(result, np.where(np.abs(x) < 0.4, 1e-4, 0.1 * np.sign(x)))
    view = prepare(result)
    view = replace(view, camera=Camera(np.eye(3), view.camera.low, view.camera.high))
    colors = _both.overlay_colors(view, 0.002)
    x, toward = view.pieces.middles[:, 0], view.pieces.facing[:, 2]
    front = toward > 0.2
    mixed = {
        name: (np.array(to_rgb("#c9d4dc")) + to_rgb(name)) / 2 for name in ("#d55e00", "#0072b2")
    }
    cases = (
        (x > 0.8, mixed["#d55e00"]),
        (x < -0.8, mixed["#0072b2"]),
        (np.abs(x) < 0.05, to_rgb("#c9d4dc")),
    )
    for where, color in cases:
        rows = colors[front & where]
        assert len(rows) > 10
        np.testing.assert_allclose(rows, np.tile(color, (len(rows), 1)), atol=1e-9)
    lost = replace(view, samples=replace(view.samples, found=np.zeros(len(colors))))
    np.testing.assert_array_equal(_both.overlay_colors(lost, 0.002)[0], to_rgb(UNKNOWN))


def test_independent_mesh_takes_the_nearest_partners(result):
    """Oracle: analytic. The change is 2 + z; another mesh of the same sphere shows 2 + z, to the
    distance of neighbours, sqrt(area / nodes). A carried mesh has the base's own pieces.
    """
    other = icosphere(2)
    match = iv.normal_rays(result.base, other)
    change = (2 + result.base.points[:, 2])[:, None] + 0 * result.times
    view = prepare(replace(result, change=change))
    own = _both.samples_there(view)
    for name in ("norm", "known", "group_margin"):
        np.testing.assert_allclose(getattr(own, name), getattr(view.samples, name), rtol=1e-12)
    foreign = replace(view.result, perturbed=other, correspondence=match)
    there = _both.samples_there(replace(view, result=foreign, split=4))
    step = np.sqrt(4 * np.pi / len(change))
    z = tessellate(other, 4).middles[:, 2]
    np.testing.assert_allclose(there.norm, 2 + z, atol=step)
    assert (there.known == 1).all()
    hole = np.where(result.base.points[:, 2] > 0.5, -1, match.triangle)
    far = replace(foreign, correspondence=replace(match, triangle=hole))
    lost = _both.samples_there(replace(view, result=far, split=4)).known == 0
    assert lost[z > 0.5 + 2.5 * step].all()
    assert not lost[z < 0.4].any()


def test_partners_that_are_nodes_give_their_own_value(result):
    """Oracle: algebra. One node has lost its partner, so that the mesh is no longer the carried
    one: all others are partners, at distance 0, and their pieces have the base's value.
    """
    old, first = result.correspondence, np.arange(len(result.base.points)) == 0
    match = replace(
        old,
        triangle=np.where(first, -1, old.triangle),
        barycentric=np.where(first[:, None], np.nan, old.barycentric),
        distance=np.where(first, np.nan, old.distance),
        hits=np.where(first, 0, old.hits),
    )
    lost = replace(result, correspondence=match)
    assert not _both.is_carried(lost)
    view = prepare(result)
    there = _both.samples_there(replace(view, result=lost))
    apart = (result.base.triangles != 0).all(axis=1).repeat(view.split**2)
    np.testing.assert_allclose(there.norm[apart], view.samples.norm[apart], rtol=1e-6)


def test_texts_do_not_overlap(result, bowl):
    """Oracle: algebra. In every new picture, with long names, bands and legends."""
    choices = {**bowl.choices, "field": "velocity_magnitude_of_the_second_phase_" * 3}
    quiet = np.arange(len(bowl.base.points)) % 3 == 0
    far = replace(
        result, perturbed=icosphere(2), correspondence=iv.normal_rays(result.base, icosphere(2))
    )
    named = replace(bowl, choices=choices, significant=bowl.significant & ~quiet)
    for case in (result, named, far):
        for picture in (_both.both, overview, details):
            check_texts(picture(case))
    check_texts(dendrogram_figure(iv.dendrogram(result.change), 4, title="a title"))


_LINE = np.array([[0.0], [0.1], [5.0], [5.3], [20.0]])


def test_dendrogram_has_the_groups_of_its_cut():
    """Oracle: algebra. Three groups of five rows: two merges below the cut, two black above."""
    tree = iv.dendrogram(_LINE, linkage="single")
    labels = tree.cut(3).labels
    leaves = leaf_groups(tree, labels, 3)
    np.testing.assert_array_equal(leaves, labels)
    np.testing.assert_array_equal(node_groups(tree.merges, leaves)[5:], [0, 1, -1, -1])
    figure = dendrogram_figure(tree, 3)
    (lines,) = figure.axes[0].findobj(LineCollection)
    drawn = sorted(tuple(np.round(color[:3], 6)) for color in lines.get_color())
    black = to_rgb("#1a1a1a")
    wanted = [*map(tuple, group_colors(2)), black, black]
    assert drawn == sorted(tuple(np.round(color, 6)) for color in wanted)
    assert "3 groups: merged up to 0.3; the next merge needs 16 times that distance" in words(
        figure
    )


def test_cut_range_lies_between_merges():
    """Oracle: algebra. Merges at 1, 2, 4: k groups are left from the (4 - k)-th one on."""
    heights = np.array([1.0, 2.0, 4.0])
    assert cut_range(heights, 4) == (0.0, 1.0)
    assert cut_range(heights, 3) == (1.0, 2.0)
    assert cut_range(heights, 2) == (2.0, 4.0)
    assert cut_range(heights, 1) == (4.0, pytest.approx(4.32))


def test_dendrogram_of_a_sample_and_of_one_row():
    """Oracle: algebra. Sampled leaves keep the groups of all rows; one row is one group; fewer
    leaves than groups are refused.
    """
    rows = np.random.default_rng(77).normal(size=(400, 3)) + 9 * (np.arange(400) % 2)[:, None]
    tree = iv.dendrogram(rows, samples=50)
    labels = tree.cut(2).labels
    leaves = leaf_groups(tree, labels, 2)
    np.testing.assert_array_equal(leaves[tree.nearest], labels)
    assert "400 rows, 50 of them merged" in words(dendrogram_figure(tree, 2, last=8))
    assert "One group" in words(dendrogram_figure(iv.dendrogram(rows[:1]), 1))
    with pytest.raises(
        iv.ArgumentError, match="last: expected 5 or more for 5 groups, got 4"
    ) as error:
        dendrogram_figure(tree, 5, last=4)
    assert error.value.code == "A02"
