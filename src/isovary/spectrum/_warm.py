"""Subspace iteration from the eigenvectors of a similar problem on the same nodes."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..geometry import Floats
from ._accuracy import UNIT, signature, signature_error, times_resolved
from ._factorization import Factorization, count_below, factorize, signed_factor
from ._threads import RowPieces, each, gram, in_pieces, pieces, scattered, times

if TYPE_CHECKING:
    from scipy.sparse import csr_array

_DEGREE = 3  # of the filter: more would leave the columns nearly parallel
_ROUNDS = 3
_NEARLY = 8.0  # an error so many times too large needs one degree less
_COLUMNS = 80  # vectors filtered by one thread, at least
_SAMPLES = 40  # vectors whose error is estimated
_FEWEST_MORE = 4  # pairs that the start must hold beyond the wanted ones
_WIDE = UNIT / 2  # a gap behind which to count
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
    start: tuple[Floats, Floats],
    count: int,
    tolerances: tuple[float, float],
) -> tuple[Floats, Floats] | None:
    """``count`` certified pairs near those of ``start``; None if these are too far or too few.

    The start's vectors are filtered by a Chebyshev polynomial of
    (stiffness + shift mass)^-1 mass that is small on all eigenvalues behind the start's
    last one, then rotated to Ritz vectors, until the error of the heat kernel signature
    is below the first of ``tolerances``, or below the second times its change since the start.
    """
    values, vectors = start
    if len(values) < count + _FEWEST_MORE:
        return None
    behind = _clear_gap(values, count)
    whole = int((values < behind).sum())
    with ThreadPoolExecutor(1) as aside:  # beside the other factorization
        counted = aside.submit(count_below, stiffness, mass, behind)
        problem = _shifted(stiffness, mass, max(values[count - 1] / 12, UNIT))
        found = _refined(problem, values, vectors, whole, tolerances)
    if found is None:
        return None
    values, ordered, errors = found
    near = values[: len(errors)]
    sure = (np.abs(near - behind) > _SAFETY * errors).all()
    if not (sure and whole == (near < behind).sum() == counted.result()):
        return None
    return values[:whole], scattered(ordered[:, :whole], problem.factor.order)


def _refined(
    problem: _Problem,
    values: Floats,
    vectors: Floats,
    count: int,
    tolerances: tuple[float, float],
) -> tuple[Floats, Floats, Floats] | None:
    """Ritz pairs that are accurate enough, and the errors of their values; or None."""
    moments, last, before, degree = times_resolved(values[:count]), values[-1], 1.0, _DEGREE
    begun = signature(values[:count], vectors[:, :count], moments)[problem.factor.order]
    vectors = vectors[problem.factor.order]
    for _ in range(_ROUNDS):
        try:
            values, vectors = _rayleigh_ritz(problem, _filter(problem, vectors, last, degree))
        except np.linalg.LinAlgError:  # the filter left the vectors parallel
            return None
        directions, errors = _errors(problem, values, vectors, _reach(values, count))
        error = signature_error(values[:count], directions[:count])
        now = signature(values[:count], vectors[:, :count], moments)
        change = float((np.sqrt(((now - begun) ** 2).mean(axis=0)) / begun.mean(axis=0)).max())
        if error > _PROGRESS * before or change > _FAR:
            return None
        enough = max(tolerances[0], tolerances[1] * change)
        if error <= enough:
            return values, vectors, errors
        before, degree = error, _DEGREE if error > _NEARLY * enough else _DEGREE - 1
    return None


def _shifted(stiffness: csr_array, mass: csr_array, shift: float) -> _Problem:
    factor = factorize(signed_factor(stiffness + shift * mass)[0])
    order = factor.order
    stiffness, mass = stiffness[order][:, order], mass[order][:, order]
    return _Problem(in_pieces(stiffness), in_pieces(mass), shift, factor)


def _filter(problem: _Problem, vectors: Floats, last: float, degree: int) -> Floats:
    """Chebyshev's polynomial of the inverse, at most 1 for eigenvalues above ``last``."""
    edge = 1 / (last + problem.shift)
    result = np.empty_like(vectors)

    def work(columns: slice) -> None:
        before = np.ascontiguousarray(vectors[:, columns])
        now = problem.inverse(before)
        now *= 2 / edge
        now -= before
        for _ in range(degree - 1):  # T_(j+1)(x) = 2 x T_j(x) - T_(j-1)(x)
            new = problem.inverse(now)
            new *= 4 / edge
            new -= 2 * now
            new -= before
            before, now = now, new
        result[:, columns] = now

    each(work, pieces(vectors.shape[1], _COLUMNS))
    return result


def _rayleigh_ritz(problem: _Problem, vectors: Floats) -> tuple[Floats, Floats]:
    """The best pairs in the span of vectors, which are scaled first: the filter spreads them."""
    from scipy.linalg import eigh

    image = problem.mass @ vectors
    scale = 1 / np.sqrt(np.einsum("nk,nk->k", vectors, image))
    both = np.outer(scale, scale)
    stiffness, mass = gram(vectors, problem.stiffness @ vectors) * both, gram(vectors, image) * both
    values, modes = eigh(stiffness, mass)
    return values, times(vectors, scale[:, None] * modes)


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


def _clear_gap(values: Floats, count: int) -> float:
    """The middle of the first wide gap behind ``count`` eigenvalues, or else of the widest."""
    gaps = np.diff(values[count - 1 : _reach(values, count)])
    below = count - 1 + int(np.argmax(gaps > _WIDE) if gaps.max() > _WIDE else np.argmax(gaps))
    return float(values[below] + values[below + 1]) / 2
