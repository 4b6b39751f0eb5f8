"""Intrinsic change of isosurfaces between simulation runs.

Two scalar fields and an isovalue in; where, at which scale and how much the
isosurface's intrinsic shape changed, and what of it is mesh noise, out.
"""

from importlib.metadata import version as _version

from .alignment import Alignment, align
from .carrying import carry, carry_isometrically
from .clustering import (
    Annealing,
    CountChoice,
    Dendrogram,
    adjusted_rand_index,
    agglomerative,
    annealing,
    choose_count,
    dendrogram,
    deterministic_annealing,
    fuzzy_c_means,
    k_medians,
    k_medoids,
    norm_bins,
    silhouette,
)
from .color import (
    color_blind,
    embedding_colors,
    group_colors,
    nested_colors,
    nested_order,
    oklab_to_srgb,
    srgb_to_oklab,
)
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
from .deform import Projectile, Region, dimple, shoot
from .difference import change_norm, heat_trace_scale, mean_size, signature_difference
from .embedding import classical_mds, universal_mds
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
from .groups import GroupFacts, group_table
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
from .potentials import born_mayer
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
    "Annealing",
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
    "CountChoice",
    "Dendrogram",
    "Distortion",
    "Eigenpairs",
    "FieldError",
    "FileError",
    "GroupFacts",
    "HausdorffDistance",
    "IsovaryError",
    "Kind",
    "Laplacian",
    "MeshError",
    "MeshQuality",
    "MovedField",
    "Projectile",
    "Region",
    "RigidMotion",
    "RunError",
    "ScalarField",
    "SignatureKind",
    "SpectrumError",
    "Surface",
    "Topology",
    "TopologyChange",
    "adjusted_rand_index",
    "agglomerative",
    "align",
    "annealing",
    "audit",
    "better_interpolation",
    "blended",
    "born_mayer",
    "carry",
    "carry_isometrically",
    "change_norm",
    "choose_count",
    "classical_mds",
    "closest_point",
    "color_blind",
    "compare",
    "component_table",
    "contour",
    "cotangent",
    "curvature_sizing",
    "cylinder",
    "dendrogram",
    "deterministic_annealing",
    "differential_coordinates",
    "diffusion_radius",
    "diffusion_times",
    "dimple",
    "disk",
    "distmesh",
    "distortion",
    "drop_cut_multiplet",
    "eigenpairs",
    "ellipsoid",
    "embedding_colors",
    "enclosed_volume",
    "epsilon_graph",
    "extrinsic_summary",
    "fem",
    "fix_nodes",
    "fuzzy_c_means",
    "global_point_signature",
    "group_colors",
    "group_table",
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
    "k_medoids",
    "kinds_of_change",
    "knn_graph",
    "marching_cubes",
    "match_components",
    "mean_size",
    "mesh_laplacian",
    "mesh_quality",
    "near_rim",
    "nested_colors",
    "nested_order",
    "noise_floor",
    "nonuniform_sizing",
    "norm_bins",
    "normal_rays",
    "oklab_to_srgb",
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
    "shoot",
    "signature_difference",
    "signature_kind",
    "silhouette",
    "srgb_to_oklab",
    "sweep_family",
    "topology",
    "topology_change",
    "torus",
    "truncation_floor",
    "uniform_graph",
    "uniform_sizing",
    "universal_mds",
    "wave_energies",
    "wave_kernel_signature",
]
