"""Room: field, isovalue -> Surface (thesis 4.1.1)."""

from ._contour import contour
from ._interpolation import better_interpolation, interpolation_errors
from ._marching_cubes import marching_cubes

__all__ = ["better_interpolation", "contour", "interpolation_errors", "marching_cubes"]
