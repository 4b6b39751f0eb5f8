"""Figures 4.9 and 4.10: nine points on three dimples, by graphs of two rules."""

from __future__ import annotations

import numpy as np
import pytest

from isovary.thesis import Outcome, Verdict, experiment, settings_of
from isovary.thesis._fig_4_9 import _pattern, _places, _spread

FIGURE = experiment("4.9")


@pytest.fixture(scope="module")
def outcome() -> Outcome:
    return FIGURE.run(settings_of(FIGURE, small=True))


def test_like_places_in_three_dimples():
    """Oracle: algebra. Unit vectors; angles to their centre are spots times the radius."""
    centres, places = _places(settings_of(FIGURE))
    assert np.linalg.norm(places, axis=1) == pytest.approx(1)
    assert np.degrees(np.arccos(centres[:, 0])) == pytest.approx([45, 52, 60])
    angles = np.arccos((places.reshape(3, 3, 3) * centres[:, None]).sum(axis=-1).clip(-1, 1))
    assert angles[:, 1:] == pytest.approx(np.tile([0.18, 0.42], (3, 1)))
    apart = np.arccos(centres @ centres.T)[np.triu_indices(3, 1)]
    assert apart.min() > 2 * 0.6, "the dimples overlap"


def test_pattern_and_spread():
    """Oracle: algebra. A factor common to all points drops out; equal colours have no spread."""
    curves = np.tile([[1.0, 4.0], [2.0, 2.0], [3.0, 3.0]], (3, 1))
    assert _pattern(7 * curves)[:3, 0] == pytest.approx([-0.5, 0, 0.5])
    assert _spread(curves) == pytest.approx([0, 0])
    curves[0] *= 1.1
    assert (_spread(curves) > 0).all()


def test_degree_counts_more_than_the_rule(outcome):
    """Oracle: measured prototypes. Either rule can win; at matched degrees they are alike.

    What is told follows from the ratios, which are those of two of the four graphs on each mesh.
    """
    finding = outcome.findings[1]
    numbers = finding.numbers
    ratios = [ratio for key, ratio in numbers.items() if key.startswith("matched_")]
    assert len(ratios) == numbers["of"] == 4
    assert 0.5 < min(ratios) <= max(ratios) < 2
    assert numbers["won"] == sum(ratio > 1 for ratio in ratios)
    assert np.log(numbers["rule"]) == pytest.approx(np.abs(np.log(ratios)).mean())
    assert 1 <= numbers["rule"] < numbers["degree"]
    decided = {0: Verdict.REFUTED, 4: Verdict.CONFIRMED}
    assert finding.verdict is decided.get(int(numbers["won"]), Verdict.IN_PART)


def test_colours_are_grouped_early(outcome):
    """Oracle: theory. At small times the signature knows only the shape around the point."""
    finding = outcome.findings[2]
    assert finding.numbers["early"] < 0.25 < finding.numbers["epsilon"]
    assert finding.verdict in (Verdict.CONFIRMED, Verdict.IN_PART)


def test_elements_need_no_neighbours(outcome):
    """Oracle: measured prototypes. Graphs err ten times as much as flat elements do."""
    finding = outcome.findings[3]
    numbers = finding.numbers
    assert numbers["graph"] > 3 * numbers["flat"]
    assert numbers["graph"] == min(numbers["radius_1000"], numbers["nearest_1000"])
    won = sum(numbers[f"nearest_{n}"] < numbers[f"radius_{n}"] for n in (600, 1000))
    decided = {0: Verdict.REFUTED, 2: Verdict.CONFIRMED}
    assert finding.verdict is decided.get(won, Verdict.IN_PART)


def test_verdict_on_the_rules_follows_the_ratios(outcome):
    """Oracle: algebra. Confirmed only if the nearest neighbours win on every mesh."""
    finding = outcome.findings[0]
    ratios = list(finding.numbers.values())
    assert (finding.verdict is Verdict.CONFIRMED) == (min(ratios) > 1.1)
    assert len(ratios) == 2


def test_figure_shows_points_curves_and_errors(outcome):
    """Oracle: data. A surface, four bundles of nine curves, and errors by degree."""
    axes = outcome.figure.axes
    assert len(axes) == 6
    assert [len(one.lines) for one in axes[1:5]] == [9] * 4
