"""Figure 5.6: the third group of an open surface is its rim."""

from __future__ import annotations

import pytest

from isovary.thesis import Verdict, experiment, settings_of


@pytest.fixture(scope="module")
def outcome():
    chosen = experiment("5.6")
    return chosen.run(settings_of(chosen, small=True))


def test_rays_miss_at_the_rim_only(outcome):
    """Oracle: geometry. Inside the box both surfaces go on: a normal can only miss near a rim."""
    found = outcome.findings[0]
    assert found.verdict is Verdict.IN_PART
    assert 0.9 < found.numbers["covered"] < 1
    assert found.numbers["missed_near_rim"] == 1


def test_the_third_group_is_made_by_the_cut(outcome):
    """Oracle: theory. A surface without a rim has no such group: the difference is the cut's."""
    found = outcome.findings[1]
    assert found.verdict is Verdict.REFUTED
    assert found.numbers["near_rim"] > 2 * found.numbers["all_near_rim"]
    assert found.numbers["share"] > 0.5
    assert found.numbers["curvature"] < 0


def test_the_third_group_goes_with_the_rim(outcome):
    """Oracle: geometry. A larger box moves the rim and no curvature: the group leaves its place,
    which is bent by -1 / 0.85 * 1 / 0.3 and more, for a rim at places that are bent less.

    By theory curvature between two like spheres is that of the neck: 1 / its radius times
    1 / decay length, nearly -3 where the box cut it first.
    """
    first, found = outcome.findings[1], outcome.findings[2]
    assert found.verdict is Verdict.REFUTED
    assert found.numbers["near_rim_0.7"] > 2 * found.numbers["all_near_rim_0.7"]
    assert found.numbers["stays_0.7"] < 0.1
    assert -1 < found.numbers["curvature_0.7"] < 0
    assert first.numbers["curvature"] < -2
    assert found.numbers["near_rim_0.8"] < 2 * found.numbers["all_near_rim_0.8"]


def test_by_the_thesiss_meshes_the_group_is_not_at_the_rim(outcome):
    """Oracle: data. Of its nodes no more lie near the rim than of all."""
    numbers = outcome.findings[1].numbers
    assert numbers["raw_near_rim"] < 2 * numbers["raw_all_near_rim"]


def test_the_natural_boundary_doubles_the_signature(outcome):
    """Oracle: analytic. The image of a node on a straight rim is itself: 2, and 1 far inside.

    There the images of nodes at half the distance of the cuts are left, exp(-0.5^2 / 0.09) = 0.06.
    """
    numbers = outcome.findings[3].numbers
    assert abs(numbers["rim"] - 2) < 0.25
    assert 1 < numbers["inside"] < 1.09
    sphere = 1 + numbers["time"] / (3 * 0.85**2)  # that of most places, a lone atom's
    assert numbers["bent"] == pytest.approx(sphere, abs=0.2 * (sphere - 1))


def test_the_figure_shows_both_ways(outcome):
    """Oracle: data. Three groups by the thesis's way and ours, in larger boxes; change uncut."""
    captions = [axes.get_title(loc="left") for axes in outcome.figure.axes]
    assert sum("3 groups" in text for text in captions) == 4
    assert sum("without the cut" in text for text in captions) == 1
