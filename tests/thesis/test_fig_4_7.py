"""Figures 4.7 and 4.8: HKS vectors on meshes of marching cubes and DistMesh."""

from __future__ import annotations

import pytest

from isovary.thesis import Outcome, Verdict, experiment, settings_of

FIGURE = experiment("4.7")


@pytest.fixture(scope="module")
def outcome() -> Outcome:
    return FIGURE.run(settings_of(FIGURE, small=True))


def test_spike_of_the_sphere(outcome):
    """Oracle: analytic. All vectors of a sphere are equal; elements on it err in this order."""
    finding = outcome.findings[0]
    assert finding.verdict is Verdict.CONFIRMED
    numbers = finding.numbers
    assert numbers["cubes"] > 2 * numbers["distmesh"] > 40 * numbers["curved"]
    assert numbers["curved"] < 0.02


def test_errors_on_the_ellipsoid(outcome):
    """Oracle: measured prototypes, against the exact vectors: cubes at least 1.4 times worse."""
    finding = outcome.findings[1]
    assert finding.verdict is Verdict.CONFIRMED
    numbers = finding.numbers
    assert numbers["error_cubes"] > 1.4 * numbers["error_distmesh"]
    assert 0.1 < numbers["error_distmesh"] < 1
    assert numbers["error_curved"] < 0.02
    assert numbers["worst_cubes"] > 1.4 * numbers["worst_distmesh"]


def test_a_sphere_gains_as_much(outcome):
    """Oracle: theory. Where curvature is the same everywhere, no sizing by it can help."""
    finding = outcome.findings[2]
    assert finding.verdict is Verdict.CONFIRMED
    assert finding.numbers["sphere"] > 0.5 * finding.numbers["ellipsoid"] > 0.7
    assert finding.numbers["gain"] > 10
    errors = outcome.findings[1].numbers
    assert finding.numbers["gain"] <= errors["error_distmesh"] / errors["error_curved"]
    assert finding.numbers["ellipsoid"] == errors["error_cubes"] / errors["error_distmesh"]


def test_figure_shows_ellipsoid_and_sphere(outcome):
    """Oracle: data. Three surfaces, a scale, and both histograms."""
    titles = [axes.get_title(loc="left") for axes in outcome.figure.axes]
    assert [title[:3] for title in titles if title[:2] == "4."] == ["4.7", "4.8"]
    assert len(titles) == 5 or len(titles) == 6
