"""Axes, ticks, lines and words of charts, as SVG text with the colour of what is around."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
from numpy.typing import ArrayLike

from ..geometry import Floats

WIDE = 6.4
"""Mean width of a letter of 12 pixels."""

_SIZE = 12.0
_CLEAR = 9.0  # least distance of a key to a curve
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclass(frozen=True)
class Axis:
    """Values from low to high along pixels from start to end."""

    low: float
    high: float
    start: float
    end: float
    logarithmic: bool

    def place(self, values: ArrayLike) -> Floats:
        """Pixels of values."""
        low, high, at = self.low, self.high, np.asarray(values, dtype=float)
        if self.logarithmic:
            low, high, at = np.log(low), np.log(high), np.log(at)
        places: Floats = self.start + (at - low) / (high - low) * (self.end - self.start)
        return places

    def ticks(self, most: int) -> list[float]:
        """Round values on the axis, two or more, about so many at most."""
        for steps in ((1, 2, 5), (1,)) if self.logarithmic else ():
            powers = range(int(np.floor(np.log10(self.low))), int(np.ceil(np.log10(self.high))) + 1)
            found = [float(f"{step}e{power}") for power in powers for step in steps]
            found = [value for value in found if self.low <= value <= self.high]
            if 3 <= len(found) <= most:
                return found
            if steps == (1,) and len(found) > most:
                return found[:: -(-len(found) // most)]
        return _even(self.low, self.high, most)


@dataclass(frozen=True)
class Panel:
    """A box with two axes."""

    x: Axis
    y: Axis

    def points(self, columns: Floats, values: Floats) -> Floats:
        """Pixels (C, 2) of a curve, NaN where it is unknown."""
        return np.column_stack([self.x.place(columns), self.y.place(values)])

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Left, top, width and height."""
        x, y = self.x, self.y
        return x.start, y.end, x.end - x.start, y.start - y.end


def _even(low: float, high: float, most: int) -> list[float]:
    """Multiples of 1, 2 or 5 times a power of ten, two or more.

    Examples
    --------
    >>> _even(-0.3, 1.2, 4)
    [0.0, 0.5, 1.0]
    """
    power = int(np.floor(np.log10((high - low) / most)))
    for step in (float(f"{part}e{power + more}") for more in (0, 1) for part in (1, 2, 5)):
        first, last = int(np.ceil(low / step)), int(np.floor(high / step))
        if last - first < most:
            break
    return [float(f"{number * step:.12g}") for number in range(first, last + 1)]


def span(values: Floats, logarithmic: bool, beyond: float) -> tuple[float, float]:
    """Ends of an axis that holds the values, by a part of their range beyond them."""
    low, high = float(values.min()), float(values.max())
    if logarithmic:
        low, high = np.log(low), np.log(high)
    if high - low <= 1e-9 * max(abs(low), abs(high), 1e-300):
        low, high = low - 0.1 * (abs(low) or 1.0), high + 0.1 * (abs(high) or 1.0)
    low, high = low - beyond * (high - low), high + beyond * (high - low)
    return (float(np.exp(low)), float(np.exp(high))) if logarithmic else (low, high)


def frame(panel: Panel, name: str, *, labels: bool, known: bool = True) -> list[str]:
    """The box of a panel, its ticks with faint lines, and the name of its upright axis."""
    left, top, wide, high = panel.box
    parts = [
        f'<rect class="panel" x="{left:.2f}" y="{top:.2f}" width="{wide:.2f}" '
        f'height="{high:.2f}" fill="none" stroke="currentColor" stroke-opacity="0.45"/>'
    ]
    for value in panel.y.ticks(6) if known else ():
        y = float(panel.y.place(value))
        parts.append(line(left, y, left + wide, y, 'stroke-opacity="0.15"'))
        parts.append(tick(left - 6, y + 4, value, "end", "y"))
    for value in spaced(panel.x):
        x = float(panel.x.place(value))
        parts.append(line(x, top, x, top + high, 'stroke-opacity="0.15"'))
        if labels:
            parts.append(tick(x, top + high + 15, value, "middle", "x"))
    y = top + high / 2
    turned = f' transform="rotate(-90 13 {y:.2f})"'
    return [*parts, text(13.0, y, cut(name, high + 24), "middle", more=turned)]


def spaced(axis: Axis) -> list[float]:
    """Ticks of a level axis whose labels do not touch."""
    for most in (8, 7, 6, 5, 4, 3):
        ticks = axis.ticks(most)
        wide = [WIDE * len(said(value)) + 8 for value in ticks]
        places = axis.place(ticks)
        half = np.array(wide) / 2
        if (np.diff(places) > half[:-1] + half[1:]).all():
            break
    return ticks


def curve(places: Floats, name: str, look: str) -> str:
    """A line through the known places (C, 2), cut where they are not; dots where alone."""
    words: list[str] = []
    known = np.asarray(np.isfinite(places).all(axis=1))
    for number, (x, y) in enumerate(places):
        if not known[number]:
            continue
        before = number > 0 and known[number - 1]
        alone = not before and not (number + 1 < len(known) and known[number + 1])
        words.append(f"{'L' if before else 'M'}{x:.2f} {y:.2f}{'h0' if alone else ''}")
    line = "".join(words)
    ends = 'stroke-linejoin="round" stroke-linecap="round"' if "h0" in line else ""
    return f'<path class="{name}" d="{line}" fill="none" {look} {ends}/>'


def free_place(
    panel: Panel, size: tuple[float, float], curves: Sequence[Floats], chosen: float | None
) -> tuple[float, float]:
    """Upper left corner of a box that is near to curves, but clear of them and of the mark."""
    left, top, wide, high = panel.box
    step = np.linspace(0.0, 1.0, 30)
    xs = left + 8 + step * (wide - size[0] - 16)
    ys = top + 4 + step * (high - size[1] - 8)
    x, y = (grid.ravel() for grid in np.meshgrid(xs, ys))
    places = np.concatenate([_dense(curve[np.isfinite(curve).all(axis=1)]) for curve in curves])
    away = np.full(len(x), np.inf)
    for px, py in places:
        dx = np.maximum(np.maximum(x - px, px - x - size[0]), 0.0)
        dy = np.maximum(np.maximum(y - py, py - y - size[1]), 0.0)
        away = np.minimum(away, np.hypot(dx, dy))
    if chosen is not None:
        away = np.minimum(away, np.maximum(np.maximum(x - chosen, chosen - x - size[0]), 0.0))
    good = away >= _CLEAR
    best = np.where(good, away, np.inf).argmin() if good.any() else away.argmax()
    return float(x[best]), float(y[best])


def _dense(places: Floats) -> Floats:
    """A hundred places along a curve."""
    if len(places) < 2:
        return places
    step = np.linspace(0, len(places) - 1, 100)
    return np.column_stack([np.interp(step, np.arange(len(places)), p) for p in places.T])


def words_in(panel: Panel, lines: Sequence[str], part: float = 0.5) -> list[str]:
    """Words in the middle of a panel, at a part of its height."""
    left, top, wide, high = panel.box
    first = top + high * part + 4 - 8 * (len(lines) - 1)
    return [
        text(left + wide / 2, first + 17 * row, line, "middle") for row, line in enumerate(lines)
    ]


def said(value: float) -> str:
    """A number in few characters.

    Examples
    --------
    >>> said(0.05), said(-20.0), said(3e-7), said(1e6), said(0.0)
    ('0.05', '−20', '3·10⁻⁷', '10⁶', '0')
    """
    if value == 0 or 1e-3 <= abs(value) < 1e5:
        return f"{value:.6g}".replace("-", "−")
    mantissa, power = f"{value:.5e}".split("e")
    factor = f"{float(mantissa):g}·".replace("-", "−").removeprefix("1·").replace("−1·", "−")
    return f"{factor}10{str(int(power)).translate(_RAISED)}"


def tick(x: float, y: float, value: float, anchor: str, axis: str) -> str:
    """A number beside an axis, which says in data-value what it is exactly."""
    more = f' class="tick {axis}" data-value="{value:.12g}"'
    return text(x, y, said(value), anchor, more=more, size=11.5)


def text(
    x: float,
    y: float,
    words: str,
    anchor: str,
    *,
    weight: str = "400",
    more: str = "",
    size: float = _SIZE,
) -> str:
    """Words at a place; ``more`` are further attributes."""
    return (
        f'<text x="{x:.2f}" y="{y:.2f}" text-anchor="{anchor}" font-size="{size:g}" '
        f'font-weight="{weight}" fill="currentColor"{more}>{_safe(words)}</text>'
    )


def line(x1: float, y1: float, x2: float, y2: float, look: str) -> str:
    """A straight line in the colour of the text."""
    return (
        f'<line x1="{x1:.2f}" y1="{y1:.2f}" x2="{x2:.2f}" y2="{y2:.2f}" '
        f'stroke="currentColor" {look}/>'
    )


def document(width: int, height: int, words: str, parts: Iterable[str]) -> str:
    """The whole chart, told in words to those who do not see it."""
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" role="img" '
        f'aria-label="{_safe(words)}" font-family="system-ui, sans-serif">{"".join(parts)}</svg>'
    )


def cut(words: str, room: float) -> str:
    """Words that fit into so many pixels."""
    most = max(int(room / WIDE), 2)
    return words if len(words) <= most else words[: most - 1] + "…"


def _safe(words: str) -> str:
    """Text for XML: its signs escaped, characters that it may not hold left out."""
    kept = (c for c in words if c in "\t\n\r" or (c >= " " and not "\ud800" <= c <= "\udfff"))
    return escape("".join(c for c in kept if c not in "\ufffe\uffff"), quote=True)
