"""Figure 4.20: deterministic annealing of perturbations whose place is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec

from ..clustering import deterministic_annealing, k_medians
from ..color import NEUTRAL, group_colors
from ..geometry import Ints, linear_triangles
from ..records import Surface
from ..view._marks import INK
from ._drawing import COLORS, curve_axes, draw_surface, grid, new_figure
from ._perturbed import WAYS, Perturbed, best_group, overlap, perturbed, roughness
from ._records import Experiment, Finding, Outcome, Settings, Verdict

_TITLE = "Deterministic annealing of known perturbations"
_PROPER = 0.5  # IoU: more in common than not
_SMOOTH, _NOISY = 0.15, 0.5  # roughness, 0 smooth and 1 noise
_INSIDE = 0.9  # part of a group's area, or of the protrusion's
_NAMES = {"a": "(a) ellipsoid, small", "b": "(b) ellipsoid, large", "c": "(c) sphere"}


@dataclass(frozen=True, eq=False)
class _Case:
    """A perturbation in one way, its groups, and how well they fit.

    Parameters
    ----------
    found : Perturbed
    labels : array (n,)
        By annealing into the given number of groups.
    own : array (n,)
        Into the number that annealing chose.
    medians : array (n,)
        By k-medians into the given number.
    """

    found: Perturbed
    labels: Ints
    own: Ints
    medians: Ints

    def fit(self, labels: Ints) -> float:
        """IoU of the best group with the region."""
        region, areas = self.found.region, self.found.areas
        return overlap(labels == best_group(labels, region, areas), region, areas)

    @property
    def inside(self) -> float:
        """Part of the best group's area within the region."""
        group, region, areas = self._best()
        return float(areas[group & region].sum() / areas[group].sum())

    @property
    def caught(self) -> float:
        """Part of the bigger protrusion's area in the best group."""
        group, _, areas = self._best()
        peak = self.found.peak
        return float(areas[group & peak].sum() / areas[peak].sum())

    def _best(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        region, areas = self.found.region, self.found.areas
        return self.labels == best_group(self.labels, region, areas), region, areas


Cases = dict[str, dict[str, _Case]]


def run(settings: Settings) -> Outcome:
    """Groups of three perturbations in each way of comparing."""
    ball = [1.0, 1.0, 1.0]
    shapes = {
        "a": (settings["ellipsoid"], settings["small_alpha"]),
        "b": (settings["ellipsoid"], settings["large_alpha"]),
        "c": (ball, settings["sphere_alpha"]),
    }
    cases = {
        name: {way: _case(way, axes, alpha, settings) for way in settings["ways"]}
        for name, (axes, alpha) in shapes.items()
    }
    findings = (_small(cases), _whose_noise(cases), _bigger(cases), _choice(cases), _number(cases))
    return Outcome(findings, _draw(cases))


def _case(way: str, axes: list[float], alpha: float, settings: Settings) -> _Case:
    found = perturbed(way, axes, alpha, settings)
    count, change = settings["groups"], found.change
    return _Case(
        found,
        deterministic_annealing(change, count).labels,
        deterministic_annealing(change, most=settings["most"]).labels,
        k_medians(change, count, rng=settings["seed"]).labels,
    )


def _fits(case: dict[str, _Case]) -> dict[str, float]:
    return {way: each.fit(each.labels) for way, each in case.items()}


def _said(values: dict[str, float]) -> str:
    return ", ".join(f"{value:.2g} ({WAYS[way]})" for way, value in values.items())


def _small(cases: Cases) -> Finding:
    fits = _fits(cases["a"])
    bad = {way: fit < _PROPER for way, fit in fits.items()}
    verdict = Verdict.CONFIRMED if all(bad.values()) else Verdict.IN_PART
    return Finding(
        "Annealing does not cluster the area of a small perturbation properly",
        "4.2.7, Fig 4.20(a)",
        f"IoU of its best of two groups with the area that moved: {_said(fits)}.",
        verdict if any(bad.values()) else Verdict.REFUTED,
        {f"fit_{way}": fit for way, fit in fits.items()},
    )


def _failing(case: dict[str, _Case], rough: dict[str, float]) -> list[str]:
    """Ways whose change is smooth, where annealing misses the region and k-medians finds it."""
    return [
        way
        for way, each in case.items()
        if rough[way] < _SMOOTH and each.fit(each.labels) < _PROPER <= each.fit(each.medians)
    ]


def _whose_noise(cases: Cases) -> Finding:
    small = cases["a"]
    rough = {way: roughness(each.found.change, each.found.base) for way, each in small.items()}
    medians = {way: each.fit(each.medians) for way, each in small.items()}
    failing = _failing(small, rough)
    itself = "".join(
        f" But of the smooth change by {WAYS[way]} annealing finds "
        f"{small[way].fit(small[way].labels):.2g} and k-medians {medians[way]:.2g}: "
        "there annealing itself fails."
        for way in failing
    )
    in_change = rough["carried"] < _SMOOTH and rough["rays"] > _NOISY
    verdict = Verdict.REFUTED if in_change else Verdict.OPEN
    return Finding(
        "The area that is rendered is probably noise from the clustering",
        "4.2.7",
        f"Between two meshes the noise is in the change before it is grouped. Its roughness (0 "
        f"smooth, 1 noise): {_said(rough)}; k-medians finds as little there, IoU "
        f"{medians['rays']:.2g}.{itself}",
        Verdict.IN_PART if failing else verdict,
        {f"roughness_{way}": value for way, value in rough.items()}
        | {f"medians_{way}": value for way, value in medians.items()}
        | {"failing": float(len(failing))},
    )


def _bigger(cases: Cases) -> Finding:
    numbers = {}
    for name in "bc":
        for way, case in cases[name].items():
            numbers[f"inside_{name}_{way}"] = case.inside
            numbers[f"caught_{name}_{way}"] = case.caught
            numbers[f"fit_{name}_{way}"] = case.fit(case.labels)
    good = min(value for key, value in numbers.items() if not key.startswith("fit")) > _INSIDE
    fits = [value for key, value in numbers.items() if key.startswith("fit")]
    inside = min(value for key, value in numbers.items() if key.startswith("inside"))
    caught = min(value for key, value in numbers.items() if key.startswith("caught"))
    return Finding(
        "For bigger ones the whole region is not caught, but that of the bigger protrusion is",
        "4.2.7, Figs 4.20(b), (c)",
        f"In all ways at least {100 * inside:.0f} % of the best group lie in the region and at "
        f"least {100 * caught:.0f} % of what moved by half of the height or more lies in the "
        f"group; with the whole region it has an IoU of {min(fits):.2g} to {max(fits):.2g}.",
        Verdict.CONFIRMED if good and max(fits) < _INSIDE else Verdict.IN_PART,
        numbers | {"inside": inside, "caught": caught, "most_fit": max(fits)},
    )


def _choice(cases: Cases) -> Finding:
    better = [
        (case.fit(case.labels), case.fit(case.medians))
        for each in cases.values()
        for case in each.values()
    ]
    won = sum(annealed > medians for annealed, medians in better)
    words = ", ".join(f"{annealed:.2f} against {medians:.2f}" for annealed, medians in better)
    part = won / len(better)
    return Finding(
        "Annealing is not the right choice, k-medoids is better",
        "4.2.7, 4.3 item 7",
        f"With two groups annealing's IoU is above that of k-medians in {won} of {len(better)} "
        f"comparisons ({words}; each shape in each way).",
        Verdict.CONFIRMED if part == 0 else Verdict.IN_PART if part < 1 else Verdict.REFUTED,
        {"won": float(won), "of": float(len(better))},
    )


def _number(cases: Cases) -> Finding:
    counts = {name: [int(c.own.max()) + 1 for c in each.values()] for name, each in cases.items()}
    words = "; ".join(
        f"{_NAMES[name]}: {', '.join(map(str, found))}" for name, found in counts.items()
    )
    same = all(len(set(found)) == 1 for found in counts.values())
    return Finding(
        "Annealing chooses its own number of clusters",
        "4.2.7",
        f"It does, but for one surface the number depends on how it is compared. {words}.",
        Verdict.CONFIRMED if same else Verdict.IN_PART,
        {f"count_{name}_{k}": float(n) for name, ns in counts.items() for k, n in enumerate(ns)},
    )


def _message(small: dict[str, _Case]) -> str:
    """Where annealing finds the small protrusion, and where it does not, with the numbers."""
    rough = {way: roughness(each.found.change, each.found.base) for way, each in small.items()}
    carried, rays = small["carried"], small["rays"]
    words = [f"{carried.fit(carried.labels):.2g} on one curved mesh"]
    for way in _failing(small, rough):
        found = small[way]
        words.append(
            f"{found.fit(found.labels):.2g} by {WAYS[way]}, where annealing fails "
            f"(k-medians {found.fit(found.medians):.2g})"
        )
    words.append(f"{rays.fit(rays.labels):.2g} between two, where the change is noise")
    return "Small protrusion, IoU of annealing: " + "; ".join(words)


def _draw(cases: Cases) -> Figure:
    figure = new_figure("4.20", _TITLE, _message(cases["a"]), height=9.6)
    cells = grid(
        figure,
        3,
        5,
        wspace=0.26,
        hspace=0.22,
        left=0.045,
        width_ratios=[1.0, 1.0, 1.0, 1.0, 1.45],
    )
    for row, (name, case) in enumerate(cases.items()):
        own, other = case["carried"], case["rays"]
        shown = (
            ("moved by 10 and 50 %", own, own.found.region * 1 + own.found.peak * 1),
            ("annealing, one mesh", own, own.labels),
            ("annealing, two meshes", other, other.labels),
            ("k-medians, two meshes", other, other.medians),
        )
        for column, (words, each, labels) in enumerate(shown):
            _draw_groups(figure, cells[5 * row + column], each, labels, f"{words}")
        figure.axes[-4].text(
            -0.08, 0.5, _NAMES[name], rotation=90, va="center", color=INK, size=10.5,
            transform=figure.axes[-4].transAxes,
        )  # fmt: skip
        _draw_fits(figure, cells[5 * row + 4], case, last=row == 2)
    return figure


def _draw_groups(figure: Figure, cell: SubplotSpec, case: _Case, labels: Ints, words: str) -> None:
    """The largest group in grey, the others in their colours."""
    areas = case.found.areas
    order = np.argsort([-areas[labels == k].sum() for k in range(labels.max() + 1)])
    grey = [int(NEUTRAL[k : k + 2], 16) / 255 for k in (1, 3, 5)]
    palette = np.empty((len(order), 3))
    palette[order] = np.vstack([grey, group_colors(8)[[5, 0, 2, 3, 4, 1, 6]]])[: len(order)]
    draw_surface(
        figure,
        cell,
        Surface(case.found.dimpled.points, linear_triangles(case.found.dimpled.triangles)),
        palette[labels],
        words,
        towards=np.array([1.0, -0.6, 1.3]),
    )


def _draw_fits(figure: Figure, cell: SubplotSpec, case: dict[str, _Case], *, last: bool) -> None:
    axes = curve_axes(figure, cell, "Found of the region", "", "IoU")
    places = np.arange(len(case))
    for shift, (name, color) in enumerate((("annealing", COLORS[1]), ("k-medians", COLORS[0]))):
        values = [each.fit(each.labels if shift == 0 else each.medians) for each in case.values()]
        axes.bar(places + 0.36 * shift - 0.18, values, 0.34, color=color, label=name)
    axes.set_ylim(0, 1.35)
    axes.set_yticks([0, 0.5, 1])
    short = {"carried": "one mesh,\ncurved", "flat": "one mesh,\nflat", "rays": "two meshes,\nflat"}
    axes.set_xticks(places, [short[way] for way in case] if last else [""] * len(case))
    axes.legend(frameon=False, fontsize=8.5)


EXPERIMENT = Experiment("4.20", _TITLE, run)
