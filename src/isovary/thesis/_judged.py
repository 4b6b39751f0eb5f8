"""HKS vectors of a meshed spheroid, judged by the exact ones."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm

from ..geometry import Floats, Ints, linear_triangles, with_midpoints
from ..laplacian import fem
from ..records import Surface
from ..signature import heat_kernel_signature
from ..spectrum import eigenpairs
from ._pair_norms import BINS, DRAWN, drawn, pair_histogram
from ._spheroid import Spheroid
from ._steps import Operator

PERCENT = "norm of difference (% of mean)"
"""Of the axis of a histogram."""

MESH_COLOR = np.array([0.86, 0.88, 0.91])
"""Of a surface under the lines of its mesh."""


@dataclass(frozen=True, eq=False)
class Judged:
    """Vectors of one mesh and one operator.

    Parameters
    ----------
    name : str
    surface : Surface
    rows : array (n, T)
        Over the length of the mean exact vector, as are all that follow.
    errors : array (n,)
        L2 norm over the times of the difference from the exact vector, in percent.
    error : float
        Its root mean square over the surface, in percent.
    """

    name: str
    surface: Surface
    rows: Floats
    errors: Floats
    error: float

    def histogram(self, top: float) -> Floats:
        """Shares (BINS,) of all pairs by the norm of their difference, 0 to top percent."""
        return pair_histogram(100 * self.rows, top)


def judge(
    name: str, surface: Surface, truth: Spheroid, pairs: int, operator: Operator = fem
) -> Judged:
    """Signature from some eigenpairs at the exact spheroid's times, and its errors."""
    laplacian = operator(surface)
    solved = eigenpairs(laplacian, pairs)
    rows = heat_kernel_signature(solved, truth.times) / truth.length
    errors = 100 * np.linalg.norm(rows - truth.at(surface.points) / truth.length, axis=1)
    areas = np.asarray(laplacian.mass.sum(axis=1)).ravel()
    areas = np.maximum(areas, 0)  # that of a curved triangle's corner vanishes
    return Judged(name, surface, rows, errors, float(np.sqrt(areas @ errors**2 / areas.sum())))


def exact_histogram(truth: Spheroid, top: float, weights: Floats | None = None) -> Floats:
    """Shares of all pairs of points, by area or with the weights (c,) of the meridian's places."""
    rows = 100 * truth.rows / truth.length
    return pair_histogram(rows, top, truth.areas if weights is None else weights)


def reach(rows: Floats) -> float:
    """Largest norm of a difference of two rows, nearly."""
    far = rows[np.linalg.norm(rows - rows.mean(axis=0), axis=1).argmax()]
    return float(np.linalg.norm(rows - far, axis=1).max())


def common_top(truth: Spheroid, judged: Sequence[Judged]) -> float:
    """End of the histograms that holds all pairs, in percent."""
    exact = truth.rows / truth.length
    return 105 * max(reach(rows) for rows in (exact, *(one.rows for one in judged)))


def flat(surface: Surface) -> Surface:
    """The flat triangles between a curved mesh's corners."""
    count = int(surface.corners.max()) + 1
    return Surface(surface.points[:count], surface.corners)


def curved(surface: Surface, half_axis: float) -> Surface:
    """The mesh with its nodes on the spheroid, edge midpoints included."""
    points, triangles = with_midpoints(surface.points, surface.corners)
    stretch = np.array([1.0, 1.0, half_axis])
    unit = points / stretch
    return Surface(unit / np.linalg.norm(unit, axis=1)[:, None] * stretch, triangles)


def in_pieces(surface: Surface) -> Surface:
    """Flat triangles through all nodes, for colours that must not overshoot between them."""
    if surface.order == 1:
        return surface
    return Surface(surface.points, linear_triangles(surface.triangles))


def error_colors(errors: Floats, low: float, high: float) -> Floats:
    """Colours (n, 3) of errors on a logarithmic scale; see ``error_bar``."""
    colors: Floats = colormaps["cividis"](LogNorm(low, high, clip=True)(errors))[:, :3]
    return colors


def error_bar(axes: Axes, low: float, high: float) -> None:
    """Scale of the errors' colours, below a surface."""
    from matplotlib.cm import ScalarMappable

    place = axes.inset_axes((0.2, -0.09, 0.6, 0.035))
    scale = ScalarMappable(LogNorm(low, high), "cividis")
    bar = axes.figure.colorbar(scale, cax=place, orientation="horizontal")
    bar.set_label("error of the HKS vector (%)", size=8.5)
    ticks = (10.0 ** np.arange(np.log10(low), np.log10(high) + 0.5, 2)).tolist()
    bar.set_ticks(ticks, labels=[f"{tick:g}" for tick in ticks])
    bar.ax.tick_params(labelsize=8)


def draw_histogram(axes: Axes, shares: Floats, top: float, **style: object) -> None:
    """Outline of a histogram, as percent of the pairs in each of the drawn bins."""
    edges = np.linspace(0, top, DRAWN + 1)
    axes.stairs(100 * drawn(shares), edges, **style)  # type: ignore[arg-type]


def draw_spike(axes: Axes, one: Judged, bins: Floats, **style: object) -> None:
    """Histogram of all pairs over logarithmic bins, each method to its own accuracy."""
    top = 105 * reach(one.rows)
    middles = (np.arange(BINS) + 0.5) * top / BINS
    shares = np.histogram(middles, bins, weights=one.histogram(top))[0]
    axes.stairs(100 * shares, bins, **style)  # type: ignore[arg-type]


def draw_spikes(
    axes: Axes, sphere: Sequence[Judged], last: float, styles: Iterable[tuple[str, str, str]]
) -> None:
    """Histograms of a sphere's pairs, each with its colour, name and the side that stands on."""
    bins = np.geomspace(min(1e-4, mean_norm(sphere[2]) / 30), last, 120)
    for one, (color, name, side) in zip(sphere, styles, strict=True):
        draw_spike(axes, one, bins, color=color, fill=True, alpha=0.75)
        label = axes.text(mean_norm(one), 0.93, name, transform=axes.get_xaxis_transform())
        label.set(color=color, ha=side, weight="bold")
    axes.margins(y=0.2)
    axes.set_xscale("log")


def valences(surface: Surface) -> Ints:
    """Number of triangles (v,) around each corner of a closed mesh."""
    return np.bincount(surface.corners.ravel())


def regular_errors(one: Judged) -> tuple[float, float]:
    """Mean errors in percent where six triangles meet, and at the other vertices."""
    regular = valences(one.surface) == 6
    return float(one.errors[regular].mean()), float(one.errors[~regular].mean())


def between_valences(one: Judged) -> tuple[float, float]:
    """Mean norms of the pairs of two vertices of six neighbours, and of one with one of others."""
    rows, regular = 100 * one.rows, valences(one.surface) == 6
    six, others = rows[regular], rows[~regular]
    top = 1.05 * reach(six)
    inside = pair_histogram(six, top) @ (np.arange(BINS) + 0.5) * top / BINS
    across = np.sqrt((six**2).sum(axis=1)[:, None] + (others**2).sum(axis=1) - 2 * six @ others.T)
    return float(inside), float(across.mean())


def mean_norm(one: Judged) -> float:
    """Mean over all pairs, in percent: the distance of the histogram from a spike at 0."""
    top = 105 * reach(one.rows)
    return float(one.histogram(top) @ (np.arange(BINS) + 0.5) * top / BINS)
