"""Two small real fields, so that everything can be tried without data of one's own."""

from __future__ import annotations

from pathlib import Path


def water_pair() -> tuple[Path, Path]:
    """Electron densities of water with one O-H bond of 0.95 and of 1.00 angstrom.

    Two ``.vti`` files, array ``electron_density`` in e/bohr^3, lengths in bohr; see
    ``README.md`` beside them. Isovalues from 0.002 to 1 give closed surfaces.

    Returns
    -------
    base, perturbed : Path

    Examples
    --------
    >>> [path.name for path in water_pair()]
    ['water_oh_0.95.vti', 'water_oh_1.00.vti']
    """
    folder = Path(__file__).parent
    return folder / "water_oh_0.95.vti", folder / "water_oh_1.00.vti"
