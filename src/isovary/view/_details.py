"""The second picture: the other side, strain, the groups at every scale, spectrum, how much."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..color import group_colors
from ..comparison import Comparison
from ..difference import change_norm
from ..geometry import Floats, node_areas
from ..signature import diffusion_radius
from . import _paint as paint
from ._curves import calm, round_ticks
from ._marks import INK, SOFT, caption, color_bar, fit_line, legend
from ._overview import prepare
from ._panels import View, draw_change, draw_surface, rim_legend, surface_axes
from ._tessellate import at_pieces
from ._words import answer, percent, title

_SIZE, _DPI = (12.8, 7.2), 160
_LEFT, _BELOW, _WIDTH, _HEIGHT = (0.02, 0.35, 0.685), (0.545, 0.085), 0.295, 0.30
_BAND = (0.1, 0.9)
_BINS = 48


def details(result: Comparison) -> Figure:
    """Six panels: two sides of the surface, groups at every scale, histogram and spectrum.

    Parameters
    ----------
    result : Comparison

    Returns
    -------
    matplotlib.figure.Figure
        12.8 x 7.2 inches at 160 dots per inch; belongs to no window.

    Notes
    -----
    The side opposite to that of :func:`overview` in the same colours; the strain of the map;
    the change's histogram by area beside that of its noise; for each group the median change at
    every column, with the band of 80 % of its nodes, and as a heat map; and how far each
    eigenvalue moved. Cost: 2 s.
    """
    return details_of(prepare(result))


def details_of(view: View) -> Figure:
    """The same, from what the overview has prepared."""
    figure = Figure(figsize=_SIZE, dpi=_DPI, facecolor="white")
    words = answer(view.result, view.significant_share) or "No significant change"
    fit_line(figure, 0.02, 0.975, words, 0.96, size=13, weight="bold", color=INK)
    said = f"Isosurface {title(view.result)}, base against perturbed"
    fit_line(figure, 0.02, 0.93, said, 0.96, size=9.5, color=SOFT)
    _other_side(figure, view)
    _strain(figure, view)
    _histogram(_plot(figure, 2, 0, "c", "How much: the change and its noise"), view.result)
    _group_curves(_plot(figure, 0, 1, "d", "Groups: median, 80 % band"), view)
    _heat_map(figure, view)
    _spectrum(_plot(figure, 2, 1, "f", "Eigenvalues: perturbed against base"), view.result)
    return figure


def _plot(figure: Figure, column: int, row: int, letter: str, words: str) -> Axes:
    left, below = _LEFT[column], _BELOW[row]
    caption(figure, left, below + _HEIGHT + 0.045, letter, words)
    axes = figure.add_axes((left + 0.045, below, _WIDTH - 0.035, _HEIGHT - 0.01))
    axes.tick_params(labelsize=8)
    axes.xaxis.label.set_fontsize(8.5)
    axes.yaxis.label.set_fontsize(8.5)
    return axes


def _other_side(figure: Figure, view: View) -> None:
    left, below = _LEFT[0], _BELOW[0]
    caption(figure, left, below + _HEIGHT + 0.045, "a", "Opposite side: where it changed")
    back = replace(view, camera=view.camera.opposite)
    axes = surface_axes(figure, (left, below, _WIDTH, _HEIGHT), back)
    limit = paint.norm_limit(view.result)
    draw_change(axes, back, limit)
    legend(figure, rim_legend(view), (left + _WIDTH / 2, below + _HEIGHT + 0.022))
    if limit > 0:
        words = "mean change, %"
        box = (left + 0.03, below - 0.022, _WIDTH - 0.06, 0.011)
        color_bar(figure, box, paint.NORM_MAP, (0, 100 * limit), words)


def _strain(figure: Figure, view: View) -> None:
    left, below = _LEFT[1], _BELOW[0]
    caption(figure, left, below + _HEIGHT + 0.045, "b", "Strain: largest change of a length")
    axes = surface_axes(figure, (left, below, _WIDTH, _HEIGHT), view)
    result, limit = view.result, paint.strain_limit(view.result)
    strain = at_pieces(result.base, view.split, result.strain)
    colors = paint.mapped(paint.NORM_MAP, strain / (limit or 1.0))
    colors[np.isnan(strain)] = paint.NO_PARTNER
    draw_surface(axes, replace(view, samples=view.samples.moved), colors)
    if limit > 0:
        box = (left + 0.03, below - 0.022, _WIDTH - 0.06, 0.011)
        color_bar(figure, box, paint.NORM_MAP, (0, 100 * limit), "strain, %")


def _histogram(axes: Axes, result: Comparison) -> None:
    """Part of the area by norm of the change, and by that of the noise floor."""
    areas = node_areas(result.base.points, result.base.triangles)
    kinds = {
        "change": (result.change_norm, INK),
        "noise floor": (change_norm(result.noise_floor), "#9a9a9a"),
    }
    sizes = {name: 100 * values[values > 0] for name, (values, _) in kinds.items()}
    everything = np.concatenate(list(sizes.values()))
    if len(everything) == 0:
        axes.text(0.5, 0.5, "no change", transform=axes.transAxes, ha="center")
        return
    edges = np.geomspace(everything.min(), everything.max() * (1 + 1e-9), _BINS)
    for name, (values, color) in kinds.items():
        known = values > 0
        weights = 100 * areas[known] / areas.sum()
        axes.hist(
            sizes[name],
            edges.tolist(),
            weights=weights,
            histtype="stepfilled",
            color=color,
            label=name,
            alpha=0.75,
        )
    axes.set_xscale("log")
    axes.set_xlabel("mean change, % of the mean signature")
    axes.set_ylabel("part of the area, %")
    axes.legend(frameon=False, fontsize=8)
    calm(axes)


def _places(result: Comparison) -> tuple[Floats, str]:
    """The columns as lengths where they are times, and the axis' name."""
    kind = result.methods.kind
    if kind.per_time:
        return diffusion_radius(result.columns), "diffusion radius 2√t (length)"
    return result.columns, kind.axis


def _group_curves(axes: Axes, view: View) -> None:
    result = view.result
    columns, name = _places(result)
    labels, count = result.clusters.labels, len(result.clusters.centers)
    axes.axhline(0, color="#888888", lw=0.8)
    for group, color in enumerate(group_colors(count)):
        rows = 100 * result.change[labels == group]
        if len(rows) == 0:
            continue
        low, middle, high = np.quantile(rows, (_BAND[0], 0.5, _BAND[1]), axis=0)
        axes.fill_between(columns, low, high, color=tuple(color), alpha=0.3, lw=0)
        axes.plot(columns, middle, color=tuple(color), lw=2, label=f"group {group}")
    axes.set_xlabel(name)
    axes.set_ylabel(f"change, % of mean {result.methods.kind.abbreviation}")
    _columns_axis(axes, result, columns)
    if count:
        axes.legend(frameon=False, fontsize=8)
    calm(axes)


def _columns_axis(axes: Axes, result: Comparison, columns: Floats) -> None:
    if result.methods.kind.logarithmic:
        axes.set_xscale("log")
        round_ticks(axes.xaxis)
    if len(columns) > 1:
        axes.set_xlim(columns[0], columns[-1])


def _heat_map(figure: Figure, view: View) -> None:
    """The median change of each group at each column."""
    axes = _plot(figure, 1, 1, "e", "At which scale each group changed")
    result = view.result
    columns, name = _places(result)
    labels = result.clusters.labels
    shown = [g for g in range(len(result.clusters.centers)) if (labels == g).any()]
    if not shown:
        axes.text(0.5, 0.5, "no group", transform=axes.transAxes, ha="center")
        axes.set_axis_off()
        return
    values = np.array([100 * np.median(result.change[labels == g], axis=0) for g in shown])
    limit = float(np.abs(values).max()) or 1.0
    axes.pcolormesh(
        _edges(columns, result.methods.kind.logarithmic),
        np.arange(len(shown) + 1),
        values,
        cmap=paint.MOVE_MAP,
        vmin=-limit,
        vmax=limit,
    )
    axes.set_yticks(np.arange(len(shown)) + 0.5, [f"group {g}" for g in shown])
    axes.invert_yaxis()
    axes.set_xlabel(name)
    _columns_axis(axes, result, columns)
    axes.spines[:].set_visible(False)
    left = _LEFT[1] + 0.045
    box = (left + 0.10, _BELOW[1] + _HEIGHT + 0.004, _WIDTH - 0.145, 0.009)
    bar = figure.add_axes(box)
    bar.imshow(np.linspace(0, 1, 64)[None], cmap=paint.MOVE_MAP, aspect="auto")
    bar.set_axis_off()
    middle = box[1] + box[3] / 2
    figure.text(
        box[0] - 0.004, middle, f"−{percent(limit / 100)}", size=7.5, ha="right", va="center"
    )
    figure.text(box[0] + box[2] + 0.004, middle, percent(limit / 100), size=7.5, va="center")


def _edges(columns: Floats, logarithmic: bool) -> Floats:
    """Borders (T + 1,) half way between the columns."""
    values = np.log(columns) if logarithmic else columns
    if len(values) == 1:
        edges = values[0] + np.array([-0.5, 0.5])
    else:
        middle = (values[1:] + values[:-1]) / 2
        edges = np.concatenate([[2 * values[0] - middle[0]], middle, [2 * values[-1] - middle[-1]]])
    borders: Floats = np.exp(edges) if logarithmic else edges
    return borders


def _spectrum(axes: Axes, result: Comparison) -> None:
    """Relative change of each eigenvalue."""
    base, perturbed = result.base_pairs.values, result.perturbed_pairs.values
    some = base > 1e-9 * base[-1]
    numbers = np.arange(1, len(base) + 1)[some]
    moved = 100 * (perturbed[some] / base[some] - 1)
    axes.axhline(0, color="#888888", lw=0.8)
    axes.plot(numbers, moved, ".", ms=3, color=INK)
    axes.set_xlabel("number of the eigenvalue")
    axes.set_ylabel("change, %")
    calm(axes)
