"""Figures 4.17 to 4.19: what a growing dimple does to eigenpairs, and what signatures see of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec

from ..view._paint import MOVE_MAP
from ._drawing import COLORS, curve_axes, draw_surface, grid, logarithmic, new_figure
from ._growing_dimple import SHELLS, Measured, measure
from ._records import Experiment, Finding, Outcome, Settings, Verdict

_TITLE = "Eigenpairs of a sphere with a growing dimple"
_CLOSE = 0.01  # mean relative shift of eigenvalues: their curves lie in one line's width
_KEPT = 0.95  # cosine of the largest angle between a shell and the harmonics of its degree
_PURE = 0.95  # part of an eigenfunction's energy in one order
_PRONOUNCED = 0.1  # relative change that nobody overlooks
_LOCAL = 10.0  # times as much at the tip as opposite it
_BINS = 40
_FIGURE = {False: "4.17: number ", True: "4.19: number "}


def run(settings: Settings) -> Outcome:
    """Eigenpairs, harmonics and signatures for each dimple."""
    measured = measure(settings)
    findings = (
        _superimpose(measured),
        _harmonics(measured, settings["apart"]),
        _more_pronounced(measured),
        _gps_fails(measured),
        _gps_reason(measured),
        _hks_sees(measured),
    )
    return Outcome(findings, _draw(measured, settings))


def _superimpose(measured: Measured) -> Finding:
    shifts, errors = np.abs(measured.shifts), np.abs(measured.flat_errors)
    depth = 1 + float(measured.spheres[-1].surface.points[measured.angles.argmin(), 2])
    curved = np.abs(measured.spheres[0].pairs.values[1:] / measured.exact[1:] - 1)
    return Finding(
        f"The first {len(shifts) + 1} eigenvalues almost superimpose as a large dimple grows",
        "4.2.6, Fig 4.18",
        f"A dimple of depth {depth:.2g} shifts them by {100 * shifts.mean():.2g} % in the mean and "
        f"{100 * shifts.max():.2g} % at most. The errors of flat elements with as many nodes are "
        f"larger, {100 * errors.mean():.2g} and {100 * errors.max():.2g} %; of curved ones "
        f"{100 * curved.mean():.2g} and {100 * curved.max():.2g} %.",
        Verdict.CONFIRMED if shifts.mean() < _CLOSE else Verdict.REFUTED,
        {
            "depth": depth,
            "shift_mean": float(shifts.mean()),
            "shift_most": float(shifts.max()),
            "flat_error_mean": float(errors.mean()),
            "flat_error_most": float(errors.max()),
            "curved_error_most": float(curved.max()),
        },
    )


def _harmonics(measured: Measured, apart: Sequence[int]) -> Finding:
    values = measured.spheres[0].pairs.values[np.array(apart) - 1]
    least = float(measured.overlaps.min())
    said = ", ".join(f"{value:.4f}" for value in values)
    return Finding(
        "The eigenfunctions stay spherical harmonics: no significant change in their behaviour",
        "4.2.6, Figs 4.17, 4.19",
        f"The spaces of the first {SHELLS} shells keep within "
        f"{np.degrees(np.arccos(min(least, 1.0))):.2g} degrees of those of the harmonics (cosine "
        f"{least:.3f}). Single eigenfunctions cannot be followed: within a shell the sphere leaves "
        f"their rotation open. Eigenvalues {', '.join(map(str, apart))} of the sphere are {said}.",
        Verdict.CONFIRMED if least > _KEPT else Verdict.REFUTED,
        {"least_cosine": least}
        | {f"value_{n}": float(v) for n, v in zip(apart, values, strict=True)},
    )


def _more_pronounced(measured: Measured) -> Finding:
    before, after = float(measured.purity[0].mean()), float(measured.purity[1:].min())
    return Finding(
        "In some cases the harmonics are more pronounced; no definite conclusion can be drawn",
        "4.2.6, Fig 4.19",
        "One can: the dimple is round and picks an axis, so every eigenfunction becomes one of a "
        f"single order around it, but for {100 * (1 - after):.1g} % of its energy at most. On the "
        f"sphere, where any mixture does, {100 * (1 - before):.2g} % in the mean lie in others.",
        Verdict.IN_PART if after > _PURE else Verdict.OPEN,
        {"purity_sphere": before, "purity_dimpled": after},
    )


def _gps_fails(measured: Measured) -> Finding:
    tip, far = measured.at_ends("gps")
    return Finding(
        "The global point signature may not work well to quantify intrinsic variation",
        "4.2.6",
        f"Subtracted one by one it changes by {100 * tip:.3g} % of its length at the tip and by "
        f"{100 * far:.3g} % opposite it, where nothing happened: it cannot locate.",
        Verdict.CONFIRMED if tip < 2 * far else Verdict.REFUTED,
        {"gps_tip": tip, "gps_opposite": far},
    )


def _gps_reason(measured: Measured) -> Finding:
    raw = float(np.median(measured.changes["gps"]))
    tip, far = measured.at_ends("gps_length")
    return Finding(
        "That is because differences are not pronounced where eigenpairs are close",
        "4.2.6",
        f"They are too pronounced: {100 * raw:.3g} % in the median, for signs and rotations within "
        "a repeated eigenvalue are arbitrary. Its squared length, which is free of them, changes "
        f"by {100 * tip:.2g} % at the tip and {100 * far:.2g} % opposite it.",
        Verdict.REFUTED if raw > _PRONOUNCED else Verdict.CONFIRMED,
        {"gps_median": raw, "length_tip": tip, "length_opposite": far},
    )


def _hks_sees(measured: Measured) -> Finding:
    tip, far = measured.at_ends("hks")
    ratio = tip / far
    return Finding(
        "The heat kernel signature is sensitive to such perturbations",
        "4.2.6",
        f"It changes by {100 * tip:.2g} % rms over the times at the tip and {100 * far:.2g} % "
        f"opposite it, {ratio:.2g} times less.",
        Verdict.CONFIRMED if ratio > _LOCAL else Verdict.REFUTED,
        {"hks_tip": tip, "hks_opposite": far, "ratio": ratio},
    )


def _draw(measured: Measured, settings: Settings) -> Figure:
    (tip, far), (gps, gps_far) = measured.at_ends("hks"), measured.at_ends("gps")
    shift = 100 * np.abs(measured.shifts).mean()
    message = (
        f"The eigenvalues move by {shift:.1g} %; the HKS changes by {100 * tip:.2g} % at the tip "
        f"and {100 * far:.1g} % opposite it, the GPS by {100 * gps:.0f} and {100 * gps_far:.0f} %: "
        "signs and rotations"
    )
    rows = len(_rows(measured))
    height = 4.9 + 1.3 * rows
    figure = new_figure("4.17 to 4.19", _TITLE, message, height=height)
    _draw_chart(figure, measured, settings, 4.1)
    cells = grid(figure, 1, 3, wspace=0.27, top=3.45 / height)
    _draw_values(figure, cells[0], measured)
    _draw_shifts(figure, cells[1], measured)
    _draw_changes(figure, cells[2], measured)
    return figure


def _rows(measured: Measured) -> list[int]:
    """Numbers of the spheres that are drawn: the plain one, and the two strongest dimples."""
    count = len(measured.alphas)
    return sorted({0, max(count - 2, 0), count - 1})


def _draw_chart(figure: Figure, measured: Measured, settings: Settings, below: float) -> None:
    """A row for each dimple, a column for each eigenfunction, all of one scale each."""
    first, apart = settings["first"], settings["apart"]
    shown = _rows(measured)
    rows, columns = len(shown), len(first) + 1 + len(apart)
    places = [(k, n) for k, n in enumerate([*first, None, *apart]) if n is not None]
    height = figure.get_size_inches()[1]
    cells = grid(
        figure,
        rows,
        columns,
        below,
        top=1 - 1.25 / height,
        wspace=0.05,
        hspace=0.2,
        width_ratios=[1.0] * len(first) + [0.25] + [1.0] * len(apart),
    )
    towards = np.array([1.0, -0.5, -0.55])
    for row, k in enumerate(shown):
        sphere, alpha = measured.spheres[k], measured.alphas[k]
        for column, number in places:
            function = sphere.pairs.vectors[:, number - 1]
            bright = function * np.sign(function[np.abs(function).argmax()])
            colors = MOVE_MAP(0.5 + 0.5 * bright / np.abs(bright).max())[:, :3]
            value = sphere.pairs.values[number - 1]
            cell = cells[columns * row + column]
            axes = draw_surface(figure, cell, sphere.surface, colors, towards=towards)
            axes.set_title(f"λ = {value:.4g}", size=8, pad=1)
            if row == 0:
                axes.text(
                    0.5,
                    1.17,
                    f"{_FIGURE[column > len(first)]}{number}",
                    size=9,
                    ha="center",
                    **_inside(axes),
                )
            if column == 0:
                words = f"alpha {alpha}" if alpha else "sphere"
                axes.text(-0.14, 0.5, words, rotation=90, size=9, va="center", **_inside(axes))


def _inside(axes: Axes) -> dict[str, Any]:
    return {"transform": axes.transAxes}


def _draw_values(figure: Figure, cell: SubplotSpec, measured: Measured) -> None:
    axes = curve_axes(figure, cell, "Figure 4.18: eigenvalues", "number", "λ (1/length²)")
    numbers = np.arange(1, len(measured.flat) + 1)
    axes.plot(numbers, measured.flat, color=COLORS[1], lw=1.4, label="sphere, flat elements")
    for sphere, alpha, color in zip(
        measured.spheres,
        measured.alphas,
        (COLORS[0], COLORS[2], COLORS[3], COLORS[6]),
        strict=False,
    ):
        axes.plot(numbers, sphere.pairs.values, color=color, lw=1.1, label=f"alpha {alpha}")
    axes.legend(frameon=False, fontsize=8.5)


def _draw_shifts(figure: Figure, cell: SubplotSpec, measured: Measured) -> None:
    axes = curve_axes(figure, cell, "How far off eigenvalues are", "number", "relative (%)")
    numbers = np.arange(2, len(measured.flat) + 1)
    errors = np.maximum(np.abs(measured.flat_errors), 1e-9)
    name = f"by the dimple, alpha {measured.alphas[-1]}"
    axes.plot(numbers, 100 * errors, ".", ms=4, color=COLORS[1], label="error of flat elements")
    axes.plot(numbers, 100 * np.abs(measured.shifts), ".", ms=4, color=COLORS[6], label=name)
    logarithmic(axes, x=False)
    axes.set_ylim(bottom=1e-4)
    axes.legend(frameon=False, fontsize=8.5, markerscale=2)


def _draw_changes(figure: Figure, cell: SubplotSpec, measured: Measured) -> None:
    axes = curve_axes(
        figure, cell, "Relative change of signatures", "angle from the tip (°)", "change (%)"
    )
    ends = np.linspace(0, 180, _BINS + 1)
    place = np.clip(np.digitize(measured.angles, ends) - 1, 0, _BINS - 1)
    filled = np.unique(place)
    middles = ((ends[1:] + ends[:-1]) / 2)[filled]
    names = {"gps": "GPS, one by one", "gps_length": "GPS, squared length", "hks": "HKS, rms"}
    for (key, name), color in zip(names.items(), (COLORS[1], COLORS[4], COLORS[0]), strict=True):
        means = [100 * measured.changes[key][place == k].mean() for k in filled]
        axes.plot(middles, means, color=color, lw=1.8, label=name)
    axes.set_xticks(range(0, 181, 45))
    logarithmic(axes, x=False)
    axes.legend(frameon=False, fontsize=8.5)


EXPERIMENT = Experiment("4.17", _TITLE, run, also=("4.18", "4.19"))
