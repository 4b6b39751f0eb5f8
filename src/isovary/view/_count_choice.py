"""How many groups: silhouette, stability and gap against the number of groups."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from ..clustering import CountChoice
from ..geometry import Floats, Ints
from ._curves import BASE_COLOR, PERTURBED_COLOR, calm
from ._marks import INK, SOFT, caption, fit_line

_SIZE, _DPI = (10.8, 4.2), 160
_BOTTOM, _HEIGHT, _RIGHT, _SPACE = 0.16, 0.52, 0.975, 0.075


def count_choice_figure(choice: CountChoice, title: str | None = None) -> Figure:
    """One figure of a choice of the number of groups: each measure against the number.

    Silhouette and gap with bars of their standard error, stability without; the number that
    each of the two speaks for has a ring.

    Parameters
    ----------
    choice : CountChoice
        Without a gap there are two panels instead of three.
    title : str, optional
        What was grouped, for the line below the heading; the heading says which number.

    Returns
    -------
    matplotlib.figure.Figure
        10.8 x 4.2 inches at 160 dots per inch; belongs to no window.

    Examples
    --------
    >>> choice = CountChoice([2, 3], [0.4, 0.8], [0.01, 0.01], [0.9, 1.0])
    >>> figure = count_choice_figure(choice)
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['mean silhouette', 'adjusted Rand index']
    """
    figure = Figure(figsize=_SIZE, dpi=_DPI, facecolor="white")
    fit_line(figure, 0.02, 0.965, _message(choice), 0.96, size=14, weight="bold", color=INK)
    words = "   ·   ".join(part for part in (title, _reason(choice)) if part)
    fit_line(figure, 0.02, 0.875, words, 0.96, size=9.5, color=SOFT)
    counts, one = choice.counts, np.append(1, choice.counts)
    panels = _panels(figure, 2 if choice.gap is None else 3)
    _draw(panels[0], counts, choice.silhouette, choice.error, choice.best)
    _title(figure, panels[0], "a", "Apart? Silhouette", "mean silhouette")
    _draw(panels[1], counts, choice.stability, None, choice.best)
    _title(figure, panels[1], "b", "Repeatable? Stability", "adjusted Rand index")
    panels[1].set_ylim(min(0.0, 1.1 * float(np.nanmin(choice.stability))), 1.06)
    if choice.gap is not None:
        _draw(panels[2], one, choice.gap, choice.gap_error, choice.best_gap)
        _title(figure, panels[2], "c", "More than one? Gap", "gap of log spread")
    for axes in panels:
        axes.set_xlim(float(one[0]) - 0.4, float(one[-1]) + 0.4)
        axes.set_xlabel("number of groups", size=9)
    return figure


def _message(choice: CountChoice) -> str:
    """The number, in one sentence."""
    if choice.best < 0:
        return "No number of groups: no run found more than one"
    at = choice.counts.tolist().index(choice.best)
    words = f"{choice.best} groups by the silhouette, stability {choice.stability[at]:.2f}"
    if choice.best_gap == choice.best:
        return f"{words}; the gap agrees"
    if choice.best_gap == 1:
        return f"{words}; by the gap one: no clear clumps"
    return f"{words}; {choice.best_gap} by the gap" if choice.best_gap > 0 else words


def _reason(choice: CountChoice) -> str:
    """How to read the rings."""
    words = "ring: fewest groups within one standard error of the highest silhouette"
    return words if choice.best_gap < 0 else f"{words} (a), of the next gap (c)"


def _panels(figure: Figure, count: int) -> list[Axes]:
    wide = _RIGHT / count - _SPACE
    lefts = [_SPACE + k * (wide + _SPACE) for k in range(count)]
    return [figure.add_axes((left, _BOTTOM, wide, _HEIGHT)) for left in lefts]


def _title(figure: Figure, axes: Axes, letter: str, words: str, label: str) -> None:
    box = axes.get_position()
    caption(figure, box.x0 - 0.045, box.y1 + 0.085, letter, words)
    axes.set_ylabel(label, size=9)


def _draw(axes: Axes, counts: Ints, values: Floats, error: Floats | None, best: int) -> None:
    """Points with their errors, joined, and a ring around the best with its number."""
    axes.plot(counts, values, color=BASE_COLOR, lw=1.4, marker="o", ms=4.5)
    if error is not None:
        axes.errorbar(counts, values, error, color=BASE_COLOR, lw=0, elinewidth=1.2, capsize=3)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.tick_params(labelsize=8.5, length=2)
    calm(axes)
    axes.margins(y=0.18)
    place = np.flatnonzero(counts == best)
    if len(place) == 0:
        return
    value = float(values[place[0]])
    axes.axvline(best, color=PERTURBED_COLOR, lw=1, ls=(0, (4, 2)), zorder=1)
    axes.plot(best, value, "o", ms=12, mfc="none", mec=PERTURBED_COLOR, mew=2)
    axes.annotate(
        str(best),
        (best, 1.0),
        xycoords=("data", "axes fraction"),
        xytext=(0, 2),
        textcoords="offset points",
        ha="center",
        va="bottom",
        size=10,
        weight="bold",
        color=PERTURBED_COLOR,
    )
