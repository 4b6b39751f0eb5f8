"""Groups by degrees: fuzzy c-means, deterministic annealing, and the choice of their number."""

from __future__ import annotations

from functools import partial
from itertools import permutations

import numpy as np
import pytest

from isovary.clustering import _deterministic_annealing as annealing_module
from isovary.clustering import _fuzzy_c_means as fuzzy_module
from isovary.clustering import k_medians
from isovary.clustering._choose_count import (
    CountChoice,
    adjusted_rand_index,
    choose_count,
    silhouette,
)
from isovary.clustering._deterministic_annealing import annealing, deterministic_annealing
from isovary.clustering._fuzzy_c_means import fuzzy_c_means
from isovary.clustering._rows import checked_rows
from isovary.errors import ArgumentError, ClusterError
from isovary.row_distances import distances

METRICS = ("l1", "l2")
SOFT = {
    "fuzzy l1": fuzzy_c_means,
    "fuzzy l2": partial(fuzzy_c_means, metric="l2"),
    "annealing": deterministic_annealing,
}
each_method = pytest.mark.parametrize("method", SOFT.values(), ids=SOFT)
each_metric = pytest.mark.parametrize("metric", METRICS)


def planted(rng, count, size=80, columns=4):
    """Rows around corners of a simplex at distances of 14 spreads, and their groups."""
    truth = np.repeat(np.arange(count), size)
    corners = 10 * np.eye(columns)[:count] * (1 + 0.1 * np.arange(count)[:, None])
    return corners[truth] + rng.standard_normal((len(truth), columns)), truth


def boxes(rng, size=800):
    """Two far boxes, uniformly filled, one long along its first side, one along its second."""
    one = rng.uniform(-1, 1, (size, 2)) * [4, 1]
    other = rng.uniform(-1, 1, (size, 2)) * [1, 2] + [80, 0]
    return one, other


def largest_variance(rows, weights=None):
    covariance = np.cov(rows.T, bias=True, aweights=weights)
    return np.linalg.eigvalsh(np.atleast_2d(covariance))[-1]


def functional(rows, weights, centers, shares, metric, fuzziness):
    """J as the docstring has it, written with loops over groups."""
    apart = [np.abs(rows - center) for center in centers]
    cost = [a.sum(axis=1) if metric == "l1" else (a**2).sum(axis=1) for a in apart]
    return sum(weights @ (shares[:, k] ** fuzziness * c) for k, c in enumerate(cost))


@each_method
def test_planted_groups_are_found_and_memberships_sum_to_one(method):
    """Oracle: analytic. Groups at 14 spreads; sums to rounding; labels are the largest shares."""
    rows, truth = planted(np.random.default_rng(1), 4)
    found = method(rows, 4, rng=3)
    np.testing.assert_array_equal(found.labels, truth)
    assert (np.diff(np.abs(found.centers).sum(axis=1)) > 0).all()
    np.testing.assert_allclose(found.memberships.sum(axis=1), 1, rtol=1e-14)
    np.testing.assert_array_equal(found.memberships.argmax(axis=1), truth)


@each_method
def test_same_seed_same_bits_and_permuted_rows_the_same_groups(method):
    """Oracle: symmetry. Twice the same bits; another order of rows, the same centers."""
    rng = np.random.default_rng(2)
    rows, _ = planted(rng, 3)
    before = rows.copy()
    first, second = (method(rows, 3, rng=5) for _ in range(2))
    np.testing.assert_array_equal(rows, before)
    np.testing.assert_array_equal(first.memberships, second.memberships)
    np.testing.assert_array_equal(first.centers, second.centers)
    order = rng.permutation(len(rows))
    mixed = method(rows[order], 3, rng=5)
    np.testing.assert_array_equal(mixed.labels, first.labels[order])
    np.testing.assert_allclose(mixed.centers, first.centers, atol=1e-2)


@each_method
def test_unknown_rows_change_nothing(method):
    """Oracle: algebra. A row with NaN has label -1 and memberships NaN; the rest is as without."""
    rows, _ = planted(np.random.default_rng(4), 3, size=20)
    holes = np.insert(rows, [0, 30], np.nan, axis=0)
    found, alone = method(holes, 3), method(rows, 3)
    unknown = np.isnan(holes).any(axis=1)
    assert (found.labels[unknown] == -1).all()
    assert np.isnan(found.memberships[unknown]).all()
    np.testing.assert_array_equal(found.memberships[~unknown], alone.memberships)


@each_method
def test_a_weight_of_three_is_the_row_three_times(method):
    """Oracle: algebra. The functionals are sums over rows; to where the rounds stop."""
    rng = np.random.default_rng(6)
    rows, _ = planted(rng, 3, size=15)
    weights = rng.integers(1, 4, len(rows))
    weighed = method(rows, 3, weights=weights)
    repeated = method(np.repeat(rows, weights, axis=0), 3)
    np.testing.assert_allclose(weighed.centers, repeated.centers, atol=2e-2)
    np.testing.assert_array_equal(np.repeat(weighed.labels, weights), repeated.labels)
    unweighed = method(rows, 3)
    assert np.abs(unweighed.centers - weighed.centers).max() > 0.05


@each_method
def test_one_group_is_the_mean_or_the_median(method):
    """Oracle: analytic. Of three rows 0, 1, 5: the mean 2, the median 1; all belong wholly."""
    found = method(np.array([[0.0], [1.0], [5.0]]), 1)
    assert found.centers[0, 0] == pytest.approx(1 if method is fuzzy_c_means else 2)
    np.testing.assert_array_equal(found.memberships, 1)


@each_method
def test_what_cannot_be_is_refused(method):
    """Oracle: algebra. Two distinct rows give two groups; three are refused, and bad values."""
    rows = np.array([[1.0, 0]] * 7 + [[0.0, 1]] * 2)
    found = method(rows, 2)
    assert len(np.unique(found.labels[:7])) == len(np.unique(found.labels[7:])) == 1
    np.testing.assert_allclose(np.sort(found.centers, axis=0), [[0, 0], [1, 1]], atol=1e-9)
    with pytest.raises(ClusterError, match="K02"):
        method(rows, 3)
    with pytest.raises(ArgumentError, match="A03"):
        method(rows[0], 1)
    with pytest.raises(ArgumentError, match="A02"):
        method(rows, 2, weights=np.zeros(9))


@each_method
def test_rows_beyond_the_sample_are_grouped_too(method, monkeypatch):
    """Oracle: analytic. Tried on 60 of 400 rows, the groups are those of all; centers too.

    Medians can rest some rows of the 100 apart, 0.025 spreads each; those of the 15 or so
    rows of a group that were drawn would be 0.3 off.
    """
    monkeypatch.setattr(annealing_module, "_SAMPLE", 60)
    monkeypatch.setattr(fuzzy_module, "_SAMPLE", 60)
    rows, truth = planted(np.random.default_rng(7), 4, size=100)
    found = method(rows, 4, rng=1)
    np.testing.assert_array_equal(found.labels, truth)
    monkeypatch.undo()
    np.testing.assert_allclose(found.centers, method(rows, 4).centers, atol=0.1)


@each_method
def test_a_rare_row_that_no_sample_holds_is_a_group(method, monkeypatch):
    """Oracle: algebra. Three distinct rows, two of them rare, are three groups."""
    monkeypatch.setattr(annealing_module, "_SAMPLE", 10)
    monkeypatch.setattr(fuzzy_module, "_SAMPLE", 10)
    rows = np.repeat([[0.0, 0], [3, 0], [0, 5]], [500, 1, 1], axis=0)
    found = method(rows, 3)
    np.testing.assert_array_equal(found.labels[-3:], [0, 1, 2])


@pytest.mark.parametrize("seed", range(4))
def test_a_row_between_two_groups_goes_to_the_less_changed(seed):
    """Oracle: algebra. Medians 0 and 4, equal shares of the row 2: label 0 for any seed."""
    rows = np.array([[0.0], [0.0], [0.0], [2.0], [4.0], [4.0], [4.0]])
    found = fuzzy_c_means(rows, 2, rng=seed)
    np.testing.assert_array_equal(found.memberships[3], 0.5)
    np.testing.assert_array_equal(found.labels, [0, 0, 0, 0, 1, 1, 1])


@each_metric
@pytest.mark.parametrize("fuzziness", [1.3, 2.0, 3.5])
def test_no_round_raises_the_functional(metric, fuzziness):
    """Oracle: algebra. Memberships and centers are each the best for the other held."""
    rng = np.random.default_rng(8)
    rows, weights = rng.standard_normal((60, 3)), rng.random(60) + 0.1
    known = checked_rows(rows, 4, weights=weights)
    problem = fuzzy_module._problem(known, metric, fuzziness)
    centers = rows[:4]
    shares = np.full((60, 4), 0.25)
    values = [functional(rows, known.weights, centers, shares, metric, fuzziness)]
    for _ in range(12):
        shares = fuzzy_module._memberships(problem, centers)
        values.append(functional(rows, known.weights, centers, shares, metric, fuzziness))
        centers = fuzzy_module._centers(problem, centers, shares)
        values.append(functional(rows, known.weights, centers, shares, metric, fuzziness))
    assert (np.diff(values) <= 1e-12 * values[0]).all()
    assert values[-1] < 0.8 * values[0]
    own = fuzzy_module._functional(problem, centers, shares)
    assert own == pytest.approx(values[-1], rel=1e-12)


@each_metric
def test_no_step_away_from_the_result_lowers_the_functional(metric):
    """Oracle: algebra. The end is a minimum in the memberships, and in each center.

    The rounds stop where J falls by less than 1e-8 of itself, and a step may gain that much
    divided by one minus their rate.
    """
    rng = np.random.default_rng(9)
    rows, _ = planted(rng, 3, size=40, columns=3)
    found = fuzzy_c_means(rows, 3, metric=metric)
    weights = np.ones(len(rows))
    least = functional(rows, weights, found.centers, found.memberships, metric, 2.0)
    for _ in range(40):
        shift = 0.05 * rng.standard_normal(found.centers.shape)
        moved = functional(rows, weights, found.centers + shift, found.memberships, metric, 2.0)
        other = found.memberships * rng.uniform(0.9, 1.1, found.memberships.shape)
        other /= other.sum(axis=1, keepdims=True)
        mixed = functional(rows, weights, found.centers, other, metric, 2.0)
        assert min(moved, mixed) > least * (1 - 1e-7)


@each_metric
def test_memberships_are_bezdeks(metric):
    """Oracle: analytic. 1 / sum_j (cost_k / cost_j)^(1 / (m - 1)) for rows off the centers."""
    rng = np.random.default_rng(10)
    rows = rng.standard_normal((50, 3))
    found = fuzzy_c_means(rows, 3, metric=metric, fuzziness=1.7)
    cost = distances(rows, found.centers, metric) ** (1 if metric == "l1" else 2)
    expected = 1 / ((cost[:, :, None] / cost[:, None, :]) ** (1 / 0.7)).sum(axis=2)
    np.testing.assert_allclose(found.memberships, expected, rtol=1e-10)


@each_metric
def test_a_row_on_a_center_belongs_to_it_wholly(metric):
    """Oracle: algebra. Alone: 1; where two centers coincide: one half each, never NaN."""
    rows = np.array([[0.0, 0], [1, 1], [4, 0]])
    problem = fuzzy_module._problem(checked_rows(rows, 3), metric, 2.0)
    shares = fuzzy_module._memberships(problem, np.array([[0.0, 0], [4, 0], [0, 0]]))
    np.testing.assert_array_equal(shares[[0, 2]], [[0.5, 0, 0.5], [0, 1, 0]])
    assert np.isfinite(shares).all()


def test_weighted_medians_of_columns():
    """Oracle: analytic. Half the weight lies on either side; at an exact half the middle."""
    data = np.array([[5.0, 1.0], [1.0, 2.0], [3.0, 9.0]])
    order = data.argsort(axis=0).T
    mass = np.array([[1.0, 1, 1], [1, 4, 2], [2, 1, 1], [1e-3, 5, 0]])
    expected = [[3, 2], [1, 2], [4, 1.5], [1, 2]]
    np.testing.assert_array_equal(fuzzy_module._medians(data, order, mass), expected)


@each_metric
def test_little_fuzziness_is_hard(metric):
    """Oracle: analytic. As m falls to 1 the memberships are 0 or 1, and nothing overflows."""
    rows, truth = planted(np.random.default_rng(11), 3, size=30)
    found = fuzzy_c_means(rows, 3, metric=metric, fuzziness=1.0001)
    np.testing.assert_allclose(found.memberships, np.eye(3)[truth], atol=1e-12)
    center = np.median if metric == "l1" else np.mean
    expected = [center(rows[truth == k], axis=0) for k in range(3)]
    np.testing.assert_allclose(found.centers, expected, atol=1e-9)


@pytest.mark.parametrize("wrong", [{"fuzziness": 1.0}, {"fuzziness": np.nan}, {"restarts": 0}])
def test_fuzzy_options_out_of_range_are_refused(wrong):
    """Oracle: algebra. A02 names the option."""
    with pytest.raises(ArgumentError, match=rf"^{next(iter(wrong))}: .*A02"):
        fuzzy_c_means(np.eye(3), 2, **wrong)


@pytest.mark.parametrize("weighted", [False, True])
def test_the_first_split_is_at_twice_the_largest_variance(weighted):
    """Oracle: analytic. Rose 1998, theorem 1, for the rows' (weighted) covariance."""
    rng = np.random.default_rng(12)
    rows = rng.uniform(-1, 1, (400, 3)) * [1, 3, 2] + 1e3
    weights = rng.random(400) + 0.01 if weighted else np.ones(400)
    cooled = annealing(rows, 2, weights=weights)
    expected = 2 * largest_variance(rows, weights)
    assert cooled.temperatures[0] == pytest.approx(expected, rel=1e-9)
    assert cooled.counts[0] == 2


def test_far_groups_split_each_at_twice_its_own_largest_variance():
    """Oracle: analytic. Two far boxes: 2 lambda_max of both together, then of either, to 5 %.

    Between the two, the halves of the long box split again: they are left out by value.
    """
    one, other = boxes(np.random.default_rng(13))
    cooled = annealing(np.concatenate([one, other]), 4)
    first, second, *rest = cooled.temperatures
    assert first == pytest.approx(2 * largest_variance(np.concatenate([one, other])), rel=1e-9)
    assert second == pytest.approx(2 * largest_variance(one), rel=0.05)
    expected = 2 * largest_variance(other)
    assert min(abs(np.array(rest) / expected - 1)) < 0.05
    assert (np.diff(cooled.temperatures) <= 0).all()
    np.testing.assert_array_equal(cooled.counts, np.arange(2, len(cooled.counts) + 2))


def test_groups_that_overlap_split_where_the_fixed_point_says():
    """Oracle: analytic. Rows -1.5, -0.5, 0.5, 1.5: centers -a and a, a = mean of x tanh(2 a x / T).

    Either half has the variance 1.25 - a^2 and splits where that is T / 2.
    """
    from scipy.optimize import brentq

    x = np.array([0.5, 1.5])

    def half(t):
        return brentq(lambda a: (x * np.tanh(2 * a * x / t)).mean() - a, 0.1, 2)

    expected = brentq(lambda t: 2 * (1.25 - half(t) ** 2) - t, 0.1, 2)
    cooled = annealing(np.array([[-1.5], [-0.5], [0.5], [1.5]]), 4)
    np.testing.assert_allclose(cooled.temperatures, [2.5, expected, expected], rtol=2e-3)


def test_temperatures_never_rise():
    """Oracle: symmetry. An equilateral triangle has two equal variances, 2 of 3 / 2 each."""
    turns = np.arange(3) * 2 * np.pi / 3
    rows = np.sqrt(3) * np.column_stack([np.cos(turns), np.sin(turns)])
    found = annealing(rows, 3).temperatures
    assert found[0] == pytest.approx(3, rel=1e-9)
    assert found[1] <= found[0]


def test_the_halves_of_two_rows_part_as_the_fixed_point_says():
    """Oracle: analytic. Rows -1, 1 at T < 2: centers at -a, a with a = tanh(2 a / T)."""
    rows = checked_rows(np.array([[-1.0], [1.0]]), 2)
    state = annealing_module._State(np.array([[-0.3], [0.3]]), np.array([0.5, 0.5]))
    for temperature in (1.8, 1.0, 0.2):
        state = annealing_module._settled(rows, state, temperature)
        a = state.centers[1, 0]
        assert a == pytest.approx(np.tanh(2 * a / temperature), abs=1e-5)
        assert a > 0.3


@pytest.mark.parametrize("count", [2, 3, 4, 5])
def test_annealing_chooses_the_planted_number(count):
    """Oracle: analytic. Round groups at 14 spreads give their number, and themselves."""
    rows, truth = planted(np.random.default_rng(14), count, columns=6)
    found = deterministic_annealing(rows)
    np.testing.assert_array_equal(found.labels, truth)


def test_annealing_of_equal_rows():
    """Oracle: algebra. One value is one group; three values are three, whatever their size."""
    assert len(deterministic_annealing(np.full((9, 2), 7.0)).centers) == 1
    rows = np.repeat([[1.0, 0], [0, 2], [3, 3]], [40, 3, 9], axis=0)
    found = deterministic_annealing(rows)
    np.testing.assert_allclose(found.centers, [[1, 0], [0, 2], [3, 3]], atol=1e-9)


def test_annealing_finds_groups_that_are_nearly_one():
    """Oracle: analytic. Pairs 1e-6 apart, the pairs 1 apart: four groups, in two steps."""
    rows = np.repeat([[0.0], [1e-6], [1.0], [1 + 1e-6]], 10, axis=0)
    cooled = annealing(rows, 4)
    np.testing.assert_array_equal(cooled.clusters.labels, np.repeat(np.arange(4), 10))
    expected = [0.5, 0.5e-12, 0.5e-12]
    np.testing.assert_allclose(cooled.temperatures, expected, rtol=1e-3)


def test_cooled_to_zero_the_groups_are_a_fixed_point_of_lloyds():
    """Oracle: algebra. Memberships 0 or 1; each center the mean of the rows nearest to it."""
    rows = np.random.default_rng(15).random((300, 3))
    found = deterministic_annealing(rows, 5, hard=True)
    np.testing.assert_array_equal(found.memberships, np.eye(5)[found.labels])
    nearest = distances(rows, found.centers, "l2").argmin(axis=1)
    np.testing.assert_array_equal(found.labels, nearest)
    means = [rows[nearest == k].mean(axis=0) for k in range(5)]
    np.testing.assert_allclose(found.centers, means, atol=1e-9)
    soft = deterministic_annealing(rows, 5)
    assert soft.memberships.max(axis=1).min() < 0.9


@pytest.mark.parametrize("seed", range(4))
def test_annealed_groups_need_no_luck(seed):
    """Oracle: analytic. Eight groups of 10 to 150 rows, in four far pairs, from one start."""
    rng = np.random.default_rng(seed)
    truth = np.repeat(np.arange(8), [10, 150, 20, 90, 150, 10, 40, 60])
    pairs = np.repeat([[10.0, 0], [0, 70], [-90, -20], [60, -150]], 2, axis=0)
    corners = pairs + np.tile([[0.0, 0], [9, 9]], (4, 1))
    rows = corners[truth] + 0.7 * rng.standard_normal((len(truth), 2))
    found = deterministic_annealing(rows, 8)
    assert adjusted_rand_index(found.labels, truth) == 1


def test_annealed_groups_are_cheaper_than_those_of_a_chance_start():
    """Oracle: peer. Where there are no groups: the mean of SciPy's k-means of 30 starts.

    Not for each set of rows, but in the mean of eight: annealing is no global minimum.
    """
    from scipy.cluster.vq import kmeans2

    def cost(rows, centers):
        return (distances(rows, centers, "l2").min(axis=1) ** 2).sum()

    ratios = []
    for rows in np.random.default_rng(16).random((8, 150, 2)):
        starts = [kmeans2(rows, 6, iter=50, minit="points", rng=seed)[0] for seed in range(30)]
        chance = np.mean([cost(rows, centers) for centers in starts])
        ratios.append(cost(rows, deterministic_annealing(rows, 6, hard=True).centers) / chance)
    assert np.mean(ratios) < 1


@pytest.mark.parametrize("scale", [1e-60, 1e60])
def test_annealing_does_not_see_the_unit(scale):
    """Oracle: symmetry. Rows times s: temperatures times s^2, the same memberships."""
    rows, _ = planted(np.random.default_rng(17), 3, size=20)
    one, other = annealing(rows, 3), annealing(scale * rows, 3)
    np.testing.assert_allclose(other.temperatures, scale**2 * one.temperatures, rtol=1e-6)
    np.testing.assert_allclose(other.clusters.memberships, one.clusters.memberships, atol=1e-6)


@pytest.mark.parametrize("wrong", [{"cooling": 1.0}, {"cooling": 0.0}, {"most": 1}])
def test_annealing_options_out_of_range_are_refused(wrong):
    """Oracle: algebra. A02 names the option."""
    with pytest.raises(ArgumentError, match=rf"^{next(iter(wrong))}: .*A02"):
        annealing(np.eye(3), **wrong)


def test_rows_that_differ_by_rounding_are_no_groups():
    """Oracle: algebra. A difference of 1e-14 of the spread is not split: K02."""
    rows = np.array([[0.0], [1e-14], [1.0]])
    assert len(annealing(rows, 2).clusters.centers) == 2
    with pytest.raises(ClusterError, match="at most 2 groups"):
        annealing(rows, 3)


def test_products_in_pieces(monkeypatch):
    """Oracle: algebra. Integers below 2^53 are added exactly, so any pieces give the same."""
    monkeypatch.setattr(annealing_module, "_PIECE", 100)
    rng = np.random.default_rng(18)
    left, right = (rng.integers(-9, 9, shape).astype(float) for shape in [(3, 101), (101, 4)])
    np.testing.assert_array_equal(annealing_module.product(left, right), left @ right)


def loop_silhouette(rows, labels, weights):
    """The mean silhouette by its definition, one row at a time."""
    scores = []
    for i, row in enumerate(rows):
        means = {}
        for group in set(labels):
            others = [j for j in range(len(rows)) if labels[j] == group and j != i]
            if others:
                apart = np.abs(rows[others] - row).sum(axis=1)
                means[group] = np.average(apart, weights=weights[others])
        inner = means.pop(labels[i], None)
        outer = min(means.values())
        scores.append(0.0 if inner is None else (outer - inner) / max(inner, outer))
    return np.average(scores, weights=weights)


@pytest.mark.parametrize("weighted", [False, True])
def test_silhouette_is_its_definition(weighted):
    """Oracle: algebra. Row by row, with a row that is alone, and rows that are left out."""
    rng = np.random.default_rng(19)
    rows, labels = rng.standard_normal((30, 2)), rng.integers(0, 3, 30)
    labels[4] = 7
    weights = rng.random(30) + 0.1 if weighted else np.ones(30)
    expected = loop_silhouette(rows, labels, weights)
    assert silhouette(rows, labels, weights=weights) == pytest.approx(expected, rel=1e-12)
    more = np.concatenate([rows, [[np.nan, 0], [50, 50]]])
    given = silhouette(more, np.append(labels, [0, -1]), weights=np.append(weights, [3, 3]))
    assert given == pytest.approx(expected, rel=1e-12)


@each_metric
def test_silhouette_is_scikit_learns(metric):
    """Oracle: peer. scikit-learn's, for both distances."""
    metrics = pytest.importorskip("sklearn.metrics")
    rng = np.random.default_rng(20)
    rows, labels = rng.standard_normal((80, 3)), rng.integers(0, 4, 80)
    name = {"l1": "manhattan", "l2": "euclidean"}[metric]
    expected = metrics.silhouette_score(rows, labels, metric=name)
    assert silhouette(rows, labels, metric=metric) == pytest.approx(expected, rel=1e-12)


def test_silhouette_of_a_sample_and_of_coinciding_rows():
    """Oracle: analytic. Groups of equal rows: 1, whatever is drawn; all rows equal: 0."""
    rows = np.repeat([[0.0], [4.0]], 500, axis=0)
    assert silhouette(rows, np.repeat([0, 1], 500), samples=50) == 1
    assert silhouette(np.ones((6, 1)), [0, 0, 0, 1, 1, 1]) == 0


def test_silhouette_refuses_what_it_cannot_judge():
    """Oracle: algebra. One group: A02; labels of another length: A03."""
    with pytest.raises(ArgumentError, match=r"2 or more groups.*A02"):
        silhouette(np.eye(3), [1, 1, -1])
    with pytest.raises(ArgumentError, match=r"labels: .*A03"):
        silhouette(np.eye(3), [1, 0])
    with pytest.raises(ArgumentError, match=r"rows: .*A03"):
        silhouette(np.ones(3), [1, 0, 1])


def test_index_is_one_for_renamed_groups_and_zero_by_chance():
    """Oracle: algebra. Any renaming; the mean over all orders of one grouping is exactly 0."""
    labels = np.random.default_rng(21).integers(0, 4, 200)
    assert adjusted_rand_index(labels, np.array([7, 3, 5, 0])[labels]) == 1
    one = np.array([0, 0, 0, 1, 1, 2])
    other = np.array([0, 0, 1, 1, 1, 1])
    values = [adjusted_rand_index(one, other[list(p)]) for p in permutations(range(6))]
    assert np.mean(values) == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [
        ([0, 0, 1, 1], [0, 1, 0, 1], -0.5),  # A = 0, B = C = 2, E = 2/3
        ([0, 0, 0, 1, 1], [0, 0, 1, 1, 1], 1 / 6),  # A = 2, B = C = 4, E = 8/5
        ([0, 0, 0], [1, 1, 1], 1.0),
        ([0, 1, 2], [2, 1, 0], 1.0),
        ([0, 0, 1, 1, -1, 4], [3, 3, 5, 5, 5, -1], 1.0),
        ([0, -1], [0, 0], np.nan),
    ],
)
def test_index_of_small_tables(first, second, expected):
    """Oracle: algebra. Pairs counted by hand: (A - E) / ((B + C) / 2 - E), E = B C / pairs."""
    for pair in ((first, second), (second, first)):
        assert adjusted_rand_index(*pair) == pytest.approx(expected, nan_ok=True)


def test_index_is_scikit_learns_and_refuses_other_lengths():
    """Oracle: peer. scikit-learn's; labels of two lengths are refused with A03."""
    metrics = pytest.importorskip("sklearn.metrics")
    rng = np.random.default_rng(22)
    first = rng.integers(0, 5, 300)
    second = np.where(rng.random(300) < 0.5, first, rng.integers(0, 3, 300))
    expected = metrics.adjusted_rand_score(first, second)
    assert adjusted_rand_index(first, second) == pytest.approx(expected, rel=1e-12)
    with pytest.raises(ArgumentError, match="A03"):
        adjusted_rand_index(first, second[1:])


@pytest.mark.parametrize("method", [k_medians, deterministic_annealing], ids=["medians", "cooled"])
def test_the_planted_number_is_chosen_and_stable(method):
    """Oracle: analytic. Four groups at 14 spreads: the best count, on which all runs agree."""
    rows, _ = planted(np.random.default_rng(23), 4, size=50)
    choice = choose_count(rows, method, [2, 3, 4, 5], repeats=3)
    assert choice.best == 4
    assert choice.stability[2] == 1
    assert choice.stability[3] < 1
    again = choose_count(rows, method, [5, 4, 3, 2, 4], repeats=3)
    np.testing.assert_array_equal(again.counts, [2, 3, 4, 5])
    np.testing.assert_array_equal(again.silhouette, choice.silhouette)


def test_runs_differ_in_seed_and_part_and_labels_by_chance_agree_by_chance():
    """Oracle: analytic. Random labels: stability and silhouette about 0.

    The standard deviation of the index of two random halvings of s rows is sqrt(2) / s, of
    which 64 % of 400 rows are shared and 45 pairs averaged: below 0.002. The silhouette's is
    below that of the mean of 320 numbers of spread 0.1.
    """
    rows = np.random.default_rng(24).random((400, 2))
    seen = []

    def chance(rows, count, *, rng):
        seen.append((rng, rows[:, 0].sum(), len(rows)))
        labels = np.random.default_rng(rng).integers(0, count, len(rows))
        return type("Found", (), {"labels": labels})

    choice = choose_count(rows, chance, [2], repeats=10)
    assert len({seed for seed, _, _ in seen}) == len({part for _, part, _ in seen}) == 10
    assert {size for _, _, size in seen} == {320}
    assert abs(choice.stability[0]) < 0.012
    assert abs(choice.silhouette[0]) < 0.03


def test_heavy_rows_are_drawn_more_often():
    """Oracle: analytic. Of 1000 rows, 100 drawn; the half with weight 99 fills nearly all."""
    rows = np.random.default_rng(25).random((1000, 1)) + np.repeat([[0.0], [10.0]], 500, axis=0)
    shares = []

    def watched(rows, count, *, rng):
        shares.append((rows > 5).mean())
        return k_medians(rows, count, rng=rng)

    weights = np.repeat([1.0, 99.0], 500)
    choose_count(rows, watched, [2], weights=weights, samples=100)
    assert np.mean(shares) > 0.9
    shares.clear()
    choose_count(rows, watched, [2], weights=weights)  # 800 of all 1000, in which 500 are heavy
    assert np.mean(shares) > 0.6


def test_the_best_count_is_the_smallest_within_one_standard_error():
    """Oracle: algebra. 0.70 + 0.02 reaches 0.71, 0.6 does not; unknown ones are passed over."""
    counts, error = [2, 3, 4, 5], [0.2, 0.2, 0.02, 0.2]
    choice = CountChoice(counts, [0.6, 0.70, 0.71, np.nan], error, np.ones(4))
    assert choice.best == 3
    assert CountChoice([2], [np.nan], [np.nan], [1.0]).best == -1


@pytest.mark.parametrize(
    "wrong", [{"counts": [1, 2]}, {"counts": []}, {"samples": 2}, {"repeats": 1}]
)
def test_choices_out_of_range_are_refused(wrong):
    """Oracle: algebra. A02 names the argument."""
    with pytest.raises(ArgumentError, match=rf"^{next(iter(wrong))}: .*A02"):
        choose_count(np.eye(9), k_medians, **wrong)
