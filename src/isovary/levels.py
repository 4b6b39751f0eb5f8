"""One comparison on one base mesh, on meshes fine enough, timed by stage."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial

import numpy as np

from .carrying import carry
from .correspondence import identity, interpolate
from .difference import signature_difference
from .errors import CorrespondenceError
from .geometry import Floats, edges_of, topology
from .meshing import contour
from .methods import Methods
from .noise import noise_floor
from .notes import noted_warnings
from .records import Correspondence, Eigenpairs, Surface
from .scalar_field import ScalarField
from .spectrum import drop_cut_multiplet, eigenpairs, first_pairs, with_spare

Progress = Callable[[str, float], None]
"""Called with a stage's name and the part of the expected work done so far, 0 to 1."""

Match = Callable[[Surface, Surface], Correspondence]
"""A method of the correspondence room."""

FIRST_VERTICES = {1: 1000, 2: 500}
"""Vertices of the coarser of the first two meshes, by order."""

WANTED_NOISE = 0.05
"""Part of the change that the noise floor should not exceed."""

_MOST_VERTICES = 2000
_COARSER = 0.8  # vertices of the coarser mesh over the finer's, at most
_COVERAGE_LIMIT = 0.5


@dataclass(frozen=True, eq=False)
class Level:
    """One comparison on one base mesh."""

    base: Surface
    perturbed: Surface
    correspondence: Correspondence
    base_pairs: Eigenpairs
    perturbed_pairs: Eigenpairs
    methods: Methods

    @property
    def vertices(self) -> int:
        """Number of the base's vertices, edge midpoints not counted."""
        return len(np.unique(self.base.corners))

    def samples(self, count: int) -> Floats:
        """What the signature is sampled at: diffusion times, as a rule."""
        return self.methods.kind.samples(self.base_pairs, count)

    def change(self, samples: Floats, *, unit_area: bool = False) -> tuple[Floats, Floats, Floats]:
        """Base signature, perturbed one at the partners, scaled change.

        With ``unit_area`` the perturbed surface is first scaled to the base's area.
        """
        other = self.perturbed_pairs
        other = other.scaled(self.base_pairs.area) if unit_area else other
        before, there = (self.methods.sample(pairs, samples) for pairs in (self.base_pairs, other))
        after = interpolate(self.correspondence, self.perturbed, there)
        scale = self.methods.scale(self.base, self.base_pairs, before, samples)
        return before, after, signature_difference(before, after, scale)

    def noise_floor(self, coarse: Level, samples: Floats) -> Floats:
        """Numerical error (n, T) of the change, from the same on a coarser mesh."""
        change, there = (level.change(samples)[2] for level in (self, coarse))
        order = self.methods.order(self.base)
        return noise_floor(self.base, change, coarse.base, there, order=order)


class Walk:
    """Times the stages and tells the progress, counted in unknowns solved for."""

    def __init__(self, progress: Progress | None) -> None:
        self.timings: dict[str, float] = {}
        self.expected, self.done = 1.0, 0.0
        self._tell = progress or (lambda stage, done: None)

    @contextmanager
    def stage(self, name: str, cost: float = 0.0) -> Iterator[None]:
        """Tell that a stage begins, time its body, and count its cost as done."""
        self._tell(name, min(self.done / self.expected, 1.0))
        start = time.perf_counter()
        yield
        self.timings[name] = self.timings.get(name, 0.0) + time.perf_counter() - start
        self.done += cost

    def finish(self) -> None:
        """Tell that all is done."""
        self._tell("done", 1.0)


def fewest_vertices(order: int, pairs: int) -> int:
    """Vertices whose nodes (one each, or four with order 2) are a quarter more than the pairs."""
    return int(np.ceil(1.25 * pairs / (1 if order == 1 else 4)))


def refined_levels(
    solve: Callable[[int], Level],
    vertices: int | None,
    order: int,
    pairs: int,
    times: int,
    walk: Walk,
) -> tuple[Level, Level, Floats]:
    """A level, the one with half its vertices, and the samples; finer until the noise is small."""
    if vertices is None:
        size = max(FIRST_VERTICES[order], 2 * fewest_vertices(order, pairs))
    else:
        size = max(vertices // 2, fewest_vertices(order, pairs))
    walk.expected = float(3 * size)
    with noted_warnings():  # those of the finer mesh are enough
        coarse = solve(size)
    level = solve(2 * size if vertices is None else vertices)
    if coarse.vertices > _COARSER * level.vertices:  # the surface took more than were asked for
        level = solve(2 * coarse.vertices)
    while True:
        samples = level.samples(times)
        if vertices is not None or 4 * size > _MOST_VERTICES:
            return level, coarse, samples
        floor = level.noise_floor(coarse, samples)
        if relative_rms(floor, level.change(samples)[2]) <= WANTED_NOISE:
            return level, coarse, samples
        size *= 2
        walk.expected += 2 * size
        coarse, level = level, solve(2 * size)


def make_level(
    base: ScalarField,
    perturbed: ScalarField,
    isovalue: float,
    order: int,
    pairs: int,
    match: Match | None,
    methods: Methods,
    walk: Walk,
    vertices: int,
) -> Level:
    """Both surfaces, matched, with their eigenpairs, on a base mesh of so many vertices."""
    mesh = partial(methods.mesher, vertices=vertices, order=order)
    with walk.stage("meshing"):
        surface = mesh(base, isovalue)
        other = None if match is None else mesh(perturbed, isovalue)
    with walk.stage("correspondence"):
        i, j = edges_of(surface.corners)[0].T
        edge = float(np.median(np.linalg.norm(surface.points[i] - surface.points[j], axis=1)))
        _check_topology(surface, other or contour(perturbed, isovalue, resolution=edge))
        if other is None or match is None:
            other, partners = carry(surface, perturbed, isovalue)
        elif np.array_equal(surface.points, other.points):
            partners = identity(surface, other)  # equal fields: no search, no rounding
        else:
            partners = match(surface, other)
    if partners.found.mean() < _COVERAGE_LIMIT:
        raise CorrespondenceError(
            "C02",
            f"coverage: expected at least {_COVERAGE_LIMIT:.0%} of the nodes with a partner, got "
            f"{partners.found.mean():.0%}; the surfaces are too far apart",
        )
    with walk.stage("eigenpairs of the base", vertices / 2):
        operator = methods.laplacian(surface)
        asked = with_spare(pairs, len(operator.unknowns)) if match is None else pairs
        more = eigenpairs(operator, asked)
        first = drop_cut_multiplet(first_pairs(more, pairs))
    with walk.stage("eigenpairs of the perturbed", vertices / 2):
        count = len(first.values)
        same = np.array_equal(surface.points, other.points)
        start = more if match is None else None  # carried: the same nodes
        if same:
            second = first
        else:
            second = eigenpairs(methods.laplacian(other), count, start=start).truncate(count)
    return Level(surface, other, partners, first, second, methods)


def relative_rms(floor: Floats, change: Floats) -> float:
    """Root mean square of a floor over that of a change: 0 without change, NaN without a floor."""
    size = float(np.sqrt(np.nanmean(change**2)))
    if size == 0 or not np.isfinite(floor).any():
        return 0.0 if size == 0 else float("nan")
    return float(np.sqrt(np.nanmean(floor**2))) / size


def _check_topology(base: Surface, perturbed: Surface) -> None:
    first, second = topology(base.triangles), topology(perturbed.triangles)
    if first != second:
        raise CorrespondenceError(
            "C01",
            f"topology: expected the same of both isosurfaces, got base: {first}; perturbed: "
            f"{second}; choose another isovalue, or a smaller step of the parameter",
        )
