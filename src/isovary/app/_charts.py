"""Charts of the page as SVG text: signatures at a point, and the values of a field.

They take the colour of the text around them, so that they read on light and on dark ground,
and hold no script and no link.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ArgumentError
from ..geometry import Floats
from ..signature import SignatureKind, diffusion_radius
from ._svg import (
    WIDE,
    Axis,
    Panel,
    curve,
    cut,
    document,
    frame,
    free_place,
    line,
    said,
    spaced,
    span,
    text,
    tick,
    words_in,
)

PERTURBED = "#d55e00"
"""Of the perturbed curve and of what is chosen: seen on white and on black."""

_LEFT, _RIGHT, _GAP = 70.0, 16.0, 16.0
_PARTNERLESS = ("no partner on the perturbed surface:", "the change here is unknown")


def curves_svg(
    columns: ArrayLike,
    base: ArrayLike,
    perturbed: ArrayLike,
    change: ArrayLike,
    noise: ArrayLike,
    *,
    kind: SignatureKind,
    title: str,
    column: int | None = None,
    width: int = 460,
    height: int = 420,
) -> str:
    """Both signatures at a point over their columns, and below the change within its noise.

    Parameters
    ----------
    columns : array (C,)
        That rise: diffusion times (length^2), or what else the signature has.
    base, perturbed : array (C,)
        Signatures; NaN where unknown.
    change, noise : array (C,)
        Scaled change and its noise floor, as parts: shown in percent.
    kind : SignatureKind
        Names, unit and axis; times get a second axis with the diffusion radius 2 sqrt(t).
    title : str
        Of the chart, such as which node.
    column : int, optional
        Of these the chosen one, which is marked.
    width, height : int
        Of the view box; letters are 12 high in it.

    Returns
    -------
    str
        An ``svg`` element without size: it fills what it is put into.

    Raises
    ------
    ArgumentError
        A02 for a column that is not there, A03 for arrays that are not (C,), and for columns
        that do not rise.

    Notes
    -----
    Cost: 2 ms.
    """
    curves = _checked(columns, base, perturbed, change, noise)
    at, (before, after, moved, floor) = curves[0], curves[1:]
    if column is not None and not 0 <= column < len(at):
        raise ArgumentError("A02", f"column: expected one of 0 to {len(at) - 1}, got {column}")
    logarithmic = kind.logarithmic and at[0] > 0
    across = Axis(*span(at, logarithmic, 0.0), _LEFT, width - _RIGHT, logarithmic)
    top = 24.0 + (36.0 if kind.per_time else 6.0)
    middle = top + (height - top - _GAP - 44.0) / 2
    upper = Panel(across, _axis_of([before, after], True, (middle, top)))
    lower = Panel(across, _change_axis(moved, floor, (height - 44.0, middle + _GAP)))
    chosen = None if column is None else float(across.place(at[column]))
    parts = [
        text(width / 2, 15.0, cut(title, width - 16), "middle", weight="600"),
        *frame(upper, f"{kind.abbreviation} ({kind.unit})", labels=False),
        *frame(
            lower,
            f"change, % of mean {kind.abbreviation}",
            labels=True,
            known=bool(np.isfinite(moved).any()),
        ),
        text((_LEFT + width - _RIGHT) / 2, height - 8.0, kind.axis, "middle"),
        *(_radius_axis(upper) if kind.per_time and logarithmic else []),
        *_marker(chosen, top, height - 44.0),
        *_signatures(upper, at, before, after, chosen),
        *_change(lower, at, moved, floor, chosen),
    ]
    if column is not None:
        parts += _dots([(upper, at, before, "currentColor"), (upper, at, after, PERTURBED)], column)
        parts += _dots([(lower, at, 100 * moved, "currentColor")], column)
    return document(width, height, f"{title}. {_told(kind, at, moved)}", parts)


def curve_values(
    columns: ArrayLike,
    base: ArrayLike,
    perturbed: ArrayLike,
    change: ArrayLike,
    noise: ArrayLike,
    *,
    kind: SignatureKind,
    most: int = 25,
) -> list[list[str]]:
    """The numbers of :func:`curves_svg` as a table of text, its headings first.

    Parameters
    ----------
    columns, base, perturbed, change, noise : array (C,)
    kind : SignatureKind
    most : int
        Rows at most, evenly chosen, with the first and the last column.

    Returns
    -------
    list of list of str

    Raises
    ------
    ArgumentError
        A02 for a number of rows below 1, A03 for arrays that are not (C,).

    Examples
    --------
    Diffusion radius 2 sqrt(0.25) = 1, and the perturbed surface has no partner there:

    >>> from isovary.signature import heat_kernel_signature, signature_kind
    >>> kind, nan = signature_kind(heat_kernel_signature), [float("nan")]
    >>> head, row = curve_values([0.25], [2.0], nan, nan, nan, kind=kind)
    >>> head[1], row
    ('diffusion radius (length)', ['0.25', '1', '2', 'unknown', 'unknown', 'unknown'])
    """
    if most < 1:
        raise ArgumentError("A02", f"most: expected 1 or more, got {most}")
    at, before, after, moved, floor = _checked(columns, base, perturbed, change, noise)
    short = kind.abbreviation
    unit = kind.unit.replace(" / ", "/")
    head = [kind.axis, *(["diffusion radius (length)"] if kind.per_time else [])]
    head += [f"{short} base ({unit})", f"{short} perturbed ({unit})"]
    head += [f"change (% of mean {short})", "noise floor (%)"]
    listed = [at, *([diffusion_radius(at)] if kind.per_time else [])]
    listed += [before, after, 100 * moved, 100 * floor]
    some = np.unique(np.linspace(0, len(at) - 1, min(len(at), most)).round().astype(int))
    return [head, *([_known(values[row]) for values in listed] for row in some)]


def histogram_svg(
    counts: ArrayLike,
    edges: ArrayLike,
    isovalue: float | None,
    *,
    title: str,
    unit: str = "value of the field",
    logarithmic: bool = False,
    width: int = 460,
    height: int = 200,
) -> str:
    """How often a field takes its values, on a logarithmic scale, and the isovalue among them.

    Parameters
    ----------
    counts : array (b,)
        Samples in each bin.
    edges : array (b + 1,)
        Of the bins, rising.
    isovalue : float, optional
        Marked, or told to lie outside.
    title, unit : str
        Of the chart, and of its axis.
    logarithmic : bool
        Whether the axis of the values is, too; the edges are then positive.
    width, height : int
        Of the view box.

    Returns
    -------
    str
        An ``svg`` element without size.

    Raises
    ------
    ArgumentError
        A02 for negative counts, or edges that have no logarithm; A03 for shapes that do not fit
        and edges that do not rise.

    Notes
    -----
    Cost: 1 ms.
    """
    many, ends = np.asarray(counts, dtype=float), np.asarray(edges, dtype=float)
    if many.ndim != 1 or not len(many) or ends.shape != (len(many) + 1,):
        raise ArgumentError(
            "A03", f"counts, edges: expected (b,) and (b + 1,), got {many.shape}, {ends.shape}"
        )
    if not (np.isfinite(ends).all() and (np.diff(ends) > 0).all()):
        raise ArgumentError("A03", "edges: expected finite numbers that rise, got others")
    if logarithmic and ends[0] <= 0:
        raise ArgumentError("A02", f"edges: expected above 0 on a logarithm, got {ends[0]:g}")
    if not (many >= 0).all():
        raise ArgumentError("A02", "counts: expected none below 0 and no NaN, got others")
    high = max(float(many.max()), 10.0)
    panel = Panel(
        Axis(float(ends[0]), float(ends[-1]), _LEFT, width - _RIGHT, logarithmic),
        Axis(0.6, 1.3 * high, height - 44.0, 44.0, True),
    )
    parts = [
        text(width / 2, 15.0, cut(title, width - 16), "middle", weight="600"),
        *frame(panel, "samples", labels=True),
        _bars(panel, many, ends),
        text((_LEFT + width - _RIGHT) / 2, height - 8.0, cut(unit, width - 90), "middle"),
        *_isovalue(panel, isovalue),
    ]
    words = f"{title}. {int(many.sum())} samples from {_known(ends[0])} to {_known(ends[-1])}"
    words += "" if isovalue is None else f", isovalue {_known(isovalue)}"
    return document(width, height, words, parts)


def _checked(*arrays: ArrayLike) -> list[Floats]:
    """Columns that rise and curves over them, or ArgumentError A03."""
    found = [np.asarray(array, dtype=float) for array in arrays]
    if found[0].ndim != 1 or not len(found[0]) or len({array.shape for array in found}) > 1:
        raise ArgumentError(
            "A03", f"curves: expected equal shapes (C,), got {[array.shape for array in found]}"
        )
    if not (np.isfinite(found[0]).all() and (np.diff(found[0]) > 0).all()):
        raise ArgumentError("A03", "columns: expected finite numbers that rise, got others")
    return found


def _axis_of(curves: Sequence[Floats], logarithmic: bool, pixels: tuple[float, float]) -> Axis:
    """An axis for what is known of curves, logarithmic if it may and all is positive."""
    known = np.concatenate([curve[np.isfinite(curve)] for curve in curves])
    if not len(known):
        known = np.array([0.0, 1.0])
    logarithmic = logarithmic and bool((known > 0).all())
    return Axis(*span(known, logarithmic, 0.06), *pixels, logarithmic)


def _change_axis(change: Floats, noise: Floats, pixels: tuple[float, float]) -> Axis:
    """An axis in percent with 0 and the noise on it."""
    known = np.concatenate([change, noise, -noise, [0.0]])
    known = 100 * known[np.isfinite(known)]
    if not known.any():
        known = np.array([-1.0, 1.0])
    return _axis_of([known], False, pixels)


def _radius_axis(panel: Panel) -> list[str]:
    """Diffusion radii over a panel whose level axis are times."""
    x, top = panel.x, panel.y.end
    low, high = (float(diffusion_radius(time)) for time in (x.low, x.high))
    radii = Axis(low, high, x.start, x.end, True)
    parts = [text((x.start + x.end) / 2, top - 23, "diffusion radius 2√t (length)", "middle")]
    for value in spaced(radii):
        place = float(radii.place(value))
        parts.append(line(place, top - 4, place, top, 'stroke-opacity="0.6"'))
        parts.append(tick(place, top - 8, value, "middle", "radius"))
    return parts


def _signatures(
    panel: Panel, at: Floats, base: Floats, perturbed: Floats, chosen: float | None
) -> list[str]:
    """Both curves and their key; words if the perturbed one is unknown."""
    places = [panel.points(at, base), panel.points(at, perturbed)]
    parts = [
        curve(places[0], "base", 'stroke="currentColor" stroke-width="2.2"'),
        curve(places[1], "perturbed", f'stroke="{PERTURBED}" {_DASHED}'),
    ]
    entries = [("base", 'stroke="currentColor" stroke-width="2.2"')]
    entries += [("perturbed", f'stroke="{PERTURBED}" {_DASHED}')]
    if not np.isfinite(base).any():
        return words_in(panel, ["the signature here is unknown"])
    if not np.isfinite(perturbed).any():
        entries[1] = ("perturbed: no partner", 'stroke="none"')
    return parts + _key(panel, entries, places, chosen)


_DASHED = 'stroke-width="1.8" stroke-dasharray="6 3"'


def _change(
    panel: Panel, at: Floats, change: Floats, noise: Floats, chosen: float | None
) -> list[str]:
    """The change in percent within the band of its noise; words if it is unknown."""
    known = np.isfinite(change)
    if not known.any():
        return words_in(panel, _PARTNERLESS)
    zero = float(panel.y.place(0.0))
    left, _, wide, _ = panel.box
    places = panel.points(at, 100 * change)
    ends = [panel.points(at, sign * 100 * noise)[np.isfinite(noise)] for sign in (1, -1)]
    parts = [
        _band(ends),
        line(left, zero, left + wide, zero, 'stroke-opacity="0.6" stroke-dasharray="2 3"'),
        curve(places, "change", 'stroke="currentColor" stroke-width="2"'),
    ]
    entries = [("base − perturbed", 'stroke="currentColor" stroke-width="2"')]
    entries += [("± noise floor", 'stroke="currentColor" stroke-opacity="0.3" stroke-width="9"')]
    if not change[known].any():
        return parts + words_in(panel, ["no change at all"], 0.78)
    return parts + _key(panel, entries, [places, *ends], chosen)


def _band(ends: Sequence[Floats]) -> str:
    """What lies between two curves (C, 2)."""
    upper, lower = ends
    places = " ".join(f"{x:.2f},{y:.2f}" for x, y in np.concatenate([upper, lower[::-1]]))
    return (
        f'<polygon class="noise" points="{places}" fill="currentColor" fill-opacity="0.25" '
        'stroke="currentColor" stroke-opacity="0.25" stroke-width="1"/>'
    )


def _key(
    panel: Panel,
    entries: Sequence[tuple[str, str]],
    curves: Sequence[Floats],
    chosen: float | None,
) -> list[str]:
    """Names of curves beside pieces of their lines, as near to the curves as is free."""
    wide = 34 + WIDE * max(len(name) for name, _ in entries)
    x, y = free_place(panel, (wide, 17.0 * len(entries)), curves, chosen)
    parts = []
    for row, (name, look) in enumerate(entries):
        middle = y + 17.0 * row + 8.5
        parts.append(f'<path d="M{x:.2f} {middle:.2f}h24" fill="none" {look}/>')
        parts.append(text(x + 30, middle + 4, name, "start"))
    return parts


def _marker(chosen: float | None, top: float, bottom: float) -> list[str]:
    if chosen is None:
        return []
    return [
        f'<path class="marker" d="M{chosen:.2f} {top:.2f}V{bottom:.2f}" fill="none" '
        'stroke="currentColor" stroke-width="1.3" stroke-opacity="0.75"/>'
    ]


def _dots(curves: Iterable[tuple[Panel, Floats, Floats, str]], column: int) -> list[str]:
    """A dot on each curve at the chosen column, where it is known."""
    return [
        f'<circle cx="{panel.x.place(at[column]):.2f}" cy="{panel.y.place(values[column]):.2f}" '
        f'r="3.5" fill="{fill}"/>'
        for panel, at, values, fill in curves
        if np.isfinite(values[column])
    ]


def _bars(panel: Panel, counts: Floats, edges: Floats) -> str:
    """The bars of a histogram as one path; none for empty bins."""
    ends, floor = panel.x.place(edges), panel.y.start
    bars = [
        f"M{ends[k]:.2f} {floor:.2f}V{panel.y.place(counts[k]):.2f}H{ends[k + 1]:.2f}V{floor:.2f}Z"
        for k in np.flatnonzero(counts)
    ]
    return f'<path class="bars" d="{"".join(bars)}" fill="currentColor" fill-opacity="0.45"/>'


def _isovalue(panel: Panel, isovalue: float | None) -> list[str]:
    """The isovalue as a line with its number, or words that it lies outside."""
    if isovalue is None:
        return []
    words = f"isovalue {_known(isovalue)}"
    left, top, wide, high = panel.box
    if not panel.x.low <= isovalue <= panel.x.high:
        outside = f"{words} lies outside the values"
        return [text(left + wide / 2, top - 6, outside, "middle", weight="600")]
    x, half = float(panel.x.place(isovalue)), WIDE * len(words) / 2
    middle = min(max(x, left + half), left + wide - half)
    return [
        f'<path class="isovalue" d="M{x:.2f} {top:.2f}v{high:.2f}" fill="none" '
        f'stroke="{PERTURBED}" stroke-width="2.4"/>',
        text(middle, top - 6, words, "middle", weight="600"),
    ]


def _told(kind: SignatureKind, columns: Floats, change: Floats) -> str:
    """The chart in a sentence, for those who do not see it."""
    if not np.isfinite(change).any():
        return f"{kind.title} over {kind.axis}; {' '.join(_PARTNERLESS)}"
    most = int(np.nanargmax(np.abs(change)))
    where = f"{kind.axis} {_known(columns[most])}"
    if kind.per_time:
        where = f"diffusion radius {_known(float(diffusion_radius(columns[most])))}"
    largest = f"{_known(100 * change[most])} % of the mean at {where}"
    return f"{kind.title} of base and perturbed over {kind.axis}; largest change {largest}"


def _known(value: float) -> str:
    """A number to three digits, or unknown."""
    return said(float(f"{value:.3g}")) if np.isfinite(value) else "unknown"
