"""Room: rows (n, T) -> points (n, dimensions) at nearly the rows' distances."""

from ._classical_mds import classical_mds
from ._universal_mds import universal_mds

__all__ = ["classical_mds", "universal_mds"]
