"""What every mesher starts from: a fine mesh of the isosurface and the edge lengths wanted."""

from __future__ import annotations

import warnings

import numpy as np

from ..errors import ArgumentError
from ..geometry import Bools, Floats, Topology, topology
from ..scalar_field import ScalarField
from ._contour import contour
from ._draft import Draft, draft
from ._sizing import Sizing, as_sizing, uniform_sizing
from ._sizing_field import SizingField, sizing_field

DEFAULT_VERTICES = 1000
"""Of a mesh for which neither a number nor edge lengths are given."""

_MOST_VERTICES = 2_000_000
_TERRACE = 0.1  # of the samples' distance
_STEPPED = 0.3  # of the samples beside the isosurface


def start(
    field: ScalarField,
    isovalue: float,
    vertices: int | None,
    sizing: Sizing | float | None,
    growth: float,
    order: int,
) -> tuple[Draft, SizingField, Topology]:
    """Marching-cubes triangles on the isosurface, at least as fine as the edges wanted.

    Returns the triangles, the edge lengths and the topology. Warns (M15) if the surface takes
    more vertices than wanted. The arguments are those of the meshers.
    """
    check_order(order)
    whole = isinstance(vertices, (int, np.integer)) and not isinstance(vertices, bool)
    if vertices is not None and not (whole and vertices >= 12):
        raise ArgumentError(
            "A02", f"vertices: expected a whole number of at least 12, got {vertices!r}"
        )
    if not (isinstance(growth, (int, float)) and 0 < growth < np.inf):
        raise ArgumentError("A02", f"growth: expected a positive number, got {growth!r}")
    if sizing is None:
        sizing, vertices = uniform_sizing, vertices or DEFAULT_VERTICES
    sizing = as_sizing(sizing)
    spacing = float(field.spacing.max())
    mesh, sizes = _contoured(field, isovalue, sizing, vertices, growth, spacing)
    if sizes.vertices > _MOST_VERTICES:
        raise ArgumentError(
            "A02",
            f"vertices, sizing: expected at most {_MOST_VERTICES} vertices, got {sizes.vertices}, "
            f"with edges down to {sizes.lengths.min():.3g}; is the length in the field's unit?",
        )
    usual = float(np.median(sizes.lengths))
    if usual < spacing:
        mesh, sizes = _contoured(field, isovalue, sizing, vertices, growth, usual)
    if vertices is not None and sizes.vertices > 1.02 * vertices:
        warnings.warn(
            f"vertices: expected at least {sizes.vertices}, so that no edge is longer than the "
            f"radius of curvature, got {vertices}; the mesh has more than was asked for. If that "
            "is noise, smooth the field (field.smoothed, --smooth) [M15]",
            UserWarning,
            stacklevel=3,
        )
    _warn_of_steps(mesh, field, isovalue)
    return mesh, sizes, topology(mesh.triangles)


def _warn_of_steps(mesh: Draft, field: ScalarField, isovalue: float) -> None:
    """Masks and integers: samples beside the isosurface equal the next ones behind them."""
    above = field.values > isovalue
    if _stepped(field.values, above) < _STEPPED:
        return
    gap = np.array([field.values[~above].max(), field.values[above].min()])
    step = float(np.diff(np.log(gap) if field.logarithmic else gap)[0])
    slope = np.linalg.norm(field.level_set(mesh.points, isovalue)[1], axis=1)
    moved = step / float(np.median(slope)) / float(field.spacing.max())
    if moved > _TERRACE:
        warnings.warn(
            f"values: expected many on both sides of the isovalue, got steps from {gap[0]:.6g} to "
            f"{gap[1]:.6g} there, which leave the isosurface uncertain by {moved:.2g} of the "
            "samples' distance, as terraces; smooth the field first (field.smoothed, --smooth) "
            "[I08]",
            UserWarning,
            stacklevel=4,
        )


def check_order(order: int) -> None:
    """A02 for an order other than 1 and 2."""
    if order not in (1, 2):
        raise ArgumentError("A02", f"order: expected 1 or 2, got {order}")


def _contoured(
    field: ScalarField,
    isovalue: float,
    sizing: Sizing,
    vertices: int | None,
    growth: float,
    resolution: float,
) -> tuple[Draft, SizingField]:
    raw = contour(field, isovalue, resolution=resolution)
    mesh = draft(raw.points, raw.triangles, field, isovalue)
    return mesh, sizing_field(mesh, field, isovalue, sizing, vertices, growth)


def _stepped(values: Floats, above: Bools) -> float:
    """Part of the samples beside the isosurface that equal the next ones behind them."""
    equal = total = 0
    for axis in range(3):
        moved = np.moveaxis(above, axis, 0)
        line = np.moveaxis(values, axis, 0)
        crossed = moved[:-1] != moved[1:]
        for beside, behind, there in (
            (line[1:-1], line[:-2], crossed[1:]),
            (line[1:-1], line[2:], crossed[:-1]),
        ):
            equal += int((beside == behind)[there].sum())
            total += int(there.sum())
    return equal / max(total, 1)
