"""Faults of dimples and potentials: what :mod:`planted_faults` plants besides."""

from __future__ import annotations

from fault import Fault

DEFORM = "tests/test_deform.py"
POTENTIALS = "tests/test_potentials.py"
THESIS = "tests/thesis/test_fig_"

MAKING = tuple(
    Fault(name, file, before, after, (tests,))
    for name, file, before, after, tests in (
        (
            "dimple: decay without the square",
            "deform.py",
            "np.exp(-squared / region.decay**2), 1 - squared",
            "np.exp(-np.sqrt(squared) / region.decay**2), 1 - squared",
            DEFORM,
        ),
        (
            "dimple: window not squared",
            "deform.py",
            "return decay * inside**2, slope",
            "return decay * inside, slope",
            DEFORM,
        ),
        (
            "dimple: lengths not in radii",
            "deform.py",
            "scale = strength * region.radius**3",
            "scale = strength",
            DEFORM,
        ),
        (
            "dimple: a charge forgotten",
            "deform.py",
            "strength = alpha * region.charge * projectile.charge",
            "strength = alpha * region.charge",
            DEFORM,
        ),
        (
            "dimple: the other side moves",
            "deform.py",
            "own = near & (piece == piece[np.flatnonzero((edges == nearest).any(axis=1))[0]])",
            "own = near",
            DEFORM,
        ),
        (
            "dimple: tide without gradient",
            "deform.py",
            "tide @ gradients",
            "tide",
            DEFORM,
        ),
        (
            "dimple: curved folds unseen",
            "deform.py",
            "turned |= ~(jacobian_ratios(points, triangles) > 0)",
            "pass",
            DEFORM,
        ),
        (
            "dimple: time not kept",
            "deform.py",
            "projectile.dt / finer",
            "projectile.dt",
            DEFORM,
        ),
        (
            "born_mayer: only the last atom",
            "potentials.py",
            "total += strength * np.exp(-decay * distance)",
            "total = strength * np.exp(-decay * distance)",
            POTENTIALS,
        ),
        (
            "born_mayer: decay taken for a length",
            "potentials.py",
            "np.exp(-decay * distance)",
            "np.exp(-distance / decay)",
            POTENTIALS,
        ),
        (
            "born_mayer: box of the fastest decay",
            "potentials.py",
            "+ 1) / decays",
            "+ 1) / decays.max()",
            POTENTIALS,
        ),
        (
            "thesis: order of the spheroid's eigenfunctions forgotten",
            "thesis/_spheroid.py",
            "order**2 * metric / radius",
            "order**2 * metric",
            THESIS + "4_11.py",
        ),
        (
            "thesis: pairs counted once",
            "thesis/_pair_norms.py",
            "(1 if one == other else 2)",
            "1",
            THESIS + "4_11.py",
        ),
        (
            "thesis: departure of twice the slope",
            "thesis/_fig_4_1.py",
            "change - depth * slope",
            "change - 2 * depth * slope",
            THESIS + "4_1.py",
        ),
        (
            "thesis: a rigid shift is no shift",
            "thesis/_fig_4_4.py",
            "shift * np.eye(3)[0]",
            "0 * shift * np.eye(3)[0]",
            THESIS + "4_4.py",
        ),
        (
            "noise of smoothed fields taken as white",
            "noise.py",
            "if field.unsmoothed is not None:",
            "if False:",
            "tests/test_smoothing.py",
        ),
        (
            "record: one digest for all files",
            "cli/_record.py",
            'file_digest(file, "sha256")',
            'file_digest(file, "sha512")',
            "tests/test_command_record.py",
        ),
        (
            "thesis: the printed W divides",
            "thesis/_fig_4_1_5.py",
            '"printed": printed_change(base, other)',
            '"printed": scaled_change(base, other)',
            THESIS + "4_1_5.py",
        ),
        (
            "thesis: fuzzy l1 in l2",
            "thesis/_fig_4_5.py",
            "fuzzy_c_means(rows, count, **chosen)",
            'fuzzy_c_means(rows, count, metric="l2", **chosen)',
            THESIS + "4_5.py",
        ),
        (
            "thesis: sheet bent less",
            "thesis/_fig_2_1.py",
            "bend=bend, order=order)",
            "bend=0.9 * bend, order=order)",
            THESIS + "2_1.py",
        ),
        (
            "crossings: beyond the triangle",
            "crossings.py",
            "(a > 0) & (b > 0) & (a + b < np.abs(slope))",
            "(a > 0) & (b > 0)",
            "tests/test_dimple_checks.py",
        ),
        (
            "crossings: touching counts",
            "crossings.py",
            "clear & (from_start * from_end < 0)",
            "(from_start * from_end < 0)",
            "tests/test_dimple_checks.py",
        ),
        (
            "crossings: those before blamed",
            "crossings.py",
            "pairs[~cross(before.points, flat, pairs)]",
            "pairs",
            "tests/test_dimple_checks.py",
        ),
        (
            "thesis: coarse run unmarked",
            "thesis/_gallery.py",
            "_mark_coarse(outcome.figure)",
            "pass",
            "tests/thesis/test_gallery.py",
        ),
        (
            "4.20: annealing's own failure unseen",
            "thesis/_fig_4_20.py",
            "Verdict.IN_PART if failing else verdict",
            "verdict",
            "tests/thesis/test_fig_4_20.py",
        ),
        (
            "2.1: change from the straight pose",
            "thesis/_fig_2_1.py",
            "(one - two) / scale for one, two in pairwise(profiles)",
            "(profiles[0] - two) / scale for two in profiles[1:]",
            "tests/thesis/test_fig_2_1.py",
        ),
        (
            "5.6: larger boxes are the same box",
            "thesis/_fig_5_6.py",
            "_carried(settings, more, base.times), whole)",
            "(base, change), whole)",
            "tests/thesis/test_fig_5_6.py",
        ),
        (
            "4.9: the loser counts as the winner",
            "thesis/_fig_4_9.py",
            "won = sum(nearest < radius",
            "won = sum(nearest > radius",
            "tests/thesis/test_fig_4_9.py",
        ),
    )
)
