"""The last step of every mesher: a Surface of the wanted order, on the isosurface, not folded."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..errors import MeshError
from ..geometry import Floats, Topology, edges_of, jacobian_ratios, topology, with_midpoints
from ..projection import outward_normals, project
from ..records import Surface
from ..scalar_field import ScalarField
from ._draft import Draft, held_between, settled
from ._edits import edges_with_sides, flip
from ._remesh import split_edges

_LEAST_JACOBIAN = 0.1
_REFINEMENTS = 6


def finished(
    draft: Draft, field: ScalarField, isovalue: float, order: int, expected: Topology
) -> Surface:
    """Surface of a draft, with every node on the isosurface and the field's normals.

    For order 2 each edge's midpoint becomes a node of its own. Triangles whose Jacobian falls
    below a tenth of its largest value are halved, and their neighbours flipped, a few times.

    Raises
    ------
    MeshError
        M12 if the topology is not the expected one, M03 if triangles stay folded.
    """
    _check_topology(draft, expected)
    for _ in range(_REFINEMENTS):
        surface = _on_isosurface(draft, field, isovalue, order)
        bad = _distorted(surface)
        if len(bad) == 0:
            return surface
        draft = _refined(draft, bad, field, isovalue)
    where = surface.points[surface.corners[bad[0]]].mean(axis=0)
    raise MeshError(
        "M03",
        f"triangles: expected none folded, got {len(bad)}, the first near "
        f"{where.round(6).tolist()}; ask for more vertices, or for another isovalue or box if "
        "the surface has an edge or touches the box there",
    )


def _check_topology(draft: Draft, expected: Topology) -> None:
    found = topology(draft.triangles)
    if found != expected:
        raise MeshError(
            "M12",
            f"vertices: expected a mesh of the isosurface's topology ({expected}), got {found} "
            f"with {len(draft.points)} vertices; ask for more",
        )


def _on_isosurface(draft: Draft, field: ScalarField, isovalue: float, order: int) -> Surface:
    points, triangles, held = draft.points, draft.triangles, draft.held
    if order == 2:
        edges, _, counts = edges_of(triangles)
        on_rim = held_between(points, held, *edges.T) & (counts == 1)[:, None]
        points, triangles = with_midpoints(points, triangles)
        held = np.concatenate([held, on_rim])
    nodes = project(points, field, isovalue, held=held)
    return Surface(nodes, triangles, outward_normals(nodes, field, isovalue))


def _distorted(surface: Surface) -> np.ndarray:
    """Numbers of the triangles whose Jacobian nearly vanishes, or that face inward."""
    ratios = jacobian_ratios(surface.points, surface.triangles)
    corners = surface.points[surface.corners]
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    along = (facing * surface.normals[surface.corners].mean(axis=1)).sum(axis=1)
    return np.flatnonzero(~(ratios > _LEAST_JACOBIAN) | ~(along > 0))


def _refined(draft: Draft, bad: np.ndarray, field: ScalarField, isovalue: float) -> Draft:
    """The longest edges of the bad triangles halved, then two rounds of flips."""
    edges = edges_with_sides(draft.triangles)
    i, j = edges.ends.T
    length: Floats = np.linalg.norm(draft.points[i] - draft.points[j], axis=1)
    near = np.isin(edges.triangles, bad).any(axis=1)
    draft = settled(
        split_edges(draft, np.where(near, length, 0.0), edges, len(length)), field, isovalue
    )
    for _ in range(2):
        triangles, _ = flip(draft.points, draft.triangles, draft.normals)
        draft = replace(draft, triangles=triangles)
    return draft
