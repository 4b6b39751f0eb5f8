"""The curves of the overview: signatures of both surfaces at one point, and their change."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from ..comparison import Comparison
from ..geometry import Floats

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


def diffusion_length(times: Floats) -> Floats:
    """How far heat spreads in a time: sqrt(4 t), the width of the flat heat kernel."""
    length: Floats = np.sqrt(4 * np.maximum(times, 0.0))
    return length


def diffusion_time(length: Floats) -> Floats:
    """The time in which heat spreads over a length."""
    return length**2 / 4


def draw_signatures(axes: Axes, times: Floats, curves: Curves) -> None:
    """Both signatures over the time, with the diffusion length on top."""
    axes.loglog(times, curves.base, color=BASE_COLOR, lw=2.2, label="base")
    axes.loglog(
        times, curves.perturbed, color=PERTURBED_COLOR, lw=1.5, ls=(0, (4, 2)), label="perturbed"
    )
    axes.set_ylabel("heat kernel signature\n(1 / length²)")
    axes.legend(frameon=False, loc="upper right", fontsize=8.5)
    axes.tick_params(labelbottom=False)
    top = axes.secondary_xaxis("top", functions=(diffusion_length, diffusion_time))  # type: ignore[arg-type]
    top.set_xlabel("diffusion length √(4t)")
    _round_ticks(top.xaxis)
    _round_ticks(axes.xaxis)
    _round_ticks(axes.yaxis)
    _calm(axes)


def draw_change(axes: Axes, times: Floats, curves: Curves) -> None:
    """The scaled change over the time, within the band of its noise floor."""
    axes.axhline(0, color="#888888", lw=0.8)
    axes.fill_between(
        times, -100 * curves.noise, 100 * curves.noise, color=NOISE_COLOR, lw=0, label="noise floor"
    )
    axes.semilogx(times, 100 * curves.change, color=BASE_COLOR, lw=1.8, label="base − perturbed")
    axes.set_ylabel("scaled change\n(% of mean HKS)")
    axes.set_xlabel("diffusion time t (length²)")
    axes.set_xlim(times[0], times[-1])
    _round_ticks(axes.xaxis)
    if not np.nan_to_num(curves.change).any():
        axes.set_ylim(-1, 1)
        axes.text(0.5, 0.62, "0 at every time", transform=axes.transAxes, ha="center")
    else:
        low, high = axes.get_ylim()
        axes.set_ylim(low, high + 0.22 * (high - low))  # room for the legend above the curve
        axes.legend(frameon=False, loc="upper left", ncols=2, fontsize=8.5)
    _calm(axes)


def _round_ticks(axis: Axis) -> None:
    """Ticks of a logarithmic axis at 1, 2, 5 times the powers of ten, as plain numbers."""
    axis.set_major_locator(LogLocator(subs=(1, 2, 5), numticks=12))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def _calm(axes: Axes) -> None:
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(True, which="major", color="#e6e6e6", lw=0.6)
    axes.set_axisbelow(True)
