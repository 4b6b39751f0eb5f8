"""The eigensolve: Laplacian, count -> Eigenpairs (thesis 4.1.3)."""

from ._eigenpairs import eigenpairs
from ._factorization import count_below
from ._multiplets import drop_cut_multiplet, first_pairs, with_spare

__all__ = ["count_below", "drop_cut_multiplet", "eigenpairs", "first_pairs", "with_spare"]
