"""The overview picture: where the isosurface changed, what moved, which groups, at which scale."""

from __future__ import annotations

from dataclasses import dataclass
from textwrap import wrap

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from ..comparison import Comparison
from ..geometry import Floats
from . import _paint as paint
from ._camera import Camera, choose_camera, in_sight
from ._curves import curves_at, draw_change, draw_signatures
from ._opengl import opengl_problem
from ._scene import Scene, mesh_lines
from ._tessellate import Pieces, tessellate
from ._words import facts, group_shares, peak, percent, title, verdict

_SIZE, _DPI = (12.8, 7.2), 160
_PIECES, _PIECES_WITHOUT_OPENGL = 200_000, 30_000
_INK, _SOFT = "#1a1a1a", "#555555"


@dataclass(frozen=True, eq=False)
class _View:
    """What all panels share."""

    result: Comparison
    pieces: Pieces
    samples: paint.Samples
    camera: Camera
    peak: int | None
    problem: str | None

    @property
    def significant_share(self) -> float:
        """Part of the area where the change is significant."""
        areas = self.pieces.areas
        return float(areas @ ((self.samples.margin > 0) & (self.samples.known > 0)) / areas.sum())


def overview(result: Comparison) -> Figure:
    """One figure of a comparison: change, displacement, groups, and the curves of one point.

    Parameters
    ----------
    result : Comparison

    Returns
    -------
    matplotlib.figure.Figure
        12.8 x 7.2 inches at 160 dots per inch; belongs to no window.

    Notes
    -----
    Three panels show the base surface from one side, the one that shows most of
    the change and the point that changed most, in parallel projection: their
    scale bars hold everywhere. What is not above the noise floor is light grey,
    what is unknown is hatched dark grey.

    Cost: 2 s with OpenGL, 4 s without.
    """
    view = _view(result)
    figure = Figure(figsize=_SIZE, dpi=_DPI, facecolor="white")
    _heading(figure, view)
    _change_panel(figure, view)
    _displacement_panel(figure, view)
    _groups_panel(figure, view)
    _curves_panel(figure, view)
    _footer(figure, view)
    return figure


def _view(result: Comparison) -> _View:
    problem = opengl_problem()
    wanted = _PIECES if problem is None else _PIECES_WITHOUT_OPENGL
    split = int(np.clip(round((wanted / len(result.base.triangles)) ** 0.5), 1, 16))
    pieces = tessellate(result.base, split)
    samples = paint.piece_samples(result, split)
    marked = peak(result)
    mark = None if marked is None else (result.base.points[marked], result.base.normals[marked])
    weight = np.where(samples.margin > 0, np.nan_to_num(samples.norm), 0.0)
    step = max(1, len(pieces.areas) // 20_000)
    parts = (pieces.middles, pieces.facing, pieces.areas, np.maximum(weight, 0.0))
    camera = choose_camera(*(part[::step] for part in parts), mark)
    return _View(result, pieces, samples, camera, marked, problem)


def _heading(figure: Figure, view: _View) -> None:
    result = view.result
    figure.text(0.02, 0.975, _plain(verdict(result, view.significant_share)), size=15,
                weight="bold", color=_INK, va="top")
    parts = [f"Isosurface {title(result)}, base against perturbed"]
    if result.significant.any():
        parts.append(f"numerical noise {percent(result.relative_noise)} of the change")
    if view.peak is not None:
        parts.append("○ marks the point that changed most")
    figure.text(0.02, 0.918, _plain("   ·   ".join(parts)), size=10, color=_SOFT, va="top")


def _change_panel(figure: Figure, view: _View) -> None:
    limit = paint.norm_limit(view.result)
    axes = _surface_axes(figure, (0.02, 0.255, 0.37, 0.575), view)
    _caption(axes, "a", "Where the intrinsic shape changed")
    _draw(axes, view, paint.paint_norm(view.samples, limit))
    _scale_bar(axes)
    _tripod(axes, view.camera)
    _mark(axes, view)
    entries = []
    if (view.samples.margin <= 0).any():
        entries.append(Patch(color=paint.NEUTRAL, label="no significant change"))
    entries += _no_partner_entry(view)
    _legend(figure, entries, 0.205, 0.148)
    if limit > 0:
        _color_bar(figure, (0.055, 0.228, 0.30, 0.016), paint.NORM_MAP, (0, 100 * limit),
                   "mean change of the heat kernel signature (HKS), % of its mean")


def _displacement_panel(figure: Figure, view: _View) -> None:
    limit = paint.move_limit(view.result)
    axes = _surface_axes(figure, (0.41, 0.60, 0.25, 0.23), view)
    _caption(axes, "b", "What moved: perturbed mesh over the base")
    lines = mesh_lines(view.result.perturbed, view.camera, 1.05 * limit)
    _draw(axes, view, paint.paint_displacement(view.samples, limit), lines)
    if limit > 0:
        _color_bar(figure, (0.435, 0.572, 0.20, 0.012), paint.MOVE_MAP, (-limit, limit),
                   "displacement along the normal (length)")
    else:
        figure.text(0.535, 0.565, "no displacement", size=8, color=_SOFT, ha="center")


def _groups_panel(figure: Figure, view: _View) -> None:
    axes = _surface_axes(figure, (0.41, 0.235, 0.25, 0.23), view)
    _caption(axes, "c", "Groups of nodes that changed alike")
    _draw(axes, view, paint.paint_groups(view.samples))
    _mark(axes, view)
    count = len(view.result.clusters.centers)
    groups, colors = view.samples.groups, paint.group_colors(count)
    shares = group_shares(groups, view.pieces.areas, view.samples.norm, count)
    entries = [
        Patch(color=tuple(color), label=f"{k}: {percent(share)} of area, mean {percent(mean)}")
        for k, (color, (share, mean)) in enumerate(zip(colors, shares, strict=True))
    ]
    if (groups < 0).any():
        entries.append(Patch(color=paint.NEUTRAL, label="no group"))
    _legend(figure, entries + _no_partner_entry(view), 0.535, 0.23)
    _number_groups(axes, view, count)


def _curves_panel(figure: Figure, view: _View) -> None:
    curves = curves_at(view.result, view.peak)
    upper = figure.add_axes((0.745, 0.505, 0.24, 0.285))
    lower = figure.add_axes((0.745, 0.205, 0.24, 0.265), sharex=upper)
    where = "at the marked point" if view.peak is not None else "median over the nodes"
    figure.text(0.69, 0.872, "d", size=11, weight="bold", va="top")
    figure.text(0.705, 0.872, f"At which scale: {where}", size=10.5, va="top")
    draw_signatures(upper, view.result.times, curves)
    draw_change(lower, view.result.times, curves)
    for axes in (upper, lower, *upper.child_axes):
        axes.tick_params(labelsize=8)
        axes.xaxis.label.set_size(8.5)
        axes.yaxis.label.set_size(8.5)
        for text in axes.get_legend().get_texts() if axes.get_legend() else ():
            text.set_size(8.5)
    figure.align_ylabels([upper, lower])


def _footer(figure: Figure, view: _View) -> None:
    words = [f"{name}: {value}" for name, value in facts(view.result).items()]
    words.append("lengths in the field's own unit")
    if view.problem:
        words.append(view.problem)
    figure.text(0.02, 0.11, _plain("\n".join(wrap("  ·  ".join(words), 128))), size=7, va="top",
                color=_SOFT, linespacing=1.35)
    lines = [line for note in view.result.notes for line in wrap(f"Note: {note}", 78)]
    if len(lines) > 6:
        lines = [*lines[:5], "(more notes in the report)"]
    if lines:
        figure.text(0.615, 0.11, _plain("\n".join(lines)), size=7.2, va="top", color="#5a4200",
                    linespacing=1.35, bbox={"fc": "#fff6df", "ec": "#e3c46b", "lw": 0.8, "pad": 4})


def _surface_axes(figure: Figure, box: tuple[float, float, float, float], view: _View) -> Axes:
    axes = figure.add_axes(box)
    axes.set_axis_off()
    left, right, bottom, top = view.camera.window(box[2] * _SIZE[0] / (box[3] * _SIZE[1]))
    axes.set_xlim(left, right)
    axes.set_ylim(bottom, top)
    return axes


def _draw(axes: Axes, view: _View, colors: Floats, lines: Floats | None = None) -> None:
    shown = paint.hatched(colors, view.samples, view.pieces.middles)
    scene = Scene(view.pieces, shown, lines)
    if view.problem is None:
        from ._render_vtk import draw
    else:
        from ._render_matplotlib import draw
    draw(axes, scene, view.camera)


def _caption(axes: Axes, letter: str, text: str) -> None:
    figure = axes.get_figure()
    box = axes.get_position()
    figure.text(box.x0, box.y1 + 0.042, letter, size=11, weight="bold", va="top")
    figure.text(box.x0 + 0.015, box.y1 + 0.042, text, size=10.5, va="top")


def _color_bar(
    figure: Figure,
    box: tuple[float, float, float, float],
    name: str,
    limits: tuple[float, float],
    label: str,
) -> None:
    axes = figure.add_axes(box)
    bar = figure.colorbar(
        ScalarMappable(Normalize(*limits), colormaps[name]), cax=axes, orientation="horizontal"
    )
    bar.outline.set_visible(False)
    bar.locator.set_params(nbins=6)
    axes.tick_params(labelsize=8, length=2)
    bar.set_label(label, size=8.5)


def _legend(figure: Figure, entries: list[Patch], x: float, y: float) -> None:
    if entries:
        figure.legend(handles=entries, loc="upper center", bbox_to_anchor=(x, y), ncols=2,
                      frameon=False, fontsize=8, handlelength=1.1, columnspacing=1.2,
                      borderaxespad=0)


def _no_partner_entry(view: _View) -> list[Patch]:
    if (view.samples.known > 0).all():
        return []
    patch = Patch(facecolor=paint.NO_PARTNER, edgecolor=paint.NO_PARTNER_2, hatch="////",
                  label="no partner: unknown")
    return [patch]


def _mark(axes: Axes, view: _View) -> None:
    if view.peak is not None:
        x, y, _ = view.camera.project(view.result.base.points[view.peak])
        axes.plot(x, y, "o", ms=11, mfc="none", mec="white", mew=3.2)
        axes.plot(x, y, "o", ms=11, mfc="none", mec="black", mew=1.4)


def _number_groups(axes: Axes, view: _View, count: int) -> None:
    """Each group's number on it, at the visible place nearest to its visible centre."""
    pieces, direction = view.pieces, view.camera.axes[2]
    front = np.flatnonzero(pieces.facing @ direction > 0.4)
    for group in range(count):
        inside = front[view.samples.groups[front] == group]
        if len(inside) == 0:
            continue
        places = pieces.middles[inside]
        flat = view.camera.project(places)[:, :2]
        near = np.linalg.norm(flat - np.average(flat, axis=0), axis=1).argsort()[:200]
        clear = in_sight(places[near], pieces.middles, direction)
        if clear.any():
            x, y = flat[near[clear.argmax()]]
            axes.text(x, y, str(group), size=9, weight="bold", ha="center", va="center",
                      bbox={"boxstyle": "circle,pad=0.2", "fc": "white", "ec": "none", "alpha": 0.8})


def _scale_bar(axes: Axes) -> None:
    """A bar of a round length in the lower left corner."""
    left, right = axes.get_xlim()
    bottom, top = axes.get_ylim()
    length = 10 ** np.floor(np.log10(0.3 * (right - left)))
    length *= max(f for f in (1, 2, 5) if f * length <= 0.3 * (right - left))
    y = bottom + 0.015 * (top - bottom)
    axes.plot([left, left + length], [y, y], color=_INK, lw=2.5, solid_capstyle="butt")
    axes.text(left, y + 0.015 * (top - bottom), f"length {length:g}", size=8, color=_INK)


def _tripod(axes: Axes, camera: Camera) -> None:
    """The directions x, y, z in the lower right corner."""
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    size = 0.07 * (right - left)
    x, y = right - 1.3 * size, bottom + 1.3 * size
    for name, (dx, dy) in zip("xyz", size * camera.axes[:2].T, strict=True):
        axes.plot([x, x + dx], [y, y + dy], color=_SOFT, lw=1.2)
        if np.hypot(dx, dy) > 0.3 * size:
            axes.text(x + 1.3 * dx, y + 1.3 * dy, name, size=8, color=_SOFT, ha="center",
                      va="center")


def _plain(text: str) -> str:
    """The text with dollar signs that stay dollar signs."""
    return text.replace("$", r"\$")
