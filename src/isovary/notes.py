"""What a reader must know before trusting a comparison."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .comparison import Comparison

_RIGID_SHARE = 0.25


def reader_notes(result: Comparison, wanted_noise: float) -> tuple[str, ...]:
    """What a reader must know before trusting the picture, each note a sentence or two.

    Parameters
    ----------
    result : Comparison
        Complete but for its notes.
    wanted_noise : float
        Share of the change above which noise and coarse samples are worth a note.

    Returns
    -------
    tuple of str
        Notes on known faults end with their code.
    """
    notes = []
    carried = result.choices["correspondence"] == "carried"
    if result.motion.share > _RIGID_SHARE:
        shift = np.linalg.norm(result.motion.translation)
        turn = np.degrees(np.linalg.norm(result.motion.rotation))
        notes.append(
            f"A rigid motion (shift {shift:.3g}, turn {turn:.2g} degrees) explains "
            f"{result.motion.share:.0%} of the squared displacement. A rigid motion changes no "
            "intrinsic shape, but along normals it slides corresponding points: part of the change "
            "may be false. If the two runs do not share one frame of reference, align them first."
        )
    if not result.change.any():
        notes.append("The two isosurfaces are identical: no change at all. [C06]")
    elif not result.significant.any():
        notes.append("The change is nowhere twice the noise floor: nothing is shown as change.")
    elif result.relative_noise > wanted_noise:
        notes.append(
            f"The noise floor is {result.relative_noise:.0%} of the change (rms): ask for "
            + ("more vertices" if carried else "carried meshes")
            + " to see finer."
        )
    samples = result.choices["noise_of_the_samples"]
    if isinstance(samples, float) and not samples <= wanted_noise:
        size = f"cause {samples:.0%} of the change (rms)" if samples == samples else "are too few"
        notes.append(f"The samples of the fields {size}: only a finer grid tells more.")
    if result.topology.components > 1:
        notes.append(f"The isosurface has {result.topology.components} components. [I06]")
    if result.topology.boundary_loops > 0:
        notes.append(
            f"The isosurface leaves the box: {result.topology.boundary_loops} rim(s); near a rim "
            "the natural boundary doubles the signature at small times. [I05]"
        )
    if result.coverage < 1:
        lost = int((~result.correspondence.found).sum())
        notes.append(f"{lost} nodes found no partner; they are grey, not unchanged. [C02]")
    used = len(result.base_pairs.values)
    if used < result.choices["pairs"]:  # type: ignore[operator]
        notes.append(
            f"Only {used} eigenpairs are used: more would cut a group of equal eigenvalues. [S04]"
        )
    return tuple(notes)
