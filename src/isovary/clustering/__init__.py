"""Room: rows (n, T), count -> Clusters (thesis 4.1.6, 4.2.7)."""

from ._k_medians import k_medians

__all__ = ["k_medians"]
