"""What every mesher starts from: a fine mesh of the isosurface and the edge lengths wanted."""

from __future__ import annotations

import warnings

import numpy as np

from ..errors import ArgumentError
from ..geometry import Bools, Floats, Topology, topology
from ..scalar_field import ScalarField
from ._contour import contour
from ._draft import Draft, draft
from ._sizing import Sizing, uniform_sizing
from ._sizing_field import SizingField, sizing_field

DEFAULT_VERTICES = 1000
"""Of a mesh for which neither a number nor edge lengths are given."""

_TERRACE = 0.1  # of the samples' distance
_FEW_VALUES = 6


def start(
    field: ScalarField,
    isovalue: float,
    vertices: int | None,
    sizing: Sizing | None,
    growth: float,
    order: int,
) -> tuple[Draft, SizingField, Topology]:
    """Marching-cubes triangles on the isosurface, at least as fine as the edges wanted.

    Returns the triangles, the edge lengths and the topology. Warns (M15) if the surface takes
    more vertices than wanted. The arguments are those of the meshers.
    """
    check_order(order)
    if vertices is not None and vertices < 12:
        raise ArgumentError("A02", f"vertices: expected at least 12, got {vertices}")
    if not growth > 0:
        raise ArgumentError("A02", f"growth: expected a positive number, got {growth}")
    if sizing is None:
        sizing, vertices = uniform_sizing, vertices or DEFAULT_VERTICES
    spacing = float(field.spacing.max())
    mesh, sizes = _contoured(field, isovalue, sizing, vertices, growth, spacing)
    usual = float(np.median(sizes.lengths))
    if usual < spacing:
        mesh, sizes = _contoured(field, isovalue, sizing, vertices, growth, usual)
    if vertices is not None and sizes.vertices > 1.02 * vertices:
        warnings.warn(
            f"vertices: expected at least {sizes.vertices}, so that no edge is longer than the "
            f"radius of curvature, got {vertices}; the mesh has more than was asked for [M15]",
            UserWarning,
            stacklevel=3,
        )
    _warn_of_steps(mesh, field, isovalue)
    return mesh, sizes, topology(mesh.triangles)


def _warn_of_steps(mesh: Draft, field: ScalarField, isovalue: float) -> None:
    """Masks and integers: the samples around the isovalue have few values, far apart."""
    above = field.values > isovalue
    if _values_beside(field.values, above) > _FEW_VALUES:
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


def _values_beside(values: Floats, above: Bools) -> int:
    """How many different values the samples have whose neighbour is on the other side."""
    beside = np.zeros_like(above)
    for axis in range(3):
        lower, upper = [slice(None)] * 3, [slice(None)] * 3
        lower[axis], upper[axis] = slice(None, -1), slice(1, None)
        crossed = above[tuple(lower)] != above[tuple(upper)]
        beside[tuple(lower)] |= crossed
        beside[tuple(upper)] |= crossed
    return len(np.unique(values[beside]))
