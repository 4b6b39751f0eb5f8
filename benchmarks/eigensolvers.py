"""How fast and how exact is the eigensolve, beside its peers?

The shape is a sphere with a dimple 0.10 deep, the perturbed one 0.11, from fields of 64^3
samples (raw marching cubes: as many as give the nodes asked for). Meshes: flat linear and curved
quadratic triangles of even shape, and the raw triangles of marching cubes. Each measurement is
a process of its own, one after the other; it first solves a tiny problem, so that loading the
packages does not count. Wall and CPU seconds are those of the eigensolve alone, with as many
threads as each solver takes by itself; the fastest of the repeats. The matrices are given, except
to pyFM, whose `process` sums them up as well. "LaPy / this" is the wall time of the faster LaPy
over this one's, "SciPy / this" likewise.

The reference is SciPy's `eigsh` with `tol=0` and more pairs than asked for, on the same matrices;
so the errors of SciPy's own row tell how far the reference can be trusted. LaPy has the matrices
of isovary's linear elements but for rounding. pyFM and robust_laplacian have others; their
reference is SciPy on theirs, so the error is that of their solver, not of their Laplacian. The
eigenvalue error is the largest relative one, without the constant; the HKS error is the largest at
any node and any of 100 times, relative to the mean over the surface. Both leave out the last
pairs where 300 cuts a repeated eigenvalue. (isovary's tolerance is for the error's mean over the
surface.) "From start" solves the perturbed surface, carried from the base, from 330 pairs of the
base; it needs to be exact only relative to the change (the number is its `tolerance_of_change`),
so its HKS error, marked with a star, is the largest error over the largest change. The peers solve
the base all the same.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from datetime import date
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path

import numpy as np

import isovary as iv

DOCS = Path(__file__).parents[1] / "docs"
SIZES, PAIRS, MORE = (2500, 10_000, 50_000), 300, 10
REPEATS, ENOUGH = 3, 30.0  # runs a row; no further one once they took so many seconds
BASE, PERTURBED, WIDTH = 0.10, 0.11, 0.3
SHIFT = -0.01
SAME = 1e-6  # relative distance of eigenvalues that count as repeated
MESHES = ("flat linear", "curved quadratic", "raw marching cubes")
LAPY, SCIPY = ("LaPy, CHOLMOD", "LaPy, SuperLU"), "SciPy eigsh"

Pairs = tuple[np.ndarray, np.ndarray]  # eigenvalues (k,), eigenvectors (n, k)


@dataclass(frozen=True)
class Problem:
    """What a solver may use; ``start`` and ``matrices`` are of the same nodes as ``surface``."""

    surface: iv.Surface
    matrices: iv.Laplacian
    start: iv.Eigenpairs | None


@dataclass(frozen=True)
class Prepared:
    """The timed call, and the solver's matrices where they are its own."""

    solve: Callable[[], Pairs]
    own: Callable[[], iv.Laplacian] | None = None


@dataclass(frozen=True)
class Reference:
    """Eigenvalues and signature of the pairs up to the last whole multiplet."""

    values: np.ndarray
    signature: np.ndarray
    times: np.ndarray
    mean: np.ndarray


@dataclass(frozen=True)
class Row:
    """One line of a table; no ``wall`` if the solver is absent or failed."""

    solver: str
    wall: float | None = None
    cpu: float | None = None
    values: float | None = None
    signature: float | None = None
    said: str = ""


# The solvers: each prepares, untimed, a call to be timed.


def isovary_at(tolerance: float) -> Callable[[Problem, int], Prepared]:
    def prepare(problem: Problem, count: int) -> Prepared:
        def solve() -> Pairs:
            pairs = iv.eigenpairs(problem.matrices, count, tolerance=tolerance)
            return pairs.values, pairs.vectors

        return Prepared(solve)

    return prepare


def isovary_from_start(of_change: float) -> Callable[[Problem, int], Prepared]:
    def prepare(problem: Problem, count: int) -> Prepared:
        def solve() -> Pairs:
            pairs = iv.eigenpairs(
                problem.matrices, count, start=problem.start, tolerance_of_change=of_change
            )
            if pairs.solver not in ("from start", "dense"):
                raise RuntimeError(f"the start was not used: {pairs.solver}")
            return pairs.values, pairs.vectors

        return Prepared(solve)

    return prepare


def scipy_eigsh(problem: Problem, count: int) -> Prepared:
    return Prepared(lambda: by_scipy(problem.matrices, count))


def lapy(use_cholmod: bool) -> Callable[[Problem, int], Prepared]:
    def prepare(problem: Problem, count: int) -> Prepared:
        from lapy import Solver, TriaMesh

        mesh = TriaMesh(problem.surface.points, problem.surface.triangles)
        solver = Solver(mesh, use_cholmod=use_cholmod)
        return Prepared(lambda: solver.eigs(count))

    return prepare


def pyfm(problem: Problem, count: int) -> Prepared:
    from pyFM.mesh import TriMesh

    mesh = TriMesh(problem.surface.points, problem.surface.triangles)

    def solve() -> Pairs:
        mesh.process(k=count)
        return mesh.eigenvalues, mesh.eigenvectors

    return Prepared(solve, lambda: iv.Laplacian(mesh.stiffness.tocsr(), mesh.mass.tocsr()))


def robust(problem: Problem, count: int) -> Prepared:
    from robust_laplacian import mesh_laplacian

    stiffness, mass = mesh_laplacian(
        np.array(problem.surface.points), np.array(problem.surface.triangles)
    )
    own = iv.Laplacian(stiffness.tocsr(), mass.tocsr())
    return Prepared(lambda: by_scipy(own, count), lambda: own)


@dataclass(frozen=True)
class Solver:
    """``package`` is the module it needs, ``linear`` whether it knows flat elements only."""

    prepare: Callable[[Problem, int], Prepared]
    package: str = "isovary"
    linear: bool = False
    carried: bool = False


SOLVERS = {
    "isovary, tolerance 1e-8": Solver(isovary_at(1e-8)),
    "isovary, tolerance 1e-5": Solver(isovary_at(1e-5)),
    "isovary, from start, 2e-2": Solver(isovary_from_start(2e-2), carried=True),
    "isovary, from start, 2e-3": Solver(isovary_from_start(2e-3), carried=True),
    "isovary, from start, 2e-4 (default)": Solver(isovary_from_start(2e-4), carried=True),
    SCIPY: Solver(scipy_eigsh, "scipy"),
    LAPY[0]: Solver(lapy(True), "cholespy", linear=True),
    LAPY[1]: Solver(lapy(False), "lapy", linear=True),
    "pyFM": Solver(pyfm, "pyFM", linear=True),
    "robust_laplacian, SciPy eigsh": Solver(robust, "robust_laplacian", linear=True),
}
PACKAGES = ("isovary", "numpy", "scipy", "lapy", "cholespy", "pyfmaps", "robust-laplacian")


# The shape and its meshes.


def dimpled(depth: float, samples: int = 64) -> iv.ScalarField:
    def value(points: np.ndarray) -> np.ndarray:
        radius = np.linalg.norm(points, axis=-1)
        angle = np.arctan2(np.hypot(points[..., 0], points[..., 1]), points[..., 2])
        return 1 - depth * np.exp(-((angle / WIDTH) ** 2)) - radius

    return iv.ScalarField.from_function(value, ((-1.6,) * 3, (1.6,) * 3), (samples,) * 3)


def mesh(kind: str, nodes: int) -> iv.Surface:
    if kind == "flat linear":
        return iv.marching_cubes(dimpled(BASE), 0.0, vertices=nodes, order=1)
    if kind == "curved quadratic":
        return iv.marching_cubes(dimpled(BASE), 0.0, vertices=nodes // 4, order=2)
    samples = 2 * round(38 * np.sqrt(nodes / 2500) / 2)  # 38^3 samples give 2 500 nodes
    return iv.contour(dimpled(BASE, samples), 0.0)


# Files between the processes.


def write_problem(folder: Path, problem: Problem) -> None:
    folder.mkdir(parents=True)
    surface = problem.surface
    np.savez(
        folder / "surface.npz",
        points=surface.points,
        triangles=surface.triangles,
        normals=surface.normals,
    )
    for name in ("stiffness", "mass"):
        matrix = getattr(problem.matrices, name).tocsr()
        np.savez(
            folder / f"{name}.npz", data=matrix.data, indices=matrix.indices, indptr=matrix.indptr
        )
    if problem.start is not None:
        start = problem.start
        np.savez(
            folder / "start.npz",
            values=start.values,
            vectors=start.vectors,
            residuals=start.residuals,
            area=start.area,
        )


def read_problem(folder: Path) -> Problem:
    start = folder / "start.npz"
    return Problem(
        iv.Surface(**read(folder / "surface.npz")),
        read_matrices(folder),
        iv.Eigenpairs(**read(start)) if start.exists() else None,
    )


def read_matrices(folder: Path) -> iv.Laplacian:
    from scipy.sparse import csr_array

    parts = (read(folder / f"{name}.npz") for name in ("stiffness", "mass"))
    return iv.Laplacian(*(csr_array((p["data"], p["indices"], p["indptr"])) for p in parts))


def read(path: Path) -> dict[str, np.ndarray]:
    with np.load(path) as arrays:
        return {name: value if value.ndim else value.item() for name, value in arrays.items()}


def read_reference(path: Path) -> Reference:
    return Reference(**read(path))


def run_child(script: str, *arguments: object) -> str:
    """Run a benchmark's file in a process of its own; the last line of its error, if any."""
    command = [sys.executable, script, *map(str, arguments)]
    done = subprocess.run(command, stderr=subprocess.PIPE, text=True)
    return "" if done.returncode == 0 else (done.stderr.strip().splitlines() or ["stopped"])[-1]


# One measurement, in a process of its own.


def by_scipy(matrices: iv.Laplacian, count: int) -> Pairs:
    from scipy.sparse.linalg import eigsh

    values, vectors = eigsh(matrices.stiffness, count, matrices.mass, sigma=SHIFT, tol=0)
    order = np.argsort(values)
    return values[order], vectors[:, order]


def signature(pairs: Pairs, count: int, times: np.ndarray) -> np.ndarray:
    values, vectors = pairs[0][:count], pairs[1][:, :count]
    return vectors**2 @ np.exp(-np.outer(values, times))


def reference(matrices: iv.Laplacian, times: np.ndarray | None = None) -> Reference:
    """SciPy's pairs up to the last gap within the count, and the times that they resolve."""
    values, vectors = by_scipy(matrices, PAIRS + MORE)
    apart = np.diff(values[: PAIRS + 1]) > SAME * values[PAIRS]
    count = int(np.flatnonzero(apart)[-1]) + 1
    if times is None:
        pairs = iv.Eigenpairs(values[:PAIRS], vectors[:, :PAIRS], values[:PAIRS], matrices.area)
        times = iv.diffusion_times(pairs)
    mean = np.exp(-np.outer(values[:count], times)).sum(axis=0) / matrices.area
    return Reference(values[:count], signature((values, vectors), count, times), times, mean)


def clocks() -> tuple[float, float]:
    """Wall and CPU seconds (user and system, all threads) of this process."""
    spent = os.times()
    return time.perf_counter(), spent.user + spent.system


def child(name: str, folder: Path, output: Path) -> None:
    """Measure one solver on the problem in the folder."""
    solver = SOLVERS[name]
    warm_up(solver)
    problem = read_problem(folder)
    runs: list[tuple[float, float]] = []
    while len(runs) < REPEATS and sum(wall for wall, _ in runs) < ENOUGH:
        prepared = solver.prepare(problem, PAIRS)
        before = clocks()
        pairs = prepared.solve()
        wall, cpu = np.subtract(clocks(), before)
        runs.append((wall, cpu))
    wall, cpu = min(runs)
    exact = read_reference(folder / "reference.npz")
    if prepared.own is not None:
        exact = reference(prepared.own(), exact.times)
        np.savez(output.with_suffix(".reference.npz"), **asdict(exact))
    found = signature(pairs, len(exact.values), exact.times)
    np.savez(output.with_suffix(".npz"), values=pairs[0], signature=found)
    output.with_suffix(".json").write_text(json.dumps({"wall": wall, "cpu": cpu}))


def warm_up(solver: Solver) -> None:
    surface = iv.icosphere(4, order=1)
    matrices = iv.fem(surface)
    start = iv.eigenpairs(matrices, 40) if solver.carried else None
    solver.prepare(Problem(surface, matrices, start), 25).solve()


# All measurements.


def prepare(folder: Path, kind: str, nodes: int, carried: bool) -> int:
    """Write the base's problem, and the carried one if it is wanted; the number of nodes."""
    surface = mesh(kind, nodes)
    base = Problem(surface, iv.fem(surface), None)
    write_problem(folder / "base", base)
    exact = reference(base.matrices)
    np.savez(folder / "base" / "reference.npz", **asdict(exact))
    if carried:
        other = iv.carry(surface, dimpled(PERTURBED), 0.0)[0]
        start = iv.eigenpairs(base.matrices, PAIRS * 11 // 10)
        problem = Problem(other, iv.fem(other), start)
        write_problem(folder / "carried", problem)
        np.savez(
            folder / "carried" / "reference.npz", **asdict(reference(problem.matrices, exact.times))
        )
    return len(surface.points)


def measure(name: str, folder: Path) -> Row:
    """The fastest of the repeats and its errors."""
    solver = SOLVERS[name]
    if find_spec(solver.package) is None:
        return Row(name, said=f"{solver.package} is not installed")
    problem, output = folder / ("carried" if solver.carried else "base"), folder / "run.json"
    failure = run_child(__file__, "--child", name, problem, output)
    if failure:
        return Row(name, said=f"failed: {failure}")
    best = json.loads(output.read_text())
    own = folder / "run.reference.npz"
    exact = read_reference(own if own.exists() else problem / "reference.npz")
    own.unlink(missing_ok=True)
    found = read(folder / "run.npz")
    return Row(
        name,
        best["wall"],
        best["cpu"],
        value_error(found["values"], exact.values),
        signature_error(found["signature"], exact, folder if solver.carried else None),
    )


def value_error(found: np.ndarray, exact: np.ndarray) -> float:
    return float(np.abs(found[1 : len(exact)] / exact[1:] - 1).max())


def signature_error(found: np.ndarray, exact: Reference, folder: Path | None) -> float:
    """Relative to the mean or, with the folder of a carried problem, to the change."""
    error = np.abs(found - exact.signature) / exact.mean
    if folder is None:
        return float(error.max())
    base = read_reference(folder / "base" / "reference.npz")
    change = np.abs(exact.signature - base.signature) / exact.mean
    return float(error.max() / change.max())


def table(kind: str, nodes: int, solvers: list[str]) -> list[str]:
    """Markdown of one mesh."""
    names = [n for n in solvers if kind != "curved quadratic" or not SOLVERS[n].linear]
    carried = any(SOLVERS[name].carried for name in names)
    with tempfile.TemporaryDirectory() as folder:
        count = prepare(Path(folder), kind, nodes, carried)
        rows = [measure(name, Path(folder)) for name in names]
    peers = best_wall(rows, LAPY), best_wall(rows, (SCIPY,))
    return [
        f"### {count:,} nodes, {kind}",
        "",
        "| solver | wall s | CPU s | LaPy / this | SciPy / this | eigenvalue error | HKS error |",
        "| --- | --- | --- | --- | --- | --- | --- |",
        *(line(row, peers) for row in rows),
        "",
    ]


def best_wall(rows: list[Row], names: tuple[str, ...]) -> float | None:
    walls = [row.wall for row in rows if row.solver in names and row.wall is not None]
    return min(walls, default=None)


def line(row: Row, peers: tuple[float | None, float | None]) -> str:
    if row.wall is None:
        return f"| {row.solver} | {row.said} | | | | | |"
    ratios = " | ".join("–" if wall is None else f"{wall / row.wall:.1f}" for wall in peers)
    star = " *" if SOLVERS[row.solver].carried else ""
    return (
        f"| {row.solver} | {row.wall:.2f} | {row.cpu:.2f} | {ratios} | "
        f"{row.values:.1e} | {row.signature:.1e}{star} |"
    )


def installed(package: str) -> str:
    try:
        return f"{package} {version(package)}"
    except PackageNotFoundError:
        return f"{package} absent"


def report(
    sizes: tuple[int, ...] = SIZES,
    solvers: tuple[str, ...] = tuple(SOLVERS),
) -> str:
    """Markdown: what was measured, and a table a mesh."""
    lines = [
        "## Beside its peers",
        "",
        (__doc__ or "").split("\n\n", 1)[1].strip(),
        "",
        f"{PAIRS} pairs. A row has {REPEATS} runs, but none after {ENOUGH:.0f} s. "
        f"{', '.join(installed(package) for package in PACKAGES)}.",
        "",
    ]
    for nodes in sizes:
        for kind in MESHES:
            lines += table(kind, nodes, list(solvers))
    return "\n".join(lines)


def header() -> str:
    return (
        "# The eigensolve: speed, accuracy, memory\n\n"
        f"Measured with isovary {iv.__version__} on {date.today()}, Python "
        f"{platform.python_version()}, {platform.machine()}, {os.cpu_count()} cores, load average "
        f"{os.getloadavg()[0]:.1f} at the start (BLAS threads that wait for a busy core cost the "
        "peers many times more than isovary, so it should be near 0). "
        "`make bench-eigensolve` measures again and rewrites this page."
    )


def parsed() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--sizes", default=",".join(map(str, SIZES)), help="nodes: 2500,10000")
    parser.add_argument("--only", help=f"solvers, by a part of the name, from: {list(SOLVERS)}")
    parser.add_argument("--no-scaling", action="store_true", help="leave out eigensolve_scaling")
    parser.add_argument("--output", type=Path, default=DOCS / "eigensolve.md")
    parser.add_argument("--child", nargs=3, help=argparse.SUPPRESS)
    return parser.parse_args()


def main() -> None:
    chosen = parsed()
    if chosen.child:
        name, folder, output = chosen.child
        child(name, Path(folder), Path(output))
        return
    import eigensolve_scaling

    sizes = tuple(int(size) for size in chosen.sizes.split(","))
    parts = chosen.only.split(",") if chosen.only else [""]
    solvers = tuple(n for n in SOLVERS if any(part.lower() in n.lower() for part in parts))
    sections = [header(), report(sizes, solvers)]
    if not chosen.no_scaling:
        sections.append(
            eigensolve_scaling.report(chosen.output.with_name("eigensolve_scaling.png"))
        )
    text = "\n\n".join(section.rstrip() for section in sections) + "\n"
    chosen.output.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
