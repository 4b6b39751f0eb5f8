"""Figure 3.1: signatures on a dimple and away from it."""

from __future__ import annotations

import numpy as np
import pytest

from isovary import Surface, disk, heat_kernel, icosphere
from isovary.thesis import Verdict, experiment, settings_of
from isovary.thesis import _fig_3_1 as figure
from isovary.thesis._fig_3_1 import _curvature
from isovary.thesis._steps import signed


@pytest.fixture(scope="module")
def outcome():
    chosen = experiment("3.1")
    return chosen.run(settings_of(chosen, small=True))


def test_the_curves_part_and_meet(outcome):
    """Oracle: theory. Small times see the dimple, large ones 1 / area wherever they start."""
    found = outcome.findings[0]
    assert found.verdict is Verdict.CONFIRMED
    assert found.numbers["most"] > 0.05
    assert found.numbers["late"] < 1e-3


def test_the_curvature_is_read_off(outcome):
    """Oracle: analytic. On a unit sphere K = 1 + t / 5 at t = 0.074; flat elements miss it more.

    The tip is narrower than what the smallest time sees, so its curvature is read too low.
    """
    found = outcome.findings[1]
    assert found.verdict is Verdict.IN_PART
    assert abs(found.numbers["away"] - (1 + 0.074 / 5)) < 0.01
    assert abs(found.numbers["away_flat"] - 1) > abs(found.numbers["away"] - 1)
    assert 1 < found.numbers["tip"] < found.numbers["tip_exact"]


def test_the_curvature_of_a_paraboloid():
    """Oracle: analytic. z = -b r^2 has the Gaussian curvature 4 b^2 at its tip."""
    flat = disk(0.5, 6, order=1)
    points = np.array(flat.points)
    points[:, 2] = 2 - 0.7 * (points**2).sum(axis=1)
    tip = int(points[:, 2].argmax())
    assert _curvature(Surface(points, flat.triangles), tip, 0.3) == pytest.approx(4 * 0.7**2)


def test_an_asymmetric_kernel_is_seen(monkeypatch):
    """Oracle: algebra. Kernels 1 and 2 there and back differ by 1: times the area, 4 pi."""
    found = signed(icosphere(1), 9, 5)

    def kernel(pairs, times, nodes):
        values = np.zeros((len(pairs.vectors), 2, len(times)))
        values[nodes[1], 0], values[nodes[0], 1] = 1.0, 2.0
        return values

    assert (
        heat_kernel(found.pairs, found.times[:3], [0, 7]).shape
        == kernel(found.pairs, found.times[:3], [0, 7]).shape
    )
    monkeypatch.setattr(figure, "heat_kernel", kernel)
    finding = figure._symmetric(found, [0, 7])
    assert finding.numbers["error"] == pytest.approx(found.pairs.area)
    assert finding.verdict is Verdict.REFUTED


def test_the_kernel_is_symmetric(outcome):
    """Oracle: theory. The kernel of a self-adjoint operator."""
    assert outcome.findings[2].numbers["error"] < 1e-10


def test_the_figure_has_both_curves(outcome):
    """Oracle: data. Figure 3.1 has a curve on the dimple and one away from it."""
    captions = {axes.get_title(loc="left"): axes for axes in outcome.figure.axes}
    labels = [line.get_label() for line in captions["Both signatures"].lines]
    assert {"on the dimple", "away"} <= set(labels)
