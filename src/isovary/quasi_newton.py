"""Steps that learn from those before: limited-memory BFGS around an approximate Hessian."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from .geometry import Floats

_MOST = 6


class Memory(NamedTuple):
    """The latest steps and by how much each changed the gradient, the oldest first.

    Examples
    --------
    For x1^2 + 5 x2^2 along x2: one step shows what the Hessian is, and the next is Newton's.

    >>> import numpy as np
    >>> memory = Memory().after(np.array([0.0, 0.1]), np.array([0.0, 1.0]))
    >>> memory.direction(np.array([0.0, 10.0]), lambda slope: slope).round(12).tolist()
    [0.0, -1.0]
    """

    steps: tuple[Floats, ...] = ()
    changes: tuple[Floats, ...] = ()

    def after(self, step: Floats, change: Floats) -> Memory:
        """With one more step, if the gradient rises along it; at most six are kept."""
        if not np.vdot(step, change) > 0:
            return self
        return Memory((*self.steps, step)[-_MOST:], (*self.changes, change)[-_MOST:])

    def direction(self, gradient: Floats, solve: Callable[[Floats], Floats]) -> Floats:
        """Downhill, where ``solve`` divides by the approximate Hessian.

        References
        ----------
        J. Nocedal and S. Wright, *Numerical Optimization*, 2006, algorithm 7.4.
        """
        way, parts = -gradient, []
        pairs = list(zip(self.steps, self.changes, strict=True))
        for step, change in reversed(pairs):
            parts.append(np.vdot(step, way) / np.vdot(step, change))
            way = way - parts[-1] * change
        way = solve(way)
        for (step, change), part in zip(pairs, reversed(parts), strict=True):
            way = way + (part - np.vdot(change, way) / np.vdot(step, change)) * step
        return way
