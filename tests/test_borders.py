"""Borders of groups: triangles cut exactly where one group ends."""

from __future__ import annotations

import numpy as np
import pytest

import isovary as iv
from isovary.geometry import linear_triangles, triangle_areas
from isovary.view._borders import NO_GROUP, NOT_KNOWN, group_pieces, node_labels
from isovary.view._paint import Samples


def samples(scores, inside=None, known=None) -> Samples:
    """Of nodes that are all in a group and known unless it is said."""
    n = len(scores)
    one = np.ones(n)
    inside = one if inside is None else inside
    return Samples(
        norm=one,
        noise=0 * one,
        margin=one,
        group_margin=inside,
        scores=scores,
        displacement=0 * one,
        known=one if known is None else known,
        found=one,
        memberships=np.empty((n, 0)),
    )


def one_triangle() -> iv.Surface:
    return iv.Surface(np.eye(3), np.array([[0, 1, 2]]), np.full((3, 3), 3**-0.5))


def drawn(surface, made):
    """All triangles, whole or cut: corners' places (q, 3, 3) and labels (q,)."""
    pieces, labels = group_pieces(surface, made), node_labels(made)
    whole = linear_triangles(surface.triangles)
    whole = whole[(labels[whole] == labels[whole[:, :1]]).all(axis=1)]
    places = np.vstack([surface.points, pieces.points(surface.points)])
    triangles = np.vstack([whole, pieces.triangles])
    return places[triangles], np.concatenate([labels[whole[:, 0]], pieces.labels])


def areas(corners):
    return triangle_areas(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))


@pytest.fixture(scope="module")
def sphere():
    return iv.icosphere(2)


@pytest.fixture(scope="module")
def square():
    return iv.sheet(1.0, 1.0, (7, 7), order=1)


def test_a_straight_border_is_straight(square):
    """Oracle: analytic. Two groups equally near on a line: the areas beside it are exact."""
    x, y, _ = square.points.T
    away = x + 0.31 * y - 0.2
    corners, labels = drawn(square, samples(np.column_stack([away, -away])))
    side = corners[..., 0] + 0.31 * corners[..., 1] - 0.2
    assert (side[labels == 0] < 1e-12).all()
    assert (side[labels == 1] > -1e-12).all()
    low, high = square.points.min(axis=0), square.points.max(axis=0)
    cut = [0.2 - 0.31 * low[1] - low[0], 0.2 - 0.31 * high[1] - low[0]]  # trapezium's two sides
    assert areas(corners)[labels == 0].sum() == pytest.approx(
        (high - low)[1] * np.mean(cut), rel=1e-12
    )


def test_pieces_cover_the_surface_once(sphere):
    """Oracle: algebra. Random scores of four groups and of none: area and facing as the whole."""
    random = np.random.default_rng(3)
    made = samples(random.random((len(sphere.points), 4)), random.normal(size=len(sphere.points)))
    corners, labels = drawn(sphere, made)
    whole = areas(sphere.points[linear_triangles(sphere.triangles)])
    assert areas(corners).sum() == pytest.approx(whole.sum(), rel=1e-12)
    a, b, c = corners.transpose(1, 0, 2)
    real = areas(corners) > 1e-12
    assert ((np.cross(b - a, c - a) * a).sum(axis=1)[real] > 0).all()
    assert set(labels) == {NO_GROUP, 0, 1, 2, 3}


def test_a_group_without_a_corner_has_its_piece():
    """Oracle: analytic. Scores 10 b and 10 a against 4: the third is nearest along the middle."""
    one = iv.Surface(
        np.eye(3)[[0, 1, 2]], np.array([[0, 1, 2]]), np.tile(np.ones(3) / 3**0.5, (3, 1))
    )
    scores = np.array([[0.0, 10, 4], [10, 0, 4], [0, 10, 4]])
    corners, labels = drawn(one, samples(scores))
    # on the way from 0 to 1 the first score is 10 s: the third wins for 0.4 < s < 0.6
    part = areas(corners)[labels == 2].sum() / areas(corners).sum()
    assert part == pytest.approx(0.6**2 - 0.4**2)


def test_unknown_corners_own_what_is_nearest():
    """Oracle: symmetry. A known and two unknown corners: a third of the triangle each."""
    one = one_triangle()
    made = samples(np.zeros((3, 1)), known=np.array([1.0, 0.0, 0.0]))
    corners, labels = drawn(one, made)
    share = areas(corners)[labels == NOT_KNOWN].sum() / areas(corners).sum()
    assert share == pytest.approx(2 / 3)
    assert set(labels) == {NOT_KNOWN, 0}


def test_neighbours_share_their_points(sphere):
    """Oracle: algebra. Every edge of the drawn triangles has two sides: no gap, no crack."""
    z = sphere.points[:, 2] + 0.1 * sphere.points[:, 0]
    made = samples(np.column_stack([z, -z, np.full(len(z), -0.3)]))
    pieces, labels = group_pieces(sphere, made), node_labels(made)
    whole = linear_triangles(sphere.triangles)
    whole = whole[(labels[whole] == labels[whole[:, :1]]).all(axis=1)]
    triangles = np.vstack([whole, pieces.triangles])
    edges = np.sort(np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]))
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
