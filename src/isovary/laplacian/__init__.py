"""Room: Surface -> Laplacian (thesis 3.2, 4.1.2)."""

from ._boundary import fix_nodes
from ._cotangent import cotangent
from ._differential_coordinates import differential_coordinates
from ._epsilon_graph import epsilon_graph
from ._fem import fem
from ._knn_graph import knn_graph
from ._mesh_laplacian import mesh_laplacian
from ._point_cloud import point_cloud
from ._robust import robust
from ._uniform_graph import uniform_graph

__all__ = [
    "cotangent",
    "differential_coordinates",
    "epsilon_graph",
    "fem",
    "fix_nodes",
    "knn_graph",
    "mesh_laplacian",
    "point_cloud",
    "robust",
    "uniform_graph",
]
