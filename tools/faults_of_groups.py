"""Faults of grouping and of seeing: what :mod:`planted_faults` plants besides."""

from __future__ import annotations

from fault import Fault

HARD = "tests/test_hard_groups.py"
SOFT = "tests/test_soft_groups.py"
EMBEDDING = "tests/test_embedding.py"
COLOR = "tests/test_color.py"
COUNT = "tests/test_count_choice.py"
BORDERS = "tests/test_borders.py"
PICTURES = "tests/test_pictures.py"

GROUPS = (
    Fault(
        "k_medians: cost without weights",
        "clustering/_k_medians.py",
        "(weights * (distance if metric",
        "((distance if metric",
        (HARD,),
    ),
    Fault(
        "k_medians: medians without weights",
        "clustering/_k_medians.py",
        "np.cumsum(weights[members], axis=1)",
        "np.cumsum(np.ones(members.shape), axis=1)",
        (HARD,),
    ),
    Fault(
        "k_medians: half missed by rounding",
        "clustering/_k_medians.py",
        "below[:, -1:] / 2 * (1 - 1e-12)",
        "below[:, -1:] / 2",
        (HARD,),
    ),
    Fault(
        "k_medoids: loss to the next medoid only",
        "clustering/_k_medoids.py",
        "np.minimum(np.maximum(reach, now.near), now.next) - now.near",
        "now.next - now.near",
        (HARD,),
    ),
    Fault(
        "k_medoids: half the exchanges tried",
        "clustering/_k_medoids.py",
        "while tried < len(table):",
        "while tried < len(table) // 2:",
        (HARD,),
    ),
    Fault(
        "k_medoids: not finished on all rows",
        "clustering/_k_medoids.py",
        "centers = _polished(known, centers, metric)",
        "pass",
        (HARD,),
    ),
    Fault(
        "norm_bins: edge to the bin below",
        "clustering/_norm_bins.py",
        'side="right"',
        'side="left"',
        (HARD,),
    ),
    Fault(
        "agglomerative: always average",
        "clustering/_agglomerative.py",
        "hierarchy.linkage(pairs, linkage)",
        'hierarchy.linkage(pairs, "average")',
        (HARD,),
    ),
    Fault(
        "agglomerative: nearest in another metric",
        "clustering/_agglomerative.py",
        "distances(data[i : i + _CHUNK], sampled, metric).argmin",
        'distances(data[i : i + _CHUNK], sampled, "l2").argmin',
        (HARD,),
    ),
    Fault(
        "fuzzy: memberships forget the power of l2",
        "clustering/_fuzzy_c_means.py",
        "ratio ** (_POWER[problem.metric] / (problem.fuzziness - 1))",
        "ratio ** (1 / (problem.fuzziness - 1))",
        (SOFT,),
    ),
    Fault(
        "fuzzy: centers weighed by u, not u^m",
        "clustering/_fuzzy_c_means.py",
        "mass = problem.weights * shares.T**problem.fuzziness",
        "mass = problem.weights * shares.T",
        (SOFT,),
    ),
    Fault(
        "annealing: critical temperature halved",
        "clustering/_deterministic_annealing.py",
        "max(2 * float(value[0]), 0.0)",
        "max(float(value[0]), 0.0)",
        (SOFT,),
    ),
    Fault(
        "annealing: masses forgotten",
        "clustering/_deterministic_annealing.py",
        "exponent += np.log(np.maximum(state.masses, np.finfo(float).tiny))",
        "pass",
        (SOFT,),
    ),
    Fault(
        "annealing: cools past the critical temperature",
        "clustering/_deterministic_annealing.py",
        "max(wanted, cooling * temperature)",
        "cooling * temperature",
        (SOFT,),
    ),
    Fault(
        "silhouette: a row counts itself",
        "clustering/_choose_count.py",
        "rest[places, own] -= weights",
        "pass",
        (SOFT,),
    ),
    Fault(
        "choose_count: one seed for all runs",
        "clustering/_choose_count.py",
        "method(data[part], count, rng=seed).labels",
        "method(data[part], count, rng=0).labels",
        (SOFT,),
    ),
    Fault(
        "mds: centred by the plain mean",
        "embedding/_classical_mds.py",
        "centred -= (centred @ weights)[:, None]",
        "centred -= centred.mean(axis=1)[:, None]",
        (EMBEDDING,),
    ),
    Fault(
        "mds: landmarks weigh alike",
        "embedding/_classical_mds.py",
        "shares = np.bincount(owner, weights=weights, minlength=len(chosen)).astype(float)",
        "shares = np.full(len(chosen), 1 / len(chosen))",
        (EMBEDDING,),
    ),
    Fault(
        "mds: worse moves are made",
        "embedding/_universal_mds.py",
        "better = moved_costs < costs",
        "better = moved_costs < np.inf",
        (EMBEDDING,),
    ),
    Fault(
        "mds: a point pulls itself",
        "embedding/_universal_mds.py",
        "others[i] = 0.0",
        "pass",
        (EMBEDDING,),
    ),
    Fault(
        "color: a group continued twice",
        "color.py",
        "common[here], common[:, there] = 0.0, 0.0",
        "common[here] = 0.0",
        (COLOR,),
    ),
    Fault(
        "color: a newcomer takes a used colour",
        "color.py",
        "free = set(range(len(before) + len(follows))) - set(before)",
        "free = set(range(len(before) + len(follows)))",
        (COLOR,),
    ),
    Fault(
        "gap: error without the references' own",
        "clustering/_gap.py",
        "np.sqrt(1 + 1 / len(theirs))",
        "1.0",
        (COUNT,),
    ),
    Fault(
        "gap: box along the columns",
        "clustering/_gap.py",
        "np.linalg.svd(data - middle, full_matrices=False)[2]",
        "np.eye(data.shape[1])",
        (COUNT,),
    ),
    Fault(
        "best_gap: without its error",
        "clustering/_choose_count.py",
        "self.gap[1:] - self.gap_error[1:]",
        "self.gap[1:]",
        (COUNT,),
    ),
    Fault(
        "auto groups: unstable counts taken",
        "groups.py",
        "choice.stability >= _STABLE",
        "choice.stability >= 0",
        (COUNT,),
    ),
    Fault(
        "borders: as far from one group as from the next, on the wrong side",
        "view/_borders.py",
        "scores[:, other] - scores[:, group]",
        "scores[:, group] - scores[:, other]",
        (BORDERS,),
    ),
    Fault(
        "borders: each piece with points of its own",
        "view/_borders.py",
        "_, first, same = np.unique(grid, axis=0, return_index=True, return_inverse=True)",
        "first = same = np.arange(len(grid))",
        (BORDERS,),
    ),
    Fault(
        "rim band: contour off the level",
        "view/_rim_band.py",
        "part = height[:, i] / np",
        "part = 0.5 * height[:, i] / np",
        (PICTURES,),
    ),
    Fault(
        "rim band at half the radius",
        "view/_rim_band.py",
        "float(diffusion_radius(time))",
        "float(diffusion_radius(time)) / 2",
        (PICTURES,),
    ),
    Fault(
        "memberships of the wrong groups",
        "view/_paint.py",
        "parts @ color.srgb_to_oklab(palette)",
        "parts[:, ::-1] @ color.srgb_to_oklab(palette)",
        (PICTURES,),
    ),
    Fault(
        "both: front and back swapped",
        "view/_both.py",
        "_share(gap - least), _share(-gap - least)",
        "_share(-gap - least), _share(gap - least)",
        (PICTURES,),
    ),
    Fault(
        "both: far partners weigh more",
        "view/_both.py",
        "weights = 1 / np.maximum(away",
        "weights = np.maximum(away",
        (PICTURES,),
    ),
    Fault(
        "dendrogram: cut one merge too low",
        "view/_dendrogram.py",
        "ends[len(ends) - count]),",
        "ends[len(ends) - count - 1]),",
        (PICTURES,),
    ),
)
