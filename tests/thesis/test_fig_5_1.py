"""The dimple maker: one motion for all meshes, nothing outside the region, in and out."""

from __future__ import annotations

import pytest
from scipy.integrate import solve_ivp

from isovary.thesis import Outcome, Verdict, experiment, settings_of


@pytest.fixture(scope="module")
def outcome() -> Outcome:
    found = experiment("5.1")
    return found.run(settings_of(found, small=True))


def _exact_depth(alpha: float) -> float:
    """Of x'' = -alpha / (p - x)^2 from rest, p from 1 to 0.5 within the time 0.2."""

    def rate(time, state):
        return state[1], -alpha / (1 - 2.5 * time - state[0]) ** 2

    return float(-solve_ivp(rate, (0, 0.2), (0.0, 0.0), rtol=1e-10, atol=1e-12).y[0, -1])


def test_meshes_do_not_matter(outcome):
    """Oracle: analytic. Particles do not act on one another: nodes in common move identically."""
    assert outcome.findings[0].numbers["worst"] < 1e-14
    assert outcome.findings[0].verdict is Verdict.CONFIRMED


def test_only_the_region_moves(outcome):
    """Oracle: analytic. The force is 0 from the radius on; exp(-1 / 0.35^2) is what is cut."""
    finding = outcome.findings[1]
    assert finding.numbers["outside"] == 0
    assert finding.numbers["cliff"] == pytest.approx(2.85e-4, rel=1e-2)
    assert finding.verdict is Verdict.CONFIRMED


def test_it_pushes_in_and_draws_out(outcome):
    """Oracle: peer. SciPy integrates the force on the axis, for either sign; 20 steps are 2 %."""
    finding = outcome.findings[2]
    assert finding.numbers["inward"] == pytest.approx(_exact_depth(5.0), rel=0.02)
    assert finding.numbers["outward"] == pytest.approx(-_exact_depth(-5.0), rel=0.02)
    assert finding.verdict is Verdict.CONFIRMED


def test_few_steps_are_enough(outcome):
    """Oracle: peer. SciPy's depth is the limit; errors of first order halve with the steps."""
    finding = outcome.findings[3]
    assert finding.numbers["limit"] == pytest.approx(_exact_depth(5.0), rel=1e-3)
    assert finding.numbers["ratio"] == pytest.approx(2, abs=0.3)
    assert finding.verdict is Verdict.CONFIRMED
    assert outcome.findings[4].verdict is Verdict.OPEN


def test_the_figure_shows_section_shapes_and_curves(outcome):
    """Oracle: data. The section, two spheres, decay, meshes and steps."""
    titles = [axes.get_title(loc="left") for axes in outcome.figure.axes]
    assert len(titles) == 6
    assert "A section: flight, region and motion" in titles
