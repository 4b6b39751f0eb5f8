"""Subspace iteration from the eigenvectors of a similar problem on the same nodes."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..geometry import Floats
from ..records import Eigenpairs
from ._accuracy import UNIT, signature, signature_error, times_resolved
from ._factorization import Factorization, count_below, factorize, signed_factor
from ._threads import RowPieces, each, in_pieces, pieces, projections, rotate, scattered

if TYPE_CHECKING:
    from scipy.sparse import csr_array

_DEGREE = 3  # of the filter: more would leave the columns nearly parallel
_ROUGH = 1e-2  # tolerance of the change for which one degree less is enough
_ROUNDS = 3
_NEARLY = 2.5  # an error so many times too large needs one degree less
_COLUMNS = 80  # vectors filtered by one thread, at least
_SAMPLES = 40  # vectors whose error is estimated
_FEWEST_MORE = 4  # pairs that the start must hold beyond the wanted ones
_WIDE = UNIT / 5  # a gap behind which to count
_AROUND = 16  # pairs before it that are looked at to find it
_SAFETY = 3.0  # the eigenvalues' errors are known to that factor
_FAR = 0.3  # a signature that changes by more has another shape
_PROGRESS = 0.3  # a round that leaves more than this part of the error is too slow


@dataclass(frozen=True, eq=False)
class _Problem:
    """Unit area, everything in the elimination order of stiffness + shift mass."""

    stiffness: RowPieces
    mass: RowPieces
    shift: float
    factor: Factorization

    def inverse(self, vectors: Floats) -> Floats:
        """(stiffness + shift mass)^-1 mass vectors, on one thread."""
        return self.factor.overwrite(self.mass.matrix @ vectors)


def warm(
    stiffness: csr_array,
    mass: csr_array,
    start: Eigenpairs,
    count: int,
    tolerances: tuple[float, float],
) -> tuple[Floats, Floats] | None:
    """``count`` certified pairs near those of ``start``; None if these are too far or too few.

    The start's vectors are filtered by a Chebyshev polynomial of
    (stiffness + shift mass)^-1 mass that is small on all eigenvalues behind the start's
    last one, then rotated to Ritz vectors, until the error of the heat kernel signature
    is below the first of ``tolerances``, or below the second times its change since the start.
    """
    values, vectors = start.values * start.area, start.vectors
    if len(values) < count + _FEWEST_MORE:
        return None
    try:
        whole, behind = _clear_gap(_moved(stiffness, mass, values, vectors, count), count)
    except np.linalg.LinAlgError:  # the start's vectors are parallel
        return None
    with ThreadPoolExecutor(1) as aside:  # beside the other factorization
        counted = aside.submit(count_below, stiffness, mass, behind)
        problem = _shifted(stiffness, mass, max(values[count - 1] / 12, UNIT))
        found = _refined(problem, start, whole, tolerances)
    if found is None:
        return None
    values, ordered, errors = found
    near = values[: len(errors)]
    sure = (np.abs(near - behind) > _SAFETY * errors).all()
    if not (sure and whole == (near < behind).sum() == counted.result()):
        return None
    return values[:whole], scattered(ordered[:, :whole], problem.factor.order)


def _refined(
    problem: _Problem, start: Eigenpairs, count: int, tolerances: tuple[float, float]
) -> tuple[Floats, Floats, Floats] | None:
    """Ritz pairs that are accurate enough, and the errors of their values; or None."""
    values, vectors = start.values * start.area, start.vectors[problem.factor.order]
    moments, last, before = times_resolved(values[:count]), values[-1], 1.0
    begun = start.area * signature(values[:count], vectors[:, :count], moments)
    degree = _DEGREE - (tolerances[1] >= _ROUGH)
    for _ in range(_ROUNDS):
        try:
            _filter(problem, vectors, last, degree)
            values = _rayleigh_ritz(problem, vectors)
        except np.linalg.LinAlgError:  # the filter left the vectors parallel
            return None
        directions, errors = _errors(problem, values, vectors, _reach(values, count))
        error = signature_error(values[:count], directions[:count])
        now = signature(values[:count], vectors[:, :count], moments)
        change = float((np.sqrt(((now - begun) ** 2).mean(axis=0)) / begun.mean(axis=0)).max())
        if change > _FAR:
            return None
        enough = max(tolerances[0], tolerances[1] * change)
        if error <= enough:
            return values, vectors, errors
        if error > _PROGRESS * before:
            return None
        before, degree = error, _DEGREE if error > _NEARLY * enough else _DEGREE - 1
    return None


def _shifted(stiffness: csr_array, mass: csr_array, shift: float) -> _Problem:
    factor = factorize(signed_factor(stiffness + shift * mass)[0])
    order = factor.order
    stiffness, mass = stiffness[order][:, order], mass[order][:, order]
    return _Problem(in_pieces(stiffness), in_pieces(mass), shift, factor)


def _filter(problem: _Problem, vectors: Floats, last: float, degree: int) -> None:
    """Put Chebyshev's polynomial of the inverse, small above ``last``, times vectors in place."""
    edge = 1 / (last + problem.shift)

    def work(columns: slice) -> None:
        before = np.ascontiguousarray(vectors[:, columns])
        now = problem.inverse(before)
        now *= 2 / edge
        now -= before
        for _ in range(degree - 1):  # T_(j+1)(x) = 2 x T_j(x) - T_(j-1)(x)
            new = problem.inverse(now)
            new *= 4 / edge
            new -= now
            new -= now
            new -= before
            before, now = now, new
        vectors[:, columns] = now

    each(work, pieces(vectors.shape[1], _COLUMNS))


def _rayleigh_ritz(problem: _Problem, vectors: Floats) -> Floats:
    """Put the best pairs in the span of vectors in their place; the result is their values.

    They are scaled first: the filter spreads their lengths.
    """
    from scipy.linalg import eigh

    stiffness, mass = projections(vectors, problem.stiffness, problem.mass)
    scale = 1 / np.sqrt(mass.diagonal())
    both = np.outer(scale, scale)
    values, modes = eigh(stiffness * both, mass * both)
    rotate(vectors, scale[:, None] * modes)
    result: Floats = values
    return result


def _errors(
    problem: _Problem, values: Floats, vectors: Floats, reach: int
) -> tuple[Floats, Floats]:
    """Errors of the first vectors and values, from the step of one more inverse iteration.

    The step s is taken for some pairs; the errors are interpolated. A component of a pair
    behind the last one moves by the part m = (lambda_last - lambda) / (lambda_last + shift)
    at least, so the vector errs by |s| / m, the value by s^T (stiffness - lambda mass) s / m^2.
    """
    some = np.unique(np.linspace(0, reach - 1, _SAMPLES).astype(int))
    old = np.ascontiguousarray(vectors[:, some])
    steps = problem.inverse(old) * (values[some] + problem.shift) - old
    squares = np.einsum("nk,nk->k", steps, problem.mass @ steps)
    energies = np.einsum("nk,nk->k", steps, problem.stiffness @ steps)
    moved = (values[-1] - values[some]) / (values[-1] + problem.shift)
    both = np.sqrt(squares) / moved, np.abs(energies - values[some] * squares) / moved**2
    floor, every = np.finfo(float).tiny, np.arange(reach)
    directions, errors = (np.exp(np.interp(every, some, np.log(e + floor))) for e in both)
    return directions, errors


def _reach(values: Floats, count: int) -> int:
    """Half of the pairs behind the wanted ones serve to find a gap: those at the end are rough."""
    return (count + len(values)) // 2


def _moved(
    stiffness: csr_array, mass: csr_array, values: Floats, vectors: Floats, count: int
) -> Floats:
    """The start's eigenvalues, those around the last wanted one moved to the new problem."""
    from scipy.linalg import eigh

    around = slice(max(count - _AROUND, 0), None)
    some = np.ascontiguousarray(vectors[:, around])
    there = eigh(some.T @ (stiffness @ some), some.T @ (mass @ some), eigvals_only=True)
    return np.concatenate([values[: around.start], there])


def _clear_gap(values: Floats, count: int) -> tuple[int, float]:
    """Pairs before the first wide gap behind ``count`` of them, or the widest; and its middle."""
    gaps = np.diff(values[count - 1 : _reach(values, count)])
    first = int(np.argmax(gaps > _WIDE) if gaps.max() > _WIDE else np.argmax(gaps))
    below = count + first
    return below, float(values[below - 1] + values[below]) / 2
