"""Figure 4.5: k-medoids finds the dimples, fuzzy c-means in l1 does not."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from isovary.thesis import Outcome, Verdict, experiment, settings_of
from isovary.thesis._fig_4_5 import _METHODS, _fuzzy


@pytest.fixture(scope="module")
def outcome() -> Outcome:
    found = experiment("4.5")
    return found.run(settings_of(found, small=True))


def test_k_medoids_find_the_dimples(outcome):
    """Oracle: prototype. IoU at least 0.6 at depth 0.05; with W as printed 0.08 there."""
    found = outcome.findings[0]
    assert found.numbers["ours_0.05"] > 0.6
    assert found.numbers["ours_0.2"] > 0.6
    assert found.numbers["thesis_0.05"] < 0.2
    assert found.verdict is Verdict.IN_PART


def test_fuzzy_c_means_do_so_in_l2_alone(outcome):
    """Oracle: theory. Fuzzy c-means in l2 is k-means made soft, so it stays near k-medoids in l2;
    in l1, where memberships fall with the distance and not its square, a node at the ratio r of
    its distances has 1 / (1 + r): many more are torn than with 1 / (1 + r^2).
    """
    numbers = outcome.findings[2].numbers
    for depth in ("0.05", "0.2"):
        assert numbers[f"fuzzy_l1_ours_{depth}"] < 0.2
        assert numbers[f"fuzzy_l2_ours_{depth}"] == pytest.approx(
            numbers[f"medoids_l2_ours_{depth}"], abs=0.05
        )
    assert numbers["torn_fuzzy_l1"] > 3 * numbers["torn_fuzzy_l2"]
    assert outcome.findings[2].verdict is Verdict.REFUTED


def test_bins_follow_the_norms(outcome):
    """Oracle: logic. The verdict follows from the IoUs; those of k-medoids are the first's."""
    found = outcome.findings[1]
    pairs = [
        (found.numbers[f"bins_{key}"], fit) for key, fit in outcome.findings[0].numbers.items()
    ]
    assert all(
        found.numbers[f"medoids_{key}"] == f for key, f in outcome.findings[0].numbers.items()
    )
    worse = [bins < medoids - 0.02 for bins, medoids in pairs]
    decided = {0: Verdict.REFUTED, len(worse): Verdict.CONFIRMED}
    assert found.verdict is decided.get(sum(worse), Verdict.IN_PART)


@pytest.mark.parametrize(
    ("fuzzy", "verdict"),
    [(0.9, Verdict.CONFIRMED), (0.5, Verdict.IN_PART), (0.1, Verdict.REFUTED)],
)
def test_the_verdict_on_fuzzy_c_means_follows_its_l1(fuzzy, verdict):
    """Oracle: logic. Above both others confirmed, below both refuted; l2 does not count."""
    fits = dict.fromkeys(_METHODS, 0.7) | {"annealing": 0.3, "fuzzy_l1": fuzzy, "fuzzy_l2": 0.8}
    case = SimpleNamespace(fit=fits.get, torn=lambda _: 0.0)
    cases = {"ours": {0.1: case}, "thesis": {0.1: case}}
    assert _fuzzy(cases).verdict is verdict


def test_the_norm_helps_one_and_spoils_the_other(outcome):
    """Oracle: algebra. The gains are differences of the IoUs that the finding before gives."""
    gains, fits = outcome.findings[3].numbers, outcome.findings[2].numbers
    for key, gain in gains.items():
        kind, rest = key.split("_", 1)
        assert gain == pytest.approx(fits[f"{kind}_l1_{rest}"] - fits[f"{kind}_l2_{rest}"])
    assert gains["fuzzy_ours_0.2"] < -0.5
    assert outcome.findings[3].verdict is Verdict.IN_PART


def test_medians_and_medoids_agree(outcome):
    """Oracle: theory. Of many nodes on a curve the medoid is next to the median."""
    centers = outcome.findings[4]
    assert min(centers.numbers.values()) > 0.95
    assert centers.verdict is Verdict.OPEN


def test_the_figure_shows_both_depths(outcome):
    """Oracle: data. Two rows: four surfaces and the IoU of six methods."""
    axes = outcome.figure.axes
    bars = [each for each in axes if each.get_xlabel() == "IoU"]
    assert len(axes) == 10
    assert [len(each.patches) for each in bars] == [12, 12]
