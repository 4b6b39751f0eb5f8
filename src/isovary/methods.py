"""Which operator and which signature a comparison uses, and what follows from the choice."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from .difference import heat_trace_scale, mean_size
from .geometry import Floats, node_areas
from .laplacian import fem
from .records import Eigenpairs, Laplacian, Surface
from .signature import SignatureKind, heat_kernel_signature, signature_kind

Operator = Callable[[Surface], Laplacian]
"""A method of the Laplacian room."""

Signature = Callable[[Eigenpairs, Floats], Floats]
"""A method of the signature room."""


@dataclass(frozen=True)
class Methods:
    """The operator and the signature of a comparison.

    Parameters
    ----------
    laplacian : callable
        Surface -> Laplacian on the surface's points.
    signature : callable
        Eigenpairs, samples (diffusion times, as a rule) -> array (n, T).
    """

    laplacian: Operator = fem
    signature: Signature = heat_kernel_signature

    @property
    def kind(self) -> SignatureKind:
        """What the signature's columns are, and what it is called."""
        return signature_kind(self.signature)

    def scale(
        self, surface: Surface, pairs: Eigenpairs, signature: Floats, samples: Floats
    ) -> Floats:
        """Mean size (T,) of a base's signature, by which its change is divided."""
        if self.signature is heat_kernel_signature:
            return heat_trace_scale(pairs, samples)
        return mean_size(signature, node_areas(surface.points, surface.triangles))

    @property
    def scaling(self) -> str:
        """What the change is divided by, in words."""
        if self.signature is heat_kernel_signature:
            return "base heat trace per unit area"
        return "mean size of the base's signature, column by column"

    def order(self, surface: Surface) -> int:
        """Power of the number of vertices with which the discretization's error falls.

        The elements' order for consistent finite elements; 1, that is h^2, is the best that
        any other operator of this package reaches.
        """
        return surface.order if _function(self.laplacian) is fem and not self._lumped else 1

    @property
    def _lumped(self) -> bool:
        return bool(getattr(self.laplacian, "keywords", {}).get("lumped", False))


def _function(method: Callable[..., object]) -> Callable[..., object]:
    return method.func if isinstance(method, partial) else method


def method_name(method: Callable[..., object]) -> str:
    """Name of a function with the options that functools.partial gave it.

    Examples
    --------
    >>> method_name(partial(fem, lumped=True))
    'fem(lumped=True)'
    """
    name = str(getattr(_function(method), "__name__", repr(method)))
    options = getattr(method, "keywords", {})
    return name + (f"({', '.join(f'{k}={v!r}' for k, v in options.items())})" if options else "")
