"""Section 4.1.5: the scaling of the change, as printed and as its source has it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec

from ..clustering import k_medians
from ..deform import dimple
from ..difference import heat_trace_scale
from ..geometry import Floats, Ints, node_areas
from ..records import Surface
from ..shapes import ellipsoid, icosphere
from ..view._marks import INK
from ._drawing import COLORS, curve_axes, grid, logarithmic, new_figure
from ._gaussian_dimples import CORNERS, POLES, dimpled, draw_region, region
from ._panels import draw_groups
from ._perturbed import best_group, overlap
from ._records import Experiment, Finding, Outcome, Settings, Verdict
from ._steps import Signed, scaled_change, signed
from ._thesis_way import printed_change

_TITLE = "The scaling of the change"
_TOWARDS = np.array([1.0, -0.6, 1.0])
_TENTH = 0.1  # of the times: their share of the change, if all times counted alike
_SWAMPED = 2 * _TENTH  # twice what they are due
_SHOWN = 0.5  # IoU: more in common than not, as in figure 4.5
_SAME = 0.01  # relative: vertices and area count alike
WAYS = {"raw": "no scaling", "divided": "divided", "printed": "multiplied, as printed"}
_HUES = dict(zip(WAYS, (COLORS[6], COLORS[0], COLORS[1]), strict=True))


@dataclass(frozen=True, eq=False)
class _Pair:
    """A sphere and a dimpled one, and the change by each scaling.

    Parameters
    ----------
    base : Signed
    shape : Surface
        With dimples, on the same mesh.
    changes : dict of arrays (n, T)
    labels : dict of arrays (n,)
        1 in the best of the groups, else 0; none if nothing was grouped.
    fits : dict of float
        IoU of that group with the dimples.
    """

    base: Signed
    shape: Surface
    changes: Mapping[str, Floats]
    labels: Mapping[str, Ints]
    fits: Mapping[str, float]


def run(settings: Settings) -> Outcome:
    """Shares of the times on eight dimples, groups on two, by curved and by flat elements."""
    curved = signed(icosphere(settings["subdivisions"]), settings["pairs"], settings["times"])
    sphere = icosphere(settings["flat_subdivisions"], order=1)
    flat = signed(sphere, settings["pairs"], settings["times"])
    eight = {name: _eight(base, settings) for name, base in (("curved", curved), ("flat", flat))}
    two = {
        name: {depth: _two(base, depth, settings) for depth in settings["depths"]}
        for name, base in (("curved", curved), ("flat", flat))
    }
    shares = {
        f"{way}_{name}": _share(change)
        for name, pair in eight.items()
        for way, change in pair.changes.items()
    }
    findings = (_swamped(shares), _balanced(shares, eight), _found(two), _sums(settings))
    return Outcome(findings, _draw(eight["curved"], two["curved"], shares, settings["width"]))


def _changes(base: Signed, other: Signed) -> dict[str, Floats]:
    return {
        "raw": base.signature - other.signature,
        "divided": scaled_change(base, other),
        "printed": printed_change(base, other),
    }


def _eight(base: Signed, settings: Settings) -> _Pair:
    """Pushed out at a cube's corners, and the tips pushed in."""
    out = dimple(base.surface, CORNERS, settings["eight_width"], alpha=settings["eight_alpha"])
    height = float(np.linalg.norm(out.points, axis=1).max())
    shape = dimple(out, height * CORNERS, settings["tip_width"], alpha=settings["tip_alpha"])
    other = signed(shape, settings["pairs"], base.times)
    return _Pair(base, shape, _changes(base, other), {}, {})


def _two(base: Signed, depth: float, settings: Settings) -> _Pair:
    sphere = base.surface
    shape = dimpled(sphere, POLES, depth, settings["width"])
    changes = _changes(base, signed(shape, settings["pairs"], base.times))
    inside = region(sphere, POLES, settings["width"])
    areas = node_areas(sphere.points, sphere.triangles)
    labels, fits = {}, {}
    for way, change in changes.items():
        groups = k_medians(change, settings["clusters"], rng=settings["seed"]).labels
        found = np.equal(groups, best_group(groups, inside, areas))
        labels[way], fits[way] = found.astype(np.int64), overlap(found, inside, areas)
    return _Pair(base, shape, changes, labels, fits)


def _profile(change: Floats) -> Floats:
    """Part of the summed absolute change at each time (T,)."""
    sums = np.abs(change).sum(axis=0)
    return np.asarray(sums / sums.sum())


def _share(change: Floats) -> float:
    """Part of the summed absolute change at the smallest tenth of the times."""
    profile = _profile(change)
    return float(profile[: round(_TENTH * len(profile))].sum())


def effective(profile: Floats) -> float:
    """How many of the times count: 1 / sum p^2 over their number, from 1 / T to 1."""
    return float(1 / (profile**2).sum() / len(profile))


def _swamped(shares: Mapping[str, float]) -> Finding:
    raw = shares["raw_curved"]
    return Finding(
        "Differences of the signature cannot be compared directly: without a scaling the small "
        "times swamp the others",
        "4.1.5",
        f"Eight dimples: the smallest tenth of the times has {100 * raw:.0f} % of the summed "
        f"change (flat elements {100 * shares['raw_flat']:.0f} %), {raw / _TENTH:.1f} times what "
        "it is due.",
        Verdict.CONFIRMED if raw > _SWAMPED else Verdict.REFUTED,
        {"share_curved": raw, "share_flat": shares["raw_flat"]},
    )


def _balanced(shares: Mapping[str, float], eight: Mapping[str, _Pair]) -> Finding:
    raw, divided, printed = (shares[f"{way}_curved"] for way in WAYS)
    changes = eight["curved"].changes
    counts = {way: effective(_profile(changes[way])) for way in WAYS}
    worse = printed > raw and counts["printed"] < counts["raw"]
    less = counts["divided"] <= counts["raw"]
    return Finding(
        "The change is to be multiplied by W, w(t) the sum of the signatures, so that all times "
        "count",
        "4.1.5",
        f"As printed it gets worse: the smallest tenth of the times has {100 * printed:.0f} % of "
        f"the change instead of {100 * raw:.0f} %, and {100 * counts['printed']:.0f} % of the "
        f"times count instead of {100 * counts['raw']:.0f} % (1 / sum of squared shares). "
        f"Divided by w, {100 * divided:.1f} % and {100 * counts['divided']:.0f} %, which is "
        f"{'no better' if less else 'what was wanted'}; flat elements: "
        f"{100 * shares['printed_flat']:.0f}, {100 * shares['raw_flat']:.0f} and "
        f"{100 * shares['divided_flat']:.1f} %. The source [54] divides.",
        Verdict.REFUTED if worse else Verdict.CONFIRMED,
        {**shares, **{f"effective_{way}": count for way, count in counts.items()}},
    )


def _found(two: Mapping[str, Mapping[float, _Pair]]) -> Finding:
    numbers = {
        f"{way}_{name}_{depth:g}": fit
        for name, pairs in two.items()
        for depth, pair in pairs.items()
        for way, fit in pair.fits.items()
    }
    words = "; ".join(
        f"depth {depth:g}: "
        + ", ".join(
            f"{WAYS[way]} {fit:.2f} (flat elements {two['flat'][depth].fits[way]:.2f})"
            for way, fit in pair.fits.items()
        )
        for depth, pair in two["curved"].items()
    )
    shown = [pair.fits["printed"] > _SHOWN for pairs in two.values() for pair in pairs.values()]
    verdict = Verdict.IN_PART if any(shown) else Verdict.REFUTED
    return Finding(
        "The vector so scaled is the quantification of the shape's uncertainty: its groups show "
        "what was perturbed",
        "4.1.5, 4.1.6",
        f"IoU of the best of two groups with two dimples, by each scaling. {words}.",
        Verdict.CONFIRMED if all(shown) else verdict,
        numbers,
    )


def _sums(settings: Settings) -> Finding:
    base = signed(
        ellipsoid(settings["ellipsoid"], settings["subdivisions"]),
        settings["pairs"],
        settings["times"],
    )
    ratio = base.signature.mean(axis=0) / heat_trace_scale(base.pairs, base.times)
    worst = int(np.abs(ratio - 1).argmax())
    most, last = float(abs(ratio[worst] - 1)), float(ratio[-1])
    return Finding(
        "The solution of [54] is to compute for each t the sum of the signatures over the points",
        "4.1.5",
        "It is the integral over the surface, the same where vertices lie evenly. On an ellipsoid "
        f"{' : '.join(f'{axis:g}' for axis in settings['ellipsoid'])}, whose vertices lie denser "
        f"at its poles, the means over vertices and over area differ by up to {100 * most:.2g} %, "
        f"at the largest time by {100 * abs(last - 1):.1g} %; the sum also grows with the number "
        "of vertices. Isovary takes the area.",
        Verdict.IN_PART if most > _SAME else Verdict.CONFIRMED,
        {"most": most, "time": float(base.times[worst]), "last": last},
    )


def _draw(
    eight: _Pair, two: Mapping[float, _Pair], shares: Mapping[str, float], width: float
) -> Figure:
    deep, shallow = two[max(two)], two[min(two)]
    message = (
        f"Dividing by w finds two dimples with IoU {deep.fits['divided']:.2f} and "
        f"{shallow.fits['divided']:.2f} (deep, shallow), multiplying as printed with "
        f"{deep.fits['printed']:.2f} and {shallow.fits['printed']:.2f}: it puts "
        f"{100 * shares['printed_curved']:.0f} % of the change into a tenth of the times"
    )
    figure = new_figure("4.1.5", _TITLE, message, height=7.8)
    ratios = [1.5, 1, 1, 1]
    cells = grid(figure, 2, 4, wspace=0.14, hspace=0.36, left=0.065, width_ratios=ratios)
    _draw_profiles(figure, cells[0], eight, shares)
    _draw_fits(figure, cells[4], two)
    colors = np.array([[0.82, 0.82, 0.82], [0.0, 0.447, 0.698]])
    for row, (depth, pair) in enumerate(sorted(two.items())):
        for column, (way, fit) in enumerate(pair.fits.items()):
            words = f"{WAYS[way]}: IoU {fit:.2f}"
            axes = draw_groups(
                figure,
                cells[4 * row + 1 + column],
                pair.shape,
                pair.labels[way],
                colors,
                f"depth {depth:g}, {words}" if column == 0 else words,
                towards=_TOWARDS,
                key=("rest", "group that fits best") if row == 1 and column == 1 else (),
            )
            draw_region(axes, POLES, depth, width, _TOWARDS)
    words = "dashed: the region to be found (to a tenth of the depth)"
    figure.text(0.5, 0.015, words, size=9, color=INK)
    return figure


def _draw_profiles(
    figure: Figure, cell: SubplotSpec, pair: _Pair, shares: Mapping[str, float]
) -> None:
    label = "time (length²)"
    axes = curve_axes(figure, cell, "Eight dimples: where the change is", label, "share (%)")
    times = pair.base.times
    for way, change in pair.changes.items():
        words = f"{WAYS[way]}: {100 * shares[f'{way}_curved']:.0f} % in a tenth"
        axes.plot(times, 100 * _profile(change), color=_HUES[way], lw=1.6, label=words)
    axes.axhline(100 / len(times), color="0.5", lw=1, ls="--", label="all times alike")
    tenth = round(_TENTH * len(times))
    axes.axvspan(times[0], times[tenth - 1], color="0.92", lw=0)
    logarithmic(axes, y=False)
    axes.set_ylim(bottom=0)
    axes.legend(frameon=False, fontsize=8.5)


def _draw_fits(figure: Figure, cell: SubplotSpec, two: Mapping[float, _Pair]) -> None:
    axes = curve_axes(figure, cell, "Two dimples: what two groups find", "depth (radii)", "IoU")
    places = np.arange(len(two))
    for k, way in enumerate(WAYS):
        fits = [pair.fits[way] for pair in two.values()]
        axes.bar(places + 0.27 * (k - 1), fits, 0.25, color=_HUES[way], label=WAYS[way])
    axes.set_xticks(places, [f"{depth:g}" for depth in two])
    axes.set_ylim(0, 1.45)
    axes.set_yticks([0, 0.5, 1])
    axes.legend(frameon=False, fontsize=8.5, loc="upper left")


EXPERIMENT = Experiment("4.1.5", _TITLE, run)
