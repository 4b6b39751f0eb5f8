"""The overview picture: where the isosurface changed, what moved, which groups, at which scale."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ..comparison import Comparison
from . import _paint as paint
from ._camera import Camera, choose_camera
from ._marks import INK, SOFT, fit_line, paragraphs
from ._opengl import opengl_problem
from ._panels import View, change_panel, curves_panel, displacement_panel, groups_panel
from ._rim_band import rim_band
from ._tessellate import outside, tessellate
from ._words import facts, peak, percent, title, verdict

_SIZE, _DPI = (12.8, 7.2), 160
_PIECES, _PIECES_WITHOUT_OPENGL, _PIECES_FOR_CAMERA = 200_000, 60_000, 8_000


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
    the change and the point that changed most, in parallel projection: a length
    in the picture is a length of the surface. What is less than twice the noise floor
    is light grey, what is unknown is hatched dark grey.

    Cost: 2 s, the first time 5 s.
    """
    view = prepare(result)
    figure = Figure(figsize=_SIZE, dpi=_DPI, facecolor="white")
    _heading(figure, view)
    change_panel(figure, view)
    displacement_panel(figure, view)
    groups_panel(figure, view)
    curves_panel(figure, view)
    _footer(figure, view)
    return figure


def prepare(result: Comparison) -> View:
    """Everything that the panels share."""
    problem = opengl_problem()
    split = _split(result, _PIECES if problem is None else _PIECES_WITHOUT_OPENGL)
    pieces, samples = tessellate(result.base, split), paint.piece_samples(result, split)
    marked = peak(result)
    band = rim_band(result, pieces, split, marked)
    return View(result, pieces, samples, _camera(result, marked), marked, problem, split, band)


def _split(result: Comparison, pieces: int) -> int:
    """Parts of each triangle's edges that give about so many pieces."""
    return int(np.clip(round((pieces / len(result.base.triangles)) ** 0.5), 1, 16))


def _camera(result: Comparison, marked: int | None) -> Camera:
    """The same whatever draws the picture."""
    split = _split(result, _PIECES_FOR_CAMERA)
    pieces, samples = tessellate(result.base, split), paint.piece_samples(result, split)
    mark = None
    if marked is not None:
        mark = result.base.points[marked], outside(result.base) * result.base.normals[marked]
    weight = np.where(samples.margin > 0, np.maximum(np.nan_to_num(samples.norm), 0.0), 0.0)
    return choose_camera(pieces.middles, pieces.facing, pieces.areas * weight, mark)


def _heading(figure: Figure, view: View) -> None:
    result = view.result
    words = verdict(result, view.half_share)
    fit_line(figure, 0.02, 0.975, words, 0.96, size=15, weight="bold", color=INK)
    parts = [f"Isosurface {title(result)}, base against perturbed"]
    if result.significant.any():
        parts.append(f"significant on {percent(view.significant_share)} of the surface")
        parts.append(f"noise {percent(result.relative_noise)} of the change")
        if np.isnan(result.choices["noise_of_the_samples"]):  # type: ignore[call-overload]
            parts.append("that of the samples unknown")
    if view.peak is not None:
        parts.append("○ changed most")
    fit_line(figure, 0.02, 0.92, "   ·   ".join(parts), 0.96, size=10, color=SOFT)


def _footer(figure: Figure, view: View) -> None:
    words = [f"{name}: {value}" for name, value in facts(view.result).items()]
    words.append("lengths in the field's own unit")
    lines = ([view.problem] if view.problem else []) + ["  ·  ".join(words)]
    paragraphs(figure, (0.02, 0.105), lines, width=0.58, color=SOFT)
    if view.result.notes:
        notes = [f"Note: {note}" for note in view.result.notes]
        box = {"fc": "#fff6df", "ec": "#e3c46b", "pad": 4}
        paragraphs(figure, (0.63, 0.105), notes, width=0.355, color="#5a4200", bbox=box)
