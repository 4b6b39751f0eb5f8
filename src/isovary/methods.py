"""Which mesher, operator and signature a comparison uses, and what follows from the choice."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from .difference import heat_trace_scale, mean_size
from .errors import ArgumentError
from .geometry import Floats, node_areas, node_components
from .laplacian import epsilon_graph, fem, knn_graph, uniform_graph
from .meshing import Mesher, Sizing, marching_cubes
from .records import Eigenpairs, Laplacian, Surface
from .signature import SignatureKind, heat_kernel_signature, signature_kind

Operator = Callable[[Surface], Laplacian]
"""A method of the Laplacian room."""

Signature = Callable[[Eigenpairs, Floats], Floats]
"""A method of the signature room."""


@dataclass(frozen=True)
class Methods:
    """The operator, the signature and the mesher of a comparison.

    Parameters
    ----------
    laplacian : callable
        Surface -> Laplacian on the surface's points.
    signature : callable
        Eigenpairs, samples (diffusion times, as a rule) -> array (n, T).
    mesher : callable
        Field, isovalue, vertices, order -> Surface.
    """

    laplacian: Operator = fem
    signature: Signature = heat_kernel_signature
    mesher: Mesher = marching_cubes

    @property
    def sizing(self) -> Sizing | float | None:
        """Edge lengths wanted of the mesher; None for its own."""
        sizing: Sizing | float | None = getattr(self.mesher, "keywords", {}).get("sizing")
        return sizing

    @property
    def kind(self) -> SignatureKind:
        """What the signature's columns are, and what it is called."""
        return signature_kind(self.signature)

    def sample(self, pairs: Eigenpairs, samples: Floats) -> Floats:
        """Return the signature (n, T); A03 for a function that gives another shape."""
        values = np.asarray(self.signature(pairs, samples))
        expected = len(pairs.vectors), len(self.kind.columns(samples))
        if values.shape != expected:
            raise ArgumentError(
                "A03",
                f"signature: expected {method_name(self.signature)} to return an array {expected}, "
                f"a row for each node, got {values.shape}",
            )
        return values

    def scale(
        self, surface: Surface, pairs: Eigenpairs, signature: Floats, samples: Floats
    ) -> Floats:
        """Mean size of a base's signature, by which its change is divided.

        (T,) as a rule; (n, T) for a signature over times on a surface of several components,
        each divided by its own mean: a small one has a large signature, and would drown the
        others. (Energies and eigenpairs may have nothing to do with a component.)
        """
        parts = node_components(surface.triangles) * self.by_component
        if parts.max() == 0 and self.is_heat:
            return heat_trace_scale(pairs, samples)
        areas = node_areas(surface.points, surface.triangles)
        means = [
            self._mean(signature[parts == k], areas[parts == k]) for k in range(parts.max() + 1)
        ]
        return means[0] if len(means) == 1 else np.stack(means)[parts]

    def _mean(self, signature: Floats, areas: Floats) -> Floats:
        """Mean size; 1 for a component that is not compared."""
        unknown = np.isnan(signature).all()
        return np.ones(signature.shape[1]) if unknown else mean_size(signature, areas)

    @property
    def scaling(self) -> str:
        """What the change is divided by, in words."""
        whose = "of each component" if self.by_component else "of the whole surface"
        if self.is_heat:
            return f"base heat trace per unit area, {whose}"
        return f"mean size of the base's signature, {whose}"

    @property
    def by_component(self) -> bool:
        """Whether each component of a surface is divided by its own mean.

        Not where heat leaves through rims: a small component is cold when another is warm.
        """
        return self.kind.per_time and not self.fixed

    @property
    def is_heat(self) -> bool:
        """Whether the signature is the heat kernel's."""
        return _function(self.signature) is heat_kernel_signature

    @property
    def sees_lengths(self) -> bool:
        """Whether the operator changes when a mesh is carried; the edges alone do not."""
        return _function(self.laplacian) is not uniform_graph

    @property
    def biased(self) -> bool:
        """Whether the operator errs alike on all meshes, which no noise floor shows."""
        return _function(self.laplacian) in (uniform_graph, knn_graph, epsilon_graph)

    @property
    def fixed(self) -> bool:
        """Whether the functions are held at 0 on rims."""
        return bool(getattr(self.laplacian, "keywords", {}).get("dirichlet", False))

    def order(self, surface: Surface) -> int:
        """Power of the number of vertices with which the discretization's error falls.

        The elements' order for consistent finite elements; 1, that is h^2, for the others.
        Graphs do not reach it: see ``biased``.
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

    def said(value: object) -> str:
        return method_name(value) if callable(value) else repr(value)

    name = str(getattr(_function(method), "__name__", repr(method)))
    options = getattr(method, "keywords", {})
    return name + (
        f"({', '.join(f'{k}={said(v)}' for k, v in options.items())})" if options else ""
    )
