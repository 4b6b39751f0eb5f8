"""The symmetric heat-kernel operator of nodes with areas, for meshes and clouds."""

from __future__ import annotations

import numpy as np

from ..errors import MeshError
from ..records import Laplacian
from ._graph import check_parts, graph_stiffness, pairs_within, squared_lengths, weighted_graph
from ._sites import Sites

CUT = 9.0
"""d^2 / 4 h at which the kernel is cut off: see the notes of mesh_laplacian."""


def heat_kernel_laplacian(sites: Sites, time: float) -> Laplacian:
    """W_ij = a_i a_j exp(-d^2 / 4 h) / (4 pi h^2) for d^2 <= 4 CUT h, mass diag(a).

    In the plane the kernel's second moment makes this the Laplacian; the cut
    takes away the share (1 + CUT) exp(-CUT) of it, which is put back.
    """
    from scipy.sparse import diags_array

    flat = np.flatnonzero(~(sites.areas > 0))
    if len(flat):
        raise MeshError(
            "M03",
            f"triangles: expected a positive area round each node, got {len(flat)} nodes on "
            f"degenerate triangles only, first {flat[:5].tolist()}; remove them",
        )
    pairs = pairs_within(sites.points, 2 * np.sqrt(CUT * time))
    kernel = np.exp(-squared_lengths(sites.points, pairs) / (4 * time)) / (4 * np.pi * time**2)
    kernel /= 1 - (1 + CUT) * np.exp(-CUT)
    graph = weighted_graph(pairs, kernel * sites.areas[pairs].prod(axis=1), len(sites.points))
    check_parts(
        graph,
        sites,
        more=lambda radius: f"use a time of at least {radius**2 / (4 * CUT):.4g}",
        less=f"use a time of less than {time:.4g}",
    )
    return Laplacian(graph_stiffness(graph), diags_array(sites.areas).tocsr())
