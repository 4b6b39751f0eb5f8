"""The surfaces of the page in small flat triangles, and the colour of each."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from matplotlib.colors import Colormap, to_hex
from numpy.typing import NDArray

from .. import color
from ..difference import change_norm
from ..errors import ArgumentError
from ..geometry import Bools, Floats, Ints, edges_of, node_places
from ..noise import SIGNIFICANCE
from ..records import Clusters, Surface
from ..view import _paint as paint
from ..view._tessellate import at_pieces, lattice, nearest_nodes, tessellate
from ._saved_result import SavedResult

Colors = NDArray[np.uint8]
Which = Literal["base", "perturbed"]

_STOPS = 9  # colours that tell a legend's bar
_SAME = 1e-6  # of a signature: smaller differences are the solver's, and are not painted


@dataclass(frozen=True, eq=False)
class Drawn:
    """A surface as the browser draws it: flat triangles that turn outward.

    Parameters
    ----------
    surface : Surface
        What is drawn.
    split : int
        Each element is cut into split^2 triangles; triangle j lies in element j // split^2.
    points, normals : array (p, 3)
        Normals of unit length.
    triangles : array (t, 3)
        Neighbours share points.
    nodes : array (p,)
        For each point the nearest node of its element.
    """

    surface: Surface
    split: int
    points: Floats
    normals: Floats
    triangles: NDArray[np.int32]
    nodes: NDArray[np.int32]


@dataclass(frozen=True)
class Legend:
    """What the colours of a painted surface mean.

    Parameters
    ----------
    title : str
        What is shown.
    low, high : float, optional
        Values of the first and of the last stop; None where colours are names, as of groups.
    unit : str
        Of these values.
    stops : tuple of str
        Colours from low to high, evenly spaced, as #rrggbb; of each group, where they are names.
    neutral : str
        Words for :data:`isovary.color.NEUTRAL`; empty if no triangle has it.
    unknown : str
        Words for :data:`isovary.color.UNKNOWN`; empty if no triangle has it.
    """

    title: str
    low: float | None
    high: float | None
    unit: str
    stops: tuple[str, ...]
    neutral: str = ""
    unknown: str = ""


@dataclass(frozen=True, eq=False)
class Painted:
    """A colour (t, 3) for each drawn triangle, 0 to 255, and what the colours mean."""

    colors: Colors
    legend: Legend


def drawn(surface: Surface, most: int = 60_000) -> Drawn:
    """The surface in as many small triangles as stay below a number.

    Parameters
    ----------
    surface : Surface
    most : int
        There are fewer triangles than this, unless the surface itself has more elements.

    Returns
    -------
    Drawn

    Raises
    ------
    ArgumentError
        A02 for a number below 1.

    Notes
    -----
    Cost: 60 ms for 10 000 nodes, in 46 000 triangles.

    Examples
    --------
    An icosahedron's 20 triangles make 20 * 3^2 = 180. Its 30 edges have two points each beside
    the 12 vertices, the triangles one inside, 12 + 60 + 20 = 92:

    >>> from isovary.shapes import icosphere
    >>> ball = icosphere(0, order=1)
    >>> shown = drawn(ball, most=181)
    >>> shown.split, len(shown.triangles), len(shown.points)
    (3, 180, 92)
    """
    if most < 1:
        raise ArgumentError("A02", f"most: expected 1 or more, got {most}")
    elements = len(surface.triangles)
    split = max(1, int(np.sqrt(max(most - 1, 0) / elements)))
    pieces = tessellate(surface, split)
    number = _places(surface, split)
    _, first, same = np.unique(number, return_index=True, return_inverse=True)
    return Drawn(
        surface,
        split,
        pieces.points[first],
        pieces.normals[first],
        same.ravel()[pieces.triangles].astype(np.int32),
        _nearest(surface, split)[first].astype(np.int32),
    )


def _places(surface: Surface, split: int) -> Ints:
    """A number for each point of each element's lattice, the same where elements meet."""
    barycentric = np.round(lattice(split)[0] * split).astype(np.int64)
    edges, of_triangle, _ = edges_of(surface.corners)
    nodes, step = len(surface.points), max(split - 1, 1)
    inside = nodes + len(edges) * step
    count = len(barycentric)
    numbers = inside + np.arange(len(surface.triangles))[:, None] * count + np.arange(count)
    for place, (a, b, c) in enumerate(barycentric.tolist()):
        zeros = [k for k, part in enumerate((a, b, c)) if part == 0]
        if len(zeros) == 2:
            numbers[:, place] = surface.corners[:, 3 - sum(zeros)]
        elif len(zeros) == 1:
            start, end = [(1, 2), (2, 0), (0, 1)][zeros[0]]
            edge = of_triangle[:, [1, 2, 0][zeros[0]]]
            forward = surface.corners[:, start] == edges[edge, 0]
            along = np.where(forward, (a, b, c)[end], (a, b, c)[start])
            numbers[:, place] = nodes + edge * step + along - 1
    return numbers.ravel()


def _nearest(surface: Surface, split: int) -> Ints:
    """The node of its own element that is nearest to each point of the lattices."""
    barycentric = lattice(split)[0]
    away = np.linalg.norm(barycentric[:, None] - node_places(surface.order), axis=2)
    nearest: Ints = surface.triangles[:, away.argmin(axis=1)].ravel()
    return nearest


def paint_signature(result: SavedResult, which: Which, column: int, shown: Drawn) -> Painted:
    """The signature of one surface at one column, on the scale of both surfaces.

    Parameters
    ----------
    result : SavedResult
    which : {"base", "perturbed"}
    column : int
        Of the signature, from 0.
    shown : Drawn
        That surface.

    Returns
    -------
    Painted
        All of one colour if the signature varies by less than a millionth.

    Raises
    ------
    ArgumentError
        A02 for a column that is not there or another surface, A03 if another surface is drawn.

    Notes
    -----
    Cost: 10 ms for 10 000 nodes.
    """
    _check_column(result, column)
    values = _own_signature(result, which)[:, column]
    _check_drawn(shown, len(values))
    both = np.concatenate(
        [result.base_signature[:, column], result.perturbed_own_signature[:, column]]
    )
    low, high = _range(both)
    inside = at_pieces(shown.surface, shown.split, values)
    share = (inside - low) / ((high - low) or 1.0)
    colors = paint.mapped(paint.NORM_MAP, share)
    unknown = ~np.isfinite(values)[nearest_nodes(shown.surface, shown.split)]
    colors[unknown] = paint.NO_PARTNER
    legend = Legend(
        f"{result.kind.title}, {which}",
        low,
        high,
        result.kind.unit,
        _stops(paint.NORM_MAP),
        unknown="unknown" if unknown.any() else "",
    )
    return Painted(_bytes(colors), legend)


def paint_change(result: SavedResult, column: int | None, factor: float, shown: Drawn) -> Painted:
    """The change at one column with its sign, or its norm over all columns.

    Parameters
    ----------
    result : SavedResult
    column : int, optional
        None for the mean of the change's size over all columns.
    factor : float
        What is not above so many times the noise floor is neutral; 0 shows everything.
    shown : Drawn
        The base.

    Returns
    -------
    Painted
        In percent of the mean signature. The scale ends at the largest change that is above
        the noise: of the norms, or of all columns, so that columns can be compared.

    Raises
    ------
    ArgumentError
        A02 for a column that is not there or a factor that is negative or not finite,
        A03 if another surface is drawn.

    Notes
    -----
    Cost: 20 ms for 10 000 nodes and 100 columns.
    """
    _check_factor(factor)
    _check_drawn(shown, len(result.change))
    mean = f"% of mean {result.kind.abbreviation}"
    if column is None:
        samples, limit = _norms(result, factor)
        title, low, used = "mean size of the change", 0.0, paint.NORM_MAP
        pieces = paint.spread(samples, shown.surface, shown.split)
        colors = paint.paint_norm(pieces, limit)
    else:
        _check_column(result, column)
        samples, limit = _at_column(result, column, factor)
        title, low, used = "change, base − perturbed", -limit, paint.MOVE_MAP
        pieces = paint.spread(samples, shown.surface, shown.split)
        colors = paint.mapped(used, 0.5 + pieces.norm / (2 * (limit or 1.0)))
        colors[~(pieces.margin > 0)] = paint.NEUTRAL
        colors[pieces.known == 0] = paint.NO_PARTNER
    neutral = ((pieces.margin <= 0) & (pieces.known > 0)).any()
    legend = Legend(
        title,
        100 * low,
        100 * limit,
        mean,
        _stops(used),
        neutral=_below(factor) if neutral else "",
        unknown=_unknown_words(pieces),
    )
    return Painted(_bytes(colors), legend)


def paint_groups(
    result: SavedResult,
    clusters: Clusters,
    shown: Drawn,
    *,
    factor: float | None = None,
    palette: Floats | None = None,
) -> Painted:
    """Each group in its colour, mixed by memberships where there are some.

    Parameters
    ----------
    result : SavedResult
    clusters : Clusters
        Labels (n,), centers (k, C).
    shown : Drawn
        The base.
    factor : float, optional
        What is not above so many times the noise floor is neutral, too.
    palette : array (k, 3), optional
        0 to 1. Default: :func:`isovary.color.group_colors`.

    Returns
    -------
    Painted

    Raises
    ------
    ArgumentError
        A02 for a factor that is negative or not finite, A03 for shapes that do not fit.

    Notes
    -----
    Cost: 30 ms for 10 000 nodes, 100 columns and 12 groups.
    """
    count = len(clusters.centers)
    colors = color.group_colors(count) if palette is None else np.asarray(palette, dtype=float)
    _check_drawn(shown, len(result.change))
    if clusters.labels.shape != result.labels.shape or colors.shape != (count, 3):
        raise ArgumentError(
            "A03",
            f"clusters, palette: expected labels {result.labels.shape} and colours ({count}, 3), "
            f"got {clusters.labels.shape} and {colors.shape}; group this result",
        )
    if factor is not None:
        _check_factor(factor)
        above = _above(result.change_norm, change_norm(result.noise_floor), factor)
        labels = np.where(above, clusters.labels, -1)
        clusters = Clusters(labels, clusters.centers, clusters.memberships)
    samples = _samples(result, clusters, SIGNIFICANCE if factor is None else factor)
    pieces = paint.spread(samples, shown.surface, shown.split)
    none = (pieces.known > 0) & (pieces.groups < 0)
    legend = Legend(
        "groups of nodes that changed alike",
        None,
        None,
        "",
        tuple(to_hex(rgb) for rgb in colors),
        neutral="no group" if none.any() else "",
        unknown=_unknown_words(pieces),
    )
    return Painted(_bytes(paint.paint_groups(pieces, colors)), legend)


def _norms(result: SavedResult, factor: float) -> tuple[paint.Samples, float]:
    """What is known of the norm of the change, and the largest that is shown."""
    none = Clusters(np.full(len(result.labels), -1), np.empty((0, len(result.columns))))
    samples = _samples(result, none, factor)
    limit = _largest(samples.norm[(samples.margin > 0) & (samples.known > 0)])
    if factor == 0:  # curved elements dip below their nodes' values
        samples = replace(samples, margin=np.ones(len(samples.norm)))
    return samples, limit


def _at_column(result: SavedResult, column: int, factor: float) -> tuple[paint.Samples, float]:
    """The same with the signed change of a column for the norm; the largest of all columns."""
    samples, _ = _norms(result, factor)
    change, noise = result.change[:, column], result.noise_floor[:, column]
    above = _above(np.abs(change), noise, factor)
    excess = np.abs(np.nan_to_num(np.abs(change) - factor * noise)) + np.finfo(float).tiny
    clear = np.abs(result.change)
    shown = clear[_above(clear, result.noise_floor, factor)]
    margin = np.where(above, excess, -excess) if factor > 0 else samples.margin
    return replace(samples, norm=change, noise=noise, margin=margin), _largest(shown)


def _samples(result: SavedResult, clusters: Clusters, factor: float) -> paint.Samples:
    return paint.samples_of(
        result.change,
        result.noise_floor,
        clusters,
        significant=_above(result.change_norm, change_norm(result.noise_floor), factor),
        found=result.found,
        distance=result.distance,
        factor=factor,
    )


def _above(size: Floats, noise: Floats, factor: float) -> Bools:
    """Where a size exceeds so many times the noise; all that is known for a factor of 0."""
    above: Bools = np.isfinite(size) if factor == 0 else size > factor * noise
    return above


def _largest(values: Floats) -> float:
    return float(values.max(initial=0.0))


def _range(values: Floats) -> tuple[float, float]:
    """Smallest and largest known value; twice the same if they hardly differ."""
    known = values[np.isfinite(values)]
    if not len(known):
        return 0.0, 0.0
    low, high = float(known.min()), float(known.max())
    if high - low <= _SAME * max(abs(low), abs(high)):
        return high, high
    return low, high


def _own_signature(result: SavedResult, which: Which) -> Floats:
    if which not in ("base", "perturbed"):
        raise ArgumentError("A02", f"which: expected base or perturbed, got {which}")
    return result.base_signature if which == "base" else result.perturbed_own_signature


def _below(factor: float) -> str:
    """Words for what is not shown.

    Examples
    --------
    >>> _below(2.0), _below(1.0)
    ('not above 2 times the noise', 'not above the noise')
    """
    return "not above the noise" if factor == 1 else f"not above {factor:g} times the noise"


def _unknown_words(pieces: paint.Samples) -> str:
    if (pieces.known > 0).all():
        return ""
    return "no partner: unknown" if (pieces.found == 0).any() else "unknown"


def _stops(colors: Colormap) -> tuple[str, ...]:
    return tuple(to_hex(rgb) for rgb in paint.mapped(colors, np.linspace(0.0, 1.0, _STOPS)))


def _bytes(colors: Floats) -> Colors:
    return np.round(255 * colors).astype(np.uint8)


def _check_column(result: SavedResult, column: int) -> None:
    if not 0 <= column < len(result.columns):
        raise ArgumentError(
            "A02", f"column: expected one of 0 to {len(result.columns) - 1}, got {column}"
        )


def _check_factor(factor: float) -> None:
    if not (np.isfinite(factor) and factor >= 0):
        raise ArgumentError("A02", f"factor: expected a number, 0 or more, got {factor}")


def _check_drawn(shown: Drawn, nodes: int) -> None:
    if len(shown.surface.points) != nodes:
        raise ArgumentError(
            "A03",
            f"shown: expected a surface of {nodes} nodes, got {len(shown.surface.points)}; "
            "draw the one that is painted",
        )
