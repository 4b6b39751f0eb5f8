"""How many groups: the gap statistic, the figure of a choice, and compare(groups="auto")."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

import isovary as iv
from isovary import groups as groups_module
from isovary.clustering._choose_count import CountChoice, choose_count
from isovary.clustering._gap import compared, gaps, log_spread, unstructured
from isovary.errors import ArgumentError
from isovary.groups import chosen_count, grouped
from isovary.view._count_choice import count_choice_figure

METRICS = ("l1", "l2")
each_metric = pytest.mark.parametrize("metric", METRICS)
each_seed = pytest.mark.parametrize("seed", [3, 17, 91])


def medians(metric):
    return partial(iv.k_medians, metric=metric, restarts=2)


def blobs(rng, count, size=50, columns=5):
    """Gaussian rows around corners of a simplex, 14 spreads apart."""
    corners = 10 * np.eye(columns)[:count]
    truth = np.repeat(np.arange(count), size)
    return corners[truth] + rng.standard_normal((len(truth), columns))


def chosen(rows, metric, counts=range(2, 6), **more):
    more = {"repeats": 2, "references": 8} | more
    return choose_count(rows, medians(metric), counts, metric=metric, **more)


@each_metric
@each_seed
def test_separated_blobs_are_counted(metric, seed):
    """Oracle: analytic. Two to four Gaussian blobs at 14 spreads; one blob is one."""
    rng = np.random.default_rng(seed)
    for count in (1, 2, 3, 4):
        assert chosen(blobs(rng, count), metric).best_gap == count


@pytest.mark.parametrize("seed", [3, 17])
def test_one_blob_of_columns_that_go_together_is_one(seed):
    """Oracle: analytic. One long Gaussian blob in 100 columns that all follow two numbers: a box
    along the columns would be a cube, in which the blob is a diagonal, and see clumps."""
    rng = np.random.default_rng(seed)
    waves = np.sin(np.linspace(0, 3, 100) * [[1.0], [2.0]])
    rows = rng.standard_normal((120, 2)) * [5.0, 1.0] @ waves
    rows += 1e-3 * rng.standard_normal(rows.shape)
    assert chosen(rows, "l2", (2,)).best_gap == 1


@pytest.mark.parametrize(("metric", "even"), [("l1", 1 / 4), ("l2", 1 / 12)])
def test_gap_of_two_intervals(metric, even):
    """Oracle: analytic. Two intervals of length 1 whose middles are 9 apart, evenly filled.

    The spread of m rows is m times: for l2 1/12 + 9^2/4 as one group, 1/12 as two; for l1 9/2
    and 1/4. In the box of length 10 the references have 10^2/12 and a quarter of it; 10/4 and
    half of it. Means of 160 drawn rows stray by some per cent, log 2 is far from that.
    """
    even_rows = (np.arange(100) + 0.5) / 100
    rows = np.concatenate([even_rows, 9 + even_rows])[:, None]
    choice = chosen(rows, metric, (2,), references=20)
    whole = 81 / 4 + 1 / 12 if metric == "l2" else 9 / 2
    box, halved = (100 / 12, 4) if metric == "l2" else (10 / 4, 2)
    assert choice.gap[0] == pytest.approx(np.log(box / whole), abs=0.05)
    assert choice.gap[1] == pytest.approx(np.log(box / halved / even), abs=0.1)
    assert choice.best_gap == 2


def test_spread_within_groups_by_hand():
    """Oracle: algebra. 0, 1, 5 and 9, 11: medians 1 and 10 give 5 + 2; means 2 and 10 give
    4 + 1 + 9 and 1 + 1. Rows that are their group leave none."""
    rows, labels = np.array([[0.0], [1.0], [5.0], [9.0], [11.0]]), np.array([0, 0, 0, 4, 4])
    assert log_spread(rows, labels, "l1") == pytest.approx(np.log(7), rel=1e-15)
    assert log_spread(rows, labels, "l2") == pytest.approx(np.log(16), rel=1e-15)
    assert log_spread(rows, np.arange(5), "l1") == -np.inf


def test_gap_and_its_error_by_hand():
    """Oracle: algebra. Means over runs and references; sd of 1, 3 is 1, times root 3/2."""
    gap, error = compared(np.array([[1.0, 0.0], [3.0, 1.0]]), np.array([[1.0, 5.0], [3.0, 5.0]]))
    np.testing.assert_allclose(gap, [0.0, 4.5], rtol=1e-15)
    np.testing.assert_allclose(error, [np.sqrt(1.5), 0.0], rtol=1e-15)


def test_runs_are_measured_on_their_own_rows():
    """Oracle: algebra. Labels below 0 are left out, and so many rows have the references."""
    rows, sizes = np.array([[0.0], [1.0], [5.0], [6.0], [9.0], [11.0]]), []

    def group(drawn, count):
        sizes.append((len(drawn), count))
        return np.arange(len(drawn)) % count

    runs = [[np.array([0, 0, -1, -1, 1, 1])], [np.array([0, 0, -1, -1, 1, 2])]]
    seeds = (np.random.default_rng(6) for _ in range(2))
    gap, _ = gaps(rows, runs, group, (2, 3), "l1", 1, next(seeds))
    drawn = unstructured(rows, 4, next(seeds))
    theirs = [log_spread(drawn, np.arange(4) % count, "l1") for count in (1, 2, 3)]
    # medians: 5 of 0, 1, 9, 11; then 1/2 and 10; then 1/2
    np.testing.assert_allclose(gap, theirs - np.log([19.0, 3.0, 1.0]), rtol=1e-12)
    assert sizes == [(4, 2), (4, 3)]


def test_references_fill_the_box_of_the_principal_axes():
    """Oracle: analytic. Rows at the corners of a turned rectangle 8 x 2 in 3 columns: what is
    drawn lies within it and has its variances, 8^2/12 and 2^2/12; none across."""
    turn = np.linalg.qr(np.random.default_rng(9).standard_normal((3, 3)))[0]
    corners = np.array([[4.0, 1, 0], [4, -1, 0], [-4, 1, 0], [-4, -1, 0]])
    drawn = unstructured(corners @ turn + 7, 20_000, np.random.default_rng(10))
    back = (drawn - 7) @ turn.T
    assert (np.abs(back) <= [4 + 1e-12, 1 + 1e-12, 1e-12]).all()
    np.testing.assert_allclose(np.cov(back.T), np.diag([64 / 12, 4 / 12, 0]), atol=0.1)


def test_the_smallest_count_that_the_next_does_not_beat():
    """Oracle: algebra. 0.5 < 0.875 - 0.25, 0.875 >= 1 - 0.125; the last if each is beaten."""
    more = ([0.5, 0.5, 0.5], np.zeros(3), np.ones(3))
    assert CountChoice([2, 3, 5], *more, [0.5, 0.875, 1, 9], [1, 0.25, 0.125, 0]).best_gap == 2
    assert CountChoice([2, 3, 5], *more, [0.5, 0.75, 1, 9], [1, 0.25, 0.125, 0]).best_gap == 1
    assert CountChoice([2, 3, 5], *more, [1, 2, 3, 4], [0, 0, 0, 0]).best_gap == 5
    assert CountChoice([2, 3, 5], *more).best_gap == -1
    with pytest.raises(ArgumentError, match=r"gap: expected shape \(4,\).*A03"):
        CountChoice([2, 3, 5], *more, [1, 2, 3], [0, 0, 0])


@each_metric
def test_the_unit_does_not_matter_and_the_seed_decides(metric):
    """Oracle: symmetry. Rows times 8: the logarithms grow alike; the same seed, the same bits.
    Silhouettes do not know whether a gap was asked for."""
    rows = blobs(np.random.default_rng(12), 3)
    first, again, larger = (chosen(each, metric, rng=5) for each in (rows, rows, 8 * rows))
    np.testing.assert_array_equal(first.gap, again.gap)
    np.testing.assert_array_equal(first.gap_error, again.gap_error)
    np.testing.assert_allclose(larger.gap, first.gap, atol=1e-9)
    without = chosen(rows, metric, rng=5, references=0)
    assert without.gap is None
    np.testing.assert_array_equal(without.silhouette, first.silhouette)
    with pytest.raises(ArgumentError, match=r"references: expected 0 or more.*A02"):
        chosen(rows, metric, references=-1)


CHOICE = CountChoice(
    [2, 3, 4, 5],
    [0.4, 0.7, 0.65, 0.6],
    [0.02, 0.01, 0.03, 0.02],
    [0.9, 0.98, 0.7, 0.6],
    [1.0, 0.5, 0.6, 0.7, 0.8],
    [0.05, 0.04, 0.03, 0.02, 0.01],
)


def test_the_figure_shows_the_record():
    """Oracle: data. Points, bars of the errors, the rings and the words are the choice's."""
    figure = count_choice_figure(CHOICE, "three blobs")
    counts, one = np.arange(2, 6), np.arange(1, 6)
    shown = [
        (counts, CHOICE.silhouette, CHOICE.error, 3),
        (counts, CHOICE.stability, None, 3),
        (one, CHOICE.gap, CHOICE.gap_error, 1),
    ]
    for axes, (x, values, error, best) in zip(figure.axes, shown, strict=True):
        np.testing.assert_array_equal(axes.lines[0].get_xydata(), np.transpose([x, values]))
        ring = axes.lines[-1].get_xydata()
        np.testing.assert_array_equal(ring, [[best, values[x == best].item()]])
        assert [text.get_text() for text in axes.texts] == [str(best)]
        assert len(axes.collections) == (error is not None)
        if error is not None:
            bars = np.array(axes.collections[0].get_segments())[:, :, 1]
            np.testing.assert_allclose(bars, np.transpose([values - error, values + error]))
        assert axes.get_xlim() == figure.axes[0].get_xlim()
        assert axes.get_ylim()[0] < values.min() < values.max() < axes.get_ylim()[1]
    words = [text.get_text() for text in figure.texts]
    assert words[0] == "3 groups by the silhouette, stability 0.98; by the gap one: no clear clumps"
    assert words[1].startswith("three blobs   ·   ring")
    wide = figure.bbox.width
    assert all(text.get_window_extent().x1 <= wide for text in figure.texts)


def test_the_figure_leaves_out_what_is_not_known():
    """Oracle: data. No gap, no panel; no silhouette, no number."""
    assert len(count_choice_figure(CountChoice([2], [0.5], [0.1], [1.0])).axes) == 2
    unknown = count_choice_figure(CountChoice([2], [np.nan], [np.nan], [1.0]))
    assert unknown.texts[0].get_text() == "No number of groups: no run found more than one"
    assert [len(axes.texts) for axes in unknown.axes] == [0, 0]


@each_seed
def test_rows_choose_their_number(seed):
    """Oracle: analytic. Four blobs at 14 spreads on which all runs agree; a round blob in 50
    columns, whose halves are anyone's, is one; so is what is too few or all the same."""
    rng = np.random.default_rng(seed)
    group = partial(iv.k_medians, rng=seed, restarts=3)
    found = chosen_count(blobs(rng, 4), group, seed=seed)
    assert (found.count, found.stability) == (4, 1.0)
    assert 0.7 < found.silhouette < 1
    assert chosen_count(rng.standard_normal((200, 50)), group).count == 1
    assert chosen_count(rng.random((5, 3)), group).count == 1
    assert chosen_count(np.repeat(rng.random((1, 3)), 50, axis=0), group).count == 1


@pytest.mark.parametrize(
    ("first", "steady", "count"), [(0.51, 1.0, 2), (0.5, 1.0, 4), (0.51, 0.7, 4)]
)
def test_the_error_is_the_samples_and_only_steady_counts_are_taken(
    monkeypatch, first, steady, count
):
    """Oracle: algebra. Error 0.01 of a mean over 5 parts of 80 %: standard deviation 0.01 root 5,
    and the jackknife's root of 0.8 / 0.2 makes it 0.0447. 0.55 less that is 0.5053."""
    choice = CountChoice(
        [2, 3, 4, 5], [first, 0.5, 0.52, 0.55], np.full(4, 0.01), [steady, 1.0, 1.0, 0.81]
    )
    monkeypatch.setattr(groups_module, "choose_count", lambda *_, **__: choice)
    found = chosen_count(np.random.default_rng(1).random((50, 2)), iv.k_medians)
    assert (found.count, found.silhouette) == (count, choice.silhouette[count - 2])


def test_the_silhouette_takes_the_metric_of_the_method():
    """Oracle: algebra. The recorded silhouette is choose_count's with that metric."""
    rows = blobs(np.random.default_rng(8), 3)
    for metric in METRICS:
        method = partial(medians(metric), rng=2)
        expected = choose_count(rows, method, metric=metric, samples=500, rng=2)
        assert chosen_count(rows, method, seed=2).silhouette == expected.silhouette[1]


def test_heavy_rows_are_looked_at():
    """Oracle: analytic. Weighed, the sample is nearly all of the first 500 rows, three blobs; the
    other 4500 are one more that hides nothing if they are drawn."""
    rng = np.random.default_rng(11)
    rows = np.concatenate([blobs(rng, 3, 167)[:500], blobs(rng, 5, 900)[-900:].repeat(5, axis=0)])
    rows[500:] += 1e-3 * rng.standard_normal((4500, 5))
    seen = []

    def spying(rows, count, *, rng):
        seen.append((rows[:, 4] > 5).mean())
        return iv.k_medians(rows, count, rng=rng, restarts=1)

    chosen_count(rows, spying, np.repeat([900.0, 0.1], [500, 4500]))
    assert max(seen) < 0.05


def test_groups_chosen_are_merged_by_noise_and_recorded():
    """Oracle: analytic. Three blobs of significant rows, 4, 5 and 9 apart in the mean of columns,
    the first two nearer than twice a noise of 2.2; what is not significant has no group, and
    does not choose."""
    rng = np.random.default_rng(13)
    kinds = np.array([[1.0, 0.0], [9.0, 0.0], [1.0, 10.0], [500.0, 500.0]])
    truth = np.repeat(np.arange(4), 60)
    change = kinds[truth] + 0.01 * rng.standard_normal((240, 2))
    significant = truth < 3
    group = partial(iv.k_medians, rng=1, restarts=3)
    for noise, kept in ((0.1, 3), (2.2, 2)):
        floor = np.full(change.shape, noise)
        clusters, said = grouped(change, floor, significant, "auto", group)
        record = said["groups_chosen"]
        assert (len(clusters.centers), record["count"], record["stability"]) == (kept, 3, 1.0)
        np.testing.assert_array_equal(clusters.labels < 0, ~significant)
    fixed, said = grouped(change, floor, significant, 2, group)
    assert (len(fixed.centers), said) == (2, {})
    nothing, said = grouped(change, floor, truth > 9, "auto", group)
    assert (len(nothing.centers), said["groups_chosen"]["count"]) == (0, 1)


def ball(radius):
    return iv.ScalarField.from_function(
        lambda p: radius - np.linalg.norm(p / [1.0, 1.0, 1.3], axis=-1),
        ((-1.8,) * 3, (1.8,) * 3),
        (21, 21, 21),
    )


def test_a_comparison_chooses_and_tells():
    """Oracle: data. "auto" and the number chosen are on record; other words are refused first."""
    once = partial(iv.k_medians, restarts=1)
    small = {"vertices": 80, "pairs": 40, "times": 8, "clustering": once}
    result = iv.compare(ball(1.0), ball(1.05), 0.0, groups="auto", **small)
    assert result.choices["groups"] == "auto"
    record = result.choices["groups_chosen"]
    assert set(record) == {"count", "silhouette", "stability"}
    assert 1 <= len(result.clusters.centers) <= record["count"] <= 8
    rows = result.change[result.significant]
    again = chosen_count(rows, partial(once, rng=result.choices["seed"]), None, 7)
    assert (again.count, again.silhouette) == (record["count"], record["silhouette"])
    for wrong, text in (("many", "groups: expected a number or 'auto', got 'many'"), (0, "groups")):
        with pytest.raises(ArgumentError, match=f"{text}.*A02"):
            iv.compare(ball(1.0), ball(1.05), 0.0, groups=wrong, **small)


def test_few_different_rows_are_their_own_groups():
    """Oracle: algebra. Three points, twenty times each: eight groups cannot be, three are."""
    rows = np.repeat([[0.0], [5.0], [9.0]], 20, axis=0)
    assert chosen_count(rows, iv.k_medians).count == 3
    assert chosen_count(np.ones((30, 2)), iv.k_medians).count == 1
