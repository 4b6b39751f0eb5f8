"""The isosurfaces of section 5.3: a Born-Mayer potential of three atoms, one of which moves."""

from __future__ import annotations

import numpy as np

from ..geometry import Floats
from ..potentials import born_mayer
from ..scalar_field import ScalarField
from ._records import Settings

_MARGIN = 1.0  # around the lone atoms' spheres, for the moved one and its neighbours' pull


def isovalue(settings: Settings) -> float:
    """Of strength 1, so that a lone atom has a sphere of radius ``level``."""
    return float(np.exp(-settings["level"] / settings["decay_length"]))


def potential(settings: Settings, move: float, height: float | None = None) -> ScalarField:
    """Potential with the third atom moved along y; a height z cuts the surface above and below."""
    atoms = np.array(settings["atoms"])
    around = settings["level"] + _MARGIN
    low, high = atoms.min(axis=0) - around, atoms.max(axis=0) + around
    if height is not None:
        low[2], high[2] = -height, height
    shape = [round(float(length) / settings["samples"]) + 1 for length in high - low]
    atoms[2, 1] += move
    decay = 1 / settings["decay_length"]
    return born_mayer(
        atoms, strength=1.0, decay=decay, bounds=(low, high), shape=(shape[0], shape[1], shape[2])
    )


def mirrored(points: Floats, settings: Settings) -> list[Floats]:
    """Images in the two mirrors that the atoms keep while the third one moves."""
    middle = float(np.array(settings["atoms"])[:2, 0].mean())
    across = points * [-1, 1, 1] + [2 * middle, 0, 0]
    return [across, points * [1, 1, -1]]
