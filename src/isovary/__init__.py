"""Intrinsic change of isosurfaces between simulation runs.

Two scalar fields and an isovalue in; where, at which scale and how much the
isosurface's intrinsic shape changed, and what of it is mesh noise, out.
"""

from importlib.metadata import version as _version

from .alignment import RigidMotion, rigid_part
from .carrying import carry
from .clustering import k_medians
from .comparison import Comparison, compare
from .correspondence import closest_point, identity, interpolate, normal_rays
from .difference import change_norm, diffusion_times, heat_trace_scale, signature_difference
from .errors import (
    ArgumentError,
    ClusterError,
    CorrespondenceError,
    FieldError,
    FileError,
    IsovaryError,
    MeshError,
    RunError,
    SpectrumError,
)
from .geometry import Topology, topology
from .io import read_field
from .laplacian import fem
from .meshing import better_interpolation, contour, interpolation_errors, marching_cubes
from .noise import noise_floor, sampling_floor
from .projection import project
from .records import Clusters, Correspondence, Eigenpairs, Laplacian, ScalarField, Surface
from .shapes import icosphere
from .signature import heat_kernel_signature
from .spectrum import drop_cut_multiplet, eigenpairs

__version__ = _version("isovary")

__all__ = [
    "ArgumentError",
    "ClusterError",
    "Clusters",
    "Comparison",
    "Correspondence",
    "CorrespondenceError",
    "Eigenpairs",
    "FieldError",
    "FileError",
    "IsovaryError",
    "Laplacian",
    "MeshError",
    "RigidMotion",
    "RunError",
    "ScalarField",
    "SpectrumError",
    "Surface",
    "Topology",
    "better_interpolation",
    "carry",
    "change_norm",
    "closest_point",
    "compare",
    "contour",
    "diffusion_times",
    "drop_cut_multiplet",
    "eigenpairs",
    "fem",
    "heat_kernel_signature",
    "heat_trace_scale",
    "icosphere",
    "identity",
    "interpolate",
    "interpolation_errors",
    "k_medians",
    "marching_cubes",
    "noise_floor",
    "normal_rays",
    "project",
    "read_field",
    "rigid_part",
    "sampling_floor",
    "signature_difference",
    "topology",
]
