"""Potentials of atoms, sampled on a grid: their isosurfaces are the atoms' shapes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from .errors import ArgumentError
from .geometry import Floats
from .scalar_field import ScalarField

_LOWEST = float(np.exp(-5))  # of the sum of strengths: the isovalue the default box allows for
_SAMPLES = 4  # per decay length
_MOST = 256**3  # samples that nobody asked for


def born_mayer(
    atoms: ArrayLike,
    *,
    strength: ArrayLike,
    decay: ArrayLike,
    isovalue: float | None = None,
    bounds: tuple[ArrayLike, ArrayLike] | None = None,
    shape: tuple[int, int, int] | None = None,
) -> ScalarField:
    r"""Born-Mayer potential of atoms: the repulsion of their closed electron shells.

    .. math:: V(x) = \sum_k A_k \exp(-B_k \lVert x - p_k \rVert)

    The isosurface of one atom at isovalue v is the sphere of radius ``ln(A / v) / B``. Those of
    two equal atoms at distance d are one below ``2 A exp(-B d / 2)``, their value midway, and
    two above. For equal atoms ``-ln(V / A) / B`` is nearly the distance to the nearest one, less
    where several are near; hence the field interpolates log V.

    The default box holds the isosurface: around each of the k atoms a ball of radius
    ``(ln(k A / isovalue) + 1) / B``, outside of which it adds at most the k-th part of
    isovalue / e. The default samples are at most a quarter of the shortest decay length,
    ``1 / max B``, apart; an isovalue above those at the samples next to the atoms finds nothing.

    Parameters
    ----------
    atoms : array (k, 3)
        Positions p; length.
    strength : float or array (k,)
        A, of all atoms or of each: its potential at its centre; energy.
    decay : float or array (k,)
        B, of all atoms or of each; 1 / length. Over the decay length 1 / B (often called rho)
        the potential falls by the factor e.
    isovalue : float
        The lowest isovalue meant, to choose the box; energy. Default: exp(-5) = 0.0067 of the
        sum of strengths. Not together with ``bounds``.
    bounds : (low, high)
        Opposite corners of the box, each (3,), as in :meth:`ScalarField.from_function`; it may
        cut the isosurface. Fields to be blended need the same box and shape.
    shape : (nx, ny, nz)
        Number of samples along each axis, both ends included.

    Returns
    -------
    ScalarField
        Logarithmic; positions in the unit of length of ``atoms``, values in that of ``strength``.

    Raises
    ------
    ArgumentError
        A03 for wrong shapes or fewer than four samples along an axis; A02 for numbers that are
        not finite, strengths or decays that are not positive, an isovalue not between 0 and the
        sum of strengths or beside bounds, corners in the wrong order, a box so far from the atoms
        that V underflows, and more than 256^3 samples that no shape asked for.

    Notes
    -----
    At each atom V has a cusp, which no spline follows: the tip is cut off, and what that leaves
    around it falls by the factor 3.7 with each cell. Ten cells from an atom, where V is
    exp(-2.5) A with the default samples, an isosurface is out of place by the spline's error
    alone, for samples h apart about ``h^4 / (64 r^3)`` at the distance r from one atom and
    ``B^3 h^4 / 192`` between two equal ones.

    Cost: about 5 ns for each sample and atom, beside that of the :class:`ScalarField`.

    References
    ----------
    The thesis's section 5.3. M. Born, J. E. Mayer, *Zur Gittertheorie der Ionenkristalle*,
    Z. Phys. 75 (1932) 1-18.

    Examples
    --------
    Two atoms at distance 2: midway, 1 from both, the potential is 2 exp(-1):

    >>> field = born_mayer([[-1, 0, 0], [1, 0, 0]], strength=1.0, decay=1.0)
    >>> float(round(field.value([0, 0, 0]) / (2 * np.exp(-1)), 4))
    1.0
    """
    places = _places(atoms)
    strengths = _of_each("strength", strength, len(places))
    decays = _of_each("decay", decay, len(places))
    if bounds is None:
        low, high = _box_around(places, strengths, decays, isovalue)
    elif isovalue is None:
        low, high = _corners(bounds)
    else:
        raise ArgumentError(
            "A02", "isovalue: expected None beside bounds, which are the box; leave out one of them"
        )
    counts = _default_shape(high - low, decays) if shape is None else _counts(shape)
    axes = [np.linspace(low[a], high[a], counts[a]) for a in range(3)]
    values = _sampled(axes, places, strengths, decays)
    spacing = (high - low) / (np.array(counts) - 1)
    return ScalarField(values, spacing, low, "Born-Mayer potential", logarithmic=True)


def _sampled(axes: Sequence[Floats], places: Floats, strengths: Floats, decays: Floats) -> Floats:
    """Values (nx, ny, nz) on the grid of the axes; raise where all exponentials underflow."""
    x, y, z = np.meshgrid(*axes, indexing="ij", sparse=True)
    total = np.zeros([len(axis) for axis in axes])
    for (px, py, pz), strength, decay in zip(places, strengths, decays, strict=True):
        distance = np.sqrt((x - px) ** 2 + (y - py) ** 2 + (z - pz) ** 2)
        total += strength * np.exp(-decay * distance)
    if total.min() < np.finfo(float).tiny:
        raise ArgumentError(
            "A02",
            "bounds: expected a box near the atoms, got one where the potential underflows, about "
            "700 decay lengths from all of them; choose a smaller box or check the units",
        )
    return total


def _numbers(name: str, values: object) -> Floats:
    """An array of numbers; ArgumentError A03 for what is none."""
    try:
        return np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise ArgumentError("A03", f"{name}: expected numbers, got {values!r}") from None


def _places(atoms: ArrayLike) -> Floats:
    places = _numbers("atoms", atoms)
    if places.ndim != 2 or places.shape[1] != 3 or len(places) == 0:
        raise ArgumentError(
            "A03", f"atoms: expected positions (k, 3) of at least one atom, got {places.shape}"
        )
    if not np.isfinite(places).all():
        wrong = np.flatnonzero(~np.isfinite(places).all(axis=1)).tolist()
        raise ArgumentError("A02", f"atoms: expected finite positions, got others at rows {wrong}")
    return places


def _of_each(name: str, values: ArrayLike, count: int) -> Floats:
    """One positive number of each atom."""
    found = _numbers(name, values)
    if found.shape not in ((), (count,)):
        raise ArgumentError(
            "A03", f"{name}: expected one number or {count}, one per atom, got shape {found.shape}"
        )
    if not (np.isfinite(found) & (found > 0)).all():
        raise ArgumentError(
            "A02",
            f"{name}: expected positive and finite, got {found.tolist()}; leave out atoms that "
            "repel nothing",
        )
    return np.broadcast_to(found, count)


def _box_around(
    places: Floats, strengths: Floats, decays: Floats, isovalue: float | None
) -> tuple[Floats, Floats]:
    """The default box; on its faces the potential is at most the isovalue over e."""
    total = float(strengths.sum())
    lowest = _LOWEST * total if isovalue is None else isovalue
    if not 0 < lowest < total:
        why = "nowhere above" if lowest >= total else "positive everywhere"
        raise ArgumentError(
            "A02",
            f"isovalue: expected between 0 and {total:.6g}, the sum of strengths, got {lowest}"
            + ("" if lowest != lowest else f"; the potential is {why}"),
        )
    radii = (np.log(len(places) * strengths / lowest) + 1) / decays
    reach = np.maximum(radii, 1 / decays)[:, None]
    return (places - reach).min(axis=0), (places + reach).max(axis=0)


def _corners(bounds: tuple[ArrayLike, ArrayLike]) -> tuple[Floats, Floats]:
    corners = _numbers("bounds", bounds)
    if corners.shape != (2, 3):
        raise ArgumentError(
            "A03", f"bounds: expected two corners of three numbers, got shape {corners.shape}"
        )
    low, high = corners
    if not np.isfinite(corners).all():
        raise ArgumentError(
            "A02", f"bounds: expected finite corners (low, high), got {corners.tolist()}"
        )
    if not (low < high).all():
        raise ArgumentError(
            "A02",
            f"bounds: expected low below high along every axis, got {corners.tolist()}; swap them "
            "where they are in the other order",
        )
    return low, high


def _counts(shape: tuple[int, int, int]) -> tuple[int, int, int]:
    counts = np.asarray(shape)
    if counts.shape != (3,) or counts.dtype.kind not in "iu" or counts.min() < 4:
        raise ArgumentError(
            "A03", f"shape: expected three whole numbers of at least 4, got {counts.tolist()}"
        )
    nx, ny, nz = counts.tolist()
    return nx, ny, nz


def _default_shape(size: Floats, decays: Floats) -> tuple[int, int, int]:
    """Numbers of samples a quarter of the shortest decay length apart, or less, in a box."""
    cells = np.maximum(np.ceil(_SAMPLES * decays.max() * size), 3)
    if np.prod(cells + 1) > _MOST:
        count = " x ".join(f"{n:.0f}" for n in cells + 1)
        raise ArgumentError(
            "A02",
            f"shape: expected to be given for this box, got None, which means {count} samples, "
            f"{_SAMPLES} per decay length; choose a shape, or a smaller box by bounds or isovalue",
        )
    nx, ny, nz = (cells.astype(int) + 1).tolist()
    return nx, ny, nz
