"""How large is the error of the change on real data, carried and with independent meshes?

Two electron densities of water (one O-H bond 0.95 and 1.00 angstrom), isosurface
at 0.05 e/bohr^3, 300 eigenpairs. The reference is a carried curved mesh of 6 000
vertices, evaluated in its own elements at every node of the mesh under test. The
error is the root mean square over nodes and times, relative to that of the change.
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


def change(vertices: int | None, order: int, carried: bool, times: np.ndarray | None) -> Run:
    """The change on one base mesh, with the pairs that the base keeps."""
    start = time.perf_counter()
    first, second = fields()
    raw = vertices is None
    mesh = partial(iv.marching_cubes, vertices=vertices, order=order, remeshed=not raw)
    base = mesh(first, ISOVALUE)
    if carried:
        other, match = iv.carry(base, second, ISOVALUE)
    else:
        other = mesh(second, ISOVALUE)
        match = iv.normal_rays(base, other)
    pairs, others = (iv.eigenpairs(iv.fem(surface), PAIRS) for surface in (base, other))
    times = iv.diffusion_times(pairs) if times is None else times
    after = iv.interpolate(match, other, iv.heat_kernel_signature(others, times))
    before = iv.heat_kernel_signature(pairs, times)
    scaled = iv.signature_difference(before, after, iv.heat_trace_scale(pairs, times))
    return Run(base, scaled, time.perf_counter() - start)


def reference() -> tuple[Run, np.ndarray]:
    run = change(REFERENCE_VERTICES, 2, True, None)
    times = iv.diffusion_times(iv.eigenpairs(iv.fem(run.base), PAIRS))
    return run, times


def relative_error(run: Run, exact: Run) -> float:
    """Root mean square of the error over that of the reference's change, at the run's nodes."""
    truth = iv.interpolate(iv.closest_point(run.base, exact.base), exact.base, exact.change)
    known = np.isfinite(run.change).all(axis=1)
    error = run.change[known] - truth[known]
    return float(np.sqrt((error**2).mean() / (truth[known] ** 2).mean()))


WAYS: dict[str, tuple[Callable[..., Run], tuple[int | None, ...]]] = {
    "carried, curved quadratic": (partial(change, order=2, carried=True), SIZES),
    "carried, flat linear": (partial(change, order=1, carried=True), SIZES),
    "independent, curved quadratic": (partial(change, order=2, carried=False), SIZES),
    "independent, flat linear": (partial(change, order=1, carried=False), SIZES),
    "independent, raw marching cubes, linear": (partial(change, order=1, carried=False), (None,)),
}


def measure() -> tuple[list[Row], Run, dict[str, Run]]:
    """One row a run, the reference, and the runs at 552 vertices by way."""
    exact, times = reference()
    rows, shown = [], {}
    for way, (run_on, sizes) in WAYS.items():
        for size in sizes:
            run = run_on(size, times=times)
            vertices = len(np.unique(run.base.corners))
            error = relative_error(run, exact)
            rows.append(Row(way, size, vertices, len(run.base.points), error, run.seconds))
            if size == 552:
                shown[way] = run
    return rows, exact, shown


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
