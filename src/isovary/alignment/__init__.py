"""Two Surfaces, perhaps the perturbed field -> the rigid motion between them."""

from ._align import Alignment, align

__all__ = ["Alignment", "align"]
