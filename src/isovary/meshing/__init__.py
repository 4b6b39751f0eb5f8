"""Room: field, isovalue, sizing -> Surface (thesis 4.1.1)."""

from collections.abc import Callable

from ..records import Surface
from ._contour import contour
from ._curvature import principal_curvatures
from ._distmesh import distmesh
from ._interpolation import better_interpolation, interpolation_errors
from ._marching_cubes import marching_cubes
from ._particles import particles
from ._sizing import Sizing, as_sizing, curvature_sizing, nonuniform_sizing, uniform_sizing
from ._start import DEFAULT_VERTICES

Mesher = Callable[..., Surface]
"""A method of this room: field, isovalue; vertices, sizing, growth, order, progress by name."""

__all__ = [
    "DEFAULT_VERTICES",
    "Mesher",
    "Sizing",
    "as_sizing",
    "better_interpolation",
    "contour",
    "curvature_sizing",
    "distmesh",
    "interpolation_errors",
    "marching_cubes",
    "nonuniform_sizing",
    "particles",
    "principal_curvatures",
    "uniform_sizing",
]
