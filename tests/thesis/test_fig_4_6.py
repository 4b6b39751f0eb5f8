"""Figure 4.6: the triangles of marching cubes and of DistMesh."""

from __future__ import annotations

import pytest

from isovary.thesis import Outcome, Verdict, experiment, settings_of

FIGURE = experiment("4.6")


@pytest.fixture(scope="module")
def outcome() -> Outcome:
    return FIGURE.run(settings_of(FIGURE, small=True))


def test_quality_of_the_triangles(outcome):
    """Oracle: measured prototypes. Mean quality 0.66 against over 0.9, worst 0.00 against 0.6."""
    finding = outcome.findings[0]
    assert finding.verdict is Verdict.OPEN
    numbers = finding.numbers
    assert numbers["mean_cubes"] == pytest.approx(0.66, abs=0.03)
    assert numbers["worst_cubes"] < 0.05
    assert numbers["mean_distmesh"] > 0.93
    assert numbers["worst_distmesh"] > 0.5
    assert numbers["ratio"] < 1.02


def test_sizes_follow_the_curvature_but_gain_little(outcome):
    """Oracle: measured prototypes, theory. Correlation beyond -0.86; chords err like length^2.

    Even edges h have the error h^2 k / 8, spread as k; edges of equal angle have it even: on this
    ellipsoid, whose curvature varies by less than 4, the two differ by little.
    """
    finding = outcome.findings[1]
    numbers = finding.numbers
    assert numbers["correlation_distmesh"] < -0.86
    assert abs(numbers["correlation_cubes"]) < 0.3
    gain = numbers["distance_even"] / numbers["distance_distmesh"]
    assert 0.8 < gain < 1.25
    assert (finding.verdict is Verdict.CONFIRMED) == (gain > 1.1)
    assert numbers["distance_cubes"] > 2 * numbers["distance_distmesh"]
    assert numbers["distance_curved"] < 0.05 * numbers["distance_even"]


def test_figure_shows_three_meshes_and_their_quality(outcome):
    """Oracle: data."""
    titles = [axes.get_title(loc="left") for axes in outcome.figure.axes]
    assert titles[0].startswith("Marching cubes")
    assert titles[1].startswith("DistMesh")
    assert len(titles) == 4
    assert len(outcome.figure.axes[3].lines) == 3
