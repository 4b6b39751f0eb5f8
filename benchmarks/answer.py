"""What does an accurate answer cost?

The unit sphere gets a dimple r = 1 - depth exp(-(angle / 0.3)^2) at its pole.
The surface is one of revolution, so the exact change of the signature comes
from one-dimensional problems, solved to 1e-7, without any mesh. isovary gets
fields of 64^3 samples. Each independent mesh gets a field sampled on the grid
that is contoured, for the second surface one shifted by a fraction of a cell,
as two runs of a simulation would have it; rays along the normals, linear
elements. 289 pairs, whole shells of the sphere (300 would cut the shell
l = 17), and 100 times. Errors are relative to the largest exact change, and
root mean squares: at the tip over the nodes within 0.3 of the pole, at the
worst time; over the surface over all nodes and times. Seconds are those from
the fields to the change.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from numpy.polynomial.legendre import leggauss

import isovary as iv
from isovary.geometry import Floats
from isovary.spectrum._threads import one_blas_thread

PAGE = Path(__file__).parents[1] / "docs" / "answer.md"
WIDTH = 0.3
PAIRS, ASKED, START = 289, 300, 330
WANTED = 0.05, 0.01
VERTICES = (100, 150, 250, 500, 1000, 2000)
SAMPLES = (24, 32, 45, 64, 80, 100)  # 1 000 to 20 000 vertices
SHIFT = np.array([0.37, 0.61, 0.23])  # of a cell
BOX, GRID = 1.6, 64
DEGREE, QUADRATURE, ORDERS, MODES = 80, 300, 20, 20


@dataclass(frozen=True)
class Case:
    """Two depths of the dimple."""

    name: str
    before: float
    after: float


SHALLOW, DEEP = Case("0 to 0.01 deep", 0.0, 0.01), Case("0.10 to 0.11 deep", 0.10, 0.11)


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    way: str
    nodes: int
    tip: float
    surface: float
    seconds: float


@dataclass(frozen=True)
class Need:
    """What a wanted error costs, and how that is known."""

    nodes: float
    seconds: float
    how: str


@dataclass(frozen=True, eq=False)
class Run:
    """A change on one base mesh; NaN rows where there is no partner."""

    points: Floats
    change: Floats
    seconds: float


# The exact change ---------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Modes:
    """Eigenfunctions u(angle) exp(i order phi) of a dimpled sphere, ascending; i and -i counted."""

    values: Floats
    orders: list[int]
    coefficients: list[Floats]

    def signature(self, angles: Floats, times: Floats) -> Floats:
        """Heat kernel signature, (angles, times)."""
        squares = np.empty((len(angles), len(self.values)))
        basis = [legendre(np.cos(angles), order) for order in range(max(self.orders) + 1)]
        for column, (order, mode) in enumerate(zip(self.orders, self.coefficients, strict=True)):
            squares[:, column] = (basis[order] @ mode) ** 2 / (2 * np.pi)
        signature: Floats = squares @ np.exp(-np.outer(self.values, times))
        return signature


def legendre(x: Floats, order: int) -> Floats:
    """Associated Legendre functions of degrees order..DEGREE, each of norm 1 on [-1, 1]."""
    sine = np.sqrt(np.maximum(1 - x**2, 0.0))
    first = np.full_like(x, np.sqrt(0.5))
    for m in range(1, order + 1):
        first = first * sine * np.sqrt((2 * m + 1) / (2 * m))
    columns = [first, x * np.sqrt(2 * order + 3) * first]
    for degree in range(order + 2, DEGREE + 1):
        grow = np.sqrt((4 * degree**2 - 1) / (degree**2 - order**2))
        shrink = np.sqrt(((degree - 1) ** 2 - order**2) / (4 * (degree - 1) ** 2 - 1))
        columns.append(grow * (x * columns[-1] - shrink * columns[-2]))
    return np.stack(columns, axis=1)


def slopes(x: Floats, order: int, basis: Floats) -> Floats:
    """Derivatives of the functions by the angle, but for their sign."""
    degree = np.arange(order, DEGREE + 1)
    before = np.pad(basis[:, :-1], ((0, 0), (1, 0)))
    factor = np.sqrt((degree**2 - order**2) * (2 * degree + 1) / np.maximum(2 * degree - 1, 1))
    return (degree * x[:, None] * basis - factor * before) / np.sqrt(1 - x**2)[:, None]


def radius(angle: Floats, depth: float) -> Floats:
    away: Floats = 1 - depth * np.exp(-((angle / WIDTH) ** 2))
    return away


def radius_slope(angle: Floats, depth: float) -> Floats:
    return 2 * angle / WIDTH**2 * (1 - radius(angle, depth))


def exact_modes(depth: float) -> Modes:
    """The first PAIRS eigenfunctions, by separation of variables and Gauss quadrature.

    With the meridian's length ds = metric d angle and the distance ``off`` from the axis,
    the integral of (u_s^2 + (order u / off)^2) off ds is made stationary in a space of
    associated Legendre functions.
    """
    from scipy.linalg import eigh

    x, weight = leggauss(QUADRATURE)
    angle = np.arccos(x)
    weight = weight / np.sin(angle)
    away = radius(angle, depth)
    metric, off = np.hypot(away, radius_slope(angle, depth)), away * np.sin(angle)
    found: list[tuple[float, int, Floats]] = []
    for order in range(ORDERS):
        basis = legendre(x, order)
        slope = slopes(x, order, basis)
        stiffness = (slope.T * (weight * off / metric)) @ slope
        stiffness += (basis.T * (weight * metric * order**2 / off)) @ basis
        mass = (basis.T * (weight * metric * off)) @ basis
        values, modes = eigh(stiffness, mass, subset_by_index=(0, MODES - 1))
        copies = 1 if order == 0 else 2
        found += [(float(values[i]), order, modes[:, i]) for i in range(MODES)] * copies
    found.sort(key=lambda mode: mode[0])
    values, orders, coefficients = zip(*found[:PAIRS], strict=True)
    return Modes(np.array(values), list(orders), list(coefficients))


def partners(angle: Floats, case: Case) -> Floats:
    """Angles at which the normals of the first surface meet the second one."""
    away, slope = radius(angle, case.before), radius_slope(angle, case.before)
    radial = np.stack([np.sin(angle), np.cos(angle)])
    along = np.stack([np.cos(angle), -np.sin(angle)])
    normal = (away * radial - slope * along) / np.hypot(away, slope)
    step = np.zeros_like(angle)
    for _ in range(50):
        place = away * radial + step * normal
        there: Floats = np.arctan2(place[0], place[1])
        step += radius(there, case.after) - np.linalg.norm(place, axis=0)
    return there


@dataclass(frozen=True, eq=False)
class Exact:
    """The exact change of a case as a function of the angle."""

    case: Case
    before: Modes
    after: Modes
    times: Floats
    largest: float

    def change(self, angle: Floats) -> Floats:
        return exact_change(self.case, self.before, self.after, self.times, angle)


def exact_change(case: Case, before: Modes, after: Modes, times: Floats, angle: Floats) -> Floats:
    """Scaled change at the angles, (angles, times)."""
    first = before.signature(angle, times)
    second = after.signature(partners(angle, case), times)
    scale = np.exp(-np.outer(before.values, times)).sum(axis=0) / area(case.before)
    return iv.signature_difference(first, second, scale)


def area(depth: float) -> float:
    x, weight = leggauss(QUADRATURE)
    angle = np.arccos(x)
    away = radius(angle, depth)
    return float(2 * np.pi * (weight * away * np.hypot(away, radius_slope(angle, depth))).sum())


def exact(case: Case) -> Exact:
    before, after = exact_modes(case.before), exact_modes(case.after)
    reach = 4 * np.log(10)
    times = np.geomspace(reach / before.values[-1], reach / before.values[1], 100)
    angles = np.linspace(0, np.pi, 400)
    largest = float(np.abs(exact_change(case, before, after, times, angles)).max())
    return Exact(case, before, after, times, largest)


# The two ways -------------------------------------------------------------------------


def dimpled(depth: float, samples: int = GRID, shift: Floats | float = 0.0) -> iv.ScalarField:
    """The distance to the surface along the radius, positive inside, on a grid moved by cells."""

    def value(points: Floats) -> Floats:
        angle = np.arctan2(np.hypot(points[..., 0], points[..., 1]), points[..., 2])
        return radius(angle, depth) - np.linalg.norm(points, axis=-1)

    moved = shift * np.full(3, 2 * BOX / (samples - 1))
    return iv.ScalarField.from_function(value, (moved - BOX, moved + BOX), (samples,) * 3)


def carried(case: Case, vertices: int, times: Floats) -> Run:
    """isovary's way: one curved mesh, carried; the base's pairs start the other's."""
    first, second = dimpled(case.before), dimpled(case.after)
    begin = time.perf_counter()
    base = iv.marching_cubes(first, 0.0, vertices=vertices, order=2)
    other, _ = iv.carry(base, second, 0.0)
    start = iv.eigenpairs(iv.fem(base), START)
    pairs = iv.eigenpairs(iv.fem(other), ASKED, start=start)
    change = scaled_change(start.truncate(PAIRS), pairs.truncate(PAIRS), times)
    return Run(base.points, change, time.perf_counter() - begin)


def scaled_change(base: iv.Eigenpairs, perturbed: iv.Eigenpairs, times: Floats) -> Floats:
    before, after = (iv.heat_kernel_signature(pairs, times) for pairs in (base, perturbed))
    return iv.signature_difference(before, after, iv.heat_trace_scale(base, times))


def independent(case: Case, samples: int, times: Floats) -> Run:
    """The thesis's way: two raw marching-cubes meshes, flat linear elements, rays."""
    first, second = dimpled(case.before, samples), dimpled(case.after, samples, SHIFT)
    begin = time.perf_counter()
    base, other = iv.contour(first, 0.0), iv.contour(second, 0.0)
    match = iv.normal_rays(base, other)
    pairs, others = (linear_pairs(surface) for surface in (base, other))
    after = iv.interpolate(match, other, iv.heat_kernel_signature(others, times))
    before = iv.heat_kernel_signature(pairs, times)
    change = iv.signature_difference(before, after, iv.heat_trace_scale(pairs, times))
    return Run(base.points, change, time.perf_counter() - begin)


def linear_pairs(surface: iv.Surface) -> iv.Eigenpairs:
    """The first pairs by LaPy, or by isovary where LaPy is not installed."""
    if find_spec("lapy") is None:
        return iv.eigenpairs(iv.fem(surface), ASKED).truncate(PAIRS)
    import lapy

    solver = lapy.Solver(lapy.TriaMesh(surface.points, surface.triangles))
    with one_blas_thread():
        values, vectors = solver.eigs(ASKED, rng=0)
    values, vectors = np.maximum(values[:PAIRS], 0.0), vectors[:, :PAIRS]
    values[0] = 0.0
    return iv.Eigenpairs(values, vectors, np.zeros(PAIRS), surface.area, "LaPy")


def measured(way: str, run: Run, truth: Exact) -> Row:
    """Errors relative to the largest exact change."""
    known = np.isfinite(run.change).all(axis=1)
    points, change = run.points[known], run.change[known]
    angle = np.arctan2(np.hypot(points[:, 0], points[:, 1]), points[:, 2])
    error = np.abs(change - truth.change(angle)) / truth.largest
    tip = float(np.sqrt((error[angle < WIDTH] ** 2).mean(axis=0)).max())
    surface = float(np.sqrt((error**2).mean()))
    return Row(way, len(run.points), tip, surface, run.seconds)


# The tables ---------------------------------------------------------------------------

CARRIED, INDEPENDENT = "isovary: carried, curved quadratic", "independent, raw, flat linear"


def measure(case: Case, vertices: Sequence[int], samples: Sequence[int]) -> list[Row]:
    """isovary's way with so many vertices, the thesis's with so many samples along the box."""
    truth = exact(case)
    rows = [measured(CARRIED, carried(case, n, truth.times), truth) for n in vertices]
    return rows + [measured(INDEPENDENT, independent(case, n, truth.times), truth) for n in samples]


def fit(sizes: list[float], results: list[float]) -> tuple[float, float]:
    """Exponent and factor of results = factor sizes^exponent, least squares of the logarithms."""
    exponent, constant = np.polyfit(np.log(sizes), np.log(results), 1)
    return float(exponent), float(np.exp(constant))


def need(rows: list[Row], measure_of: str, wanted: float) -> Need:
    """Nodes and seconds for an error: between two rows, of the first row, or extrapolated."""
    errors = [getattr(row, measure_of) for row in rows]
    nodes, seconds = [float(row.nodes) for row in rows], [row.seconds for row in rows]
    if errors[0] <= wanted:
        return Need(nodes[0], seconds[0], "at most; the coarsest mesh is good enough")
    for i in range(1, len(rows)):
        if errors[i] <= wanted:
            part = np.log(errors[i - 1] / wanted) / np.log(errors[i - 1] / errors[i])
            return Need(
                nodes[i - 1] * (nodes[i] / nodes[i - 1]) ** part,
                seconds[i - 1] * (seconds[i] / seconds[i - 1]) ** part,
                "interpolated",
            )
    order, factor = fit(nodes, errors)
    slope, cost = fit(nodes, seconds)
    enough = (wanted / factor) ** (1 / order)
    how = f"extrapolated: error ~ nodes^{order:.2f}, seconds ~ nodes^{slope:.2f}"
    return Need(enough, cost * enough**slope, how)


def needs(rows: list[Row]) -> list[str]:
    """Lines of the table of costs, a way each, and the two ratios."""
    lines = []
    for measure_of, words in (("tip", "at the tip"), ("surface", "over the surface")):
        for wanted in WANTED:
            both = [
                need([row for row in rows if row.way == way], measure_of, wanted)
                for way in (CARRIED, INDEPENDENT)
            ]
            for way, cost in zip((CARRIED, INDEPENDENT), both, strict=True):
                lines.append(
                    f"| {wanted:.0%} {words} | {way} | {cost.nodes:,.0f} | {cost.seconds:,.1f} | "
                    f"{cost.how} |"
                )
            ours, theirs = both
            lines.append(
                f"| | ratio | {theirs.nodes / ours.nodes:,.0f} | "
                f"{theirs.seconds / ours.seconds:,.0f} | |"
            )
    return lines


def table(rows: list[Row]) -> list[str]:
    return [
        "| way | nodes | error at the tip | over the surface | seconds |",
        "| --- | --- | --- | --- | --- |",
        *(
            f"| {row.way} | {row.nodes:,} | {row.tip:.2%} | {row.surface:.2%} | {row.seconds:.1f} |"
            for row in rows
        ),
        "",
    ]


def report(vertices: Sequence[int] = VERTICES, samples: Sequence[int] = SAMPLES) -> str:
    """Markdown: the errors of both ways, what a wanted error costs, and a second case."""
    rows = measure(SHALLOW, vertices, samples)
    deep = measure(DEEP, vertices, ())
    peer = "isovary's, as LaPy is not installed" if find_spec("lapy") is None else "LaPy's"
    lines = [
        "# What an accurate answer costs",
        "",
        (__doc__ or "").split("\n\n", 1)[1].replace("\n", " ").strip()
        + f" The linear elements of the independent meshes are {peer}.",
        "",
        f"A dimple {SHALLOW.name}:",
        "",
        *table(rows),
        "What an error costs. What is not between two lines of the table above is extrapolated "
        "along the straight line through all of them in logarithmic scales.",
        "",
        "| error | way | nodes | seconds | |",
        "| --- | --- | --- | --- | --- |",
        *needs(rows),
        "",
        f"A dimple {DEEP.name}, isovary's way:",
        "",
        *table(deep),
    ]
    return "\n".join(lines).rstrip() + "\n"


def main() -> None:
    PAGE.write_text(report(), encoding="utf-8")
    print(f"wrote {PAGE}")


if __name__ == "__main__":
    main()
