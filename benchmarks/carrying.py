"""What is matched with what: how far the maps between two isosurfaces can be trusted.

First copies of one surface, moved or mirrored, where any change is false. Then isometries, where
lengths stay and only the way of matching can make a change. Then maps that are known. Last a
molecule that is twisted by 120 degrees, if its densities are at hand: the folder that holds
h2o2_torsion_density.npz is the first argument, or the environment variable ISOVARY_FIELDS.
"""

from __future__ import annotations

import os
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from carrying_picture import Shown, draw_maps
from measured_page import write_page
from scipy.special import ellipe

import isovary as iv
from isovary.correspondence import isometric_match
from isovary.data import water_pair
from isovary.geometry import Floats, edges_of, linear_triangles
from isovary.level_sets import LevelSet, moved
from isovary.potentials import born_mayer
from isovary.view._camera import Camera

DOCS = Path(__file__).parents[1] / "docs"
TORSION = "h2o2_torsion_density.npz"
DENSITY = 0.05  # electrons per cubic bohr

ATOMS = np.array([(0.0, 0.0, 0.0), (1.7, 0.0, 0.0), (0.85, 1.45, 0.0)])
SIZES = np.array([1.0, 1.3, 0.75])
DECAY_LENGTH = 0.3
BORN_MAYER = float(np.exp(-0.85 / DECAY_LENGTH))
AXIS = np.array([1.0, 2.0, 3.0]) / np.sqrt(14)

SETTLED = 2e-6  # errors below it are the sliding's last step, not the mesh's

Match = Callable[[iv.Surface, Sequence[LevelSet]], tuple[iv.Surface, iv.Correspondence]]


def turned(degrees: float) -> iv.RigidMotion:
    """A turn about the axis (1, 2, 3), by Rodrigues' formula."""
    x, y, z = AXIS
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.radians(degrees)
    turn = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return iv.RigidMotion(turn)


COPIES = {
    "shifted by 0.2": iv.RigidMotion(translation=0.2 * AXIS),
    "turned by 5 degrees": turned(5),
    "turned by 60 degrees": turned(60),
    "mirrored": iv.RigidMotion(np.diag([-1.0, 1.0, 1.0])),
}


def molecule(motion: iv.RigidMotion | None = None, scale: float = 1.0) -> iv.ScalarField:
    """Three unequal atoms, sampled anew on an upright grid of their own wherever they are."""
    motion = motion or iv.RigidMotion()
    atoms = motion.apply(scale * ATOMS)
    bounds, shape = own_grid(atoms, 1.25 * scale, 0.08 * scale)
    decay = 1 / (DECAY_LENGTH * scale)
    return born_mayer(atoms, strength=SIZES, decay=decay, bounds=bounds, shape=shape)


def resampled(
    field: iv.ScalarField, isovalue: float, motion: iv.RigidMotion, scale: float = 1.0
) -> iv.ScalarField:
    """The field's spline moved, and sampled on an upright grid of its own.

    Beyond the old box, in corners of the new one that are far from the surface, the value is
    that of the nearest place in it.
    """
    low, high = field.bounds

    def value(points: Floats) -> Floats:
        back = motion.inverse.apply(points.reshape(-1, 3)) / scale
        density: Floats = field.value(np.clip(back, low, high)).reshape(points.shape[:-1])
        return density

    points = motion.apply(scale * iv.contour(field, isovalue).points)
    step = scale * float(field.spacing.min())
    bounds, shape = own_grid(points, 5 * step, step)
    return iv.ScalarField.from_function(value, bounds, shape, logarithmic=True)


def own_grid(
    points: Floats, margin: float, step: float
) -> tuple[tuple[Floats, Floats], tuple[int, int, int]]:
    """Bounds and shape around points; no two grids have samples at the same places of them."""
    low = points.min(axis=0) - margin
    counts = np.ceil((np.ptp(points, axis=0) + 2 * margin) / step).astype(int) + 1
    own = step * (0.37 + 0.2 * np.sin(1e3 * low))  # a part of a step
    high = low + (counts - 1) * step
    nx, ny, nz = counts.tolist()
    return (low + own, high + own), (nx, ny, nz)


@dataclass(frozen=True)
class Null:
    """A copy of a surface: what two comparisons make of it, NaN and a code where one failed."""

    shape: str
    copy: str
    change: float
    floor: float
    significant: float
    raw: float
    raw_significant: float
    fault: str = ""


def nulls() -> Iterator[Null]:
    """Every copy of both surfaces."""
    density = iv.better_interpolation(iv.read_field(water_pair()[0]), DENSITY)
    for name, motion in COPIES.items():
        yield null("Born-Mayer", name, molecule(), molecule(motion), BORN_MAYER)
    yield null("Born-Mayer", SCALED, molecule(), molecule(scale=1.01), BORN_MAYER)
    there = replace(density, origin=density.origin + 0.2 * AXIS)
    yield null("water", "shifted by 0.2, same samples", density, there, DENSITY)
    for name, motion in COPIES.items():
        yield null("water", name, density, resampled(density, DENSITY, motion), DENSITY)
    there = resampled(density, DENSITY, iv.RigidMotion(), 1.01)
    yield null("water", SCALED, density, there, DENSITY)


SCALED = "scaled by 1.01, then to equal area"


def null(
    shape: str, copy: str, base: iv.ScalarField, there: iv.ScalarField, isovalue: float
) -> Null:
    """One copy, matched by the defaults and by rays from where it is."""
    compare = partial(iv.compare, base, there, isovalue, vertices=300, pairs=100, times=50)
    scaled = copy == SCALED

    def sizes(result: iv.Comparison) -> tuple[float, float, float]:
        change = result.unit_area_change if scaled else result.change
        floor, changed = result.noise_floor, iv.change_norm(change)
        above = changed > 2 * iv.change_norm(floor)
        return rms(change), rms(floor), float(above.mean())

    mine = sizes(compare())
    try:
        raw, _, raw_significant = sizes(compare(align=False, isometric=False))
    except iv.IsovaryError as error:
        return Null(shape, copy, *mine, np.nan, np.nan, error.code)
    return Null(shape, copy, *mine, raw, raw_significant)


def null_table(rows: Sequence[Null]) -> str:
    lines = [
        "**Copies of one surface, each sampled anew** (300 vertices, 100 pairs, rms over nodes "
        "and times):",
        "",
        "| surface, copy | change | noise floor | significant nodes | along normals, not aligned: "
        "change | significant nodes |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for row in rows:
        raw = (
            f"stops, {row.fault} | " if row.fault else f"{row.raw:.1e} | {row.raw_significant:.0%}"
        )
        lines.append(
            f"| {row.shape}, {row.copy} | {row.change:.1e} | {row.floor:.1e} | "
            f"{row.significant:.0%} | {raw} |"
        )
    return "\n".join(lines) + "\n"


def rms(values: Floats) -> float:
    """Root mean square of what is known."""
    return float(np.sqrt(np.nanmean(values**2)))


@dataclass(frozen=True, eq=False)
class Outcome:
    """One way of matching, on one base mesh; ``fault`` is the code if there is none."""

    way: str
    seconds: float
    fault: str = ""
    base: iv.Surface | None = None
    partners: Floats | None = None
    match: iv.Correspondence | None = None
    audit: iv.CorrespondenceAudit | None = None
    distortion: iv.Distortion | None = None
    change: Floats | None = None
    floor: float = np.nan

    @property
    def edge_strain(self) -> float:
        """Relative change of the lengths between neighbouring nodes, rms."""
        if self.base is None or self.partners is None:
            return float("nan")
        i, j = edges_of(linear_triangles(self.base.triangles))[0].T
        before, after = (
            np.linalg.norm(points[i] - points[j], axis=1)
            for points in (self.base.points, self.partners)
        )
        return rms(after / before - 1)

    def line(self, name: str, *, floor: bool) -> str:
        """A row of a table."""
        if self.fault or self.audit is None or self.distortion is None or self.change is None:
            cells = [f"stops, {self.fault}", *[""] * (6 if floor else 5)]
        else:
            found, stretch = self.audit, self.distortion
            cells = [
                f"{found.base_coverage:.1%}, {found.perturbed_coverage:.1%}",
                f"{found.turned.sum()}",
                f"{stretch.strain:.2%}",
                f"{self.edge_strain:.2%}",
                f"{np.nanmax(stretch.stretches):.2f}",
                f"{rms(self.change):.1e}",
                *([f"{self.floor:.1e}"] if floor else []),
            ]
        return f"| {' | '.join([name, *cells, f'{self.seconds:.1f}'])} |"


def header(first: str, *, floor: bool) -> str:
    """Head of a table of outcomes."""
    names = [first, "covers base, perturbed", "folded triangles", "strain", "edge strain"]
    names += ["largest stretch", "change", *(["noise floor"] if floor else []), "seconds"]
    return f"| {' | '.join(names)} |\n" + "| --- " * len(names) + "|"


def outcome(
    way: str, match: Match, bases: Sequence[iv.Surface], path: Sequence[LevelSet], pairs: int
) -> Outcome:
    """The way on the first base mesh; the others, coarser, give the noise floor."""
    start = time.perf_counter()
    try:
        other, found = match(bases[0], path)
        seconds = time.perf_counter() - start
        base_pairs = iv.eigenpairs(iv.fem(bases[0]), pairs)
        times = iv.diffusion_times(base_pairs)
        change = changed(bases[0], other, found, pairs, times)
        floors = [
            iv.noise_floor(
                bases[0], change, coarse, changed(coarse, *match(coarse, path), pairs, times)
            )
            for coarse in bases[1:]
        ]
    except iv.IsovaryError as error:
        return Outcome(way, time.perf_counter() - start, error.code)
    partners = iv.interpolate(found, other, other.points)
    return Outcome(
        way,
        seconds,
        "",
        bases[0],
        partners,
        found,
        iv.audit(bases[0], other, found),
        iv.distortion(bases[0], partners),
        change,
        rms(np.array([rms(floor) for floor in floors])) if floors else np.nan,
    )


def changed(
    base: iv.Surface, other: iv.Surface, match: iv.Correspondence, pairs: int, times: Floats
) -> Floats:
    """Scaled change at the base's nodes."""
    here, there = (iv.eigenpairs(iv.fem(surface), pairs) for surface in (base, other))
    after = iv.interpolate(match, other, iv.heat_kernel_signature(there, times))
    before = iv.heat_kernel_signature(here, times)
    return iv.signature_difference(before, after, iv.heat_trace_scale(here, times))


def rays(isovalue: float) -> Match:
    """Independent meshes, rays along normals."""

    def match(base: iv.Surface, path: Sequence[LevelSet]) -> tuple[iv.Surface, iv.Correspondence]:
        field, motion = path[-1], iv.RigidMotion()
        if isinstance(field, iv.MovedField):
            field, motion = field.field, field.motion
        assert isinstance(field, iv.ScalarField)
        vertices = len(np.unique(base.corners))
        other = motion.surface(iv.marching_cubes(field, isovalue, vertices=vertices))
        return other, iv.normal_rays(base, other)

    return match


def along_normals(isovalue: float) -> Match:
    """From field to field along the normals, each time from where the nodes are."""

    def match(base: iv.Surface, path: Sequence[LevelSet]) -> tuple[iv.Surface, iv.Correspondence]:
        current, found = base, np.ones(len(base.points), dtype=bool)
        for field in path[1:]:
            current, step = iv.carry(current, field, isovalue)
            found &= step.found
        lost = (
            np.where(found, step.triangle, -1),
            np.where(found[:, None], step.barycentric, np.nan),
        )
        return current, iv.Correspondence(*lost, step.distance, step.hits)

    return match


def isometrically(isovalue: float) -> Match:
    """The map that changes lengths least."""
    return lambda base, path: iv.carry_isometrically(base, path, isovalue)


def ways(isovalue: float) -> dict[str, Match]:
    """Every way to match two isosurfaces."""
    return {
        "rays, independent meshes": rays(isovalue),
        "carried along normals": along_normals(isovalue),
        "carried isometrically": isometrically(isovalue),
    }


def tube(bend: float = 0.0) -> iv.ScalarField:
    """Distance, negative, to a segment of length 2 or, bent, to an arc of that length; 0.05 off."""

    def value(points: Floats) -> Floats:
        x, y, z = np.moveaxis(points, -1, 0)
        if bend == 0:
            near = np.stack([np.clip(x, -1, 1), 0 * y, 0 * z], axis=-1)
        else:
            angle = np.clip(np.arctan2(x, 1 / bend - z), -bend, bend)
            near = np.stack([np.sin(angle), 0 * y, 1 - np.cos(angle)], axis=-1) / bend
        return 0.05 - np.linalg.norm(points - near, axis=-1)

    box = ((-1.2, -0.16, -0.16), (1.2, 0.16, 0.3))
    return iv.ScalarField.from_function(value, box, (141, 33, 47))


def tubes(vertices: int = 600) -> list[Outcome]:
    """The straight tube and the one bent to radius 6, by every way in one jump, and by members."""
    bends = [0.0, 1 / 36, 1 / 18, 1 / 12, 1 / 9, 1 / 7, 1 / 6]
    fields = [tube(bend) for bend in bends]
    base = iv.marching_cubes(fields[0], 0.0, vertices=vertices)
    path = aligned(base, fields, 0.0)
    found = [
        outcome(f"{name}, one jump", way, [base], [path[0], path[-1]], 100)
        for name, way in ways(0.0).items()
    ]
    more = list(ways(0.0).items())[1:]
    found += [outcome(f"{name}, 6 steps", way, [base], path, 100) for name, way in more]
    return found


def aligned(base: iv.Surface, fields: Sequence[iv.ScalarField], isovalue: float) -> list[LevelSet]:
    """The fields, each moved rigidly to where its isosurface lies nearest to the base."""
    motions = [
        iv.align(base, iv.contour(field, isovalue), field, isovalue).motion for field in fields[1:]
    ]
    return [fields[0], *(moved(f, motion) for f, motion in zip(fields[1:], motions, strict=True))]


def sheet_meshes(radius: float) -> tuple[iv.Surface, iv.Surface, iv.Surface]:
    """A flat sheet of 2 by 1; one rolled to a radius, on other triangles, aligned; it unrolled."""
    base, flat = iv.sheet(2.0, 1.0, (24, 12)), iv.sheet(2.0, 1.0, (27, 14))
    rolled = iv.sheet(2.0, 1.0, (27, 14), bend=1 / radius)
    return base, iv.align(base, rolled).motion.surface(rolled), flat


def sheets(radius: float) -> list[Outcome]:
    """The flat sheet and the rolled one, by every way of matching meshes without fields."""
    base, rolled, _ = sheet_meshes(radius)
    methods = {
        "rays": iv.normal_rays,
        "closest points": iv.closest_point,
        "isometric_match": isometric_match,
    }

    def matched(
        method: Callable[[iv.Surface, iv.Surface], iv.Correspondence],
    ) -> Match:
        return lambda base, path: (rolled, method(base, rolled))

    return [
        outcome(f"sheet rolled to radius {radius:g}, {name}", matched(method), [base], [], 100)
        for name, method in methods.items()
    ]


def isometry_table(tubed: Sequence[Outcome], rolled: Sequence[Outcome]) -> str:
    lines = [
        "**Isometries** (100 pairs; strain is the rms Green strain, edge strain the rms change of "
        "the lengths between neighbouring nodes, change the rms over nodes and times):",
        "",
        header("surfaces, way", floor=False),
    ]
    for row in [*tubed, *rolled]:
        name = row.way if "sheet" in row.way else f"tube bent to radius 6, {row.way}"
        lines.append(row.line(name, floor=False))
    return "\n".join(lines) + "\n"


def triaxial(scale: float = 1.0, motion: iv.RigidMotion | None = None) -> iv.ScalarField:
    """The ellipsoid with semi-axes 1, 1.3, 1.7 at -1; a quadratic, which the spline reproduces."""
    back = (motion or iv.RigidMotion()).inverse
    return iv.ScalarField.from_function(
        lambda p: -((back.apply(p) / (scale * np.array([1.0, 1.3, 1.7]))) ** 2).sum(axis=-1),
        ((-3.0,) * 3, (3.0,) * 3),
        (9, 9, 9),
    )


def known_maps(sizes: Sequence[int] = (150, 300, 600, 1200)) -> str:
    """Table of the largest error of the map, and the order in the edge length."""
    motion = iv.RigidMotion(turned(14).rotation, [0.2, -0.1, 0.1])
    errors: dict[str, list[float]] = {"scaled by 1.1": [], "turned by 14 degrees, shifted": []}
    for size in sizes:
        base = iv.marching_cubes(triaxial(), -1.0, vertices=size)
        known = (
            (triaxial(1.1), 1.1 * base.points),
            (triaxial(1.0, motion), motion.apply(base.points)),
        )
        for mine, (field, exact) in zip(errors.values(), known, strict=True):
            carried, _ = iv.carry_isometrically(base, [field], -1.0)
            mine.append(float(np.linalg.norm(carried.points - exact, axis=1).max()))
    lines = [
        "**Maps that are known**: largest error of the map of the ellipsoid with semi-axes 1, 1.3 "
        "and 1.7, against vertices; the order is that in the edge length:",
        "",
        "| ellipsoid | " + " | ".join(f"{size:,}" for size in sizes) + " | order |",
        "| --- " * (len(sizes) + 2) + "|",
    ]
    for name, mine in errors.items():
        fitted = -2 * np.polyfit(np.log(sizes), np.log(mine), 1)[0]
        order = f"{fitted:.1f}" if min(mine) > SETTLED else "none"
        lines.append(f"| {name} | " + " | ".join(f"{e:.1e}" for e in mine) + f" | {order} |")
    return "\n".join(lines) + "\n\n" + slip_table()


def bar(twist: float, half: float = 4.0) -> iv.ScalarField:
    """An elliptic bar along z, semi-axes 1 and 0.6, turned by ``twist`` per length."""

    def value(p: Floats) -> Floats:
        c, s = np.cos(twist * p[..., 2]), np.sin(twist * p[..., 2])
        u, v = c * p[..., 0] + s * p[..., 1], c * p[..., 1] - s * p[..., 0]
        level: Floats = 1 - u**2 - (v / 0.6) ** 2
        return level

    box = ((-1.5, -1.5, -half), (1.5, 1.5, half))
    return iv.ScalarField.from_function(value, box, (41, 41, 33))


def slip_table() -> str:
    """A twisted bar's slip against Bredt's -2 A t / P."""
    girth = 4 * ellipe(1 - 0.6**2)
    lines = [
        "A twisted elliptic bar slips around its girth, by Bredt's formula -2 A t / P per length "
        "(area A and girth P of its section, twist t; exact for small t):",
        "",
        "| vertices | twist per length | slip measured | Bredt | strain, isometrically | strain, "
        "along normals |",
        "| --- " * 6 + "|",
    ]
    for vertices in (500, 1500):
        base = iv.marching_cubes(bar(0.0), 0.0, vertices=vertices)
        for twist in (0.02, 0.05, 0.1):
            carried, _ = iv.carry_isometrically(base, [bar(twist)], 0.0)
            along, _ = iv.carry(base, bar(twist), 0.0)
            mine, theirs = (iv.distortion(base, s.points).strain for s in (carried, along))
            bredt = -2 * np.pi * 0.6 * twist / girth
            lines.append(
                f"| {vertices:,} | {twist:g} | {slip(base, carried, twist):.5f} | {bredt:.5f} | "
                f"{mine:.2%} | {theirs:.2%} |"
            )
    return "\n".join(lines) + "\n"


def slip(base: iv.Surface, carried: iv.Surface, twist: float) -> float:
    """Move around the girth per length, beyond the twist, in the bar's middle half."""
    x, y, z = base.points.T
    girth = np.column_stack([-y / 0.6, 0.6 * x, 0 * x])
    girth /= np.linalg.norm(girth, axis=1, keepdims=True)
    swept = np.column_stack([-twist * z * y, twist * z * x, 0 * z])
    moves = ((carried.points - base.points - swept) * girth).sum(axis=1)
    middle = np.abs(z) < 2
    return float(np.polyfit(z[middle], moves[middle], 1)[0])


def torsion_fields(folder: Path | None) -> list[iv.ScalarField]:
    """Densities of hydrogen peroxide from 60 to 180 degrees; none if they are not at hand."""
    path = None if folder is None else folder / TORSION
    if path is None or not path.is_file():
        return []
    with np.load(path) as stored:
        return [
            iv.ScalarField(
                values.astype(float),
                spacing=stored["spacing"],
                origin=stored["origin"],
                logarithmic=True,
            )
            for values in stored["s"]
        ]


def torsions(fields: Sequence[iv.ScalarField]) -> list[Outcome]:
    """From 60 to 180 degrees and, for a start, to 75, by every way, aligned and as they lie."""
    bases = [iv.marching_cubes(fields[0], DENSITY, vertices=size) for size in (500, 300)]
    path, every, steps = aligned(bases[0], fields, DENSITY), ways(DENSITY), len(fields) - 1
    several = [name for name in every if "rays" not in name]
    runs = [(name, f"{name}, 60 to 75", path[:2]) for name in every]
    for said, way in (("", path), (", not aligned", list(fields))):
        runs += [(name, f"{name}, one jump{said}", [way[0], way[-1]]) for name in every]
        runs += [(name, f"{name}, {steps} steps{said}", way) for name in several]
    found = [outcome(way, every[name], bases, there, 200) for name, way, there in runs]
    return [in_place(row, path[-1]) if "not aligned" in row.way else row for row in found]


def in_place(row: Outcome, field: LevelSet) -> Outcome:
    """The image moved to where the aligned ones are, for pictures."""
    if row.partners is None or not isinstance(field, iv.MovedField):
        return row
    return replace(row, partners=field.motion.apply(row.partners))


def torsion_table(rows: Sequence[Outcome]) -> str:
    lines = [
        "**Hydrogen peroxide twisted from a dihedral angle of 60 to 180 degrees** (density "
        f"{DENSITY} e/bohr^3, 500 vertices, 200 pairs; each member aligned with the first; the "
        "noise floor is that of the mesh):",
        "",
        header("way", floor=True),
    ]
    lines += [row.line(row.way, floor=True) for row in rows]
    return "\n".join(lines) + "\n"


def shown(rows: Sequence[Outcome], names: dict[str, str]) -> list[Shown]:
    """What a picture shows of the rows so named, in the words given."""
    by_name = {row.way: row for row in rows}
    found = []
    for name, said in names.items():
        row = by_name[name]
        if row.base is None or row.partners is None or row.distortion is None:
            raise RuntimeError(f"{name}: expected a map to draw, got {row.fault}")
        first, _, second = said.partition("; ")
        strain = row.distortion.strain
        detail = f"{second}: strain {strain:{'.1%' if strain > 0.001 else '.2%'}} (rms)"
        found.append(Shown(row.base, row.partners, row.distortion, first, detail))
    return found


def draw_sheets(rows: Sequence[Outcome], path: Path) -> None:
    """The maps onto the sheet of radius 1, drawn with that sheet unrolled again."""
    flat = sheet_meshes(1.0)[2]
    unrolled = [
        replace(row, partners=iv.interpolate(row.match, flat, flat.points))
        for row in rows
        if row.match is not None
    ]
    names = {
        "sheet rolled to radius 1, rays": "rays; along normals",
        "sheet rolled to radius 1, closest points": "closest points; nearest place",
        "sheet rolled to radius 1, isometric_match": "isometric_match; lengths kept",
    }
    draw_maps(
        shown(unrolled, names),
        "Rolling paper changes no length: only the isometric match finds every point again",
        "sheet of 2 by 1, flat (base) and rolled to radius 1; where each map puts the base on the "
        "rolled sheet, drawn unrolled",
        path,
        limit=0.4,
        height=4.1,
        spots=(60, 0.055),
        split=18,
        camera=Camera(np.eye(3), np.array([-1.0, 0, 0]), np.array([1.0, 1.0, 0.01])),
    )


def draw_torsion(rows: Sequence[Outcome], path: Path) -> None:
    """The maps in one jump, in place and aligned, and the isometric one."""
    names = {
        "rays, independent meshes, one jump, not aligned": "rays along normals; in place",
        "rays, independent meshes, one jump": "rays along normals; aligned first",
        "carried isometrically, one jump": "carried isometrically; aligned first",
    }
    maps = shown(rows, names)
    most = [np.nanmax(one.distortion.stretches) - 1 for one in maps]
    draw_maps(
        maps,
        f"A twisted molecule: rays along normals stretch lengths by up to {most[0]:.0%}, the "
        f"isometric carry by {most[2]:.0%}",
        "hydrogen peroxide, dihedral angle 60 to 180 degrees; isosurface of the electron density "
        "at 0.05 e/bohr³; all perturbed surfaces are one, drawn aligned",
        path,
        limit=0.4,
        height=4.9,
        spots=(110, 0.22),
        split=12,
    )


def main() -> None:
    told = sys.argv[1] if len(sys.argv) > 1 else os.environ.get("ISOVARY_FIELDS")
    tables = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        tables["nulls"] = null_table(list(nulls()))
        print(tables["nulls"], flush=True)
        rolled = [row for radius in (5.0, 2.0, 1.0) for row in sheets(radius)]
        tables["isometries"] = isometry_table(tubes(), rolled)
        print(tables["isometries"], flush=True)
        draw_sheets(rolled, DOCS / "carrying.png")
        tables["maps"] = known_maps()
        print(tables["maps"], flush=True)
        fields = torsion_fields(Path(told) if told else None)
        if fields:
            rows = torsions(fields)
            tables["torsion"] = torsion_table(rows)
            print(tables["torsion"], flush=True)
            draw_torsion(rows, DOCS / "torsion.png")
        else:
            print(f"No {TORSION}: its table and picture stay. Name its folder, or ISOVARY_FIELDS.")
    write_page(DOCS / "carrying.md", "carrying.py", tables)


if __name__ == "__main__":
    main()
