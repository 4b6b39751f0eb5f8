"""Scalar fields from files: one function, the format told by the suffix."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ArgumentError, FieldError, FileError
from ..scalar_field import ScalarField
from ._checks import Samples, check_file, check_grid, check_magic, check_shape, guess_suffix
from ._cube import read_cube
from ._numpy import read_npy, read_npz
from ._vti import read_vti

_READERS: dict[str, Callable[[Path, str | None], Samples]] = {
    ".vti": read_vti,
    ".npy": read_npy,
    ".npz": read_npz,
    ".cube": read_cube,
    ".cube.gz": read_cube,
}
_TAKES_GRID = (".npy", ".npz")


def read_field(
    path: str | os.PathLike[str],
    array: str | None = None,
    *,
    spacing: ArrayLike | None = None,
    origin: ArrayLike | None = None,
) -> ScalarField:
    """Read a scalar field on a regular grid from a file.

    ============  ==========================================  ====================
    suffix        what ``array`` names                        length unit
    ============  ==========================================  ====================
    ``.vti``      a point array with one component            the file's
    ``.npy``      ``"[3]"``: index 3 of a 4-D array           yours
    ``.npz``      a key, ``"s[3]"`` for index 3 of a 4-D key  the file's, or yours
    ``.cube``     ``"0"``, ``"1"``, ..: value in each voxel   bohr
    ``.cube.gz``  the same                                    bohr
    ============  ==========================================  ====================

    Parameters
    ----------
    path : path
        File to read.
    array : str, optional
        Array to take. Not needed if the file holds only one; a file with several
        is refused without it, with their names, rather than guessed at.
    spacing, origin : array (3,), optional
        Grid of an ``.npy`` or ``.npz`` file, whose keys ``spacing`` and
        ``origin`` they override; length. Without any, the spacing is 1 (with a
        warning, I07) and the origin 0. The other formats state their own.

    Returns
    -------
    ScalarField
        Values in the file's unit, indexed x, y, z. Cube files are turned so
        that their axes run along +x, +y, +z, and angstrom (negative voxel
        counts) become bohr (1 bohr = 0.529177210903 angstrom).

    Raises
    ------
    FileError
        F01 missing or unreadable; F02 empty; F03 truncated, damaged, or with
        bytes left over; F04 unknown or wrong suffix; F05 fewer than four
        samples along an axis; F06 VTK complained or crashed; F08 more samples
        than the file or the memory can hold; F09 no such array, several, or
        none that is a scalar field; F10 pickled objects; F11 an unsafe zip
        archive; F12 XML with a DOCTYPE; F14 a grid that is not along x, y, z.
    FieldError
        I01 for NaN or inf, I03 for a constant field.
    ArgumentError
        A03 for a spacing or origin of the wrong shape, or for a format that
        states its own.

    Notes
    -----
    Cost: linear in the file's size. A ``.vti`` is parsed in a child process
    (0.3 s to start), so that a crash in VTK's native code ends in an error; a
    ``.cube`` takes about a second for 2 million values.

    Examples
    --------
    Electron density of water on a box around the molecule, in bohr:

    >>> from isovary.data import water_pair
    >>> field = read_field(water_pair()[0])
    >>> field.name, field.spacing.round(3).tolist()
    ('electron_density', [0.19, 0.19, 0.19])
    """
    path = Path(path)
    if array is not None and not isinstance(array, str):
        raise ArgumentError("A03", f"array: expected a name, got {array!r}; use str({array!r})")
    check_file(path)
    suffix = _suffix(path)
    if suffix not in _TAKES_GRID and not (spacing is None and origin is None):
        raise ArgumentError(
            "A03",
            f"spacing, origin: expected none for a {suffix} file, which states its own, "
            f"got spacing={spacing!r}, origin={origin!r}; leave them out",
        )
    check_magic(path, suffix)
    samples = _READERS[suffix](path, array)
    check_shape(path, samples.values.shape)
    check_grid(path, samples.spacing, samples.origin)
    if spacing is None and samples.spacing is None:
        text = f"{path}: spacing: expected in the file or as an argument, got none; 1 is used [I07]"
        warnings.warn(text, UserWarning, stacklevel=2)
    return _field(path, samples, spacing, origin)


_SURFACES = (".vtu", ".vtp", ".ply", ".obj", ".off", ".stl")


def _suffix(path: Path) -> str:
    name = path.name.lower()
    suffix = ".cube.gz" if name.endswith(".cube.gz") else path.suffix.lower()
    if suffix in _READERS:
        return suffix
    guess = guess_suffix(path)
    looks = f", whose content looks like {guess}" if guess else ""
    remedy = "rename it" if guess in _READERS else "convert it to one of these"
    if suffix in _SURFACES:
        remedy = "that is a surface: fields are compared, two surfaces as docs/dimples.md shows"
    raise FileError(
        "F04",
        f"{path}: expected a suffix among {', '.join(_READERS)}, got {suffix!r}{looks}; {remedy}",
    )


def _field(
    path: Path, samples: Samples, spacing: ArrayLike | None, origin: ArrayLike | None
) -> ScalarField:
    def first(given: ArrayLike | None, stated: ArrayLike | None, default: ArrayLike) -> ArrayLike:
        return given if given is not None else stated if stated is not None else default

    try:
        return ScalarField(
            samples.values,
            first(spacing, samples.spacing, np.ones(3)),  # type: ignore[arg-type]
            first(origin, samples.origin, np.zeros(3)),  # type: ignore[arg-type]
            samples.name,
        )
    except FieldError as error:
        raise FieldError(error.code, f"{path}: {error.message}") from None
