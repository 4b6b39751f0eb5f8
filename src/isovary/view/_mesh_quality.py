"""The mesh report's picture: the mesh coloured by quality, and how its measures spread."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from ..geometry import Floats, rim_nodes
from ..quality import LEAST_QUALITY, MeshQuality
from ..records import Surface
from ._camera import Camera, choose_camera, in_sight
from ._marks import INK, SOFT, Box, caption, fit_line, paragraphs, ring, scale_bar, tripod
from ._opengl import opengl_problem
from ._paint import mapped
from ._scene import Scene, mesh_lines
from ._tessellate import Pieces, tessellate

QUALITY_MAP = ListedColormap(colormaps["magma"](np.linspace(0.12, 0.98, 256)))
"""Bad is dark, good is pale, so that what is bad stands out; without black, for the lines."""

_SIZE, _DPI = (12.8, 7.2), 160
_PIECES, _PIECES_WITHOUT_OPENGL = 200_000, 60_000
_STAGE: Box = (0.02, 0.155, 0.54, 0.70)
_LEFT, _BOTTOM, _WIDTH, _HEIGHT = (0.635, 0.825), (0.55, 0.125), 0.155, 0.275
_BARS, _BAR_COLOR = 30, "#7d9bb5"
_LIFT, _LIFT_WITHOUT_OPENGL = 3e-3, 1.2e-2  # of the size: edges are drawn before the surface


def mesh_quality_figure(surface: Surface, quality: MeshQuality, title: str | None = None) -> Figure:
    """One figure of a mesh: the mesh itself, coloured by quality, and histograms.

    Parameters
    ----------
    surface : Surface
    quality : MeshQuality
        Of this surface.
    title : str, optional
        What the mesh is of, for the line below the heading; the heading says how good it is.

    Returns
    -------
    matplotlib.figure.Figure
        12.8 x 7.2 inches at 160 dots per inch; belongs to no window.

    Notes
    -----
    The worst triangle is ringed where it can be seen. The view is the one that shows most of
    the bad triangles. Colours run from 0.3, the least of a clean mesh, to 1.

    Cost: 2 s.
    """
    problem = opengl_problem()
    wanted = _PIECES if problem is None else _PIECES_WITHOUT_OPENGL
    split = int(np.clip(round((wanted / len(surface.triangles)) ** 0.5), 1, 16))
    pieces = tessellate(surface, split)
    figure = Figure(figsize=_SIZE, dpi=_DPI, facecolor="white")
    fit_line(figure, 0.02, 0.975, message(quality), 0.96, size=15, weight="bold", color=INK)
    hidden = _mesh_panel(figure, surface, quality, pieces, split, problem is None)
    worst = "worst triangle, on the far side" if hidden else "○ worst triangle"
    parts = [title, _counts(quality), worst]
    words = "   ·   ".join(part for part in parts if part)
    fit_line(figure, 0.02, 0.92, words, 0.96, size=10, color=SOFT)
    _histograms(figure, quality)
    if problem is not None:
        paragraphs(figure, (0.02, 0.035), [problem], width=0.5, color=SOFT)
    return figure


def message(quality: MeshQuality) -> str:
    """How good the mesh is, in one sentence."""
    q, count = quality.quality, f"{quality.vertices} vertices"
    if not quality.clean:
        return f"{count}, not clean: {'; '.join(quality.faults)}"
    words = f"{count}: mean quality {q.mean():.3f}, worst {q.min():.2g}"
    if quality.distances is None or quality.element_distances is None:
        return words
    nodes, all_of_it = quality.distances.max(), quality.element_distances.max()
    if nodes > 0.5 * all_of_it:
        return f"{words}; within {all_of_it:.1g} of the isosurface"
    return f"{words}; nodes on the isosurface to {nodes:.1g}, triangles to {all_of_it:.1g}"


def _counts(quality: MeshQuality) -> str:
    t, kind = quality.topology, "curved six-node" if quality.order == 2 else "flat"
    loops = f"{t.boundary_loops} rim{'s' * (t.boundary_loops != 1)}"
    shape = f"{t.components} component{'s' * (t.components != 1)}, genus {t.genus}, " + (
        loops if t.boundary_loops else "closed"
    )
    return f"{quality.triangles} {kind} triangles, {shape}, area {quality.area:.5g}"


def _mesh_panel(
    figure: Figure,
    surface: Surface,
    quality: MeshQuality,
    pieces: Pieces,
    split: int,
    opengl: bool,
) -> bool:
    """Draw the mesh with its colour bar; return whether the worst triangle is out of sight."""
    if opengl:
        from ._render_vtk import draw
    else:
        from ._render_matplotlib import draw
    worst = int(quality.quality.argmin())
    inside = slice(worst * split**2, (worst + 1) * split**2)
    middle = pieces.middles[inside].mean(axis=0)
    normal = pieces.facing[inside].mean(axis=0)
    camera = _camera(pieces, quality, split, (middle, normal))
    axes = _stage(figure, camera)
    colors = mapped(QUALITY_MAP, _scaled(quality.quality)).repeat(split**2, axis=0)
    lift = _LIFT if opengl else _LIFT_WITHOUT_OPENGL
    draw(axes, Scene(pieces, colors, _edges(surface, camera, lift)), camera)
    scale_bar(axes)
    tripod(figure, (0.515, 0.085, 0.045, 0.08), camera)
    _quality_bar(figure)
    toward = camera.axes[2]
    seen = normal @ toward > 0 and in_sight(middle[None], pieces.middles, toward)[0]
    if seen:
        ring(axes, camera.project(middle))
    return not seen


def _edges(surface: Surface, camera: Camera, part: float) -> Floats:
    """The elements' edges that face the viewer, on an open surface from either side."""
    lift = part * float(np.ptp(surface.points, axis=0).max())
    lines = mesh_lines(surface, camera, lift)
    if len(rim_nodes(surface.triangles)) == 0:
        return lines
    turned = replace(surface, normals=-surface.normals)
    return np.concatenate([lines, mesh_lines(turned, camera, lift)])


def _scaled(quality: Floats) -> Floats:
    scaled: Floats = (quality - LEAST_QUALITY) / (1 - LEAST_QUALITY)
    return scaled


def _camera(
    pieces: Pieces, quality: MeshQuality, split: int, mark: tuple[Floats, Floats]
) -> Camera:
    """The view that shows most of what is bad."""
    step = max(1, len(pieces.areas) // 8_000)
    bad = (1 - quality.quality).repeat(split**2) ** 2
    some = slice(None, None, step)
    return choose_camera(
        pieces.middles[some], pieces.facing[some], (pieces.areas * bad)[some], mark
    )


def _stage(figure: Figure, camera: Camera) -> Axes:
    axes = figure.add_axes(_STAGE)
    axes.set_axis_off()
    width, height = figure.get_size_inches()
    left, right, bottom, top = camera.window(_STAGE[2] * width / (_STAGE[3] * height))
    axes.set_xlim(left, right)
    axes.set_ylim(bottom, top)
    return axes


def _quality_bar(figure: Figure) -> None:
    axes = figure.add_axes((0.2, 0.095, 0.2, 0.018))
    scale = ScalarMappable(Normalize(LEAST_QUALITY, 1), QUALITY_MAP)
    bar = figure.colorbar(scale, cax=axes, orientation="horizontal", extend="min")
    bar.outline.set_visible(False)
    axes.tick_params(labelsize=8, length=2)
    bar.set_label("quality: 2 inradius / circumradius", size=8.5)
    for x, words, side in ((0.188, "bad", "right"), (0.406, "good", "left")):
        figure.text(x, 0.104, words, size=9, color=INK, ha=side, va="center")


def _histograms(figure: Figure, quality: MeshQuality) -> None:
    panels: list[Callable[[Axes, MeshQuality], str]] = [_quality_panel, _angle_panel, _edge_panel]
    if quality.element_distances is not None:
        panels.append(_distance_panel)
    elif quality.order == 2:
        panels.append(_jacobian_panel)
    for k, (panel, letter) in enumerate(zip(panels, "abcd", strict=False)):
        left, bottom = _LEFT[k % 2], _BOTTOM[k // 2]
        wide = _WIDTH if len(panels) > 3 or k < 2 else _LEFT[1] - _LEFT[0] + _WIDTH
        axes = figure.add_axes((left, bottom, wide, _HEIGHT))
        caption(figure, left - 0.03, bottom + _HEIGHT + 0.045, letter, panel(axes, quality))


def _quality_panel(axes: Axes, quality: MeshQuality) -> str:
    q = quality.quality
    edges = np.linspace(min(float(q.min()), 0.7), 1, _BARS + 1)
    middles = (edges[1:] + edges[:-1]) / 2
    _bars(axes, q, edges, mapped(QUALITY_MAP, _scaled(middles)))
    _mark(axes, float(q.mean()), f"mean {q.mean():.3f}", 0.99)
    _mark(axes, float(q.min()), f"worst {q.min():.2g}", 0.5)
    axes.set_xlabel("2 inradius / circumradius")
    return "Quality of the triangles"


def _angle_panel(axes: Axes, quality: MeshQuality) -> str:
    angles = quality.angles.ravel()
    low, high = float(angles.min()), float(angles.max())
    _bars(axes, angles, np.linspace(min(low, 50), max(high, 70), _BARS + 1))
    _mark(axes, 60.0, "60°", 0.99)
    axes.set_xlabel(f"degrees, {low:.0f} to {high:.0f}")
    return "Angles at their corners"


def _edge_panel(axes: Axes, quality: MeshQuality) -> str:
    if quality.edge_ratios is None:
        values, words = quality.edge_lengths / quality.edge_lengths.mean(), "edge / mean edge"
    else:
        values, words = quality.edge_ratios, "edge / wished edge, scaled to rms 1"
    low, high = float(values.min()), float(values.max())
    _bars(axes, values, np.linspace(min(low, 0.8), max(high, 1.2), _BARS + 1))
    _mark(axes, 1.0, f"{low:.3g} to {high:.3g}", 0.99)
    axes.set_xlabel(words)
    return "Edge lengths"


def _distance_panel(axes: Axes, quality: MeshQuality) -> str:
    assert quality.element_distances is not None
    most = float(quality.element_distances.max())
    if not 0 < most < np.inf:
        axes.text(0.5, 0.5, f"{most:g} everywhere", transform=axes.transAxes, ha="center")
        return "Distance to the isosurface"
    rest = np.maximum(quality.element_distances, 1e-6 * most)  # zero has no logarithm
    edges = np.geomspace(min(float(rest.min()), most / 100), most, _BARS + 1)
    _bars(axes, rest, edges)
    axes.set_xscale("log")
    axes.xaxis.set_minor_formatter(NullFormatter())
    _mark(axes, most, f"largest {most:.1g}", 0.99)
    _mark(axes, quality.surface_distance, f"rms {quality.surface_distance:.1g}", 0.88)
    axes.set_xlabel("largest in each triangle (length)")
    return "Distance to the isosurface"


def _jacobian_panel(axes: Axes, quality: MeshQuality) -> str:
    ratios = np.nan_to_num(quality.jacobians, nan=0.0)
    low = float(ratios.min())
    _bars(axes, ratios, np.linspace(min(low, 0.95), 1, _BARS + 1))
    _mark(axes, low, f"smallest {low:.2g}", 0.5)
    axes.set_xlabel("smallest / largest Jacobian")
    return "Distortion of the triangles"


def _bars(axes: Axes, values: Floats, edges: Floats, colors: Floats | str = _BAR_COLOR) -> None:
    """Parts of the values between the edges, with room for words above."""
    parts = np.histogram(values, edges)[0] / len(values)
    wide = np.diff(edges)
    axes.bar(edges[:-1], parts, wide, align="edge", color=colors, edgecolor=SOFT, linewidth=0.4)
    axes.set_xlim(edges[0] - wide[0], edges[-1] + wide[-1])
    axes.set_ylim(0, 1.22 * parts.max())
    axes.yaxis.set_major_formatter(FuncFormatter(lambda part, _: f"{100 * part:g}%"))
    axes.locator_params(axis="y", nbins=4)
    axes.tick_params(labelsize=8, length=2)
    axes.xaxis.label.set_fontsize(8.5)
    axes.spines[["top", "right"]].set_visible(False)


def _mark(axes: Axes, x: float, words: str, height: float) -> None:
    """A line at x with words beside it, on the side with more room."""
    axes.axvline(x, color=INK, lw=1, ls=(0, (4, 2)), ymax=height)
    part = float(axes.transAxes.inverted().transform(axes.transData.transform((x, 0)))[0])
    left = part > 0.5
    axes.annotate(
        words,
        (x, height),
        xycoords=("data", "axes fraction"),
        xytext=(-3 if left else 3, 0),
        textcoords="offset points",
        ha="right" if left else "left",
        va="top",
        size=8,
        color=INK,
        bbox={"fc": "white", "ec": "none", "alpha": 0.8, "pad": 0.5},
    )
