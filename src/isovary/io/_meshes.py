"""A mesh out: for viewers and solvers, with its quality as a picture and in numbers."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..geometry import Floats
from ..levels import Progress
from ..quality import MeshQuality
from ..records import Surface
from ._atomic import write_folder
from ._writing import curved_grid, flat_triangles, seconds, stage, write_summary, write_vtk

if TYPE_CHECKING:
    import pyvista as pv


def save_mesh(
    surface: Surface,
    quality: MeshQuality,
    out: str | os.PathLike[str],
    *,
    title: str | None = None,
    choices: Mapping[str, object] | None = None,
    notes: Sequence[str] = (),
    timings: Mapping[str, float] | None = None,
    arrays: Mapping[str, Floats] | None = None,
    original: Surface | None = None,
    progress: Progress | None = None,
) -> Path:
    """Write a mesh into a folder that appears whole or not at all.

    ====================  =============================================================
    ``mesh.vtu``          true cells, normals at the nodes, quality of the cells
    ``mesh.vtp``          the same in flat triangles, for any viewer
    ``mesh_quality.png``  the picture
    ``summary.json``      versions, choices, notes, quality, timings
    ====================  =============================================================

    With the surface that it was before, two more:

    ====================  =============================================================
    ``original.vtu``      that surface, node for node
    ``displacement.png``  the mesh, coloured by how far its nodes moved
    ====================  =============================================================

    Parameters
    ----------
    surface : Surface
    quality : MeshQuality
        Of this surface.
    out : path
        A new or empty folder, or an earlier result, which is replaced.
    title : str, optional
        What the mesh is of, for the picture.
    choices, notes, timings : optional
        What made the mesh, what its reader must know, and the seconds of each stage so far.
    arrays : mapping, optional
        Further values at the nodes (n,) or (n, 3), by name.
    original : Surface, optional
        What the nodes moved from, with the same triangles.
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
    Cost: 3 s, most of it drawing; 1 MB for 4 000 nodes.
    """
    from ..view import displacement_figure, mesh_quality_figure

    spent = dict(timings or {})
    with write_folder(out) as folder:
        with stage("data files", 0.0, spent, progress):
            for name, data in (("vtu", curved_grid(surface)), ("vtp", flat_triangles(surface))):
                for key, values in (arrays or {}).items():
                    data.point_data[key] = values
                _write_cells(data, surface, quality, folder / f"mesh.{name}")
            if original is not None:
                grid = curved_grid(original)
                grid.point_data["normals"] = original.normals
                write_vtk(grid, folder / "original.vtu")
        with stage("mesh picture", 0.2, spent, progress):
            mesh_quality_figure(surface, quality, title).savefig(folder / "mesh_quality.png")
        if original is not None:
            with stage("displacement picture", 0.6, spent, progress):
                figure = displacement_figure(original, surface, title)
                figure.savefig(folder / "displacement.png")
        summary = {
            "choices": dict(choices or {}),
            "notes": list(notes),
            "mesh": quality.summary(),
            "timings_seconds": seconds(spent),
        }
        write_summary(summary, folder)
    if progress:
        progress("done", 1.0)
    return Path(out)


def _write_cells(data: pv.DataSet, surface: Surface, quality: MeshQuality, path: Path) -> None:
    """Write cells, or the flat pieces of them, with their normals and quality."""
    pieces = data.n_cells // len(surface.triangles)
    cells = {"quality": quality.quality, "jacobian": quality.jacobians}
    if quality.element_distances is not None:
        cells["distance"] = quality.element_distances
    for name, values in cells.items():
        data.cell_data[name] = values.repeat(pieces)
    data.point_data["normals"] = surface.normals
    data.point_data.active_normals_name = "normals"
    data.set_active_scalars("quality", preference="cell")
    write_vtk(data, path)
