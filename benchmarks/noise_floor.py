"""Does the noise floor bound the error, how much too wide is it, and is noise called change?

Fifty small cases: sums of exponentials around two to five atoms, which move or change in size by
1 to 5 %; ellipsoids with a dimple or a bump, which deepens or whose axes change; water, one bond
stretched. 250 to 500 vertices, 100 pairs, 24 to 40 samples an axis. The reference is a curved
mesh of 2 000 vertices with 160 pairs, of fields with twice the samples along each axis (the
densities are compared by every other sample; of the potentials there are no more), at the case's
times and nodes. The nulls are one shape twice: on 25 and 28 samples an axis, shifted, turned, or
with white noise of 0.001, 0.003 or 0.01 on one of the fields.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import isovary as iv
from isovary.data import water_pair

Value = Callable[[np.ndarray], np.ndarray]

PAGE = Path(__file__).parents[1] / "docs" / "noise-floor.md"
BEGIN, END = "<!-- measured: begin -->", "<!-- measured: end -->"
SEED = 2024
FORMULAS = (
    ("atoms", 18, 2),
    ("dimpled ellipsoids", 13, 2),
    ("atoms", 8, 1),
    ("dimpled ellipsoids", 6, 1),
)
NULLS_OF_EACH = 3
PAIRS, REFERENCE_PAIRS, REFERENCE_VERTICES = 100, 160, 2000


@dataclass(frozen=True)
class Case:
    """Two fields to compare, and the same two with finer samples for the reference."""

    family: str
    base: iv.ScalarField
    perturbed: iv.ScalarField
    fine_base: iv.ScalarField
    fine_perturbed: iv.ScalarField
    isovalue: float
    vertices: int
    order: int


def sampled(value: Value, half_width: float, samples: int) -> iv.ScalarField:
    bounds = ((-half_width,) * 3, (half_width,) * 3)
    return iv.ScalarField.from_function(value, bounds, (samples,) * 3)


def exponentials(centers: np.ndarray, radii: np.ndarray, softness: float) -> Value:
    """Born-Mayer like: the sum of exp((radius - distance) / softness) over the atoms; 1 at one."""

    def value(points: np.ndarray) -> np.ndarray:
        total = np.zeros(points.shape[:-1])
        for center, radius in zip(centers, radii, strict=True):
            distance = np.linalg.norm(points - center, axis=-1)
            total += np.exp((radius - distance) / softness)
        return total

    return value


def atoms(rng: np.random.Generator) -> tuple[Value, Value, float, float]:
    """Two to five joined atoms, moved by or changed in size by a few percent."""
    count = int(rng.integers(2, 6))
    radii = rng.uniform(0.7, 1.1, count)
    centers = np.zeros((1, 3))
    while len(centers) < count:
        step = rng.standard_normal(3)
        start = centers[rng.integers(len(centers))]
        there = start + rng.uniform(0.8, 1.1) * step / np.linalg.norm(step)
        if np.linalg.norm(centers - there, axis=1).min() > 0.75:
            centers = np.vstack([centers, there])
    centers = centers - (centers.min(axis=0) + centers.max(axis=0)) / 2
    softness = rng.uniform(0.25, 0.35)
    size = rng.uniform(0.01, 0.05)
    moved = centers + size * rng.standard_normal(centers.shape) * (rng.random() < 0.7)
    grown = radii * (1 + size * rng.standard_normal(count) * (np.array_equal(moved, centers)))
    half_width = float(np.abs(centers).max() + 1.9)
    first, second = (exponentials(*shape, softness) for shape in ((centers, radii), (moved, grown)))
    return first, second, half_width, 1.0


def dimpled(axes: np.ndarray, way: np.ndarray, depth: float, width: float) -> Value:
    """An ellipsoid with a dimple of a depth (or a bump) around a direction."""

    def value(points: np.ndarray) -> np.ndarray:
        local = points / axes
        distance = np.linalg.norm(local, axis=-1)
        cosine = local @ way / np.maximum(distance, 1e-9)
        return 1 - depth * np.exp(-2 * (1 - cosine) / width**2) - distance

    return value


def dimples(rng: np.random.Generator) -> tuple[Value, Value, float, float]:
    """An ellipsoid whose dimple deepens, or whose axes change, by a few percent."""
    axes, way = rng.uniform(0.8, 1.4, 3), rng.standard_normal(3)
    way /= np.linalg.norm(way)
    depth, width = rng.uniform(-0.2, 0.2), rng.uniform(0.5, 0.9)
    size = rng.uniform(0.01, 0.05)
    deeper = rng.random() < 0.5
    first = dimpled(axes, way, depth, width)
    longer = axes * (1 + size * rng.standard_normal(3) * (not deeper))
    second = dimpled(longer, way, depth + size * deeper, width)
    return first, second, float(1.35 * axes.max()) + 0.2, 0.0


FAMILIES = {"atoms": atoms, "dimpled ellipsoids": dimples}


def formula_cases(family: str, count: int, order: int, seed: int) -> Iterator[Case]:
    for number in range(count):
        rng = np.random.default_rng([seed, order, number])
        first, second, half_width, isovalue = FAMILIES[family](rng)
        samples = int(rng.integers(24, 41))
        vertices = int(rng.integers(250, 501))
        few = [sampled(value, half_width, samples) for value in (first, second)]
        many = [sampled(value, half_width, 2 * samples - 1) for value in (first, second)]
        yield Case(f"{family}, order {order}", *few, *many, isovalue, vertices, order)


def every_other(field: iv.ScalarField) -> iv.ScalarField:
    return replace(field, values=field.values[::2, ::2, ::2], spacing=2 * field.spacing)


def real_case(family: str, fields: list[iv.ScalarField], seed: int, halved: bool = True) -> Case:
    vertices = int(np.random.default_rng(seed).integers(250, 501))
    few = [every_other(field) for field in fields] if halved else fields
    return Case(family, *few, *fields, 0.05, vertices, 2)


def real_cases(folder: Path, seed: int) -> Iterator[Case]:
    """Water, a bond stretched: the pair that ships, and members of sweeps where they are found."""
    yield real_case(
        "water, shipped densities", [iv.read_field(path) for path in water_pair()], seed
    )
    for name, logarithmic, halved in (("density", True, True), ("esp", False, False)):
        path = folder / f"h2o_bond_{name}.npz"
        if not path.exists():
            print(f"{path} is not here: left out", file=sys.stderr)
            continue
        data = np.load(path)
        members = [
            iv.ScalarField(v, data["spacing"], data["origin"], logarithmic=logarithmic)
            for v in data["s"]
        ]
        for first in (seed % 3, seed % 3 + 3):
            pair = members[first : first + 2]
            yield real_case(f"water, {name}", pair, seed + first, halved)


def stated(case: Case) -> iv.Comparison:
    return iv.compare(
        case.base,
        case.perturbed,
        case.isovalue,
        vertices=case.vertices,
        order=case.order,
        pairs=PAIRS,
    )


def true_change(
    case: Case,
    result: iv.Comparison,
    vertices: int = REFERENCE_VERTICES,
    pairs: int = REFERENCE_PAIRS,
) -> np.ndarray:
    """The change (n, T) at the result's nodes and times, on a finer mesh of finer fields."""
    logarithmic = result.choices["interpolation"] == "logarithmic"
    base, perturbed = (
        replace(field, logarithmic=logarithmic) for field in (case.fine_base, case.fine_perturbed)
    )
    first = iv.marching_cubes(base, case.isovalue, vertices=vertices)
    path = [base, iv.MovedField(perturbed, result.motion)]
    second, _ = iv.carry_isometrically(first, path, case.isovalue)
    more = iv.eigenpairs(iv.fem(first), pairs)
    before = iv.heat_kernel_signature(more, result.times)
    other = iv.eigenpairs(iv.fem(second), len(more.values), start=more)
    after = iv.heat_kernel_signature(other, result.times)
    scale = iv.heat_trace_scale(more, result.times)
    change = iv.signature_difference(before, after, scale)
    return iv.interpolate(iv.closest_point(result.base, first), first, change)


@dataclass(frozen=True)
class Null:
    """Two fields of one shape."""

    family: str
    base: iv.ScalarField
    perturbed: iv.ScalarField
    isovalue: float
    vertices: int


def rotation(rng: np.random.Generator, degrees: float) -> np.ndarray:
    axis = rng.standard_normal(3)
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.radians(degrees)
    turn: np.ndarray = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return turn


def placed(value: Value, shift: np.ndarray, turn: np.ndarray) -> Value:
    return lambda points: value((points - shift) @ turn)


def nulls_of(family: str, rng: np.random.Generator) -> Iterator[Null]:
    """One shape sampled on another grid, shifted, turned by 5 degrees, and with white noise."""
    value, _, half_width, isovalue = FAMILIES[family](rng)
    shift, turn = 0.1 * rng.standard_normal(3), rotation(rng, 5.0)
    base = sampled(value, half_width, 25)
    noise = rng.choice([0.001, 0.003, 0.01]) * rng.standard_normal(base.values.shape)
    others = {
        "on 25 and 28 samples": sampled(value, half_width, 28),
        "shifted": sampled(placed(value, shift, np.eye(3)), half_width, 25),
        "turned by 5 degrees": sampled(placed(value, np.zeros(3), turn), half_width, 25),
        "with white noise on one": replace(base, values=base.values + noise),
    }
    for name, other in others.items():
        yield Null(name, base, other, isovalue, int(rng.integers(250, 501)))


def nulls(count: int, seed: int) -> Iterator[Null]:
    for number in range(count):
        for family in FAMILIES:
            yield from nulls_of(family, np.random.default_rng([seed, 3, number]))


@dataclass(frozen=True)
class Row:
    """Of one case: floors over errors (n, T), and the error relative to the change (rms)."""

    family: str
    ratios: np.ndarray
    error: float

    @property
    def below(self) -> float:
        return float((self.ratios >= 1).mean())


@dataclass(frozen=True)
class NullRow:
    """Of one null: norm of the change over norm of the floor (n,), and the nodes marked."""

    family: str
    ratios: np.ndarray
    marked: float


def measured(cases: Iterable[Case]) -> Iterator[Row]:
    for case in cases:
        try:
            result = stated(case)
            truth = true_change(case, result)
        except iv.IsovaryError as error:
            print(f"{case.family}: left out, {error}", file=sys.stderr)
            continue
        error = np.abs(result.change - truth)
        size = np.sqrt(np.nanmean(error**2) / np.nanmean(truth**2))
        known = np.isfinite(error)
        yield Row(case.family, result.noise_floor[known] / error[known], float(size))


def measured_nulls(cases: Iterable[Null]) -> Iterator[NullRow]:
    for case in cases:
        result = iv.compare(
            case.base, case.perturbed, case.isovalue, vertices=case.vertices, pairs=PAIRS
        )
        ratios = iv.change_norm(result.change) / iv.change_norm(result.noise_floor)
        yield NullRow(case.family, ratios, float(result.significant.mean()))


def family_line(name: str, rows: list[Row]) -> str:
    ratios = np.concatenate([row.ratios for row in rows])
    medians = [float(np.median(row.ratios)) for row in rows]
    return (
        f"| {name} | {len(rows)} | {np.median([row.error for row in rows]):.2%} | "
        f"{(ratios >= 1).mean():.1%} | {min(row.below for row in rows):.1%} | "
        f"{np.median(ratios):.1f} | {min(medians):.1f} to {max(medians):.1f} |"
    )


def null_line(name: str, rows: list[NullRow]) -> str:
    ratios = np.concatenate([row.ratios for row in rows])
    marked = [row.marked for row in rows]
    return (
        f"| {name} | {len(rows)} | {np.mean(marked):.2%} | {max(marked):.2%} | "
        f"{(ratios > 1).mean():.2%} | {(ratios > 1.5).mean():.2%} | {ratios.max():.2f} |"
    )


def grouped(rows: list, line: Callable[[str, list], str]) -> list[str]:
    """A line for each family and one for all."""
    families = list(dict.fromkeys(row.family for row in rows))
    lines = [line(name, [row for row in rows if row.family == name]) for name in families]
    return [*lines, line("**all**", rows)]


def all_cases(folder: Path, seed: int) -> Iterator[Case]:
    for family, count, order in FORMULAS:
        yield from formula_cases(family, count, order, seed)
    yield from real_cases(folder, seed)


def report(rows: list[Row], empty: list[NullRow], said: str) -> str:
    """Markdown: both tables and the verdict."""
    ratios = np.concatenate([row.ratios for row in rows])
    below, median = (ratios >= 1).mean(), np.median(ratios)
    marked = np.mean([row.marked for row in empty])
    met = below >= 0.95 and median <= 5 and marked < 0.01
    lines = [
        said,
        "",
        "| family | cases | error of the change, median case | errors below the floor | worst case "
        "| floor over error, median | medians of the cases |",
        "| --- | --- | --- | --- | --- | --- | --- |",
        *grouped(rows, family_line),
        "",
        "| null: one shape, | cases | nodes marked significant | worst case | norm above one floor "
        "| above 1.5 | largest norm of the change over the floor's |",
        "| --- | --- | --- | --- | --- | --- | --- |",
        *grouped(empty, null_line),
        "",
        "Wanted: at least 95 % below the floor, a median of at most 5, less than 1 % of the nodes "
        f"of nulls marked. Found: {below:.1%}, {median:.1f} and {marked:.2%}; "
        + ("all three are met." if met else "**not all are met.**"),
    ]
    return "\n".join(lines) + "\n"


def write(found: str) -> None:
    """Put what was found between the markers of the page."""
    text = PAGE.read_text(encoding="utf-8")
    before, after = text.split(BEGIN)[0], text.split(END)[1]
    PAGE.write_text(f"{before}{BEGIN}\n{found}{END}{after}", encoding="utf-8")


def main() -> None:
    """Measure, and write what was found into the page."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path("fields")
    start = time.process_time()
    rows = list(measured(all_cases(folder, SEED)))
    empty = list(measured_nulls(nulls(NULLS_OF_EACH, SEED)))
    seconds = time.process_time() - start
    found = report(rows, empty, f"Random cases of seed {SEED}; {seconds:.0f} s of computing time.")
    write(found)
    print(found)


if __name__ == "__main__":
    main()
