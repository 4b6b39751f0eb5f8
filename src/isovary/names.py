"""The words by which command line and page call methods and shapes."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from . import clustering as clusterings
from . import laplacian as operators
from . import signature as signatures
from .correspondence import closest_point, isometric_match, normal_rays
from .groups import Clustering
from .meshing import (
    Mesher,
    Sizing,
    curvature_sizing,
    distmesh,
    marching_cubes,
    nonuniform_sizing,
    particles,
    uniform_sizing,
)
from .methods import Signature
from .records import Laplacian, Surface
from .shapes import ellipsoid, icosphere, torus
from .task import Match

MATCHES: dict[str, Match | None] = {
    "carried": None,
    "isometric-match": isometric_match,
    "normal-rays": normal_rays,
    "closest-point": closest_point,
}
LAPLACIANS: dict[str, Callable[..., Laplacian]] = {
    "fem": operators.fem,
    "fem-lumped": partial(operators.fem, lumped=True),
    "cotangent": operators.cotangent,
    "robust": operators.robust,
    "mesh-laplacian": operators.mesh_laplacian,
    "point-cloud": operators.point_cloud,
    "uniform-graph": operators.uniform_graph,
    "knn-graph": operators.knn_graph,
    "epsilon-graph": operators.epsilon_graph,
}
WITH_BOUNDARY = ("fem", "fem-lumped", "cotangent")
CLUSTERINGS: dict[str, Clustering] = {
    "k-medians": clusterings.k_medians,
    "k-medoids": clusterings.k_medoids,
    "fuzzy-c-means": partial(clusterings.fuzzy_c_means, metric="l2"),  # l1 fails with two groups
    "agglomerative": clusterings.agglomerative,
    "deterministic-annealing": clusterings.deterministic_annealing,
    "norm-bins": clusterings.norm_bins,
}
SIGNATURES: dict[str, Signature] = {
    "heat-kernel": signatures.heat_kernel_signature,
    "scale-invariant-heat-kernel": signatures.scale_invariant_heat_kernel_signature,
    "wave-kernel": signatures.wave_kernel_signature,
    "global-point": signatures.global_point_signature,
}
MESHERS: dict[str, Mesher] = {
    "marching-cubes": marching_cubes,
    "distmesh": distmesh,
    "particles": particles,
}
SIZINGS: dict[str, Sizing] = {
    "uniform": uniform_sizing,
    "curvature": curvature_sizing,
    "nonuniform": nonuniform_sizing,
}

_AROUND, _ALONG = 24, 10  # nodes of a torus per subdivision step
SHAPES: dict[str, Callable[[int, int], Surface]] = {
    "sphere": lambda fine, order: icosphere(fine, order=order),
    "ellipsoid": lambda fine, order: ellipsoid((1, 1, 2), fine, order=order),
    "torus": lambda fine, order: torus(
        1.0, 0.4, (_AROUND * 2 ** (fine - 2), _ALONG * 2 ** (fine - 2)), order=order
    ),
}
"""Closed surfaces, made of a number of subdivisions and an order."""
