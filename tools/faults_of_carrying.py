"""Faults of aligning, carrying and the floors: what :mod:`planted_faults` plants besides."""

from __future__ import annotations

from fault import Fault

ISOMETRY = "tests/test_isometry.py"
TRUST = "tests/test_trust.py"
COMPARISON = "tests/test_comparison.py"

CARRYING = (
    Fault(
        "slide: half of the shear",
        "isometry.py",
        "mixed = np.sqrt(2) * symmetric[..., 0, 1]",
        "mixed = symmetric[..., 0, 1]",
        (ISOMETRY,),
    ),
    Fault(
        "slide: away from the least strain is taken, too",
        "sliding.py",
        "if there.arrived.all() and lower < energy and",
        "if there.arrived.all() and",
        (ISOMETRY,),
    ),
    Fault(
        "slide: nothing holds what could slide freely",
        "sliding.py",
        "_ANCHOR = 10.0",
        "_ANCHOR = 0.0",
        (ISOMETRY,),
    ),
    Fault(
        "slide: the first small step is the last",
        "sliding.py",
        "\nSETTLED = 1e-5\n",
        "\nSETTLED = 1e-2\n",
        (ISOMETRY,),
    ),
    Fault(
        "slide: nothing is learned from the steps before",
        "sliding.py",
        "memory, damping = memory.after(step, gradient - before),",
        "memory, damping = Memory(),",
        (ISOMETRY,),
    ),
    Fault(
        "memory: steps along which the gradient falls are kept",
        "quasi_newton.py",
        "        if not np.vdot(step, change) > 0:\n            return self\n",
        "",
        ("tests/test_quasi_newton.py",),
    ),
    Fault(
        "strain: one component only",
        "isometry.py",
        "strain = part.mean([(tensor - np.eye(2)) / 2])",
        "strain = part.mean([(tensor - np.eye(2)) * [[0.5, 0], [0, 0]]])",
        (ISOMETRY,),
    ),
    Fault(
        "carry: rims are not held",
        "carrying/_isometrically.py",
        "        frames[on_face] = 0\n",
        "",
        (ISOMETRY,),
    ),
    Fault(
        "carry: corners of rims slide",
        "carrying/_isometrically.py",
        "        frames[count > 1] = 0\n",
        "",
        (ISOMETRY,),
    ),
    Fault(
        "carry: the strain of each step alone",
        "carrying/_isometrically.py",
        "points = slide(base, carried.points,",
        "points = slide(current, carried.points,",
        (ISOMETRY,),
    ),
    Fault(
        "carry: nobody follows a rim",
        "carrying/_along_normals.py",
        "    moves = _diffused(surface, rim, along, length)\n",
        "",
        (ISOMETRY,),
    ),
    Fault(
        "align: the motion taken backwards",
        "task.py",
        "moved(field, found.motion) for",
        "moved(field, found.motion.inverse) for",
        (COMPARISON,),
    ),
    Fault(
        "moved field: gradients not turned",
        "level_sets.py",
        "return level, self.motion.turn(gradient)",
        "return level, gradient",
        (COMPARISON,),
    ),
    Fault(
        "blend: the first field's gradient",
        "level_sets.py",
        "[weight * gradient for weight, _, gradient in mixed]",
        "[weight * mixed[0][2] for weight, _, _ in mixed]",
        (ISOMETRY,),
    ),
    Fault(
        "strain: a third of its floor",
        "levels.py",
        "return combined_floor(floors)[:, 0]",
        "return combined_floor(floors)[:, 0] / 3",
        (TRUST,),
    ),
    Fault(
        "notes: places in the wrong order are not told",
        "notes.py",
        "if result.audit.turned.any():",
        "if False:",
        (TRUST,),
    ),
    Fault(
        "notes: what is nobody's partner is not told",
        "notes.py",
        "if result.audit.perturbed_coverage < _COVERED:",
        "if False:",
        (TRUST,),
    ),
    Fault(
        "only matching: a distance where nothing was compared",
        "levels.py",
        "spread(partners.distance, np.nan),",
        "spread(partners.distance, 0.0),",
        (TRUST,),
    ),
    Fault(
        "carry: a step that arrived is not doubled",
        "carrying/_isometrically.py",
        "part, step, count = part + step, 2 * step, count + 1",
        "part, step, count = part + step, step, count + 1",
        (ISOMETRY,),
    ),
    Fault(
        "slide: a damped short step is the last",
        "sliding.py",
        "_LITTLE if exact else np.inf",
        "np.inf",
        (ISOMETRY,),
    ),
    Fault(
        "slide: one round",
        "sliding.py",
        "for _ in range(_ROUNDS if exact else 1):",
        "for _ in range(1):",
        (ISOMETRY,),
    ),
    Fault(
        "slide: rounds go on where the mesh alone moves the points",
        "sliding.py",
        "_SHRINKS = 0.5",
        "_SHRINKS = 1e9",
        (ISOMETRY,),
    ),
    Fault(
        "slide: the anchor does not pull",
        "sliding.py",
        "slope = more * slope.reshape(-1, 2) + pull * away",
        "slope = more * slope.reshape(-1, 2)",
        (ISOMETRY,),
    ),
    Fault(
        "slide: the anchor's factor is left out of the slope",
        "sliding.py",
        "slope = more * slope.reshape(-1, 2) + pull * away",
        "slope = slope.reshape(-1, 2) + pull * away",
        (ISOMETRY,),
    ),
)
