"""A growing dimple: eigenvalues hardly move, the HKS finds it, the plain GPS does not."""

from __future__ import annotations

import pytest

from isovary.thesis import Outcome, Verdict, experiment, settings_of


@pytest.fixture(scope="module")
def outcome() -> Outcome:
    found = experiment("4.18")
    return found.run(settings_of(found, small=True))


def test_the_eigenvalues_hardly_move(outcome):
    """Oracle: data. 0.2 % in the mean and up to 1.4 %, as measured by another program's elements.

    The exact l (l + 1): flat elements are off by more, of order h^2 lambda.
    """
    finding = outcome.findings[0]
    assert 5e-4 < finding.numbers["shift_mean"] < 5e-3
    assert finding.numbers["shift_most"] < 0.014
    assert finding.numbers["flat_error_mean"] > finding.numbers["shift_mean"]
    assert finding.numbers["curved_error_most"] < 0.2 * finding.numbers["flat_error_most"]
    assert finding.verdict is Verdict.CONFIRMED


@pytest.mark.parametrize(("number", "exact"), [(4, 2), (9, 6), (16, 12), (25, 20)])
def test_the_numbers_apart_end_the_shells(outcome, number, exact):
    """Oracle: analytic. The last of the shell of degree l is the number (l + 1)^2: l (l + 1)."""
    assert outcome.findings[1].numbers[f"value_{number}"] == pytest.approx(exact, rel=3e-4)


def test_harmonics_stay_and_find_the_axis(outcome):
    """Oracle: analytic. First order perturbation turns a simple shell by little; a round dimple
    commutes with rotations about its axis, so single orders m remain."""
    kept, pronounced = outcome.findings[1:3]
    assert 0.95 < kept.numbers["least_cosine"] <= 1 + 1e-6
    assert kept.verdict is Verdict.CONFIRMED
    assert pronounced.numbers["purity_dimpled"] > 0.999
    assert pronounced.numbers["purity_sphere"] < 0.9
    assert pronounced.verdict is Verdict.IN_PART


def test_only_the_hks_locates(outcome):
    """Oracle: analytic. Signs and rotations are arbitrary: the GPS differs everywhere.

    The squares' sums are not; they and the HKS change at the tip, and hardly opposite it.
    """
    fails, reason, sees = outcome.findings[3:]
    assert fails.numbers["gps_opposite"] > 0.5
    assert fails.numbers["gps_tip"] == pytest.approx(fails.numbers["gps_opposite"], rel=0.2)
    assert fails.verdict is Verdict.CONFIRMED
    assert reason.numbers["length_tip"] > 10 * reason.numbers["length_opposite"]
    assert reason.verdict is Verdict.REFUTED
    assert sees.numbers["hks_tip"] > 0.01
    assert sees.numbers["hks_opposite"] < 1e-3
    assert sees.verdict is Verdict.CONFIRMED


def test_the_figure_has_a_chart_and_curves(outcome):
    """Oracle: data. Two rows of nine eigenfunctions, and three sets of axes with names."""
    named = [axes for axes in outcome.figure.axes if axes.get_xlabel()]
    assert len(outcome.figure.axes) == 2 * 9 + 3
    assert named[0].get_title(loc="left") == "Figure 4.18: eigenvalues"
    assert len(named) == 3
