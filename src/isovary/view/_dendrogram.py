"""The tree of merges of a grouping, and where it is cut."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from ..clustering import Dendrogram
from ..color import group_colors
from ..errors import ArgumentError
from ..geometry import Floats, Ints
from ._marks import INK, SOFT, fit_line

_SIZE, _DPI = (12.8, 7.2), 160
_ABOVE = -1  # group of a merge of several groups
_ROOM = 1.08  # of the highest merge


def dendrogram_figure(
    tree: Dendrogram, count: int, *, last: int = 30, title: str | None = None
) -> Figure:
    """One figure of the last merges of a tree, with the groups below the cut in their colours.

    Parameters
    ----------
    tree : Dendrogram
        Of :func:`isovary.dendrogram`.
    count : int
        Number of groups at which the tree is cut.
    last : int
        Leaves that are drawn, one more than merges; what merged before stands at the bottom,
        with its number of rows.
    title : str, optional
        What was merged, for the line below the heading; the heading says how clear the cut is.

    Returns
    -------
    matplotlib.figure.Figure
        12.8 x 7.2 inches at 160 dots per inch; belongs to no window.

    Raises
    ------
    ArgumentError
        A02 for a count below 1, or fewer leaves than 2 or than groups.
    ClusterError
        K02 if fewer distinct rows than groups were merged.

    Notes
    -----
    The groups have the numbers of ``tree.cut(count)`` and the colours of
    :func:`isovary.group_colors`, as in :func:`overview`. The dashed line lies in the middle of
    the heights that give so many groups; the longer they are, the clearer the number.

    Cost: 0.5 s.
    """
    if last < max(2, count):
        raise ArgumentError(
            "A02", f"last: expected {max(2, count)} or more for {count} groups, got {last}"
        )
    groups = tree.cut(count).labels[tree.rows.known]
    leaves = leaf_groups(tree, groups, count)
    figure = Figure(figsize=_SIZE, dpi=_DPI, facecolor="white")
    found = int(leaves.max()) + 1
    low, high = cut_range(tree.merges[:, 2], found)
    words = heading(found, low, high)
    fit_line(figure, 0.02, 0.975, words, 0.96, size=15, weight="bold", color=INK)
    rows = f"{len(groups)} rows" + (
        f", {len(leaves)} of them merged" if len(leaves) < len(groups) else ""
    )
    said = "   ·   ".join([*([title] if title else []), rows, "numbers below: rows merged there"])
    fit_line(figure, 0.02, 0.92, said, 0.96, size=10, color=SOFT)
    axes = figure.add_axes((0.075, 0.085, 0.905, 0.775))
    if len(tree.merges):
        _draw_tree(axes, tree.merges, leaves, last)
        _draw_cut(axes, low, high, found)
    axes.set_ylabel(f"distance at which two groups merge ({tree.metric})")
    _key(axes, np.bincount(groups, minlength=found))
    return figure


def leaf_groups(tree: Dendrogram, groups: Ints, count: int) -> Ints:
    """Group of each merged row (s,), from those of all known rows (m,)."""
    if len(tree.merges) == 0:
        return groups[:1]
    from scipy.cluster import hierarchy

    names = hierarchy.fcluster(tree.merges, count, "maxclust")
    renamed: Ints = np.zeros(names.max() + 1, dtype=np.int64)
    renamed[names[tree.nearest]] = groups
    leaves: Ints = renamed[names]
    return leaves


def node_groups(merges: Floats, leaves: Ints) -> Ints:
    """Group (2 s - 1,) of each leaf and merge, -1 where a merge joins several."""
    groups = list(leaves)
    for first, second in merges[:, :2].astype(int):
        groups.append(groups[first] if groups[first] == groups[second] else _ABOVE)
    return np.array(groups)


def cut_range(heights: Floats, count: int) -> tuple[float, float]:
    """The heights between which a cut leaves so many groups."""
    ends = np.concatenate([[0.0], heights])
    highest = ends[-1] * (_ROOM if count == 1 else 1.0)
    return float(ends[len(ends) - count]), float([*ends, highest][len(ends) - count + 1])


def heading(count: int, low: float, high: float) -> str:
    """How clear the number of groups is, in one sentence."""
    if count == 1:
        return "One group"
    ratio = f"{high / low:.2g} times that distance" if low > 0 else "any distance"
    return f"{count} groups: merged up to {low:.3g}; the next merge needs {ratio}"


def _draw_tree(axes: Axes, merges: Floats, leaves: Ints, last: int) -> None:
    from scipy.cluster import hierarchy

    groups = node_groups(merges, leaves)
    palette = [*map(tuple, group_colors(int(leaves.max()) + 1)), INK]
    drawn: dict[str, Any] = hierarchy.dendrogram(
        merges,
        p=last,
        truncate_mode="lastp",
        no_plot=True,
        show_leaf_counts=True,
        link_color_func=lambda node: str(groups[node]),
    )
    bends = np.stack([drawn["icoord"], drawn["dcoord"]], axis=-1)
    colors = [palette[int(name)] for name in drawn["color_list"]]
    axes.add_collection(LineCollection(list(bends), colors=colors, linewidths=1.8))
    ends = drawn["leaves"]
    places = 5.0 + 10.0 * np.arange(len(ends))
    foot = [palette[groups[node]] for node in ends]
    axes.scatter(places, np.zeros(len(ends)), 40, color=foot, clip_on=False, zorder=3)
    axes.set_xticks(places, [word.strip("()") if "(" in word else "1" for word in drawn["ivl"]])
    axes.tick_params(axis="x", length=0, labelsize=8, pad=8)
    axes.tick_params(axis="y", labelsize=8)
    axes.set_xlim(0, 10 * len(ends))
    axes.set_ylim(0, _ROOM * merges[-1, 2] or 1.0)
    axes.spines[["top", "right", "bottom"]].set_visible(False)


def _draw_cut(axes: Axes, low: float, high: float, count: int) -> None:
    """The dashed line half way through the range, which is shaded."""
    axes.axhspan(low, high, color="#f0f0f0", lw=0, zorder=0)
    axes.axhline((low + high) / 2, color=SOFT, lw=1, ls=(0, (4, 3)), zorder=1)
    words = f"{count} groups" if count > 1 else "one group"
    right = axes.get_xlim()[1]
    axes.annotate(
        words,
        (right, (low + high) / 2),
        xytext=(0, 2),
        textcoords="offset points",
        ha="right",
        size=8.5,
        color=SOFT,
    )


def _key(axes: Axes, sizes: Ints) -> None:
    """Each group's colour and number of rows."""
    for group, (color, size) in enumerate(zip(group_colors(len(sizes)), sizes, strict=True)):
        axes.plot([], [], "o", color=tuple(color), label=f"group {group}: {size} rows")
    axes.legend(frameon=False, fontsize=8.5, loc="upper right", handletextpad=0.3)
