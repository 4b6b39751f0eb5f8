"""Figure 4.4: corresponding points by rays along the normals, and whether they are one to one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec

from ..alignment import align
from ..carrying import carry
from ..color import group_colors
from ..correspondence import CorrespondenceAudit, audit, normal_rays
from ..geometry import Ints, topology
from ..level_sets import moved as moved_by
from ..meshing import marching_cubes
from ..records import Correspondence, Surface
from ._drawing import COLORS, curve_axes, grid, new_figure
from ._panels import draw_groups
from ._records import Experiment, Finding, Outcome, Settings, Verdict
from ._steps import scaled_change, signed
from ._three_atoms import isovalue, potential

_TITLE = "Correspondence by rays along the normals"
_WHOLE = 0.999  # of an area: what one to one must cover, but for the chords of flat triangles
_NOTHING = 1e-3  # of the mean signature: what a rigid motion may change
_TOWARDS = np.array([0.25, 0.35, 1.0])


@dataclass(frozen=True, eq=False)
class _Shot:
    """Rays from the base to a surface after a move, and what they make of it."""

    other: Surface
    match: Correspondence
    audit: CorrespondenceAudit

    @property
    def outward(self) -> float:
        """Part of the nodes whose hit lies on the outer side, all that one direction finds."""
        return float((self.match.distance >= 0).mean())

    @property
    def one_to_one(self) -> bool:
        found = self.audit
        whole = min(found.base_coverage, found.perturbed_coverage) > _WHOLE
        return bool(whole and found.folded == 0)


def run(settings: Settings) -> Outcome:
    """Rays to the surface after smaller and larger moves, and after a rigid shift."""
    level = isovalue(settings)
    base, shots = _base(settings), {}
    for move in settings["moves"]:
        field = potential(settings, move)
        other = marching_cubes(field, level, vertices=settings["vertices"][1], order=1)
        match = normal_rays(base, other)
        shots[move] = _Shot(other, match, audit(base, other, match))
    findings = (
        _one_to_one(shots),
        _meshes(base, shots),
        _combination(shots),
        _intrinsic(*_of_shift(settings)),
    )
    return Outcome(findings, _draw(base, shots))


def _base(settings: Settings) -> Surface:
    still, count = potential(settings, 0.0), settings["vertices"][0]
    return marching_cubes(still, isovalue(settings), vertices=count, order=1)


def _of_shift(settings: Settings) -> tuple[float, float]:
    """Rms scaled change after a rigid shift, carried along the normals: as it is, and aligned."""
    shift = settings["shift"]
    moved = {**settings, "atoms": (np.array(settings["atoms"]) + shift * np.eye(3)[0]).tolist()}
    still, level = potential(settings, 0.0), isovalue(settings)
    mesh = marching_cubes(still, level, vertices=settings["vertices"][0] // 4)
    field = potential(moved, 0.0)
    carried = carry(mesh, field, level)[0]
    back = align(mesh, carried, field, level).motion
    base = signed(mesh, settings["pairs"], settings["times"])
    raw, aligned = (
        scaled_change(base, signed(other, settings["pairs"], base.times))
        for other in (carried, carry(mesh, moved_by(field, back), level)[0])
    )
    return float(np.sqrt((raw**2).mean())), float(np.sqrt((aligned**2).mean()))


def _one_to_one(shots: Mapping[float, _Shot]) -> Finding:
    numbers: dict[str, float] = {}
    for move, shot in shots.items():
        numbers |= {
            f"hit_{move:g}": float(shot.match.found.mean()),
            f"outward_{move:g}": shot.outward,
            f"covered_{move:g}": shot.audit.perturbed_coverage,
            f"folded_{move:g}": shot.audit.folded,
            f"components_{move:g}": float(topology(shot.other.triangles).components),
        }
    good = [move for move, shot in shots.items() if shot.one_to_one]
    said = "; ".join(
        f"{move:g}: {100 * numbers[f'hit_{move:g}']:.3g}, "
        f"{100 * numbers[f'covered_{move:g}']:.3g}, {100 * numbers[f'folded_{move:g}']:.2g} %"
        for move in shots
    )
    torn = [move for move in shots if numbers[f"components_{move:g}"] > 1]
    apart = f" (by {min(torn):g} the atom has come apart, which the thesis leaves out)"
    one_way = max(shot.outward for shot in shots.values())
    verdict = Verdict.CONFIRMED if len(good) == len(shots) else Verdict.IN_PART
    return Finding(
        "Rays along the normals guarantee a one to one correspondence",
        "4.1.4",
        "Nodes with a partner, area of the other surface that has one, and area folded over, "
        f"after a move of {said}. One to one for moves up to {max(good, default=0):g}"
        f"{apart if torn else ''}. Rays outward alone would find {100 * one_way:.0f} % at most.",
        verdict if good else Verdict.REFUTED,
        numbers | {"largest_one_to_one": max(good, default=0.0)},
    )


def _meshes(base: Surface, shots: Mapping[float, _Shot]) -> Finding:
    first = shots[min(shots)]
    counts = len(base.points), len(first.other.points)
    found = float(first.match.found.mean())
    return Finding(
        "Both meshes need not have the same number of points",
        "4.1.4",
        f"With {counts[0]} and {counts[1]} points {100 * found:.0f} % of the rays hit.",
        Verdict.CONFIRMED if found == 1 and counts[0] != counts[1] else Verdict.REFUTED,
        {"base": float(counts[0]), "other": float(counts[1]), "found": found},
    )


def _combination(shots: Mapping[float, _Shot]) -> Finding:
    matches = [shot.match for shot in shots.values()]
    weights = np.concatenate([match.barycentric[match.found] for match in matches])
    error = float(np.abs(weights.sum(axis=1) - 1).max())
    low = float(weights.min())
    return Finding(
        "The signature at the hit is a convex combination of those at the triangle's corners",
        "4.1.4, Fig 4.4",
        f"The barycentric weights are at least {low:.0e} and sum to 1 within {error:.0e}.",
        Verdict.CONFIRMED if low >= 0 and error < 1e-12 else Verdict.REFUTED,
        {"low": low, "error": error},
    )


def _intrinsic(change: float, aligned: float) -> Finding:
    return Finding(
        "The approach captures intrinsic changes; it is indifferent to the correspondence's method",
        "4.1.4",
        f"A rigid shift changes nothing intrinsic, yet along normals it gives a change of "
        f"{100 * change:.2g} % (rms), for the partners lie beside where they should. Isovary takes "
        f"the rigid motion out first, which leaves {100 * aligned:.1g} %.",
        Verdict.CONFIRMED if change < _NOTHING else Verdict.REFUTED,
        {"change": change, "aligned": aligned},
    )


def _draw(base: Surface, shots: Mapping[float, _Shot]) -> Figure:
    last = max(shots)
    good = max((move for move, shot in shots.items() if shot.one_to_one), default=0)
    message = (
        f"One to one for moves up to {good:g}; after {last:g}, "
        f"{100 * (1 - shots[last].match.found.mean()):.1g} % of the nodes have no partner and "
        f"{100 * (1 - shots[last].audit.perturbed_coverage):.1g} % of the other surface is none's"
    )
    figure = new_figure("4.4", _TITLE, message)
    cells = grid(figure, 1, 3, wspace=0.25, below=0.75)
    colors = group_colors(3)
    key = ["outer side", "inner side", "no hit"]
    caption = f"Where the rays hit, atom moved by {last:g}"
    labels = _sides(shots[last].match)
    draw_groups(figure, cells[0], base, labels, colors, caption, towards=_TOWARDS, key=key)
    _draw_section(figure, cells[1], base, shots[last])
    _draw_shares(figure, cells[2], shots)
    return figure


def _sides(match: Correspondence) -> Ints:
    labels: Ints = np.where(match.found, np.where(match.distance >= 0, 0, 1), 2)
    return labels


def _draw_section(figure: Figure, cell: SubplotSpec, base: Surface, shot: _Shot) -> None:
    """Rays near the plane of the atoms."""
    axes = curve_axes(figure, cell, "Rays near the atoms' plane", "x (length)", "y (length)")
    near = np.abs(base.points[:, 2]) < 0.05
    beside = np.abs(shot.other.points[:, 2]) < 0.05
    hit = near & shot.match.found
    ends = base.points + shot.match.distance[:, None] * base.normals
    for start, end in zip(base.points[hit], ends[hit], strict=True):
        axes.plot(*np.array([start, end])[:, :2].T, color="#999999", lw=0.8)
    axes.plot(*base.points[near][:, :2].T, ".", color=COLORS[0], ms=4, label="base")
    axes.plot(*shot.other.points[beside][:, :2].T, ".", color=COLORS[4], ms=4, label="moved")
    axes.set_aspect("equal")
    axes.legend(frameon=False, fontsize=8.5, loc="upper left")


def _draw_shares(figure: Figure, cell: SubplotSpec, shots: Mapping[float, _Shot]) -> None:
    caption = "How far from one to one"
    axes = curve_axes(figure, cell, caption, "atom moved by (length)", "share (%)")
    moves = list(shots)
    for name, shares, color in (
        ("nodes without a hit", [1 - s.match.found.mean() for s in shots.values()], COLORS[1]),
        ("other area not met", [1 - s.audit.perturbed_coverage for s in shots.values()], COLORS[0]),
        ("area folded over", [s.audit.folded for s in shots.values()], COLORS[2]),
    ):
        axes.plot(moves, 100 * np.array(shares), "o-", color=color, label=name)
    axes.legend(frameon=False, fontsize=8.5)


EXPERIMENT = Experiment("4.4", _TITLE, run)
