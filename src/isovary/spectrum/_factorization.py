"""L D L^T of a sparse symmetric matrix, arranged so that many right sides are solved at once.

SuperLU orders and factorizes; it solves one right side at a time. Here its
factor is cut into panels: runs of columns with nearly the same rows, closed
over small subtrees of the elimination tree, stored dense and with the
triangle on the diagonal inverted. Then each panel is one matrix product over
all right sides.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..errors import SpectrumError
from ..geometry import Floats, Ints

if TYPE_CHECKING:
    from scipy.sparse import csc_array, csr_array
    from scipy.sparse.linalg import SuperLU

_LEAF, _WIDEST = 64, 256  # columns of a panel: of a whole subtree, and at most
_GROWTH = 1e10  # largest entry of L: pivots are taken as they come
_PADDING = 0.4  # part of a panel that may be zeros


@dataclass(frozen=True, eq=False)
class _Panel:
    """Columns first..last of the factor: what they give to themselves and to the rows below."""

    first: int
    last: int
    rows: Ints  # below the diagonal block
    all_rows: Ints  # first..last, then ``rows``
    forward: Floats  # [inverse of the diagonal block; -(the rest) times it]
    backward: Floats  # its transpose, contiguous


@dataclass(frozen=True, eq=False)
class Factorization:
    """P A P^T = L D L^T in panels.

    Parameters
    ----------
    order : array (n,)
        ``order[i]`` is the row of A that is eliminated i-th.
    pivots : array (n,)
        The diagonal of D; its signs are those of A's eigenvalues (Sylvester).
    panels : tuple
    """

    order: Ints
    pivots: Floats
    panels: tuple[_Panel, ...]

    def solve(self, right: Floats) -> Floats:
        """A^-1 right for right (n, m) whose rows are in elimination order; so is the result."""
        return self.overwrite(np.array(right, order="C"))

    def overwrite(self, x: Floats) -> Floats:
        """A^-1 x in the place of x, C-contiguous; 1 ms a column for n = 50 000 and m = 64."""
        tallest = max(len(panel.all_rows) for panel in self.panels)
        product, below = np.empty((2, tallest, x.shape[1]))
        for panel in self.panels:
            image = product[: len(panel.all_rows)]
            np.matmul(panel.forward, x[panel.first : panel.last], out=image)
            width = panel.last - panel.first
            x[panel.first : panel.last] = image[:width]
            rest = below[: len(panel.rows)]
            x.take(panel.rows, 0, rest, "clip")  # "clip": without it take() copies once more
            rest += image[width:]
            x[panel.rows] = rest
        x /= self.pivots[:, None]
        for panel in reversed(self.panels):
            given = product[: len(panel.all_rows)]
            x.take(panel.all_rows, 0, given, "clip")
            np.matmul(panel.backward, given, out=x[panel.first : panel.last])
        return x


def signed_factor(matrix: csr_array, ordering: str = "MMD_AT_PLUS_A") -> tuple[SuperLU, int]:
    """SuperLU's factor of a symmetric matrix, pivots on the diagonal, and how many are negative.

    A matrix in elimination order asks for ``ordering="NATURAL"``.

    Raises
    ------
    SpectrumError
        S01 if the factorization had to leave the diagonal or met a pivot near zero, so that
        its signs mean nothing.
    """
    from scipy.sparse.linalg import splu

    try:
        factor = splu(
            matrix.tocsc(),
            permc_spec=ordering,
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
    except RuntimeError:
        factor = None
    if factor is None or not np.array_equal(factor.perm_r, factor.perm_c):
        raise SpectrumError(
            "S01",
            "factorization: expected a regular symmetric matrix, got a zero pivot; ask for "
            "another number of pairs",
        )
    growth = float(np.abs(factor.L.data).max())
    if not growth <= _GROWTH:
        raise SpectrumError(
            "S01",
            f"factorization: expected factors of at most {_GROWTH:g}, got {growth:.3g}, which "
            "leaves no digit; ask for another number of pairs",
        )
    return factor, int((factor.U.diagonal() < 0).sum())


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
    return signed_factor(stiffness - shift * mass)[1]


def factorize(factor: SuperLU) -> Factorization:
    """The panels of a factor of :func:`signed_factor`."""
    lower = factor.L
    after = _postorder(_parents(lower))
    lower = lower[after][:, after].tocsc()
    lower.sort_indices()
    if (lower.indices[lower.indptr[:-1]] == np.arange(lower.shape[0])).all():
        starts = _panel_starts(lower)
    else:  # exact zeros left out of L hide branches of the tree: any runs of columns will do
        after, lower = np.arange(lower.shape[0]), factor.L
        lower.sort_indices()
        starts = np.arange(0, lower.shape[0], _LEAF)
    panels = _panels(lower, starts, np.append(starts[1:], lower.shape[0]))
    order = np.argsort(factor.perm_r)[after]
    return Factorization(order, factor.U.diagonal()[after], panels)


def _parents(lower: csc_array) -> Ints:
    """Elimination tree: the first row below the diagonal of each column, n for a root."""
    size = lower.shape[0]
    row = np.where(lower.indices > np.repeat(np.arange(size), np.diff(lower.indptr)), 0, size)
    first: Ints = np.minimum.reduceat(row + lower.indices, lower.indptr[:-1])
    return first.clip(max=size)


def _postorder(parents: Ints) -> Ints:
    """Children before parents, each subtree in one run."""
    size = len(parents)
    child, sibling, up = [-1] * (size + 1), [-1] * size, parents.tolist()
    for node in range(size - 1, -1, -1):
        sibling[node], child[up[node]] = child[up[node]], node
    order, stack = [], [size]
    while stack:
        node = stack[-1]
        below = child[node]
        if below >= 0:
            child[node] = sibling[below]
            stack.append(below)
        else:
            order.append(stack.pop())
    return np.array(order[:-1])


def _panel_starts(lower: csc_array) -> Ints:
    """First columns of the panels.

    A subtree of at most ``_LEAF`` columns is one panel. Above those, a column
    joins its child's panel while no more than ``_PADDING`` of it would be zeros.
    """
    size = lower.shape[0]
    parents, counts = _parents(lower), np.diff(lower.indptr).tolist()
    subtree = [1] * size + [0]
    for node, parent in enumerate(parents.tolist()):
        subtree[parent] += subtree[node]
    subtree[size] = size + _LEAF  # so that a small tree is a leaf, too
    columns = np.array(subtree)
    roots = np.flatnonzero((columns[:-1] <= _LEAF) & (columns[parents] > _LEAF))
    depth = np.zeros(size + 1, dtype=np.int64)
    np.add.at(depth, roots + 1 - columns[roots], 1)
    np.add.at(depth, roots + 1, -1)
    in_leaf = np.cumsum(depth)[:-1] > 0
    starts = (roots + 1 - columns[roots]).tolist()
    start, zeros = -1, 0
    for node in np.flatnonzero(~in_leaf).tolist():
        zeros += (counts[node] - counts[node - 1] + 1) * (node - start)
        width = node - start + 1
        panel = width * counts[node] + width * (width - 1) // 2
        follows = start >= 0 and node > 0 and parents[node - 1] == node and not in_leaf[node - 1]
        if not follows or zeros > _PADDING * panel or width > _WIDEST:
            starts.append(node)
            start, zeros = node, 0
    return np.sort(np.array(starts))


def _panels(lower: csc_array, starts: Ints, ends: Ints) -> tuple[_Panel, ...]:
    from scipy.linalg.lapack import dtrtri

    place = np.empty(lower.shape[0], dtype=np.int64)
    counts = np.diff(lower.indptr)
    panels = []
    for first, last in zip(starts.tolist(), ends.tolist(), strict=True):
        entries = slice(lower.indptr[first], lower.indptr[last])
        entry_rows, width = lower.indices[entries], last - first
        rows = np.unique(entry_rows[entry_rows >= last])
        all_rows = np.concatenate([np.arange(first, last), rows])
        place[all_rows] = np.arange(len(all_rows))
        dense = np.zeros((len(all_rows), width))
        columns = np.repeat(np.arange(width), counts[first:last])
        dense[place[entry_rows], columns] = lower.data[entries]
        inverse = dtrtri(dense[:width], lower=1, unitdiag=1)[0]
        forward = np.concatenate([inverse, -dense[width:] @ inverse])
        panels.append(_Panel(first, last, rows, all_rows, forward, np.ascontiguousarray(forward.T)))
    return tuple(panels)
