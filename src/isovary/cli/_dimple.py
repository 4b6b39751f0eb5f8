"""``isovary dimple``."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from cyclopts import Parameter

from ..crossings import run_through
from ..deform import Projectile, Region, dimple
from ..dimple_checks import check_finite
from ..errors import ArgumentError
from ..geometry import Floats
from ..io import read_surface
from ..io._atomic import check_output
from ..io._meshes import save_mesh
from ..levels import Walk
from ..names import SHAPES
from ..notes import noted_warnings
from ..quality import MeshQuality, mesh_quality
from ..records import Surface
from ._app import Whole, app, progress, say
from ._record import another, command_line, file_facts

_FINE = 4
_FILES = (".vtu", ".vtp", ".vtk", ".ply", ".obj", ".off", ".stl")


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
    steps: Whole = 20,
    subdivisions: Whole = _FINE,
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
        Where on the surface: three numbers with spaces between; once for each dimple, one after
        the other.
    radius
        Distance from a center beyond which nothing moves, several edges of the mesh.
    alpha
        Strength. Depth in radii, where the surface was flat: 1: 0.03; 3: 0.09; 5: 0.14; 9: 0.25;
        -1: 0.03 outward; -3: 0.10; -5: 0.17. The thesis's 100 to 900 correspond to 1 to 9.
    charge
        Of the projectile: positive pushes in, negative draws out.
    decay
        Width of the force, in radii.
    steps
        How long the force acts, in time steps of 0.01. More go deeper, they are not more exact:
        200 go 33 times as deep as 20.
    subdivisions
        How fine the sphere, ellipsoid or torus is: nodes grow four times with each. Not for
        files.
    order
        Of their elements. 2: curved; 1: flat. Not for files, which stay as they are.
    """
    given, start = dict(locals()), time.perf_counter()
    _check(shape, out, subdivisions, order)
    for point in center:
        Region(np.array(point), radius, decay)
    check_finite("alpha", alpha)
    Projectile(np.zeros(3), np.zeros(3), charge, steps)
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
                quality = _quality(base, made)
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
            original=base,
            progress=lambda s, d: tell(s, 0.6 + 0.4 * d),
        )
    for line in _summary(notes, quality, displacement):
        say(line)
    say(f"time        {time.perf_counter() - start:.0f} s")
    say("compare     original.vtu with mesh.vtu, node for node: docs/dimples.md has the steps")
    say(f"open        {out / 'displacement.png'}, {out / 'mesh.vtu'}")


def _summary(notes: Sequence[str], quality: MeshQuality, displacement: Floats) -> list[str]:
    size = np.linalg.norm(displacement, axis=1)
    moved = f"moved       {(size > 0).sum()} of {len(size)} nodes, at most by {size.max():.4g}"
    return [*(f"note: {note}" for note in notes), *str(quality).splitlines(), moved]


def _quality(base: Surface, made: Surface) -> MeshQuality:
    """Of the dimpled mesh; what runs through itself now is a fault of it."""
    found = mesh_quality(made)
    torn = {"pieces of triangles run through others": run_through(base, made)}
    return replace(found, tears=found.tears | torn)


def _check(shape: str, out: Path, subdivisions: int, order: int) -> None:
    """Raise ArgumentError A02 for words that cannot be meant."""
    if out.suffix.lower() in _FILES:
        raise ArgumentError(
            "A02", f"out: expected a folder, got the name of a file, {out}; name a folder"
        )
    if shape in SHAPES:
        if not 2 <= subdivisions <= 7:
            raise ArgumentError("A02", f"subdivisions: expected 2 to 7, got {subdivisions}")
        return
    if not Path(shape).suffix and not Path(shape).exists():
        close = get_close_matches(shape.lower(), SHAPES, 1)
        raise ArgumentError(
            "A02",
            f"shape: expected {', '.join(SHAPES)} or a surface file ({', '.join(_FILES)}), got "
            f"{shape}" + (f"; did you mean {close[0]}?" if close else ""),
        )
    for name, value, default in (("subdivisions", subdivisions, _FINE), ("order", order, 2)):
        if value != default:
            raise ArgumentError(
                "A02", f"{name}: expected none for a file, which stays as it is, got {value}"
            )


def _surface(shape: str, subdivisions: int, order: int) -> Surface:
    if shape not in SHAPES:
        return read_surface(shape)
    return SHAPES[shape](subdivisions, order)


def _choices(shape: str, given: dict[str, Any]) -> dict[str, object]:
    """Everything that made the mesh, default or not."""
    if shape not in SHAPES:
        given = given | {"shape": Path(shape)}
    files = [] if shape in SHAPES else [file_facts(Path(shape), "")]
    again = given | {"out": another(given["out"])}
    made = {"command": command_line("dimple", dimple_surface, again), "files": files}
    left = ("shape", "out") if shape in SHAPES else ("shape", "out", "subdivisions", "order")
    numbers = {name: value for name, value in given.items() if name not in left}
    return made | {"shape": shape} | numbers
