"""How large is the error of the change on real data, carried and with independent meshes?

Two electron densities of water (one O-H bond 0.95 and 1.00 angstrom), isosurface
at 0.05 e/bohr^3, 300 eigenpairs. Carried: aligned, and by the map that changes lengths
least. Independent: rays along normals. The reference is a carried curved mesh of 6 000
vertices, evaluated in its own elements at every node of the mesh under test; for rays it
is carried along normals, which matches the same points. The error is the root mean square
over nodes and times, relative to that of the change.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

import isovary as iv
from isovary.data import water_pair

ISOVALUE, PAIRS, REFERENCE_VERTICES = 0.05, 300, 6000
SIZES = (400, 552, 1100, 2200)


@dataclass
class Row:
    """One line of the table; ``wanted`` is the number of vertices asked for."""

    way: str
    wanted: int | None
    vertices: int
    nodes: int
    error: float
    seconds: float


@dataclass
class Run:
    """A change on one base mesh."""

    base: iv.Surface
    change: np.ndarray
    seconds: float


def fields() -> tuple[iv.ScalarField, iv.ScalarField]:
    base, perturbed = (
        iv.better_interpolation(iv.read_field(path), ISOVALUE) for path in water_pair()
    )
    return base, perturbed


def matched(
    mesh: Callable[..., iv.Surface], base: iv.Surface, second: iv.ScalarField, way: str
) -> tuple[iv.Surface, iv.Correspondence]:
    """The perturbed surface and what is matched with what: isometric, normals or rays."""
    if way == "isometric":
        motion = iv.align(base, iv.contour(second, ISOVALUE), second, ISOVALUE).motion
        return iv.carry_isometrically(base, [iv.MovedField(second, motion)], ISOVALUE)
    if way == "normals":
        return iv.carry(base, second, ISOVALUE)
    other = mesh(second, ISOVALUE)
    return other, iv.normal_rays(base, other)


def change(vertices: int | None, order: int, way: str, times: np.ndarray | None) -> Run:
    """The change on one base mesh, with the pairs that the base keeps."""
    start = time.perf_counter()
    first, second = fields()
    raw = vertices is None
    mesh = partial(iv.marching_cubes, vertices=vertices, order=order, remeshed=not raw)
    base = mesh(first, ISOVALUE)
    other, match = matched(mesh, base, second, way)
    pairs, others = (iv.eigenpairs(iv.fem(surface), PAIRS) for surface in (base, other))
    times = iv.diffusion_times(pairs) if times is None else times
    after = iv.interpolate(match, other, iv.heat_kernel_signature(others, times))
    before = iv.heat_kernel_signature(pairs, times)
    scaled = iv.signature_difference(before, after, iv.heat_trace_scale(pairs, times))
    return Run(base, scaled, time.perf_counter() - start)


def references() -> tuple[dict[str, Run], np.ndarray]:
    """The reference of each way, and the times."""
    run = change(REFERENCE_VERTICES, 2, "isometric", None)
    times = iv.diffusion_times(iv.eigenpairs(iv.fem(run.base), PAIRS))
    return {"isometric": run, "rays": change(REFERENCE_VERTICES, 2, "normals", times)}, times


def relative_error(run: Run, exact: Run) -> float:
    """Root mean square of the error over that of the reference's change, at the run's nodes."""
    truth = iv.interpolate(iv.closest_point(run.base, exact.base), exact.base, exact.change)
    known = np.isfinite(run.change).all(axis=1)
    error = run.change[known] - truth[known]
    return float(np.sqrt((error**2).mean() / (truth[known] ** 2).mean()))


WAYS: dict[str, tuple[int, str, tuple[int | None, ...]]] = {
    "carried, curved quadratic": (2, "isometric", SIZES),
    "carried, flat linear": (1, "isometric", SIZES),
    "independent, curved quadratic": (2, "rays", SIZES),
    "independent, flat linear": (1, "rays", SIZES),
    "independent, raw marching cubes, linear": (1, "rays", (None,)),
}


def measure() -> tuple[list[Row], Run, dict[str, Run]]:
    """One row a run, the reference, and the runs at 552 vertices by way."""
    exact, times = references()
    rows, shown = [], {}
    for name, (order, way, sizes) in WAYS.items():
        for size in sizes:
            run = change(size, order, way, times)
            vertices = len(np.unique(run.base.corners))
            error = relative_error(run, exact[way])
            rows.append(Row(name, size, vertices, len(run.base.points), error, run.seconds))
            if size == 552:
                shown[name] = run
    return rows, exact["isometric"], shown


def report(picture: Path | None = None) -> str:
    """Markdown: the table; the picture is drawn to the path given."""
    rows, exact, shown = measure()
    if picture is not None:
        from mesh_noise_picture import draw_picture

        draw_picture(rows, exact, shown, picture)
    rms = float(np.sqrt((exact.change**2).mean()))
    lines = [
        "## The change on carried and on independent meshes",
        "",
        (__doc__ or "").split("\n\n", 1)[1].replace("\n", " ").strip()
        + f" The change itself is {rms:.2e} (rms).",
        "",
        "| way | vertices | nodes | error relative to the change | seconds |",
        "| --- | --- | --- | --- | --- |",
    ]
    lines += [
        f"| {row.way} | {row.vertices:,} | {row.nodes:,} | {row.error:.2%} | {row.seconds:.1f} |"
        for row in rows
    ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    print(report(Path("mesh_noise.png")))
