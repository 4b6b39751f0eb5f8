"""Figure 4.6: an ellipsoid's mesh by marching cubes and by DistMesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from ..meshing import contour, curvature_sizing, distmesh, marching_cubes
from ..quality import MeshQuality, mesh_quality
from ..records import Surface
from ..scalar_field import ScalarField
from ._drawing import COLORS, curve_axes, draw_surface, grid, new_figure
from ._judged import MESH_COLOR
from ._records import Experiment, Finding, Outcome, Settings, Verdict
from ._spheroid import spheroid_field

_TITLE = "Marching cubes and DistMesh on an ellipsoid"
_ALIKE = 1.1
"""Largest ratio of two triangle counts that are similar."""

_BETTER = 1.1
"""How many times nearer to the surface a mesh is that captures its curvature better."""

_SHORTER = -0.5
"""Correlation of log edge length with log curvature from which a mesh follows the curvature."""

_LOOK = np.array([1.0, 0.35, 0.2])


@dataclass(frozen=True, eq=False)
class _Mesh:
    name: str
    surface: Surface
    quality: MeshQuality


def run(settings: Settings) -> Outcome:
    """The thesis's two meshes and the default one, of the same number of vertices."""
    field = spheroid_field(settings["half_axis"], settings["spacing"])
    raw = contour(field, 0.0)
    count = len(raw.points)
    meshes = [
        _judge("Marching cubes", raw, field),
        _judge(
            "DistMesh, by curvature",
            distmesh(field, 0.0, vertices=count, sizing=curvature_sizing, order=1),
            field,
        ),
        _judge("isovary's default, curved", marching_cubes(field, 0.0, vertices=count), field),
    ]
    even = _judge("DistMesh, even", distmesh(field, 0.0, vertices=count, order=1), field)
    return Outcome((_look_alike(meshes), _capture(meshes, even)), _draw(meshes))


def _judge(name: str, surface: Surface, field: ScalarField) -> _Mesh:
    return _Mesh(name, surface, mesh_quality(surface, field, 0.0))


def _look_alike(meshes: Sequence[_Mesh]) -> Finding:
    cubes, truss = (mesh.quality for mesh in meshes[:2])
    ratio = max(cubes.triangles, truss.triangles) / min(cubes.triangles, truss.triangles)
    poor = [100 * float((one.quality < 0.5).mean()) for one in (cubes, truss)]
    return Finding(
        "Both meshes have similar triangle counts, and many viewers would take both for good",
        "4.2.1, Fig 4.6",
        f"{cubes.triangles} and {truss.triangles} triangles. What viewers think is not told; the "
        f"triangles are not alike: mean quality {cubes.quality.mean():.2f} and "
        f"{truss.quality.mean():.2f}, worst {cubes.quality.min():.2g} and "
        f"{truss.quality.min():.2g}, {poor[0]:.0f} % and {poor[1]:.1g} % below 0.5.",
        Verdict.OPEN if ratio < _ALIKE else Verdict.REFUTED,
        {
            "ratio": ratio,
            "mean_cubes": float(cubes.quality.mean()),
            "mean_distmesh": float(truss.quality.mean()),
            "worst_cubes": float(cubes.quality.min()),
            "worst_distmesh": float(truss.quality.min()),
        },
    )


def _capture(meshes: Sequence[_Mesh], even: _Mesh) -> Finding:
    cubes, truss, curved = (mesh.quality for mesh in meshes)
    ratio = even.quality.surface_distance / truss.surface_distance
    follows = truss.size_curvature_correlation < _SHORTER
    confirmed = follows and ratio > _BETTER
    return Finding(
        "DistMesh captures the curvature better, for a set number of vertices",
        "4.1.1, 4.2.1",
        "Correlation of edge length with curvature: marching cubes "
        f"{cubes.size_curvature_correlation:.2f}, DistMesh {truss.size_curvature_correlation:.2f}. "
        "Distance of the triangles to the surface, rms, of semi-axis 1: "
        f"{cubes.surface_distance:.2g} and {truss.surface_distance:.2g}; DistMesh with even edges "
        f"{even.quality.surface_distance:.2g}, so that the sizes gain {ratio:.2g} times; curved "
        f"triangles with even edges {curved.surface_distance:.2g}.",
        Verdict.CONFIRMED if confirmed else Verdict.IN_PART if follows else Verdict.REFUTED,
        {
            "correlation_cubes": cubes.size_curvature_correlation,
            "correlation_distmesh": truss.size_curvature_correlation,
            "distance_cubes": cubes.surface_distance,
            "distance_distmesh": truss.surface_distance,
            "distance_even": even.quality.surface_distance,
            "distance_curved": curved.surface_distance,
        },
    )


def _draw(meshes: Sequence[_Mesh]) -> Figure:
    cubes, truss = (mesh.quality for mesh in meshes[:2])
    message = (
        f"{cubes.vertices} vertices each: the worst triangle has quality {cubes.quality.min():.2g} "
        f"by marching cubes and {truss.quality.min():.2g} by DistMesh, the mean "
        f"{cubes.quality.mean():.2f} and {truss.quality.mean():.2f} (1: equilateral)"
    )
    figure = new_figure("4.6", _TITLE, message, 5.8)
    cells = grid(figure, 1, 5, left=0.02, width_ratios=[1, 1, 1, 0.1, 1.5], wspace=0.1)
    for cell, mesh in zip(cells, meshes, strict=False):
        colors = np.tile(MESH_COLOR, (len(mesh.surface.points), 1))
        draw_surface(figure, cell, mesh.surface, colors, mesh.name, towards=_LOOK, mesh=True)
    axes = curve_axes(
        figure,
        cells[4],
        "Quality of the triangles",
        "2 inradius / circumradius",
        "triangles below (%)",
    )
    styles = ((COLORS[1], "-"), (COLORS[0], "-"), (COLORS[2], "--"))
    for mesh, (color, line) in zip(meshes, styles, strict=True):
        values = np.sort(mesh.quality.quality)
        share = 100 * np.arange(1, len(values) + 1) / len(values)
        axes.plot(values, share, line, color=color, lw=1.8, label=mesh.name)
    axes.set_xlim(0, 1)
    axes.set_ylim(0, 100)
    axes.legend(frameon=False, loc="upper left")
    return figure


EXPERIMENT = Experiment("4.6", _TITLE, run)
