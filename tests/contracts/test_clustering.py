"""What every grouping promises."""

from __future__ import annotations

from inspect import signature
from itertools import product

import numpy as np
import pytest

import isovary as iv

METHODS = {
    "k_medians": iv.k_medians,
    "k_medoids": iv.k_medoids,
    "agglomerative": iv.agglomerative,
    "norm_bins": iv.norm_bins,
    "fuzzy_c_means": iv.fuzzy_c_means,
    "deterministic_annealing": iv.deterministic_annealing,
}
BY_KIND = {name: method for name, method in METHODS.items() if name != "norm_bins"}


def three_groups(rng):
    centers = np.array([[0.0, 0, 0], [4, 0, 1], [-3, 6, 2]])
    truth = np.repeat([0, 1, 2], [40, 25, 60])
    return centers[truth] + 0.2 * rng.standard_normal((125, 3)), truth


@pytest.mark.parametrize("method", BY_KIND.values(), ids=BY_KIND)
def test_separated_groups_are_found_in_any_order(method):
    """Oracle: analytic. Labels by norm of the center; invariant to the order of rows."""
    rng = np.random.default_rng(314)
    rows, truth = three_groups(rng)
    found = method(rows, 3, rng=12)
    np.testing.assert_array_equal(found.labels, truth)
    order = rng.permutation(len(rows))
    np.testing.assert_array_equal(method(rows[order], 3, rng=12).labels, truth[order])
    assert (np.diff(np.abs(found.centers).sum(axis=1)) > 0).all()


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
def test_the_same_seed_gives_the_same_groups(method):
    """Oracle: symmetry. Twice the same bits."""
    rows = np.random.default_rng(3).random((200, 4))
    first, second = (method(rows, 4, rng=99) for _ in range(2))
    np.testing.assert_array_equal(first.labels, second.labels)
    np.testing.assert_array_equal(first.centers, second.centers)


def test_the_best_partition_of_a_small_set_is_found():
    """Oracle: algebra. The L1 cost equals the minimum over all 3^9 assignments."""
    rows = np.random.default_rng(21).random((9, 2))
    found = iv.k_medians(rows, 3, rng=5, restarts=30)

    def cost(labels):
        labels = np.array(labels)
        groups = [rows[labels == g] for g in range(3) if (labels == g).any()]
        return sum(np.abs(g - np.median(g, axis=0)).sum() for g in groups)

    best = min(cost(labels) for labels in product(range(3), repeat=9))
    assert cost(found.labels) == pytest.approx(best, rel=1e-12)


@pytest.mark.parametrize("method", BY_KIND.values(), ids=BY_KIND)
def test_unknown_rows_stay_unknown(method):
    """Oracle: algebra. NaN rows are labelled -1 and do not move the centers."""
    rng = np.random.default_rng(17)
    rows, truth = three_groups(rng)
    holes = rows.copy()
    holes[::5, 1] = np.nan
    found = method(holes, 3, rng=1)
    assert (found.labels[::5] == -1).all()
    known = np.setdiff1d(np.arange(len(rows)), np.arange(0, len(rows), 5))
    np.testing.assert_array_equal(found.labels[known], truth[known])


def test_empty_groups_are_refilled():
    """Oracle: algebra. From seeds that leave two groups empty, no group stays empty."""
    from isovary.clustering._k_medians import _lloyd

    rows = np.array([[0.0], [1.0], [2.0], [3.0]])
    centers, labels, _ = _lloyd(rows, np.array([[1.5], [90.0], [95.0]]))
    assert set(labels) == {0, 1, 2}
    assert np.isfinite(centers).all()


def test_no_group_is_empty_and_too_many_are_refused():
    """Oracle: algebra. Two distinct rows give two groups; three are refused with the number."""
    rows = np.array([[1.0, 0]] * 7 + [[0.0, 1]] * 2)
    assert set(iv.k_medians(rows, 2).labels) == {0, 1}
    with pytest.raises(iv.ClusterError, match="K02") as caught:
        iv.k_medians(rows, 3)
    assert "at most 2 groups" in str(caught.value)
    with pytest.raises(iv.ArgumentError, match="A02"):
        iv.k_medians(rows, 0)


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
def test_every_method_is_called_alike(method):
    """Oracle: algebra. Weights in any unit, and a metric; NaN rows are labelled -1 in all."""
    rng = np.random.default_rng(23)
    rows, _ = three_groups(rng)
    rows[4] = np.nan
    weights = rng.uniform(0.5, 2.0, len(rows))
    metrics = "metric" in signature(method).parameters  # annealing has but one
    for metric in ("l1", "l2"):
        options = {"metric": metric} if metrics else {}
        found, again = (
            method(rows, 3, rng=4, weights=w, **options) for w in (weights, 1e6 * weights)
        )
        np.testing.assert_array_equal(found.labels, again.labels)
        assert found.labels[4] == -1
        assert found.labels.max() == len(found.centers) - 1
    if metrics:
        with pytest.raises(iv.ArgumentError, match="A02"):
            method(rows, 3, metric="l3")
    with pytest.raises(iv.ArgumentError, match="A03"):
        method(rows, 3, weights=weights[1:])
    with pytest.raises(iv.ArgumentError, match="A02"):
        method(rows, 3, weights=-weights)
