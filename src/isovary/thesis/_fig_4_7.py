"""Figures 4.7 and 4.8: histograms on meshes of marching cubes and of DistMesh."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from ..meshing import contour, curvature_sizing, distmesh, marching_cubes
from ._drawing import COLORS, curve_axes, draw_surface, grid, new_figure
from ._judged import (
    PERCENT,
    Judged,
    common_top,
    draw_histogram,
    draw_spikes,
    error_bar,
    error_colors,
    exact_histogram,
    in_pieces,
    judge,
    mean_norm,
)
from ._pair_norms import modes, transport
from ._records import Experiment, Finding, Outcome, Settings, Verdict
from ._spheroid import Spheroid, spheroid, spheroid_field

_TITLE = "HKS vectors on meshes of marching cubes and DistMesh"
_MUCH = 2.0
"""How many times smaller a spread must be to be called a spike beside the other."""

_NOISIER = 1.1
_NAMES, _SHORT = (
    ("marching cubes", "DistMesh", "isovary's default"),
    ("cubes", "distmesh", "curved"),
)
_CAPTIONS, _SIDES = ("cubes", "DistMesh", "isovary"), ("left", "right", "right")
_COLORS = (COLORS[1], COLORS[0], COLORS[2])
_LOOK = np.array([1.0, 0.0, 0.25])


def run(settings: Settings) -> Outcome:
    """Flat elements on the thesis's meshes and curved ones on the default one, on two shapes."""
    truth = spheroid(settings["half_axis"], settings["pairs"], settings["times"])
    ellipsoid = _meshed(truth, settings)
    sphere = _meshed(spheroid(1.0, settings["pairs"], settings["times"]), settings)
    top = common_top(truth, ellipsoid)
    findings = (_spike(sphere), _noisier(truth, ellipsoid, top), _recommended(ellipsoid, sphere))
    return Outcome(findings, _draw(truth, ellipsoid, sphere, top))


def _meshed(truth: Spheroid, settings: Settings) -> list[Judged]:
    field = spheroid_field(truth.half_axis, settings["spacing"])
    raw = contour(field, 0.0)
    count = len(raw.points)
    meshes = (
        raw,
        distmesh(field, 0.0, vertices=count, sizing=curvature_sizing, order=1),
        marching_cubes(field, 0.0, vertices=count),
    )
    return [
        judge(name, mesh, truth, settings["pairs"])
        for name, mesh in zip(_NAMES, meshes, strict=True)
    ]


def _spike(sphere: Sequence[Judged]) -> Finding:
    means = [mean_norm(one) for one in sphere]
    return Finding(
        "On a sphere the mesh of DistMesh approximates a spike, that of marching cubes does not",
        "4.2.1, Fig 4.8",
        f"Mean norm of all pairs, exactly 0: marching cubes {means[0]:.2g} %, DistMesh "
        f"{means[1]:.2g} %, {means[0] / means[1]:.2g} times less; curved elements on the default "
        f"mesh {means[2]:.2g} %.",
        Verdict.CONFIRMED
        if means[0] > _MUCH * means[1]
        else Verdict.IN_PART
        if means[0] > _NOISIER * means[1]
        else Verdict.REFUTED,
        dict(zip(_SHORT, means, strict=True)),
    )


def _noisier(truth: Spheroid, judged: Sequence[Judged], top: float) -> Finding:
    exact = exact_histogram(truth, top)
    shifts = [transport(one.histogram(top), exact, top) for one in judged]
    found = [modes(one.histogram(top)) for one in judged]
    worst = [float(np.quantile(one.errors, 0.99)) for one in judged]
    errors = [one.error for one in judged]
    return Finding(
        "The mesh of marching cubes has noisier HKS vectors",
        "4.2.1, Fig 4.7",
        "Error on the ellipsoid, rms and at the worst percent of the nodes: "
        + ", ".join(
            f"{one.name} {one.error:.2g} and {far:.2g} %"
            for one, far in zip(judged, worst, strict=True)
        )
        + f". Modes of the histograms: {found[0]}, {found[1]} and {found[2]}, of the exact one "
        f"{modes(exact)}.",
        Verdict.CONFIRMED if errors[0] > _NOISIER * errors[1] else Verdict.REFUTED,
        {f"error_{n}": e for n, e in zip(_SHORT, errors, strict=True)}
        | {f"worst_{n}": e for n, e in zip(_SHORT, worst, strict=True)}
        | {f"shift_{n}": e for n, e in zip(_SHORT, shifts, strict=True)},
    )


def _recommended(ellipsoid: Sequence[Judged], sphere: Sequence[Judged]) -> Finding:
    ratios = [judged[0].error / judged[1].error for judged in (ellipsoid, sphere)]
    gains = [judged[1].error / judged[2].error for judged in (ellipsoid, sphere)]
    return Finding(
        "Curvature-sensitive meshing is recommended as opposed to marching cubes",
        "4.3",
        f"Flat elements on marching cubes err {ratios[0]:.2g} times as much as on DistMesh's mesh "
        f"of the ellipsoid, and {ratios[1]:.2g} times on the sphere, where no curvature varies: it "
        "is the triangles' shape that helps. Curved elements on marching cubes remeshed gain "
        f"{gains[0]:.2g} and {gains[1]:.2g} times more.",
        Verdict.CONFIRMED if min(ratios) > _NOISIER else Verdict.REFUTED,
        {"ellipsoid": ratios[0], "sphere": ratios[1], "gain": min(gains)},
    )


def _draw(
    truth: Spheroid, ellipsoid: Sequence[Judged], sphere: Sequence[Judged], top: float
) -> Figure:
    means = [mean_norm(one) for one in sphere]
    message = (
        f"On the sphere pairs of HKS vectors differ by {means[0]:.2g} % on marching cubes, by "
        f"{means[1]:.2g} % on DistMesh, by {means[2]:.1g} % on curved elements; exactly, by 0"
    )
    figure = new_figure("4.7, 4.8", _TITLE, message, 5.6)
    cells = grid(
        figure, 1, 6, below=0.95, left=0.01, width_ratios=[0.8, 0.8, 0.8, 0.2, 2, 2], wspace=0.2
    )
    low = 10 ** np.floor(np.log10(np.median(ellipsoid[2].errors)))
    high = 10 ** np.ceil(np.log10(np.quantile(ellipsoid[0].errors, 0.9)))
    for cell, one, name in zip(cells, ellipsoid, _CAPTIONS, strict=False):
        colors = error_colors(one.errors, low, high)
        caption = f"{name}: {one.error:.2g} %"
        shown = draw_surface(figure, cell, in_pieces(one.surface), colors, caption, towards=_LOOK)
        if name == "DistMesh":
            error_bar(shown, low, high)
    caption = f"4.7: ellipsoid 1:1:{truth.half_axis:g}, all pairs"
    axes = curve_axes(figure, cells[4], caption, PERCENT, "pairs (% per bin)")
    exact = exact_histogram(truth, top)
    draw_histogram(axes, exact, top, color="#d0d0d0", fill=True, label="exact")
    for one, color in zip(ellipsoid, _COLORS, strict=True):
        draw_histogram(axes, one.histogram(top), top, color=color, lw=1.6, label=one.name)
    axes.set_xlim(0, top)
    axes.legend(frameon=False)
    caption = "4.8: sphere, exactly all are 0"
    axes = curve_axes(figure, cells[5], caption, PERCENT, "pairs (% per bin)")
    draw_spikes(axes, sphere, 10, zip(_COLORS, _CAPTIONS, _SIDES, strict=True))
    return figure


EXPERIMENT = Experiment("4.7", _TITLE, run, also=("4.8",))
