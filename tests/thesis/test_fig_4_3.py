"""Figure 4.3: eigenpairs that a signature needs."""

from __future__ import annotations

import pytest

from isovary.thesis import Verdict, experiment, settings_of


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
    assert numbers["needed"] == 200
    assert outcome.findings[0].verdict is Verdict.IN_PART


def test_the_graph_converges_as_quickly(outcome):
    """Oracle: theory. Its eigenvalues grow like their number, too: no verdict but refuted."""
    assert 0.5 < outcome.findings[1].numbers["ratio"] < 2
    assert outcome.findings[1].verdict is Verdict.REFUTED


def test_the_figure_shows_both_and_the_errors(outcome):
    """Oracle: data. Two panels of curves, one of errors, each with named axes."""
    signatures, graph, errors = outcome.figure.axes
    assert len(signatures.lines) == len(graph.lines) == 8
    assert errors.get_xlabel() == "eigenpairs"
    assert "%" in errors.get_ylabel()
