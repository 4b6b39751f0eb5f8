"""Groups in which each row has one place: held to brute force, to SciPy, and to copies of rows."""

from __future__ import annotations

from inspect import signature
from itertools import combinations, product

import numpy as np
import pytest
from scipy.cluster import hierarchy
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist, pdist

from isovary.clustering._agglomerative import agglomerative, dendrogram
from isovary.clustering._k_medians import k_medians, middles_of
from isovary.clustering._k_medoids import k_medoids
from isovary.clustering._norm_bins import norm_bins
from isovary.clustering._rows import checked_rows
from isovary.errors import ArgumentError, ClusterError

CDIST = {"l1": "cityblock", "l2": "euclidean"}
METRICS = ["l1", "l2"]
GROUPINGS = {
    "medians": k_medians,
    "means": lambda rows, count, **more: k_medians(rows, count, metric="l2", **more),
    "medoids": k_medoids,
    "medoids, sampled": lambda rows, count, **more: k_medoids(rows, count, samples=60, **more),
    "average": agglomerative,
    "average, sampled": lambda rows, count, **more: agglomerative(rows, count, samples=60, **more),
    "ward": lambda rows, count, **more: agglomerative(
        rows, count, metric="l2", linkage="ward", **more
    ),
}


def same_groups(first, second):
    """Whether two labellings differ by their numbers only."""
    pairs = {(int(a), int(b)) for a, b in zip(first, second, strict=True)}
    return len(pairs) == len(set(first)) == len(set(second))


def kinds_of_equal_norm(copies, rng):
    """Bumps of one height early, in the middle and late, and one that falls; noise of 1 %."""
    times = np.arange(40)
    bumps = [np.exp(-(((times - place) / 2) ** 2)) for place in (10, 20, 30)]
    truth = np.repeat(np.arange(4), copies)
    rows = np.array([*bumps, -bumps[1]])[truth]
    return rows + 0.01 * rng.standard_normal(rows.shape), truth


@pytest.mark.parametrize("method", GROUPINGS.values(), ids=GROUPINGS)
def test_kinds_of_equal_norm_are_separated(method):
    """Oracle: analytic. Four kinds, 350 times the noise apart, in whatever order they come."""
    rng = np.random.default_rng(8)
    rows, truth = kinds_of_equal_norm([30, 200, 50, 20], rng)
    order = rng.permutation(len(rows))
    found = method(rows[order], 4, weights=rng.uniform(0.5, 2, len(rows)), rng=3)
    assert same_groups(found.labels, truth[order])
    assert (np.diff(np.abs(found.centers).sum(axis=1)) >= 0).all()


@pytest.mark.parametrize("metric", METRICS)
def test_norm_bins_merge_kinds_of_equal_norm(metric):
    """Oracle: analytic. All norms lie within some per cent of one another: one bin of four."""
    rows, truth = kinds_of_equal_norm(25, np.random.default_rng(8))
    rows[truth == 0] /= 3
    found = norm_bins(rows, 4, metric=metric)
    np.testing.assert_array_equal(found.labels == found.labels[0], truth == 0)
    assert len(found.centers) == 2


def test_bins_are_equally_wide_from_zero_to_the_largest():
    """Oracle: analytic. Edges 0, 2, 4, 6, 8: an edge belongs to the bin above, the last to the
    last; unknown rows stay so, and two empty bins give no group."""
    norms = np.array([8.0, 0.0, 1.9, 2.0, np.nan, 3.9])
    found = norm_bins(norms[:, None] * [1.0, 0.0], 4)
    np.testing.assert_array_equal(found.labels, [2, 0, 0, 1, -1, 1])
    np.testing.assert_allclose(found.centers, [[0.95, 0], [2.95, 0], [8, 0]], rtol=1e-15)


def test_bins_know_their_norm():
    """Oracle: analytic. Norms 8, 5, 0.2 or 5.7, 5, 0.1: 5 is in the last third of 5.7 only."""
    rows = np.array([[4.0, 4.0], [5.0, 0.0], [0.1, 0.1]])
    assert norm_bins(rows, 3).labels.tolist() == [2, 1, 0]
    assert norm_bins(rows, 3, metric="l2").labels.tolist() == [1, 1, 0]


def test_rows_without_change_are_one_bin():
    """Oracle: algebra. The largest norm is 0: no width to divide, one group of all."""
    np.testing.assert_array_equal(norm_bins(np.zeros((3, 2)), 1).labels, [0, 0, 0])
    np.testing.assert_array_equal(agglomerative(np.zeros((3, 2)), 1).labels, [0, 0, 0])
    np.testing.assert_array_equal(agglomerative(np.zeros((1, 2)), 1).labels, [0])
    np.testing.assert_array_equal(k_medoids(np.zeros((3, 2)), 1).labels, [0, 0, 0])


def scatter(metric, rows, weights, labels):
    """The cost of k-medians or k-means, on copies of the rows."""
    copies, labels = np.repeat(rows, weights, axis=0), np.repeat(labels, weights)
    groups = [copies[labels == g] for g in set(labels)]
    if metric == "l1":
        return sum(np.abs(g - np.median(g, axis=0)).sum() for g in groups)
    return sum(((g - g.mean(axis=0)) ** 2).sum() for g in groups)


@pytest.mark.parametrize("metric", METRICS)
@pytest.mark.parametrize("seed", range(3))
def test_k_medians_takes_a_weight_for_copies(metric, seed):
    """Oracle: algebra. The least cost over all 3^8 partitions of copies, and their medians."""
    rng = np.random.default_rng(seed)
    rows, weights = rng.random((8, 2)), rng.integers(1, 5, 8)
    found = k_medians(rows, 3, metric=metric, weights=0.7 * weights, restarts=30)
    best = min(scatter(metric, rows, weights, np.array(way)) for way in product(range(3), repeat=8))
    assert scatter(metric, rows, weights, found.labels) == pytest.approx(best, rel=1e-12)
    for group, center in enumerate(found.centers):
        copies = np.repeat(rows, weights * (found.labels == group), axis=0)
        lower = np.sort(copies, axis=0)[(len(copies) - 1) // 2]
        expected = lower if metric == "l1" else copies.mean(axis=0)
        np.testing.assert_allclose(center, expected, rtol=1e-12)


@pytest.mark.parametrize("metric", METRICS)
def test_k_medians_ends_where_nothing_moves(metric):
    """Oracle: algebra. Rows without structure: each is nearest to the center of its group."""
    rng = np.random.default_rng(23)
    rows, weights = rng.random((400, 6)), rng.uniform(0.2, 3, 400)
    found = k_medians(rows, 6, metric=metric, weights=weights, restarts=1)
    nearest = cdist(rows, found.centers, CDIST[metric]).argmin(axis=1)
    np.testing.assert_array_equal(found.labels, nearest)


def test_lower_weighted_medians():
    """Oracle: analytic. Half the weight exactly: the lower of the two; alike: their middle."""
    rows, labels = np.array([[4.0], [1.0], [2.0], [9.0]]), np.zeros(4, dtype=np.int64)
    for weights, median in (([1, 1, 2, 2], 2.0), ([2, 1, 1, 2], 4.0), ([0.1] * 4, 3.0)):
        middles = middles_of(rows, np.array(weights, dtype=float), "l1")
        assert middles(labels, 1).item() == median
    middles = middles_of(rows, np.array([0.1, 0.1, 0.2, 0.4]), "l1")  # 0.4 of 0.8
    assert middles(labels, 1).item() == 4.0


@pytest.mark.parametrize("metric", METRICS)
def test_many_rows_are_finished_on_all(metric):
    """Oracle: algebra. Beyond the sample, too, the centers are the groups' own middles, each
    row is nearest to its own, and the same seed gives the same bits."""
    rng = np.random.default_rng(4)
    rows, truth = kinds_of_equal_norm(1100, rng)
    weights = rng.uniform(0.5, 2, len(rows))
    found, again = (k_medians(rows, 4, metric=metric, weights=weights, rng=6) for _ in range(2))
    assert same_groups(found.labels, truth)
    np.testing.assert_array_equal(found.centers, again.centers)
    nearest = cdist(rows, found.centers, CDIST[metric]).argmin(axis=1)
    np.testing.assert_array_equal(found.labels, nearest)
    for group, center in enumerate(found.centers):
        mine = found.labels == group
        if metric == "l2":
            expected = np.average(rows[mine], axis=0, weights=weights[mine])
        else:
            expected = np.quantile(
                rows[mine], 0.5, axis=0, weights=weights[mine], method="inverted_cdf"
            )
        np.testing.assert_allclose(center, expected, rtol=1e-12)


@pytest.mark.parametrize("method", [k_medians, k_medoids], ids=["medians", "medoids"])
def test_rare_rows_that_no_sample_shows_are_found(method):
    """Oracle: analytic. 9000 times 0, once 5 and once 7: three groups cost nothing."""
    rows = np.zeros((9002, 2))
    rows[100], rows[7000] = 5, 7
    more = {"samples": 50} if method is k_medoids else {}
    found = method(rows, 3, **more)
    np.testing.assert_array_equal(found.centers, [[0, 0], [5, 5], [7, 7]])
    assert (np.bincount(found.labels) == [9000, 1, 1]).all()


def cost_of(medoids, rows, weights, metric):
    return (weights * cdist(rows, medoids, CDIST[metric]).min(axis=1)).sum()


@pytest.mark.parametrize("metric", METRICS)
@pytest.mark.parametrize("count", [1, 2, 4])
def test_the_best_medoids_of_a_small_set(metric, count):
    """Oracle: algebra. The least cost over all sets of rows; a weight stands for copies."""
    rng = np.random.default_rng(count)
    for _ in range(5):
        rows, weights = rng.random((14, 3)), rng.integers(1, 5, 14)
        found = k_medoids(rows, count, metric=metric, weights=0.3 * weights, restarts=40)
        best = min(
            cost_of(rows[list(way)], rows, weights, metric)
            for way in combinations(range(14), count)
        )
        assert cost_of(found.centers, rows, weights, metric) == pytest.approx(best, rel=1e-12)
        assert (rows[:, None] == found.centers).all(axis=2).any(axis=0).all()
        copies = np.repeat(rows, weights, axis=0)
        among = k_medoids(copies, count, metric=metric, restarts=40).centers
        assert cost_of(among, rows, weights, metric) == pytest.approx(best, rel=1e-12)


@pytest.mark.parametrize("metric", METRICS)
def test_no_exchange_of_a_medoid_lowers_the_cost(metric):
    """Oracle: algebra. One start, and all exchanges of one medoid tried afterwards."""
    rng = np.random.default_rng(11)
    for _ in range(15):
        rows, weights = rng.random((120, 3)), rng.uniform(0.2, 3, 120)
        found = k_medoids(rows, 7, metric=metric, weights=weights, restarts=1)
        cost = cost_of(found.centers, rows, weights, metric)
        table = cdist(rows, rows, CDIST[metric])
        for left_out in range(7):
            rest = cdist(rows, np.delete(found.centers, left_out, axis=0), CDIST[metric])
            exchanged = weights @ np.minimum(rest.min(axis=1)[:, None], table)
            assert exchanged.min() >= cost * (1 - 1e-12)


def test_the_lone_medoid_of_a_line_is_its_weighted_median():
    """Oracle: analytic. Also where samples only see forty of 1501 rows."""
    rng = np.random.default_rng(19)
    rows, weights = rng.random((1501, 1)), rng.pareto(1.5, 1501) + 0.1
    median = np.quantile(rows[:, 0], 0.5, weights=weights, method="inverted_cdf")
    for samples in (40, 1501):
        found = k_medoids(rows, 1, weights=weights, samples=samples, restarts=2)
        assert found.centers.item() == median


def test_near_duplicates_end():
    """Oracle: algebra. Groups a million times their widths apart, where a sum of large terms
    would drown what an exchange gains: no exchange within a group lowers its cost."""
    rng = np.random.default_rng(2)
    places = 1e6 * rng.random((5, 3))
    truth = np.repeat(np.arange(5), 40)
    rows = places[truth] + 1e-4 * rng.random((200, 3))
    found = k_medoids(rows, 5, restarts=2)
    assert same_groups(found.labels, truth)
    for group, center in enumerate(found.centers):
        mine = rows[found.labels == group]
        costs = cdist(mine, mine, "cityblock").sum(axis=0)
        assert cdist(mine, [center], "cityblock").sum() == pytest.approx(costs.min(), rel=1e-9)


@pytest.mark.parametrize("metric", METRICS)
def test_sampled_medoids_cost_little_more(metric):
    """Oracle: convergence. From samples of a fifteenth, finished on all rows, within 1 % of
    the swaps on the whole matrix."""
    rng = np.random.default_rng(5)
    rows, _ = kinds_of_equal_norm(375, rng)
    rows *= rng.uniform(0.7, 1.3, (len(rows), 1))
    weights = rng.uniform(0.2, 3, len(rows))
    more = {"metric": metric, "weights": weights}
    few, again, all_ = (k_medoids(rows, 4, samples=s, **more).centers for s in (100, 100, 1500))
    np.testing.assert_array_equal(few, again)
    assert cost_of(few, rows, weights, metric) <= 1.01 * cost_of(all_, rows, weights, metric)
    assert (rows[:, None] == few).all(axis=2).any(axis=0).all()


LINKAGES = [(link, m) for link in ("average", "complete", "single") for m in METRICS]


@pytest.mark.parametrize(("linkage", "metric"), [*LINKAGES, ("ward", "l2")])
def test_merged_groups_are_those_of_scipy(linkage, metric):
    """Oracle: peer. SciPy's linkage and fcluster on its own distances; one tree for all cuts."""
    rng = np.random.default_rng(9)
    rows = rng.random((80, 4))
    rows[::9, 2] = np.nan
    known = np.isfinite(rows).all(axis=1)
    tree = hierarchy.linkage(pdist(rows[known], CDIST[metric]), linkage)
    weights = rng.uniform(0.2, 3, 80)
    ours = dendrogram(rows, metric=metric, linkage=linkage, weights=weights)
    np.testing.assert_allclose(ours.merges, tree, rtol=1e-12)
    for count in (1, 2, 5, 30):
        found = agglomerative(rows, count, metric=metric, linkage=linkage, weights=weights)
        assert (found.labels[~known] == -1).all()
        assert same_groups(found.labels[known], hierarchy.fcluster(tree, count, "maxclust"))
        np.testing.assert_array_equal(ours.cut(count).labels, found.labels)
        np.testing.assert_array_equal(ours.cut(count).centers, found.centers)


def test_rows_beyond_the_sample_follow_the_nearest_in_it():
    """Oracle: peer. SciPy's tree of the sample and its k-d tree in the 1-norm."""
    rows = np.random.default_rng(13).random((5000, 3))
    found = agglomerative(rows, 6, samples=120, rng=31)
    sample = checked_rows(rows, 6).sample(120, np.random.default_rng(31)).data
    groups = hierarchy.fcluster(hierarchy.linkage(sample, "average", "cityblock"), 6, "maxclust")
    _, nearest = cKDTree(sample).query(rows, p=1)
    assert same_groups(found.labels, groups[nearest])
    for group, center in enumerate(found.centers):
        np.testing.assert_allclose(center, np.median(rows[found.labels == group], axis=0))


def test_up_to_6000_rows_nothing_is_left_to_chance():
    """Oracle: peer. SciPy's tree of all rows of a mesh of usual size, whatever the seed."""
    rows = np.random.default_rng(14).random((3500, 2))
    found = agglomerative(rows, 5, rng=2)
    groups = hierarchy.fcluster(hierarchy.linkage(rows, "average", "cityblock"), 5, "maxclust")
    assert same_groups(found.labels, groups)
    assert signature(agglomerative).parameters["samples"].default == 6000
    assert signature(dendrogram).parameters["samples"].default == 6000


def test_merges_draw_and_weights_move_the_centers():
    """Oracle: analytic. Two pairs; the mean of rows 0 and 1 that weigh 3 and 1 is 1/4."""
    rows = np.array([[0.0], [1.0], [9.0], [9.5]])
    tree = dendrogram(rows, metric="l2", linkage="ward", weights=[3, 1, 1, 1])
    assert hierarchy.is_valid_linkage(tree.merges)
    assert set(hierarchy.dendrogram(tree.merges, no_plot=True)["leaves"]) == {0, 1, 2, 3}
    np.testing.assert_allclose(tree.cut(2).centers, [[0.25], [9.25]], rtol=1e-15)
    assert repr(tree) == "Dendrogram(4 leaves, 4 rows)"
    with pytest.raises(ValueError, match="read-only"):
        tree.merges[0, 0] = 1


def test_the_order_of_the_rows_does_not_matter():
    """Oracle: symmetry. Without ties nothing is left to chance in merges and bins."""
    rng = np.random.default_rng(15)
    rows, order = rng.random((300, 3)), rng.permutation(300)
    rows.setflags(write=False)
    for method in (agglomerative, norm_bins):
        first, second = method(rows, 5), method(rows[order], 5)
        np.testing.assert_array_equal(first.labels[order], second.labels)
        np.testing.assert_allclose(first.centers, second.centers, rtol=1e-12)


ROWS = np.arange(8.0).reshape(4, 2)


@pytest.mark.parametrize(
    ("call", "error", "text"),
    [
        (lambda: agglomerative(ROWS, 2, linkage="ward"), ArgumentError, "expected l2 for ward"),
        (lambda: agglomerative(ROWS, 2, linkage="centroid"), ArgumentError, "got centroid.*A02"),
        (lambda: dendrogram(ROWS, samples=0), ArgumentError, "samples: expected 1.*A02"),
        (lambda: dendrogram(ROWS).cut(0), ArgumentError, "count: expected 1 or more.*A02"),
        (lambda: dendrogram(ROWS).cut(5), ClusterError, "at most 4 groups.*K02"),
        (lambda: dendrogram(ROWS * np.nan), ClusterError, "at most 0 groups.*K02"),
        (lambda: agglomerative(np.zeros((3, 2)), 2), ClusterError, "at most 1 groups.*K02"),
        (lambda: k_medoids(ROWS, 3, samples=2), ArgumentError, "samples: expected.*3.*A02"),
        (lambda: k_medoids(ROWS, 2, restarts=0), ArgumentError, "restarts: expected 1.*A02"),
        (lambda: k_medians(ROWS, 2, restarts=0), ArgumentError, "restarts: expected 1.*A02"),
        (lambda: k_medoids(ROWS, 2, metric="l3"), ArgumentError, "metric: expected.*A02"),
        (lambda: k_medians(ROWS, 2, weights=[1, 0, 1, 1]), ArgumentError, "weights.*A02"),
        (lambda: norm_bins(ROWS, 5), ClusterError, "at most 4 groups.*K02"),
        (lambda: norm_bins(ROWS[0], 1), ArgumentError, "rows: expected shape.*A03"),
    ],
)
def test_what_cannot_be_grouped_is_refused(call, error, text):
    """Oracle: data. The error, its code and what it names."""
    with pytest.raises(error, match=text):
        call()
