"""Where to look from: a parallel camera that shows most of the change, the same for all panels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry import Floats

_CANDIDATES = 300
_FACING = 0.45, 0.8  # cosines: the marked point is seen obliquely, so that depth shows
_ROUND = 1.15  # below this ratio of extents a shape has no long axis


@dataclass(frozen=True, eq=False)
class Camera:
    """A parallel projection. Lengths in the picture are lengths of the surface.

    ``axes`` (3, 3) has the unit vectors to the right, up, and towards the viewer
    as rows; ``low``, ``high`` (3,) bound the scene along them.
    """

    axes: Floats
    low: Floats
    high: Floats

    @property
    def opposite(self) -> Camera:
        """From behind, with the same direction up."""
        turn = np.diag([-1.0, 1.0, -1.0])
        low, high = turn @ self.low, turn @ self.high
        return Camera(turn @ self.axes, np.minimum(low, high), np.maximum(low, high))

    def project(self, points: Floats) -> Floats:
        """Right, up and depth (towards the viewer) of each point (k, 3)."""
        projected: Floats = points @ self.axes.T
        return projected

    def window(self, aspect: float, margin: float = 0.04) -> tuple[float, float, float, float]:
        """Left, right, bottom, top of the tightest window of this aspect, width over height."""
        size = (1 + 2 * margin) * (self.high - self.low)[:2]
        width = max(size[0], size[1] * aspect)
        x, y = (self.low + self.high)[:2] / 2
        height = width / aspect
        return x - width / 2, x + width / 2, y - height / 2, y + height / 2


def choose_camera(
    points: Floats,
    facing: Floats,
    weights: Floats,
    mark: tuple[Floats, Floats] | None,
) -> Camera:
    """The direction that shows most change and most surface, with the marked point in sight.

    Of 300 directions the best by visible weight + twice the silhouette's area, each
    relative to the largest, among those that see the marked point obliquely, at
    37 to 63 degrees, and not behind another part. The long axis of the picture
    lies flat; z points up as far as that allows.

    Parameters
    ----------
    points, facing : array (q, 3)
        Middles and unit normals of small pieces of surface.
    weights : array (q,)
        How much each piece deserves to be seen.
    mark : (array (3,), array (3,)), optional
        Point that must be seen, and its normal.

    Returns
    -------
    Camera
    """
    directions = _directions(_CANDIDATES)
    seen = np.maximum(facing @ directions.T, 0.0)
    heavy, large = weights @ seen, np.array([_silhouette(points, d) for d in directions])
    score = heavy / max(heavy.max(), 1e-300) + 2 * large / large.max()
    if mark is not None:
        slant = directions @ mark[1]
        score = np.where((slant > _FACING[0]) & (slant < _FACING[1]), score, slant - 2)
        for i in np.argsort(-score):
            if slant[i] > 0 and in_sight(mark[0][None], points, directions[i])[0]:
                return _upright(points, directions[i])
    return _upright(points, directions[int(score.argmax())])


def in_sight(places: Floats, points: Floats, direction: Floats) -> np.ndarray:
    """Which places (k, 3) have none of the points (q, 3) in front of them."""
    from scipy.spatial import cKDTree

    size = float(np.ptp(points, axis=0).max())
    across = _frame(direction)[:2]
    near = cKDTree(points @ across.T).query_ball_point(places @ across.T, 0.02 * size)
    depth, own = points @ direction, places @ direction
    free = [not (depth[i] > d + 0.08 * size).any() for i, d in zip(near, own, strict=True)]
    return np.array(free, dtype=bool)


def _silhouette(points: Floats, direction: Floats) -> int:
    """Area of the points' shadow, counted in squares of 1/30 of the size."""
    flat = points @ _frame(direction)[:2].T
    step = float(np.ptp(points, axis=0).max()) / 30
    squares = np.floor((flat - flat.min(axis=0)) / step).astype(np.int64)
    return int(np.count_nonzero(np.bincount(100 * squares[:, 0] + squares[:, 1])))


def _directions(count: int) -> Floats:
    """Unit vectors spread evenly over the sphere (a Fibonacci spiral)."""
    i = np.arange(count) + 0.5
    z = 1 - 2 * i / count
    turn = np.pi * (1 + 5**0.5) * i
    r = np.sqrt(1 - z**2)
    return np.column_stack([r * np.cos(turn), r * np.sin(turn), z])


def _frame(direction: Floats) -> Floats:
    """Right, up and the direction itself, with up near z (or near y when looking along z)."""
    helper = np.array([0.0, 0.0, 1.0]) if abs(direction[2]) < 0.95 else np.array([0.0, 1.0, 0.0])
    right = np.cross(helper, direction)
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(direction, right), direction])


def _upright(points: Floats, direction: Floats) -> Camera:
    axes = _frame(direction)
    flat = points @ axes[:2].T
    spread, along = np.linalg.eigh(np.cov(flat.T))
    if spread[1] > _ROUND**2 * spread[0]:
        c, s = along[:, 1] * (1 if along[0, 1] >= 0 else -1)
        axes[:2] = np.array([[c, s], [-s, c]]) @ axes[:2]
    inside = points @ axes.T
    return Camera(axes, inside.min(axis=0), inside.max(axis=0))
