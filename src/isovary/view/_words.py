"""The verdict and the facts of a comparison in words, the same for picture and report."""

from __future__ import annotations

from importlib.metadata import version
from textwrap import shorten

import numpy as np

from ..comparison import Comparison
from ..extrinsic import Kind
from ..geometry import Floats
from ..signature import diffusion_radius
from ._paint import norm_limit

UNITS = "Lengths in the field's own unit."


def percent(share: float) -> str:
    """A share in percent to two digits; only a whole is 100 %.

    Examples
    --------
    >>> percent(0.0113), percent(0.25), percent(0.9996), percent(1.0), percent(0.0)
    ('1.1 %', '25 %', '> 99.9 %', '100 %', '0 %')
    """
    value = 100 * share
    if 99.95 <= value < 100 * (1 - 1e-9):
        return "> 99.9 %"
    if value >= 99:
        return f"{value:.4g} %"
    return f"{value:.0f} %" if value >= 10 else f"{value:.2g} %"


def title(result: Comparison) -> str:
    """Which isosurface: the field's name, cut to sixty characters, and the isovalue."""
    name = str(result.choices.get("field", "field")) or "field"
    return f"{shorten(name, 60, placeholder='…')} = {result.isovalue:g}"


def peak(result: Comparison) -> int | None:
    """The node that changed most: of the significant ones, else of all; None without change."""
    norm = np.nan_to_num(result.change_norm, nan=-1.0)
    shown = np.where(result.significant, norm, -1.0)
    best = int((shown if result.significant.any() else norm).argmax())
    return best if norm[best] > 0 else None


_BY_CHANCE = 0.01  # of the nodes of null comparisons, at most, exceed the noise
MOSTLY_RIGID = 0.9
"""Share of the squared displacement above which the change is not called one."""


def verdict(result: Comparison, half_share: float) -> str:
    """What was found, in one sentence.

    Parameters
    ----------
    result : Comparison
    half_share : float
        Smallest part of the area that holds half of the significant change.
    """
    marked = peak(result)
    if marked is None:
        return "No change: the two isosurfaces are identical"
    if not result.significant.any():
        most = percent(float(result.change_norm[marked]))
        return f"No significant change: the largest, {most}, is less than twice the noise floor"
    if result.relative_noise > 1 and result.significant.mean() < _BY_CHANCE:
        return "No change above the noise: what exceeds it does so by chance, on a few nodes"
    loose = result.choices["alignment"] == "off" and result.choices["carrying"] != "isometric"
    if loose and result.alignment.share > MOSTLY_RIGID:
        return (
            f"Mostly a rigid motion ({percent(result.alignment.share)} of the displacement): "
            "the change shown may be false"
        )
    kind = result.methods.kind
    what = "Intrinsic shape" if kind.short == "hks" else f"The {kind.abbreviation}"
    over = "scales" if kind.per_time else "columns"
    return (
        f"{what} changed by up to {percent(norm_limit(result))} (mean over {over}); half of the "
        f"change lies on {percent(half_share)} of the surface"
    )


def answer(result: Comparison, significant_share: float) -> str:
    """How much of the surface, where most, at which scale, and how far above the noise.

    Parameters
    ----------
    result : Comparison
    significant_share : float
        Part of the area where the change is significant.
    """
    marked = peak(result)
    if marked is None or not result.significant.any():
        return ""
    near = place(result, result.base.points[marked])
    column = float(result.columns[int(np.nanargmax(np.abs(result.change[marked])))])
    kind = result.methods.kind
    at = f"at {kind.axis} {column:.3g}"
    if kind.per_time:
        at = f"at the scale of {diffusion_radius(column):.2g} (diffusion radius)"
    local = percent(result.kind_shares[Kind.NEW_SHAPE.words])
    return (
        f"{local} of the surface changed by 1 % or more at a local scale, "
        f"{percent(significant_share)} by more than the noise at any; most {at} near "
        f"{near}; signal over noise {_two_digits(1 / result.relative_noise)}."
    )


def place(result: Comparison, point: Floats) -> str:
    """A point in words, to about a thousandth of the surface's extent."""
    extent = float(np.ptp(result.base.points, axis=0).max())
    digits = max(0, 2 - int(np.floor(np.log10(extent))))
    return "(" + ", ".join(f"{round(float(x), digits) + 0.0:g}" for x in point) + ")"


def _two_digits(value: float) -> str:
    """A positive number to two digits, without an exponent up to a million.

    Examples
    --------
    >>> _two_digits(583.2), _two_digits(3.14159), _two_digits(7.2e9)
    ('580', '3.1', '7.2e+09')
    """
    rounded = float(f"{value:.2g}")
    return f"{rounded:g}" if rounded < 1e6 else f"{rounded:.2g}"


def unknown(result: Comparison) -> str:
    """What a grey, hatched node is."""
    return "no partner: unknown" if result.coverage < 1 else "no signature: unknown"


def facts(result: Comparison) -> dict[str, str]:
    """Counts and choices that made the result, by name."""
    nodes, vertices = len(result.base.points), len(np.unique(result.base.corners))
    columns, choices = result.columns, result.choices
    shape = "curved quadratic" if result.base.order == 2 else "flat linear"
    areas = result.base_pairs.area, result.perturbed_pairs.area
    motion, strain = result.alignment, result.distortion.strain
    return {
        "mesh": f"{vertices} vertices, {nodes} nodes, {shape} elements",
        "eigenpairs": str(len(result.base_pairs.values)),
        "laplacian": str(choices.get("laplacian", "?")),
        "signature": f"{result.methods.kind.title}, {len(columns)} columns, "
        f"{result.methods.kind.axis} {columns[0]:.3g} to {columns[-1]:.3g}",
        "correspondence": f"{choices.get('correspondence', '?')}, "
        f"{percent(result.coverage)} of the nodes have a partner",
        "scaling": str(choices.get("scaling", "?")),
        "interpolation": str(choices.get("interpolation", "?")),
        "noise floor": f"{percent(result.relative_noise)} of the change (rms)",
        "topology": _shape(result),
        "rigid motion": f"{percent(motion.share)} of the squared distance, "
        + ("taken out" if choices["alignment"] == "rigid" else "left in"),
        "strain": f"{percent(strain)} (rms)",
        "area": f"base {areas[0]:.5g}, perturbed {areas[1]:.5g} "
        f"({100 * (areas[1] / areas[0] - 1):+.2g} %)",
        "isovary": version("isovary"),
    }


def _shape(result: Comparison) -> str:
    t = result.topology
    parts = [
        f"{t.components} component" + "s" * (t.components != 1),
        f"genus {t.genus}",
        f"{t.boundary_loops} boundary loop" + "s" * (t.boundary_loops != 1)
        if t.boundary_loops
        else "closed",
    ]
    return ", ".join(parts)
