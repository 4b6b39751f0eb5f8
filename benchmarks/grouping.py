"""Is any way of grouping the nodes superior? The thesis's section 4.2.7 measured.

Three pairs of isosurfaces whose changed region is known, every method of the clustering room and
both embeddings: what they find, how repeatable, how fast. The same in the thesis's way of
comparing, to see where the noise comes from that it found. Then kinds of change that only their
curve tells apart, the number of groups, and time and memory with many rows. Rewrites
docs/grouping.md.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import time
import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from grouping_picture import Panel, draw_panels, group_scores
from measured_page import write_page

import isovary as iv
from isovary.geometry import Bools, Floats, Ints, edges_of, linear_triangles, node_areas
from isovary.row_distances import distances

DOCS = Path(__file__).parents[1] / "docs"
PAGE = DOCS / "grouping.md"

WIDTH, INNER = 0.3, 0.12  # of a dimple, and of the deeper one inside; angles
REGION = WIDTH * np.log(10) ** 0.5  # there a dimple has a tenth of its depth
POLES = np.array([[0.0, 0, 1], [0, 0, -1]])
CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / 3**0.5
RINGS = ((0.1, 0.2), (0.2, 0.3), (0.3, 0.4), (0.4, 0.5))
SAMPLES, VERTICES, PAIRS = 61, 1500, 300
SEEDS = range(5)
MANY, GROUPS = 50_000, 5

Method = Callable[..., iv.Clusters]
METHODS: dict[str, Method] = {
    "k_medians, l1": iv.k_medians,
    "k_medians, l2 (k-means)": partial(iv.k_medians, metric="l2"),
    "k_medoids, l1": iv.k_medoids,
    "fuzzy_c_means, l1": iv.fuzzy_c_means,
    "fuzzy_c_means, l1, fuzziness 1.5": partial(iv.fuzzy_c_means, fuzziness=1.5),
    "fuzzy_c_means, l2": partial(iv.fuzzy_c_means, metric="l2"),
    "agglomerative, average, l1": iv.agglomerative,
    "agglomerative, ward, l2": partial(iv.agglomerative, metric="l2", linkage="ward"),
    "deterministic_annealing": iv.deterministic_annealing,
    "norm_bins": iv.norm_bins,
}
EMBEDDINGS: dict[str, Callable[..., Floats]] = {
    "classical_mds": iv.classical_mds,
    "universal_mds": iv.universal_mds,
}


@dataclass(frozen=True, eq=False)
class Pair:
    """Two isosurfaces compared, and how far each node of the base is from the nearest tip."""

    name: str
    tips: Floats
    base: iv.Surface
    shown: iv.Surface
    change: Floats
    significant: Bools
    times: Floats

    @property
    def areas(self) -> Floats:
        return node_areas(self.base.points, self.base.triangles)

    @property
    def angles(self) -> Floats:
        """From each node to each tip (n, tips), seen from the centre."""
        rays = self.base.points / np.linalg.norm(self.base.points, axis=1, keepdims=True)
        away: Floats = np.arccos(np.clip(rays @ self.tips.T, -1, 1))
        return away

    @property
    def region(self) -> Bools:
        """Where the surface moved by more than a tenth of the depth."""
        return self.angles.min(axis=1) < REGION


def sphere(tips: Floats, dimples: Sequence[tuple[float, float]]) -> iv.ScalarField:
    """Radius of the unit sphere with dimples, depth and width, at every tip, minus distance."""

    def value(points: Floats) -> Floats:
        away = np.linalg.norm(points, axis=-1)
        rays = points / np.maximum(away, 1e-9)[..., None]
        angles = np.arccos(np.clip(rays @ tips.T, -1, 1))
        depths = [depth * np.exp(-((angles / width) ** 2)).sum(axis=-1) for depth, width in dimples]
        level: Floats = 1 - away - sum(depths)
        return level

    bounds = ((-1.25,) * 3, (1.25,) * 3)
    return iv.ScalarField.from_function(value, bounds, (SAMPLES,) * 3)


DIMPLES = {
    "(a)": (POLES, [(0.2, WIDTH)]),
    "(b)": (POLES, [(0.05, WIDTH)]),
    "(c)": (CORNERS, [(0.1, WIDTH), (0.1, INNER)]),
}


def compared(name: str) -> Pair:
    """The pair by the defaults of compare."""
    tips, dimples = DIMPLES[name]
    base, dented = sphere(tips, []), sphere(tips, dimples)
    found = iv.compare(base, dented, 0.0, vertices=VERTICES, pairs=PAIRS)
    return Pair(
        name,
        tips,
        found.base,
        found.perturbed,
        found.change,
        found.significant,
        found.times,
    )


def thesis_way(name: str, vertices: int) -> Pair:
    """Two independent meshes of flat triangles, rays along the normals."""
    tips, dimples = DIMPLES[name]
    base, other = (
        iv.marching_cubes(sphere(tips, some), 0.0, vertices=vertices, order=1)
        for some in ([], dimples)
    )
    here, there = (iv.eigenpairs(iv.fem(surface), PAIRS) for surface in (base, other))
    times, match = iv.diffusion_times(here), iv.normal_rays(base, other)
    after = iv.interpolate(match, other, iv.heat_kernel_signature(there, times))
    before = iv.heat_kernel_signature(here, times)
    change = iv.signature_difference(before, after, iv.heat_trace_scale(here, times))
    unknown = np.zeros(len(change), dtype=bool)
    return Pair(name, tips, base, base, change, unknown, times)


def overlap(group: Bools, pair: Pair) -> float:
    """Area in both the group and the region over that in either (IoU)."""
    areas, region = pair.areas, pair.region
    return float(areas[group & region].sum() / areas[group | region].sum())


def best_group(labels: Ints, pair: Pair) -> float:
    """Overlap of the group that fits best."""
    return max(overlap(labels == group, pair) for group in range(labels.max() + 1))


def best_union(labels: Ints, pair: Pair) -> float:
    """Overlap of the groups, taken together, that fit best; all together do not count."""
    names = range(labels.max() + 1)
    unions = (some for size in names[1:] for some in combinations(names, size))
    return max((overlap(np.isin(labels, some), pair) for some in unions), default=0.0)


def agreement(runs: Sequence[Ints]) -> float:
    """Mean adjusted Rand index of pairs of runs."""
    return float(np.mean([iv.adjusted_rand_index(a, b) for a, b in combinations(runs, 2)]))


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [" | ".join(heads), " | ".join(["---"] * len(heads)), *(" | ".join(r) for r in rows)]
    return "".join(f"| {line} |\n" for line in lines)


def seeded(method: Method, pair: Pair, count: int) -> tuple[list[Ints], float]:
    """Labels with each seed, and the mean seconds of a run."""
    start = time.perf_counter()
    runs = [method(pair.change, count, rng=seed).labels for seed in SEEDS]
    return runs, (time.perf_counter() - start) / len(runs)


def region_table(pair: Pair) -> str:
    """Every method on a pair with two dimples: how well a group is the region."""
    heads = ["method", "2 groups", "area weights", "significant only"]
    heads += ["best union of 3", "of 4", "of 5", "seeds agree", "seconds"]
    known = np.where(pair.significant[:, None], pair.change, np.nan)
    rows = []
    for name, method in METHODS.items():
        runs, seconds = seeded(method, pair, 2)
        unions = [best_union(method(pair.change, k, rng=0).labels, pair) for k in (3, 4, 5)]
        weighted = method(pair.change, 2, weights=pair.areas, rng=0).labels
        fits = [best_group(labels, pair) for labels in (runs[0], weighted)]
        fits += [best_group(method(known, 2, rng=0).labels, pair), *unions]
        cells = [f"{fit:.2f}" for fit in fits]
        rows.append([name, *cells, f"{agreement(runs):.2f}", f"{seconds:.1f}"])
    depth = DIMPLES[pair.name][1][0][0]
    said = (
        f"**Pair {pair.name}, dimples of depth {depth:g}**: IoU of the best group with the region, "
        f"by area; {len(pair.change):,} nodes, {pair.significant.mean():.1%} of them significant.\n"
    )
    return f"{said}\n{table(heads, rows)}"


def limits(pair: Pair) -> str:
    """What decides the overlap: the change by angle, and the best that a threshold can do."""
    away, norm = pair.angles.min(axis=1), iv.change_norm(pair.change)
    low = np.arange(0, 0.9, 0.1)
    inside = [(away >= a) & (away < a + 0.1) for a in low]
    columns = [0, 25, 50, 75, len(pair.times) - 1]
    rows = [
        [f"{a:.1f} to {a + 0.1:.1f}", f"{1e3 * norm[band].mean():.1f}"]
        + [f"{1e3 * v:.1f}" for v in pair.change[band][:, columns].mean(axis=0)]
        for a, band in zip(low, inside, strict=True)
    ]
    heads = ["angle from the tip", "norm", *(f"t = {pair.times[c]:.2g}" for c in columns)]
    cuts = np.quantile(norm, np.linspace(0, 1, 400))
    threshold = max(overlap(norm >= cut, pair) for cut in cuts)
    labels = iv.k_medians(pair.change, 2).labels
    group = max((0, 1), key=lambda g: overlap(labels == g, pair))
    reach = 2 * np.arcsin((pair.areas[labels == group].sum() / len(pair.tips) / np.pi) ** 0.5 / 2)
    said = (
        f"**What limits pair {pair.name}** (mean change times 1000; the region ends at "
        f"{REGION:.3f}): the group of `k_medians` has the area of caps up to the angle "
        f"{reach:.2f}; the best of all thresholds on the norm reaches IoU {threshold:.2f}.\n"
    )
    return f"{said}\n{table(heads, rows)}"


def alike(labels: Ints, pair: Pair) -> tuple[int, int, float]:
    """How many tips share one label; rings, of those that agree least; the tips' group inside."""
    away, areas = pair.angles, pair.areas
    tips = labels[away.argmin(axis=0)]
    common = np.bincount(tips).argmax()
    nearest, angle = away.argmin(axis=1), away.min(axis=1)
    least = len(pair.tips)
    for low, high in RINGS:
        band = (angle >= low) & (angle < high)
        main = [
            np.bincount(labels[own], areas[own]).argmax()
            for own in (band & (nearest == tip) for tip in range(len(pair.tips)))
        ]
        least = min(least, int(np.bincount(main).max()))
    own = labels == common
    inside = areas[own & pair.region].sum() / areas[own].sum()
    return int((tips == common).sum()), least, float(inside)


def tips_table(pair: Pair) -> str:
    """Do equal places get equal labels?"""
    heads = ["method", "2 groups", "3 groups", "5 groups", "seeds agree (3 groups)", "seconds"]
    rows = []
    for name, method in METHODS.items():
        runs, seconds = seeded(method, pair, 3)
        each = [method(pair.change, 2, rng=0).labels, runs[0]]
        each.append(method(pair.change, 5, rng=0).labels)
        cells = ["{} of 8, {} of 8, {:.0%}".format(*alike(labels, pair)) for labels in each]
        rows.append([name, *cells, f"{agreement(runs):.2f}", f"{seconds:.1f}"])
    said = (
        "**Pair (c), eight two-level dimples**: tips that share one label; dimples whose rings "
        "have the same main label (the worst of four rings 0.1 wide, from 0.1 to 0.5); and how "
        f"much of the tips' group lies in the region; {len(pair.change):,} nodes.\n"
    )
    return f"{said}\n{table(heads, rows)}"


def stress(points: Floats, rows: Floats) -> float:
    """Root of the summed squared misfit of distances over that of the distances, of a sample."""
    some = np.random.default_rng(2024).choice(len(rows), min(len(rows), 1500), replace=False)
    wanted = distances(rows[some], rows[some], "l1")
    found = distances(points[some], points[some], "l2")
    return float(np.sqrt(((found - wanted) ** 2).sum() / (wanted**2).sum()))


def roughness(points: Floats, surface: iv.Surface) -> float:
    """Mean squared distance of neighbours over that of any two nodes: 0 smooth, 1 pure noise."""
    i, j = edges_of(linear_triangles(surface.triangles))[0].T
    known = np.isfinite(points).all(axis=1)
    both = known[i] & known[j]
    steps = ((points[i] - points[j])[both] ** 2).sum(axis=1).mean()
    return float(steps / (2 * points[known].var(axis=0).sum()))


def stress_table(pairs: Sequence[Pair]) -> str:
    """Both embeddings in three dimensions."""
    heads = ["embedding", *(f"{p.name} {what}" for p in pairs for what in ("stress", "roughness"))]
    heads.append("seconds")
    rows = []
    for name, embed in EMBEDDINGS.items():
        start = time.perf_counter()
        found = [embed(pair.change) for pair in pairs]
        seconds = (time.perf_counter() - start) / len(pairs)
        cells = [
            f"{value:.3g}"
            for points, pair in zip(found, pairs, strict=True)
            for value in (stress(points, pair.change), roughness(points, pair.base))
        ]
        rows.append([name, *cells, f"{seconds:.1f}"])
    said = (
        "**Embeddings in three dimensions**: stress, the root mean square error of the distances "
        "over their root mean square; roughness, the mean squared step between neighbouring nodes "
        "over that between any two (0 smooth, 1 noise).\n"
    )
    return f"{said}\n{table(heads, rows)}"


def cause_table(ways: Sequence[tuple[str, Pair]]) -> str:
    """The methods that the thesis dismissed, and its own, on the change of either way."""
    heads = ["way", "pair", "nodes", "k_medians", "k_medoids", "annealing, 2 groups"]
    heads += ["annealing's own number", "classical_mds roughness", "universal_mds roughness"]
    rows = []
    for way, whole in ways:
        pair = without_lost(whole)
        fits = [
            best_group(METHODS[name](pair.change, 2, rng=0).labels, pair)
            for name in ("k_medians, l1", "k_medoids, l1", "deterministic_annealing")
        ]
        own = iv.deterministic_annealing(pair.change)
        rough = [roughness(embed(pair.change), pair.base) for embed in EMBEDDINGS.values()]
        rows.append(
            [way, pair.name, f"{len(pair.change):,}", *(f"{fit:.2f}" for fit in fits)]
            + [f"{len(own.centers)}: best union {best_union(own.labels, pair):.2f}"]
            + [f"{value:.2g}" for value in rough]
        )
    said = "**The same surfaces, the same methods, two ways to compare** (IoU with the region).\n"
    return f"{said}\n{table(heads, rows)}"


def without_lost(pair: Pair) -> Pair:
    """A pair all of whose nodes have a partner, or an error."""
    if not np.isfinite(pair.change).all():
        raise RuntimeError(f"pair {pair.name}: expected a partner for every node")
    return pair


def kinds_table() -> str:
    """Three kinds of change of equal norm: early, late, and first one sign and then the other."""
    column = np.arange(100)
    early, middle, late = (np.exp(-(((column - at) / 12) ** 2)) for at in (20, 50, 80))
    kinds = np.stack([early - middle, middle - late, late - early])
    kinds /= np.abs(kinds).sum(axis=1, keepdims=True) / 100
    truth = np.repeat(np.arange(3), 500)
    generator = np.random.default_rng(2024)
    rows = kinds[truth] + generator.normal(0, 0.3, (len(truth), 100))
    found = [
        [name, f"{iv.adjusted_rand_index(truth, method(rows, 3, rng=0).labels):.2f}"]
        for name, method in METHODS.items()
    ]
    said = (
        "**Three kinds of change of equal L1 norm**, 500 rows of each, with noise of 0.3 of the "
        "mean size in every entry: adjusted Rand index with the truth.\n"
    )
    return f"{said}\n{table(['method', '3 groups'], found)}"


def counts_table(pairs: Sequence[Pair]) -> str:
    """Silhouette and stability by number of groups, and annealing's own number."""
    heads = ["pair", "method", *(str(k) for k in range(2, 9)), "best"]
    rows = []
    for pair in pairs:
        for name in ("k_medians, l1", "agglomerative, average, l1"):
            found = iv.choose_count(pair.change, METHODS[name], range(2, 9))
            both = zip(found.silhouette, found.stability, strict=True)
            cells = [f"{good:.2f}, {again:.2f}" for good, again in both]
            rows.append([pair.name, name, *cells, str(found.best)])
        own = iv.annealing(pair.change)
        spans = np.log(own.temperatures[:-1] / own.temperatures[1:])
        longest = dict(zip(own.counts.tolist(), spans.tolist(), strict=False))
        cells = [f"{longest[k]:.2f}" if k in longest else "" for k in range(2, 9)]
        rows.append([pair.name, "annealing", *cells, str(len(own.clusters.centers))])
    said = (
        "**How many groups?** `choose_count`: silhouette, stability. Annealing: the range of log "
        "temperature over which the number stays.\n"
    )
    return f"{said}\n{table(heads, rows)}"


def many_rows(change: Floats) -> Floats:
    """Rows between those there are: each a blend of two, by chance."""
    generator = np.random.default_rng(2024)
    one, other = generator.integers(len(change), size=(2, MANY))
    part = generator.random((MANY, 1)) ** 4
    rows: Floats = (1 - part) * change[one] + part * change[other]
    return rows


def cost_table(change: Floats) -> str:
    """Time and peak memory with many rows, each method in a process of its own."""
    names = ("rows read, nothing else", *METHODS, *EMBEDDINGS)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "rows.npy"
        np.save(path, many_rows(change))
        rows = [[name, *measured_alone(name, path)] for name in names]
    said = (
        f"**{MANY:,} rows of {change.shape[1]} times, {GROUPS} groups** (embeddings: 3 axes), each "
        "in a process of its own; the rows blend two of pair (c) each. Seconds by the clock, on "
        "all threads together, and the peak memory of the whole process.\n"
    )
    return f"{said}\n{table(['method', 'seconds', 'CPU seconds', 'GB'], rows)}"


def measured_alone(name: str, path: Path) -> list[str]:
    """Seconds, CPU seconds and GB of one method in a process of its own."""
    command = [sys.executable, __file__, "--one", name, str(path)]
    said = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    seconds, used, memory = map(float, said.split())
    return [f"{seconds:.1f}", f"{used:.1f}", f"{memory:.2f}"]


def run_one(name: str, path: str) -> None:
    """Seconds, CPU seconds and peak memory in GB of one method, printed."""
    rows = np.load(path)
    start, used = time.perf_counter(), time.process_time()
    if name in METHODS:
        METHODS[name](rows, GROUPS, rng=0)
    elif name in EMBEDDINGS:
        EMBEDDINGS[name](rows, rng=0)
    print(time.perf_counter() - start, time.process_time() - used, peak_memory())


def peak_memory() -> float:
    """Largest resident memory of this process, GB.

    Linux's getrusage includes what the parent held when it started this process.
    """
    status = Path("/proc/self/status")
    if status.is_file():
        peak = next(line for line in status.read_text().splitlines() if "VmHWM" in line)
        return int(peak.split()[1]) * 1024 / 1e9
    unit = 1 if sys.platform == "darwin" else 1024  # macOS counts bytes
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e9


SHORT = {
    "k_medians, l1": "k_medians (l1)",
    "k_medians, l2 (k-means)": "k_medians (l2), k-means",
    "k_medoids, l1": "k_medoids (l1)",
    "fuzzy_c_means, l1": "fuzzy_c_means (l1)",
    "fuzzy_c_means, l2": "fuzzy_c_means (l2)",
    "agglomerative, average, l1": "average linkage (l1)",
    "agglomerative, ward, l2": "ward linkage (l2)",
    "deterministic_annealing": "annealing",
    "norm_bins": "norm_bins",
}


def group_panel(name: str, pair: Pair, count: int, reference: Ints) -> tuple[float, Panel]:
    """IoU, and the groups in the colours of those of the reference that they continue."""
    groups = METHODS[name](pair.change, count, rng=0)
    labels = groups.labels
    palette = iv.nested_colors([reference, labels], weights=pair.areas)[1]
    fit = best_group(labels, pair)
    words = SHORT[name], f"IoU {fit:.2f}"
    scores = group_scores(pair.change, groups, pair.base)
    return fit, Panel(pair.shown, palette[labels], *words, pair.tips, REGION, scores, palette)


def embedding_panel(name: str, pair: Pair) -> Panel:
    points = EMBEDDINGS[name](pair.change)
    said = f"roughness {roughness(points, pair.base):.2g}"
    return Panel(pair.shown, iv.embedding_colors(points), name, said, pair.tips, REGION)


def draw_methods(pair: Pair) -> None:
    """All methods on the shallow dimples, two groups, the best first."""
    reference = iv.k_medians(pair.change, 2).labels
    found = [group_panel(name, pair, 2, reference) for name in SHORT]
    found.sort(key=lambda one: one[0], reverse=True)
    colors = iv.group_colors(2)
    truth = Panel(
        pair.shown,
        colors[pair.region.astype(int)],
        "the true region",
        "IoU 1",
        pair.tips,
        REGION,
        np.column_stack([np.full(len(pair.change), REGION), pair.angles.min(axis=1)]),
        colors,
    )
    panels = [truth]
    panels += [panel for _, panel in found]
    panels += [embedding_panel(name, pair) for name in EMBEDDINGS]
    draw_panels(
        panels,
        f"Two groups overlap a shallow dimple by {found[-1][0]:.0%} to {found[0][0]:.0%}; "
        "embeddings show it whole",
        "unit sphere, dimples of depth 0.05 at both poles, one of them seen; inside the black line "
        "a dimple has more than a tenth of its depth; IoU: overlap of the best group with that",
        DOCS / "grouping.png",
        columns=6,
    )


def draw_cause(ways: Sequence[tuple[str, Pair]]) -> None:
    """What the thesis dismissed as noise, on the change of each way."""
    panels: list[Panel] = []
    for way, pair in ways:
        reference = iv.k_medians(pair.change, 2).labels
        names = ("k_medians, l1", "deterministic_annealing")
        panels += [group_panel(name, pair, 2, reference)[1].marked(way) for name in names]
        panels += [embedding_panel(name, pair).marked(way) for name in EMBEDDINGS]
    draw_panels(
        panels,
        "The noise was in the meshes, not in the methods",
        "the same two surfaces, dimples of depth 0.05; first row: one curved mesh, carried; "
        "others: two flat meshes and rays",
        DOCS / "grouping-noise.png",
        columns=4,
        width=9.6,
    )


def main() -> None:
    start = time.perf_counter()
    tables: dict[str, str] = {}

    def note(name: str, measured: str) -> None:
        tables[name] = measured
        print(f"{measured}\n({time.perf_counter() - start:.0f} s)\n", flush=True)

    deep, shallow, eight = pairs = [compared(name) for name in DIMPLES]
    theirs = [thesis_way(name, n) for n in (4 * VERTICES, VERTICES) for name in ("(a)", "(b)")]
    draw_methods(shallow)
    shown = {"one mesh": shallow, "two fine ones": theirs[1], "two coarse ones": theirs[3]}
    draw_cause(list(shown.items()))
    note("deep", region_table(deep))
    note("shallow", region_table(shallow))
    note("limits", limits(shallow))
    note("tips", tips_table(eight))
    carried, rays = "one mesh, carried", "two meshes, rays"
    ways = [(carried, deep), (carried, shallow), *((rays, pair) for pair in theirs)]
    note("cause", cause_table(ways))
    note("stress", stress_table(pairs))
    note("kinds", kinds_table())
    note("counts", counts_table(pairs))
    note("cost", cost_table(eight.change))
    write_page(PAGE, "grouping.py", tables)


if __name__ == "__main__":
    warnings.simplefilter("ignore", UserWarning)
    if sys.argv[1:2] == ["--one"]:
        run_one(*sys.argv[2:])
    else:
        main()
