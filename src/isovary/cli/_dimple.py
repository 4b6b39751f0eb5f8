"""``isovary dimple``."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from cyclopts import Parameter

from ..deform import dimple
from ..errors import ArgumentError
from ..io import read_surface
from ..io._atomic import check_output
from ..io._meshes import save_mesh
from ..levels import Walk
from ..notes import noted_warnings
from ..quality import mesh_quality
from ..records import Surface
from ..shapes import ellipsoid, icosphere, torus
from ._app import app, progress, say
from ._record import another, command_line, file_facts

_AROUND, _ALONG = 24, 10  # nodes of a torus per subdivision step
_SHAPES: dict[str, Callable[[int, int], Surface]] = {
    "sphere": lambda fine, order: icosphere(fine, order=order),
    "ellipsoid": lambda fine, order: ellipsoid((1, 1, 2), fine, order=order),
    "torus": lambda fine, order: torus(
        1.0, 0.4, (_AROUND * 2 ** (fine - 2), _ALONG * 2 ** (fine - 2)), order=order
    ),
}


@app.command(name="dimple")
def dimple_surface(
    shape: str,
    /,
    *,
    out: Annotated[Path, Parameter(name=["--out", "-o"])],
    center: Annotated[Sequence[tuple[float, float, float]], Parameter(name="--center")],
    radius: float,
    alpha: float = 5.0,
    charge: float = 1.0,
    decay: float = 0.35,
    steps: int = 20,
    subdivisions: int = 4,
    order: Literal[1, 2] = 2,
) -> None:
    """Push dimples into a surface, or draw them out, with nodes that correspond by number.

    Parameters
    ----------
    shape
        A surface file (.vtu, .vtp, .vtk, .ply, .obj, .off, .stl), or sphere (radius 1), ellipsoid
        (1, 1, 2) or torus (1, 0.4).
    out
        Folder for the dimpled mesh; an earlier result in it is replaced.
    center
        Where on the surface; once for each dimple, one after the other.
    radius
        Distance from a center beyond which nothing moves.
    alpha
        Strength. The thesis's 100 to 900 correspond to 1 to 9.
    charge
        Of the projectile: positive pushes in, negative draws out.
    decay
        Width of the force, in radii.
    steps
        Time steps of 0.01.
    subdivisions
        How fine the sphere, ellipsoid or torus is: nodes grow four times with each.
    order
        Of their elements. 2: curved; 1: flat.
    """
    given, start = dict(locals()), time.perf_counter()
    check_output(out)
    with progress() as tell:
        walk = Walk(tell)
        with noted_warnings() as notes:
            with walk.stage("reading", 0.1):
                base = _surface(shape, subdivisions, order)
            with walk.stage("dimples", 0.3):
                made = dimple(
                    base, center, radius, alpha=alpha, charge=charge, decay=decay, steps=steps
                )
            with walk.stage("mesh quality", 0.2):
                quality = mesh_quality(made)
        displacement = made.points - base.points
        save_mesh(
            made,
            quality,
            out,
            title=f"{Path(shape).name}, dimpled",
            choices=_choices(shape, given),
            notes=notes,
            timings=walk.timings,
            arrays={"displacement": displacement},
            progress=lambda s, d: tell(s, 0.6 + 0.4 * d),
        )
    for line in (*(f"note: {note}" for note in notes), *str(quality).splitlines()):
        say(line)
    size = np.linalg.norm(displacement, axis=1)
    say(f"moved       {(size > 0).sum()} of {len(size)} nodes, at most by {size.max():.4g}")
    say(f"time        {time.perf_counter() - start:.0f} s")
    say(f"open        {out / 'mesh.vtu'}")


def _surface(shape: str, subdivisions: int, order: int) -> Surface:
    if shape not in _SHAPES:
        return read_surface(shape)
    if not 2 <= subdivisions <= 7:
        raise ArgumentError("A02", f"subdivisions: expected 2 to 7, got {subdivisions}")
    return _SHAPES[shape](subdivisions, order)


def _choices(shape: str, given: dict[str, Any]) -> dict[str, object]:
    """Everything that made the mesh, default or not."""
    if shape not in _SHAPES:
        given = given | {"shape": Path(shape)}
    files = [] if shape in _SHAPES else [file_facts(Path(shape), "")]
    again = given | {"out": another(given["out"])}
    made = {"command": command_line("dimple", dimple_surface, again), "files": files}
    numbers = {name: value for name, value in given.items() if name not in ("shape", "out")}
    return made | {"shape": shape} | numbers
