"""Polar dimples on an ellipsoid: steady drawn out, not pushed in; both poles alike."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from isovary.thesis import Outcome, Verdict, experiment, settings_of


@pytest.fixture(scope="module")
def outcome() -> Outcome:
    found = experiment("5.2")
    return found.run(settings_of(found, small=True))


def test_the_change_is_steady_only_drawn_out(outcome):
    """Oracle: analytic. The pole's curvature (c / a^2)^2 falls to 0 as the tip goes flat."""
    finding = outcome.findings[0]
    numbers = finding.numbers
    assert numbers["bend"] == pytest.approx(2.0, rel=1e-5)
    assert numbers["steady_out"] >= 0.95
    assert numbers["steady_in"] < 0.5
    assert 1 < numbers["flat_at"] < 4
    assert finding.verdict is Verdict.IN_PART


def test_the_poles_agree(outcome):
    """Oracle: analytic. A mirror maps one pole to the other; without it what differs is error."""
    finding = outcome.findings[1]
    assert finding.numbers["mismatch_symmetric"] < 1e-6
    assert 1e-6 < finding.numbers["mismatch_curved"] < finding.numbers["mismatch_flat"] / 3
    assert finding.numbers["mismatch_flat"] < 0.02
    assert finding.verdict is Verdict.CONFIRMED


@pytest.mark.parametrize(("name", "alpha"), [("depth_first", 1.0), ("depth_last", 9.0)])
def test_depths_follow_the_force_law(outcome, name, alpha):
    """Oracle: peer. SciPy integrates x'' = -alpha / (p - x)^2 on the axis, p from 1 to 0.5."""

    def rate(time, state):
        return state[1], -alpha / (1 - 0.5 * time / 0.2 - state[0]) ** 2

    depth = -solve_ivp(rate, (0, 0.2), (0.0, 0.0), rtol=1e-9).y[0, -1]
    finding = outcome.findings[2]
    assert finding.numbers[name] == pytest.approx(depth, rel=0.02)
    assert finding.verdict is Verdict.OPEN


def test_the_figure_shows_shapes_curves_and_errors(outcome):
    """Oracle: data. Two surfaces, two sets of curves, the curvature and the mismatch."""
    titles = [axes.get_title(loc="left") for axes in outcome.figure.axes]
    assert len(titles) == 6
    assert sum("drawn out" in title for title in titles) == 3
    curves = outcome.figure.axes[titles.index("Signature at the poles, pushed in")]
    assert np.array([np.ptp(line.get_ydata()) > 0 for line in curves.lines[:-1]]).all()
