"""Figure 5.2: dimples at both poles of an ellipsoid, pushed in and drawn out ever stronger."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec

from ..color import NEUTRAL
from ..geometry import Floats
from ..records import Surface
from ..shapes import disk, ellipsoid
from ._drawing import COLORS, curve_axes, draw_surface, grid, new_figure
from ._irregular import irregular_ellipsoid, polar_dimple
from ._records import Experiment, Finding, Outcome, Settings, Verdict
from ._steps import signed

_TITLE = "Two polar dimples, ever stronger"
_STEADY = 0.95  # of the times: the curves at the ends may touch
_SAME = 0.02  # about the width of a drawn line
_PATCH = 1e-3  # radius of the piece whose bend is the tip's curvature, in semi-axes


class _Series(NamedTuple):
    """Signatures (alphas, 2, times) at both poles, the first without a dimple."""

    times: Floats
    poles: Floats

    @property
    def steady(self) -> float:
        """Part of the times at which every step of alpha has the same sign."""
        steps = np.diff(self.poles[1:, 0], axis=0)
        return float(((steps > 0).all(axis=0) | (steps < 0).all(axis=0)).mean())

    @property
    def mismatch(self) -> Floats:
        """Largest relative difference of the poles over the times, for each alpha."""
        worst: Floats = np.abs(self.poles[:, 1] / self.poles[:, 0] - 1).max(axis=1)
        return worst


def run(settings: Settings) -> Outcome:
    """Signatures at the poles for all strengths, on symmetric and irregular meshes."""
    axes, shift, seed = (settings[name] for name in ("axes", "shift", "seed"))
    few, many = settings["subdivisions"], settings["flat_subdivisions"]
    meshes = {
        "symmetric": ellipsoid(axes, few),
        "curved": irregular_ellipsoid(axes, few, shift, seed),
        "flat": irregular_ellipsoid(axes, many, shift, seed, order=1),
    }
    found = {
        name: {sign: _series(mesh, sign, settings) for sign in (1, -1)}
        for name, mesh in meshes.items()
    }
    bends = {sign: _bends(sign, settings) for sign in (1, -1)}
    findings = (_steadily(found, bends[1], settings), _aligned(found), _strengths(settings))
    return Outcome(findings, _draw(meshes["symmetric"], found, bends, settings))


def _dimpled(surface: Surface, alpha: float, settings: Settings) -> Surface:
    height, radius = settings["axes"][2], settings["dimple_radius"]
    if alpha == 0:
        return surface
    return polar_dimple(polar_dimple(surface, height, radius, alpha), -height, radius, alpha)


def _series(surface: Surface, sign: int, settings: Settings) -> _Series:
    pairs = settings["pairs"]
    base = signed(surface, pairs, settings["times"])
    height = settings["axes"][2]
    places = np.array([[0, 0, height], [0, 0, -height]])
    nodes = [int(np.linalg.norm(surface.points - place, axis=1).argmin()) for place in places]
    poles = [base.signature[nodes]]
    for alpha in settings["alphas"]:
        dimpled = _dimpled(surface, sign * alpha, settings)
        poles.append(signed(dimpled, pairs, base.times).signature[nodes])
    return _Series(base.times, np.array(poles))


def _bends(sign: int, settings: Settings) -> Floats:
    """Curvature of every line through the tip, without a dimple and with each; 1/length.

    From a piece of the surface so small that it is a paraboloid.
    """
    flat = disk(_PATCH, 1, order=1)
    x, y, height = settings["axes"]
    inside = 1 - (flat.points[:, 0] / x) ** 2 - (flat.points[:, 1] / y) ** 2
    points = np.column_stack([flat.points[:, :2], height * np.sqrt(inside)])
    piece = Surface(points, flat.triangles)
    bends = []
    for alpha in (0, *settings["alphas"]):
        radius = settings["dimple_radius"]
        moved = polar_dimple(piece, height, radius, sign * alpha).points if alpha else points
        away = (moved[1:, :2] ** 2).sum(axis=1)
        bends.append(float((2 * (moved[0, 2] - moved[1:, 2]) / away).mean()))
    return np.array(bends)


def _steadily(found: dict[str, dict[int, _Series]], bends: Floats, settings: Settings) -> Finding:
    inward, outward = (found["symmetric"][sign].steady for sign in (1, -1))
    strengths = np.array([0, *settings["alphas"]], dtype=float)
    flat_at = float(np.interp(0, -bends, strengths))
    good = (inward >= _STEADY) + (outward >= _STEADY)
    return Finding(
        "The signature at the pole changes steadily as the depression grows",
        "5.2.1, Fig 5.2(b)",
        f"Rises or falls throughout at {100 * inward:.0f} % of the times for dimples pushed in and "
        f"{100 * outward:.0f} % for those drawn out. At small times the signature follows the "
        f"Gaussian curvature, the square of the tip's bend: drawn out it only grows; pushed in it "
        f"falls from {bends[0] ** 2:.2g} to 0, where the tip is flat (alpha {flat_at:.2g}), and "
        "rises again.",
        (Verdict.REFUTED, Verdict.IN_PART, Verdict.CONFIRMED)[good],
        {"steady_in": inward, "steady_out": outward, "bend": bends[0], "flat_at": flat_at},
    )


def _aligned(found: dict[str, dict[int, _Series]]) -> Finding:
    worst = {
        name: max(float(series.mismatch.max()) for series in both.values())
        for name, both in found.items()
    }
    poles = found["flat"][1].poles[1:, 0]
    step = float((np.abs(np.diff(poles, axis=0)) / poles[1:]).max(axis=1).min())
    good = worst["flat"] < _SAME
    return Finding(
        "The curves of both poles, deformed identically, are almost perfectly aligned",
        "5.2.1",
        f"Worst difference over times and strengths: {100 * worst['flat']:.2g} % with flat "
        f"elements on an irregular mesh, {100 * worst['curved']:.2g} % with as many nodes of "
        f"curved ones, {100 * worst['symmetric']:.1g} % on a symmetric mesh. One step of alpha "
        f"changes the curve by {100 * step:.2g} % at least.",
        Verdict.CONFIRMED if good and worst["symmetric"] < 1e-5 else Verdict.IN_PART,
        {f"mismatch_{name}": value for name, value in worst.items()} | {"step": step},
    )


def _strengths(settings: Settings) -> Finding:
    height = settings["axes"][2]
    flat = disk(_PATCH, 1, order=1)
    piece = Surface(flat.points + np.array([0, 0, height]), flat.triangles)
    radius, alphas = settings["dimple_radius"], settings["alphas"]
    ends = [
        (height - float(polar_dimple(piece, height, radius, alpha).points[0, 2])) / radius
        for alpha in (alphas[0], alphas[-1])
    ]
    return Finding(
        "The strengths are alpha = 100, ..., 900",
        "Fig 5.2",
        "Depths are not given, nor charges, time step, flight and the region's radius, without "
        "which alpha has no meaning. Read as alpha / 100 of ours they are dimples of "
        f"{ends[0]:.2g} to {ends[1]:.2g} radii.",
        Verdict.OPEN,
        {"depth_first": ends[0], "depth_last": ends[1]},
    )


def _draw(
    surface: Surface,
    found: dict[str, dict[int, _Series]],
    bends: dict[int, Floats],
    settings: Settings,
) -> Figure:
    both = found["symmetric"]
    message = (
        f"Drawn out, the signature at the pole changes steadily ({100 * both[-1].steady:.0f} % of "
        f"the times); pushed in, it turns round ({100 * both[1].steady:.0f} %), for the tip goes "
        "flat and then bends inward"
    )
    figure = new_figure("5.2", _TITLE, message, height=8.2)
    cells = grid(figure, 2, 3, wspace=0.26, hspace=0.36, left=0.02, width_ratios=[0.62, 1.2, 1])
    strongest = settings["alphas"][-1]
    for row, (sign, name) in enumerate(((1, "pushed in"), (-1, "drawn out"))):
        shape = _dimpled(surface, sign * strongest, settings)
        _draw_shape(figure, cells[3 * row], shape, f"Poles {name}, alpha {strongest}")
        _draw_curves(figure, cells[3 * row + 1], both[sign], name, settings["alphas"])
    _draw_bends(figure, cells[2], bends, settings["alphas"])
    _draw_mismatch(figure, cells[5], found, settings["alphas"])
    return figure


def _draw_shape(figure: Figure, cell: SubplotSpec, shape: Surface, caption: str) -> None:
    grey = [int(NEUTRAL[k : k + 2], 16) / 255 for k in (1, 3, 5)]
    colors = np.tile(grey, (len(shape.points), 1))
    draw_surface(figure, cell, shape, colors, caption, towards=np.array([1.0, -0.6, 0.75]))


def _draw_curves(
    figure: Figure, cell: SubplotSpec, series: _Series, name: str, alphas: Sequence[float]
) -> None:
    axes = curve_axes(
        figure,
        cell,
        f"Signature at the poles, {name}",
        "time (length²)",
        "change against no dimple (%)",
    )
    shades = colormaps["viridis"](np.linspace(0, 0.9, len(alphas)))
    change = 100 * (series.poles[1:] / series.poles[0] - 1)
    for alpha, shade, (north, south) in zip(alphas, shades, change, strict=True):
        axes.plot(series.times, north, color=shade, lw=1.7, label=f"{alpha}")
        axes.plot(series.times, south, color="white", lw=0.7, ls=(0, (2, 3)))
    axes.axhline(0, color="0.6", lw=0.8)
    axes.set_xscale("log")
    axes.legend(
        frameon=False, fontsize=8, title="alpha (dotted: other pole)", ncols=3, title_fontsize=8
    )


def _draw_bends(
    figure: Figure, cell: SubplotSpec, bends: dict[int, Floats], alphas: Sequence[float]
) -> Axes:
    axes = curve_axes(
        figure, cell, "Gaussian curvature at the tip, exact", "alpha", "K (1/length²)"
    )
    for sign, color, name in ((1, COLORS[0], "pushed in"), (-1, COLORS[1], "drawn out")):
        axes.plot([0, *alphas], bends[sign] ** 2, "o-", color=color, label=name)
    axes.set_yscale("symlog", linthresh=1)
    axes.set_ylim(bottom=-0.1)
    axes.legend(frameon=False)
    return axes


def _draw_mismatch(
    figure: Figure,
    cell: SubplotSpec,
    found: dict[str, dict[int, _Series]],
    alphas: Sequence[float],
) -> None:
    axes = curve_axes(figure, cell, "How far the poles differ, drawn out", "alpha", "worst (%)")
    names = ("flat elements, irregular mesh", "curved, irregular", "curved, symmetric")
    for kind, name, color in zip(
        ("flat", "curved", "symmetric"), names, (COLORS[1], COLORS[0], COLORS[6]), strict=True
    ):
        worst = 100 * np.maximum(found[kind][-1].mismatch, 1e-12)
        axes.plot([0, *alphas], worst, "o-", color=color, label=name)
    axes.set_yscale("log")
    axes.legend(frameon=False, fontsize=8.5)


EXPERIMENT = Experiment("5.2", _TITLE, run)
