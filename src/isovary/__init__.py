"""Intrinsic change of isosurfaces between simulation runs.

Two scalar fields and an isovalue in; where, at which scale and how much the
isosurface's intrinsic shape changed, and what of it is mesh noise, out.
"""

from importlib.metadata import version as _version

from .alignment import Alignment, align
from .carrying import carry, carry_isometrically
from .clustering import k_medians
from .comparison import Comparison, compare
from .correspondence import (
    CorrespondenceAudit,
    audit,
    closest_point,
    identity,
    interpolate,
    isometric_match,
    normal_rays,
)
from .difference import change_norm, heat_trace_scale, mean_size, signature_difference
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
from .extrinsic import (
    HausdorffDistance,
    Kind,
    enclosed_volume,
    extrinsic_summary,
    hausdorff_distance,
    kinds_of_change,
)
from .families import blended, sweep_family
from .geometry import Topology, rim_nodes, topology
from .io import read_field, read_surface
from .isometry import Distortion, distortion
from .laplacian import (
    cotangent,
    differential_coordinates,
    epsilon_graph,
    fem,
    fix_nodes,
    knn_graph,
    mesh_laplacian,
    point_cloud,
    robust,
    uniform_graph,
)
from .level_sets import BlendedField, MovedField
from .matching import (
    Component,
    ComponentMatch,
    component_table,
    match_components,
    part_of,
)
from .meshing import (
    better_interpolation,
    contour,
    curvature_sizing,
    distmesh,
    interpolation_errors,
    marching_cubes,
    nonuniform_sizing,
    particles,
    principal_curvatures,
    uniform_sizing,
)
from .noise import noise_floor, sampling_floor, truncation_floor
from .projection import project
from .quality import MeshQuality, mesh_quality
from .records import Clusters, Correspondence, Eigenpairs, Laplacian, Surface
from .rigid_motion import RigidMotion
from .rims import near_rim, rim_distance
from .scalar_field import ScalarField
from .shapes import cylinder, disk, ellipsoid, hemisphere, icosphere, sheet, torus
from .signature import (
    SignatureKind,
    diffusion_radius,
    diffusion_times,
    global_point_signature,
    heat_kernel,
    heat_kernel_signature,
    implied_curvature,
    scale_invariant_heat_kernel_signature,
    shape_dna,
    signature_kind,
    wave_energies,
    wave_kernel_signature,
)
from .spectrum import drop_cut_multiplet, eigenpairs
from .topology_change import TopologyChange, topology_change

__version__ = _version("isovary")

__all__ = [
    "Alignment",
    "ArgumentError",
    "BlendedField",
    "ClusterError",
    "Clusters",
    "Comparison",
    "Component",
    "ComponentMatch",
    "Correspondence",
    "CorrespondenceAudit",
    "CorrespondenceError",
    "Distortion",
    "Eigenpairs",
    "FieldError",
    "FileError",
    "HausdorffDistance",
    "IsovaryError",
    "Kind",
    "Laplacian",
    "MeshError",
    "MeshQuality",
    "MovedField",
    "RigidMotion",
    "RunError",
    "ScalarField",
    "SignatureKind",
    "SpectrumError",
    "Surface",
    "Topology",
    "TopologyChange",
    "align",
    "audit",
    "better_interpolation",
    "blended",
    "carry",
    "carry_isometrically",
    "change_norm",
    "closest_point",
    "compare",
    "component_table",
    "contour",
    "cotangent",
    "curvature_sizing",
    "cylinder",
    "differential_coordinates",
    "diffusion_radius",
    "diffusion_times",
    "disk",
    "distmesh",
    "distortion",
    "drop_cut_multiplet",
    "eigenpairs",
    "ellipsoid",
    "enclosed_volume",
    "epsilon_graph",
    "extrinsic_summary",
    "fem",
    "fix_nodes",
    "global_point_signature",
    "hausdorff_distance",
    "heat_kernel",
    "heat_kernel_signature",
    "heat_trace_scale",
    "hemisphere",
    "icosphere",
    "identity",
    "implied_curvature",
    "interpolate",
    "interpolation_errors",
    "isometric_match",
    "k_medians",
    "kinds_of_change",
    "knn_graph",
    "marching_cubes",
    "match_components",
    "mean_size",
    "mesh_laplacian",
    "mesh_quality",
    "near_rim",
    "noise_floor",
    "nonuniform_sizing",
    "normal_rays",
    "part_of",
    "particles",
    "point_cloud",
    "principal_curvatures",
    "project",
    "read_field",
    "read_surface",
    "rim_distance",
    "rim_nodes",
    "robust",
    "sampling_floor",
    "scale_invariant_heat_kernel_signature",
    "shape_dna",
    "sheet",
    "signature_difference",
    "signature_kind",
    "sweep_family",
    "topology",
    "topology_change",
    "torus",
    "truncation_floor",
    "uniform_graph",
    "uniform_sizing",
    "wave_energies",
    "wave_kernel_signature",
]
