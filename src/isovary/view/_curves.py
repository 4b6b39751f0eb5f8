"""The curves of the overview: signatures of both surfaces at one point, and their change."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from ..comparison import Comparison
from ..geometry import Floats
from ..signature import diffusion_radius

BASE_COLOR, PERTURBED_COLOR, NOISE_COLOR = "#222222", "#d55e00", "#b0b0b0"


@dataclass(frozen=True, eq=False)
class Curves:
    """Signatures, change and noise (T,) at one node, or the medians over all nodes."""

    base: Floats
    perturbed: Floats
    change: Floats
    noise: Floats


def curves_at(result: Comparison, node: int | None) -> Curves:
    """Curves of a node; of the median over the nodes if it is None."""
    arrays = (
        result.base_signature,
        result.perturbed_signature,
        result.change,
        result.noise_floor,
    )
    if node is not None:
        return Curves(*(array[node] for array in arrays))
    return Curves(*(np.nanmedian(array, axis=0) for array in arrays))


def diffusion_time(radius: Floats) -> Floats:
    """The time in which heat spreads over a radius."""
    return radius**2 / 4


def draw_signatures(axes: Axes, result: Comparison, curves: Curves) -> None:
    """Both signatures over their columns, with the diffusion radius of the times on top."""
    kind, columns = result.methods.kind, result.columns
    axes.plot(columns, curves.base, color=BASE_COLOR, lw=2.2, label="base")
    dashed = (0, (4, 2))
    axes.plot(
        columns, curves.perturbed, color=PERTURBED_COLOR, lw=1.5, ls=dashed, label="perturbed"
    )
    if kind.logarithmic:
        axes.set_xscale("log")
        round_ticks(axes.xaxis)
    if (np.nan_to_num(np.stack([curves.base, curves.perturbed]), nan=1.0) > 0).all():
        axes.set_yscale("log")
        round_ticks(axes.yaxis)
    axes.set_ylabel(f"{signature_name(result)}\n({kind.unit})")
    axes.legend(frameon=False, loc="upper right" if kind.per_time else "best", fontsize=8.5)
    axes.tick_params(labelbottom=False)
    if kind.per_time:
        top = axes.secondary_xaxis("top", functions=(diffusion_radius, diffusion_time))  # type: ignore[arg-type]
        top.set_xlabel("diffusion radius 2√t (length)")
        round_ticks(top.xaxis)
    calm(axes)


def draw_change(axes: Axes, result: Comparison, curves: Curves) -> None:
    """The scaled change over the columns, within the band of its noise floor."""
    kind, columns = result.methods.kind, result.columns
    axes.axhline(0, color="#888888", lw=0.8)
    noise = 100 * curves.noise
    axes.fill_between(columns, -noise, noise, color=NOISE_COLOR, lw=0, label="noise floor")
    axes.plot(columns, 100 * curves.change, color=BASE_COLOR, lw=1.8, label="base − perturbed")
    axes.set_ylabel(f"scaled change\n(% of mean {kind.abbreviation})")
    axes.set_xlabel(kind.axis)
    if len(columns) > 1:
        axes.set_xlim(columns[0], columns[-1])
    if kind.logarithmic:
        axes.set_xscale("log")
        round_ticks(axes.xaxis)
    if not np.nan_to_num(curves.change).any():
        axes.set_ylim(-1, 1)
        words = "0 at every time" if kind.per_time else "0 in every column"
        axes.text(0.5, 0.62, words, transform=axes.transAxes, ha="center")
    else:
        low, high = axes.get_ylim()
        axes.set_ylim(low, high + 0.22 * (high - low))  # room for the legend above the curve
        axes.legend(frameon=False, loc="upper left", ncols=2, fontsize=8.5)
    calm(axes)


def signature_name(result: Comparison) -> str:
    """The signature's name without its abbreviation."""
    return result.methods.kind.title.split(" (")[0]


def round_ticks(axis: Axis) -> None:
    """Ticks of a logarithmic axis at 1, 2, 5 times the powers of ten, as plain numbers."""
    axis.set_major_locator(LogLocator(subs=(1, 2, 5), numticks=12))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def calm(axes: Axes) -> None:
    """No frame above and beside, a faint grid behind."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(True, which="major", color="#e6e6e6", lw=0.6)
    axes.set_axisbelow(True)
