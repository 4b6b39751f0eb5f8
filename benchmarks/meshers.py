"""Which mesher? Every way to mesh an isosurface, and the signature on its meshes.

The unit sphere and the spheroid with semi-axes 1, 1, 2 from sampled fields, and a Born-Mayer
surface that its box cuts. First what the meshes are like. Then what they are for: the error of
the heat kernel signature by finite elements (300 pairs, 100 times, as in operators.py) at equal
numbers of nodes. Raw marching cubes takes no number; its grid is chosen to give it.
"""

from __future__ import annotations

import os
import platform
import time
import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from datetime import date
from functools import partial
from pathlib import Path

import numpy as np
from meshers_picture import draw_errors, draw_meshes
from operators import PAIRS, Shape, shapes

import isovary as iv
from isovary.geometry import Floats, edges_of, node_areas, triangle_quality

DOCS = Path(__file__).parents[1] / "docs"
SIZES = (1000, 3000, 12000)
CUT_SIZES = (1000, 3000)
LEVEL = float(np.exp(-0.5))
POLE = 0.9  # of the half axis: above are the caps, a twelfth of the spheroid's area

Mesher = Callable[..., iv.Surface]
ALONG = partial(iv.nonuniform_sizing, axis=2)


@dataclass(frozen=True)
class Way:
    """A way to mesh: its name, how it is drawn, the mesher, and whether it chooses the grid."""

    name: str
    style: tuple[str, str, str]
    mesher: Mesher
    gridded: bool = False


@dataclass(frozen=True)
class Row:
    """One mesh, and the signature on it; ``fault`` is the code if there is none."""

    shape: str
    way: Way
    order: int
    size: int
    fault: str = ""
    vertices: int = 0
    nodes: int = 0
    quality: float = np.nan
    least: float = np.nan
    off: float = np.nan
    follows: float = np.nan
    meshing: float = np.nan
    solving: float = np.nan
    rms: float = np.nan
    worst: float = np.nan
    poles: float = np.nan
    late: float = np.nan
    spread: float = np.nan

    @property
    def seconds(self) -> float:
        """Mesh, matrix and eigenpairs."""
        return self.meshing + self.solving


def contoured(
    field: iv.ScalarField, isovalue: float, *, vertices: int, order: int, **_: object
) -> iv.Surface:
    """The flat triangles of marching cubes, as the thesis has them."""
    if order != 1:
        raise iv.MeshError("-", "no curved triangles")
    return iv.contour(field, isovalue)


def projected(
    field: iv.ScalarField, isovalue: float, *, vertices: int, order: int, **_: object
) -> iv.Surface:
    """The same triangles with every node on the isosurface."""
    return iv.marching_cubes(field, isovalue, order=order, remeshed=False)


def ways() -> list[Way]:
    """Every mesher and sizing."""
    found = [
        Way("raw marching cubes", ("#999999", "x", "-"), contoured, gridded=True),
        Way("raw, nodes on the surface", ("#555555", "+", "--"), projected, gridded=True),
    ]
    colors = {"marching_cubes": "#0072b2", "distmesh": "#d55e00", "particles": "#009e73"}
    sizings: dict[str, tuple[iv.meshing.Sizing, str, str]] = {
        "uniform": (iv.uniform_sizing, "o", "-"),
        "curvature": (iv.curvature_sizing, "^", "--"),
        "nonuniform": (ALONG, "s", ":"),
    }
    for mesher, color in colors.items():
        for sizing, (function, marker, line) in sizings.items():
            if hasattr(iv, mesher) and (mesher, sizing) != ("particles", "nonuniform"):
                call = partial(getattr(iv, mesher), sizing=function)
                found.append(Way(f"{mesher}, {sizing}", (color, marker, line), call))
    return found


def ball(axis: float, samples: tuple[int, int, int]) -> iv.ScalarField:
    """A Gaussian whose isosurface at LEVEL is the spheroid with semi-axes 1, 1, axis."""
    stretch = np.array([1.0, 1.0, axis])
    return iv.ScalarField.from_function(
        lambda p: np.exp(-0.5 * ((p / stretch) ** 2).sum(axis=-1)),
        (-1.4 * stretch, 1.4 * stretch),
        samples,
        logarithmic=True,
    )


def cubic(axis: float, vertices: int) -> iv.ScalarField:
    """The Gaussian on the grid of cubic cells whose contour comes nearest to so many vertices."""

    def made(n: int) -> iv.ScalarField:
        return ball(axis, (n, n, round(1 + (n - 1) * axis)))

    def count(n: int) -> int:
        return len(iv.contour(made(n), LEVEL).points)

    guess = round(1 + 20 * np.sqrt(vertices / count(21)))
    return made(min((guess - 1, guess, guess + 1), key=lambda n: abs(count(n) - vertices)))


def meshed(way: Way, axis: float, vertices: int, order: int) -> tuple[iv.Surface, float]:
    """About so many vertices on a spheroid, and the seconds."""
    field = cubic(axis, vertices) if way.gridded else ball(axis, (41, 41, 41))
    return timed(way, field, LEVEL, vertices, order)


def timed(
    way: Way, field: iv.ScalarField, isovalue: float, vertices: int, order: int
) -> tuple[iv.Surface, float]:
    """A mesh and the seconds it took; that it takes more vertices (M15) shows in the table."""
    start = clocks()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        mesh = way.mesher(field, isovalue, vertices=vertices, order=order)
    return mesh, since(start)


def clocks() -> tuple[float, float]:
    """The wall's, and that of the processors at work for this program."""
    return time.perf_counter(), time.process_time()


def since(start: tuple[float, float]) -> float:
    """Seconds, by the clock that tells fewer: a busy machine drags out one, threads the other."""
    return min(now - then for now, then in zip(clocks(), start, strict=True))


def measure(shape: Shape, way: Way, order: int, size: int) -> Row:
    """The mesh, and the errors of the signature on it."""
    try:
        mesh, meshing = meshed(way, shape.axis, size if order == 1 else size // 4, order)
    except iv.MeshError as error:
        return Row(shape.name, way, order, size, error.code)
    found, solving = signature(mesh, shape)
    wrong = found / shape.exact(mesh.points[:, 2], shape.times) - 1
    areas = node_areas(mesh.points, mesh.triangles)
    caps = np.abs(mesh.points[:, 2]) > POLE * shape.axis
    quality = triangle_quality(mesh.points, mesh.corners)
    field = ball(shape.axis, (41, 41, 41))
    return Row(
        shape.name,
        way,
        order,
        size,
        vertices=len(np.unique(mesh.corners)),
        nodes=len(mesh.points),
        quality=float(quality.mean()),
        least=float(quality.min()),
        off=distance(mesh, field),
        follows=correlation(mesh, field),
        meshing=meshing,
        solving=solving,
        rms=rms(wrong, areas),
        worst=float(np.abs(wrong).max()),
        poles=rms(wrong[caps], areas[caps]),
        late=rms(wrong[:, len(shape.times) // 2 :], areas),
        spread=float((found.std(axis=0) / found.mean(axis=0)).max()),
    )


def signature(mesh: iv.Surface, shape: Shape) -> tuple[Floats, float]:
    """Heat kernel signature by finite elements, and the seconds for matrix and eigenpairs."""
    start = clocks()
    pairs = iv.eigenpairs(iv.fem(mesh), PAIRS).truncate(PAIRS)
    seconds = since(start)
    return iv.heat_kernel_signature(pairs, shape.times), seconds


def rms(error: Floats, areas: Floats) -> float:
    """Root mean square over nodes by area, and over times."""
    return float(np.sqrt((areas @ error**2).mean() / areas.sum()))


def distance(mesh: iv.Surface, field: iv.ScalarField) -> float:
    """Largest distance of a node to the isosurface, to first order."""
    level, gradient = field.level_set(mesh.points, LEVEL)
    return float((np.abs(level) / np.linalg.norm(gradient, axis=1)).max())


def correlation(mesh: iv.Surface, field: iv.ScalarField) -> float:
    """Of log mean edge length with log curvedness over the vertices: -1 if edges follow it."""
    ends = edges_of(mesh.corners)[0]
    lengths = np.linalg.norm(mesh.points[ends[:, 0]] - mesh.points[ends[:, 1]], axis=1)
    used = np.unique(ends)
    total = np.bincount(ends.ravel(), np.repeat(lengths, 2))[used]
    mean = total / np.bincount(ends.ravel())[used]
    bend = np.sqrt((iv.principal_curvatures(mesh.points[used], field) ** 2).mean(axis=1))
    return float(np.corrcoef(np.log(mean), np.log(bend))[0, 1])


def run() -> list[Row]:
    """Every way, number of nodes and order; on the sphere, of even curvature, uniform sizings."""
    rows = []
    sphere, spheroid = shapes()
    every = ways()
    plain = [way for way in every if way.gridded or way.name.endswith(", uniform")]
    for shape, order, chosen in ((sphere, 1, plain), (spheroid, 1, every), (spheroid, 2, every)):
        for size in SIZES:
            for way in chosen:
                if order == 1 or way.mesher is not contoured:
                    rows.append(measure(shape, way, order, size))
                    report(rows[-1])
    return rows


def report(row: Row) -> None:
    print(
        f"{row.shape:18} order {row.order} {row.way.name:26} {row.nodes:6} nodes, quality "
        f"{row.quality:.2f} {row.least:.3f}  rms {row.rms:.2e} worst {row.worst:.1e}  "
        f"{row.meshing:.1f} + {row.solving:.1f} s {row.fault}",
        flush=True,
    )


def triple(values: Iterable[float], how: str) -> str:
    """A cell with a value for each size."""
    return " / ".join("-" if np.isnan(value) else format(value, how) for value in values)


def mesh_table(rows: list[Row], shape: str) -> str:
    """Markdown: what the meshes are like, a way a row."""
    sizes = " / ".join(f"{size:,}" for size in SIZES)
    closed = shape != "unit sphere"
    last = "edges' correlation with curvature" if closed else "spread of the signature"
    lines = [
        f"**{shape[0].upper()}{shape[1:]}**, flat triangles; for {sizes} vertices asked for:",
        "",
        "| mesher, sizing | vertices | mean quality | smallest quality | off the surface | "
        f"{last} | seconds |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for name, own in by_way(rows, shape, 1).items():
        ends = [row.follows if closed else row.spread for row in own]
        off = "0" if all(r.off < 1e-9 for r in own if not r.fault) else ""
        cells = (
            " / ".join(f"{r.vertices:,}" if not r.fault else f"fails ({r.fault})" for r in own),
            triple((r.quality for r in own), ".2f"),
            triple((r.least for r in own), ".2g"),
            off or triple((r.off for r in own), ".0e"),
            triple(ends, "+.2f" if closed else ".1e"),
            triple((r.meshing for r in own), ".1f"),
        )
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join([*lines, ""])


def by_way(rows: Iterable[Row], shape: str, order: int) -> dict[str, list[Row]]:
    """The rows of a surface and an order, by the name of the way."""
    found: dict[str, list[Row]] = {}
    for row in rows:
        if (row.shape, row.order) == (shape, order):
            found.setdefault(row.way.name, []).append(row)
    return found


DEFAULT = "marching_cubes, uniform"


def ratio(own: list[Row], default: list[Row], over: str) -> float:
    """Error over the default's at equal nodes or seconds; geometric mean over the sizes.

    Near each of its sizes the default's error is a power of the nodes, and its seconds grow as
    they do.
    """
    x, y = (np.log([getattr(row, name) for row in default]) for name in ("nodes", "rms"))
    slope = np.polyfit(x, y, 1)[0]
    logs = [
        np.log(row.rms / base.rms) - slope * np.log(getattr(row, over) / getattr(base, over))
        for row, base in zip(own, default, strict=True)
        if not row.fault
    ]
    return float(np.exp(np.mean(logs)))


def error_table(rows: list[Row], order: int) -> str:
    """Markdown: the signature's error on the spheroid, a way a row."""
    own = by_way(rows, "spheroid 1 : 1 : 2", order)
    words = {1: "Flat triangles, linear elements", 2: "Curved triangles, quadratic elements"}
    lines = [
        f"**{words[order]}**, spheroid: error of the signature (rms) and seconds for mesh + "
        "(matrix and eigenpairs). Then the error over the default's, at equal nodes and at equal "
        f"seconds; and, with {SIZES[-1]:,} nodes, the worst node's error, the rms at the poles, "
        "and the rms of the longer half of the times:",
        "",
        "| mesher, sizing | "
        + " | ".join(f"{size:,} nodes" for size in SIZES)
        + " | per node | per second | worst | poles | long times |",
        "| --- |" + " --- |" * (len(SIZES) + 5),
    ]
    for name, found in own.items():
        cells = [cell(row) for row in found]
        cells += [f"{ratio(found, own[DEFAULT], over):.2f}" for over in ("nodes", "seconds")]
        last = found[-1]
        cells += ["-" if last.fault else f"{v:.1e}" for v in (last.worst, last.poles, last.late)]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join([*lines, ""])


def cell(row: Row) -> str:
    """Error and seconds; the number of nodes where it is another."""
    if row.fault:
        return f"fails ({row.fault})"
    other = abs(row.nodes - row.size) > 0.03 * row.size
    count = f" ({row.nodes:,} nodes)" if other else ""
    return f"{row.rms:.1e}, {row.meshing:.1f} + {row.solving:.1f} s{count}"


def cut_table() -> str:
    """Markdown: a Born-Mayer surface that its box cuts on all sides, in curved triangles."""
    atoms, reach = np.array([(0.0, 0.0, 0.0), (1.7, 0.0, 0.0), (0.85, 1.45, 0.0)]), 0.3

    def potential(p: Floats) -> Floats:
        away = np.linalg.norm(p[..., None, :] - atoms, axis=-1)
        found: Floats = reach * np.log(np.exp(-away / reach).sum(axis=-1))
        return found

    box = (-0.9, -0.6, -0.5), (2.6, 2.05, 0.5)
    field = iv.ScalarField.from_function(potential, box, (71, 54, 21))
    lines = [
        "**Born-Mayer surface cut by its box**, curved triangles; for "
        f"{' / '.join(f'{size:,}' for size in CUT_SIZES)} vertices asked for:",
        "",
        "| mesher, sizing | vertices | mean quality | smallest quality | "
        "rim nodes off the box's faces | seconds |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for way in ways()[1:]:
        cells = zip(*(cut_cells(way, field, size) for size in CUT_SIZES), strict=True)
        lines.append(f"| {way.name} | {' | '.join(' / '.join(cell) for cell in cells)} |")
        print(lines[-1], flush=True)
    return "\n".join([*lines, ""])


def cut_cells(way: Way, field: iv.ScalarField, size: int) -> tuple[str, ...]:
    """Vertices, qualities, distance of the rim to the box, seconds."""
    try:
        mesh, seconds = timed(way, field, -0.85, size, 2)
    except iv.MeshError as error:
        return f"fails ({error.code})", "-", "-", "-", "-"
    quality = triangle_quality(mesh.points, mesh.corners)
    rim = mesh.points[iv.rim_nodes(mesh.triangles)]
    off = np.abs(rim[:, None] - np.array(field.bounds)).min(axis=(1, 2)).max()
    vertices = len(np.unique(mesh.corners))
    return (
        f"{vertices:,}",
        f"{quality.mean():.2f}",
        f"{quality.min():.2g}",
        "0" if off < 1e-12 else f"{off:.0e}",
        f"{seconds:.1f}",
    )


def histograms(size: int = 3000, bins: int = 60) -> str:
    """Markdown: the thesis's histograms, of the exact signature and of the computed one.

    Of the norm of the difference of two nodes' signatures, over all pairs of nodes. Two
    histograms differ by the share of pairs that would have to move to another bin.
    """
    shape = shapes()[1]
    lines = [
        "| sizing | computed, against exact at the same nodes | exact at these nodes, "
        "against exact at evenly spread points |",
        "| --- | --- | --- |",
    ]
    fine = iv.marching_cubes(ball(shape.axis, (41, 41, 41)), LEVEL, vertices=size, order=1)
    even = shape.exact(fine.points[:, 2], shape.times)
    edges = np.linspace(0.0, float(differences(even).max()), bins + 1)

    def shares(values: Floats) -> Floats:
        counts = np.histogram(np.minimum(differences(values), edges[-1]), edges)[0]
        found: Floats = counts / counts.sum()
        return found

    for way in (way for way in ways() if way.name.startswith(("raw m", "distmesh"))):
        mesh = meshed(way, shape.axis, size, 1)[0]
        exact = shares(shape.exact(mesh.points[:, 2], shape.times))
        computed = shares(signature(mesh, shape)[0])
        apart = [0.5 * np.abs(exact - other).sum() for other in (computed, shares(even))]
        lines.append(f"| {way.name} | {apart[0]:.1%} | {apart[1]:.1%} |")
        print(lines[-1], flush=True)
    said = f"**The thesis's histograms** (figures 4.14 to 4.16) with {size:,} vertices, spheroid:"
    return "\n".join([said, "", *lines, ""])


def differences(signatures: Floats) -> Floats:
    """Norms of the differences of all pairs of rows."""
    from scipy.spatial.distance import pdist

    found: Floats = pdist(signatures)
    return found


def write_page(tables: dict[str, list[str]]) -> None:
    """Put the tables between their markers in docs/meshing.md."""
    page = DOCS / "meshing.md"
    text = page.read_text(encoding="utf-8")
    for name, parts in tables.items():
        begin, end = f"<!-- measured {name}: begin -->", f"<!-- measured {name}: end -->"
        head, tail = text.split(begin)[0], text.split(end)[1]
        measured = "\n".join(parts)
        text = f"{head}{begin}\n{measured}{end}{tail}"
    page.write_text(text, encoding="utf-8")


def tables(rows: list[Row], histogram: str, cut: str) -> dict[str, list[str]]:
    """The measured parts of the page."""
    said = (
        f"Measured with isovary {iv.__version__} on {date.today()}, Python "
        f"{platform.python_version()}, {platform.machine()}, {os.cpu_count()} cores; "
        "`make bench-meshers` measures again.\n"
    )
    return {
        "signature": [said, error_table(rows, 1), error_table(rows, 2), histogram],
        "meshes": [*(mesh_table(rows, shape.name) for shape in shapes()), cut],
    }


def main() -> None:
    """Measure, and rewrite the tables and the pictures of docs/meshing.md."""
    draw_meshes(ways(), lambda way: meshed(way, 2.0, 1000, 1)[0], DOCS / "meshes.png")
    rows = run()
    draw_errors([row for row in rows if row.shape != "unit sphere"], DOCS / "meshers.png")
    write_page(tables(rows, histograms(), cut_table()))


if __name__ == "__main__":
    main()
