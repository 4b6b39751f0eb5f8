"""Tall products on several threads whose bits do not depend on how many there are.

The rows are cut into pieces by their number alone, each piece is multiplied by
one BLAS thread, and sums run over the pieces in order.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from threading import RLock
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from ..geometry import Floats, Ints

if TYPE_CHECKING:
    from scipy.sparse import csr_array

Item = TypeVar("Item")
Result = TypeVar("Result")

_ROWS = 4096  # of a piece: fewer are not worth a thread
_PIECES = 16


_ONE_AT_A_TIME = RLock()


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Let BLAS use one thread: the pieces are the threads.

    The limit holds for the whole process, so one solve waits for the other.
    """
    import scipy.linalg  # its BLAS must be there to be limited
    import scipy.sparse.linalg  # noqa: F401
    from threadpoolctl import threadpool_limits

    with _ONE_AT_A_TIME, threadpool_limits(1, user_api="blas"):
        yield


def pieces(length: int, least: int = _ROWS) -> list[slice]:
    """Cut range(length) into equal slices of about ``least`` or more, 16 at most."""
    count = max(1, min(_PIECES, length // least))
    ends = [length * i // count for i in range(count + 1)]
    return [slice(*pair) for pair in pairwise(ends)]


def each(work: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
    """``work`` of every item, side by side, in the items' order."""
    if len(items) == 1:
        return [work(items[0])]
    with ThreadPoolExecutor(min(len(items), os.cpu_count() or 1)) as threads:
        return list(threads.map(work, items))


def gram(left: Floats, right: Floats) -> Floats:
    """left^T right for tall (n, a) and (n, b)."""
    parts = each(lambda rows: right[rows].T @ left[rows], pieces(len(left)))
    total: Floats = np.sum(parts, axis=0)
    return total.T


def projections(tall: Floats, *matrices: RowPieces) -> list[Floats]:
    """tall^T A tall for symmetric matrices A, of which three quarters are computed."""
    half = tall.shape[1] // 2

    def work(item: tuple[slice, tuple[csr_array, ...]]) -> Floats:
        here = tall[item[0]]
        results = np.zeros((len(matrices), tall.shape[1], tall.shape[1]))
        for result, part in zip(results, item[1], strict=True):
            image = part @ tall
            result[:, half:] = here.T @ image[:, half:]
            result[:half, :half] = here[:, :half].T @ image[:, :half]
        return results

    parts = zip(*(matrix.parts for matrix in matrices), strict=True)
    total = np.sum(each(work, list(zip(pieces(len(tall)), parts, strict=True))), axis=0)
    total[:, half:, :half] = total[:, :half, half:].transpose(0, 2, 1)
    return list(total)


def rotate(tall: Floats, small: Floats) -> None:
    """Put tall (n, a) times small (a, a) in the place of tall."""

    def work(rows: slice) -> None:
        tall[rows] = tall[rows] @ small

    each(work, pieces(len(tall)))


def times(tall: Floats, small: Floats, out: Floats | None = None) -> Floats:
    """Tall (n, a) times small (a, b), in the memory order of ``tall`` or of ``out``."""
    by_column = tall.strides[0] < tall.strides[-1]
    empty = np.empty((len(tall), small.shape[1]), order="F" if by_column else "C")
    result = empty if out is None else out

    def work(rows: slice) -> None:
        if result.strides[0] < result.strides[-1]:  # BLAS is twice as fast in one order
            np.matmul(small.T, tall[rows].T, out=result[rows].T)
        else:
            np.matmul(tall[rows], small, out=result[rows])

    each(work, pieces(len(tall)))
    return result


def minus(block: Floats, tall: Floats, small: Floats) -> Floats:
    """Block - tall small, for a basis ``tall`` (n, a) whose columns are contiguous."""
    result = np.empty_like(block)

    def work(rows: slice) -> None:
        np.subtract(block[rows], (small.T @ tall[rows].T).T, out=result[rows])

    each(work, pieces(len(tall)))
    return result


@dataclass(frozen=True, eq=False)
class RowPieces:
    """A sparse matrix in pieces of rows: ``matrix @ block`` on several threads."""

    matrix: csr_array
    parts: tuple[csr_array, ...]

    def __matmul__(self, block: Floats) -> Floats:
        result = np.empty((self.matrix.shape[0], block.shape[1]))

        def work(item: tuple[slice, csr_array]) -> None:
            result[item[0]] = item[1] @ block

        each(work, list(zip(pieces(len(result)), self.parts, strict=True)))
        return result


def in_pieces(matrix: csr_array) -> RowPieces:
    """A sparse matrix ready for products with blocks of vectors."""
    return RowPieces(matrix, tuple(matrix[rows] for rows in pieces(matrix.shape[0])))


def scattered(ordered: Floats, order: Ints, small: Floats | None = None) -> Floats:
    """The rows of ``ordered``, or of its product with ``small``, put back to places ``order``."""
    result = np.empty((len(ordered), (ordered if small is None else small).shape[1]))

    def work(rows: slice) -> None:
        part = ordered[rows]
        result[order[rows]] = part if small is None else (small.T @ part.T).T

    each(work, pieces(len(ordered)))
    return result
