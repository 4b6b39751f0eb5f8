"""Figure 2.1: a finger straight, bent and in contact, and a sheet that is rolled."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec

from ..difference import heat_trace_scale
from ..extrinsic import hausdorff_distance
from ..geometry import Floats, Ints, node_areas, topology
from ..meshing import distmesh
from ..potentials import born_mayer
from ..records import Surface
from ..shapes import sheet
from ._drawing import COLORS, curve_axes, grid, logarithmic, new_figure
from ._panels import draw_values
from ._records import Experiment, Finding, Outcome, Settings, Verdict
from ._steps import Signed, scaled_change, signed

_TITLE = "Bending and contact"
_NOTHING = 1e-3  # scaled change: nothing, for the sheet
_LITTLE = 0.05  # scaled change: one twentieth of the mean signature
_AWAY = 0.5  # of the way to the tips: the middle half of the finger


@dataclass(frozen=True, eq=False)
class _Pose:
    """A bent finger with the mean signature in slices along it.

    Parameters
    ----------
    bend : float
        Angle of its middle line, radians.
    signed : Signed
    slices : array (n,)
        Slice of each node, from the middle to the tips.
    profile : array (slices, T)
        Mean over the area of a slice.
    """

    bend: float
    signed: Signed
    slices: Ints
    profile: Floats


def run(settings: Settings) -> Outcome:
    """Change from each pose of the finger to the next, and of a sheet when it is rolled."""
    poses: list[_Pose] = []
    for bend in settings["bends"]:
        poses.append(_pose(bend, poses[0].signed.times if poses else settings["times"], settings))
    scale = heat_trace_scale(poses[0].signed.pairs, poses[0].signed.times)
    changes = steps_of([pose.profile for pose in poses], scale)
    rolled = {order: _rolled(order, settings) for order in (1, 2)}
    distance = _distance(settings)
    findings = (_isometry(rolled, distance), _bent(poses, changes), _contact(poses, changes))
    return Outcome(findings, _draw(poses, changes, rolled, settings))


def steps_of(profiles: Sequence[Floats], scale: Floats) -> list[Floats]:
    """Scaled change (slices, T) from each profile to the one after it."""
    return [(one - two) / scale for one, two in pairwise(profiles)]


def middle_line(length: float, bend: float, count: int) -> Floats:
    """Points (count, 3) in equal steps on an arc through the origin, along x there."""
    along = (np.arange(count) / (count - 1) - 0.5) * length
    angle = along * bend / length
    x = along * np.sinc(angle / np.pi)
    y = -along * angle / 2 * np.sinc(angle / (2 * np.pi)) ** 2
    return np.stack([x, y, np.zeros(count)], axis=1)


def position(points: Floats, length: float, bend: float) -> Floats:
    """Distance (n,) from the middle along that arc, at most half of its length."""
    x, y = points[:, 0], points[:, 1]
    along = x if bend == 0 else np.arctan2(x, y + length / bend) * length / bend
    return np.asarray(np.minimum(np.abs(along), length / 2))


def _finger(bend: float, settings: Settings) -> Surface:
    atoms = middle_line(settings["length"], bend, settings["atoms"])
    low, high = atoms.min(axis=0) - settings["margin"], atoms.max(axis=0) + settings["margin"]
    nx, ny, nz = (round(float(size) / settings["samples"]) + 1 for size in high - low)
    decay = 1 / settings["decay_length"]
    field = born_mayer(atoms, strength=1.0, decay=decay, bounds=(low, high), shape=(nx, ny, nz))
    isovalue = float(np.exp(-decay * settings["thickness"]))
    return distmesh(field, isovalue, vertices=settings["vertices"])


def _pose(bend: float, times: int | Floats, settings: Settings) -> _Pose:
    found = signed(_finger(bend, settings), settings["pairs"], times)
    points, count = found.surface.points, settings["bins"]
    part = position(points, settings["length"], bend) / (settings["length"] / 2)
    slices = np.minimum((part * count).astype(np.int64), count - 1)
    areas = node_areas(points, found.surface.triangles)
    sums = np.zeros((count, len(found.times)))
    np.add.at(sums, slices, areas[:, None] * found.signature)
    return _Pose(bend, found, slices, sums / np.bincount(slices, areas, count)[:, None])


def _sheet(order: int, bend: float, settings: Settings) -> Surface:
    width, height = settings["sheet"]
    cells = [cells * (3 - order) for cells in settings["sheet_cells"]]  # as many nodes
    return sheet(width, height, cells, bend=bend, order=order)


def _rolled(order: int, settings: Settings) -> tuple[Floats, Floats]:
    """Times, and the largest scaled change over the nodes at each (T,)."""
    base = signed(_sheet(order, 0.0, settings), settings["pairs"], settings["times"])
    bent = _sheet(order, settings["sheet_bend"], settings)
    change = scaled_change(base, signed(bent, settings["pairs"], base.times))
    return base.times, np.asarray(np.abs(change).max(axis=0))


def _distance(settings: Settings) -> float:
    """Between the sheets, length."""
    flat, bent = (_sheet(2, bend, settings) for bend in (0.0, settings["sheet_bend"]))
    return hausdorff_distance(flat, bent).largest


def _isometry(rolled: dict[int, tuple[Floats, Floats]], distance: float) -> Finding:
    flat, curved = (float(rolled[order][1].max()) for order in (1, 2))
    return Finding(
        "An intrinsic signature does not see isometries, an extrinsic measure does",
        "2.1.2",
        f"A sheet rolled by four radians of a cylinder is {distance:.2g} away (Hausdorff), and "
        f"its signature changes by {curved:.1g} of its mean at most with curved elements, by "
        f"{flat:.1g} with flat ones at as many nodes.",
        Verdict.CONFIRMED if curved < _NOTHING < distance else Verdict.REFUTED,
        {"curved": curved, "flat": flat, "distance": distance},
    )


def _around(pose: _Pose, scale: Floats) -> float:
    """Largest difference of a node from the mean of its slice, in the middle half."""
    inside = pose.slices < _AWAY * len(pose.profile)
    apart = (pose.signed.signature - pose.profile[pose.slices])[inside] / scale
    return float(np.abs(apart).max())


def _bent(poses: list[_Pose], changes: list[Floats]) -> Finding:
    tips = [float(np.ptp(pose.signed.surface.points, axis=0).max()) for pose in poses]
    means = [float(np.abs(change).mean()) for change in changes]
    bending = sum(means[:-1])
    ratio = means[-1] / bending
    scale = heat_trace_scale(poses[0].signed.pairs, poses[0].signed.times)
    straight, around = (_around(pose, scale) for pose in (poses[0], poses[-2]))
    words = ", ".join(
        f"{100 * mean:.2g} % from {one.bend:g} to {two.bend:g}"
        for mean, (one, two) in zip(means, pairwise(poses), strict=True)
    )
    return Finding(
        "For a bent finger, a deformation near an isometry, intrinsic measures are the right way",
        "2.1.2, Fig 2.1 left and middle",
        f"Mean change of slices of the finger, by its bend in radians: {words}, where "
        f"its tips touch. A round finger stretches outside and shrinks inside when it bends; "
        f"while its size falls from {tips[0]:.2g} to {tips[-2]:.2g}, its signature changes by "
        f"{100 * bending:.2g} % in all, {ratio:.2g} times less than by the touch. "
        f"Within a slice, inside against outside, nodes are up to {100 * around:.2g} % off its "
        f"mean (straight: {100 * straight:.2g} %): a round finger bends near an isometry only on "
        "the average.",
        Verdict.CONFIRMED if max(bending, around) < _LITTLE else Verdict.IN_PART,
        {
            "around": around,
            "around_straight": straight,
            "bending": bending,
            "contact": means[-1],
            "ratio": ratio,
        },
    )


def _contact(poses: list[_Pose], changes: list[Floats]) -> Finding:
    genus = [topology(pose.signed.surface.triangles).genus for pose in poses[-2:]]
    change = np.abs(changes[-1])
    away = change[: max(1, round(_AWAY * len(change)))].max(axis=0)
    times = poses[0].signed.times
    reached = int(np.argmax(away >= _LITTLE))  # 0 if never, or at once
    untouched = float(times[reached if away[reached] >= _LITTLE else -1])
    last = float(change[:, -len(times) // 3 :].mean())
    numbers = {
        "genus_before": float(genus[0]),
        "genus_after": float(genus[1]),
        "tips_small": float(change[-1, 0]),
        "middle_small": float(away[0]),
        "untouched": untouched,
        "large_times": last,
    }
    return Finding(
        "Fingers in contact change the topology, so that no intrinsic measure can be used",
        "2.1.2, Fig 2.1 right",
        f"The genus goes from {genus[0]} to {genus[1]}. At the smallest time the signature changes "
        f"by {100 * change[-1, 0]:.2g} % at the tips and by {100 * away[0]:.1g} % in the middle "
        f"half, and there by {100 * _LITTLE:g} % from time {untouched:.2g} (length²) of "
        f"{times[-1]:.2g} on: before, that half can be compared. In the last third of the times "
        f"the change is {100 * last:.0f} % on the average.",
        Verdict.IN_PART if away[0] < _LITTLE else Verdict.CONFIRMED,
        numbers,
    )


def _draw(
    poses: list[_Pose],
    changes: list[Floats],
    rolled: dict[int, tuple[Floats, Floats]],
    settings: Settings,
) -> Figure:
    means = [float(np.abs(change).mean()) for change in changes]
    message = (
        f"Bending changes a finger's signature by {100 * sum(means[:-1]):.2g} % (a rolled sheet's "
        f"by {100 * rolled[2][1].max():.1g} %), a touch of its tips by {100 * means[-1]:.2g} %, at "
        "small times only where they touch"
    )
    figure = new_figure("2.1", _TITLE, message, height=7.8)
    cells = grid(figure, 2, 3, wspace=0.24, hspace=0.42)
    zero = np.zeros_like(poses[0].profile)
    shown = ((poses[0], zero), (poses[-2], sum(changes[:-1], zero)), (poses[-1], changes[-1]))
    limit = float(np.ceil(100 * max(np.abs(change).mean(axis=1).max() for _, change in shown)))
    words = (
        "straight",
        f"bent by {poses[-2].bend:g}: change since straight",
        f"in contact, {poses[-1].bend:g}: change since {poses[-2].bend:g}",
    )
    for cell, (pose, change), caption in zip(cells, shown, words, strict=False):
        norm = 100 * np.abs(change).mean(axis=1)[pose.slices]
        draw_values(
            figure,
            cell,
            pose.signed.surface,
            norm,
            limit,
            caption,
            "mean change of each slice (%)",
            towards=np.array([0.0, -0.35, 1.0]),
        )
    _draw_along(figure, cells[3], poses, changes, 0, settings)
    _draw_along(figure, cells[4], poses, changes, len(poses[0].signed.times) * 2 // 3, settings)
    _draw_sheet(figure, cells[5], rolled)
    return figure


def _draw_along(
    figure: Figure,
    cell: SubplotSpec,
    poses: list[_Pose],
    changes: list[Floats],
    time: int,
    settings: Settings,
) -> None:
    caption = f"Change at time {poses[0].signed.times[time]:.2g} length²"
    axes = curve_axes(figure, cell, caption, "distance from the middle (length)", "change (%)")
    places = (np.arange(settings["bins"]) + 0.5) / settings["bins"] * settings["length"] / 2
    hues = (*COLORS[:1], *COLORS[2:][: len(changes) - 2], COLORS[1])
    for (one, two), change, hue in zip(pairwise(poses), changes, hues, strict=False):
        contact = ", contact" if two is poses[-1] else ""
        label = f"bent {one.bend:g} to {two.bend:g}{contact}"
        axes.plot(places, 100 * change[:, time], color=hue, lw=1.6, label=label)
    axes.axhline(0, color="0.5", lw=0.8)
    axes.legend(frameon=False, fontsize=8.5)


def _draw_sheet(
    figure: Figure, cell: SubplotSpec, rolled: dict[int, tuple[Floats, Floats]]
) -> None:
    axes = curve_axes(figure, cell, "Sheet, rolled", "time (length²)", "largest change (%)")
    for order, name, hue in ((1, "flat elements", COLORS[1]), (2, "curved elements", COLORS[0])):
        times, worst = rolled[order]
        axes.plot(times, 100 * worst, color=hue, lw=1.6, label=name)
    logarithmic(axes)
    axes.legend(frameon=False, fontsize=8.5)


EXPERIMENT = Experiment("2.1", _TITLE, run)
