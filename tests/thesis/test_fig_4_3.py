"""Figure 4.3: eigenpairs that a signature needs."""

from __future__ import annotations

import numpy as np
import pytest

from isovary.thesis import Verdict, experiment, settings_of
from isovary.thesis._fig_4_3 import _enough


@pytest.fixture(scope="module")
def outcome():
    found = experiment("4.3")
    return found.run(settings_of(found, small=True))


def test_few_pairs_err_as_weyl_says(outcome):
    """Oracle: theory. Eigenvalues grow like their number, so k of K pairs leave a part
    exp(-lambda_k t) = 10^(-4 k / K) of the signature at the smallest time, 4 ln 10 / lambda_K.
    """
    numbers = outcome.findings[0].numbers
    for count in (10, 50, 100):
        assert numbers[f"error_{count}"] == pytest.approx(10 ** (-4 * count / 200), rel=0.3)
    assert outcome.findings[0].verdict is Verdict.IN_PART


def test_pairs_are_enough_at_the_times_they_give(outcome):
    """Oracle: theory. Of all pairs the first k leave exp(-lambda_k t), 10^-4 at the smallest time
    that they give themselves, 4 ln 10 / lambda_k. The next ones all count a little: up to 3 times.
    """
    assert 3e-5 < outcome.findings[0].numbers["own"] < 3e-4


def test_the_verdict_follows_the_errors():
    """Oracle: logic. Enough and no change: confirmed; few are too few: in part; not enough."""
    few, none = np.array([0.5, 0.001, 0.0]), np.array([0.05, 0.001, 0.0])
    assert _enough([10, 300, 500], few, 300, 1e-4).verdict is Verdict.IN_PART
    assert _enough([10, 300, 500], none, 300, 1e-4).verdict is Verdict.CONFIRMED
    assert _enough([10, 300, 500], none, 300, 0.02).verdict is Verdict.REFUTED


def test_logarithmic_times_see_both_ranges(outcome):
    """Oracle: analytic. On a sphere the signature times the area is the sum of
    (2 l + 1) exp(-l (l + 1) t): 10 at t = 0.103 and 2 at 0.617; times from 4 ln 10 / 210 to
    4 ln 10 / 2, for eigenvalue 200 is of degree 14.
    """
    found = outcome.findings[2]
    first, last = 4 * np.log(10) / np.array([210, 2])
    span = np.log(last / first)
    assert found.numbers["local"] == pytest.approx(np.log(0.103 / first) / span, abs=0.02)
    assert found.numbers["whole"] == pytest.approx(np.log(last / 0.617) / span, abs=0.02)
    assert found.numbers["even_local"] == pytest.approx((0.103 - first) / (last - first), abs=0.005)
    assert found.numbers["even_whole"] == pytest.approx((last - 0.617) / (last - first), abs=0.02)
    assert found.verdict is Verdict.CONFIRMED


def test_the_graph_converges_as_quickly(outcome):
    """Oracle: theory. Its eigenvalues grow like their number, too: no verdict but refuted."""
    ratio = outcome.findings[1].numbers["ratio"]
    assert 0.5 < ratio < 2
    assert abs(ratio - 1) > 0.01, "the graph is none"
    assert outcome.findings[1].verdict is Verdict.REFUTED


def test_the_figure_shows_both_and_the_errors(outcome):
    """Oracle: data. Two panels of curves, one of errors, each with named axes."""
    signatures, graph, errors = outcome.figure.axes
    assert len(signatures.lines) == len(graph.lines) == 8
    assert errors.get_xlabel() == "eigenpairs"
    assert "%" in errors.get_ylabel()
