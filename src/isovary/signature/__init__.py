"""Room: Eigenpairs, times -> signature (n, T) (thesis 3.1, 4.2.6)."""

from ._energies import wave_energies
from ._global_point import global_point_signature
from ._heat_kernel import heat_kernel_signature
from ._kernel import heat_kernel
from ._kinds import SignatureKind, signature_kind
from ._reading import diffusion_radius, implied_curvature
from ._scale_invariant import scale_invariant_heat_kernel_signature
from ._shape_dna import shape_dna
from ._times import diffusion_times
from ._wave_kernel import wave_kernel_signature

__all__ = [
    "SignatureKind",
    "diffusion_radius",
    "diffusion_times",
    "global_point_signature",
    "heat_kernel",
    "heat_kernel_signature",
    "implied_curvature",
    "scale_invariant_heat_kernel_signature",
    "shape_dna",
    "signature_kind",
    "wave_energies",
    "wave_kernel_signature",
]
