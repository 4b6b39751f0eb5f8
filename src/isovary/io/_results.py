"""Results out: data for viewers, pictures, a report, and a summary that repeats the run."""

from __future__ import annotations

import math
import os
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..alignment import Alignment
from ..comparison import Comparison
from ..difference import change_norm
from ..geometry import Floats
from ..groups import GroupFacts
from ..isometry import Distortion
from ..levels import Progress
from ..matching import ComponentMatch
from ._atomic import write_folder
from ._writing import curved_grid, flat_triangles, seconds, stage, write_summary, write_vtk

if TYPE_CHECKING:
    import pyvista as pv


def save(result: Comparison, out: str | os.PathLike[str], progress: Progress | None = None) -> Path:
    """Write a comparison into a folder that appears whole or not at all.

    ====================  ========================================================
    ``change.vtu``        base surface, true quadratic cells, all arrays
    ``perturbed.vtu``     perturbed surface with its own signature
    ``change.vtp``        base surface in flat triangles, for any viewer
    ``overview.png``      the picture
    ``details.png``       the other side, strain, histogram, groups by scale, eigenvalues
    ``both.png``          base and perturbed surface, side by side and in one place
    ``mesh_quality.png``  the base's mesh: how good it is
    ``report.html``       one file, opens offline, the surface can be turned
    ``summary.json``      versions, choices, counts, noise, notes, timings
    ====================  ========================================================

    Parameters
    ----------
    result : Comparison
    out : path
        A new or empty folder, or an earlier result, which is replaced.
    progress : callable, optional
        Called with the stage's name and the part done.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    RunError
        W02 if ``out`` holds something else, W06 if the disk is full, W07 if it cannot be written.

    Notes
    -----
    Cost: 10 s, most of it drawing; 20 MB for 4 000 nodes.
    """
    from ..view import both, details, mesh_quality_figure, overview, write_report
    from ..view._words import title

    timings = dict(result.timings)
    with write_folder(out) as folder:
        with stage("data files", 0.0, timings, progress):
            write_vtk(_change_grid(result), folder / "change.vtu")
            write_vtk(_perturbed_grid(result), folder / "perturbed.vtu")
            write_vtk(_flat_surface(result), folder / "change.vtp")
        with stage("overview picture", 0.2, timings, progress):
            picture = overview(result)
            picture.savefig(folder / "overview.png")
        with stage("details picture", 0.4, timings, progress):
            more = details(result)
            more.savefig(folder / "details.png")
        with stage("picture of both surfaces", 0.5, timings, progress):
            surfaces = both(result)
            surfaces.savefig(folder / "both.png")
        with stage("mesh picture", 0.6, timings, progress):
            words = f"isosurface {title(result)}, mesh of the base"
            figure = mesh_quality_figure(result.base, result.base_quality, words)
            figure.savefig(folder / "mesh_quality.png")
        with stage("report", 0.7, timings, progress):
            write_report(result, folder / "report.html", pictures=(picture, surfaces, more))
        summary = _summary(replace(result, timings=timings))
        write_summary(summary, folder)
    if progress:
        progress("done", 1.0)
    return Path(out)


def _node_arrays(result: Comparison) -> dict[str, np.ndarray]:
    """Arrays with one value per base node, by the names they have in files."""
    found = result.correspondence.found
    arrays: dict[str, np.ndarray] = {
        "change_norm": result.change_norm,
        "noise_norm": change_norm(result.noise_floor),
        "significant": result.significant.astype(np.int8),
        "group": result.clusters.labels.astype(np.int32),
        "displacement": result.displacement,
        "deformation": result.deformation,
        "partner": result.base.points + result.displacement,
        "strain": result.strain,
        "kind_of_change": result.kinds.astype(np.int8),
        "normal_displacement": result.correspondence.distance,
        "partner_found": found.astype(np.int8),
    }
    if result.topology.boundary_loops:
        arrays["rim_distance"] = result.rim_distance
    return arrays


def _change_grid(result: Comparison) -> pv.UnstructuredGrid:
    grid, name = curved_grid(result.base), result.methods.kind.short
    grid.point_data[f"{name}_base"] = result.base_signature
    grid.point_data[f"{name}_perturbed"] = result.perturbed_signature
    grid.point_data[f"{name}_change"] = result.change
    grid.point_data["noise_floor"] = result.noise_floor
    for name, values in _node_arrays(result).items():
        grid.point_data[name] = values
    grid.cell_data["area_strain"] = result.distortion.area_strain
    grid.cell_data["angle_strain"] = result.distortion.angle_strain
    grid.field_data[_columns_name(result)] = result.columns
    grid.set_active_scalars("change_norm")
    return grid


def _columns_name(result: Comparison) -> str:
    """Name of the array that tells each column's time, energy, frequency..."""
    return "times" if result.methods.kind.per_time else "columns"


def _perturbed_grid(result: Comparison) -> pv.UnstructuredGrid:
    grid, methods = curved_grid(result.perturbed_in_place), result.methods
    grid.point_data[methods.kind.short] = methods.signature(result.perturbed_pairs, result.times)
    grid.field_data[_columns_name(result)] = result.columns
    return grid


def _flat_surface(result: Comparison) -> pv.PolyData:
    flat = flat_triangles(result.base)
    for name, values in _node_arrays(result).items():
        flat.point_data[name] = values
    flat.point_data["Normals"] = result.base.normals
    flat.set_active_scalars("change_norm")
    return flat


def _summary(result: Comparison) -> dict[str, Any]:
    """Everything a reader needs to judge the result and to repeat it."""
    return {
        "isovalue": result.isovalue,
        "choices": result.choices,
        "notes": list(result.notes),
        "counts": {
            "nodes": len(result.base.points),
            "vertices": len(np.unique(result.base.corners)),
            "triangles": len(result.base.triangles),
            "eigenpairs": len(result.base_pairs.values),
            "without_partner": int((~result.correspondence.found).sum()),
            "significant": int(result.significant.sum()),
            "by_group": np.bincount(result.clusters.labels + 1).tolist()[1:],
        },
        "coverage": result.coverage,
        "correspondence": result.audit.summary(),
        "topology": asdict(result.topology),
        "components": [_component(match) for match in result.components],
        "extrinsic": result.extrinsic(),
        "kinds_of_change": result.kind_shares,
        "groups": [_group(result, group) for group in result.group_table],
        "mesh": {
            "base": result.base_quality.summary(),
            "perturbed": result.perturbed_quality.summary(),
        },
        "change": _sizes(result),
        "rigid_motion": _rigid_motion(result.alignment),
        "strain": _strain(result.distortion),
        "spectrum": {
            "largest_eigenvalue": result.base_pairs.values[-1],
            "eigenvalues": {
                "base": result.base_pairs.values,
                "perturbed": result.perturbed_pairs.values,
            },
            _columns_name(result): result.columns[[0, -1]],
            "solver": {
                "base": result.base_pairs.solver,
                "perturbed": result.perturbed_pairs.solver,
            },
            "largest_residual": {
                "base": result.base_pairs.residuals.max(),
                "perturbed": result.perturbed_pairs.residuals.max(),
            },
        },
        "timings_seconds": seconds(result.timings),
    }


def _group(result: Comparison, group: GroupFacts) -> dict[str, Any]:
    """A group's facts, its dominant column by its place on the axis."""
    facts = {k: v for k, v in asdict(group).items() if k != "column"}
    name = "time" if result.methods.kind.per_time else "column"
    return facts | {f"largest_at_{name}": float(result.columns[group.column])}


def _component(match: ComponentMatch) -> dict[str, Any]:
    """What became of a component."""
    return {
        "event": match.event,
        "base": None if match.base_part is None else asdict(match.base_part),
        "perturbed": None if match.perturbed_part is None else asdict(match.perturbed_part),
    }


def _rigid_motion(found: Alignment) -> dict[str, Any]:
    """The motion that brings the perturbed surface onto the base."""
    return {
        "rotation": found.motion.rotation,
        "translation": found.motion.translation,
        "turn_degrees": found.motion.angle,
        "mirrored": found.motion.mirrored,
        "share": found.share,
        "rms_before": found.rms_before,
        "rms_after": found.rms_after,
        "held": list(found.held),
    }


def _strain(found: Distortion) -> dict[str, float]:
    """How far the correspondence is from an isometry."""
    known = found.size[np.isfinite(found.size)]
    most = float(known.max()) if len(known) else math.nan
    return {"rms": found.strain, "largest": most}


def _sizes(result: Comparison) -> dict[str, float]:
    norm = result.change_norm
    none = not np.isfinite(norm).any()
    return {
        "rms": _rms(result.change),
        "rms_at_unit_area": _rms(result.unit_area_change),
        "rms_noise": _rms(result.noise_floor),
        "relative_noise": result.relative_noise,
        "signal_over_noise": 1 / result.relative_noise if result.relative_noise else math.nan,
        "largest_norm": math.nan if none else float(np.nanmax(norm)),
        "largest_norm_node": -1 if none else int(np.nanargmax(norm)),
    }


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.nanmean(values**2)))
