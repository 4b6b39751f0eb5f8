"""Figure 5.1: the dimple maker, its projectile, region, decay and motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec

from ..geometry import Floats
from ..records import Surface
from ..shapes import icosphere
from ..view._paint import NORM_MAP
from ._drawing import COLORS, curve_axes, draw_surface, grid, logarithmic, new_figure
from ._irregular import polar_dimple
from ._records import Experiment, Finding, Outcome, Settings, Verdict

_TITLE = "The dimple maker"
_EQUAL = 1e-12  # places that differ by no more than rounding
_DECAY = 0.35  # of a region's force, in radii
_FINAL = 0.02  # relative: a few steps are enough


def run(settings: Settings) -> Outcome:
    """Push one pole in and draw it out, on meshes ever finer and in steps ever shorter."""
    refined = _refined(settings)
    spheres = [icosphere(count, order=1) for count in settings["subdivisions"]]
    pushed, drawn = (_dimpled(spheres[-1], sign, settings) for sign in (1, -1))
    depths = np.array([_depth(spheres[0], settings, steps) for steps in settings["steps"]])
    findings = (
        _insensitive(refined, settings),
        _local(spheres[-1], pushed, settings),
        _both_ways(pushed, drawn),
        _few_steps(depths, settings["steps"]),
        _law(settings),
    )
    figure = _draw(spheres[-1], (pushed, drawn), refined, depths, settings)
    return Outcome(findings, figure)


def _dimpled(surface: Surface, sign: int, settings: Settings, steps: int = 20) -> Surface:
    radius = settings["dimple_radius"]
    return polar_dimple(surface, 1.0, radius, sign * settings["alpha"], steps=steps)


def _depth(surface: Surface, settings: Settings, steps: int) -> float:
    tip = int(surface.points[:, 2].argmax())
    return float(1 - _dimpled(surface, 1, settings, steps).points[tip, 2])


def _refined(settings: Settings) -> Floats:
    """For each mesh, how far its coarsest nodes arrive from where those of the first do."""
    first: Floats | None = None
    apart = []
    for count in settings["subdivisions"]:
        sphere = icosphere(count, order=1)
        moved = _dimpled(sphere, 1, settings).points
        first = (
            moved if first is None else first
        )  # an icosphere's first nodes are the coarser one's
        apart.append(float(np.abs(moved[: len(first)] - first).max()))
    return np.array(apart)


def _within(refined: Floats) -> str:
    worst = float(refined.max())
    return f"within {worst:.1g} of one another" if worst else "at exactly the same places"


def _insensitive(refined: Floats, settings: Settings) -> Finding:
    worst = float(refined.max())
    counts = [10 * 4**count + 2 for count in settings["subdivisions"]]
    return Finding(
        "The perturbation is insensitive to mesh refinement: edges have no effect on it",
        "5.1",
        f"From {counts[0]} to {counts[-1]} vertices, the {counts[0]} in common arrive "
        f"{_within(refined)}: a node's way depends on its own place alone.",
        Verdict.CONFIRMED if worst < _EQUAL else Verdict.REFUTED,
        {"worst": worst},
    )


def _local(sphere: Surface, pushed: Surface, settings: Settings) -> Finding:
    radius = settings["dimple_radius"]
    away = np.linalg.norm(sphere.points - [0, 0, 1], axis=1)
    moved = np.linalg.norm(pushed.points - sphere.points, axis=1)
    outside, most = float(moved[away >= radius].max()), float(moved.max())
    cliff = float(np.exp(-1 / _DECAY**2))
    return Finding(
        "Only the vertices in the circled region move, less and less away from its centre",
        "5.1, Fig 5.1",
        f"Outside the radius nothing moves (at most {outside:.1g}), inside up to {most:.2g}. The "
        f"decay alone would leave {cliff:.1g} of the central force at the border, a cliff; our "
        "window brings it to 0.",
        Verdict.CONFIRMED if outside == 0 and _falls(away, moved) else Verdict.REFUTED,
        {"outside": outside, "most": most, "cliff": cliff},
    )


def _falls(away: Floats, moved: Floats) -> bool:
    """Whether no node moves farther than one that is nearer to the centre."""
    order = np.argsort(away)
    return bool((np.diff(moved[order]) <= _EQUAL).all())


def _both_ways(pushed: Surface, drawn: Surface) -> Finding:
    inward, outward = (1 - float(s.points[s.points[:, :2].any(axis=1) == 0, 2].max()) for s in
                       (pushed, drawn))  # fmt: skip
    return Finding(
        "Vertices are pushed in or out, depending on the sign of charge",
        "5.1, Fig 5.1",
        f"The same strength pushes the tip in by {inward:.3g} and draws it out by "
        f"{-outward:.3g}: farther, for it comes nearer to the projectile.",
        Verdict.CONFIRMED if inward > 0 > outward else Verdict.REFUTED,
        {"inward": inward, "outward": -outward},
    )


def _few_steps(depths: Floats, steps: Sequence[int]) -> Finding:
    limit = float(2 * depths[-1] - depths[-2])
    errors = np.abs(depths / limit - 1)
    words = ", ".join(f"{100 * e:.2g} % with {n}" for e, n in zip(errors, steps, strict=True))
    twenty = float(errors[list(steps).index(20)])
    return Finding(
        "The simulation is run for a few steps",
        "Fig 5.1",
        f"That is enough: the depth is off its limit by {words}; the error is of first order.",
        Verdict.CONFIRMED if twenty < _FINAL else Verdict.REFUTED,
        {"limit": limit, "error_20": twenty, "ratio": float(errors[0] / errors[1])},
    )


def _law(settings: Settings) -> Finding:
    return Finding(
        "The force is alpha q_i q_p exp(-d_i) / r^2 along the vector to the projectile",
        "5.1",
        "As printed, the direction makes equal charges attract. The decay d_i depends on the "
        "distance to the projectile in the text, to the circle's centre in the caption, and is "
        "given in neither; nor are flight, time step and charges. We take the caption's, "
        "d = (s / 0.35 R)^2, and let equal charges repel.",
        Verdict.OPEN,
        {"alpha": settings["alpha"]},
    )


def _draw(
    sphere: Surface,
    both: tuple[Surface, Surface],
    refined: Floats,
    depths: Floats,
    settings: Settings,
) -> Figure:
    message = (
        f"A projectile pushes a tip in by {depths[-1]:.2g} or draws it out; nodes that meshes have "
        f"in common arrive {_within(refined)}, and nothing outside the region moves"
    )
    figure = new_figure("5.1", _TITLE, message, height=8.4)
    cells = grid(figure, 2, 3, wspace=0.28, hspace=0.34)
    _draw_section(figure, cells[0], settings)
    for cell, surface, name in zip(cells[1:3], both, ("pushed in", "drawn out"), strict=True):
        moved = np.linalg.norm(surface.points - sphere.points, axis=1)
        colors = NORM_MAP(moved / moved.max())[:, :3]
        words = f"{name}; bright moved most, {moved.max():.2g}"
        draw_surface(figure, cell, surface, colors, words, towards=np.array([1, -0.6, 0.9]))
    _draw_weights(figure, cells[3])
    _draw_refined(figure, cells[4], sphere, both[0], settings)
    _draw_steps(figure, cells[5], depths, settings["steps"])
    return figure


def _draw_section(figure: Figure, cell: SubplotSpec, settings: Settings) -> Axes:
    """The meridian at rest and after each charge, the flight, and the region."""
    axes = curve_axes(
        figure, cell, "A section: flight, region and motion", "x (radii)", "z (radii)"
    )
    radius = settings["dimple_radius"]
    angles = np.linspace(-1.3, 1.3, settings["arc"])
    points = np.column_stack([np.sin(angles), np.zeros_like(angles), np.cos(angles)])
    strip = _strip(points)
    axes.plot(points[:, 0], points[:, 2], color="0.6", lw=1.2, label="at rest")
    for sign, color, name in ((1, COLORS[0], "pushed in"), (-1, COLORS[1], "drawn out")):
        moved = _dimpled(strip, sign, settings).points[: len(points)]
        axes.plot(moved[:, 0], moved[:, 2], color=color, lw=1.8, label=name)
    ring = points[np.linalg.norm(points - [0, 0, 1], axis=1) < radius]
    axes.plot(ring[[0, -1], 0], ring[[0, -1], 2], "|", ms=16, color=COLORS[6], mew=2)
    axes.annotate(
        "", (0, 1 + 0.5 * radius), (0, 1 + radius),
        arrowprops={"arrowstyle": "-|>", "color": COLORS[3], "lw": 2},
    )  # fmt: skip
    axes.plot(0, 1 + radius, "o", color=COLORS[3], label="projectile")
    axes.text(0, ring[-1, 2], "region between the bars", size=9, ha="center", va="center")
    axes.set_aspect("equal")
    axes.set_ylim(0.15, 2.15)
    axes.legend(frameon=False, fontsize=8.5, loc="upper left")
    return axes


def _strip(points: Floats) -> Surface:
    """A narrow strip of triangles along places on a curve."""
    shifted = points + np.array([0, 1e-3, 0])
    k = np.arange(len(points) - 1)
    n = len(points)
    lower, upper = np.stack([k, k + n, k + 1], 1), np.stack([k + 1, k + n, k + n + 1], 1)
    return Surface(np.vstack([points, shifted]), np.vstack([lower, upper]))


def _draw_weights(figure: Figure, cell: SubplotSpec) -> None:
    axes = curve_axes(
        figure, cell, "Decay of the force", "distance from the centre (radii)", "part of the force"
    )
    s = np.linspace(0, 1.2, 200)
    decay = np.exp(-((s / _DECAY) ** 2))
    axes.plot(s, np.where(s < 1, decay, 0), color=COLORS[1], ls="--", label="exp(-d), cut")
    smooth = decay * np.clip(1 - s**2, 0, None) ** 2
    axes.plot(s, smooth, color=COLORS[0], lw=1.8, label="with our window")
    axes.set_yscale("log")
    axes.set_ylim(1e-6, 2)
    axes.legend(frameon=False)


def _draw_refined(
    figure: Figure, cell: SubplotSpec, finest: Surface, pushed: Surface, settings: Settings
) -> None:
    axes = curve_axes(
        figure,
        cell,
        "Every mesh samples the same motion",
        "distance from the centre (radii)",
        "moved (radii)",
    )
    radius = settings["dimple_radius"]
    for surface, marker, color, count in (
        (icosphere(settings["subdivisions"][0], order=1), "o", COLORS[1], 0),
        (finest, ".", COLORS[0], -1),
    ):
        arrived = pushed if surface is finest else _dimpled(surface, 1, settings)
        away = np.linalg.norm(surface.points - [0, 0, 1], axis=1) / radius
        moved = np.linalg.norm(arrived.points - surface.points, axis=1) / radius
        near = away < 1.25
        size, top = (7, 2) if marker == "o" else (3, 1)
        vertices = 10 * 4 ** settings["subdivisions"][count] + 2
        axes.plot(away[near], moved[near], marker, ms=size, color=color, zorder=top,
                  mfc="none" if marker == "o" else color, label=f"{vertices} vertices")  # fmt: skip
    axes.legend(frameon=False)


def _draw_steps(figure: Figure, cell: SubplotSpec, depths: Floats, steps: Sequence[int]) -> None:
    caption = "The same time in more, smaller steps"
    axes = curve_axes(figure, cell, caption, "number of steps", "error of the depth (%)")
    limit = 2 * depths[-1] - depths[-2]
    axes.plot(steps, 100 * np.abs(depths / limit - 1), "o-", color=COLORS[0])
    logarithmic(axes)


EXPERIMENT = Experiment("5.1", _TITLE, run)
