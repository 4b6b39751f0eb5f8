"""Figure 5.6: the third group of an open surface is its rim."""

from __future__ import annotations

import pytest

from isovary.thesis import Verdict, experiment, settings_of


@pytest.fixture(scope="module")
def outcome():
    chosen = experiment("5.6")
    return chosen.run(settings_of(chosen, small=True))


def test_rays_miss_at_the_rim_only(outcome):
    """Oracle: geometry. Inside the box both surfaces go on: a normal can only miss near a rim."""
    found = outcome.findings[0]
    assert found.verdict is Verdict.IN_PART
    assert 0.9 < found.numbers["covered"] < 1
    assert found.numbers["missed_near_rim"] == 1


def test_the_third_group_is_made_by_the_cut(outcome):
    """Oracle: theory. A surface without a rim has no such group: the difference is the cut's."""
    found = outcome.findings[1]
    assert found.verdict is Verdict.REFUTED
    assert found.numbers["near_rim"] > 2 * found.numbers["all_near_rim"]
    assert found.numbers["share"] > 0.5
    assert found.numbers["curvature"] < 0


def test_the_natural_boundary_doubles_the_signature(outcome):
    """Oracle: analytic. The image of a node on a straight rim is itself: 2, and 1 far inside."""
    numbers = outcome.findings[2].numbers
    assert abs(numbers["rim"] - 2) < 0.25
    assert abs(numbers["inside"] - 1) < 0.1


def test_the_figure_shows_both_ways(outcome):
    """Oracle: data. Three groups by the thesis's way and by ours, and the change with no cut."""
    captions = [axes.get_title(loc="left") for axes in outcome.figure.axes]
    assert sum("3 groups" in text for text in captions) == 2
    assert sum("without the cut" in text for text in captions) == 1
