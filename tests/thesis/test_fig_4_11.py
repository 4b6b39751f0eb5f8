"""Figures 4.11 and 4.12: graph and elements against the exact signature of spheroids."""

from __future__ import annotations

import numpy as np
import pytest
from oracles import sphere_signature, spheroid_eigenvalues, spheroid_signature

from isovary.thesis import Outcome, Verdict, experiment, settings_of
from isovary.thesis import _pair_norms as pair_norms
from isovary.thesis._judged import curved, flat
from isovary.thesis._spheroid import eigenvalues, spheroid, spheroid_field

NUMBERS = experiment("4.11")


@pytest.fixture(scope="module")
def outcome() -> Outcome:
    return NUMBERS.run(settings_of(NUMBERS, small=True))


def test_exact_signatures_agree_with_another_basis():
    """Oracle: analytic. Associated Legendre functions instead of sine series; sums on the sphere.

    And known eigenvalues of the spheroids 1:1:2 and 1:1:0.5.
    """
    known = [0, 0.728795, 1.533632, 1.533632, 2.374089, 3.245101, 3.245101]
    assert eigenvalues(2.0, 7) == pytest.approx(known, abs=1e-6)
    assert eigenvalues(0.5, 4) == pytest.approx([0, 2.575105, 2.575105, 3.740681], abs=1e-6)
    for half_axis in (0.5, 2.0):
        assert eigenvalues(half_axis, 80) == pytest.approx(
            spheroid_eigenvalues(half_axis, 80), abs=1e-8
        )
        exact = spheroid(half_axis, 80, 10, places=100)
        expected = spheroid_signature(half_axis, half_axis * np.cos(exact.angles), exact.times)
        np.testing.assert_allclose(exact.rows, expected, rtol=1e-9)
    sphere = spheroid(1.0, 300, 20, places=100)
    np.testing.assert_allclose(
        sphere.rows, np.tile(sphere_signature(sphere.times), (100, 1)), rtol=1e-10
    )


def test_signatures_and_shares_at_points():
    """Oracle: analytic. At any turn about the axis; on the sphere areas are equal in height."""
    exact = spheroid(2.0, 50, 8)
    angle = np.linspace(0, 3, 50)
    height = np.linspace(-1.99, 1.99, 50)
    radius = np.sqrt(1 - (height / 2) ** 2)
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=1)
    np.testing.assert_allclose(
        exact.at(points), spheroid_signature(2.0, height, exact.times), rtol=1e-6
    )
    sphere = spheroid(1.0, 50, 5)
    even = (np.arange(100_000) + 0.5) / 50_000 - 1
    points = np.stack([np.sqrt(1 - even**2), 0 * even, even], axis=1)
    assert np.abs(sphere.shares(points) - sphere.areas).max() < 2e-5


def test_field_vanishes_on_the_spheroid():
    """Oracle: analytic. 1 - x^2 - y^2 - (z / c)^2 is reproduced by the cubic spline."""
    field = spheroid_field(1.5, 0.13)
    assert field.value([[1, 0, 0], [0, 0, -1.5], [0, 0, 0]]) == pytest.approx([0, 0, 1], abs=1e-12)


def test_histogram_of_pairs(monkeypatch):
    """Oracle: brute force. Every pair's norm, counted by NumPy; weights as repeated rows."""
    monkeypatch.setattr(pair_norms, "_BLOCK", 130)
    random = np.random.default_rng(3)
    rows = random.normal(size=(400, 4)) @ random.normal(size=(4, 30)) + 50
    one, other = np.triu_indices(len(rows), 1)
    norms = np.linalg.norm(rows[one] - rows[other], axis=1)
    top = 0.9 * norms.max()
    found = np.cumsum(pair_norms.pair_histogram(rows, top))
    for part in (0.2, 0.5, 0.8):
        assert found[int(part * pair_norms.BINS) - 1] == pytest.approx(
            np.mean(norms < part * top), abs=2e-4
        )
    assert found[-1] == pytest.approx(1)
    weights = random.integers(1, 4, size=40)
    weighted = pair_norms.pair_histogram(rows[:40], top, weights / weights.sum())
    twice = np.repeat(np.arange(40), weights)
    norms = np.linalg.norm(rows[twice][:, None] - rows[twice], axis=-1)
    assert np.cumsum(weighted)[999] == pytest.approx(np.mean(norms < top / 3), abs=1e-3)


def test_modes_distance_and_roughness():
    """Oracle: analytic. One and two bumps; a shift by a tenth; a straight slope and a comb."""
    place = (np.arange(pair_norms.BINS) + 0.5) / pair_norms.BINS

    def bump(middle: float) -> np.ndarray:
        shape = np.exp(-(((place - middle) / 0.05) ** 2))
        return shape / shape.sum()

    assert pair_norms.modes(bump(0.5)) == 1
    assert pair_norms.modes(bump(0.3) + bump(0.6)) == 2
    assert pair_norms.modes(np.exp(-5 * place)) == 1
    assert pair_norms.transport(bump(0.4), bump(0.5), 7.0) == pytest.approx(0.7, rel=1e-3)
    assert pair_norms.roughness((1 - place) / place.sum()) == pytest.approx(0, abs=1e-12)
    assert pair_norms.roughness(np.repeat(np.tile([0, 2], 30), 50) / 3000) > 0.4


def test_curved_mesh_lies_on_the_spheroid():
    """Oracle: analytic. Each node fulfils x^2 + y^2 + z^2 / 4 = 1; flat undoes curved."""
    from isovary import ellipsoid

    mesh = ellipsoid([1, 1, 2], 2, order=1)
    smooth = curved(mesh, 2.0)
    assert (smooth.points**2 / [1, 1, 4]).sum(axis=1) == pytest.approx(1, abs=1e-12)
    np.testing.assert_allclose(flat(smooth).points, mesh.points, atol=1e-12)


def test_ellipsoid_has_one_mode(outcome):
    """Oracle: analytic. The exact density of the norms falls monotonically on every spheroid."""
    finding = outcome.findings[0]
    assert finding.verdict is Verdict.REFUTED
    assert finding.numbers["exact"] == finding.numbers["most"] == 1


def test_elements_are_nearer_to_the_spike_than_the_graph(outcome):
    """Oracle: measured prototypes. Spread on the sphere: graph over 1e-2, curved under 1e-3."""
    finding = outcome.findings[1]
    assert finding.verdict is Verdict.CONFIRMED
    numbers = finding.numbers
    assert numbers["graph"] > 2 * numbers["linear"] > 40 * numbers["curved"]
    assert numbers["curved"] < 0.05


def test_flat_elements_see_the_valence(outcome):
    """Oracle: theory. All vertices of a sphere are alike; those of its mesh are not."""
    finding = outcome.findings[2]
    assert finding.numbers["across"] > 2 * finding.numbers["inside"]
    assert (finding.verdict is Verdict.REFUTED) == (finding.numbers["modes"] > 1)


def test_errors_against_the_exact_signature(outcome):
    """Oracle: measured prototypes. Order 1e-1 for graphs, 1e-2 to 1e-3 flat, below 1e-3 curved."""
    finding = outcome.findings[3]
    assert finding.verdict is Verdict.CONFIRMED
    numbers = finding.numbers
    assert 2 < numbers["error_graph"] < 30
    assert 0.1 < numbers["error_linear"] < 1.5
    assert numbers["error_curved"] < 0.05
    assert numbers["shift_curved"] < numbers["shift_linear"] < numbers["shift_graph"]


def test_figure_shows_both_shapes(outcome):
    """Oracle: data. Three surfaces, a scale, and histograms of ellipsoid and sphere."""
    titles = [axes.get_title(loc="left") for axes in outcome.figure.axes]
    assert any(title.startswith("Ellipsoid 1:1:2") for title in titles)
    assert any(title.startswith("Sphere") for title in titles)
    assert sum(title.startswith(("graph", "flat", "curved")) for title in titles) == 3
