"""Section 4.1.5: the scaling of the change, as printed and as its source has it."""

from __future__ import annotations

import numpy as np
import pytest
from oracles import spheroid_signature

from isovary.thesis import Outcome, Verdict, experiment, settings_of
from isovary.thesis._fig_4_1_5 import effective


@pytest.fixture(scope="module")
def outcome() -> Outcome:
    found = experiment("4.1.5")
    return found.run(settings_of(found, small=True))


def test_the_small_times_swamp_and_more_so_as_printed(outcome):
    """Oracle: prototype. Of eight dimples' change the smallest tenth of the times has 0.28 raw,
    0.105 divided by the trace and 0.54 multiplied by it (linear elements, other dimples).
    """
    swamped, balanced = outcome.findings[:2]
    for way, share in (("raw", 0.28), ("divided", 0.105), ("printed", 0.54)):
        for name in ("curved", "flat"):
            assert balanced.numbers[f"{way}_{name}"] == pytest.approx(share, abs=0.05)
    assert swamped.numbers["share_curved"] == balanced.numbers["raw_curved"]
    assert swamped.verdict is Verdict.CONFIRMED
    assert balanced.verdict is Verdict.REFUTED
    counts = [balanced.numbers[f"effective_{way}"] for way in ("printed", "raw", "divided")]
    assert counts == sorted(counts)


def test_as_printed_a_shallow_dimple_is_lost(outcome):
    """Oracle: prototype. IoU with dimples of depth 0.05: 0.08 multiplied, 0.63 divided."""
    found = outcome.findings[2]
    for name in ("curved", "flat"):
        assert found.numbers[f"printed_{name}_0.05"] < 0.2
        assert found.numbers[f"divided_{name}_0.05"] > 0.6
    assert found.verdict is Verdict.IN_PART


def test_vertices_are_not_area(outcome):
    """Oracle: theory. At the largest time the signature is 1 / area everywhere but for its last
    mode, a ten-thousandth of it: there both means are one, and before they are not. Vertices lie
    evenly in z, which is the mean over them of the exact signature by separation of variables.
    """
    sums = outcome.findings[3]
    assert sums.numbers["last"] == pytest.approx(1, abs=1e-3)
    assert sums.numbers["most"] > 0.01
    height = np.arange(-1.995, 2, 0.01)
    exact = spheroid_signature(2.0, height, np.array([sums.numbers["time"]]))[:, 0]
    area = np.sqrt(1 - height**2 / 4 + height**2 / 16)
    ratio = exact.mean() * area.sum() / (exact @ area)
    assert sums.numbers["most"] == pytest.approx(abs(ratio - 1), rel=0.1)
    assert sums.verdict is Verdict.IN_PART


def test_times_that_count_by_hand():
    """Oracle: algebra. All of four alike: all count; one alone: a quarter; two: a half."""
    assert effective(np.full(4, 0.25)) == 1
    assert effective(np.array([1.0, 0, 0, 0])) == 0.25
    assert effective(np.array([0.5, 0.5, 0, 0])) == 0.5


def test_the_figure_shows_each_scaling(outcome):
    """Oracle: data. Profiles and IoU, and two depths by three scalings."""
    axes = outcome.figure.axes
    assert len(axes) == 8
    assert axes[0].get_ylabel() == "share (%)"
    assert axes[1].get_ylabel() == "IoU"
    assert len(axes[0].lines) == 4
    assert sum("IoU 0." in each.get_title(loc="left") for each in axes) == 6
