"""Rows to group: checked, their weights, and the groups made of them in one order."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ArgumentError, ClusterError
from ..geometry import Bools, Floats, Ints
from ..records import Clusters
from ..row_distances import Metric, check_metric, checked_weights


class Rows(NamedTuple):
    """The known rows (m, T), their weights (m,) of mean 1, and which (n,) of all they are."""

    data: Floats
    weights: Floats
    known: Bools

    def clusters(
        self, nearest: Ints, centers: Floats, memberships: Floats | None = None
    ) -> Clusters:
        """Groups (m,) of the known rows, numbered anew by their centers' norms; -1 = unknown."""
        order = np.argsort(np.abs(centers).sum(axis=1), kind="stable")
        labels = np.full(len(self.known), -1, dtype=np.int64)
        labels[self.known] = np.argsort(order)[nearest]
        if memberships is None:
            return Clusters(labels, centers[order])
        shares = np.full((len(self.known), len(centers)), np.nan)
        shares[self.known] = memberships[:, order]
        return Clusters(labels, centers[order], shares)

    def sample(self, most: int, rng: np.random.Generator) -> Rows:
        """At most so many rows, without replacement, with a chance in proportion to the weights.

        What is drawn weighs alike.
        """
        if len(self.data) <= most:
            return self
        chance = self.weights / self.weights.sum()
        drawn = np.sort(rng.choice(len(self.data), most, replace=False, p=chance))
        return Rows(self.data[drawn], np.ones(most), np.ones(most, dtype=bool))


def checked_rows(
    rows: ArrayLike, count: int, *, weights: ArrayLike | None = None, metric: Metric = "l1"
) -> Rows:
    """The rows without NaN, ready to be put into so many groups.

    Raises
    ------
    ArgumentError
        A02 for a count below 1, an unknown metric or weights that are not positive, A03 for
        rows that are not (n, T) or weights that are not (n,).
    ClusterError
        K02 if there are fewer distinct rows than groups.
    """
    values = np.asarray(rows, dtype=float)
    if values.ndim != 2:
        raise ArgumentError("A03", f"rows: expected shape (n, T), got {values.shape}")
    if count < 1:
        raise ArgumentError("A02", f"count: expected 1 or more, got {count}")
    check_metric(metric)
    heavy = checked_weights(weights, len(values))
    known = np.isfinite(values).all(axis=1)
    data = values[known]
    distinct = len(np.unique(data, axis=0))
    if distinct < count:
        raise ClusterError(
            "K02",
            f"count: expected at most {distinct} groups for {distinct} distinct rows, got {count}",
        )
    return Rows(data, heavy[known] / heavy[known].mean(), known)
