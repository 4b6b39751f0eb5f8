"""One comparison on one base mesh, on meshes fine enough, timed by stage."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from .correspondence import closest_point, identity, interpolate
from .difference import signature_difference
from .errors import CorrespondenceError, IsovaryError
from .geometry import (
    Floats,
    Ints,
    edge_length,
    jacobian_ratios,
    node_components,
    topology,
    triangle_quality,
)
from .isometry import distortion
from .matching import ComponentMatch, component_table, describe, match_components, part_of
from .meshing import contour
from .methods import Methods
from .noise import carried, combined_floor, noise_floor, sampling_floor, truncation_floor
from .notes import noted_warnings
from .records import Correspondence, Eigenpairs, Surface
from .spectrum import drop_cut_multiplet, eigenpairs, first_pairs, with_spare
from .task import Task

Progress = Callable[[str, float], None]
"""Called with a stage's name and the part of the expected work done so far, 0 to 1."""

FIRST_VERTICES = {1: 1000, 2: 500}
"""Vertices of the coarser of the first two meshes, by order."""

WANTED_NOISE = 0.05
"""Part of the change that the noise floor should not exceed, if nothing else is asked for."""

_MOST_VERTICES = 2000
_MOST_VERTICES_ASKED = 32_000
_COARSER = 0.8  # vertices of the coarser mesh over the finer's, at most
_COVERAGE_LIMIT = 0.5
_FEWER_PAIRS = 0.8
_ROUNDINGS = 16.0  # that meet in one number
_LEAST_JACOBIAN = 0.1  # of a carried mesh that elements may stand on


@dataclass(frozen=True, eq=False)
class Level:
    """One comparison on one base mesh; the perturbed surface is aligned with it."""

    base: Surface
    perturbed: Surface
    correspondence: Correspondence
    base_pairs: Eigenpairs
    perturbed_pairs: Eigenpairs
    methods: Methods
    components: tuple[ComponentMatch, ...]

    @property
    def strain(self) -> Floats:
        """Largest change of a length at each node (n,), relative to it; NaN without partners."""
        return distortion(self.base, self.partners).at_nodes(self.base.triangles)

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

    @property
    def partners(self) -> Floats:
        """Each base node's corresponding point (n, 3); NaN without one."""
        return interpolate(self.correspondence, self.perturbed, self.perturbed.points)

    def noise_floor(self, coarse: Level, samples: Floats) -> Floats:
        """Numerical error (n, T) of the change, from the same on a coarser mesh."""
        change, there = (level.change(samples)[2] for level in (self, coarse))
        order = self.methods.order(self.base)
        return noise_floor(self.base, change, coarse.base, there, order=order)

    def truncation_floor(self, samples: Floats) -> Floats:
        """Error (n, T) of the change by the pairs left out; 0 but for the heat kernel's."""
        change = self.change(samples)[2]
        if not self.methods.is_heat:
            return np.zeros_like(change)
        count = int(_FEWER_PAIRS * len(self.base_pairs.values))
        fewer = replace(
            self,
            base_pairs=self.base_pairs.truncate(count),
            perturbed_pairs=self.perturbed_pairs.truncate(count),
        )
        last = self.base_pairs.values[[count - 1, -1]]
        return truncation_floor(self.base, change, fewer.change(samples)[2], last, samples)


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


@dataclass(frozen=True, eq=False)
class Refinement:
    """The finest level, coarser ones for its noise floor, and what it took.

    ``history`` has a row for each mesh: its vertices, and the noise of its change relative to
    it, NaN for the first.
    """

    level: Level
    coarse: tuple[Level, ...]
    samples: Floats
    history: tuple[tuple[int, float], ...]

    @property
    def facts(self) -> dict[str, object]:
        """What it took, for the record of choices."""
        return {
            "refinement": [{"vertices": n, "relative_noise": r} for n, r in self.history],
            "noise_floor_vertices": [coarse.vertices for coarse in self.coarse],
        }

    @property
    def strain_floor(self) -> Floats:
        """Numerical error (n,) of the strain, from the coarser meshes."""
        strain = self.level.strain[:, None]
        order = max(self.level.methods.order(self.level.base) - 1, 1)  # of gradients
        floors = [
            noise_floor(self.level.base, strain, level.base, level.strain[:, None], order=order)
            for level in self.coarse
        ]
        return combined_floor(floors)[:, 0]

    @property
    def noise_floor(self) -> Floats:
        """Numerical error (n, T) from the meshes, the root mean square over the coarser ones."""
        return combined_floor(
            [self.level.noise_floor(coarse, self.samples) for coarse in self.coarse]
        )


def refined_levels(
    solve: Callable[[int], Level],
    task: Task,
    times: int,
    walk: Walk,
    *,
    vertices: int | None = None,
    accuracy: float | None = None,
    noise_meshes: int = 1,
) -> Refinement:
    """A level, coarser ones of about half its vertices, and the samples; finer until accurate."""
    fewest = fewest_vertices(task.order, task.pairs)
    if vertices is None:
        size = max(FIRST_VERTICES[task.order], 2 * fewest)
    else:
        size = max(vertices // 2, fewest)
    walk.expected = float((2 + noise_meshes) * size)
    with noted_warnings():  # those of the finer mesh are enough
        coarse = solve(size)
    level = solve(2 * size if vertices is None else vertices)
    if coarse.vertices > _COARSER * level.vertices:  # the surface took more than were asked for
        level = solve(2 * coarse.vertices)
    most = _MOST_VERTICES if accuracy is None else _MOST_VERTICES_ASKED
    history: tuple[tuple[int, float], ...] = ((coarse.vertices, float("nan")),)
    while True:
        found = Refinement(level, (coarse,), level.samples(times), history)
        noise = relative_rms(found.noise_floor, level.change(found.samples)[2])
        history += ((level.vertices, noise),)
        wanted = WANTED_NOISE if accuracy is None else accuracy
        if vertices is not None or 4 * size > most or noise <= wanted:
            break
        size *= 2
        walk.expected += 2 * size
        coarse, level = level, solve(2 * size)
    with noted_warnings():
        spread = 1 + (_COARSER / 0.5 - 1) * np.arange(1, noise_meshes) / noise_meshes
        more = [solve(int(coarse.vertices * factor)) for factor in spread]
    return replace(found, coarse=(coarse, *more), history=history)


def make_level(task: Task, walk: Walk, vertices: int) -> Level:
    """Both surfaces, matched, with their eigenpairs, on a base mesh of so many vertices."""
    methods, match = task.methods, task.match
    mesh = partial(methods.mesher, vertices=vertices, order=task.order)
    with walk.stage("meshing"):
        whole = mesh(task.base, task.isovalue)
        other = None if match is None else task.motion.surface(mesh(task.perturbed, task.isovalue))
    with walk.stage("correspondence"):
        there = other or task.motion.surface(_contour(task, whole))
        components = _checked_components(whole, there, task)
        surface, nodes = _matching(whole, [m.base for m in components if m.same])
        if other is None or match is None:
            other, partners = carried(surface, task.path, task.isovalue, task.isometric)
            if not _fit_for_elements(surface, other):
                other, partners = _remeshed(
                    other, partners, mesh(task.perturbed, task.isovalue), task
                )
        else:
            other, _ = _matching(other, [m.perturbed for m in components if m.same])
            equal = np.array_equal(surface.points, other.points)  # no search, no rounding
            partners = (identity if equal else match)(surface, other)
    if partners.found.mean() < _COVERAGE_LIMIT:
        raise CorrespondenceError(
            "C02",
            f"coverage: expected at least {_COVERAGE_LIMIT:.0%} of the nodes with a partner, got "
            f"{partners.found.mean():.0%}; the surfaces are too far apart",
        )
    with walk.stage("eigenpairs of the base", vertices / 2):
        operator = methods.laplacian(surface)
        asked = with_spare(task.pairs, len(operator.unknowns)) if match is None else task.pairs
        more = eigenpairs(operator, asked)
        first = drop_cut_multiplet(first_pairs(more, task.pairs))
    with walk.stage("eigenpairs of the perturbed", vertices / 2):
        count = len(first.values)
        same = np.array_equal(surface.triangles, other.triangles)  # carried: the same nodes
        start = more if same else None
        if np.array_equal(surface.points, other.points):
            second = first
        else:
            second = eigenpairs(methods.laplacian(other), count, start=start).truncate(count)
    partners, first = _in_whole(whole, nodes, partners, first)
    return Level(whole, other, partners, first, second, methods, components)


def _fit_for_elements(surface: Surface, image: Surface) -> bool:
    """Whether no triangle is folded or ten times worse in shape than it was."""
    if jacobian_ratios(image.points, image.triangles).min() < _LEAST_JACOBIAN:
        return False
    before, after = (triangle_quality(s.points, s.triangles) for s in (surface, image))
    return bool((after > _LEAST_JACOBIAN * before).all())


def _remeshed(
    image: Surface, partners: Correspondence, fresh: Surface, task: Task
) -> tuple[Surface, Correspondence]:
    """A fresh mesh in place of a carried one that cannot serve elements, and the partners on it."""
    warnings.warn(
        "triangles of the base are so distorted on the perturbed surface that no elements stand "
        "on them: it was meshed anew, and its signature is interpolated where the nodes were "
        "carried. Meshing errors no longer cancel; the noise floor holds them. [M16]",
        stacklevel=2,
    )
    fresh = task.motion.surface(fresh)
    same = [m.perturbed for m in match_components(image, fresh) if m.same]
    fresh, _ = _matching(fresh, same)
    there = closest_point(image, fresh)
    known = partners.found
    return fresh, Correspondence(
        np.where(known, there.triangle, -1),
        np.where(known[:, None], there.barycentric, np.nan),
        partners.distance,
        partners.hits,
    )


def _checked_components(
    base: Surface, perturbed: Surface, task: Task
) -> tuple[ComponentMatch, ...]:
    """Which component is which, told in place; an error if some differ and none is left out."""
    matches = match_components(base, perturbed)
    parts = component_table(task.motion.inverse.surface(perturbed))
    matches = tuple(
        replace(m, perturbed_part=parts[m.perturbed]) if m.perturbed >= 0 else m for m in matches
    )
    differ = [match for match in matches if not match.same]
    if not differ or (task.only_matching and len(differ) < len(matches)):
        return matches
    raise CorrespondenceError(
        "C01",
        f"topology: expected the same of both isosurfaces, got base: {topology(base.triangles)}; "
        f"perturbed: {topology(perturbed.triangles)};\n{describe(differ)}\nchoose another isovalue "
        "or a smaller step of the parameter; topology_change finds where it happens, and "
        "only_matching (--only-matching) compares the components that are the same",
    )


def _matching(surface: Surface, kept: Sequence[int]) -> tuple[Surface, Ints]:
    """The components to compare, and their nodes' numbers in the whole."""
    part, nodes = part_of(surface, kept)
    return (surface, nodes) if len(nodes) == len(surface.points) else (part, nodes)


def _in_whole(
    whole: Surface, nodes: Ints, partners: Correspondence, pairs: Eigenpairs
) -> tuple[Correspondence, Eigenpairs]:
    """Rows for all nodes of the whole: no partner, and NaN, where nothing was compared."""
    if len(nodes) == len(whole.points):
        return partners, pairs

    def spread(rows: Floats | Ints, unknown: float) -> Floats:
        spread_out = np.full((len(whole.points), *rows.shape[1:]), unknown)
        spread_out[nodes] = rows
        return spread_out

    there = Correspondence(
        spread(partners.triangle, -1).astype(np.int64),
        spread(partners.barycentric, np.nan),
        spread(partners.distance, np.nan),
        spread(partners.hits, 0).astype(np.int64),
    )
    return there, replace(pairs, vectors=spread(pairs.vectors, np.nan))


def sample_floor(task: Task, solved: Refinement) -> Floats:
    """Noise floor of the samples at the base's nodes; NaN throughout if it cannot be told."""
    level, methods = solved.level, task.methods
    pairs = len(level.base_pairs.values)
    vertices = max(FIRST_VERTICES[2], fewest_vertices(2, pairs))
    try:
        mesh = methods.mesher(task.base, task.isovalue, vertices=vertices)
        mesh = _compared(mesh, level)
        floor = sampling_floor(
            mesh,
            task.base,
            task.perturbed,
            task.isovalue,
            pairs,
            solved.samples,
            motion=task.motion,
            isometric=task.isometric,
            through=task.path[1:-1],
            laplacian=methods.laplacian,
            signature=methods.signature,
        )
    except IsovaryError:
        columns = len(methods.kind.columns(solved.samples))
        return np.full((len(level.base.points), columns), np.nan)
    return interpolate(closest_point(level.base, mesh), mesh, floor)


def rounding_floor(task: Task, level: Level, change: Floats) -> Floats:
    """What rounding of places and samples does to a change: their error over an edge's length."""
    points = level.base.points
    edge = edge_length(points, level.base.triangles)
    place = np.finfo(float).eps * max(
        float(np.abs(field.bounds).max()) for field in (task.base, task.perturbed)
    )
    slope = np.linalg.norm(task.base.level_set(points, task.isovalue)[1], axis=1)
    errors = _ROUNDINGS * (place + task.base.rounding / slope) / edge
    return np.tile(errors[:, None], change.shape[1])


def _compared(mesh: Surface, level: Level) -> Surface:
    """The components of another mesh of the base that the level compares."""
    place = closest_point(mesh, level.base).triangle
    found = level.correspondence.found[level.base.triangles[place]].any(axis=1)
    parts = node_components(mesh.triangles)
    share = np.bincount(parts, found) / np.bincount(parts)
    return _matching(mesh, np.flatnonzero(share > 0.5).tolist())[0]


def relative_rms(floor: Floats, change: Floats) -> float:
    """Root mean square of a floor over that of a change: 0 without change, NaN without a floor."""
    size = float(np.sqrt(np.nanmean(change**2)))
    if size == 0 or not np.isfinite(floor).any():
        return 0.0 if size == 0 else float("nan")
    return float(np.sqrt(np.nanmean(floor**2))) / size


def _contour(task: Task, surface: Surface) -> Surface:
    """The perturbed isosurface as fine as the base's mesh."""
    edge = edge_length(surface.points, surface.triangles)
    return contour(task.perturbed, task.isovalue, resolution=edge)
