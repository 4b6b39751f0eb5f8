"""Groups of nodes that changed alike: how many there are, and what is said of each."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

import isovary as iv
from isovary.groups import group_table, groups_above_noise

SPHERE = iv.icosphere(4, order=1)


def planted(sizes=(0.0, 1.0, 1.2)):
    """Three rings of a sphere that changed by so much, the first a little noisily."""
    ring = np.digitize(SPHERE.points[:, 2], [-0.4, 0.5])
    change = np.outer(np.array(sizes)[ring], [1.0, -2.0])
    return change, ring


@pytest.mark.parametrize(("noise", "count"), [(0.05, 3), (0.2, 2), (2.0, 1)])
def test_groups_nearer_than_their_noise_are_one(noise, count):
    """Oracle: analytic. Centers 0.3 (the two large) and 1.5 apart in the norm; noise doubled."""
    change, _ = planted()
    floor = np.full(change.shape, noise)
    everywhere = np.ones(len(change), dtype=bool)
    found = groups_above_noise(change, floor, everywhere, 3, partial(iv.k_medians, rng=1))
    assert len(found.centers) == count


def test_what_is_not_significant_has_no_group():
    """Oracle: algebra. Label -1 there; no group at all if nothing is significant."""
    change, ring = planted()
    floor = np.full(change.shape, 1e-3)
    cluster = partial(iv.k_medians, rng=1)
    found = groups_above_noise(change, floor, ring > 0, 2, cluster)
    np.testing.assert_array_equal(found.labels, ring - 1)
    nothing = groups_above_noise(change, floor, ring > 5, 2, cluster)
    assert (nothing.labels == -1).all()
    assert len(nothing.centers) == 0


def test_weights_reach_the_method():
    """Oracle: algebra. The method is given the areas it is asked to weigh with, or none."""
    change, _ = planted()
    floor = np.full(change.shape, 1e-3)
    seen = []

    def spying(rows, count, **options):
        seen.append(options)
        return iv.k_medians(rows, count)

    everywhere = np.ones(len(change), dtype=bool)
    areas = np.linspace(1, 2, len(change))
    groups_above_noise(change, floor, everywhere, 3, spying, areas)
    groups_above_noise(change, floor, everywhere, 3, spying)
    assert seen[0]["weights"] is areas
    assert seen[1] == {}


def test_the_table_says_what_each_group_is():
    """Oracle: analytic. Caps and a band of a sphere: areas by Archimedes, the largest column."""
    change, ring = planted()
    clusters = iv.Clusters(ring, np.array([[0.0, 0], [1, -2], [1.2, -2.4]]))
    rows = group_table(SPHERE, clusters, change)
    assert [row.rank for row in rows] == [3, 2, 1]
    assert [row.mean_change for row in rows] == pytest.approx([0, 1.5, 1.8])
    assert [row.column for row in rows] == [1, 1, 1]
    assert [row.change for row in rows] == pytest.approx([0, -2.0, -2.4])
    np.testing.assert_allclose([row.area_share for row in rows], [0.3, 0.45, 0.25], atol=0.01)
    assert sum(row.nodes for row in rows) == len(ring)
    assert rows[2].place[2] > 0.5


def test_growth_is_no_groups_own_scale():
    """Oracle: analytic. All grow by 5 at the last time; one ring changed by 1 at the first."""
    _, ring = planted()
    change = np.column_stack([1.0 * (ring == 2), 5.0 + 0 * ring])
    clusters = iv.Clusters((ring == 2).astype(int), np.array([[0.0, 5], [1, 5]]))
    _, changed = group_table(SPHERE, clusters, change)
    assert (changed.column, changed.change) == (0, 1.0)


def test_a_comparison_takes_any_method_and_tells_it():
    """Oracle: data. Fuzzy groups by area: memberships come along, the choices tell."""

    def ball(radius):
        return iv.ScalarField.from_function(
            lambda p: radius - np.linalg.norm(p / [1.0, 1.0, 1.3], axis=-1),
            ((-1.8,) * 3, (1.8,) * 3),
            (21, 21, 21),
        )

    result = iv.compare(
        ball(1.0),
        ball(1.05),
        0.0,
        vertices=80,
        pairs=40,
        times=8,
        groups=2,
        clustering=partial(iv.fuzzy_c_means, fuzziness=1.5),
        area_weighted=True,
    )
    assert result.clusters.memberships is not None
    known = result.clusters.labels >= 0
    np.testing.assert_allclose(result.clusters.memberships[known].sum(axis=1), 1, rtol=1e-12)
    assert result.choices["clustering"] == "fuzzy_c_means(fuzziness=1.5)"
    assert result.choices["area_weighted"] is True
    assert len(result.group_table) == len(result.clusters.centers)
