"""Which operator? Accuracy and time of every Laplacian of isovary against exact answers.

Two surfaces whose heat kernel signature is known: the unit sphere (harmonics) and the
spheroid with semi-axes 1, 1, 2 (separation of variables, solved in one dimension). Both are
meshed from fields sampled on a grid, as a user's data would be, with about 1 000, 3 000 and
12 000 nodes; curved quadratic elements get a quarter of the vertices, so that all have the
same number of unknowns. 300 eigenpairs, 100 times from 4 ln 10 / lambda_300 to
4 ln 10 / lambda_2. The error is that of the signature relative to the exact one, root mean
square over nodes (by area) and times.
"""

from __future__ import annotations

import os
import platform
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import date
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

import isovary as iv
from isovary.geometry import node_areas

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))
from oracles import sphere_signature, spheroid_eigenvalues, spheroid_signature  # noqa: E402

DOCS = ROOT / "docs"
SIZES = (1000, 3000, 12000)
PAIRS, TIMES = 300, 100


@dataclass(frozen=True)
class Operator:
    """A way to discretize: its name, how it is called, and how it is drawn."""

    name: str
    call: str
    make: Callable[[iv.Surface], iv.Laplacian]
    style: tuple[str, str, str]
    mesh: str = "flat"  # or "curved", or "from a file": flat triangles with midpoints


OPERATORS = (
    Operator("curved quadratic FEM", "fem", iv.fem, ("#009e73", "o", "-"), "curved"),
    Operator(
        "curved quadratic, lumped",
        "fem(lumped=True)",
        partial(iv.fem, lumped=True),
        ("#009e73", "s", ":"),
        "curved",
    ),
    Operator(
        "flat quadratic FEM",
        "fem(surface.quadratic())",
        iv.fem,
        ("#004d40", "D", "--"),
        "from a file",
    ),
    Operator("linear FEM", "fem", iv.fem, ("#0072b2", "o", "-")),
    Operator(
        "linear, lumped", "fem(lumped=True)", partial(iv.fem, lumped=True), ("#0072b2", "s", ":")
    ),
    Operator("cotangent, Voronoi areas", "cotangent", iv.cotangent, ("#56b4e9", "^", "-")),
    Operator("robust (intrinsic Delaunay)", "robust", iv.robust, ("#56b4e9", "v", ":")),
    Operator("mesh Laplacian (Belkin)", "mesh_laplacian", iv.mesh_laplacian, ("#e69f00", "o", "-")),
    Operator("point cloud (Belkin)", "point_cloud", iv.point_cloud, ("#e69f00", "s", ":")),
    Operator("uniform graph", "uniform_graph", iv.uniform_graph, ("#d55e00", "^", "-")),
    Operator("kNN graph, 50, heat", "knn_graph", iv.knn_graph, ("#cc79a7", "o", "-")),
    Operator("epsilon graph", "epsilon_graph", iv.epsilon_graph, ("#cc79a7", "s", ":")),
)


def mean_mass(surface: iv.Surface) -> iv.Laplacian:
    """Linear elements with the mean of consistent and lumped mass."""
    both = iv.fem(surface), iv.fem(surface, lumped=True)
    return iv.Laplacian(both[0].stiffness, (both[0].mass + both[1].mass).tocsr() / 2)


@dataclass(frozen=True)
class Shape:
    """A surface with a known signature."""

    name: str
    axis: float
    exact: Callable[[np.ndarray, np.ndarray], np.ndarray]  # heights, times -> (n, T)
    eigenvalues: np.ndarray

    @property
    def times(self) -> np.ndarray:
        """The thesis's times, from the exact spectrum."""
        reach = 4 * np.log(10)
        return np.geomspace(reach / self.eigenvalues[PAIRS - 1], reach / self.eigenvalues[1], TIMES)

    def mesh(self, nodes: int, kind: str) -> iv.Surface:
        """About so many nodes on the isosurface of a sampled Gaussian."""
        high = 1.4 * np.array([1.0, 1.0, self.axis])
        stretch = np.array([1.0, 1.0, self.axis])
        field = iv.ScalarField.from_function(
            lambda p: np.exp(-0.5 * ((p / stretch) ** 2).sum(axis=-1)),
            (-high, high),
            (41, 41, 41),
            logarithmic=True,
        )
        vertices = nodes if kind == "flat" else nodes // 4
        order = 2 if kind == "curved" else 1
        mesh = iv.marching_cubes(field, float(np.exp(-0.5)), vertices=vertices, order=order)
        return mesh.quadratic() if kind == "from a file" else mesh


@dataclass(frozen=True)
class Row:
    """One operator on one mesh."""

    shape: Shape
    operator: Operator
    size: int
    nodes: int
    rms: float
    worst: float
    eigenvalues: float
    build: float
    solve: float


def shapes() -> tuple[Shape, Shape]:
    """The sphere and the spheroid."""
    degree = np.arange(30)
    ball = np.repeat(degree * (degree + 1.0), 2 * degree + 1)
    return (
        Shape("unit sphere", 1.0, lambda z, t: np.tile(sphere_signature(t), (len(z), 1)), ball),
        Shape(
            "spheroid 1 : 1 : 2",
            2.0,
            partial(spheroid_signature, 2.0),
            spheroid_eigenvalues(2.0, PAIRS),
        ),
    )


def measure(shape: Shape, operator: Operator, size: int, surface: iv.Surface) -> Row:
    """Errors and seconds."""
    start = time.perf_counter()
    laplacian = operator.make(surface)
    built = time.perf_counter()
    pairs = iv.eigenpairs(laplacian, PAIRS).truncate(PAIRS)
    solved = time.perf_counter()
    found = iv.heat_kernel_signature(pairs, shape.times)
    error = found / shape.exact(surface.points[:, 2], shape.times) - 1
    weights = node_areas(surface.points, surface.triangles)
    values = pairs.values[1:] / shape.eigenvalues[1:PAIRS] - 1
    return Row(
        shape,
        operator,
        size,
        len(surface.points),
        float(np.sqrt((weights @ error**2).mean() / weights.sum())),
        float(np.abs(error).max()),
        float(np.median(np.abs(values))),
        built - start,
        solved - built,
    )


def icospheres() -> str:
    """Markdown: the operators on the most even meshes there are, subdivided icosahedra."""
    lines = [
        "**Icospheres**, the most even meshes there are: largest error of the signature over the "
        "nodes for t >= 0.1 and for all t, spread over the nodes (standard deviation, worst "
        "time), mean error of the first 300 eigenvalues:",
        "",
        "| operator | nodes | t >= 0.1 | all t | spread | eigenvalues, mean error |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    ball = shapes()[0]
    exact = sphere_signature(ball.times)
    averaged = Operator("linear, mean of both masses", "-", mean_mass, ("", "", ""))
    linear = next(op for op in OPERATORS if op.name == "linear FEM")
    cases = [(linear, 4), *((op, 5 - (op.mesh != "flat")) for op in (*OPERATORS, averaged))]
    for operator, subdivisions in cases:
        surface = iv.icosphere(subdivisions, order=2 if operator.mesh == "curved" else 1)
        surface = surface.quadratic() if operator.mesh == "from a file" else surface
        pairs = iv.eigenpairs(operator.make(surface), PAIRS).truncate(PAIRS)
        found = iv.heat_kernel_signature(pairs, ball.times)
        error = np.abs(found / exact - 1).max(axis=0)
        spread = (found.std(axis=0) / exact).max()
        values = np.abs(pairs.values[1:] / ball.eigenvalues[1:PAIRS] - 1).mean()
        lines.append(
            f"| {operator.name} | {len(surface.points):,} | "
            f"{error[ball.times >= 0.1].max():.1e} | {error.max():.1e} | {spread:.1e} | "
            f"{values:.1e} |"
        )
        print(lines[-1], flush=True)
    return "\n".join(lines) + "\n"


def run() -> list[Row]:
    """Every operator on every mesh."""
    rows = []
    for shape in shapes():
        for size in SIZES:
            meshes = {kind: shape.mesh(size, kind) for kind in ("flat", "curved", "from a file")}
            for operator in OPERATORS:
                rows.append(measure(shape, operator, size, meshes[operator.mesh]))
                row = rows[-1]
                print(
                    f"{shape.name:20} {row.nodes:6} {operator.name:28} rms {row.rms:.1e}  worst "
                    f"{row.worst:.1e}  {row.build:.2f} + {row.solve:.2f} s",
                    flush=True,
                )
    return rows


def headline(rows: list[Row]) -> str:
    """What the finest meshes show, in one sentence, with the smaller ratio of the two shapes."""

    def ratio(*names: str) -> str:
        finest = [row for row in rows if row.size == SIZES[-1]]
        error = {(row.shape.name, row.operator.name): row.rms for row in finest}
        smallest = min(
            min(error[shape, name] for name in names) / error[shape, OPERATORS[0].name]
            for shape in dict.fromkeys(row.shape.name for row in rows)
        )
        return f"{float(f'{smallest:.2g}'):g}"

    graphs = ratio("uniform graph", "kNN graph, 50, heat", "epsilon graph")
    return (
        f"{SIZES[-1]:,} nodes: curved elements err {ratio('linear FEM')} times less than linear "
        f"ones, {graphs} times less than any graph"
    )


def draw(rows: list[Row], path: Path) -> None:
    """Error against time, a line an operator, a panel a surface."""
    figure = Figure(figsize=(12.8, 6.0), dpi=130, facecolor="white")
    figure.text(
        0.02,
        0.945,
        headline(rows),
        size=15,
        weight="bold",
        color="#1d1d1f",
    )
    figure.text(
        0.02,
        0.9,
        "Error of the heat kernel signature (root mean square over nodes and 100 times) against "
        "the time for matrix and 300 eigenpairs; markers: 1 000, 3 000 and 12 000 nodes",
        size=10,
        color="#555555",
    )
    axes = figure.subplots(1, 2, sharex=True, sharey=True)
    figure.subplots_adjust(left=0.07, right=0.79, top=0.82, bottom=0.11, wspace=0.06)
    for axis, name in zip(axes, dict.fromkeys(row.shape.name for row in rows), strict=True):
        for operator in OPERATORS:
            color, marker, line = operator.style
            own = [r for r in rows if r.shape.name == name and r.operator is operator]
            axis.plot(
                [r.build + r.solve for r in own],
                [r.rms for r in own],
                color=color,
                marker=marker,
                ls=line,
                lw=1.6,
                ms=5.5,
                label=operator.name,
            )
        axis.set_title(name, loc="left", size=11)
        axis.set_xscale("log")
        axis.set_yscale("log")
        axis.grid(True, which="major", color="#e6e6e6", lw=0.6)
        axis.spines[["top", "right"]].set_visible(False)
        axis.set_xlabel("seconds, matrix and eigenpairs")
        axis.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axis.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.xaxis.set_minor_formatter(NullFormatter())
    axes[0].set_ylabel("relative error of the signature")
    worst_first = sorted(axes[1].lines, key=lambda line: -line.get_ydata()[-1])
    axes[1].legend(
        handles=worst_first,
        frameon=False,
        loc="center left",
        bbox_to_anchor=(1.02, 0.5),
        fontsize=9,
    )
    figure.savefig(path)


def table(rows: list[Row]) -> str:
    """Markdown: an operator a row, the sizes beside each other."""
    lines = []
    for name in dict.fromkeys(row.shape.name for row in rows):
        lines += [
            f"**{name[0].upper()}{name[1:]}**, error of the signature (rms) and seconds for "
            "matrix + eigenpairs:",
            "",
            "| operator | " + " | ".join(f"{size:,} nodes" for size in SIZES) + " | worst error, "
            f"{SIZES[-1]:,} | eigenvalues, median error |",
            "| --- |" + " --- |" * (len(SIZES) + 2),
        ]
        for operator in OPERATORS:
            own = [r for r in rows if r.shape.name == name and r.operator is operator]
            cells = [f"{r.rms:.1e}, {r.build:.1f} + {r.solve:.1f} s" for r in own]
            last = own[-1]
            lines.append(
                f"| {operator.name} (`{operator.call}`) | {' | '.join(cells)} | "
                f"{last.worst:.1e} | {last.eigenvalues:.1e} |"
            )
        lines.append("")
    return "\n".join(lines)


def main() -> None:
    """Measure, and rewrite the tables and the figure of docs/operators.md."""
    rows = run()
    draw(rows, DOCS / "operators.png")
    page = DOCS / "operators.md"
    begin, end = "<!-- measured: begin -->", "<!-- measured: end -->"
    text = page.read_text(encoding="utf-8")
    head, tail = text.split(begin)[0], text.split(end)[1]
    said = (
        f"Measured with isovary {iv.__version__} on {date.today()}, Python "
        f"{platform.python_version()}, {platform.machine()}, {os.cpu_count()} cores; "
        "`make bench-operators` measures again.\n\n"
    )
    measured = f"{said}{table(rows)}\n{icospheres()}"
    page.write_text(f"{head}{begin}\n{measured}{end}{tail}", encoding="utf-8")


if __name__ == "__main__":
    main()
