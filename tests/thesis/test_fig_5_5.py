"""Figure 5.5: independent meshes do not see small changes, carried ones do."""

from __future__ import annotations

import numpy as np
import pytest

from isovary.thesis import Verdict, experiment, settings_of
from isovary.thesis._three_atoms import mirrored


@pytest.fixture(scope="module")
def outcome():
    chosen = experiment("5.5")
    return chosen.run(settings_of(chosen, small=True))


def test_small_changes_take_a_carried_mesh(outcome):
    """Oracle: convergence. Two meshes of one surface must agree; independent ones miss by half.

    The move of 0.02 is a fiftieth of an atom's radius; a carried curved mesh knows it to 5 %.
    """
    found = outcome.findings[0]
    assert found.verdict is Verdict.IN_PART
    assert found.numbers["independent_0.02"] > 0.5
    assert found.numbers["independent_0.1"] < found.numbers["independent_0.02"]
    assert found.numbers["carried_flat_0.02"] < 0.07
    assert found.numbers["carried_curved_0.02"] < 0.05
    assert found.numbers["carried_curved_0.02"] < found.numbers["carried_flat_0.02"]


def test_rays_hit_a_closed_surface(outcome):
    """Oracle: topology. A closed surface near another is met by every normal, one way or other."""
    found = outcome.findings[1]
    assert found.verdict is Verdict.CONFIRMED
    assert set(found.numbers.values()) == {1.0}


def test_groups_keep_the_mirrors(outcome):
    """Oracle: symmetry. The moved atom stays in both mirrors of the other two."""
    numbers = outcome.findings[2].numbers
    for count in (2, 3):
        assert numbers[f"carried_curved_{count}"] > 0.99
        assert numbers[f"independent_{count}"] <= numbers[f"carried_curved_{count}"]
        assert 0 < numbers[f"alike_{count}"] < 1
    alike = min(numbers["alike_2"], numbers["alike_3"])
    good = alike > 0.9 and min(numbers["independent_2"], numbers["independent_3"]) > 0.98
    assert (outcome.findings[2].verdict is Verdict.CONFIRMED) == good


def test_mirrors_map_the_atoms_onto_themselves():
    """Oracle: geometry. One changes the first two, none of them moves the third."""
    settings = settings_of(experiment("5.5"))
    atoms = np.array(settings["atoms"])
    across, below = mirrored(atoms, settings)
    np.testing.assert_allclose(across, atoms[[1, 0, 2]], atol=1e-12)
    np.testing.assert_allclose(below, atoms, atol=1e-12)
    place = np.array([[0.2, 0.3, 0.4]])
    np.testing.assert_allclose(mirrored(place, settings), [[[1.5, 0.3, 0.4]], [[0.2, 0.3, -0.4]]])


def test_the_figure_shows_both_groupings_in_three_ways(outcome):
    """Oracle: data. Figure 5.5 has both surfaces, then two and three groups."""
    captions = [axes.get_title(loc="left") for axes in outcome.figure.axes]
    for count in (2, 3):
        assert sum(text.startswith(f"{count} groups") for text in captions) == 3
    assert sum(text.startswith("Before") for text in captions) == 1
