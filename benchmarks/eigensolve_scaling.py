"""How do time and memory of the eigensolve grow with the nodes and with the pairs?

An ellipsoid with the half axes 1, 1.2 and 0.85 and evenly spread vertices, so that no eigenvalue
repeats; flat linear and curved quadratic triangles. Each solve is a process of its own; the memory
is how far its peak rose during the solve. Beside it stands what isovary predicts to decide
whether a solve will fit. The exponents are fitted to the upper half of the sizes.
"""

from __future__ import annotations

import argparse
import json
import resource
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from eigensolvers import Problem, read_matrices, run_child, write_problem
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

import isovary as iv
from isovary.geometry import edges_of
from isovary.spectrum._memory import predicted_memory

PICTURE = Path(__file__).parents[1] / "docs" / "eigensolve_scaling.png"
NODES, PAIRS = (2500, 5000, 10_000, 20_000, 50_000, 100_000, 200_000), 300
COUNTS, NODES_OF_COUNTS = (50, 100, 200, 300, 500, 700, 1000), 10_000
ORDERS = {1: "flat linear", 2: "curved quadratic"}
HALF_AXES = np.array([1.0, 1.2, 0.85])
UNITS = {"seconds": ("wall time, s", 1.0), "memory": ("peak memory, MB", 1e-6)}
STYLES = {1: ("#0072b2", "o"), 2: ("#d55e00", "s")}


@dataclass(frozen=True)
class Row:
    """One solve; memory in bytes. ``failure`` says why there are no numbers."""

    order: int
    nodes: int
    pairs: int
    seconds: float = np.nan
    memory: float = np.nan
    predicted: float = np.nan
    failure: str = ""


def ellipsoid(nodes: int, order: int) -> iv.Surface:
    """A triaxial ellipsoid with about so many nodes, its vertices on a Fibonacci spiral."""
    from scipy.spatial import ConvexHull

    index = np.arange(nodes if order == 1 else (nodes + 6) // 4) + 0.5
    height, angle = 1 - 2 * index / len(index), np.pi * (1 + 5**0.5) * index
    radius = np.sqrt(1 - height**2)
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=1)
    triangles = outward(points, ConvexHull(points).simplices.astype(np.int64))
    if order == 2:
        edges, of_triangle, _ = edges_of(triangles)
        middle = points[edges].mean(axis=1)
        middle /= np.linalg.norm(middle, axis=1, keepdims=True)
        triangles = np.hstack([triangles, of_triangle + len(points)])
        points = np.concatenate([points, middle])
    return iv.Surface(points * HALF_AXES, triangles)


def outward(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Triangles around the origin, counter-clockwise seen from outside."""
    inward = np.linalg.det(points[triangles]) < 0
    return np.where(inward[:, None], triangles[:, ::-1], triangles)


def peak_memory() -> float:
    """Largest resident memory so far, in bytes.

    Linux hands ru_maxrss of the parent on to the child, so its own VmHWM is read there.
    """
    status = Path("/proc/self/status")
    if status.exists():
        lines = status.read_text().splitlines()
        return 1024.0 * next(int(line.split()[1]) for line in lines if line.startswith("VmHWM"))
    unit = 1 if sys.platform == "darwin" else 1024
    return float(unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)


def child(folder: Path, count: int) -> None:
    """Measure one solve of the matrices in the folder."""
    iv.eigenpairs(iv.fem(ellipsoid(1500, 1)), 10)  # loads the packages
    matrices = read_matrices(folder)
    before, start = peak_memory(), time.perf_counter()
    iv.eigenpairs(matrices, count)
    seconds = time.perf_counter() - start
    size, entries = matrices.mass.shape[0], matrices.stiffness.nnz
    measured = {
        "seconds": seconds,
        "memory": peak_memory() - before,
        "predicted": predicted_memory(size, entries, count),
    }
    (folder / "row.json").write_text(json.dumps(measured))


def measure(order: int, nodes: int, counts: tuple[int, ...]) -> list[Row]:
    """One row a count."""
    with tempfile.TemporaryDirectory() as parent:
        folder, surface = Path(parent) / "problem", ellipsoid(nodes, order)
        write_problem(folder, Problem(surface, iv.fem(surface), None))
        rows = []
        for count in counts:
            failure = run_child(__file__, "--child", folder, count)
            found = {} if failure else json.loads((folder / "row.json").read_text())
            rows.append(Row(order, len(surface.points), count, **found, failure=failure))
        return rows


def exponent(across: list[float], up: list[float]) -> float:
    """Slope of the straight line through the upper half of the points, in logarithms."""
    upper = slice(len(across) // 2, None) if len(across) > 3 else slice(None)
    return float(np.polyfit(np.log(across[upper]), np.log(up[upper]), 1)[0])


def column(rows: list[Row], order: int, name: str) -> list[float]:
    return [asdict(row)[name] for row in rows if row.order == order and not row.failure]


def exponents(rows: list[Row], across: str, up: str) -> list[float]:
    """One for each order."""
    return [exponent(column(rows, o, across), column(rows, o, up)) for o in ORDERS]


def span(numbers: list[float]) -> str:
    """The numbers' range: "1.1" or "1.1 to 1.3"."""
    ends = sorted({f"{number:.1f}" for number in numbers}, key=float)
    return ends[0] if len(ends) == 1 else f"{ends[0]} to {ends[-1]}"


def doubled(rows: list[Row], across: str, up: str) -> str:
    """How many times more for twice as many, of the elements for which it is most."""
    return f"{2 ** max(exponents(rows, across, up)):.1f}"


def draw_picture(by_nodes: list[Row], by_pairs: list[Row], path: Path) -> None:
    """Time above memory, against nodes and against pairs."""
    figure = Figure(figsize=(10.5, 6.6), dpi=150, facecolor="white", layout="constrained")
    columns = (
        (by_nodes, "nodes", f"{PAIRS} pairs"),
        (by_pairs, "pairs", f"{NODES_OF_COUNTS:,} nodes"),
    )
    factors = [doubled(rows, across, up) for rows, across, _ in columns for up in UNITS]
    title = (
        f"Twice the nodes take {factors[0]} times the time and {factors[1]} times the memory; "
        f"twice the pairs {factors[2]} and {factors[3]}"
    )
    figure.suptitle(title, x=0.01, ha="left", size=12, weight="bold", color="#1d1d1f")
    panels = figure.subplots(len(UNITS), len(columns), sharex="col", sharey="row")
    for place, (rows, across, said) in enumerate(columns):
        for axes, up in zip(panels[:, place], UNITS, strict=True):
            draw(axes, rows, across, up)
        panels[0, place].set_title(said.replace(",", " "), size=11, loc="left", weight="bold")
        panels[-1, place].set_xlabel(across)
    for axes, (words, _) in zip(panels[:, 0], UNITS.values(), strict=True):
        axes.set_ylabel(words)
    figure.savefig(path)


def draw(axes: Axes, rows: list[Row], across: str, up: str) -> None:
    scale = UNITS[up][1]
    for (order, words), slope in zip(ORDERS.items(), exponents(rows, across, up), strict=True):
        color, marker = STYLES[order]
        places = column(rows, order, across)
        label = f"{words}: {across}$^{{{slope:.2f}}}$"
        heights = scale * np.array(column(rows, order, up))
        axes.loglog(places, heights, color=color, marker=marker, ms=5, label=label)
        if up == "memory":
            predicted = scale * np.array(column(rows, order, "predicted"))
            axes.loglog(places, predicted, color=color, ls=":", lw=1.5)
    if up == "memory":
        axes.plot([], [], color="#666666", ls=":", lw=1.5, label="predicted before the solve")
    ticks = sorted({round(row.nodes, -2) if across == "nodes" else row.pairs for row in rows})
    axes.set_xticks(ticks, [f"{tick:,}".replace(",", " ") for tick in ticks])
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(lambda height, _: f"{height:,g}".replace(",", " "))
    axes.minorticks_off()
    axes.grid(color="#e4e4e4")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(fontsize=9, frameon=False, loc="upper left")


def table(rows: list[Row]) -> list[str]:
    return [
        "| elements | nodes | pairs | wall s | peak memory | predicted |",
        "| --- | --- | --- | --- | --- | --- |",
        *map(line, rows),
    ]


def line(row: Row) -> str:
    solved = f"| {ORDERS[row.order]} | {row.nodes:,} | {row.pairs:,} |"
    if row.failure:
        return f"{solved} failed: {row.failure} | | |"
    memory, predicted = (f"{size / 1e6:,.0f} MB" for size in (row.memory, row.predicted))
    return f"{solved} {row.seconds:.2f} | {memory} | {predicted} |"


def fits(rows: list[Row], across: str) -> str:
    time_of, memory_of = (span(exponents(rows, across, up)) for up in ("seconds", "memory"))
    return f"Time grows like {across} to the power {time_of}, memory like {memory_of}."


def report(
    picture: Path = PICTURE,
    nodes: tuple[int, ...] = NODES,
    counts: tuple[int, ...] = COUNTS,
) -> str:
    """Markdown: the picture, which is drawn to the path given, and two tables."""
    by_nodes = [row for o in ORDERS for size in nodes for row in measure(o, size, (PAIRS,))]
    by_pairs = [row for o in ORDERS for row in measure(o, NODES_OF_COUNTS, counts)]
    draw_picture(by_nodes, by_pairs, picture)
    lines = [
        "## Growth with nodes and pairs",
        "",
        (__doc__ or "").split("\n\n", 1)[1].replace("\n", " ").strip(),
        "",
        f"![Time and memory of the eigensolve against nodes and pairs]({picture.name})",
        "",
        fits(by_nodes, "nodes"),
        "",
        *table(by_nodes),
        "",
        fits(by_pairs, "pairs"),
        "",
        *table(by_pairs),
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--child", nargs=2, help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.child:
        child(Path(chosen.child[0]), int(chosen.child[1]))
    else:
        print(report())


if __name__ == "__main__":
    main()
