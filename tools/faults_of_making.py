"""Faults of dimples and potentials: what :mod:`planted_faults` plants besides."""

from __future__ import annotations

from fault import Fault

DEFORM = "tests/test_deform.py"
POTENTIALS = "tests/test_potentials.py"

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
            "+ 1) / decays.min()",
            "+ 1) / decays.max()",
            POTENTIALS,
        ),
    )
)
