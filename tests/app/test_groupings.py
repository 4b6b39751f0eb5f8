"""Groups of the page for every count: those that the comparison itself would have made."""

from __future__ import annotations

import json
import pickle
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from saved_folder import dented_ball, folder_of

from isovary import color
from isovary.app import _groupings
from isovary.app._groupings import (
    counts_around,
    group_rows,
    groupings,
    palettes,
    saved_groups,
)
from isovary.app._saved_result import read_result
from isovary.clustering import fuzzy_c_means, k_medians
from isovary.errors import ArgumentError
from isovary.geometry import node_areas
from isovary.groups import groups_above_noise
from isovary.records import Clusters


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return folder_of(dented_ball(), tmp_path_factory.mktemp("grouped") / "out")


@pytest.fixture(scope="module")
def saved(folder):
    return read_result(folder)


def choosing(saved, **choices):
    return replace(saved, summary=saved.summary | {"choices": saved.choices | choices})


def test_the_count_of_the_comparison_gives_its_own_groups(saved):
    """Oracle: other package. The comparison's labels and centers, to the last bit."""
    count = saved.choices["groups"]
    ((found, clusters),) = groupings(saved, [count])
    assert found == count
    np.testing.assert_array_equal(clusters.labels, saved.labels)
    np.testing.assert_array_equal(clusters.centers, dented_ball().clusters.centers)


@pytest.mark.parametrize(
    ("words", "method", "weighted"),
    [
        ("k_medians", k_medians, True),
        ("k_medians(metric='l2', restarts=3)", partial(k_medians, metric="l2", restarts=3), False),
        ("fuzzy_c_means(metric='l2')", partial(fuzzy_c_means, metric="l2"), False),
    ],
)
def test_method_options_seed_and_weights_are_the_recorded_ones(saved, words, method, weighted):
    """Oracle: other package. The comparison's own grouping with these choices."""
    asked = choosing(saved, clustering=words, area_weighted=weighted, seed=3)
    weights = node_areas(saved.base.points, saved.base.triangles) if weighted else None
    for count, found in groupings(asked, [2, 4]):
        expected = groups_above_noise(
            saved.change,
            saved.noise_floor,
            saved.significant,
            count,
            partial(method, rng=3),
            weights,
        )
        np.testing.assert_array_equal(found.labels, expected.labels)
        assert (found.memberships is None) == (expected.memberships is None)


def test_nodes_below_the_noise_have_no_group(saved):
    """Oracle: data. Exactly the nodes that are not significant are in no group."""
    some = replace(saved, significant=saved.significant & (saved.base.points[:, 2] > 0))
    assert some.significant.any()
    for _, clusters in groupings(some, [2, 5]):
        np.testing.assert_array_equal(clusters.labels >= 0, some.significant)


def test_without_a_change_there_is_no_group(saved):
    """Oracle: limits. Nothing significant, nothing to group, and no row."""
    still = replace(saved, significant=np.zeros_like(saved.significant))
    for _, clusters in groupings(still, [2, 3]):
        assert (clusters.labels == -1).all()
        assert group_rows(still, clusters) == []
    assert len(saved_groups(replace(still, labels=np.full_like(saved.labels, -1))).centers) == 0


def test_each_count_is_clustered_once(saved, monkeypatch):
    """Oracle: data. With a noise above all differences each count falls to 1 by the others."""
    asked = []

    def counted(rows, count, **options):
        asked.append(count)
        return k_medians(rows, count, **options)

    monkeypatch.setitem(_groupings._CLUSTERINGS, "k_medians", counted)
    noisy = replace(saved, noise_floor=np.full_like(saved.noise_floor, 10.0))
    sizes = [len(clusters.centers) for _, clusters in groupings(noisy, [5, 3, 6, 2])]
    assert sizes == [1, 1, 1, 1]
    assert sorted(asked) == [1, 2, 3, 4, 5, 6]


def test_the_answers_pass_to_another_process(saved):
    """Oracle: inverse. Groups come out of a pickle as they went in, and rows are JSON."""
    (made,) = groupings(saved, [3])
    _, clusters = pickle.loads(pickle.dumps(made))
    np.testing.assert_array_equal(clusters.labels, made[1].labels)
    rows = group_rows(saved, clusters)
    assert json.loads(json.dumps(rows)) == rows


@pytest.mark.parametrize("words", ["my_own", "k_medians(rows=other)", "", "k_medians.__call__"])
def test_a_method_that_is_not_ours_is_told(saved, words):
    """Oracle: data. An unknown method cannot be run again; its saved groups can be shown."""
    other = choosing(saved, clustering=words)
    with pytest.raises(ArgumentError, match="clustering: expected one of k_medians") as told:
        next(groupings(other))
    assert told.value.code == "A02"
    np.testing.assert_array_equal(saved_groups(other).labels, saved.labels)


def test_summary_without_a_seed_and_counts_below_one(saved):
    """Oracle: data. Both end in an error with its code."""
    with pytest.raises(ArgumentError, match="and a seed"):
        next(groupings(choosing(saved, seed=None)))
    with pytest.raises(ArgumentError, match="counts: expected 1 or more, got 0"):
        next(groupings(saved, [0]))


def test_the_saved_groups_are_around_their_medians(saved):
    """Oracle: brute force. k-medians' centers are the medians of its groups."""
    ours = saved_groups(saved)
    np.testing.assert_allclose(ours.centers, dented_ball().clusters.centers, rtol=1e-12)


def test_counts_come_from_the_nearest_outward():
    """Oracle: algebra. Every count once, at distances that never shrink."""
    order = counts_around(9)
    assert sorted(order) == list(range(2, 13))
    away = [abs(count - 9) for count in order]
    assert away == sorted(away)


def test_a_group_keeps_its_colour(saved):
    """Oracle: algebra. The count of the pictures has their colours; halves keep or are new."""
    halves = np.repeat(np.arange(4), 3)
    two, four = Clusters(halves // 2, np.zeros((2, 1))), Clusters(halves, np.zeros((4, 1)))
    areas = np.repeat([1.0, 2.0, 4.0, 3.0], 3)
    made = palettes({2: two, 4: four}, 2, areas)
    np.testing.assert_array_equal(made[2], color.group_colors(2))
    np.testing.assert_array_equal(made[4][[1, 2]], made[2])  # the larger halves
    assert len(np.unique(made[4], axis=0)) == 4
    back = palettes({2: two, 4: four}, 4, areas)
    np.testing.assert_array_equal(back[4], color.group_colors(4))
    np.testing.assert_array_equal(back[2], back[4][[1, 2]])
    with pytest.raises(ArgumentError, match=r"start: expected one of \[2, 4\], got 3"):
        palettes({2: two, 4: four}, 3, areas)


def test_colours_stay_when_counts_are_added(saved):
    """Oracle: data. Added from the nearest outward, what is there keeps its colours."""
    found, before = {}, {}
    areas = node_areas(saved.base.points, saved.base.triangles)
    for count, clusters in groupings(saved, counts_around(3, range(2, 7))):
        found[count] = clusters
        made = palettes(found, 3, areas)
        for old, colors in before.items():
            np.testing.assert_array_equal(made[old], colors)
        before = made
    assert all(len(made[count]) == len(found[count].centers) for count in found)


def test_rows_tell_area_change_and_scale(saved):
    """Oracle: analytic. Half a ball of area 4 pi, changed by 20 % at one time alone."""
    columns = len(saved.columns)
    upper = saved.base.points[:, 2] > 0
    change = np.zeros_like(saved.change)
    change[upper, 7] = 0.2 * columns
    known = replace(saved, change=change)
    centers = np.array([np.zeros(columns), change[upper][0]])
    palette = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    first, second = group_rows(known, Clusters(upper.astype(int), centers), palette)
    assert (first["number"], first["rank"], second["rank"]) == (1, 1, 2)
    assert (first["color"], second["color"]) == ("#0000ff", "#ff0000")
    assert first["area_percent"] + second["area_percent"] == pytest.approx(100)
    assert first["area"] == pytest.approx(2 * np.pi, rel=0.1)
    assert first["area"] + second["area"] == pytest.approx(4 * np.pi, rel=1e-2)
    assert first["mean_change_percent"] == pytest.approx(20)
    assert (first["column"], first["at"]) == (7, saved.columns[7])
    assert first["radius"] == pytest.approx(2 * np.sqrt(saved.columns[7]))
    assert first["change_percent"] == pytest.approx(20 * columns)
    assert first["nodes"] == upper.sum()
    assert first["place"][2] > 0
