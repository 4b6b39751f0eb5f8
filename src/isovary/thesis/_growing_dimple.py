"""Spheres with a growing dimple: their eigenpairs, the harmonics in them, their signatures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..geometry import Floats
from ..laplacian import fem
from ..records import Eigenpairs, Surface
from ..shapes import icosphere
from ..signature import global_point_signature
from ..spectrum import drop_cut_multiplet, eigenpairs
from ._irregular import polar_dimple
from ._records import Settings
from ._steps import Signed, signed

SHELLS = 4
"""Degrees from 1 on whose eigenfunctions are looked at: the first 25 with the constant."""

_DEGREES = 9  # harmonics of degree below it are enough for these
_TIP = np.array([0.0, 0.0, -1.0])


@dataclass(frozen=True, eq=False)
class Measured:
    """Dimpled spheres, the first without a dimple, and what is measured of them.

    Parameters
    ----------
    spheres : list of Signed
    alphas : sequence of float
    flat : array (k,)
        Eigenvalues of the sphere by flat elements.
    exact : array (k,)
        Those of theory.
    overlaps : array (spheres, shells)
        Cosine of the largest angle between each shell of eigenfunctions and the harmonics.
    purity : array (spheres, 24)
        Largest part of each eigenfunction's energy in one order m around the axis.
    changes : dict of arrays (n,)
        Relative change of signatures at each node, by the largest dimple.
    """

    spheres: list[Signed]
    alphas: Sequence[float]
    flat: Floats
    exact: Floats
    overlaps: Floats
    purity: Floats
    changes: dict[str, Floats]

    @property
    def shifts(self) -> Floats:
        """Relative shift (k - 1,) of the eigenvalues by the largest dimple."""
        shifts: Floats = self.spheres[-1].pairs.values[1:] / self.spheres[0].pairs.values[1:] - 1
        return shifts

    @property
    def flat_errors(self) -> Floats:
        """Relative error (k - 1,) of the flat elements' eigenvalues."""
        errors: Floats = self.flat[1:] / self.exact[1:] - 1
        return errors

    @property
    def angles(self) -> Floats:
        """From the tip, in degrees (n,)."""
        cosines = np.clip(self.spheres[0].surface.points @ _TIP, -1, 1)
        return np.asarray(np.degrees(np.arccos(cosines)))

    def at_ends(self, name: str) -> tuple[float, float]:
        """Relative change of a signature at the tip and opposite it."""
        change, angles = self.changes[name], self.angles
        return float(change[angles.argmin()]), float(change[angles.argmax()])


def measure(settings: Settings) -> Measured:
    """Solve for each dimple, and for the sphere by flat elements."""
    count, alphas = settings["pairs"], settings["alphas"]
    sphere = icosphere(settings["subdivisions"])
    base = signed(sphere, count, settings["times"])
    spheres = [base]
    for alpha in alphas[1:]:
        dimpled = polar_dimple(sphere, _TIP[2], settings["dimple_radius"], alpha)
        spheres.append(signed(dimpled, count, base.times))
    flat = eigenpairs(fem(icosphere(settings["flat_subdivisions"], order=1)), count).values
    harmonics = _harmonic_parts([each.pairs for each in spheres], sphere)
    return Measured(
        spheres,
        alphas,
        flat,
        _exact(count),
        np.array([_overlaps(parts) for parts in harmonics]),
        np.array([_purities(parts) for parts in harmonics]),
        _changes(base, spheres[-1]),
    )


def _exact(count: int) -> Floats:
    degrees = np.arange(int(count**0.5) + 1)
    return np.repeat(degrees * (degrees + 1.0), 2 * degrees + 1)[:count]


def _orders() -> tuple[np.ndarray, np.ndarray]:
    """Degree and order of each harmonic."""
    degrees = np.repeat(np.arange(_DEGREES), 2 * np.arange(_DEGREES) + 1)
    return degrees, np.arange(len(degrees)) - degrees**2 - degrees


def _harmonic_parts(solved: Sequence[Eigenpairs], sphere: Surface) -> list[Floats]:
    """Coefficients (harmonics, 25) of the first eigenfunctions, carried back to the sphere."""
    from scipy.special import lpmv, poch

    x, y, z = sphere.points.T
    degrees, orders = _orders()
    sizes = np.abs(orders)
    around = np.arctan2(y, x)[:, None] * sizes
    waves = np.where(orders < 0, np.sin(around), np.cos(around)) * lpmv(sizes, degrees, z[:, None])
    norms = (2 - (orders == 0)) * (2 * degrees + 1) / (4 * np.pi)
    real = waves * np.sqrt(norms / poch(degrees - sizes + 1, 2 * sizes))
    weighted = fem(sphere).mass @ real
    return [weighted.T @ pairs.vectors[:, : (SHELLS + 1) ** 2] for pairs in solved]


def _overlaps(parts: Floats) -> Floats:
    """For each degree from 1 on, the cosine of the largest angle of two spaces of functions."""
    degrees = _orders()[0]
    own = parts / np.linalg.norm(parts, axis=0)
    cosines = []
    for degree in range(1, SHELLS + 1):
        shell = own[:, degree**2 : (degree + 1) ** 2]
        basis = np.linalg.qr(shell)[0]
        cosines.append(np.linalg.svd(basis[degrees == degree], compute_uv=False).min())
    return np.array(cosines)


def _purities(parts: Floats) -> Floats:
    """Largest part of each eigenfunction's energy that lies in one order around the axis."""
    orders = np.abs(_orders()[1])
    energy = np.array([(parts[orders == m, 1:] ** 2).sum(axis=0) for m in range(_DEGREES)])
    purest: Floats = (energy / energy.sum(axis=0)).max(axis=0)
    return purest


def _changes(base: Signed, dimpled: Signed) -> dict[str, Floats]:
    whole = len(drop_cut_multiplet(base.pairs).values)
    plain, moved = (global_point_signature(s.pairs.truncate(whole)) for s in (base, dimpled))
    size = (plain**2).sum(axis=1)
    heat = dimpled.signature / base.signature - 1
    return {
        "gps": np.linalg.norm(moved - plain, axis=1) / size**0.5,
        "gps_length": np.abs((moved**2).sum(axis=1) / size - 1),
        "hks": np.sqrt((heat**2).mean(axis=1)),
    }
