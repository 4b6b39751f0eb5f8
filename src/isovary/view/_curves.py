"""The curves of the overview: signatures of both surfaces at one point, and their change."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import NullFormatter

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
    return np.sqrt(4 * np.maximum(times, 0.0))


def draw_signatures(axes: Axes, times: Floats, curves: Curves) -> None:
    """Both signatures over the time, with the diffusion length on top."""
    axes.loglog(times, curves.base, color=BASE_COLOR, lw=2.2, label="base")
    axes.loglog(times, curves.perturbed, color=PERTURBED_COLOR, lw=1.5, ls=(0, (4, 2)),
                label="perturbed")
    axes.set_ylabel("heat kernel signature\n(1 / length²)")
    axes.legend(frameon=False, loc="upper right")
    axes.tick_params(labelbottom=False)
    top = axes.secondary_xaxis("top", functions=(diffusion_length, lambda x: x**2 / 4))
    top.set_xlabel("diffusion length √(4t)")
    for axis in (top.xaxis, axes.yaxis, axes.xaxis):
        axis.set_minor_formatter(NullFormatter())
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
    if not np.nan_to_num(curves.change).any():
        axes.set_ylim(-1, 1)
        axes.text(0.5, 0.62, "0 at every time", transform=axes.transAxes, ha="center")
    else:
        axes.legend(frameon=False, loc="best")
    _calm(axes)


def _calm(axes: Axes) -> None:
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(True, which="major", color="#e6e6e6", lw=0.6)
    axes.set_axisbelow(True)
