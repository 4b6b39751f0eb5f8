"""Multidimensional scaling: smooth on one mesh, noisy between two."""

from __future__ import annotations

import numpy as np
import pytest

from isovary.thesis import Outcome, Verdict, experiment, settings_of
from isovary.thesis._fig_4_21 import _stress


@pytest.fixture(scope="module")
def outcome() -> Outcome:
    found = experiment("4.21")
    return found.run(settings_of(found, small=True))


def test_the_region_is_told_apart(outcome):
    """Oracle: data. What moved is known; both embeddings put it far from the rest."""
    assert min(outcome.findings[0].numbers.values()) > 0.9
    assert outcome.findings[0].verdict is Verdict.CONFIRMED


@pytest.mark.parametrize("name", ["classical", "universal"])
def test_the_noise_is_that_of_two_meshes(outcome, name):
    """Oracle: analytic. Where nothing moved the true change is smooth: 0 against 1 for noise."""
    numbers = outcome.findings[1].numbers
    assert numbers[f"rough_{name}_carried"] < 0.1
    assert numbers[f"rough_{name}_rays"] > 0.25
    assert outcome.findings[1].verdict is Verdict.IN_PART
    assert outcome.findings[3].verdict is Verdict.REFUTED


def test_three_dimensions_hold_the_distances(outcome):
    """Oracle: algebra. Universal scaling lowers the stress that classical scaling leaves."""
    numbers = outcome.findings[2].numbers
    assert max(numbers.values()) < 0.1
    for way in ("carried", "rays"):
        assert numbers[f"stress_universal_{way}"] < numbers[f"stress_classical_{way}"]


def test_stress_by_hand():
    """Oracle: algebra. Distances a tenth too long everywhere: 0.1."""
    rows = np.random.default_rng(2).normal(size=(40, 1))
    assert _stress(rows, 1.1 * rows, {"seed": 0, "sample": 30}) == pytest.approx(0.1)


def test_the_figure_has_two_views_of_each(outcome):
    """Oracle: data. A row for each way; classical and universal, general and near."""
    titles = [axes.get_title(loc="left") for axes in outcome.figure.axes]
    assert len(titles) == 8
    assert sum("perturbed area" in title for title in titles) == 2
