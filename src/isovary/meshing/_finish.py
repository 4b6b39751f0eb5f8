"""The last step of every mesher: a Surface of the wanted order, on the isosurface, not folded."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np

from ..errors import MeshError
from ..geometry import (
    Bools,
    Floats,
    Ints,
    Topology,
    edges_of,
    jacobian_ratios,
    topology,
    triangle_quality,
    with_midpoints,
)
from ..projection import newton, outward_normals
from ..records import Surface
from ..scalar_field import ScalarField
from ._draft import Draft, held_between, moved, settled
from ._edits import edges_with_sides, flip
from ._interpolation import suits_logarithm
from ._moves import centroid_step
from ._remesh import split_edges

_LEAST_JACOBIAN = 0.1
_POOR = 0.3  # quality
_HOPELESS = 5  # times as many bad triangles as at first
_REFINEMENTS, _SPLITS, _EVENINGS = 6, 2, 6


def finished(
    draft: Draft,
    field: ScalarField,
    isovalue: float,
    order: int,
    expected: Topology,
    *,
    judged: bool = True,
) -> Surface:
    """Surface of a draft, with every node on the isosurface and the field's normals.

    For order 2 each edge's midpoint becomes a node of its own. Where a triangle's Jacobian falls
    below a tenth of its largest value the mesh is refined, a few times.

    Raises
    ------
    MeshError
        M12 if the topology is not the expected one, M03 if triangles stay folded.
    """
    _check_topology(draft, expected)
    first: tuple[int, Floats] | None = None
    for _ in range(_REFINEMENTS + 1):
        points, triangles, bad = _nodes(draft, field, isovalue, order)
        if len(bad) == 0:
            if judged:
                _warn_of_slivers(points, triangles)
            return Surface(points, triangles, outward_normals(points, field, isovalue))
        first = first or (len(bad), points[triangles[bad[0], :3]].mean(axis=0))
        if len(bad) > _HOPELESS * first[0]:
            break
        draft = _refined(draft, bad, field, isovalue)
    assert first is not None
    raise MeshError(
        "M03",
        f"triangles: expected none folded, got {first[0]}, the first near "
        f"{first[1].round(6).tolist()}; {_by_logarithm(field, isovalue)}ask for more vertices, "
        "smooth the field, or choose another isovalue or box if the surface has an edge or "
        "touches the box there",
    )


def _by_logarithm(field: ScalarField, isovalue: float) -> str:
    """Advice for a field of many decades, whose own spline swings where it is steep."""
    if field.logarithmic or not suits_logarithm(field, isovalue):
        return ""
    return "interpolate its logarithm (isovary.better_interpolation), or "


def _warn_of_slivers(points: Floats, triangles: Ints) -> None:
    quality = triangle_quality(points, triangles)
    if quality.min() < _POOR:
        where = points[triangles[quality.argmin(), :3]].mean(axis=0)
        warnings.warn(
            f"triangles: expected a quality of at least {_POOR}, got {quality.min():.2g} near "
            f"{where.round(6).tolist()} (and {(quality < _POOR).sum() - 1} others below); ask for "
            "another number of vertices, smooth the field, or move the box if it touches the "
            "surface there [M14]",
            UserWarning,
            stacklevel=4,
        )


def _check_topology(draft: Draft, expected: Topology) -> None:
    found = topology(draft.triangles)
    if found != expected:
        raise MeshError(
            "M12",
            f"vertices: expected a mesh of the isosurface's topology ({expected}), got {found} "
            f"with {len(draft.points)} vertices; ask for more, or smooth the field if it is noisy",
        )


def _nodes(
    draft: Draft, field: ScalarField, isovalue: float, order: int
) -> tuple[Floats, Ints, Ints]:
    """Nodes on the isosurface, triangles, and the numbers of those that are not sound.

    These have a node that does not arrive, face inward or have a Jacobian that nearly vanishes.
    """
    points, triangles, held = draft.points, draft.triangles, draft.held
    if order == 2:
        edges, _, counts = edges_of(triangles)
        on_rim = held_between(points, held, *edges.T) & (counts == 1)[:, None]
        points, triangles = with_midpoints(points, triangles)
        held = np.concatenate([held, on_rim])
    points, arrived = newton(points, field, isovalue, held=held)
    a, b, c = points[triangles[:, :3]].transpose(1, 0, 2)
    up = draft.normals[draft.triangles].sum(axis=1)
    outward = (np.cross(b - a, c - a) * up).sum(axis=1) > 0
    sound = arrived[triangles].all(axis=1) & outward
    sound[sound] = jacobian_ratios(points, triangles[sound]) > _LEAST_JACOBIAN
    return points, triangles, np.flatnonzero(~sound)


def _refined(draft: Draft, bad: Ints, field: ScalarField, isovalue: float) -> Draft:
    """Longer edges of the bad triangles and their neighbours halved, and the vertices evened."""
    near = _with_neighbours(draft.triangles, draft.triangles[bad].ravel(), len(draft.points))
    for _ in range(_SPLITS):
        edges = edges_with_sides(draft.triangles)
        i, j = edges.ends.T
        length: Floats = np.linalg.norm(draft.points[i] - draft.points[j], axis=1)
        inside = near[i] & near[j]
        excess = np.where(inside, length - 0.6 * length[inside].max(), 0.0)
        draft = settled(split_edges(draft, excess, edges, len(length)), field, isovalue)
        near = np.append(near, np.ones(len(draft.points) - len(near), dtype=bool))
    for _ in range(_EVENINGS):
        triangles, _ = flip(draft.points, draft.triangles, draft.normals)
        draft = replace(draft, triangles=triangles)
        step = centroid_step(draft, np.ones(len(draft.points)))
        draft = moved(draft, np.where(near[:, None], step, 0.0), field, isovalue)
    return draft


def _with_neighbours(triangles: Ints, vertices: Ints, count: int) -> Bools:
    """Mask (count,) of the vertices and those beside them."""
    there = np.zeros(count, dtype=bool)
    there[vertices] = True
    there[triangles[there[triangles].any(axis=1)]] = True
    return there
