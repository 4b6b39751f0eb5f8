"""How much of a displacement is a rigid motion, which a signature does not see."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .geometry import Floats
from .records import Surface

_UNSEEN = 1e-2  # part of a motion along the normals below which it is not seen


@dataclass(frozen=True)
class RigidMotion:
    """The small rigid motion that explains most of a normal displacement.

    ``translation`` (3,) in length, ``rotation`` (3,) is the rotation vector in
    radians about the surface's centre, ``rms`` the root-mean-square normal
    displacement that it makes, ``total_rms`` that of the whole displacement.
    """

    translation: tuple[float, float, float]
    rotation: tuple[float, float, float]
    rms: float
    total_rms: float

    @property
    def share(self) -> float:
        """Part of the squared normal displacement that the rigid motion explains, 0 to 1."""
        return (self.rms / self.total_rms) ** 2 if self.total_rms > 0 else 0.0


def rigid_part(surface: Surface, distance: Floats) -> RigidMotion:
    """Best rigid motion behind a normal displacement, by least squares.

    Minimizes sum_i ((a + w x (x_i - c)) . n_i - s_i)^2 over translation a and
    rotation w, with s the displacement along the normals n. A rigid motion
    changes no intrinsic shape, but rays along normals turn it into a slide of
    corresponding points, and that into a false change.

    Parameters
    ----------
    surface : Surface
    distance : array (n,)
        Displacement along the normals, NaN where unknown; length.

    Returns
    -------
    RigidMotion

    Notes
    -----
    Linear in the motion: for turns of more than some ten degrees it tells that
    the motion is large, not how large. Motions that hardly move points along their
    normals, by less than 1 % of their way (a sphere's rotation), come out as zero:
    nothing could tell how large they are.

    Examples
    --------
    A sphere shifted by 0.01 along z:

    >>> from isovary.shapes import icosphere
    >>> sphere = icosphere(1)
    >>> motion = rigid_part(sphere, 0.01 * sphere.normals[:, 2])
    >>> [round(x, 6) + 0.0 for x in motion.translation], round(motion.share, 6)
    ([0.0, 0.0, 0.01], 1.0)
    """
    known = np.isfinite(distance)
    points, normals, values = surface.points[known], surface.normals[known], distance[known]
    centre = points.mean(axis=0)
    size = float(np.abs(points - centre).max())
    columns = np.hstack([normals, np.cross((points - centre) / size, normals)])
    motion, *_ = np.linalg.lstsq(columns, values, rcond=_UNSEEN)
    turn = motion[3:] / size
    return RigidMotion(
        (float(motion[0]), float(motion[1]), float(motion[2])),
        (float(turn[0]), float(turn[1]), float(turn[2])),
        float(np.sqrt(np.mean((columns @ motion) ** 2))),
        float(np.sqrt(np.mean(values**2))),
    )
