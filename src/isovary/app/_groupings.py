"""Groups for every number of groups, as the comparison itself would have made them."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np
from matplotlib.colors import to_hex

from .. import clustering as clusterings
from ..color import group_colors, nested_colors
from ..errors import ArgumentError
from ..geometry import Floats, node_areas
from ..groups import Clustering, group_table, groups_above_noise
from ..records import Clusters
from ..signature import diffusion_radius
from ._saved_result import SavedResult

COUNTS = range(2, 13)
"""Numbers of groups that the page offers."""

_CLUSTERINGS: dict[str, Clustering] = {
    method.__name__: method
    for method in (
        clusterings.k_medians,
        clusterings.k_medoids,
        clusterings.fuzzy_c_means,
        clusterings.agglomerative,
        clusterings.deterministic_annealing,
        clusterings.norm_bins,
    )
}


def groupings(
    result: SavedResult, counts: Iterable[int] = COUNTS
) -> Iterator[tuple[int, Clusters]]:
    """Groups of the significant nodes for each count, each as soon as it is there.

    The method, its options, its seed and the weights are those of the comparison: for the
    count that it was asked for the groups are its own. As there, nodes below the noise have no
    group, and there are fewer groups than asked for where they would differ by less than noise.

    Parameters
    ----------
    result : SavedResult
    counts : iterable of int
        In this order; see :func:`counts_around`.

    Yields
    ------
    int, Clusters
        The count and labels (n,), centers (k, C) with k up to the count.

    Raises
    ------
    ArgumentError
        A02 for a count below 1 or a method that is not isovary's: :func:`saved_groups` has what
        the file holds.

    Notes
    -----
    Each count is clustered once, however many others fall back to it.
    """
    clustering = _remembered(clustering_of(result))
    weights = None
    if result.choices.get("area_weighted"):
        weights = node_areas(result.base.points, result.base.triangles)
    for count in counts:
        if count < 1:
            raise ArgumentError("A02", f"counts: expected 1 or more, got {count}")
        found = groups_above_noise(
            result.change, result.noise_floor, result.significant, count, clustering, weights
        )
        yield count, found


def _remembered(clustering: Clustering) -> Clustering:
    """The same method of the same rows, which keeps its answer for each count."""
    found: dict[int, Clusters] = {}

    def grouped(rows: Floats, count: int, **options: Any) -> Clusters:
        if count not in found:
            found[count] = clustering(rows, count, **options)
        return found[count]

    return grouped


def clustering_of(result: SavedResult) -> Clustering:
    """The method that grouped a result, with its options and its seed.

    Parameters
    ----------
    result : SavedResult

    Returns
    -------
    callable

    Raises
    ------
    ArgumentError
        A02 for a method that is not isovary's.
    """
    words, seed = str(result.choices.get("clustering")), result.choices.get("seed")
    name, options = _call(words)
    if name not in _CLUSTERINGS or not isinstance(seed, int):
        raise ArgumentError(
            "A02",
            f"clustering: expected one of {', '.join(_CLUSTERINGS)} and a seed, got {words[:80]} "
            f"and {seed}; its groups can be shown, but not others",
        )
    return partial(_CLUSTERINGS[name], rng=seed, **options)


def _call(words: str) -> tuple[str, dict[str, Any]]:
    """Name and options of a method as :func:`isovary.methods.method_name` writes it.

    Examples
    --------
    >>> _call("k_medians(metric='l2')")
    ('k_medians', {'metric': 'l2'})
    >>> _call("k_medians"), _call("k_medians(rng=print('no'))"), _call("<lambda>")
    (('k_medians', {}), ('', {}), ('', {}))
    """
    try:
        tree = ast.parse(words, mode="eval").body
        if isinstance(tree, ast.Name):
            return tree.id, {}
        if isinstance(tree, ast.Call) and isinstance(tree.func, ast.Name) and not tree.args:
            options = {str(k.arg): ast.literal_eval(k.value) for k in tree.keywords}
            return tree.func.id, options
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        pass
    return "", {}


def counts_around(count: int, counts: Iterable[int] = COUNTS) -> list[int]:
    """The counts in the order in which somebody is likely to look at them: the nearest first.

    Examples
    --------
    >>> counts_around(4, range(2, 8))
    [4, 5, 3, 6, 2, 7]
    """
    return sorted(counts, key=lambda other: (abs(other - count), -other))


def saved_groups(result: SavedResult) -> Clusters:
    """The groups in the file, around the medians of their rows.

    Parameters
    ----------
    result : SavedResult

    Returns
    -------
    Clusters
        Without the memberships of soft groups, which are not in the file.
    """
    rows = [result.change[result.labels == number] for number in range(result.count)]
    width = result.change.shape[1]
    centers = [np.median(row, axis=0) if len(row) else np.full(width, np.inf) for row in rows]
    return Clusters(result.labels, np.array(centers).reshape(-1, width))


def palettes(found: Mapping[int, Clusters], start: int, areas: Floats) -> dict[int, Floats]:
    """Colours for each count, such that a group keeps its own when the count changes.

    The count ``start`` has the colours of the pictures, :func:`isovary.color.group_colors`;
    from there they are handed on to the next larger counts, and to the next smaller ones, by
    :func:`isovary.color.nested_colors`.

    Parameters
    ----------
    found : mapping of int to Clusters
        By count. If counts are added in the order of :func:`counts_around`, the colours of
        those before stay.
    start : int
        One of them.
    areas : array (n,)
        Of the nodes: the group that shares the largest area continues one.

    Returns
    -------
    dict of int to array (k, 3)
        0 to 1.

    Raises
    ------
    ArgumentError
        A02 if ``start`` is not among the counts.

    Examples
    --------
    Of two groups the larger one splits; three of four nodes stay blue:

    >>> two = Clusters([0, 1, 1, 1], [[0.0], [1.0]])
    >>> three = Clusters([0, 1, 2, 2], [[0.0], [1.0], [2.0]])
    >>> made = palettes({2: two, 3: three}, 2, np.ones(4))
    >>> bool((made[3][[0, 2]] == made[2]).all())
    True
    """
    if start not in found:
        raise ArgumentError("A02", f"start: expected one of {sorted(found)}, got {start}")
    up = [count for count in sorted(found) if count >= start]
    down = [count for count in sorted(found, reverse=True) if count <= start]
    made: dict[int, Floats] = {}
    for chain in (up, down):
        labels = [found[count].labels for count in chain]
        colors = nested_colors(labels, weights=areas)
        made |= {
            count: _filled(own, len(found[count].centers))
            for count, own in zip(chain, colors, strict=True)
        }
    return made


def _filled(colors: Floats, count: int) -> Floats:
    """Colours for all groups, if the last ones hold no node."""
    return np.vstack([colors, group_colors(count)[len(colors) :]])


def group_rows(
    result: SavedResult, clusters: Clusters, palette: Floats | None = None
) -> list[dict[str, Any]]:
    """A row for each group, from the one that changed most.

    Parameters
    ----------
    result : SavedResult
    clusters : Clusters
    palette : array (k, 3), optional
        Default: :func:`isovary.color.group_colors`.

    Returns
    -------
    list of dict
        ``number`` (the label), ``rank`` (1 changed most), ``nodes``, ``color`` (#rrggbb),
        ``area_percent``, ``area`` (length^2, of the curved surface), ``mean_change_percent``
        (mean norm), ``column`` (where the group stands out), ``at`` (that column on its axis),
        ``radius`` (the same as a diffusion radius, length; None where columns are no times),
        ``change_percent`` (median there, base minus perturbed) and ``place`` (three
        coordinates of the node that changed most). Plain numbers, ready for JSON.

    Notes
    -----
    Cost: 20 ms for 10 000 nodes and 100 columns.
    """
    colors = group_colors(len(clusters.centers)) if palette is None else palette
    area = result.base.area
    rows: list[dict[str, Any]] = [
        {
            "number": group.number,
            "rank": group.rank,
            "nodes": group.nodes,
            "color": to_hex(colors[group.number]),
            "area_percent": 100 * group.area_share,
            "area": group.area_share * area,
            "mean_change_percent": 100 * group.mean_change,
            "column": group.column,
            "at": float(result.columns[group.column]),
            "radius": _radius(result, group.column),
            "change_percent": 100 * group.change,
            "place": [float(x) for x in group.place],
        }
        for group in group_table(result.base, clusters, result.change)
    ]
    return sorted(rows, key=lambda row: int(row["rank"]))


def _radius(result: SavedResult, column: int) -> float | None:
    """The diffusion radius of a column, if columns are times."""
    if not result.kind.per_time:
        return None
    return float(diffusion_radius(result.columns[column]))
