"""Room: Surface -> Laplacian (thesis 3.2, 4.1.2)."""

from ._fem import fem

__all__ = ["fem"]
