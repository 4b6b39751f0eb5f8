"""Deterministic annealing: groups that split by themselves as a temperature falls."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ArgumentError, ClusterError
from ..geometry import Floats, Ints, frozen
from ..records import Clusters
from ..row_distances import distances
from ._rows import Rows, checked_rows

_SAMPLE = 4000  # rows that are cooled
_ROUNDS = 500  # at one temperature
_LAST_ROUNDS = 100  # with all rows
_SETTLED = 1e-6  # a round that moves no center by more of the root of the temperature is the last
_NEAR = 1e-3  # a group splits this near its critical temperature
_COLDEST = 1e-24  # of the first critical temperature: below lies rounding
_FROZEN = 1e-9  # of the temperature: there memberships are hard
_PIECE = 2**18  # multiplications that BLAS does on one thread


class _State(NamedTuple):
    """Centers (k, T) and their masses (k,), which sum to 1."""

    centers: Floats
    masses: Floats


class _Phase(NamedTuple):
    """The range of temperatures over which the number of groups stays, its end settled."""

    state: _State
    start: float
    end: float
    temperature: float


@dataclass(frozen=True, eq=False)
class Annealing:
    """Groups found by cooling, and the temperatures at which groups split on the way.

    Parameters
    ----------
    clusters : Clusters
        With memberships.
    temperatures : array (s,)
        Temperature of each split, descending; squared unit of the rows. The last is that at
        which there would have been one group too many.
    counts : array (s,)
        Number of groups below each of these temperatures, from 2.
    """

    clusters: Clusters
    temperatures: Floats
    counts: Ints

    def __post_init__(self) -> None:
        object.__setattr__(self, "temperatures", frozen(self.temperatures))
        object.__setattr__(self, "counts", frozen(self.counts, np.int64))


def deterministic_annealing(
    rows: ArrayLike,
    count: int | None = None,
    *,
    most: int = 8,
    weights: ArrayLike | None = None,
    rng: int | np.random.Generator = 0,
    cooling: float = 0.9,
    hard: bool = False,
) -> Clusters:
    r"""Groups that split by themselves as a temperature falls; it can choose their number.

    At the temperature T the centers y and masses p lower the free energy

    .. math:: F = -T \sum_i w_i \log \sum_k p_k e^{-d_{ik}^2 / T} ,
              \qquad u_{ik} \propto p_k e^{-d_{ik}^2 / T} ,

    in turns: memberships u, then the means and the masses of the rows weighted by w u. Above
    :math:`2 \lambda_{\max}` of the rows' covariance one group at their mean is the only
    minimum. A group splits, along the eigenvector, where T falls below twice the largest
    eigenvalue of its own covariance (rows weighted by w u). No start is drawn by chance.

    With ``count=None`` the number is that which stays over the longest range of log T, from
    2 to ``most``. One group alone has no upper end of its range and is never chosen, unless
    all rows are equal; rows of a few different values are as many groups, for these never
    split. The groups are those at the lower end of their range, where the next one would split.

    Distances are squared L2, not L1: then the centers are means, a group's stability is
    decided by its covariance, and the temperatures of the splits are known. With L1 neither
    holds.

    Parameters
    ----------
    rows : array (n, T)
        For example a change. Rows with NaN are left out: label -1, memberships NaN.
    count : int, optional
        Number of groups. Default: it chooses.
    most : int
        The largest number that it may choose.
    weights : array (n,), optional
        How much each row counts, for example its area. Default: all alike.
    rng : int or Generator
        Seed of the sample; of no effect up to 4000 rows.
    cooling : float
        Factor from one temperature to the next, in (0, 1). Next to 1 the groups follow more
        faithfully; 0.9 finds far groups well, and the splits to 5 %.
    hard : bool
        Cool on to temperature 0 with these groups: memberships become 0 or 1, and the groups
        a fixed point of Lloyd's iteration (k-means).

    Returns
    -------
    Clusters
        With ``memberships`` (n, k); the labels are the largest ones. A group that is nobody's
        largest has no label: more groups are wanted than there are, and ``hard`` helps.

    Raises
    ------
    ClusterError
        K02 if there are fewer distinct rows than groups.
    ArgumentError
        A02 for a count below 1, most below 2, a cooling outside (0, 1) or weights that are not
        positive; A03 for rows that are not (n, T) or weights not (n,).

    See Also
    --------
    annealing : the same, with the temperatures of the splits.

    Notes
    -----
    Above 4000 rows, 4000 drawn in proportion to their weights are cooled; the end is settled
    with all. Cost: n T k operations a round, some thousand rounds, and (n + T) T^2 k for the
    eigenvalues at each of 30 to 100 temperatures; 50 000 rows, 100 times, up to 8 groups take
    10 to 35 s.

    References
    ----------
    K. Rose, *Deterministic annealing for clustering, compression, classification, regression,
    and related optimization problems*, Proc. IEEE 86 (1998) 2210-2239, section II (the
    mass-constrained method; its theorem 1 gives the critical temperature).

    Examples
    --------
    >>> rows = np.array([[0.0], [1.0], [50.0], [51.0], [90.0], [91.0]])
    >>> groups = deterministic_annealing(rows, most=5)
    >>> groups.labels.tolist(), groups.centers.ravel().round(1).tolist()
    ([0, 0, 1, 1, 2, 2], [0.5, 50.5, 90.5])
    """
    return annealing(
        rows, count, most=most, weights=weights, rng=rng, cooling=cooling, hard=hard
    ).clusters


def annealing(
    rows: ArrayLike,
    count: int | None = None,
    *,
    most: int = 8,
    weights: ArrayLike | None = None,
    rng: int | np.random.Generator = 0,
    cooling: float = 0.9,
    hard: bool = False,
) -> Annealing:
    """Deterministic annealing with the temperatures at which groups split.

    For the method, the arguments and the errors see :func:`deterministic_annealing`.

    Parameters
    ----------
    rows : array (n, T)
    count : int, optional
    most : int
    weights : array (n,), optional
    rng : int or Generator
    cooling : float
    hard : bool

    Returns
    -------
    Annealing

    Raises
    ------
    ClusterError
        K02 if there are fewer distinct rows than groups.
    ArgumentError
        A02 for a value out of its range, A03 for a wrong shape.

    Notes
    -----
    Cost: that of :func:`deterministic_annealing`.

    References
    ----------
    K. Rose, Proc. IEEE 86 (1998) 2210-2239, theorem 1.

    Examples
    --------
    The rows -1 and 1 have the variance 1, and part at the temperature 2:

    >>> cooled = annealing([[-1.0], [1.0]], 2)
    >>> cooled.temperatures.round(9).tolist(), cooled.counts.tolist()
    ([2.0], [2])
    """
    if not 0 < cooling < 1:
        raise ArgumentError("A02", f"cooling: expected a factor in (0, 1), got {cooling:g}")
    if count is None and most < 2:
        raise ArgumentError("A02", f"most: expected 2 or more, got {most}")
    known = checked_rows(rows, 1 if count is None else count, weights=weights, metric="l2")
    shift = known.data.mean(axis=0)
    whole = known._replace(data=known.data - shift)
    limit = most if count is None else count
    sample = _cooled_rows(whole, limit, np.random.default_rng(rng))
    phases, temperatures = _cool(sample, limit, cooling)
    if count is not None and len(phases[-1].state.masses) < count:
        raise ClusterError(
            "K02",
            f"count: expected at most {len(phases[-1].state.masses)} groups of rows that differ "
            f"by more than rounding, got {count}",
        )
    phase = phases[-1] if count is not None else _longest(phases)
    state, shares = _finished(whole, sample, phase, cooling, hard)
    clusters = known.clusters(shares.argmax(axis=1), state.centers + shift, shares)
    return Annealing(clusters, np.array(temperatures), np.arange(2, len(temperatures) + 2))


def _cooled_rows(whole: Rows, limit: int, generator: np.random.Generator) -> Rows:
    """The rows to cool: a sample, or equal rows made one if too few of a sample's differ."""
    sample = whole.sample(_SAMPLE, generator)
    if sample is whole or len(np.unique(sample.data, axis=0)) > limit:
        return sample
    data, places = np.unique(whole.data, axis=0, return_inverse=True)
    weights = np.zeros(len(data))
    np.add.at(weights, places.ravel(), whole.weights)
    return Rows(data, weights, np.ones(len(data), dtype=bool))


def _cool(rows: Rows, limit: int, cooling: float) -> tuple[list[_Phase], list[float]]:
    """Phases of up to so many groups, and the temperatures of their splits and of the next."""
    mean = np.average(rows.data, axis=0, weights=rows.weights)
    state = _State(mean[None], np.ones(1))
    critical, axes = _stability(rows, state, np.inf)
    temperature, start = critical[0], np.inf
    coldest = _COLDEST * temperature
    phases: list[_Phase] = []
    splits: list[float] = []
    while temperature > coldest:
        order = np.argsort(-critical, kind="stable")
        order = order[critical[order] >= (1 - _NEAR) * temperature]
        order = order[: max(limit - len(critical), 1)]
        if len(order):
            found = np.minimum(critical[order], start)
            phases.append(_Phase(state, start, found[0], temperature))
            splits += found.tolist()
            if len(critical) == limit:
                return phases, splits
            state, start = _split(rows, state, order, axes, temperature), found[-1]
            temperature = cooling * temperature
        else:
            temperature = _next(rows, state, temperature, cooling, max(critical.max(), coldest))
        state = _settled(rows, state, temperature)
        critical, axes = _stability(rows, state, temperature)
    return [*phases, _Phase(state, start, coldest, temperature)], splits


def _next(rows: Rows, state: _State, temperature: float, cooling: float, critical: float) -> float:
    """The next lower temperature: not below the critical one, which falls a little on the way.

    Hard memberships no longer change with the temperature, so there it is reached at once.
    """
    hard = bool((_memberships(rows, state, temperature).max(axis=1) > 1 - 1e-15).all())
    wanted = min(critical, (1 - _NEAR) * temperature)
    return wanted if hard else max(wanted, cooling * temperature)


def _longest(phases: list[_Phase]) -> _Phase:
    """The phase over the longest range of log T, of those that have an upper end."""
    ended = [phase for phase in phases if np.isfinite(phase.start)]
    return max(ended, key=lambda phase: np.log(phase.start / phase.end), default=phases[-1])


def _finished(
    whole: Rows, sample: Rows, phase: _Phase, cooling: float, hard: bool
) -> tuple[_State, Floats]:
    """The state settled with all rows, at temperature 0 if it is to be hard; memberships."""
    state, temperature = phase.state, phase.temperature
    if hard:
        last = _FROZEN * temperature
        while temperature > last:
            temperature = max(cooling * temperature, last)
            state = _settled(sample, state, temperature)
    if sample is not whole:
        state = _settled(whole, state, temperature, _LAST_ROUNDS)
    return state, _memberships(whole, state, temperature)


def _settled(rows: Rows, state: _State, temperature: float, rounds: int = _ROUNDS) -> _State:
    """The state after rounds, at one temperature, that no longer move a center."""
    near = _SETTLED * np.sqrt(temperature)
    for _ in range(rounds):
        before = state.centers
        state = _round(rows, state, temperature)
        if np.sqrt(((state.centers - before) ** 2).sum(axis=1)).max() <= near:
            break
    return state


def _round(rows: Rows, state: _State, temperature: float) -> _State:
    """Means and masses of the memberships; a group that nothing weighs stays where it is."""
    shares = rows.weights * _memberships(rows, state, temperature).T
    mass = shares.sum(axis=1)
    held = mass > 0
    centers = state.centers.copy()
    centers[held] = product(shares[held], rows.data) / mass[held, None]
    return _State(centers, mass / mass.sum())


def product(left: Floats, right: Floats) -> Floats:
    """A product (a, b) of (a, m) and (m, b) for large m, added up in pieces of m.

    They are small enough for one thread: then the bits do not depend on how many there are,
    and a busy machine does not stall it.
    """
    step = max(_PIECE // (left.shape[0] * right.shape[1]), 16)
    total = np.zeros((left.shape[0], right.shape[1]))
    for first in range(0, len(right), step):
        total += left[:, first : first + step] @ right[first : first + step]
    return total


def _memberships(rows: Rows, state: _State, temperature: float) -> Floats:
    """Memberships (m, k); the largest exponent of a row is taken off, so none overflows."""
    if len(state.masses) == 1 or temperature == 0:
        return np.ones((len(rows.data), 1))
    exponent = -(distances(rows.data, state.centers, "l2") ** 2) / temperature
    exponent += np.log(np.maximum(state.masses, np.finfo(float).tiny))
    exponent -= exponent.max(axis=1, keepdims=True)
    power = np.exp(exponent)
    shares: Floats = power / power.sum(axis=1, keepdims=True)
    return shares


def _stability(rows: Rows, state: _State, temperature: float) -> tuple[Floats, Floats]:
    """Critical temperature (k,) of each group, and the axis (k, T) along which it splits."""
    from scipy.linalg import eigh

    last = rows.data.shape[1] - 1
    critical, axes = np.zeros(len(state.masses)), np.zeros_like(state.centers)
    shares = rows.weights * _memberships(rows, state, temperature).T
    for group, (center, share) in enumerate(zip(state.centers, shares, strict=True)):
        if share.sum() > 0:
            apart = (rows.data - center) * np.sqrt(share / share.sum())[:, None]
            value, vector = eigh(product(apart.T, apart), subset_by_index=[last, last])
            critical[group], axes[group] = max(2 * float(value[0]), 0.0), vector[:, 0]
    return critical, axes


def _split(rows: Rows, state: _State, groups: Ints, axes: Floats, temperature: float) -> _State:
    """Each of these groups as two: its rows on either side of the plane across its axis."""
    shares = rows.weights * _memberships(rows, state, temperature).T
    centers, masses = list(state.centers), list(state.masses)
    for group in groups:
        ahead = (rows.data - state.centers[group]) @ axes[group] > 0
        halves = np.stack([shares[group] * ~ahead, shares[group] * ahead])
        weights = halves.sum(axis=1)
        middles = product(halves, rows.data) / weights[:, None]
        parts = state.masses[group] * weights / weights.sum()
        centers[group], masses[group] = middles[0], parts[0]
        centers.append(middles[1])
        masses.append(parts[1])
    return _State(np.array(centers), np.array(masses))
