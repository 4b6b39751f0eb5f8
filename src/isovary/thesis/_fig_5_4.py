"""Figure 5.4: a moving dimple, and which of the four dimples can see a difference at all."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.artist import Artist
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ..correspondence import interpolate, normal_rays
from ..deform import Projectile, Region, shoot
from ..geometry import Floats, linear_triangles
from ..records import Surface
from ..shapes import icosphere
from ._drawing import COLORS, curve_axes, draw_line, draw_surface, logarithmic, new_figure
from ._gaussian_dimples import ring_around
from ._records import Experiment, Finding, Outcome, Settings, Verdict
from ._steps import signed

_TITLE = "A dimple that moves, seen from four dimples"
_TOWARDS = [0.3, 1.0, 0.6]
_SHOWN = 3.0  # times the mesh's error, which symmetry tells: a difference that is one
_NAMES = "abc"
_PAIRS = {"1 and 3": (0, 2), "2 and 4": (1, 3)}
_COLORS = {"1 and 3": COLORS[2], "2 and 4": COLORS[4]}
_DIMPLES = (COLORS[0], "#c8102e", COLORS[2], COLORS[4])  # the figure's blue, red, green, orange


def _poles(angle: float) -> Floats:
    """1 and 3 at the poles of the circle on which 2 and 4 lie."""
    moving = [-np.cos(angle), np.sin(angle), 0.0]
    return np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0], moving])


def _equator(angle: float) -> Floats:
    """All four on the circle."""
    moving = [-np.cos(angle), np.sin(angle), 0.0]
    return np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0], moving])


def _tetrahedron(angle: float) -> Floats:
    """At first the corners of a regular tetrahedron; 1 and 3 mirror one another in the circle."""
    half = np.arccos(-1 / 3) / 2
    c, s = np.cos(half), np.sin(half)
    moving = [np.cos(half - angle), np.sin(half - angle), 0.0]
    return np.array([[-c, 0.0, s], [c, -s, 0.0], [-c, 0.0, -s], moving])


_READINGS: Mapping[str, Callable[[float], Floats]] = {
    "1, 3 at the poles": _poles,
    "all on the equator": _equator,
    "tetrahedron": _tetrahedron,
}


@dataclass(frozen=True, eq=False)
class _Views:
    """Signatures (configurations, 4 dimples, T) at the tips, by reading, and the surfaces."""

    times: Floats
    tips: Mapping[str, Floats]
    surfaces: Mapping[str, list[Surface]]
    centers: Mapping[str, list[Floats]]

    def apart(self, reading: str, pair: str) -> Floats:
        """Largest relative difference of a pair's signatures in each configuration."""
        i, j = _PAIRS[pair]
        tips = self.tips[reading]
        worst: Floats = np.abs(tips[:, i] / tips[:, j] - 1).max(axis=1)
        return worst

    @property
    def noise(self) -> float:
        """The mesh's error: with 1 and 3 at the poles every pair is equal by reflection."""
        return max(float(self.apart(next(iter(self.tips)), pair).max()) for pair in _PAIRS)


def run(settings: Settings) -> Outcome:
    """The three configurations in three readings, with flat and with curved elements."""
    flat, curved = (_views(settings, order) for order in (1, 2))
    findings = (
        _all_equal_at_first(flat, curved),
        _fixed_pair(curved),
        _moving_pair(flat, curved),
        _fixed_pair_moves(curved),
    )
    return Outcome(findings, _draw(flat, curved))


def _views(settings: Settings, order: int) -> _Views:
    sphere = icosphere(settings["subdivisions"], order=order)
    times: int | Floats = settings["times"]
    tips: dict[str, Floats] = {}
    surfaces: dict[str, list[Surface]] = {}
    angles = np.radians(settings["angles"])
    centers = {reading: [places(a) for a in angles] for reading, places in _READINGS.items()}
    for reading, configurations in centers.items():
        rows = []
        surfaces[reading] = []
        for places in configurations:
            surface = _dimpled(sphere, places, settings["radius"], settings["alpha"])
            solved = signed(surface, settings["pairs"], times)
            times = solved.times
            rows.append(_at(sphere, places, solved.signature))
            surfaces[reading].append(surface)
        tips[reading] = np.array(rows)
    return _Views(np.asarray(times), tips, surfaces, centers)


def _dimpled(sphere: Surface, centers: Floats, radius: float, alpha: float) -> Surface:
    """Dimples whose projectiles fly along the true normals, whatever the mesh."""
    for center in centers:
        flight = Projectile((1 + radius) * center, (1 + radius / 2) * center)
        sphere = shoot(sphere, flight, Region(center, radius), alpha=alpha)
    return sphere


def _at(sphere: Surface, places: Floats, values: Floats) -> Floats:
    """Values (n, T) at places (4, 3) of the sphere that need not be nodes."""
    probe = Surface(places, np.array([[0, 1, 2], [0, 1, 3]]), places)
    return interpolate(normal_rays(probe, sphere), sphere, values)


def _all_equal_at_first(flat: _Views, curved: _Views) -> Finding:
    worst = []
    for views in (flat, curved):
        first = np.concatenate([tips[:1] for tips in views.tips.values()])
        worst.append(float(np.abs(first / first[:, :1] - 1).max()))
    return Finding(
        "Initially all four dimples generate almost identical vectors",
        "5.2.3, Fig 5.4(a)",
        f"In (a) the four differ by at most {100 * worst[1]:.1g} % at any time, in all readings "
        f"(flat elements: {100 * worst[0]:.1g} %).",
        Verdict.CONFIRMED if worst[1] < 0.01 else Verdict.REFUTED,
        {"flat": worst[0], "curved": worst[1]},
    )


def _fixed_pair(views: _Views) -> Finding:
    apart = {reading: views.apart(reading, "1 and 3") for reading in _READINGS}
    poles, equator, tetrahedron = (float(worst.max()) for worst in apart.values())
    return Finding(
        "Dimples 1 and 3 have almost identical vectors in all configurations",
        "5.2.3, Fig 5.4",
        f"Where the mirror that maps 1 to 3 keeps 2 and 4 they are equal to {100 * poles:.1g} % "
        f"(at the poles) and {100 * tetrahedron:.1g} % (tetrahedron). All on the equator, moving "
        f"4 parts them, by {100 * equator:.2g} %.",
        Verdict.CONFIRMED if poles < 1e-6 else Verdict.REFUTED,
        {"poles": poles, "equator": equator, "tetrahedron": tetrahedron, "noise": views.noise},
    )


def _moving_pair(flat: _Views, curved: _Views) -> Finding:
    numbers = {"noise": curved.noise, "noise_flat": flat.noise}
    fits = False
    for name, reading in zip(("poles", "equator", "tetrahedron"), _READINGS, strict=True):
        b, c = curved.apart(reading, "2 and 4")[1:] / curved.noise
        fits |= bool(b <= _SHOWN < c and curved.apart(reading, "1 and 3").max() < 1e-6)
        numbers |= {f"{name}_b": float(b * curved.noise), f"{name}_c": float(c * curved.noise)}
    b, c = flat.apart("1, 3 at the poles", "2 and 4")[1:]
    numbers |= {"flat_b": float(b), "flat_c": float(c)}
    percent = {name: f"{100 * number:.1g}" for name, number in numbers.items()}
    return Finding(
        "Dimple 4 is symmetric to dimple 2 in (b) and different in (c)",
        "5.2.3, Fig 5.4(d)",
        "With 1 and 3 at the poles the plane between 2 and 4 is a mirror in every configuration, "
        f"so the two are equal: curved elements show {percent['poles_b']} and "
        f"{percent['poles_c']} % in (b) and (c), flat ones {percent['flat_b']} and "
        f"{percent['flat_c']} %, which is the mesh's error. From a tetrahedron they differ by "
        f"{percent['tetrahedron_b']} and {percent['tetrahedron_c']} %, no more than that error. "
        f"All on the equator they do, by {percent['equator_b']} and {percent['equator_c']} %, but "
        "so do 1 and 3: no reading has both claims.",
        Verdict.CONFIRMED if fits else Verdict.REFUTED,
        numbers,
    )


def _fixed_pair_moves(views: _Views) -> Finding:
    poles, *others = (
        float(np.abs(views.tips[reading][1:, 0] / views.tips[reading][0, 0] - 1).max())
        for reading in _READINGS
    )
    error = float(views.apart("1, 3 at the poles", "1 and 3").max())
    seen = poles > _SHOWN * error
    return Finding(
        "The pair 1, 3 differs slightly between the configurations",
        "5.2.3, Fig 5.4(d)",
        f"Dimple 1 changes by at most {100 * poles:.1g} % (at the poles), "
        f"{100 * others[0]:.1g} % (equator) and {100 * others[1]:.1g} % (tetrahedron). "
        "Where 1 and 3 stay equal that is far below what a plot of the curves shows.",
        Verdict.CONFIRMED if seen and poles > 0.01 else Verdict.IN_PART,
        {"poles": poles, "equator": others[0], "tetrahedron": others[1], "error": error},
    )


def _draw(flat: _Views, curved: _Views) -> Figure:
    shown = [100 * float(v.apart("1, 3 at the poles", "2 and 4")[2]) for v in (flat, curved)]
    message = (
        f"With 1 and 3 at the poles a mirror keeps 2 and 4 equal: the {shown[0]:.1g} % between "
        f"them with flat elements is the mesh's error, {shown[1]:.1g} % with curved ones"
    )
    figure = new_figure("5.4", _TITLE, message, height=7.6)
    top = figure.add_gridspec(1, 5, left=0.02, right=0.99, top=0.845, bottom=0.55, wspace=0.05)
    spheres = [("1, 3 at the poles", k) for k in range(3)]
    spheres += [("all on the equator", 2), ("tetrahedron", 2)]
    for place, (reading, k) in enumerate(spheres):
        _draw_sphere(figure, top[place], curved, reading, k)
    _draw_key(figure)
    bottom = figure.add_gridspec(1, 3, left=0.06, right=0.985, top=0.44, bottom=0.085, wspace=0.3)
    _draw_curves(figure, bottom[0], curved)
    _draw_error(figure, bottom[1], flat, curved)
    _draw_pairs(figure, bottom[2], curved)
    return figure


def _draw_sphere(figure: Figure, cell: SubplotSpec, views: _Views, reading: str, k: int) -> None:
    """The dimples in their colours."""
    surface = views.surfaces[reading][k]
    colors = np.full(surface.points.shape, 0.8)
    for center, color in zip(views.centers[reading][k], _DIMPLES, strict=True):
        near = surface.points @ center > np.cos(0.3) * np.linalg.norm(surface.points, axis=1)
        colors[near] = to_rgb(color)
    fine = Surface(surface.points, linear_triangles(surface.triangles), surface.normals)
    towards = np.array([0.6, -0.25, 1.0] if reading == "tetrahedron" else _TOWARDS)
    caption = f"({_NAMES[k]}) {reading}"
    axes = draw_surface(figure, cell, fine, colors, caption, towards=towards)
    for center, color in zip(views.centers[reading][k], _DIMPLES, strict=True):
        if center @ towards < 0.1 * np.linalg.norm(towards):
            draw_line(axes, ring_around(center, 0.3), towards, color=color)


def _draw_key(figure: Figure) -> None:
    marks: list[Artist] = [
        Patch(color=color, label=f"dimple {k}") for k, color in enumerate(_DIMPLES, 1)
    ]
    marks.append(Line2D([], [], color="k", lw=1.3, ls=(0, (4, 2)), label="on the far side"))
    figure.legend(
        handles=marks,
        loc="upper center",
        bbox_to_anchor=(0.5, 0.545),
        ncols=5,
        frameon=False,
        fontsize=9,
    )


def _draw_curves(figure: Figure, cell: SubplotSpec, views: _Views) -> None:
    """The thesis's panel (d): four dimples in three configurations, one curve to the eye."""
    caption = "(d) Signatures, 1, 3 at the poles: 12 in one"
    axes = curve_axes(figure, cell, caption, "time (length²)", "HKS (1/length²)")
    for k, (style, tips) in enumerate(zip(("-", "--", ":"), views.tips["1, 3 at the poles"],
                                          strict=True)):  # fmt: skip
        for dimple, color in enumerate(_DIMPLES):
            width = 9 - 2.2 * dimple if k == 0 else 1.2
            axes.plot(views.times, tips[dimple], style, color=color, lw=width)
    logarithmic(axes)
    marks = [
        Line2D([], [], color=c, lw=9 - 2.2 * k, label=f"dimple {k + 1} (a)")
        for k, c in enumerate(_DIMPLES)
    ]
    marks += [
        Line2D([], [], color="k", ls=style, lw=1.2, label=f"all ({name})")
        for style, name in zip(("--", ":"), _NAMES[1:], strict=True)
    ]
    axes.legend(handles=marks, frameon=False, fontsize=8.5)


def _draw_error(figure: Figure, cell: SubplotSpec, flat: _Views, curved: _Views) -> None:
    """What parts 2 from 4 where a mirror makes them equal."""
    caption = "2 against 4, 1, 3 at the poles: 0 by reflection"
    axes = curve_axes(figure, cell, caption, "time (length²)", "difference (%)")
    for views, name, color in ((flat, "flat", COLORS[1]), (curved, "curved", COLORS[0])):
        tips = views.tips["1, 3 at the poles"]
        for k, style in ((1, "--"), (2, "-")):
            apart = 100 * np.abs(tips[k, 1] / tips[k, 3] - 1)
            label = f"{name} elements, ({_NAMES[k]})"
            axes.plot(views.times, apart, color=color, ls=style, label=label)
    logarithmic(axes, y=False)
    axes.set_yscale("log")
    axes.set_ylim(1e-5, 1e3)
    axes.legend(
        frameon=False, fontsize=8, ncols=2, loc="upper right", columnspacing=1.0, handlelength=1.5
    )


def _draw_pairs(figure: Figure, cell: SubplotSpec, views: _Views) -> None:
    """Largest difference of both pairs in each reading and configuration, above the noise."""
    axes = curve_axes(figure, cell, "Largest difference, curved elements", "", "difference (%)")
    for (pair, color), shift in zip(_COLORS.items(), (-0.12, 0.12), strict=True):
        for place, reading in enumerate(_READINGS):
            apart = np.maximum(100 * views.apart(reading, pair), 1e-9)
            for k, mark in enumerate("ox+"):
                axes.plot(place + shift, apart[k], mark, color=color, ms=8, mew=1.8)
    axes.axhspan(1e-9, 100 * views.noise, color="#e4e4e4", lw=0, label="the mesh's error")
    axes.set_yscale("log")
    axes.set_ylim(1e-8, 1e4)
    axes.set_xlim(-0.5, 2.5)
    axes.set_xticks(range(3), [reading.replace("the ", "the\n") for reading in _READINGS], size=8.5)
    marks: list[Artist] = [
        Line2D([], [], color=c, marker="s", ls="", label=p) for p, c in _COLORS.items()
    ]
    marks += [
        Line2D([], [], color="k", marker=m, ls="", label=f"({n})")
        for m, n in zip("ox+", _NAMES, strict=True)
    ]
    marks.append(Patch(color="#e4e4e4", label="the mesh's error"))
    axes.legend(handles=marks, frameon=False, fontsize=8, ncols=3, loc="upper left")


EXPERIMENT = Experiment("5.4", _TITLE, run)
