"""Figure 4.21: classical and universal multidimensional scaling of the change, as colours."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from ..color import embedding_colors
from ..embedding import classical_mds, universal_mds
from ..geometry import Floats, linear_triangles
from ..records import Surface
from ..row_distances import distances
from ..view._marks import INK
from ._drawing import draw_surface, grid, new_figure
from ._perturbed import WAYS, Perturbed, perturbed, roughness
from ._records import Experiment, Finding, Outcome, Settings, Verdict

_TITLE = "Multidimensional scaling of the change, as colours"
_TOLD = 0.9  # chance that a node in the region lies farther from the rest than one outside
_SMOOTH, _NOISY = 0.1, 0.25  # roughness: 0 smooth, 1 noise
_HELD = 0.05  # stress
_EMBEDDINGS = {"classical": classical_mds, "universal": universal_mds}
_VIEWS = {"general view": (1.0, -0.6, 0.15), "perturbed area": (0.35, -0.2, 1.0)}


@dataclass(frozen=True, eq=False)
class _Case:
    """A perturbation in one way, and its embeddings.

    Parameters
    ----------
    found : Perturbed
    points : dict of arrays (n, 3)
        By the name of the embedding.
    stress : dict of float
        Root mean square error of the distances over their root mean square.
    """

    found: Perturbed
    points: dict[str, Floats]
    stress: dict[str, float]

    def rough(self, name: str) -> float:
        """Roughness of an embedding where nothing moved."""
        return roughness(self.points[name], self.found.base, self.found.still)

    def told(self, name: str) -> float:
        """Chance that a node that moved lies farther from the median than one that did not."""
        from scipy.stats import mannwhitneyu

        points, region = self.points[name], self.found.region
        known = np.isfinite(points).all(axis=1)
        away = np.linalg.norm(points - np.median(points[known & ~region], axis=0), axis=1)
        inside, outside = away[known & region], away[known & ~region]
        count = mannwhitneyu(inside, outside).statistic
        return float(count / (len(inside) * len(outside)))


def run(settings: Settings) -> Outcome:
    """Both embeddings of the same perturbation in each way of comparing."""
    cases = {way: _case(way, settings) for way in settings["ways"]}
    findings = (_told_apart(cases), _too_noisy(cases), _collapses(cases), _meaning(cases))
    return Outcome(findings, _draw(cases))


def _case(way: str, settings: Settings) -> _Case:
    found = perturbed(way, settings["ellipsoid"], settings["alpha"], settings)
    points = {
        name: embed(
            found.change,
            settings["dimensions"],
            landmarks=settings["landmarks"],
            rng=settings["seed"],
        )
        for name, embed in _EMBEDDINGS.items()
    }
    stress = {name: _stress(found.change, each, settings) for name, each in points.items()}
    return _Case(found, points, stress)


def _stress(rows: Floats, points: Floats, settings: Settings) -> float:
    known = np.flatnonzero(np.isfinite(rows).all(axis=1))
    generator = np.random.default_rng(settings["seed"])
    some = generator.choice(known, min(settings["sample"], len(known)), replace=False)
    wanted = distances(rows[some], rows[some], "l1")
    got = distances(points[some], points[some], "l2")
    return float(np.sqrt(((got - wanted) ** 2).sum() / (wanted**2).sum()))


def _both(values: dict[str, float]) -> str:
    return " and ".join(f"{value:.3g} ({name})" for name, value in values.items())


def _numbers(cases: dict[str, _Case], measure: str) -> dict[str, float]:
    return {
        f"{measure}_{name}_{way}": getattr(case, measure)(name)
        for way, case in cases.items()
        for name in _EMBEDDINGS
    }


def _by_way(cases: dict[str, _Case], measure: str) -> str:
    return "; ".join(
        f"{WAYS[way]}: {_both({name: getattr(case, measure)(name) for name in _EMBEDDINGS})}"
        for way, case in cases.items()
    )


def _told_apart(cases: dict[str, _Case]) -> Finding:
    numbers = _numbers(cases, "told")
    good = [value > _TOLD for value in numbers.values()]
    verdict = Verdict.CONFIRMED if all(good) else Verdict.IN_PART
    return Finding(
        "The perturbed regions are distinguished from the rest of the shape",
        "4.2.7, Fig 4.21",
        "Chance that a node that moved lies farther from the middle of the others than one that "
        f"did not (0.5 tells nothing): {_by_way(cases, 'told')}.",
        verdict if any(good) else Verdict.REFUTED,
        numbers,
    )


def _too_noisy(cases: dict[str, _Case]) -> Finding:
    numbers = _numbers(cases, "rough")
    carried = max(numbers[f"rough_{name}_carried"] for name in _EMBEDDINGS)
    rays = min(numbers[f"rough_{name}_rays"] for name in _EMBEDDINGS)
    mesh = carried < _SMOOTH and rays > _NOISY
    return Finding(
        "The noise is too much for this to be an effective visualization",
        "4.2.7",
        f"Roughness where nothing moved (0 smooth, 1 noise): {_by_way(cases, 'rough')}. "
        "The noise is that of two independent meshes; on one mesh there is next to none.",
        Verdict.IN_PART if mesh else Verdict.CONFIRMED if carried > _NOISY else Verdict.OPEN,
        numbers,
    )


def _collapses(cases: dict[str, _Case]) -> Finding:
    numbers = {
        f"stress_{name}_{way}": case.stress[name]
        for way, case in cases.items()
        for name in _EMBEDDINGS
    }
    said = "; ".join(f"{WAYS[way]}: {_both(case.stress)}" for way, case in cases.items())
    good = [value < _HELD for value in numbers.values()]
    return Finding(
        "MDS reduces the vectors to three dimensions, leaving out irrelevant ones",
        "4.2.7",
        f"Stress, the error of all distances in three dimensions: {said}.",
        Verdict.CONFIRMED if all(good) else Verdict.IN_PART if any(good) else Verdict.REFUTED,
        numbers,
    )


def _meaning(cases: dict[str, _Case]) -> Finding:
    carried = cases["carried"]
    told = min(carried.told(name) for name in _EMBEDDINGS)
    rough = max(carried.rough(name) for name in _EMBEDDINGS)
    fine = told > _TOLD and rough < _SMOOTH
    return Finding(
        "So MDS is not a good choice of visualization for the change",
        "4.2.7",
        f"On one mesh the colours are smooth (roughness {rough:.2g}) and tell the region (chance "
        f"{told:.2g}); what they do not do is name groups.",
        Verdict.REFUTED if fine else Verdict.CONFIRMED,
        {"told": told, "rough": rough},
    )


def _draw(cases: dict[str, _Case]) -> Figure:
    clean, noisy = (
        max(cases[way].rough(name) for name in _EMBEDDINGS) for way in ("carried", "rays")
    )
    message = (
        f"The noise is that of two meshes: roughness {noisy:.2g} where nothing moved, against "
        f"{clean:.2g} on one carried mesh; 0 is smooth, 1 noise"
    )
    figure = new_figure("4.21", _TITLE, message, height=4.0 + 3.1 * (len(cases) - 1))
    cells = grid(figure, len(cases), 4, below=0.15, wspace=0.02, hspace=0.16, left=0.06)
    columns = [(name, view) for name in _EMBEDDINGS for view in _VIEWS]
    for row, (way, case) in enumerate(cases.items()):
        dimpled = case.found.dimpled
        shape = Surface(dimpled.points, linear_triangles(dimpled.triangles))
        for column, (name, view) in enumerate(columns):
            colors = embedding_colors(case.points[name])
            words = f"{name}, {view}" if row == 0 else ""
            towards = np.array(_VIEWS[view])
            cell = cells[4 * row + column]
            axes = draw_surface(figure, cell, shape, colors, words, towards=towards)
            if column == 0:
                axes.text(
                    -0.03, 0.5, WAYS[way].replace(", ", "\n", 1), rotation=90, size=10, color=INK,
                    va="center", ha="right", transform=axes.transAxes,
                )  # fmt: skip
    return figure


EXPERIMENT = Experiment("4.21", _TITLE, run)
