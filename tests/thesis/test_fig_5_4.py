"""Figure 5.4: what symmetry says of a moving dimple."""

from __future__ import annotations

import pytest

from isovary.thesis import Verdict, experiment, settings_of


@pytest.fixture(scope="module")
def outcome():
    chosen = experiment("5.4")
    return chosen.run(settings_of(chosen, small=True))


def test_four_dimples_are_equal_at_first(outcome):
    """Oracle: symmetry. A square and a tetrahedron map each corner to each other."""
    found = outcome.findings[0]
    assert found.verdict is Verdict.CONFIRMED
    assert found.numbers["curved"] < 2e-4
    assert found.numbers["curved"] < found.numbers["flat"]


def test_the_mirror_keeps_one_and_three_equal(outcome):
    """Oracle: symmetry. The mesh has the mirror z -> -z, too, so to rounding and the eigensolve.

    All on the equator there is no such mirror, and 1 and 3 part.
    """
    found = outcome.findings[1]
    assert found.verdict is Verdict.CONFIRMED
    assert found.numbers["poles"] < 1e-7
    assert found.numbers["tetrahedron"] < 1e-7
    assert found.numbers["equator"] > 5e-3


def test_two_and_four_cannot_part(outcome):
    """Oracle: symmetry. The plane between them is a mirror: what is left is the mesh's error.

    It is smaller with curved elements.
    """
    found = outcome.findings[2]
    assert found.verdict is Verdict.REFUTED
    assert found.numbers["poles_c"] < 1e-3
    assert found.numbers["flat_c"] > 10 * found.numbers["poles_c"]
    assert found.numbers["equator_c"] > 5e-3


def test_the_fixed_dimples_hardly_see_the_move(outcome):
    """Oracle: symmetry. More than the error of equal ones, less than a plot shows."""
    found = outcome.findings[3]
    assert found.verdict is Verdict.IN_PART
    assert found.numbers["error"] < found.numbers["poles"] < 1e-4


def test_the_figure_has_the_three_configurations(outcome):
    """Oracle: data. Figure 5.4 has (a) to (d)."""
    captions = [axes.get_title(loc="left") for axes in outcome.figure.axes]
    assert [text[:3] for text in captions[:3]] == ["(a)", "(b)", "(c)"]
    assert len([text for text in captions if text.startswith("(d)")]) == 1
