"""Block Lanczos around a shift in the middle of the wanted spectrum."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..errors import SpectrumError
from ..geometry import Floats
from ._accuracy import SMALLEST_GAP, UNIT, first_gap, signature_error
from ._factorization import Factorization, factorize, signed_factor
from ._threads import RowPieces, gram, in_pieces, minus, scattered, times

if TYPE_CHECKING:
    from scipy.sparse import csr_array

_SEED = 20130808
_BLOCK, _WIDEST = 32, 256  # columns of the first and of the last start's block
_FEWEST_IN_THE_MIDDLE = 32  # for fewer pairs a shift below the spectrum does
_BELOW = 0.35, 0.55  # part of the wanted pairs that a shift in the middle leaves below
_TRIES = 6  # shifts
_MOST_BELOW = 0.8  # more than these cost as much as a shift below the spectrum
_BLIND = 3  # blocks between two checks, at most
_RANK_TOLERANCE, _WEAK = 1e-11, 1e-4  # relative: below, a direction is rounding; or partly so
_LEAST_SPACING = 1e-3 * UNIT  # where all the wanted eigenvalues are zero
_UNEVEN = 1e-2  # ratio of a block's lengths below which it is orthonormalized twice


@dataclass(frozen=True, eq=False)
class _Operator:
    """(stiffness - shift mass)^-1 mass; everything in the factor's elimination order."""

    stiffness: csr_array
    mass: csr_array
    shift: float
    below: int  # eigenvalues below the shift
    factor: Factorization

    def count_below(self, shift: float) -> int:
        """Number of eigenvalues below another shift, by inertia."""
        return signed_factor(self.stiffness - shift * self.mass, "NATURAL")[1]


@dataclass(frozen=True, eq=False)
class _Ritz:
    """Approximate pairs in the order of their eigenvalues."""

    values: Floats  # lambda
    ritz: Floats  # 1 / (lambda - shift)
    modes: Floats  # coefficients on the basis
    missed: Floats  # and on the next block: what the basis misses

    @property
    def residuals(self) -> Floats:
        """Length of operator phi - ritz phi."""
        lengths: Floats = np.linalg.norm(self.missed, axis=0)
        return lengths

    @property
    def uncertain(self) -> Floats:
        """Estimate of the eigenvalues' errors, to first order."""
        result: Floats = self.residuals / self.ritz**2
        return result


def lanczos(
    stiffness: csr_array, mass: csr_array, count: int, tolerance: float
) -> tuple[Floats, Floats]:
    """At least ``count`` certified pairs of a large problem of unit area.

    (stiffness - shift mass)^-1 mass has the eigenvalues 1 / (lambda - shift): with the
    shift in the middle of the wanted ones, two thirds of the vectors that a shift at
    zero needs are enough. The number of pairs below the shift is known from the
    inertia of the factorization; that of pairs below a gap behind the last wanted one
    is counted by another. A block finds as many copies of an eigenvalue as it has
    columns at once, so it is doubled when copies are missing.

    Raises
    ------
    SpectrumError
        S01 if copies stay missing, or the vectors do not suffice.
    """
    operator = _middle(stiffness, mass, count)
    width = _BLOCK
    while width <= min(_WIDEST, mass.shape[0] // 2):
        try:
            found = _grow(operator, count, width, tolerance)
        except np.linalg.LinAlgError:  # the block's vectors are parallel
            found = None
        if found is not None:
            return found
        width *= 2
    raise SpectrumError(
        "S01",
        f"eigenvalues: expected {count} that are accurate and that an inertia count confirms, got "
        f"some missing with blocks of up to {_WIDEST} vectors; ask for another number of pairs, or "
        "compare fewer equal components at a time",
    )


def _middle(stiffness: csr_array, mass: csr_array, count: int) -> _Operator:
    """A shift with nearly half of the wanted eigenvalues below it, by inertia.

    The first guess is Weyl's law for surfaces. If a few tries do not find one, the best of
    them is taken; if none leaves any of the wanted ones on both sides (as many zeros as
    pairs), the shift lies below the spectrum.
    """
    low, high = (part * count for part in _BELOW)
    middle = (low + high) / 2
    shift, tried = 0.47 * count * UNIT, list[tuple[float, int]]()
    best = None
    for _ in range(2 * _TRIES if count >= _FEWEST_IN_THE_MIDDLE else 0):
        try:
            raw, below = signed_factor(stiffness - shift * mass)
        except SpectrumError:  # a pivot near zero: another shift has others
            shift *= 1.01
            continue
        if 0 < below <= _MOST_BELOW * count:
            better = best is None or abs(below - middle) < abs(best[2] - middle)
            best = (raw, shift, below) if better else best
        if low <= below <= high:
            break
        tried.append((shift, below))
        if best is not None and len(tried) >= _TRIES:
            break
        shift = _next_shift(tried, middle)
    if best is None:
        best = (signed_factor(stiffness + UNIT * mass)[0], -UNIT, 0)
    factor = factorize(best[0])
    order = factor.order
    return _Operator(stiffness[order][:, order], mass[order][:, order], *best[1:], factor)


def _next_shift(tried: list[tuple[float, int]], wanted: float) -> float:
    """Shift that may leave ``wanted`` eigenvalues below it, from shifts and counts so far.

    The counts grow as some power of the shift: 1 on surfaces (Weyl), 1/2 on curves, more
    where the spectrum of a graph ends, or behind the first of a strip with fixed sides.
    """
    few = max((pair for pair in tried if pair[1] < wanted), default=None)
    many = min((pair for pair in tried if pair[1] > wanted), default=None)
    if few is None or many is None:  # no bracket: Weyl's power, at most a factor of 30
        shift, below = tried[-1]
        return shift * min(max(wanted / max(below, 1), 1 / 30), 30.0)
    if few[1] == 0:  # no power of nothing: along a straight line, in growing steps
        zeros = sum(below == 0 for _, below in tried)
        part = 1 - (1 - min(max(wanted / many[1], 0.05), 0.95)) ** zeros
        return few[0] + part * (many[0] - few[0])
    part = np.log(wanted / few[1]) / np.log(many[1] / few[1])
    return float(few[0] * (many[0] / few[0]) ** min(max(part, 0.05), 0.95))


def _grow(
    operator: _Operator, count: int, width: int, tolerance: float
) -> tuple[Floats, Floats] | None:
    """Lanczos vectors until the pairs are accurate and counted; None if that does not come.

    The count runs aside as soon as there is a gap to count at: on one core, while the
    other goes on with the vectors.
    """
    extra = max(8, count // 20)  # pairs behind the wanted ones, to find a gap there
    limit = min(operator.mass.shape[0] - width, (4 if operator.below else 8) * count + 12 * width)
    checks: list[tuple[int, float]] = []
    check_at, miscounts = 2 * count + 2 * width, 0
    counted: tuple[float, Future[int]] | None = None
    with ThreadPoolExecutor(1) as aside:
        for used, basis, projected, remainder in _krylov(operator, width, limit):
            if used < check_at and used + width <= limit:
                continue
            pairs = _ritz(operator, projected, remainder, min(count + extra, used))
            last = first_gap(pairs.values, pairs.uncertain, count)
            complete = bool((pairs.ritz[: operator.below] < 0).all())  # all those below the shift
            directions = _directions(operator, pairs, last or count)
            error = signature_error(pairs.values[: len(directions)], directions)
            checks.append((used, error))
            check_at = _next_check(checks, tolerance, width)
            if not last:
                if pairs.uncertain[count - 1 :].max() < SMALLEST_GAP * max(pairs.values[-1], UNIT):
                    extra *= 4  # the last multiplet ends behind the pairs looked at
                continue
            below, above = pairs.values[last - 1 : last + 1]
            if counted is None or not below < counted[0] < above:
                behind = float(below + above) / 2
                counted = behind, aside.submit(operator.count_below, behind)
            if not (complete and error <= tolerance):
                continue
            if counted[1].result() == last:
                vectors = scattered(basis, operator.factor.order, _purged(pairs, last))
                return pairs.values[:last], vectors
            miscounts += 1
            if miscounts == 2:
                break
    return None


def _krylov(
    operator: _Operator, width: int, limit: int
) -> Iterator[tuple[int, Floats, Floats, Floats]]:
    """Block by block: vectors used, the basis with one block more, projection, remainder.

    operator basis[:, :used] = basis[:, :used] projected + (last block) remainder, the
    remainder standing for its last columns. The basis is mass-orthonormal; ``projected``
    is block tridiagonal, of which only the lower triangle is written.
    """
    mass = in_pieces(operator.mass)
    limit = limit // width * width
    basis = np.empty((operator.mass.shape[0], limit + width), order="F")
    projected = np.zeros((limit + width, limit + width))
    start = np.random.default_rng(_SEED).standard_normal((len(basis), width))
    start = operator.factor.solve(mass @ start)
    image, remainder = _append(start, basis[:, :width], mass)
    for used in range(width, limit + 1, width):
        last, before = slice(used - width, used), slice(max(used - 2 * width, 0), used - width)
        new = operator.factor.solve(image)
        if used > width:
            new = minus(new, basis[:, before], remainder.T)
        projected[last, last] = gram(image, new)
        new = minus(new, basis[:, last], projected[last, last])
        image, remainder = _append(new, basis[:, : used + width], mass)
        projected[used : used + width, last] = remainder
        yield used, basis[:, : used + width], projected[:used, :used], remainder


def _next_check(checks: list[tuple[int, float]], tolerance: float, width: int) -> int:
    """Number of vectors for the next check, if the error goes on falling as it did."""
    used, error = checks[-1]
    ahead = width
    if len(checks) > 1 and tolerance < error < checks[-2][1]:
        earlier, worse = checks[-2]
        ahead = int((used - earlier) * np.log(error / tolerance) / np.log(worse / error))
    return used + min(max(ahead // width, 1), _BLIND) * width


def _ritz(operator: _Operator, projected: Floats, remainder: Floats, count: int) -> _Ritz:
    """The Ritz pairs that belong to the smallest eigenvalues, those below the shift first."""
    ritz, modes = np.linalg.eigh(projected)
    below, size = operator.below, len(ritz)
    chosen = np.r_[below - 1 : -1 : -1, size - 1 : size - 1 - (count - below) : -1]
    ritz, modes = ritz[chosen], modes[:, chosen]
    missed = remainder @ modes[-len(remainder) :]
    least = _RANK_TOLERANCE * np.abs(ritz).max()  # far from converged: any large value will do
    ritz = np.where(np.abs(ritz) < least, least, ritz)
    return _Ritz(operator.shift + 1 / ritz, ritz, modes, missed)


def _directions(operator: _Operator, pairs: _Ritz, count: int) -> Floats:
    """Error of each wanted eigenvector: its residual over the gap to the pairs left out."""
    outside = pairs.values[count]
    spacing = max(outside / count, _LEAST_SPACING)
    gaps = np.maximum(outside - pairs.values, spacing) / (outside - operator.shift)
    errors: Floats = pairs.residuals / np.abs(pairs.ritz) / np.minimum(gaps, 1.0)
    return errors[:count]


def _purged(pairs: _Ritz, count: int) -> Floats:
    """Coefficients of operator phi / ritz, orthonormal: one step more, without a solve.

    What is left of high eigenvectors is divided by their eigenvalues, so the residuals
    of stiffness phi - lambda mass phi become small as well.
    """
    columns = np.vstack([pairs.modes, pairs.missed / pairs.ritz])[:, :count]
    squares, modes = np.linalg.eigh(columns.T @ columns)
    result: Floats = columns @ (modes / np.sqrt(squares)) @ modes.T
    return result


def _append(block: Floats, basis: Floats, mass: RowPieces) -> tuple[Floats, Floats]:
    """Write block, made mass-orthonormal to the columns before, as the last ones of a basis.

    The result is ``mass @ unit`` and ``remainder``, where block = unit @ remainder but for
    the part along the columns before, which the three-term recurrence left to rounding.
    Directions of which nothing is left, because the basis spans them, are replaced by
    random ones with a remainder of zero: so an invariant subspace is left for new copies
    of the same eigenvalues.
    """
    width = block.shape[1]
    basis, target = basis[:, :-width], basis[:, -width:]
    image = mass @ block
    scale = np.sqrt(np.einsum("nk,nk->", block, image))
    block = minus(block, basis, gram(basis, image))
    image = mass @ block
    square, directions = np.linalg.eigh(gram(block, image))
    length = np.sqrt(np.maximum(square, 0.0))
    kept = length > _RANK_TOLERANCE * scale
    inverse, remainder = directions / np.where(kept, length, 1.0), length[:, None] * directions.T
    weak = length.min() < _WEAK * scale or not kept.all()
    if weak or length.min() < _UNEVEN * length.max():  # its square is lost: orthonormalize again
        block, image = times(block, inverse), times(image, inverse)
        if weak:
            rng = np.random.default_rng(_SEED + basis.shape[1])
            block[:, ~kept] = rng.standard_normal((len(block), int((~kept).sum())))
            remainder[~kept] = 0.0
            for _ in range(2):  # what is left of a weak direction is mostly rounding at first
                block = minus(block, basis, gram(basis, mass @ block))
                inverse, lower = _orthonormalizer(gram(block, mass @ block))
                block, remainder = times(block, inverse), lower.T @ remainder
            image = mass @ block
        inverse, lower = _orthonormalizer(gram(block, image))
        remainder = lower.T @ remainder
    times(block, inverse, out=target)
    return times(image, inverse), remainder


def _orthonormalizer(squares: Floats) -> tuple[np.ndarray, np.ndarray]:
    """The inverse, transposed, of the Cholesky factor of a block's inner products; the factor."""
    lower = np.linalg.cholesky(squares)
    return np.linalg.inv(lower).T, lower
