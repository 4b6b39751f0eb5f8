"""Deterministic annealing: the noise of a small change comes from the meshes, not from it."""

from __future__ import annotations

import numpy as np
import pytest

import isovary as iv
from isovary.thesis import Outcome, Verdict, experiment, settings_of
from isovary.thesis._perturbed import best_group, overlap, roughness


@pytest.fixture(scope="module")
def outcome() -> Outcome:
    found = experiment("4.20")
    return found.run(settings_of(found, small=True))


def test_the_noise_is_in_the_change(outcome):
    """Oracle: data. Meshed twice, a small change drowns whatever groups it; carried it does not."""
    small, noise = outcome.findings[:2]
    assert small.numbers["fit_carried"] > 0.5 > small.numbers["fit_rays"]
    assert small.verdict is Verdict.IN_PART
    assert noise.numbers["roughness_carried"] < 0.15
    assert noise.numbers["roughness_rays"] > 0.5
    assert noise.numbers["medians_rays"] < 0.2
    assert noise.verdict is Verdict.REFUTED


def test_bigger_protrusions_are_caught_in_part(outcome):
    """Oracle: data. The map of space tells what moved: the group lies in it and has its top."""
    numbers = outcome.findings[2].numbers
    assert numbers["inside"] > 0.9
    assert numbers["caught"] > 0.9
    assert numbers["most_fit"] < 0.9
    assert outcome.findings[2].verdict is Verdict.CONFIRMED


def test_no_method_wins(outcome):
    """Oracle: data. On one mesh k-medians fits better, on two annealing; as in docs/grouping.md."""
    choice, number = outcome.findings[3:]
    assert 0 < choice.numbers["won"] < choice.numbers["of"] == 6
    assert choice.verdict is Verdict.IN_PART
    assert all(count >= 2 for count in number.numbers.values())


def test_overlap_and_roughness_by_hand():
    """Oracle: algebra. 1 of 3 areas in common; alternating and equal values on a square's ring."""
    areas, wanted = np.array([1.0, 2.0, 1.0]), np.array([True, False, True])
    labels = np.array([1, 1, 0])
    assert overlap(labels == 1, wanted, areas) == 0.25
    assert best_group(labels, wanted, areas) == 0
    ball = iv.icosphere(3, order=1)
    noise = np.random.default_rng(0).normal(size=(len(ball.points), 4))
    assert roughness(noise, ball) == pytest.approx(1, abs=0.1)
    assert roughness(np.array(ball.points), ball) < 0.02


def test_the_figure_shows_each_case(outcome):
    """Oracle: data. Three rows of four surfaces, and how much of the region is found."""
    named = [axes for axes in outcome.figure.axes if axes.get_ylabel() == "IoU"]
    assert len(outcome.figure.axes) == 15
    assert len(named) == 3
