"""Points at nearly the rows' distances: classical and universal multidimensional scaling."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.distance import cdist, pdist

from isovary.embedding import _universal_mds as universal
from isovary.embedding._classical_mds import classical_mds
from isovary.embedding._universal_mds import universal_mds
from isovary.errors import ArgumentError

METHODS = {"classical": classical_mds, "universal": universal_mds}
COSTS = ("squared", "absolute")


def flat_rows(count, rng):
    """Rows (count, 12) in a three-dimensional affine space."""
    axes = np.linalg.qr(rng.standard_normal((12, 3)))[0].T
    return rng.standard_normal((count, 3)) * [3.0, 2.0, 1.0] @ axes + rng.standard_normal(12)


def curves(count, rng):
    """Rows (count, 20): a few smooth curves and noise."""
    times = np.linspace(0, 1, 20)
    bumps = np.exp(-(((times - np.array([[0.2], [0.5], [0.8]])) / 0.2) ** 2))
    return rng.random((count, 3)) ** 2 @ bumps + 0.02 * rng.standard_normal((count, 20))


def cost_of(points, wanted, cost):
    off = pdist(points) - wanted
    return (off**2).sum() if cost == "squared" else np.abs(off).sum()


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
@pytest.mark.parametrize("landmarks", [1000, 40])
def test_flat_rows_keep_their_distances(method, landmarks):
    """Oracle: analytic. Rows of rank 3 in l2 lie in space; landmarks place all exactly."""
    rows = flat_rows(200, np.random.default_rng(3))
    points = method(rows, metric="l2", landmarks=landmarks)
    np.testing.assert_allclose(pdist(points), pdist(rows), rtol=0, atol=1e-10 * np.ptp(rows))


@pytest.mark.parametrize("landmarks", [1000, 40])
def test_l2_gives_the_weighted_principal_components(landmarks):
    """Oracle: algebra. The SVD of the weighted, centred rows; up to signs, beyond landmarks too."""
    rng = np.random.default_rng(5)
    rows, weights = flat_rows(150, rng), rng.random(150) + 0.1
    centred = rows - np.average(rows, axis=0, weights=weights)
    _, _, axes = np.linalg.svd(np.sqrt(weights)[:, None] * centred, full_matrices=False)
    expected = centred @ axes[:3].T
    points = classical_mds(rows, metric="l2", weights=weights, landmarks=landmarks)
    expected *= np.sign((expected * points).sum(axis=0))
    np.testing.assert_allclose(points, expected, atol=1e-9)


def test_principal_components_of_noisy_rows():
    """Oracle: algebra. Double centring in l2 is the SVD also where the rank is higher."""
    rows = curves(80, np.random.default_rng(8))
    centred = rows - rows.mean(axis=0)
    expected = centred @ np.linalg.svd(centred, full_matrices=False)[2][:2].T
    points = classical_mds(rows, 2, metric="l2")
    expected *= np.sign((expected * points).sum(axis=0))
    np.testing.assert_allclose(points, expected, atol=1e-10)


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
@pytest.mark.parametrize("metric", ["l1", "l2"])
def test_mean_axes_and_signs_are_settled(method, metric):
    """Oracle: symmetry. Weighted mean 0, no covariance, variances fall, sums grow; in any order."""
    rng = np.random.default_rng(13)
    rows, weights = curves(60, rng), rng.random(60) + 0.2
    points = method(rows, metric=metric, weights=weights)
    covariance = points.T @ (weights[:, None] * points)
    np.testing.assert_allclose(weights @ points, 0, atol=1e-10)
    np.testing.assert_allclose(covariance, np.diag(np.diag(covariance)), atol=1e-10)
    assert (np.diff(np.diag(covariance)) < 0).all()
    assert ((weights * rows.sum(axis=1)) @ points > 0).all()
    if method is classical_mds:  # the other goes through the points in turn
        order = rng.permutation(60)
        again = method(rows[order], metric=metric, weights=weights[order])
        np.testing.assert_allclose(again, points[order], atol=1e-9)


def test_axes_without_a_positive_eigenvalue_are_zero():
    """Oracle: analytic. The square in L1 has eigenvalues 2, 2, 0, -1; halves of it lie in axes."""
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    points = classical_mds(square, 4)
    assert (points[:, 2:] == 0).all()
    np.testing.assert_allclose((points**2).sum(axis=0), [2, 2, 0, 0], atol=1e-12)


def test_weights_count_as_copies():
    """Oracle: symmetry. A row of weight 3 is the row three times."""
    rows = curves(30, np.random.default_rng(21))
    copies = np.random.default_rng(1).integers(1, 4, 30)
    repeated = np.repeat(np.arange(30), copies)
    expected = np.empty((30, 3))
    expected[repeated] = classical_mds(rows[repeated])
    np.testing.assert_allclose(classical_mds(rows, weights=copies), expected, atol=1e-9)


def test_a_small_far_group_is_not_missed():
    """Oracle: analytic. One row in 2000 lies 50 away along its own axis; it is a landmark."""
    rng = np.random.default_rng(2)
    rows = np.column_stack([rng.random((2000, 2)), np.zeros(2000)])
    rows[1234, 2] = 50.0
    points = classical_mds(rows, metric="l2", landmarks=20)
    assert np.linalg.norm(points - points[1234], axis=1)[:1234].min() == pytest.approx(50, rel=1e-3)


def test_landmarks_weigh_what_they_stand_for():
    """Oracle: analytic. Variance 3 along x, about 4 * 68 / 1004 along y: the axis is x.

    The four far rows are a tenth of the landmarks, where y varies more.
    """
    rows = np.column_stack([np.linspace(-3, 3, 1000), np.zeros(1000)])
    rows = np.vstack([rows, [[0, 8], [0, -8], [0, 8.5], [0, -8.5]]])
    found = classical_mds(rows, 1, metric="l2", landmarks=40)[:, 0]
    np.testing.assert_allclose(np.abs(found[:1000]), np.abs(rows[:1000, 0]), atol=0.3)


@pytest.mark.parametrize("cost", COSTS)
def test_no_single_move_increases_the_cost(cost, monkeypatch):
    """Oracle: algebra. The whole cost, summed over pairs anew after every move, three starts."""
    rows = curves(25, np.random.default_rng(34))
    wanted = cdist(rows, rows, "cityblock")
    weights = np.ones(25)
    real = universal.placed
    for seed in range(3):
        start = np.random.default_rng(seed).standard_normal((25, 3))
        seen = [cost_of(start, wanted[np.triu_indices(25, 1)], cost)]
        points = start.copy()

        def watched(here, row, others, heavy, kind, steps, tolerance, seen=seen, points=points):
            moved = real(here, row, others, heavy, kind, steps, tolerance)
            points[heavy == 0] = moved
            seen.append(cost_of(points, wanted[np.triu_indices(25, 1)], kind))
            return moved

        monkeypatch.setattr(universal, "placed", watched)
        universal.rearranged(start, wanted, weights, cost, 15, 0.0)
        assert len(seen) > 25
        assert (np.diff(seen) <= 1e-12 * seen[0]).all()
        assert seen[-1] < 0.5 * seen[0]


def test_the_squared_cost_reaches_the_minimum_of_another_program():
    """Oracle: peer. BFGS of SciPy on all coordinates at once, from the same start."""
    rows = curves(20, np.random.default_rng(55))
    wanted = pdist(rows, "cityblock")
    start = classical_mds(rows, 2)
    peer = minimize(lambda x: cost_of(x.reshape(-1, 2), wanted, "squared"), start.ravel())
    points = universal_mds(rows, 2, rounds=400, tolerance=1e-9)
    assert cost_of(points, wanted, "squared") == pytest.approx(peer.fun, rel=1e-4)
    assert peer.fun < 0.9 * cost_of(start, wanted, "squared")


def test_one_point_goes_to_its_best_place():
    """Oracle: peer. SciPy's minimum of one point's squared cost, from the same start."""
    rng = np.random.default_rng(89)
    anchors, weights, start = rng.standard_normal((30, 3)), rng.random(30), np.full((1, 3), 2.0)
    wanted = rng.random((1, 30)) * 3

    def cost(x):
        return weights @ (np.linalg.norm(x - anchors, axis=1) - wanted[0]) ** 2

    found = universal.placed(start, wanted, anchors, weights, "squared", 500, 0.0)
    peer = minimize(cost, start[0], options={"gtol": 1e-9})
    assert cost(found[0]) == pytest.approx(peer.fun, rel=1e-9)


def test_the_absolute_cost_forgives_a_wrong_distance():
    """Oracle: analytic. Of 40 distances to a known point one is far off: the others hold it."""
    rng = np.random.default_rng(144)
    anchors, truth = rng.standard_normal((40, 3)), np.array([[0.3, -0.2, 0.1]])
    wanted = cdist(truth, anchors)
    wanted[0, 4] += 2.0
    start = truth + 0.2
    squared, absolute = (
        universal.placed(start, wanted, anchors, np.ones(40), cost, 200, 0.0) for cost in COSTS
    )
    np.testing.assert_allclose(absolute, truth, atol=2e-4)  # 0.003 of the mean, 2 / 40
    assert np.linalg.norm(squared - truth) > 0.05


def test_a_point_on_an_anchor_leaves_it():
    """Oracle: analytic. It wants distance 1 to the anchor it lies on: along the first axis."""
    here = np.zeros((1, 3))
    found = universal.placed(here, np.ones((1, 1)), here, np.ones(1), "squared", 200, 0.0)
    np.testing.assert_allclose(found, [[1.0, 0.0, 0.0]], atol=1e-12)


@pytest.mark.parametrize("cost", COSTS)
def test_landmarks_cost_little_more_than_all(cost):
    """Oracle: convergence. All 200 rows at once; 40 of them give half of the gain or more."""
    rows = curves(200, np.random.default_rng(233))
    wanted = pdist(rows, "cityblock")
    full, some = (
        cost_of(universal_mds(rows, cost=cost, landmarks=n, rounds=20), wanted, cost)
        for n in (200, 40)
    )
    classical = cost_of(classical_mds(rows), wanted, cost)
    assert full < classical
    assert some < full + 0.5 * (classical - full)


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
def test_unknown_rows_stay_unknown(method):
    """Oracle: algebra. NaN and infinity give NaN and do not move the others; arguments stay."""
    rows = curves(50, np.random.default_rng(377))
    holes = rows.copy()
    holes[::5, 1] = np.nan
    holes[5, 1] = np.inf
    kept = np.arange(50) % 5 > 0
    before = holes.copy()
    points = method(holes)
    assert np.isnan(points[~kept]).all()
    np.testing.assert_array_equal(points[kept], method(rows[kept]))
    np.testing.assert_array_equal(holes, before)


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
def test_the_same_seed_gives_the_same_points(method):
    """Oracle: symmetry. Twice the same bits, also with rows drawn by chance."""
    rows = curves(150, np.random.default_rng(610))
    first, second, other = (method(rows, landmarks=30, rng=seed) for seed in (7, 7, 8))
    np.testing.assert_array_equal(first, second)
    assert (first != other).any()


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
@pytest.mark.parametrize("count", [0, 1, 2, 30])
def test_few_or_equal_rows_are_points_too(method, count):
    """Oracle: analytic. Equal rows coincide; more landmarks than distinct rows do not matter."""
    points = method(np.ones((count, 4)), landmarks=10)
    np.testing.assert_array_equal(points, np.zeros((count, 3)))


@pytest.mark.parametrize(
    ("rows", "options", "code"),
    [
        (np.ones(3), {}, "A03"),
        (np.ones((3, 2)), {"dimensions": 0}, "A02"),
        (np.ones((3, 2)), {"metric": "l3"}, "A02"),
        (np.ones((3, 2)), {"landmarks": 3}, "A02"),
        (np.ones((3, 2)), {"weights": [1, 2]}, "A03"),
        (np.ones((3, 2)), {"weights": [1, 0, 2]}, "A02"),
    ],
)
@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
def test_wrong_arguments_are_refused(method, rows, options, code):
    """Oracle: data. Each with its stable code."""
    with pytest.raises(ArgumentError, match=code):
        method(rows, **options)


@pytest.mark.parametrize("options", [{"cost": "cubed"}, {"rounds": 0}, {"tolerance": -1.0}])
def test_wrong_choices_of_the_universal_one_are_refused(options):
    """Oracle: data. A02."""
    with pytest.raises(ArgumentError, match="A02"):
        universal_mds(np.ones((3, 2)), **options)
