"""The eigensolve: Laplacian, count -> Eigenpairs (thesis 4.1.3)."""

from ._eigenpairs import drop_cut_multiplet, eigenpairs
from ._factorization import count_below

__all__ = ["count_below", "drop_cut_multiplet", "eigenpairs"]
