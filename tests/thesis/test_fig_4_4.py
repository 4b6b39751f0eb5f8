"""Figure 4.4: rays along the normals are one to one for small moves only."""

from __future__ import annotations

import pytest

from isovary.thesis import Verdict, experiment, settings_of


@pytest.fixture(scope="module")
def outcome():
    chosen = experiment("4.4")
    return chosen.run(settings_of(chosen, small=True))


def test_rays_hit_until_the_atom_comes_apart(outcome):
    """Oracle: geometry. A closed surface near another is met; one direction finds a part only.

    Two lone spheres of radius 0.85 whose centres are 2.3 apart no longer touch.
    """
    found = outcome.findings[0]
    assert found.verdict is Verdict.IN_PART
    for move in ("0.05", "0.3"):
        assert found.numbers[f"hit_{move}"] == 1
        assert found.numbers[f"folded_{move}"] == 0
        assert found.numbers[f"components_{move}"] == 1
        assert found.numbers[f"outward_{move}"] < 0.5
    assert found.numbers["hit_0.7"] < 0.97
    assert found.numbers["covered_0.7"] < 0.97
    assert found.numbers["components_0.7"] == 2


def test_meshes_may_differ_and_weights_are_convex(outcome):
    """Oracle: algebra. Barycentric weights of a place in a triangle: not below 0, of sum 1."""
    counts, weights = outcome.findings[1:3]
    assert counts.verdict is Verdict.CONFIRMED
    assert counts.numbers["base"] != counts.numbers["other"]
    assert weights.verdict is Verdict.CONFIRMED
    assert weights.numbers["error"] < 1e-12


def test_a_shift_looks_like_change(outcome):
    """Oracle: invariance. A rigid shift by 0.05 changes nothing, but rays make 0.6 % of it.

    With the motion taken out first little of that is left.
    """
    found = outcome.findings[3]
    assert found.verdict is Verdict.REFUTED
    assert 3e-3 < found.numbers["change"] < 1e-2
    assert found.numbers["aligned"] < found.numbers["change"] / 10


def test_the_figure_shows_rays(outcome):
    """Oracle: data. Figure 4.4 has rays from one surface to the other."""
    captions = [axes.get_title(loc="left") for axes in outcome.figure.axes]
    assert "Rays near the atoms' plane" in captions
