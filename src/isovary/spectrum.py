"""The eigensolve: Laplacian, count -> Eigenpairs (thesis 4.1.3)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .errors import ArgumentError, SpectrumError
from .geometry import Floats
from .records import Eigenpairs, Laplacian

if TYPE_CHECKING:
    from scipy.sparse import csr_array
    from scipy.sparse.linalg import SuperLU

_DENSE_SIZE, _DENSE_RATIO = 1000, 4  # so small, or so few unknowns a pair: LAPACK is as fast
_UNIT = 4 * np.pi  # mean spacing of eigenvalues at unit area (Weyl): their natural unit
_START_SEED = 20130808
_SMALLEST_GAP = 1e-7  # relative: below it, two eigenvalues are one to the solver
_BLOCK, _WIDEST = 16, 128  # columns of the first and the last start's block
_LANCZOS_TOLERANCE = 1e-8
_RANK_TOLERANCE, _WEAK = 1e-11, 1e-6  # relative: below, a direction is rounding; or partly so
_RESIDUAL_LIMIT = 1e-6


def eigenpairs(laplacian: Laplacian, count: int = 300) -> Eigenpairs:
    """The smallest eigenpairs of stiffness phi = lambda mass phi, counted so that none is missing.

    Block shift-invert Lanczos on the operator scaled to unit area, from a fixed start
    vector: the same input gives the same pairs. Sylvester's law of inertia
    (signs of the pivots of stiffness - s mass) then proves that the number of
    eigenvalues below s is the number found; a missed copy of a repeated
    eigenvalue leads to another start with a wider block, then to an error.

    Parameters
    ----------
    laplacian : Laplacian
    count : int
        Number of pairs, the constant included.

    Returns
    -------
    Eigenpairs
        Units are those of the laplacian: the scaling is undone.

    Raises
    ------
    ArgumentError
        M09 if the laplacian has fewer than count + 2 unknowns.
    SpectrumError
        S01 if eigenvalues stay missing, S02 if a residual is too large.

    Notes
    -----
    Cost for 300 pairs on two cores: 0.6 s for 2 000 unknowns, 2 s for 10 000.

    References
    ----------
    Thesis, section 4.1.3; B. N. Parlett, *The Symmetric Eigenvalue Problem*, chapter 3
    (inertia) and 13 (Lanczos).

    Examples
    --------
    On the unit sphere the eigenvalues are l (l + 1), each 2 l + 1 times:

    >>> from isovary.laplacian import fem
    >>> from isovary.shapes import icosphere
    >>> eigenpairs(fem(icosphere(3)), 9).values.round(2).tolist()
    [0.0, 2.0, 2.0, 2.0, 6.0, 6.0, 6.0, 6.0, 6.0]
    """
    from threadpoolctl import threadpool_limits

    size = laplacian.mass.shape[0]
    if not 1 <= count <= size - 2:
        raise ArgumentError(
            "M09",
            f"count: expected 1 to {max(size - 2, 0)} eigenpairs for {size} unknowns, got {count}; "
            "use a finer mesh or fewer pairs",
        )
    area = laplacian.area
    mass = laplacian.mass / area
    small = size <= max(_DENSE_SIZE, _DENSE_RATIO * count)
    solve = _dense if small else _certified
    with threadpool_limits(1, user_api="blas"):  # skinny products: more threads only wait
        values, vectors = solve(laplacian.stiffness, mass, count)
    values = _clamp(values)
    residuals = _residuals(laplacian.stiffness, mass, values, vectors)
    if not residuals.max() <= _RESIDUAL_LIMIT:
        raise SpectrumError(
            "S02",
            f"residuals: expected at most {_RESIDUAL_LIMIT:g}, got {residuals.max():.3g} for pair "
            f"{int(residuals.argmax())}; the mesh may hold degenerate triangles",
        )
    return Eigenpairs(values / area, vectors / np.sqrt(area), residuals, area)


def _dense(stiffness: csr_array, mass: csr_array, count: int) -> tuple[Floats, Floats]:
    from scipy.linalg import eigh

    values, vectors = eigh(
        stiffness.toarray(), mass.toarray(), subset_by_index=(0, count - 1), driver="gvx"
    )
    return values, vectors


def _certified(stiffness: csr_array, mass: csr_array, count: int) -> tuple[Floats, Floats]:
    """Lanczos pairs whose number below a gap at or behind the last one agrees with the inertia.

    A few more pairs than wanted are solved for, so that a gap can be found there, and
    four times more where they all belong to one multiplet. A block finds as many copies
    of an eigenvalue as it has columns, so it is doubled when copies are missing.
    """
    extra, width = max(8, count // 20), _BLOCK
    while width <= _WIDEST and extra <= mass.shape[0]:
        found = min(count + extra, mass.shape[0] // 2)
        try:
            values, vectors = _block_lanczos(stiffness, mass, found, width)
        except np.linalg.LinAlgError:  # the block's start spans too little of the mesh
            width *= 2
            continue
        gaps = np.diff(values[count - 1 :])
        last = count + int(np.argmax(gaps))  # pairs up to the gap
        shift = (values[last - 1] + values[last]) / 2
        if gaps.max() < _SMALLEST_GAP * max(values[-1], _UNIT):
            extra *= 4
        elif count_below(stiffness, mass, shift) == last:
            return values[:count], vectors[:, :count]
        else:
            width *= 2
    raise SpectrumError(
        "S01",
        f"eigenvalues: expected {count} that an inertia count confirms, got copies of repeated "
        f"ones missing with blocks of up to {_WIDEST} vectors; ask for another number of pairs, "
        "or compare fewer equal components at a time",
    )


def _block_lanczos(
    stiffness: csr_array, mass: csr_array, count: int, width: int
) -> tuple[Floats, Floats]:
    """Block Lanczos for (stiffness + mass)^-1 mass with full reorthogonalization.

    The basis V is mass-orthonormal and ``projected`` is V^T mass operator V.
    Both are filled block by block until the residual of every wanted Ritz pair,
    |remainder times the last rows of its coefficients|, is below the tolerance.
    """
    size = mass.shape[0]
    factor = _factor(stiffness + mass)  # shift -1 at unit area: positive definite
    limit = min(size - width, 8 * count + 10 * width) // width * width
    basis = np.empty((size, limit), order="F")
    projected = np.zeros((limit, limit))
    start = np.random.default_rng(_START_SEED).standard_normal((size, width))
    block, _, _ = _orthonormalize(start, basis[:, :0], mass)
    check_at = 3 * count
    for used in range(width, limit + 1, width):
        last = slice(used - width, used)
        basis[:, last] = block
        image = factor.solve(np.asfortranarray(mass @ block))
        block, coefficients, remainder = _orthonormalize(image, basis[:, :used], mass)
        projected[:used, last] = coefficients
        if used >= check_at or used == limit:
            ritz, modes = _ritz(projected[:used, :used], count)
            error = np.linalg.norm(remainder @ modes[last], axis=0) / ritz
            if error.max() < _LANCZOS_TOLERANCE:
                return 1 / ritz - 1, basis[:, :used] @ modes
            check_at = used + count // 6
    raise SpectrumError(
        "S02",
        f"Lanczos: expected residuals below {_LANCZOS_TOLERANCE:g} within {limit} vectors, got "
        f"{error.max():.3g}; use a finer mesh or fewer pairs",
    )


def _ritz(projected: Floats, count: int) -> tuple[Floats, Floats]:
    from scipy.linalg import eigh

    size = len(projected)
    whole = np.triu(projected) + np.triu(projected, 1).T
    ritz, modes = eigh(whole, subset_by_index=(size - count, size - 1))
    return ritz[::-1], modes[:, ::-1]


def _orthonormalize(block: Floats, basis: Floats, mass: csr_array) -> tuple[Floats, Floats, Floats]:
    """Split block = basis @ coefficients + unit @ remainder, with unit mass-orthonormal to basis.

    The first projection needs only the last two blocks (three-term recurrence);
    the second goes against the whole basis and removes rounding. Directions of
    which nothing is left, because the basis spans them, are replaced by random
    ones with a remainder of zero: so an invariant subspace is left for new
    copies of the same eigenvalues.
    """
    from scipy.linalg import solve_triangular

    width = block.shape[1]
    scale = np.sqrt(np.einsum("nk,nk->", block, mass @ block))
    coefficients = np.zeros((basis.shape[1], width))
    for columns in (slice(-2 * width, None), slice(None)):
        part = basis[:, columns].T @ (mass @ block)
        block = block - basis[:, columns] @ part
        coefficients[columns] += part
    square, directions = np.linalg.eigh(block.T @ (mass @ block))
    kept = square > (_RANK_TOLERANCE * scale) ** 2
    length = np.where(kept, np.sqrt(np.maximum(square, 0.0)), 0.0)
    unit = block @ directions / np.where(kept, length, 1.0)
    remainder = length[:, None] * directions.T
    if not (length > _WEAK * scale).all():
        rng = np.random.default_rng(_START_SEED + basis.shape[1])
        unit[:, ~kept] = rng.standard_normal((len(block), int((~kept).sum())))
        for _ in range(2):
            unit = unit - basis @ (basis.T @ (mass @ unit))
    lower = np.linalg.cholesky(unit.T @ (mass @ unit))
    unit = solve_triangular(lower, unit.T, lower=True).T
    return unit, coefficients, lower.T @ remainder


def _factor(matrix: csr_array) -> SuperLU:
    from scipy.sparse.linalg import splu

    return splu(
        matrix.tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )


def count_below(stiffness: csr_array, mass: csr_array, shift: float) -> int:
    """Number of eigenvalues of stiffness phi = lambda mass phi below ``shift``.

    By Sylvester's law of inertia it is the number of negative pivots of the
    symmetric factorization of stiffness - shift mass.

    Raises
    ------
    SpectrumError
        S01 if the factorization had to leave the diagonal, so that its signs mean nothing.

    Examples
    --------
    >>> from isovary.laplacian import fem
    >>> from isovary.shapes import icosphere
    >>> sphere = fem(icosphere(2))
    >>> count_below(sphere.stiffness, sphere.mass, 3.0)
    4
    """
    factor = _factor(stiffness - shift * mass)
    if not np.array_equal(factor.perm_r, factor.perm_c):
        raise SpectrumError(
            "S01", f"shift: expected a regular stiffness - {shift:g} mass, got a zero pivot"
        )
    return int((factor.U.diagonal() < 0).sum())


def _clamp(values: Floats) -> Floats:
    """Set values within rounding of zero to zero; a truly negative one is left for the reader."""
    return np.where(np.abs(values) < 1e-10 * max(values[-1], _UNIT), 0.0, values)


def _residuals(stiffness: csr_array, mass: csr_array, values: Floats, vectors: Floats) -> Floats:
    defect = stiffness @ vectors - (mass @ vectors) * values
    norm = np.sqrt((defect**2 / mass.diagonal()[:, None]).sum(axis=0))
    result: Floats = norm / max(values[-1], _UNIT)
    return result


def drop_cut_multiplet(pairs: Eigenpairs) -> Eigenpairs:
    """Leave out the last pairs where the count cuts a multiplet of a symmetric surface.

    300 pairs cut the l = 17 shell of a sphere (17^2 = 289 below, 18^2 = 324
    above), and a part of a shell is no symmetric signature. If the last 15 % of
    the pairs hold a gap of at least eight mean spacings 4 pi / area (Weyl), the
    spectrum is cut there; a generic surface has no such gap and keeps all.

    Returns
    -------
    Eigenpairs
        The given pairs, or fewer.

    Examples
    --------
    40 pairs of a sphere become the 36 of the shells l = 0 to 5:

    >>> from isovary.laplacian import fem
    >>> from isovary.shapes import icosphere
    >>> len(drop_cut_multiplet(eigenpairs(fem(icosphere(3)), 40)).values)
    36
    """
    first = int(0.85 * len(pairs.values))
    gaps = np.diff(pairs.values[first:])
    widest = 8 * 4 * np.pi / pairs.area
    if len(gaps) == 0 or gaps.max() < widest:
        return pairs
    return pairs.truncate(first + int(np.argmax(gaps)) + 1)
