"""Figure 4.3: how many eigenpairs a signature needs, by curved elements and by a graph."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from ..deform import dimple
from ..geometry import Floats
from ..laplacian import fem, knn_graph
from ..records import Eigenpairs
from ..shapes import icosphere
from ..signature import diffusion_times, heat_kernel_signature
from ..spectrum import eigenpairs
from ._drawing import COLORS, curve_axes, grid, logarithmic, new_figure
from ._records import Experiment, Finding, Outcome, Settings, Verdict

_TITLE = "Eigenpairs that a signature needs"
_ENOUGH = 0.01  # relative: about the width of a drawn line
_FEW = 0.1  # relative: a change that is significant
_FASTER = 2.0  # times the error, from which one converges as quickly no more
_LOCAL, _WHOLE = 10.0, 2.0  # times 1 / area: heat is still near, has seen nearly everything
_BOTH = 0.1  # of the times: less do not tell a range


def run(settings: Settings) -> Outcome:
    """Signatures at the dimple's tip and opposite it, from few to many pairs."""
    sphere = icosphere(settings["subdivisions"])
    tip = np.array([0.0, 0.0, 1.0])
    surface = dimple(sphere, tip, settings["dimple_radius"], alpha=settings["dimple_alpha"])
    nodes = [int(np.linalg.norm(sphere.points - place, axis=1).argmin()) for place in (tip, -tip)]
    counts, chosen, samples = settings["pairs"], settings["chosen"], settings["times"]
    pairs, on_graph = (eigenpairs(of(surface), max(counts)) for of in (fem, knn_graph))
    times, curves = _curves(pairs, pairs, nodes, counts, samples)
    graph = _curves(on_graph, on_graph, nodes, counts, samples)[1]
    errors, graph_errors = _errors(curves[:, 0]), _errors(graph[:, 0])
    own = _curves(pairs, pairs.truncate(chosen), nodes, [chosen, max(counts)], samples)[1]
    findings = (
        _enough(counts, errors, chosen, float(_errors(own[:, 0])[0])),
        _faster(counts, errors, graph_errors),
        _logarithmic(times, curves[-1, 1] * pairs.area),
    )
    return Outcome(findings, _draw(times, curves, graph, counts, errors, graph_errors))


def _curves(
    pairs: Eigenpairs,
    timed: Eigenpairs,
    nodes: Sequence[int],
    counts: Sequence[int],
    samples: int,
) -> tuple[Floats, Floats]:
    """Times of some pairs, and signatures (counts, nodes, times) there from the first of all."""
    times = diffusion_times(timed, samples)
    some = [heat_kernel_signature(pairs.truncate(count), times)[nodes] for count in counts]
    return times, np.array(some)


def _errors(curves: Floats) -> Floats:
    """Largest relative difference from the last curve, of each (counts,)."""
    worst: Floats = np.abs(curves / curves[-1] - 1).max(axis=1)
    return worst


def _enough(counts: Sequence[int], errors: Floats, chosen: int, own: float) -> Finding:
    """The last curve is the measure of the others, and none of them."""
    fewer = list(zip(counts[:-1], errors[:-1], strict=True))
    words = ", ".join(f"{100 * error:.2g} % with {count}" for count, error in fewer)
    few = Verdict.IN_PART if errors[0] > _FEW else Verdict.CONFIRMED
    return Finding(
        "More eigenpairs do not change the curve significantly; 300 are enough",
        "4.1.3, Fig 4.3",
        f"At the tip, against {counts[-1]} pairs and at the worst of their times: {words}: with "
        f"few pairs the small times are wrong. At the times that {chosen} pairs give, which begin "
        f"later, {chosen} are {100 * own:.1g} % off.",
        few if own < _ENOUGH else Verdict.REFUTED,
        {f"error_{count}": float(error) for count, error in fewer} | {"own": own},
    )


def _faster(counts: Sequence[int], errors: Floats, graph: Floats) -> Finding:
    middle = len(counts) // 2
    ratio = float(graph[middle] / errors[middle])
    return Finding(
        "Signatures of the graph Laplacian do not converge as quickly as those of FEM",
        "4.1.3",
        f"With {counts[middle]} of {counts[-1]} pairs the graph's is {100 * graph[middle]:.2g} % "
        f"off its own last curve, that of the curved elements {100 * errors[middle]:.2g} %: "
        f"{ratio:.2g} times.",
        Verdict.CONFIRMED if ratio > _FASTER else Verdict.REFUTED,
        {"ratio": ratio},
    )


def _logarithmic(times: Floats, curve: Floats) -> Finding:
    """A signature (T,) times the area falls to 1; shares of the times before and after."""
    local, whole = (float(np.interp(-level, -curve, times)) for level in (_LOCAL, _WHOLE))
    first, last = times[0], times[-1]
    shares = {
        "local": float(np.log(local / first) / np.log(last / first)),
        "whole": float(np.log(last / whole) / np.log(last / first)),
        "even_local": float((local - first) / (last - first)),
        "even_whole": float((last - whole) / (last - first)),
    }
    percent = {name: f"{100 * share:.2g}" for name, share in shares.items()}
    both = min(shares["local"], shares["whole"]) > _BOTH
    needed = min(shares["even_local"], shares["even_whole"]) < _BOTH
    return Finding(
        "Times on a logarithmic scale capture effects at long range as well as at short",
        "4.1.3, 4.2.4, 4.3",
        f"{percent['local']} % of the times are so small that the signature is above {_LOCAL:g} / "
        f"area, {percent['whole']} % so large that it is below {_WHOLE:g} / area. In even steps "
        f"they would be {percent['even_local']} and {percent['even_whole']} %.",
        Verdict.CONFIRMED if both and needed else Verdict.IN_PART if both else Verdict.REFUTED,
        shares,
    )


def _draw(
    times: Floats,
    curves: Floats,
    graph: Floats,
    counts: Sequence[int],
    errors: Floats,
    graph_errors: Floats,
) -> Figure:
    last = len(counts) - 1
    message = (
        f"Against {counts[-1]} pairs the signature at the dimple's tip is off by up to "
        f"{100 * errors[0]:.2g} % with {counts[0]} and {100 * errors[last - 1]:.2g} % with "
        f"{counts[last - 1]}"
    )
    figure = new_figure("4.3", _TITLE, message)
    cells = grid(figure, 1, 3, wspace=0.28)
    shades = [str(0.78 - 0.55 * k / last) for k in range(last)]
    for cell, data, name in zip(cells, (curves, graph), ("curved elements", "graph"), strict=False):
        axes = curve_axes(figure, cell, f"Signatures, {name}", "time (length²)", "HKS (1/length²)")
        for count, shade, both in zip(counts, [*shades, COLORS[0]], data, strict=True):
            axes.plot(times, both[0], color=shade, lw=1.6, label=f"{count} pairs")
            axes.plot(times, both[1], color=shade, lw=1.6, ls="--")
        logarithmic(axes)
        axes.legend(frameon=False, fontsize=8.5, title="solid: tip, dashed: opposite")
    axes = curve_axes(figure, cells[2], "Worst error at the tip", "eigenpairs", "error (%)")
    for data, name, color in (
        (errors, "curved elements", COLORS[0]),
        (graph_errors, "graph", COLORS[1]),
    ):
        axes.plot(counts[:-1], 100 * data[:-1], "o-", color=color, label=name)
    logarithmic(axes)
    axes.legend(frameon=False)
    return figure


EXPERIMENT = Experiment("4.3", _TITLE, run)
