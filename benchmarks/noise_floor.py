"""Does the noise floor bound the error, and how much too wide is it?

Small random cases with a reference that is several times finer in mesh, samples and pairs.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import isovary as iv
from isovary.data import water_pair

Value = Callable[[np.ndarray], np.ndarray]

SHARED = Path("/work/shared/fields")
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
    first, second = (
        exponentials(*shape, softness) for shape in ((centers, radii), (moved, grown))
    )
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


def real_case(family: str, fields: list[iv.ScalarField], seed: int, order: int) -> Case:
    rng = np.random.default_rng(seed)
    halves = [every_other(field) for field in fields]
    return Case(f"{family}, order {order}", *halves, *fields, 0.05, int(rng.integers(250, 501)), order)


def real_cases(seed: int) -> Iterator[Case]:
    """Water, a bond stretched: every other sample is compared, all of them are the reference."""
    yield real_case("water (shipped)", [iv.read_field(path) for path in water_pair()], seed, 2)
    for name, logarithmic in (("density", True), ("esp", False)):
        path = SHARED / f"h2o_bond_{name}.npz"
        if not path.exists():
            continue
        data = np.load(path)
        members = [
            iv.ScalarField(v, data["spacing"], data["origin"], logarithmic=logarithmic)
            for v in data["s"]
        ]
        for first in (seed % 3, seed % 3 + 3):
            pair = members[first : first + 2]
            yield real_case(f"water, {name}", pair, seed + first, 2)


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
    case: Case, result: iv.Comparison, vertices: int = REFERENCE_VERTICES, pairs: int = REFERENCE_PAIRS
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


def nulls(count: int, seed: int) -> Iterator[Null]:
    """Every shape sampled on another grid, shifted, turned by 5 degrees, and with white noise."""
    for number in range(count):
        for family in FAMILIES:
            rng = np.random.default_rng([seed, 3, number])
            value, _, half_width, isovalue = FAMILIES[family](rng)
            shift, turn = 0.1 * rng.standard_normal(3), rotation(rng, 5.0)
            base = sampled(value, half_width, 25)
            noise = rng.choice([0.001, 0.003, 0.01]) * rng.standard_normal(base.values.shape)
            others = {
                "on 25 and 28 samples": sampled(value, half_width, 28),
                "shifted": sampled(lambda p: value(p - shift), half_width, 25),
                "turned by 5 degrees": sampled(lambda p: value(p @ turn), half_width, 25),
                "white noise on one": replace(base, values=base.values + noise),
            }
            for name, other in others.items():
                yield Null(name, base, other, isovalue, int(rng.integers(250, 501)))
