"""Figure 5.3: eight dimples with dented tips, and whether equal ones share their groups."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations, product

import numpy as np
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from ..clustering import k_medians, k_medoids
from ..color import nested_colors
from ..deform import dimple
from ..difference import change_norm
from ..geometry import Bools, Floats, Ints
from ..records import Surface
from ..shapes import icosphere
from ._drawing import COLORS, curve_axes, grid, logarithmic, new_figure
from ._panels import draw_groups, draw_values
from ._records import Experiment, Finding, Outcome, Settings, Verdict
from ._steps import scaled_change, signed
from ._thesis_way import patches, printed_change

_TITLE = "Eight dimples with dented tips, in groups"
_AGREE = 0.99  # by theory all; within an edge of a group's border the mesh decides
_NEAR = 7  # a node and those around it
_EQUAL = 0.05  # of the tips' change: what one looks at as the same curve


@dataclass(frozen=True, eq=False)
class _Way:
    """Change (n, T) of a dimpled sphere, its groups for each count, and how equal the equal is."""

    sphere: Surface
    dimpled: Surface
    times: Floats
    change: Floats
    labels: Mapping[int, Ints]
    tips: Ints
    spread: float
    agreement: Mapping[int, float]


def run(settings: Settings) -> Outcome:
    """The thesis's way (flat, k-medoids, W as printed) and isovary's, on the same triangles."""
    turn = Rotation.from_rotvec(settings["turn"]).as_matrix()
    flat, curved = (_way(settings, order, turn) for order in (1, 2))
    symmetric = _way({**settings, "groups": []}, 2, np.eye(3)).spread
    findings = (
        _one_group(flat, curved, symmetric),
        _only_dimples(curved),
        _band_then_dimples(curved),
    )
    return Outcome(findings, _draw(flat, curved, turn))


def _way(settings: Settings, order: int, turn: Floats) -> _Way:
    corners = np.array(list(product((-1.0, 1.0), repeat=3))) / 3**0.5 @ turn.T
    sphere = icosphere(settings["subdivisions"], order=order)
    tips = cKDTree(sphere.points).query(corners)[1]
    dimpled = dimple(sphere, corners, settings["outer_radius"], alpha=settings["outer_alpha"])
    height = np.linalg.norm(dimpled.points[tips], axis=1).mean()
    inner = settings["inner_radius"], settings["inner_alpha"]
    with warnings.catch_warnings():  # the small run's inner dimples have few nodes: it is coarse
        warnings.filterwarnings("ignore", message=r"radius: expected several edges(.|\n)*")
        dimpled = dimple(dimpled, height * corners, inner[0], alpha=inner[1])
    base = signed(sphere, settings["pairs"], settings["times"])
    perturbed = signed(dimpled, settings["pairs"], base.times)
    change = scaled_change(base, perturbed)
    rows, group = (
        (change, k_medians) if order == 2 else (printed_change(base, perturbed), k_medoids)
    )
    counts = settings["groups"]
    labels = {k: group(rows, k, rng=settings["seed"]).labels for k in counts}
    agreement = {k: _agreement(sphere, labels[k], turn) for k in counts}
    spread = np.abs(change[tips] - change[tips].mean(axis=0)).max() / np.abs(change[tips]).max()
    return _Way(sphere, dimpled, base.times, change, labels, tips, float(spread), agreement)


def _agreement(sphere: Surface, labels: Ints, turn: Floats) -> float:
    """Share of nodes with their own label at or beside their images under the 48 symmetries."""
    tree = cKDTree(sphere.points)
    shares = []
    for order, signs in product(permutations(range(3)), product((-1.0, 1.0), repeat=3)):
        symmetry = turn @ (np.eye(3)[list(order)] * signs) @ turn.T
        images = tree.query(sphere.points @ symmetry.T, _NEAR)[1]
        shares.append(np.mean((labels[images] == labels[:, None]).any(axis=1)))
    return float(np.mean(shares))


def _one_group(flat: _Way, curved: _Way, symmetric: float) -> Finding:
    ways = (flat, curved)
    together = all(len(set(way.labels[k][way.tips])) == 1 for way in ways for k in way.labels)
    worst = [min(way.agreement.values()) for way in ways]
    equal = together and worst[1] > _AGREE and max(flat.spread, curved.spread) < _EQUAL
    return Finding(
        "Dimples of the same geometry are placed in a single cluster, wherever they are",
        "5.2.2, Fig 5.3",
        f"All eight tips share one group with {_listed(curved.labels)} groups, flat and curved. "
        f"Turned by the cube's 48 symmetries, {100 * worst[1]:.1f} % of the nodes or more find "
        f"their own group there or beside it (flat: {100 * worst[0]:.1f} %). The tips' curves "
        f"differ by {100 * flat.spread:.2g} % with flat elements, {100 * curved.spread:.2g} % "
        f"with curved ones on the same triangles, {100 * symmetric:.1g} % where the mesh has the "
        "symmetry.",
        Verdict.CONFIRMED if equal else Verdict.IN_PART if together else Verdict.REFUTED,
        {
            "tips_together": float(together),
            "agreement_flat": worst[0],
            "agreement_curved": worst[1],
            "spread_flat": flat.spread,
            "spread_curved": curved.spread,
            "spread_symmetric": symmetric,
        },
    )


def _listed(counts: Mapping[int, Ints]) -> str:
    *first, last = map(str, counts)
    return f"{', '.join(first)} and {last}"


def _angles(way: _Way) -> Floats:
    """Angle (n,) of each node from the nearest tip, radians."""
    cosines = way.sphere.points @ way.sphere.points[way.tips].T
    angles: Floats = np.arccos(np.clip(cosines, -1, 1)).min(axis=1)
    return angles


def _rings(way: _Way, count: int) -> dict[int, float]:
    """Median angle (degrees) of each group from the nearest tip, from the inside out."""
    angles = np.degrees(_angles(way))
    middles = {k: float(np.median(angles[way.labels[count] == k])) for k in range(count)}
    return dict(sorted(middles.items(), key=lambda item: item[1]))


def _moved(way: _Way) -> Bools:
    """Nodes (n,) that moved: those in the dimples."""
    return np.asarray(np.any(way.dimpled.points != way.sphere.points, axis=1))


def _tips_group(way: _Way) -> Bools:
    """Nodes (n,) of the group of the tips, with two groups."""
    return np.asarray(way.labels[2] == way.labels[2][way.tips[0]])


def _only_dimples(way: _Way) -> Finding:
    moved, tips = _moved(way), _tips_group(way)
    inside, share = float(moved[tips].mean()), float(tips.sum() / moved.sum())
    pieces = patches(way.sphere, tips)
    return Finding(
        "With two clusters the only change is the short-range deformation of the dimples",
        "5.2.2, Fig 5.3(b)",
        f"{100 * inside:.0f} % of the second group's nodes lie in the dimples, in {pieces} "
        f"patches; it holds {100 * share:.0f} % of the nodes that moved, the dented tips.",
        Verdict.CONFIRMED if inside == 1 else Verdict.REFUTED,
        {"inside": inside, "patches": float(pieces), "share": share},
    )


def _band_then_dimples(way: _Way) -> Finding:
    counts = list(way.labels)
    rings = {k: _rings(way, k) for k in counts}
    moved = _moved(way)
    around = [sum(moved[way.labels[k] == g].all() for g in range(k)) for k in counts]
    pieces = patches(way.sphere, _tips_group(way))
    said = "; ".join(
        f"{k}: at {', '.join(f'{angle:.0f}°' for angle in rings[k].values())}" for k in counts
    )
    grows = all(np.diff(around) > 0)
    verdict = Verdict.REFUTED if not grows else Verdict.IN_PART
    return Finding(
        "With more clusters a band is detected as well, and only finally the individual dimples",
        "5.2.2, Fig 5.3(c, d)",
        f"Median angle of the groups from the nearest tip, with {said}. Of them "
        f"{', '.join(map(str, around))} lie wholly in the dimples: each step adds rings around the "
        "tips, as said; but "
        f"the individual tips are {pieces} patches from "
        f"{counts[0]} groups on, not finally.",
        verdict if pieces == len(way.tips) else Verdict.CONFIRMED,
        {"patches": float(pieces)}
        | {f"rings_{k}": float(n) for k, n in zip(counts, around, strict=True)},
    )


def _draw(flat: _Way, curved: _Way, turn: Floats) -> Figure:
    message = (
        f"All eight dented tips fall into one group, with {_listed(curved.labels)} groups; their "
        f"curves differ by {100 * flat.spread:.1g} % with flat elements, by "
        f"{100 * curved.spread:.1g} % with curved ones"
    )
    figure = new_figure("5.3", _TITLE, message, height=7.8)
    cells = grid(figure, 2, 4, below=0.6, left=0.05, right=0.99, wspace=0.12, hspace=0.34)
    towards = turn @ np.array([1.0, 0.22, 0.3])
    norm = 100 * change_norm(curved.change)
    limit = float(np.ceil(norm.max()))
    caption, label = "Eight dimples, tips dented", "mean scaled change (%)"
    draw_values(figure, cells[0], curved.dimpled, norm, limit, caption, label, towards=towards)
    _draw_tips(figure, cells[4], flat, curved)
    _draw_way(figure, cells[1:4], flat, towards, "flat, W as printed, k-medoids")
    _draw_way(figure, cells[5:8], curved, towards, "curved, divided, k-medians")
    return figure


def _draw_way(
    figure: Figure, cells: Sequence[SubplotSpec], way: _Way, towards: Floats, name: str
) -> None:
    """One surface for each number of groups; a group keeps its colour from each to the next."""
    palettes = nested_colors([way.labels[k] for k in way.labels])
    for cell, colors, (count, labels) in zip(cells, palettes, way.labels.items(), strict=True):
        rings = _rings(way, count)
        order = np.array(list(rings))
        key = [f"{angle:.0f}°" for angle in rings.values()]
        caption = f"{count} groups: {name}" if cell is cells[0] else f"{count} groups"
        place = np.argsort(order)[labels]
        draw_groups(
            figure,
            cell,
            way.dimpled,
            place,
            colors[order],
            caption,
            towards=towards,
            key=key,
            title="median angle from the nearest tip",
        )


def _draw_tips(figure: Figure, cell: SubplotSpec, flat: _Way, curved: _Way) -> None:
    """The eight tips' change over time, which are one curve."""
    label = "time (length²)"
    axes = curve_axes(figure, cell, "Change at the eight tips", label, "scaled change (%)")
    for way, name, color in ((flat, "flat", COLORS[1]), (curved, "curved", COLORS[0])):
        lines = axes.plot(way.times, 100 * way.change[way.tips].T, color=color, lw=0.9)
        lines[0].set_label(f"{name}: differ by {100 * way.spread:.1g} %")
    logarithmic(axes, y=False)
    axes.axhline(0, color="#888888", lw=0.8)
    axes.legend(frameon=False, fontsize=8.5)


EXPERIMENT = Experiment("5.3", _TITLE, run)
