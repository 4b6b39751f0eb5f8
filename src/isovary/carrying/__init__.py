"""Room: base Surface, perturbed field -> the base mesh on the perturbed isosurface."""

from ._along_normals import carry
from ._isometrically import carry_isometrically

__all__ = ["carry", "carry_isometrically"]
