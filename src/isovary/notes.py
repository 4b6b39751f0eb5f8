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
        Notes on known faults begin with their code.
    """
    notes = []
    if not result.change.any():
        notes.append("C06: the two isosurfaces are identical: no change at all.")
    elif not result.significant.any():
        notes.append("The change is nowhere above the noise floor: nothing is shown as change.")
    elif result.relative_noise > wanted_noise:
        notes.append(
            f"The noise floor is {result.relative_noise:.0%} of the change (rms): ask for more "
            "vertices, or for carried meshes, to see finer."
        )
    sampling = _sampling_error(result)
    if sampling > wanted_noise * result.motion.total_rms > 0:
        notes.append(
            f"The samples are coarse: they misplace the isosurface by about {sampling:.2g} "
            f"({sampling / result.motion.total_rms:.0%} of the rms displacement). The noise floor "
            "does not contain that: use a finer grid."
        )
    if result.topology.components > 1:
        notes.append(f"I06: the isosurface has {result.topology.components} components.")
    if result.topology.boundary_loops > 0:
        notes.append(
            f"I05: the isosurface leaves the box: {result.topology.boundary_loops} boundary "
            "loop(s); near a rim the natural boundary doubles the signature at small times."
        )
    if result.coverage < 1:
        lost = int((~result.correspondence.found).sum())
        notes.append(f"C02: {lost} nodes found no partner; they are grey, not unchanged.")
    used = len(result.base_pairs.values)
    if used < result.choices["pairs"]:  # type: ignore[operator]
        notes.append(f"S04: {used} eigenpairs used; the count asked for would cut a multiplet.")
    if result.motion.share > _RIGID_SHARE:
        shift = np.linalg.norm(result.motion.translation)
        turn = np.degrees(np.linalg.norm(result.motion.rotation))
        notes.append(
            f"A rigid motion (shift {shift:.3g}, turn {turn:.2g} degrees) explains "
            f"{result.motion.share:.0%} of the squared displacement. A rigid motion changes no "
            "intrinsic shape, but along normals it slides corresponding points: part of the change "
            "may be false. If the two runs do not share one frame of reference, align them first."
        )
    return tuple(notes)


def _sampling_error(result: Comparison) -> float:
    """Length by which the samples misplace the isosurface: a sixteenth of that of every other."""
    errors = result.choices["interpolation_errors_at_half_resolution"]
    chosen = result.choices["interpolation"]
    return errors.get(chosen, 0.0) / 16 if isinstance(errors, dict) else 0.0
