"""Room: base Surface, perturbed field -> the base mesh on the perturbed isosurface."""

from ._along_normals import carry

__all__ = ["carry"]
