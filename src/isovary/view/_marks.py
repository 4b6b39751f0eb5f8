"""Small things drawn over a surface or beside it: captions, scale bar, marks, legends."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import wrap
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Colormap, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from ..geometry import Floats
from ._camera import Camera

INK, SOFT = "#1a1a1a", "#555555"
_MOST_LINES = 5
_SMALLEST = 6.0  # points that can be read

Box = tuple[float, float, float, float]
"""Left, bottom, width, height in parts of the figure."""


def plain(text: str) -> str:
    """The text with dollar signs that stay dollar signs, not formulas."""
    return text.replace("$", r"\$")


def fit_line(figure: Figure, x: float, y: float, words: str, width: float, **style: Any) -> None:
    """One line of text, its top left corner at (x, y); smaller if too wide, then cut short."""
    text = figure.text(x, y, plain(words), va="top", **style)
    wide = text.get_window_extent().width / figure.bbox.width
    while wide > width and len(words) > 1:  # letters do not shrink evenly
        size = 0.995 * float(text.get_fontsize()) * width / wide
        text.set_fontsize(max(size, _SMALLEST))
        if size < _SMALLEST:
            words = words[: int(0.98 * len(words) * size / _SMALLEST)]
            text.set_text(plain(words.rstrip() + "…"))
        wide = text.get_window_extent().width / figure.bbox.width


def paragraphs(
    figure: Figure, corner: tuple[float, float], words: Sequence[str], **style: Any
) -> None:
    """Paragraphs wrapped from their top left corner to a ``width`` in parts of the figure.

    What does not fit into five lines is left to the report.
    """
    width = style.pop("width")
    text = figure.text(*corner, "", va="top", size=7, linespacing=1.3, **style)
    for letters in range(200, 20, -4):
        lines = [line for part in words for line in wrap(part, letters)]
        if len(lines) > _MOST_LINES:
            lines = [*lines[: _MOST_LINES - 1], "… more in the report"]
        text.set_text(plain("\n".join(lines)))
        if text.get_window_extent().width <= width * figure.bbox.width:
            return


def caption(figure: Figure, x: float, y: float, letter: str, text: str) -> None:
    """A panel's letter and title, with their top left corner at (x, y)."""
    figure.text(x, y, letter, size=11, weight="bold", va="top")
    figure.text(x + 0.015, y, plain(text), size=10.5, va="top")


def color_bar(
    figure: Figure, box: Box, colors: Colormap, limits: tuple[float, float], label: str
) -> None:
    """A flat colour bar with its label below."""
    axes = figure.add_axes(box)
    scale = ScalarMappable(Normalize(*limits), colors)
    bar = figure.colorbar(scale, cax=axes, orientation="horizontal")
    bar.outline.set_visible(False)
    axes.locator_params(nbins=6)
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.3g}"))
    axes.tick_params(labelsize=8, length=2)
    bar.set_label(label, size=8.5)


def legend(
    figure: Figure,
    entries: Sequence[Artist],
    place: tuple[float, float],
    title: str | None = None,
    columns: int = 3,
) -> None:
    """Colour patches and lines in rows, with their top centre at a place."""
    if not entries:
        return
    figure.legend(
        handles=entries,
        loc="upper center",
        bbox_to_anchor=place,
        ncols=columns,
        frameon=False,
        fontsize=8,
        handlelength=1.1,
        columnspacing=1.2,
        borderaxespad=0,
        title=title,
        title_fontsize=8,
    )


def scale_bar(axes: Axes) -> None:
    """A bar of a round length below the lower left corner."""
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    most = 0.3 * (right - left)
    power = 10 ** np.floor(np.log10(most))
    length = power * max(f for f in (1, 2, 5) if f * power <= most)
    y, gap = bottom - 0.03 * (top - bottom), 0.02 * (right - left)
    end = left + length
    axes.plot([left, end], [y, y], color=INK, lw=2.5, solid_capstyle="butt", clip_on=False)
    axes.text(end + gap, y, f"length {length:g}", size=8, color=INK, va="center")


def tripod(figure: Figure, box: Box, camera: Camera) -> None:
    """The directions x, y, z in a box of their own."""
    axes = figure.add_axes(box)
    axes.set_axis_off()
    axes.set_aspect("equal")
    axes.set_xlim(-1.8, 1.8)
    axes.set_ylim(-1.8, 1.8)
    corner = np.zeros(2)
    taken = [corner]
    for name, arm in zip("xyz", camera.axes[:2].T, strict=True):
        axes.plot([0, arm[0]], [0, arm[1]], color=SOFT, lw=1.2)
        if np.linalg.norm(arm) < 0.3:
            continue
        beyond = np.arange(1.35, 8.0, 0.1)[:, None] * arm
        x, y = place = beyond[apart(beyond, taken, 1.0).argmax()]
        axes.text(x, y, name, size=8, color=SOFT, ha="center", va="center")
        taken.append(place)


def ring(axes: Axes, place: Floats) -> None:
    """A ring around a place in the picture, seen on every colour."""
    _hollow(axes, place, "o")


def diamond(axes: Axes, place: Floats) -> None:
    """A diamond around a place in the picture, seen on every colour."""
    _hollow(axes, place, "D")


def _hollow(axes: Axes, place: Floats, shape: str) -> None:
    x, y = place[:2]
    for color, width in (("white", 3.2), ("black", 1.4)):
        axes.plot(x, y, shape, ms=11, mfc="none", mec=color, mew=width, clip_on=False)


def number(axes: Axes, place: Floats, text: str) -> None:
    """A number on a white disc."""
    disc = {"boxstyle": "circle,pad=0.2", "fc": "white", "ec": "none", "alpha": 0.85}
    x, y = place[:2]
    axes.text(x, y, text, size=9, weight="bold", ha="center", va="center", bbox=disc)


def apart(places: Floats, taken: list[Floats], distance: float) -> np.ndarray:
    """Which places in the picture are farther than a distance from all taken ones."""
    free = np.ones(len(places), dtype=bool)
    for place in taken:
        free &= np.linalg.norm(places - place, axis=1) > distance
    return free
