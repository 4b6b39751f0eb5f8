"""Figure 2.1: bending leaves the signature, contact changes it where it is, and then beyond."""

from __future__ import annotations

import numpy as np
import pytest

from isovary.thesis import Outcome, Verdict, experiment, settings_of
from isovary.thesis._fig_2_1 import middle_line, position, steps_of


@pytest.fixture(scope="module")
def outcome() -> Outcome:
    found = experiment("2.1")
    return found.run(settings_of(found, small=True))


def test_rolling_is_not_seen(outcome):
    """Oracle: theory. It is an isometry: no change but the mesh's, below 1e-3. The rolled sheet
    sinks 1 - cos(2) below its middle at its sides, and the flat one does not.
    """
    numbers = outcome.findings[0].numbers
    assert numbers["curved"] < 1e-3
    assert numbers["curved"] < numbers["flat"] < 1e-2
    assert numbers["distance"] == pytest.approx(1 - np.cos(2), abs=0.02)
    assert outcome.findings[0].verdict is Verdict.CONFIRMED


def test_bending_changes_less_than_contact(outcome):
    """Oracle: theory. A bent tube of radius r stretches by r * bend / length, opposite on its two
    sides, so that only the square of that is left in a slice: (0.42 * 5.2 / 6)^2 = 0.13 at most.
    """
    numbers = outcome.findings[1].numbers
    assert 0 < numbers["bending"] < 0.05
    assert numbers["contact"] > 3 * numbers["bending"]
    assert numbers["around"] > numbers["around_straight"]
    assert outcome.findings[1].verdict is Verdict.IN_PART


def test_contact_is_local_at_small_times(outcome):
    """Oracle: theory. A ball becomes a ring, genus 1. A rod's end at a distance d adds an image,
    exp(-d^2 / t) of the signature, which a seamless ring has not: 5 % at t = d^2 / ln 20. The
    outermost slice of the middle half is at 1.375 and the end at 3 to 3.42, so t is 0.88 to 1.40
    at the earliest; a narrow neck lets less heat through, which is later.
    """
    numbers = outcome.findings[2].numbers
    assert (numbers["genus_before"], numbers["genus_after"]) == (0, 1)
    assert numbers["middle_small"] < 0.05 < numbers["tips_small"]
    assert 0.88 < numbers["untouched"] < 3 * 1.40
    assert outcome.findings[2].verdict is Verdict.IN_PART


def test_changes_are_from_each_pose_to_the_next():
    """Oracle: algebra. Profiles 1, 3 and 7 over a scale of 2: -1 and -2, not -1 and -3."""
    profiles = [np.full((2, 3), value) for value in (1.0, 3.0, 7.0)]
    first, second = steps_of(profiles, np.full(3, 2.0))
    np.testing.assert_array_equal(first, np.full((2, 3), -1.0))
    np.testing.assert_array_equal(second, np.full((2, 3), -2.0))


def test_positions_by_hand():
    """Oracle: algebra. Points of the middle line are where they were put, whatever the bend."""
    for bend in (0.0, 1.0, 5.2):
        line = middle_line(6.0, bend, 7)
        np.testing.assert_allclose(position(line, 6.0, bend), [3, 2, 1, 0, 1, 2, 3], atol=1e-12)
    assert position(np.array([[9.0, 0, 0]]), 6.0, 0.0) == 3


def test_the_figure_shows_the_poses(outcome):
    """Oracle: data. Three surfaces, change along the finger at two times, and the sheet."""
    captions = [axes.get_title(loc="left") for axes in outcome.figure.axes]
    assert captions[0] == "straight"
    assert sum("Change at time" in text for text in captions) == 2
    assert "Sheet, rolled" in captions
