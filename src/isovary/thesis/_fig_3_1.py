"""Figure 3.1: signatures on a dimple and away from it, and what tells them apart."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ..deform import dimple
from ..geometry import Floats
from ..records import Surface
from ..shapes import icosphere
from ..signature import heat_kernel, implied_curvature
from ._drawing import COLORS, curve_axes, grid, logarithmic, new_figure
from ._panels import draw_values
from ._records import Experiment, Finding, Outcome, Settings, Verdict
from ._steps import Signed, signed
from ._thesis_way import flattened

_TITLE = "The signature on a dimple and away from it"
_SEEN = 0.05  # of the signature: two curves that a plot tells apart
_NEAR = 0.1  # of a curvature: the next term of the series makes so much of it
_EXACT = 1e-10


def run(settings: Settings) -> Outcome:
    """Signatures at the tip of a dimple and opposite it, by curved and by flat elements."""
    sphere = icosphere(settings["subdivisions"])
    tip = np.array([0.0, 0.0, 1.0])
    surface = dimple(sphere, tip, settings["dimple_radius"], alpha=settings["dimple_alpha"])
    nodes = [int(np.linalg.norm(sphere.points - place, axis=1).argmin()) for place in (tip, -tip)]
    curved = signed(surface, settings["pairs"], settings["times"])
    coarse = flattened(surface)
    flat = signed(coarse, settings["pairs"], curved.times)
    of_flat = [
        int(np.linalg.norm(coarse.points - surface.points[node], axis=1).argmin()) for node in nodes
    ]
    bent = np.array([_curvature(surface, nodes[0], settings["fitted"]), 1.0])
    curves = curved.signature[nodes]
    findings = (
        _apart(curved.times, curves),
        _curvatures(curved, curves, flat.signature[of_flat], bent),
        _symmetric(curved, nodes),
    )
    return Outcome(findings, _draw(curved, curves))


def _curvature(surface: Surface, node: int, radius: float) -> float:
    """Gaussian curvature at a tip with the z axis around it: z = a + b r^2 + c r^4, K = 4 b^2.

    From the nodes' places alone.
    """
    distance = np.hypot(*(surface.points - surface.points[node])[:, :2].T)
    near = (distance < radius) & (surface.points[:, 2] > 0)
    slope = np.polyfit(distance[near] ** 2, surface.points[near, 2], 2)[1]
    return float(4 * slope**2)


def _apart(times: Floats, curves: Floats) -> Finding:
    apart = np.abs(curves[0] / curves[1] - 1)
    early, late = float(apart[0]), float(apart[-1])
    return Finding(
        "A point on a dimple and one away from it have different vectors",
        "3.1.3, Fig 3.1",
        f"They differ by {100 * early:.2g} % at the smallest time, which sees a radius of "
        f"{2 * times[0] ** 0.5:.2f}, by at most {100 * apart.max():.2g} %, and by "
        f"{100 * late:.1g} % at the largest, which sees the whole surface.",
        Verdict.CONFIRMED if apart.max() > _SEEN > late else Verdict.REFUTED,
        {"early": early, "late": late, "most": float(apart.max())},
    )


def _curvatures(curved: Signed, curves: Floats, flat: Floats, bent: Floats) -> Finding:
    """At a little above the smallest time 4 pi t HKS = 1 + K t / 3 + O(t^2)."""
    near = int(np.searchsorted(curved.times, 1.25 * curved.times[0]))
    read = implied_curvature(curves, curved.times)[:, near]
    coarse = implied_curvature(flat, curved.times)[:, near]
    good = bool((np.abs(read / bent - 1) < _NEAR).all())
    return Finding(
        "The signature captures the intrinsic geometry around the point",
        "1, 3.1.2",
        f"Gaussian curvature read off at t = {curved.times[near]:.3f}: {read[1]:.2f} away from "
        f"the dimple (exact: 1; flat elements: {coarse[1]:.2f}), {read[0]:.2f} on its tip (by a "
        f"parabola through the nodes: {bent[0]:.2f}; flat elements: {coarse[0]:.2f}), blurred "
        f"over the radius {2 * curved.times[near] ** 0.5:.2f}.",
        Verdict.CONFIRMED if good else Verdict.IN_PART,
        {
            "away": float(read[1]),
            "tip": float(read[0]),
            "tip_exact": float(bent[0]),
            "away_flat": float(coarse[1]),
            "tip_flat": float(coarse[0]),
        },
    )


def _symmetric(curved: Signed, nodes: list[int]) -> Finding:
    times = curved.times[[0, len(curved.times) // 2, -1]]
    kernel = heat_kernel(curved.pairs, times, nodes)
    there, back = kernel[nodes[1], 0], kernel[nodes[0], 1]
    error = float(np.abs(there - back).max() * curved.pairs.area)
    return Finding(
        "The heat kernel is symmetric",
        "3.1.1",
        f"From the tip to the other side and back, at three times: equal to {error:.0e} of the "
        "final value, 1 / area. A sum over eigenfunctions is so by construction, if the operator's "
        "matrices are symmetric.",
        Verdict.CONFIRMED if error < _EXACT else Verdict.REFUTED,
        {"error": error},
    )


def _draw(curved: Signed, curves: Floats) -> Figure:
    apart = 100 * (curves[0] / curves[1] - 1)
    message = (
        f"On the dimple the signature departs by up to {np.abs(apart).max():.2g} % from that "
        f"opposite it, and by {abs(apart[-1]):.1g} % once heat has seen the whole surface"
    )
    figure = new_figure("3.1", _TITLE, message)
    cells = grid(figure, 1, 3, wspace=0.28, below=0.75)
    first = 100 * (4 * np.pi * curved.times[0] * curved.signature[:, 0] - 1)
    limit = float(np.abs(first).max())
    draw_values(
        figure,
        cells[0],
        curved.surface,
        first,
        limit,
        "At the smallest time",
        "HKS above that of a plane (%)",
        towards=np.array([0.0, -1.0, 0.25]),
        signed=True,
    )
    axes = curve_axes(figure, cells[1], "Both signatures", "time (length²)", "HKS (1/length²)")
    for curve, name, color in zip(curves, ("on the dimple", "away"), COLORS[1::-1], strict=True):
        axes.plot(curved.times, curve, color=color, label=name)
    area = 1 / curved.pairs.area
    axes.axhline(area, color="#888888", lw=0.8, ls="--", label="1 / area")
    logarithmic(axes)
    axes.legend(frameon=False, fontsize=9)
    axes = curve_axes(
        figure, cells[2], "Against a plane's 1 / 4πt", "time (length²)", "4πt HKS − 1 (%)"
    )
    early = curved.times < 0.5
    times = curved.times[early]
    for curve, name, color in zip(curves, ("on the dimple", "away"), COLORS[1::-1], strict=True):
        axes.plot(times, 100 * (4 * np.pi * times * curve[early] - 1), color=color, label=name)
    axes.plot(times, 100 * times / 3, color="#888888", ls="--", label="K t / 3, K = 1")
    logarithmic(axes, y=False)
    axes.set_ylim(-2, 130 * float((4 * np.pi * curved.times * curves - 1)[:, early].max()))
    axes.legend(frameon=False, fontsize=9)
    return figure


EXPERIMENT = Experiment("3.1", _TITLE, run)
