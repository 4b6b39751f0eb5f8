"""The working example: the dimples are found, and the change is not in proportion to the step."""

from __future__ import annotations

import numpy as np
import pytest

from isovary.thesis import Outcome, Verdict, experiment, settings_of


@pytest.fixture(scope="module")
def outcome() -> Outcome:
    found = experiment("4.1")
    return found.run(settings_of(found, small=True))


def test_two_groups_find_the_dimples(outcome):
    """Oracle: data. The dimples' places are given; with few pairs still more in common than not."""
    numbers = outcome.findings[0].numbers
    assert numbers["fit_0.2"] > 0.7
    assert numbers["fit_0.05"] > 0.5
    assert outcome.findings[0].verdict is Verdict.IN_PART


def test_both_dimples_change_alike(outcome):
    """Oracle: analytic. A mirror maps one onto the other, and the mesh onto itself."""
    numbers = outcome.findings[1].numbers
    assert numbers["mismatch"] < 1e-6
    assert numbers["tip"] > 1.5 * numbers["equator"]
    seen = numbers["tip"] > 3 * numbers["equator"]
    assert (outcome.findings[1].verdict is Verdict.CONFIRMED) == seen


def test_the_change_is_not_in_proportion(outcome):
    """Oracle: analytic. The remainder of a Taylor series: a tenth of the step, a tenth of it.

    Another program found 5 % at a depth of 0.01 and more than 30 % at 0.1.
    """
    numbers = outcome.findings[2].numbers
    assert 0.02 < numbers["departure_0.01"] < 0.06
    assert numbers["departure_0.1"] > 0.25
    ratio = numbers["departure_0.1"] / numbers["departure_0.01"]
    assert np.log10(ratio) == pytest.approx(1, abs=0.25)
    assert numbers["order"] == pytest.approx(np.log10(ratio))
    assert outcome.findings[2].verdict is Verdict.IN_PART


def test_the_figure_shows_both_depths(outcome):
    """Oracle: data. Three surfaces for each depth, and two sets of curves."""
    titles = [axes.get_title(loc="left") for axes in outcome.figure.axes]
    assert len(titles) == 8
    assert {"depth 0.05", "depth 0.2", "Departure from proportion"} <= set(titles)
    assert outcome.findings[3].verdict is Verdict.OPEN
