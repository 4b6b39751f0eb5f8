"""What every operator of triangles asks of its argument."""

from __future__ import annotations

from ..errors import ArgumentError
from ..records import Surface


def check_surface(surface: object) -> None:
    """Raise ArgumentError A03 unless it is a Surface."""
    if not isinstance(surface, Surface):
        raise ArgumentError(
            "A03",
            f"surface: expected a Surface, got {type(surface).__name__}; read_surface reads files; "
            "knn_graph, epsilon_graph and point_cloud take bare points",
        )
