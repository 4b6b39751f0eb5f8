"""``isovary mesh``."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from ..errors import ArgumentError
from ..io import read_field
from ..io._atomic import check_output
from ..io._meshes import save_mesh
from ..levels import Walk
from ..meshing import DEFAULT_VERTICES, Sizing, better_interpolation, interpolation_errors
from ..methods import method_name
from ..names import MESHERS, SIZINGS
from ..notes import noted_warnings
from ..quality import mesh_quality
from ..scalar_field import ScalarField
from ..task import field_facts
from ._app import WholeOrNone, app, progress, say
from ._record import another, command_line, file_facts


@app.command(name="mesh")
def mesh_file(
    field: Path,
    /,
    *,
    isovalue: float,
    out: Annotated[Path, Parameter(name=["--out", "-o"])],
    array: str | None = None,
    spacing: tuple[float, float, float] | None = None,
    origin: tuple[float, float, float] | None = None,
    smooth: float | None = None,
    vertices: WholeOrNone = None,
    mesher: Literal["marching-cubes", "distmesh", "particles"] = "marching-cubes",
    sizing: Literal["uniform", "curvature", "nonuniform"] = "uniform",
    edge_length: float | None = None,
    growth: float = 0.3,
    order: Literal[1, 2] = 2,
) -> None:
    """Mesh an isosurface, and tell how good the mesh is.

    Parameters
    ----------
    field
        Field file: .vti, .npy, .npz, .cube or .cube.gz.
    isovalue
        Value of the isosurface, in the field's unit.
    out
        Folder for the mesh; an earlier result in it is replaced.
    array
        Array to read, where the file holds several; "s[3]" takes index 3 of a 4-D array.
    spacing
        Distance of samples along x, y, z for .npy and .npz files.
    origin
        Position of the first sample for .npy and .npz files.
    smooth
        Width of a Gaussian that smooths the field first, in the unit of the spacing.
    vertices
        Vertices of the mesh. Default: 1000; as many as it takes with --sizing curvature or
        --edge-length.
    mesher
        marching-cubes: remeshed to equal edges; distmesh: a truss; particles: repelling.
    sizing
        Edge lengths: equal, shorter where the surface curves, or graded along x.
    edge_length
        Length of all edges, in the unit of the spacing, in place of a number of vertices.
    growth
        Largest difference of two edge lengths over the distance between them.
    order
        2: curved quadratic elements; 1: flat linear ones.
    """
    given, start = dict(locals()), time.perf_counter()
    check_output(out)
    wanted: Sizing | float = SIZINGS[sizing]
    if edge_length is not None:
        if vertices is not None or sizing != "uniform":
            raise ArgumentError("A02", "edge-length: expected no --vertices or --sizing beside it")
        wanted = edge_length
    elif vertices is None and sizing != "curvature":  # the others' lengths are in no unit
        vertices = DEFAULT_VERTICES
    chosen = {"vertices": vertices, "growth": growth, "order": order}
    said = {"edge_length": edge_length, **chosen}
    with progress() as tell:
        walk = Walk(tell)
        with noted_warnings() as notes:
            with walk.stage("reading", 0.1):
                read = read_field(field, array, spacing=spacing, origin=origin)
                read = read if smooth is None else read.smoothed(smooth)
                used = better_interpolation(read, isovalue)
            with walk.stage("meshing", 0.4):
                surface = MESHERS[mesher](used, isovalue, sizing=wanted, **chosen)
            with walk.stage("mesh quality", 0.2):
                quality = mesh_quality(surface, used, isovalue, sizing=wanted)
        command = command_line("mesh", mesh_file, given | {"out": another(out)})
        source = {"command": command, "files": [file_facts(field, read.name)]}
        save_mesh(
            surface,
            quality,
            out,
            title=f"isosurface {used.name} = {isovalue:g}, {mesher}, {sizing} edges",
            choices=source | _mesh_choices(used, isovalue, mesher, sizing, said),
            notes=notes,
            timings=walk.timings,
            progress=lambda s, d: tell(s, 0.7 + 0.3 * d),
        )
    for line in (*(f"note: {note}" for note in notes), *str(quality).splitlines()):
        say(line)
    say(f"time        {time.perf_counter() - start:.0f} s")
    say(f"open        {out / 'mesh_quality.png'}")


def _mesh_choices(
    field: ScalarField,
    isovalue: float,
    mesher: str,
    sizing: str,
    chosen: Mapping[str, object],
) -> dict[str, object]:
    """Everything that made a mesh, default or not."""
    return {
        "field": field.name,
        "samples": field_facts(field),
        "isovalue": isovalue,
        "interpolation": "logarithmic" if field.logarithmic else "plain",
        "interpolation_errors_at_half_resolution": interpolation_errors(field, isovalue),
        "mesher": method_name(MESHERS[mesher]),
        "sizing": method_name(SIZINGS[sizing]),
        **chosen,
        "vertices": chosen["vertices"] or "by sizing",
    }
