"""Figures 4.11 and 4.12: weighted graph Laplacian against finite elements."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec

from ..laplacian import knn_graph
from ..meshing import distmesh
from ._drawing import COLORS, curve_axes, draw_surface, grid, new_figure
from ._judged import (
    PERCENT,
    Judged,
    between_valences,
    common_top,
    curved,
    draw_histogram,
    draw_spikes,
    error_bar,
    error_colors,
    exact_histogram,
    flat,
    in_pieces,
    judge,
    mean_norm,
    reach,
)
from ._pair_norms import modes, transport
from ._records import Experiment, Finding, Outcome, Settings, Verdict
from ._spheroid import Spheroid, spheroid, spheroid_field

_TITLE = "Graph Laplacian against finite elements"
_MUCH = 2.0
"""How many times smaller an error must be to be called much smaller."""

_COLORS = (COLORS[1], COLORS[0], COLORS[2])
_NAMES, _SIDES = ("graph", "flat", "curved"), ("left", "right", "right")
_LOOK = np.array([1.0, 0.0, 0.25])


def run(settings: Settings) -> Outcome:
    """Three operators on two shapes, judged by the exact signature."""
    shapes = {
        name: (truth, _operators(truth, settings))
        for name, truth in (
            ("ellipsoid", spheroid(settings["half_axis"], settings["pairs"], settings["times"])),
            ("sphere", spheroid(1.0, settings["pairs"], settings["times"])),
        )
    }
    truth, judged = shapes["ellipsoid"]
    top = common_top(truth, judged)
    findings = (
        _two_modes(truth, judged, top, settings),
        _spike(shapes["sphere"][1]),
        _one_mode(shapes["sphere"][1]),
        _accurate(truth, judged, top),
    )
    return Outcome(findings, _draw(truth, judged, shapes["sphere"][1], top, settings))


def _operators(truth: Spheroid, settings: Settings) -> list[Judged]:
    """Graph, flat and curved elements on one DistMesh mesh."""
    field = spheroid_field(truth.half_axis, settings["spacing"])
    mesh = flat(distmesh(field, 0.0, vertices=settings["vertices"], order=1))
    graph = partial(knn_graph, neighbours=settings["neighbours"])
    fine = curved(mesh, truth.half_axis)
    return [
        judge("weighted graph", mesh, truth, settings["pairs"], graph),
        judge("flat linear elements", mesh, truth, settings["pairs"]),
        judge("curved elements (isovary)", fine, truth, settings["pairs"]),
    ]


def _two_modes(
    truth: Spheroid, judged: Sequence[Judged], top: float, settings: Settings
) -> Finding:
    exact = modes(exact_histogram(truth, top))
    found = [modes(one.histogram(top)) for one in judged]
    all_shapes = []
    for aspect in settings["aspects"]:
        other = spheroid(aspect, settings["pairs"], settings["times"])
        all_shapes.append(modes(exact_histogram(other, common_top(other, []))))
    words = ", ".join(f"{one.name} {count}" for one, count in zip(judged, found, strict=True))
    span = f"1:1:{min(settings['aspects']):g} to 1:1:{max(settings['aspects']):g}"
    return Finding(
        "For an ellipsoid the histogram has two modes, since its ends and its middle have "
        "different curvatures",
        "4.2.3, Fig 4.11",
        f"The exact histogram of the 1:1:{truth.half_axis:g} ellipsoid has {exact} mode, at 0: "
        "curvature changes gradually, so there are pairs of every norm, fewer the larger it is. "
        f"At most {max(all_shapes)} in {len(all_shapes)} spheroids from {span}. Modes found: "
        f"{words}. A second mode would be an error of the operator, or two kinds of points that "
        "were chosen.",
        Verdict.REFUTED if exact == max(all_shapes) == 1 else Verdict.IN_PART,
        {"exact": exact, "most": max(all_shapes)}
        | dict(zip(("graph", "linear", "curved"), found, strict=True)),
    )


def _spike(judged: Sequence[Judged]) -> Finding:
    graph, linear, fine = (mean_norm(one) for one in judged)
    return Finding(
        "On a sphere, where all HKS vectors are identical, the graph Laplacian does not "
        "approximate the ideal spike as well as FEM",
        "4.2.3, Fig 4.12",
        f"Mean norm of all pairs, exactly 0: graph {graph:.2g} %, flat linear elements "
        f"{linear:.2g} %, {graph / linear:.2g} times less; curved elements {fine:.2g} %, another "
        f"{linear / fine:.2g} times less.",
        Verdict.CONFIRMED if graph > _MUCH * linear else Verdict.REFUTED,
        {"graph": graph, "linear": linear, "curved": fine},
    )


def _one_mode(judged: Sequence[Judged]) -> Finding:
    linear = judged[1]
    found = modes(linear.histogram(105 * reach(linear.rows)))
    inside, across = between_valences(linear)
    return Finding(
        "The sphere's histogram by FEM has just one mode",
        "4.2.3, Fig 4.12",
        f"Flat linear elements: {found} mode(s). Their errors depend on how many triangles meet "
        f"at a vertex: two vertices with six differ by {inside:.2g} % on average, one with six "
        f"from one with five or seven by {across:.2g} %. This is the mesh, not the shape.",
        Verdict.CONFIRMED if found == 1 else Verdict.REFUTED,
        {"modes": found, "inside": inside, "across": across},
    )


def _accurate(truth: Spheroid, judged: Sequence[Judged], top: float) -> Finding:
    exact = exact_histogram(truth, top)
    shifts = [transport(one.histogram(top), exact, top) for one in judged]
    errors = [one.error for one in judged]
    names = ("graph", "linear", "curved")
    return Finding(
        "FEM is much more reliable than the graph Laplacian and produces much more accurate HKS",
        "4.2.3",
        "Error of the vectors on the ellipsoid, rms: "
        + ", ".join(f"{one.name} {one.error:.2g} %" for one in judged)
        + ". Distance of the histogram from the exact one (W1): "
        + ", ".join(f"{shift:.2g} %" for shift in shifts)
        + f"; all of the mean HKS vector's length. Flat elements are better by "
        f"{errors[0] / errors[1]:.2g}, curved ones on the same triangles by another "
        f"{errors[1] / errors[2]:.2g}.",
        Verdict.CONFIRMED if errors[0] > _MUCH * errors[1] else Verdict.IN_PART,
        {f"error_{n}": e for n, e in zip(names, errors, strict=True)}
        | {f"shift_{n}": s for n, s in zip(names, shifts, strict=True)},
    )


def _draw(
    truth: Spheroid,
    judged: Sequence[Judged],
    sphere: Sequence[Judged],
    top: float,
    settings: Settings,
) -> Figure:
    count = modes(exact_histogram(truth, top))
    message = (
        f"HKS vectors of the graph are {judged[0].error:.2g} % off the exact ones, of flat "
        f"elements {judged[1].error:.2g} %, of curved ones {judged[2].error:.1g} %; modes of the "
        f"ellipsoid's exact histogram: {count}"
    )
    figure = new_figure("4.11, 4.12", _TITLE, message, 5.6)
    cells = grid(
        figure, 1, 6, below=0.95, left=0.01, width_ratios=[0.8, 0.8, 0.8, 0.2, 2, 2], wspace=0.2
    )
    low = 10 ** np.floor(np.log10(np.median(judged[2].errors)))
    high = 10 ** np.ceil(np.log10(np.median(judged[0].errors)))
    for cell, one, name in zip(cells, judged, _NAMES, strict=False):
        caption = f"{name}: {one.error:.2g} %"
        shown = draw_surface(
            figure,
            cell,
            in_pieces(one.surface),
            error_colors(one.errors, low, high),
            caption,
            towards=_LOOK,
        )
        if name == "flat":
            error_bar(shown, low, high)
    _draw_pairs(figure, cells[4], truth, judged, top)
    caption = "Sphere: exactly, all differences are 0"
    axes = curve_axes(figure, cells[5], caption, PERCENT, "pairs (% per bin)")
    draw_spikes(axes, sphere, 30, zip(_COLORS, _NAMES, _SIDES, strict=True))
    return figure


def _draw_pairs(
    figure: Figure, cell: SubplotSpec, truth: Spheroid, judged: Sequence[Judged], top: float
) -> None:
    axes = curve_axes(
        figure,
        cell,
        f"Ellipsoid 1:1:{truth.half_axis:g}: pairs of HKS vectors",
        PERCENT,
        "pairs (% per bin)",
    )
    draw_histogram(
        axes, exact_histogram(truth, top), top, color="#d0d0d0", fill=True, label="exact"
    )
    for one, color in zip(judged, _COLORS, strict=True):
        draw_histogram(axes, one.histogram(top), top, color=color, lw=1.6, label=one.name)
    axes.set_xlim(0, top)
    axes.legend(frameon=False)


EXPERIMENT = Experiment("4.11", _TITLE, run, also=("4.12",))
