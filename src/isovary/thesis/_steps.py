"""Steps of the pipeline that several experiments take, on surfaces whose nodes correspond."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ..difference import heat_trace_scale, signature_difference
from ..geometry import Floats
from ..laplacian import fem
from ..records import Eigenpairs, Laplacian, Surface
from ..signature import diffusion_times, heat_kernel_signature
from ..spectrum import eigenpairs

Operator = Callable[[Surface], Laplacian]


@dataclass(frozen=True, eq=False)
class Signed:
    """A surface with its eigenpairs and its heat kernel signature (n, T) at times (T,)."""

    surface: Surface
    pairs: Eigenpairs
    times: Floats
    signature: Floats


def signed(surface: Surface, pairs: int, times: int | Floats, operator: Operator = fem) -> Signed:
    """Eigenpairs and signature of a surface; a number of times leaves them to the eigenpairs."""
    solved = eigenpairs(operator(surface), pairs)
    samples = diffusion_times(solved, times) if isinstance(times, int) else times
    return Signed(surface, solved, samples, heat_kernel_signature(solved, samples))


def scaled_change(base: Signed, perturbed: Signed) -> Floats:
    """Scaled change (n, T), base minus perturbed, of surfaces with the same nodes and times."""
    scale = heat_trace_scale(base.pairs, base.times)
    return signature_difference(base.signature, perturbed.signature, scale)
