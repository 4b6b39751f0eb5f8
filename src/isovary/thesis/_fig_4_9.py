"""Figures 4.9 and 4.10: nine points on three dimples, by a radius and by the nearest neighbours."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec

from ..deform import dimple
from ..geometry import Floats, Ints
from ..laplacian import epsilon_graph, knn_graph
from ..meshing import distmesh
from ..records import Surface
from ._drawing import COLORS, curve_axes, draw_surface, grid, new_figure
from ._judged import MESH_COLOR, curved, flat, in_pieces
from ._records import Experiment, Finding, Outcome, Settings, Verdict
from ._spheroid import spheroid_field
from ._steps import Operator, Signed, signed

_TITLE = "Neighbours within a radius, or the nearest ones"
_CLEANER = 1.1
"""How many times larger the other pattern's error is when one is cleaner."""

_GROUPED = 0.25
"""Largest spread within the colours, over that between them, of curves that are grouped."""

_APART = 0.3
"""Smallest difference of two degrees' logarithms that tells what the degree does."""

_SPOTS = (COLORS[1], COLORS[0], COLORS[2])
_RULES = ("epsilon", "nearest", "epsilon, matched", "nearest, matched")


@dataclass(frozen=True, eq=False)
class _Case:
    """Patterns (9, T) at the points of one mesh, by rule, beside the curved elements'."""

    surface: Surface
    points: Ints
    times: Floats
    reference: Floats
    curves: Mapping[str, Floats]
    degrees: Mapping[str, float]

    def error(self, rule: str) -> float:
        """Rms difference of the patterns from the reference's, over the rms of that."""
        wrong = _pattern(self.curves[rule]) - _pattern(self.reference)
        return float(np.linalg.norm(wrong) / np.linalg.norm(_pattern(self.reference)))


def run(settings: Settings) -> Outcome:
    """Four graphs and flat elements on each mesh, judged by curved elements on its vertices."""
    cases = {count: _case(count, settings) for count in settings["vertices"]}
    findings = (_cleaner(cases), _rule_or_degree(cases), _grouped(cases), _best(cases))
    return Outcome(findings, _draw(cases, settings))


def _case(count: int, settings: Settings) -> _Case:
    field = spheroid_field(1.0, settings["spacing"])
    sphere = curved(distmesh(field, 0.0, vertices=count, order=1), 1.0)
    centres, places = _places(settings)
    dimpled = dimple(sphere, centres, settings["dimple_radius"], alpha=settings["dimple_alpha"])
    surface = Surface(settings["radius"] * dimpled.points, dimpled.triangles)
    corners = flat(surface)
    rest = flat(sphere).points
    points = np.array([int(np.linalg.norm(rest - place, axis=1).argmin()) for place in places])
    reference = signed(surface, settings["pairs"], settings["times"])
    share = (settings["epsilon"] / settings["radius"]) ** 2 / 4  # of the sphere, within the radius
    wide = 2 * settings["radius"] * np.sqrt((settings["neighbours"] + 1) / count)
    operators: dict[str, Operator] = {
        "epsilon": partial(epsilon_graph, radius=settings["epsilon"]),
        "nearest": partial(knn_graph, neighbours=settings["neighbours"]),
        "epsilon, matched": partial(epsilon_graph, radius=wide),
        "nearest, matched": partial(knn_graph, neighbours=round(share * count) - 1),
    }
    found: dict[str, Floats] = {}
    degrees = {}
    for rule, operator in operators.items():
        laplacian = operator(corners)
        degrees[rule] = laplacian.stiffness.nnz / count - 1
        found[rule] = _curves(signed(corners, settings["pairs"], reference.times, operator), points)
    found["flat"] = _curves(signed(corners, settings["pairs"], reference.times), points)
    return _Case(surface, points, reference.times, _curves(reference, points), found, degrees)


def _places(settings: Settings) -> tuple[Floats, Floats]:
    """Centres (3, 3) of the dimples around the x axis, and nine places, dimple by dimple."""
    polar = np.deg2rad(settings["polar"])
    around = 2 * np.pi * np.arange(3) / 3 + 0.5

    def at(angle: Floats) -> Floats:
        side = np.sin(angle)
        return np.stack([np.cos(angle), side * np.cos(around), side * np.sin(around)], axis=-1)

    steps = settings["dimple_radius"] * np.asarray(settings["spots"])
    places = np.stack([at(polar + step) for step in steps], axis=1)
    return at(polar), places.reshape(-1, 3)


def _curves(one: Signed, points: Ints) -> Floats:
    rows: Floats = one.signature[points]
    return rows


def _pattern(curves: Floats) -> Floats:
    """Curves (9, T) over their mean, less 1: how the points differ at each time."""
    pattern: Floats = curves / curves.mean(axis=0) - 1
    return pattern


def _cleaner(cases: Mapping[int, _Case]) -> Finding:
    ratios = {count: case.error("epsilon") / case.error("nearest") for count, case in cases.items()}
    words = ", ".join(
        f"{case.error('epsilon'):.2g} and {case.error('nearest'):.2g} times with {count} "
        f"vertices ({case.degrees['epsilon']:.0f} and {case.degrees['nearest']:.0f} neighbours)"
        for count, case in cases.items()
    )
    best, worst = max(ratios.values()), min(ratios.values())
    below = sum(case.error(rule) < 1 for case in cases.values() for rule in _RULES[:2])
    if worst > _CLEANER:
        verdict = Verdict.CONFIRMED
    else:
        verdict = Verdict.IN_PART if best > _CLEANER else Verdict.REFUTED
    return Finding(
        "The nearest neighbours give a cleaner and more recognizable pattern of HKS vectors than "
        "the radius",
        "4.2.2, Fig 4.10",
        "Error of the pattern of the nine points over its own size, by radius and by nearest "
        f"neighbours: {words}. The number of vertices, which decides, is not told. Below 1, where "
        f"a pattern can be recognized, {below} of {2 * len(cases)} are.",
        verdict,
        {f"ratio_{count}": ratio for count, ratio in ratios.items()},
    )


def _matched(cases: Mapping[int, _Case]) -> dict[str, float]:
    """Error by radius over that by nearest neighbours, with as many neighbours on average."""
    pairs = (("epsilon", "nearest, matched"), ("epsilon, matched", "nearest"))
    return {
        f"{count}_{case.degrees[other]:.0f}": case.error(one) / case.error(other)
        for count, case in cases.items()
        for one, other in pairs
    }


def _by_degree(cases: Mapping[int, _Case]) -> float:
    """How many times twice the neighbours change the error, by the same rule."""
    powers = [
        abs(np.log(case.error(one) / case.error(other)))
        / abs(np.log(case.degrees[one] / case.degrees[other]))
        for case in cases.values()
        for one, other in (("epsilon", "epsilon, matched"), ("nearest", "nearest, matched"))
        if abs(np.log(case.degrees[one] / case.degrees[other])) > _APART
    ]
    return float(2 ** np.mean(powers))


def _rule_or_degree(cases: Mapping[int, _Case]) -> Finding:
    ratios = _matched(cases)
    won = sum(ratio > 1 for ratio in ratios.values())
    by_rule = float(np.exp(np.mean(np.abs(np.log(list(ratios.values()))))))
    by_degree = _by_degree(cases)
    words = ", ".join(
        f"{ratio:.2g} ({key.split('_')[1]} of {key.split('_')[0]})" for key, ratio in ratios.items()
    )
    return Finding(
        "For a reasonable k the nearest neighbours give better HKS vectors than the radius",
        "4.2.2, 4.3",
        "With as many neighbours on average the radius errs so many times as much (neighbours, of "
        f"vertices): {words}; the nearest ones win {won} of {len(ratios)}. The rules differ "
        f"{by_rule:.2g} times on average; twice as many neighbours by the same rule change the "
        f"error {by_degree:.2g} times: k counts more than the rule.",
        Verdict.CONFIRMED if won == len(ratios) else Verdict.IN_PART if won else Verdict.REFUTED,
        {"rule": by_rule, "degree": by_degree, "won": float(won), "of": float(len(ratios))}
        | {f"matched_{key}": ratio for key, ratio in ratios.items()},
    )


def _spread(curves: Floats) -> Floats:
    """Spread (T,) within the colours over that between their means."""
    groups = np.log(curves).reshape(3, 3, -1)  # dimple, spot, time
    within = np.sqrt(groups.var(axis=0).mean(axis=0))
    return np.asarray(within / groups.mean(axis=0).std(axis=0))


def _grouped(cases: Mapping[int, _Case]) -> Finding:
    case = cases[max(cases)]
    early = slice(len(case.times) // 3)
    exact = _spread(case.reference)
    first, last = float(np.median(exact[early])), float(np.median(exact[-len(case.times) // 3 :]))
    seen = {rule: float(np.median(_spread(case.curves[rule])[early])) for rule in _RULES[:2]}
    verdict = Verdict.CONFIRMED if first < _GROUPED else Verdict.REFUTED
    if first < _GROUPED and last <= first:
        verdict = Verdict.IN_PART
    return Finding(
        "Lines of one colour are grouped early, before the places of the dimples part them",
        "4.2.2",
        f"Spread within the colours over that between them, curved elements with {max(cases)} "
        f"vertices: {first:.2g} in the first third of the times, {last:.2g} in the last. Early by "
        f"radius {seen['epsilon']:.2g}, by nearest neighbours {seen['nearest']:.2g}. The points "
        "are the vertices nearest to like places, which alone parts the lines a little.",
        verdict,
        {"early": first, "late": last} | seen,
    )


def _best(cases: Mapping[int, _Case]) -> Finding:
    """Among graphs, of which the text speaks; flat elements stand beside them."""
    least = {
        count: [min(case.error(r) for r in _RULES if r.startswith(n)) for n in _RULES[:2]]
        for count, case in cases.items()
    }
    won = sum(nearest < radius for radius, nearest in least.values())
    case = cases[max(cases)]
    flat_error, graph = case.error("flat"), min(least[max(cases)])
    words = ", ".join(
        f"{radius:.2g} and {nearest:.2g} with {count}" for count, (radius, nearest) in least.items()
    )
    return Finding(
        "With a reasonable number the nearest neighbours are the best way to calculate an accurate "
        "discrete Laplacian",
        "4.2.2",
        f"Least error of the pattern by radius and by nearest neighbours, over its size: {words} "
        f"vertices; the nearest ones are the best graph on {won} of {len(least)} meshes. Flat "
        f"elements on the same {max(cases)} vertices err by {flat_error:.2g} times: of all ways no "
        "graph is the best, as section 4.2.3 says too.",
        Verdict.CONFIRMED if won == len(least) else Verdict.IN_PART if won else Verdict.REFUTED,
        {"graph": graph, "flat": flat_error, "won": float(won), "of": float(len(least))}
        | {f"radius_{count}": radius for count, (radius, _) in least.items()}
        | {f"nearest_{count}": nearest for count, (_, nearest) in least.items()},
    )


def _draw(cases: Mapping[int, _Case], settings: Settings) -> Figure:
    counts = list(cases)
    case = cases[counts[len(counts) // 2]]
    graphs = [one.error(rule) for one in cases.values() for rule in _RULES]
    elements = [one.error("flat") for one in cases.values()]
    message = (
        f"The errors of graphs are {min(graphs):.2g} to {max(graphs):.2g} times as large as the "
        f"pattern of the nine points, by either rule; those of flat elements "
        f"{min(elements):.2g} to {max(elements):.2g} times"
    )
    figure = new_figure("4.9, 4.10", _TITLE, message, 7.2)
    cells = grid(figure, 2, 3, wspace=0.3, hspace=0.36)
    _draw_points(figure, cells[0], case, settings)
    captions = {
        "reference": "Curved elements (isovary)",
        "flat": "Flat linear elements",
        "epsilon": f"Radius {settings['epsilon']:g} (curves leave the frame)",
        "nearest": f"{settings['neighbours']} nearest neighbours (curves leave it)",
    }
    shown = {"reference": case.reference, **case.curves}
    first: Axes | None = None
    for cell, (name, caption) in zip((cells[1], cells[2], cells[3], cells[4]), captions.items(),
                                     strict=True):  # fmt: skip
        axes = curve_axes(figure, cell, caption, "time (length²)", "HKS over the nine's mean (%)")
        _draw_curves(axes, case, shown[name])
        if first is not None:
            axes.set_ylim(first.get_ylim())
        first = first or axes
    _draw_errors(figure, cells[5], cases)
    return figure


def _draw_curves(axes: Axes, case: _Case, curves: Floats) -> None:
    pattern = 100 * (_pattern(curves) + 1)
    names = ("centre", "flank", "rim")
    for place, row in enumerate(pattern):
        spot = place % 3
        label = names[spot] if place < 3 else None
        axes.plot(case.times, row, color=_SPOTS[spot], lw=1.3, label=label)
    axes.set_xscale("log")
    axes.legend(frameon=False, fontsize=8.5)


def _draw_points(figure: Figure, cell: SubplotSpec, case: _Case, settings: Settings) -> None:
    colors = np.tile(MESH_COLOR, (len(case.surface.points), 1))
    for place, point in enumerate(case.points):
        away = np.linalg.norm(case.surface.points - case.surface.points[point], axis=1)
        colors[away < 0.055 * settings["radius"]] = to_rgb(_SPOTS[place % 3])
    caption = f"4.9: three dimples, nine points; radius {settings['radius']:g}"
    draw_surface(
        figure, cell, in_pieces(case.surface), colors, caption, towards=np.array([1.0, 0, 0])
    )


def _draw_errors(figure: Figure, cell: SubplotSpec, cases: Mapping[int, _Case]) -> None:
    axes = curve_axes(
        figure,
        cell,
        "Both rules at equal degree",
        "neighbours on average",
        "error over the pattern",
    )
    styles: Sequence[str] = ("-", "--", ":")
    for (count, case), style in zip(cases.items(), styles, strict=False):
        for name, color, mark in (("epsilon", COLORS[3], "o"), ("nearest", COLORS[5], "s")):
            rules = [rule for rule in _RULES if rule.startswith(name)]
            places = np.array([[case.degrees[r], case.error(r)] for r in rules])
            places = places[places[:, 0].argsort()]
            label = name.replace("epsilon", "radius") if style == "-" else None
            axes.plot(*places.T, style, marker=mark, color=color, label=label)
        axes.annotate(f"{count}", places[-1], (6, -3), textcoords="offset points", size=8.5)
    axes.margins(x=0.15)
    axes.set_ylim(bottom=0)
    axes.legend(frameon=False, fontsize=8.5, title="numbers: vertices")


EXPERIMENT = Experiment("4.9", _TITLE, run, also=("4.10",))
