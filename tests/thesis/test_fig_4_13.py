"""Figures 4.13 to 4.16: meshes sized by curvature, blindly and evenly."""

from __future__ import annotations

import numpy as np
import pytest

from isovary.thesis import Outcome, Verdict, experiment, settings_of

FIGURE = experiment("4.13")


@pytest.fixture(scope="module")
def outcome() -> Outcome:
    return FIGURE.run(settings_of(FIGURE, small=True))


def test_histograms_become_smoother(outcome):
    """Oracle: theory. Counting noise falls with the number of vertices."""
    numbers = outcome.findings[0].numbers
    assert numbers["rough_900"] < numbers["rough_300"]
    assert outcome.findings[0].verdict is Verdict.CONFIRMED


@pytest.mark.parametrize("place", [1, 4])
def test_no_second_mode(outcome, place):
    """Oracle: analytic. The exact density of the norms falls monotonically: one mode."""
    finding = outcome.findings[place]
    assert finding.numbers["exact"] == 1
    assert finding.numbers["modes_900"] == 1
    assert finding.verdict is Verdict.REFUTED


def test_density_of_vertices_shapes_the_histogram(outcome):
    """Oracle: theory. Exact vectors alone, counted by vertex, move more than the errors do."""
    numbers = outcome.findings[2].numbers
    assert numbers["modes"] == 1
    assert numbers["density"] > 0.1, "as many vertices as area everywhere"
    assert numbers["density_curvature"] > 3 * numbers["density"]
    assert numbers["density_curvature"] > 3 * numbers["errors"]


def test_blind_sizes_cost_accuracy(outcome):
    """Oracle: theory. Edges graded 4 : 1 at equal count err like the longest: within 1.05 to 4."""
    assert 1.05 < outcome.findings[3].numbers["ratio"] < 4


def test_curvature_gains_nothing_over_even_edges(outcome):
    """Oracle: measured prototypes. Within 10 or so percent of the uniform mesh's error."""
    finding = outcome.findings[5]
    assert 0.85 < finding.numbers["ratio"] < 1.25
    assert (finding.verdict is Verdict.CONFIRMED) == (finding.numbers["ratio"] < 1 / 1.05)


def test_orders_of_convergence(outcome):
    """Oracle: theory. Order 2 for flat elements on any mesh; curved ones err far less."""
    finding = outcome.findings[6]
    assert finding.verdict is Verdict.CONFIRMED
    orders = [finding.numbers[f"order_{name}"] for name in ("curvature", "nonuniform", "uniform")]
    assert orders == pytest.approx([2, 2, 2], abs=0.5)
    assert finding.numbers["curved"] < 0.1 * finding.numbers["same_mesh"]


def test_figure_shows_meshes_errors_and_histograms(outcome):
    """Oracle: data. Three surfaces, errors, three histograms and the exact ones."""
    titles = [axes.get_title(loc="left") for axes in outcome.figure.axes]
    assert len(titles) == 8
    assert sum("300 vertices" in title for title in titles) == 3
    for number in ("4.14", "4.15", "4.16"):
        assert np.sum([title.startswith(number) for title in titles]) == 1
