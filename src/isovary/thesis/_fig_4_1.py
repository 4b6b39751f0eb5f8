"""Figure 4.1: the working example; its change is local, and not in proportion to its size."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec

from ..clustering import k_medians
from ..color import NEUTRAL
from ..difference import change_norm
from ..geometry import Bools, Floats, Ints, linear_triangles, node_areas
from ..records import Surface
from ..shapes import icosphere
from ..view._marks import INK
from ._drawing import COLORS, curve_axes, draw_surface, grid, logarithmic, new_figure
from ._gaussian_dimples import POLES, dimpled, draw_region, region
from ._gaussian_dimples import angles as angles_from
from ._panels import draw_values
from ._perturbed import best_group, overlap
from ._records import Experiment, Finding, Outcome, Settings, Verdict
from ._steps import Signed, scaled_change, signed

_TITLE = "The working example: a sphere, and with two dimples"
_WHOLE, _PARTLY = 0.9, 0.5  # IoU: found whole; more in common than not
_PROPORTIONAL = 0.05  # relative departure from it
_FALLS = 0.5  # order from which the departure goes to 0 with the step
_LARGE = 3.0  # times the change at the equator: what one sees at once
_TOWARDS = np.array([1, -0.6, 1])
_EQUAL = 1e-4  # relative: on a mesh that has the mirror, the eigensolver's error


@dataclass(frozen=True, eq=False)
class _Example:
    """Spheres with dimples of some depths on one mesh, and what two groups find.

    Parameters
    ----------
    base : Signed
    changes, labels : dict of arrays (n, T) and (n,)
        By depth.
    fits : dict of float
        IoU of the best group with the dimples.
    region : array (n,)
        Nodes where a dimple has more than a tenth of its depth.
    """

    base: Signed
    changes: dict[float, Floats]
    labels: dict[float, Ints]
    fits: dict[float, float]
    region: Bools


def run(settings: Settings) -> Outcome:
    """The change, its groups by curved and by flat elements, and its growth with the depth."""
    sphere = icosphere(settings["subdivisions"])
    curved = _example(sphere, settings)
    flat = _example(icosphere(settings["flat_subdivisions"], order=1), settings)
    departures = _departures(sphere, settings)
    findings = (_found(curved, flat), _local(curved), _scaling(departures), _shapes(settings))
    return Outcome(findings, _draw(curved, departures, settings))


def _dimpled(sphere: Surface, depth: float, settings: Settings) -> Surface:
    return dimpled(sphere, POLES, depth, settings["width"])


def _signed(surface: Surface, base: Signed, settings: Settings) -> Signed:
    return signed(surface, settings["pairs"], base.times)


def _example(sphere: Surface, settings: Settings) -> _Example:
    base = signed(sphere, settings["pairs"], settings["times"])
    inside = region(sphere, POLES, settings["width"])
    areas = node_areas(sphere.points, sphere.triangles)
    changes, labels, fits = {}, {}, {}
    for depth in settings["depths"]:
        other = _signed(_dimpled(sphere, depth, settings), base, settings)
        change = scaled_change(base, other)
        groups = k_medians(change, settings["clusters"], rng=settings["seed"]).labels
        best = best_group(groups, inside, areas)
        fits[depth] = overlap(np.equal(groups, best), inside, areas)
        changes[depth], labels[depth] = change, np.where(groups == best, 1, 0)
    return _Example(base, changes, labels, fits, inside)


def _departures(sphere: Surface, settings: Settings) -> dict[float, float]:
    """By depth, how far the change is from the depth times its derivative, as a part of it."""
    base = signed(sphere, settings["pairs"], settings["times"])
    step = settings["step"]
    up, down = (
        scaled_change(base, _signed(_dimpled(sphere, depth, settings), base, settings))
        for depth in (step, -step)
    )
    slope = (up - down) / (2 * step)
    found = {}
    for depth in (*settings["small_depths"], max(settings["depths"])):
        other = _signed(_dimpled(sphere, depth, settings), base, settings)
        change = scaled_change(base, other)
        found[depth] = float(np.linalg.norm(change - depth * slope) / np.linalg.norm(change))
    return found


def _found(curved: _Example, flat: _Example) -> Finding:
    words = "; ".join(
        f"depth {depth:g}: {fit:.2f} (flat elements {flat.fits[depth]:.2f})"
        for depth, fit in curved.fits.items()
    )
    least = min(curved.fits.values())
    part = Verdict.IN_PART if least >= _PARTLY else Verdict.REFUTED
    return Finding(
        "The change of the signature identifies the points and regions that were perturbed",
        "Ch. 1, 4.1, Fig 4.1",
        f"IoU of one of two groups with the two dimples, on one mesh: {words}. "
        "Where the surface moved and where its shape changed are not quite the same places.",
        Verdict.CONFIRMED if least >= _WHOLE else part,
        {f"fit_{depth:g}": fit for depth, fit in curved.fits.items()}
        | {f"flat_{depth:g}": fit for depth, fit in flat.fits.items()},
    )


def _local(curved: _Example) -> Finding:
    deepest = max(curved.changes)
    norm = change_norm(curved.changes[deepest])
    angles = angles_from(curved.base.surface, POLES)
    nearest = angles.min(axis=1)
    tip, far = float(norm[nearest.argmin()]), float(norm[nearest.argmax()])
    apart = norm[[int(angles[:, k].argmin()) for k in (0, 1)]]
    mismatch = float(abs(apart[1] / apart[0] - 1))
    return Finding(
        "The points where large changes have occurred are identified, in both dimples alike",
        "Ch. 1, 4.1",
        f"At depth {deepest:g} the mean change is {tip:.2g} at the tips and {far:.2g} at the "
        f"equator, {tip / far:.2g} times less; the tips differ by {mismatch:.1g}.",
        Verdict.CONFIRMED if tip > _LARGE * far and mismatch < _EQUAL else Verdict.IN_PART,
        {"tip": tip, "equator": far, "mismatch": mismatch},
    )


def _scaling(departures: dict[float, float]) -> Finding:
    words = ", ".join(f"{100 * part:.3g} % at depth {d:g}" for d, part in departures.items())
    worst, (low, high) = max(departures.values()), sorted(departures)[:2]
    order = float(np.log(departures[high] / departures[low]) / np.log(high / low))
    part = Verdict.IN_PART if order > _FALLS else Verdict.REFUTED
    return Finding(
        "Divided by the step the change approximates the derivative; that merely scales its "
        "magnitude globally",
        "4.1.5",
        "In the limit of small steps it does. The change departs from the step times the "
        f"derivative by {words} (order {order:.2g} of the step): at the depths of the example the "
        "quotient is no derivative, and steps of different size are not compared by dividing.",
        Verdict.CONFIRMED if worst < _PROPORTIONAL else part,
        {f"departure_{depth:g}": part for depth, part in departures.items()} | {"order": order},
    )


def _shapes(settings: Settings) -> Finding:
    depths = " and ".join(f"{depth:g}" for depth in settings["depths"])
    return Finding(
        "The example is a sphere and the same sphere with two dimples",
        "4.1, Fig 4.1",
        "Neither depth, width nor places of the dimples are given. Taken here: both poles, depths "
        f"{depths} and width {settings['width']:g} of a unit sphere.",
        Verdict.OPEN,
        {f"depth_{k}": depth for k, depth in enumerate(settings["depths"])},
    )


def _draw(example: _Example, departures: dict[float, float], settings: Settings) -> Figure:
    shallow, deep = min(example.fits), max(example.fits)
    small = min(departures)
    message = (
        f"Two groups of the change find the dimples (IoU {example.fits[deep]:.2f} at depth "
        f"{deep:g}, {example.fits[shallow]:.2f} at {shallow:g}); it is "
        f"{100 * departures[small]:.2g} % out of proportion at depth {small:g}, "
        f"{100 * departures[deep]:.0f} % at {deep:g}"
    )
    figure = new_figure("4.1", _TITLE, message, height=8.0)
    ratios = [1, 1, 1, 0.14, 1.3]  # the fourth for the name of an axis
    cells = grid(figure, 2, 5, wspace=0.16, hspace=0.3, left=0.03, width_ratios=ratios)
    sphere = example.base.surface
    grey = np.array([int(NEUTRAL[k : k + 2], 16) / 255 for k in (1, 3, 5)])
    for row, depth in enumerate((shallow, deep)):
        shape = _dimpled(sphere, depth, settings)
        norm = change_norm(example.changes[depth])
        blue = np.array([0.0, 0.447, 0.698])
        shown = (
            (f"depth {depth:g}", np.tile(grey, (len(norm), 1))),
            (
                f"two groups, IoU {example.fits[depth]:.2f}",
                np.where(example.labels[depth][:, None] == 1, blue, grey),
            ),
        )
        plain = Surface(shape.points, linear_triangles(shape.triangles), normals=shape.normals)
        axes = [
            draw_surface(figure, cells[5 * row + column], plain, colors, words, towards=_TOWARDS)
            for column, (words, colors) in zip((0, 2), shown, strict=True)
        ]
        bar = "mean change (% of the mean HKS)"
        most = 100 * float(norm.max())
        cell = cells[5 * row + 1]
        axes.append(
            draw_values(figure, cell, plain, 100 * norm, most, "mean change", bar, towards=_TOWARDS)
        )
        for panel in axes:
            draw_region(panel, POLES, depth, settings["width"], _TOWARDS)
    words = "dashed: the region to be found (to a tenth of the depth)"
    figure.text(0.445, 0.025, words, size=8.5, color=INK)
    _draw_profile(figure, cells[4], example)
    _draw_departures(figure, cells[9], departures)
    return figure


def _draw_profile(figure: Figure, cell: SubplotSpec, example: _Example) -> None:
    axes = curve_axes(figure, cell, "Mean change", "angle from the tip (°)", "part of the mean HKS")
    nearest = np.degrees(angles_from(example.base.surface, POLES).min(axis=1))
    order = nearest.argsort()
    for (depth, change), color in zip(example.changes.items(), COLORS, strict=False):
        norm = change_norm(change)
        axes.plot(nearest[order], norm[order], color=color, lw=1.6, label=f"depth {depth:g}")
    border = float(nearest[example.region].max())
    axes.axvline(border, color="0.5", lw=1, ls="--", label="a tenth of the depth")
    logarithmic(axes, x=False)
    axes.legend(frameon=False, fontsize=8.5)


def _draw_departures(figure: Figure, cell: SubplotSpec, departures: dict[float, float]) -> None:
    axes = curve_axes(
        figure, cell, "Departure from proportion", "depth (radii)", "of the change (%)"
    )
    depths = sorted(departures)
    axes.plot(depths, [100 * departures[d] for d in depths], "o-", color=COLORS[0])
    logarithmic(axes)


EXPERIMENT = Experiment("4.1", _TITLE, run)
