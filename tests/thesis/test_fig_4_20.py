"""Deterministic annealing: the noise of a small change comes from the meshes, not from it."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

import isovary as iv
from isovary.thesis import Outcome, Verdict, _fig_4_20, experiment, settings_of
from isovary.thesis._irregular import irregular_ellipsoid, scattered_ellipsoid
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


@pytest.mark.parametrize(
    ("annealed", "verdict"), [((0.7, 0.7), Verdict.REFUTED), ((0.7, 0.02), Verdict.IN_PART)]
)
def test_a_smooth_change_that_annealing_misses_is_no_refutation(monkeypatch, annealed, verdict):
    """Oracle: algebra. Made-up cases: noise on two meshes only; k-medians finds the region."""
    region, areas = np.arange(100) < 50, np.ones(100)
    truth = region.astype(int)

    def case(name, share):
        missed = np.where(np.arange(100) < 50 * share, 1, 0)
        return _fig_4_20._Case(SimpleNamespace(
            region=region, areas=areas, change=name, base=None), missed, truth, truth
        )  # fmt: skip

    rough = {"carried": 0.05, "flat": 0.08, "rays": 0.9}
    monkeypatch.setattr(_fig_4_20, "roughness", lambda change, base: rough[change])
    monkeypatch.setattr(_fig_4_20, "best_group", lambda labels, region, areas: 1)
    shares = {"carried": annealed[0], "flat": annealed[1], "rays": 0.02}
    cases = {"a": {way: case(way, share) for way, share in shares.items()}}
    noise = _fig_4_20._whose_noise(cases)
    assert noise.verdict is verdict
    assert ("annealing itself fails" in noise.measured) is (verdict is Verdict.IN_PART)
    assert ("annealing fails" in _fig_4_20._message(cases["a"])) is (verdict is Verdict.IN_PART)


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
    counts = number.numbers
    assert all(count >= 2 for count in counts.values())
    same = all(counts[f"count_{name}_0"] == counts[f"count_{name}_1"] for name in "abc")
    assert number.verdict is (Verdict.CONFIRMED if same else Verdict.IN_PART)


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


def test_the_second_mesh_is_related_to_nothing():
    """Oracle: analytic, Euler. On the ellipsoid, outward, closed: E = 3 V - 6, F = 2 V - 4.

    Of the base's vertices, six neighbours each but for twelve, none is one of its own.
    """
    axes = np.array([1.0, 1.0, 2.0])
    base, other = (
        irregular_ellipsoid(axes, 3, 0.2, 0, order=1),
        scattered_ellipsoid(axes, 700, 0.2, 0),
    )
    assert ((other.points / axes) ** 2).sum(axis=1) == pytest.approx(1, abs=1e-12)
    assert len(other.triangles) == 2 * 700 - 4
    assert iv.topology(other.triangles).euler == 2
    corners = other.points[other.triangles]
    volume = np.linalg.det(corners).sum() / 6
    assert volume == pytest.approx(8 / 3 * np.pi, rel=0.03)
    assert (np.linalg.det(corners) > 0).all()
    away = np.linalg.norm(base.points[:, None] - other.points, axis=2).min(axis=1)
    assert (away > 0).all()
    assert set(np.bincount(base.triangles.ravel())) == {5, 6}
    assert not set(np.bincount(other.triangles.ravel())) <= {5, 6}


def test_the_second_mesh_is_as_irregular_as_it_is_told():
    """Oracle: geometry. Shifts in a cube of half side 0.2 edges: at most sqrt(3) of that, tangent
    part 2 / 3 of the mean square, 0.2^2; edges of equilateral triangles of the mean area."""
    ball = [1.0, 1.0, 1.0]
    even, shifted = (scattered_ellipsoid(ball, 700, shift, 0).points for shift in (0.0, 0.2))
    edge = (4 * np.pi / 1400 * 4 / 3**0.5) ** 0.5
    moved = np.linalg.norm(shifted - even, axis=1) / edge
    assert moved.max() < 0.2 * 3**0.5
    assert np.sqrt((moved**2).mean()) == pytest.approx(0.2 * (2 / 3) ** 0.5, rel=0.05)


def test_the_figure_shows_each_case(outcome):
    """Oracle: data. Three rows of four surfaces, and how much of the region is found."""
    named = [axes for axes in outcome.figure.axes if axes.get_ylabel() == "IoU"]
    assert len(outcome.figure.axes) == 15
    assert len(named) == 3
