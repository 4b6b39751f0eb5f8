"""Figure 3.1: signatures on a dimple and away from it."""

from __future__ import annotations

import pytest

from isovary.thesis import Verdict, experiment, settings_of


@pytest.fixture(scope="module")
def outcome():
    chosen = experiment("3.1")
    return chosen.run(settings_of(chosen, small=True))


def test_the_curves_part_and_meet(outcome):
    """Oracle: theory. Small times see the dimple, large ones 1 / area wherever they start."""
    found = outcome.findings[0]
    assert found.verdict is Verdict.CONFIRMED
    assert found.numbers["most"] > 0.05
    assert found.numbers["late"] < 1e-3


def test_the_curvature_is_read_off(outcome):
    """Oracle: analytic. On a unit sphere K = 1 + t / 5 at t = 0.074; flat elements miss it more.

    The tip is narrower than what the smallest time sees, so its curvature is read too low.
    """
    found = outcome.findings[1]
    assert found.verdict is Verdict.IN_PART
    assert abs(found.numbers["away"] - (1 + 0.074 / 5)) < 0.01
    assert abs(found.numbers["away_flat"] - 1) > abs(found.numbers["away"] - 1)
    assert 1 < found.numbers["tip"] < found.numbers["tip_exact"]


def test_the_kernel_is_symmetric(outcome):
    """Oracle: theory. The kernel of a self-adjoint operator."""
    assert outcome.findings[2].numbers["error"] < 1e-10


def test_the_figure_has_both_curves(outcome):
    """Oracle: data. Figure 3.1 has a curve on the dimple and one away from it."""
    captions = {axes.get_title(loc="left"): axes for axes in outcome.figure.axes}
    labels = [line.get_label() for line in captions["Both signatures"].lines]
    assert {"on the dimple", "away"} <= set(labels)
