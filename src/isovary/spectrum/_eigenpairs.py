"""Laplacian, count -> Eigenpairs: which solver, and what every result must fulfil."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..errors import ArgumentError, SpectrumError
from ..geometry import Floats
from ..records import Eigenpairs, Laplacian
from ._accuracy import UNIT, first_gap, signature_error
from ._lanczos import lanczos
from ._memory import check_memory
from ._threads import each, one_blas_thread, pieces
from ._warm import warm

if TYPE_CHECKING:
    from scipy.sparse import csr_array

_DENSE_SIZE, _DENSE_RATIO = 1000, 4  # so small, or so few unknowns a pair: LAPACK is as fast
_SMALLEST_TOLERANCE, _LARGEST_TOLERANCE = 1e-12, 1e-5
_RESIDUAL_LIMIT = 1e-3
_ORTHONORMALITY_LIMIT = 1e-9
_CONSTANT = 1e-8  # relative: rounding of the stiffness of a constant
_ZERO = 1e-9  # relative: rounding of a zero eigenvalue


def eigenpairs(
    laplacian: Laplacian,
    count: int = 300,
    *,
    start: Eigenpairs | None = None,
    tolerance: float = 1e-9,
    tolerance_of_change: float = 2e-4,
) -> Eigenpairs:
    """The smallest eigenpairs of stiffness phi = lambda mass phi, counted so that none is missing.

    Small problems are solved by LAPACK; larger ones by block shift-invert Lanczos with
    the shift in the middle of the wanted spectrum or, from the pairs of a similar
    Laplacian on the same nodes, by filtered subspace iteration. Sylvester's law of
    inertia (the signs of the pivots of stiffness - s mass) proves that the number of
    eigenvalues below s, behind the last pair, is the number found. The same input gives
    the same bits, on any number of threads.

    Parameters
    ----------
    laplacian : Laplacian
    count : int
        Number of pairs, the constant included. If it cuts a repeated eigenvalue, the
        other copies are added; there may be a few more where neighbours nearly coincide.
    start : Eigenpairs, optional
        Pairs of a similar Laplacian on the same nodes, such as those of the base for a
        carried surface, at least 4 and better 10 % more than ``count``. If they are too
        few or too far away, they are not used; ``solver`` of the result tells.
    tolerance : float
        Largest relative error of the heat kernel signature that may be expected (mean
        over the surface; 1e-12 to 1e-5). Eigenvectors near the last are less accurate,
        those far below it more.
    tolerance_of_change : float
        With a start, an error that is so much smaller than the signature's change since
        the start (root mean square) is small enough, too.

    Returns
    -------
    Eigenpairs
        Units are those of the laplacian: it is solved at unit area.

    Raises
    ------
    ArgumentError
        M09 if the laplacian has fewer than count + 2 unknowns, A02 for a tolerance out
        of bounds or what is not finite, A03 for a start on other nodes, or what is no
        Laplacian.
    SpectrumError
        S01 if eigenvalues stay missing, S02 if residuals or mass-orthonormality are off,
        S05 if zero eigenvalues and components that carry a constant differ in number, S06
        if the smallest eigenvalue is negative.
    RunError
        W08 if the work needs more memory than is free.

    Notes
    -----
    Cost for 300 pairs on two cores: 1.5 s for 10 000 unknowns, 7 s and 0.7 GB for 50 000,
    30 s and 3 GB for 200 000; from a start a quarter to a half less.

    References
    ----------
    Thesis, section 4.1.3; B. N. Parlett, *The Symmetric Eigenvalue Problem*, chapters 3
    (inertia) and 13 (Lanczos); R. G. Grimes, J. G. Lewis, H. D. Simon, *A shifted block
    Lanczos algorithm*, SIAM J. Matrix Anal. Appl. 15 (1994); Y. Zhou, Y. Saad et al.,
    *Chebyshev-filtered subspace iteration*, J. Comput. Phys. 219 (2006).

    Examples
    --------
    On the unit sphere the eigenvalues are l (l + 1), each 2 l + 1 times:

    >>> from isovary.laplacian import fem
    >>> from isovary.shapes import icosphere
    >>> eigenpairs(fem(icosphere(3)), 9).values.round(2).tolist()
    [0.0, 2.0, 2.0, 2.0, 6.0, 6.0, 6.0, 6.0, 6.0]
    """
    _check(laplacian, count, start, tolerance, tolerance_of_change)
    area = laplacian.area
    stiffness, mass = laplacian.stiffness, laplacian.mass / area
    check_memory(mass.shape[0], stiffness.nnz, count)
    with one_blas_thread():
        solver, (values, vectors) = _solve(
            stiffness,
            mass,
            count,
            _at_unknowns(laplacian, start),
            (tolerance, tolerance_of_change),
        )
        values, residuals = _checked(stiffness, mass, values, vectors)
    order = np.argsort(values, kind="stable")
    if (np.diff(order) < 0).any():  # rounding turned two copies round
        values, vectors, residuals = values[order], vectors[:, order], residuals[order]
    values = _clamp(values)
    _check_zeros(stiffness, values)
    vectors = _at_nodes(laplacian, vectors / np.sqrt(area))
    return Eigenpairs(values / area, vectors, residuals, area, solver)


def _check(
    laplacian: Laplacian,
    count: int,
    start: Eigenpairs | None,
    tolerance: float,
    tolerance_of_change: float,
) -> None:
    if not isinstance(laplacian, Laplacian):
        raise ArgumentError(
            "A03",
            f"laplacian: expected a Laplacian, got {type(laplacian).__name__}; fem(surface) makes "
            "one",
        )
    size = laplacian.mass.shape[0]
    if not 1 <= count <= size - 2:
        raise ArgumentError(
            "M09",
            f"count: expected 1 to {max(size - 2, 0)} eigenpairs for {size} unknowns, got {count}; "
            "use a finer mesh or fewer pairs",
        )
    for name, value, most in (
        ("tolerance", tolerance, _LARGEST_TOLERANCE),
        ("tolerance_of_change", tolerance_of_change, 1.0),
    ):
        if not _SMALLEST_TOLERANCE <= value <= most:
            raise ArgumentError(
                "A02", f"{name}: expected {_SMALLEST_TOLERANCE:g} to {most:g}, got {value:g}"
            )
    finite = all(np.isfinite(m.data).all() for m in (laplacian.stiffness, laplacian.mass))
    if not (finite and laplacian.area > 0):
        raise ArgumentError(
            "A02",
            "laplacian: expected finite matrices and an area above 0, got others; the mesh may "
            "hold degenerate triangles",
        )
    if start is not None and not np.isfinite(start.vectors).all():
        raise ArgumentError("A02", "start: expected finite eigenvectors, got NaN or infinity")
    if start is not None and len(start.vectors) != laplacian.nodes:
        raise ArgumentError(
            "A03",
            f"start: expected eigenvectors on {laplacian.nodes} nodes, got {len(start.vectors)}; "
            "a start must belong to the same nodes",
        )


def _at_nodes(laplacian: Laplacian, vectors: Floats) -> Floats:
    """Vectors on all nodes from those on the unknowns: 0 at the fixed ones."""
    if laplacian.nodes == len(vectors):
        return vectors
    whole = np.zeros((laplacian.nodes, vectors.shape[1]))
    whole[laplacian.unknowns] = vectors
    return whole


def _at_unknowns(laplacian: Laplacian, start: Eigenpairs | None) -> Eigenpairs | None:
    """A start without the rows of the fixed nodes."""
    if start is None or laplacian.nodes == len(laplacian.unknowns):
        return start
    return replace(start, vectors=start.vectors[laplacian.unknowns])


def _solve(
    stiffness: csr_array,
    mass: csr_array,
    count: int,
    start: Eigenpairs | None,
    tolerances: tuple[float, float],
) -> tuple[str, tuple[Floats, Floats]]:
    """The solver's name and its pairs."""
    size = mass.shape[0]
    if size <= max(_DENSE_SIZE, _DENSE_RATIO * count):
        return "dense", _dense(stiffness, mass, count)
    if start is None:
        return "Lanczos", lanczos(stiffness, mass, count, tolerances[0])
    found = warm(stiffness, mass, start, count, tolerances)
    if found is None:
        return "Lanczos (start too far away)", lanczos(stiffness, mass, count, tolerances[0])
    return "from start", found


def _dense(stiffness: csr_array, mass: csr_array, count: int) -> tuple[Floats, Floats]:
    """LAPACK's pairs, and the copies of the last one."""
    from scipy.linalg import eigh

    size, more = mass.shape[0], count
    dense = stiffness.toarray(), mass.toarray()
    while True:
        more = min(4 * more - 3 * count + 8, size)
        values, vectors = eigh(*dense, subset_by_index=(0, more - 1), driver="gvx")
        whole = first_gap(values, np.zeros(more), count)
        if whole or more == size:
            return values[: whole or size], vectors[:, : whole or size]


def _clamp(values: Floats) -> Floats:
    """Values within rounding of zero become zero; a truly negative one is an error."""
    rounding = _ZERO * max(values[-1], UNIT)
    if values[0] < -rounding:
        raise SpectrumError(
            "S06",
            f"eigenvalues: expected none below zero, got {values[0]:.3g} (at unit area); the "
            "stiffness matrix is not positive semidefinite",
        )
    return np.where(np.abs(values) < rounding, 0.0, values)


def _check_zeros(stiffness: csr_array, values: Floats) -> None:
    """Each component on which the stiffness of a constant vanishes has one zero, no others."""
    from scipy.sparse.csgraph import connected_components

    count, labels = connected_components(stiffness, directed=False)
    scale = np.bincount(labels, stiffness.diagonal(), count)
    defect = np.bincount(labels, np.abs(stiffness.sum(axis=1)), count)
    expected = min(int((defect <= _CONSTANT * scale).sum()), len(values))
    zeros = int((values == 0).sum())
    if zeros != expected:
        raise SpectrumError(
            "S05",
            f"eigenvalues: expected a zero for each of {expected} components, got {zeros}; the "
            "mesh may hold degenerate triangles, or parts that are nearly separate",
        )


def _checked(
    stiffness: csr_array, mass: csr_array, values: Floats, vectors: Floats
) -> tuple[Floats, Floats]:
    """Rayleigh quotients, and residuals relative to the last; both promises are checked."""
    diagonal, parts = mass.diagonal(), pieces(len(vectors))

    def work(rows: slice) -> tuple[Floats, Floats, Floats]:
        part = vectors[rows]
        image, force = mass[rows] @ vectors, stiffness[rows] @ vectors
        energies = np.einsum("nk,nk->k", part, force)
        force -= image * values
        return energies, (force**2 / diagonal[rows, None]).sum(axis=0), part.T @ image

    energies, squares, products = (sum(p) for p in zip(*each(work, parts), strict=True))
    residuals: Floats = np.sqrt(squares) / max(values[-1], UNIT)
    weighted = signature_error(values, residuals)
    if not weighted <= _RESIDUAL_LIMIT:
        raise SpectrumError(
            "S02",
            f"residuals: expected at most {_RESIDUAL_LIMIT:g} where they count in the signature, "
            f"got {weighted:.3g}; the mesh may hold degenerate triangles",
        )
    off = np.abs(products - np.eye(len(values))).max()
    if not off <= _ORTHONORMALITY_LIMIT:
        raise SpectrumError(
            "S02",
            f"eigenvectors: expected mass-orthonormal ones, got inner products off by {off:.3g}; "
            "the mesh may hold degenerate triangles",
        )
    return energies / products.diagonal(), residuals
