"""Surfaces coloured by a norm or by groups, with the key that tells the colours."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec
from matplotlib.patches import Patch

from ..geometry import Floats, Ints, linear_triangles
from ..records import Surface
from ..view._paint import MOVE_MAP, NORM_MAP
from ._drawing import draw_surface

UNKNOWN = np.array([0.82, 0.82, 0.82])


def draw_values(
    figure: Figure,
    cell: SubplotSpec,
    surface: Surface,
    values: Floats,
    limit: float,
    caption: str,
    label: str,
    *,
    towards: Floats,
    signed: bool = False,
) -> Axes:
    """Values (n,) from 0 to a limit, or from minus that if signed, with a colour bar below.

    Grey where NaN.
    """
    low = -limit if signed else 0.0
    colors = MOVE_MAP if signed else NORM_MAP
    rgb = np.array(colors(np.clip((values - low) / (limit - low), 0, 1)))[:, :3]
    rgb[np.isnan(values)] = UNKNOWN
    axes = draw_surface(figure, cell, surface, rgb, caption, towards=towards)
    inset = axes.inset_axes((0.2, -0.06, 0.6, 0.03))
    scale = ScalarMappable(Normalize(low, limit), colors)
    bar = figure.colorbar(scale, cax=inset, orientation="horizontal")
    bar.outline.set_visible(False)
    bar.ax.locator_params(nbins=4)
    bar.ax.tick_params(labelsize=8, length=2)
    bar.set_label(label, size=8.5)
    return axes


def draw_groups(
    figure: Figure,
    cell: SubplotSpec,
    surface: Surface,
    labels: Ints,
    colors: Floats,
    caption: str,
    *,
    towards: Floats,
    key: Sequence[str] = (),
    title: str | None = None,
) -> Axes:
    """Groups (n,) in their colours (k, 3), grey where -1, with a word of the key for each."""
    rgb = np.where(labels[:, None] >= 0, colors[labels], UNKNOWN)
    # three-node triangles, for parabolas through colours overshoot
    fine = Surface(surface.points, linear_triangles(surface.triangles), surface.normals)
    axes = draw_surface(figure, cell, fine, rgb, caption, towards=towards)
    if key:
        pairs = zip(colors, key, strict=True)
        patches = [Patch(color=tuple(color), label=word) for color, word in pairs]
        axes.legend(
            handles=patches,
            title=title,
            title_fontsize=8,
            loc="upper center",
            bbox_to_anchor=(0.5, -0.01),
            ncols=len(patches),
            frameon=False,
            fontsize=8,
            handlelength=1.0,
            columnspacing=1.0,
        )
    return axes
