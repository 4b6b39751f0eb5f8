"""How far a map between two surfaces is from an isometry, and the map that is nearest to one."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .errors import CorrespondenceError
from .geometry import (
    Bools,
    Floats,
    Ints,
    edge_length,
    node_places,
    shape_gradients,
    tangents,
    triangle_areas,
)
from .records import Surface

if TYPE_CHECKING:
    from scipy.sparse import csc_array

_STEPS = 100
_DAMPING = 1e-6  # of the diagonal, at least: directions that hardly change a length stand still
_MOST_DAMPING = 1e6
_ISOMETRIC = 1e-11  # strain that is rounding
_SETTLED = 1e-4  # of an edge: a step below it is the last,
_GAIN = 1e-6  # and so is one that lowers the mean square of the strain by less, relative to it


@dataclass(frozen=True, eq=False)
class Distortion:
    """How much a map stretches each triangle of a surface.

    Parameters
    ----------
    stretches : array (m, 2)
        Principal stretches of each triangle, the larger first: lengths after over lengths
        before, along two directions at right angles.
    areas : array (m,)
        The triangles' areas before; length^2.
    strain : float
        Root mean square over the surface of the Green strain ((F^T F - 1) / 2, Frobenius norm).

    Examples
    --------
    A triangle stretched by 1.2 along x alone:

    >>> triangle = Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> stretched = distortion(triangle, triangle.points * [1.2, 1, 1])
    >>> stretched.stretches.round(12).tolist(), round(stretched.strain, 12)
    ([[1.2, 1.0]], 0.22)
    >>> stretched.area_strain.round(12).tolist(), stretched.angle_strain.round(12).tolist()
    ([0.2], [0.2])
    """

    stretches: Floats
    areas: Floats
    strain: float

    @property
    def area_strain(self) -> Floats:
        """Area after over area before, less 1; (m,)."""
        strain: Floats = self.stretches.prod(axis=1) - 1
        return strain

    @property
    def angle_strain(self) -> Floats:
        """Larger stretch over the smaller, less 1; (m,), 0 where angles are kept."""
        strain: Floats = self.stretches[:, 0] / self.stretches[:, 1] - 1
        return strain

    @property
    def size(self) -> Floats:
        """Largest change of a length in each triangle, relative to it; (m,)."""
        change: Floats = np.abs(self.stretches - 1).max(axis=1)
        return change

    def at_nodes(self, triangles: Ints) -> Floats:
        """``size`` at the nodes (n,): the mean of the triangles around, by area."""
        weight = np.repeat(self.areas, triangles.shape[1])
        total = np.bincount(triangles.ravel(), weight * np.repeat(self.size, triangles.shape[1]))
        mean: Floats = total / np.bincount(triangles.ravel(), weight)
        return mean


def distortion(base: Surface, points: Floats) -> Distortion:
    """How much a map of a surface's nodes stretches its triangles.

    The map between the (curved) triangles is that of their shape functions. With F its
    gradient in orthonormal coordinates of the base, the stretches are the singular values of
    F, from the mean of F^T F over each triangle.

    Parameters
    ----------
    base : Surface
    points : array (n, 3)
        Where the base's nodes go; NaN where unknown.

    Returns
    -------
    Distortion
        NaN for triangles at nodes whose place is unknown.

    Notes
    -----
    Cost: linear in the number of triangles, 10 ms for 2 000 of six nodes.
    """
    metric = _metric(base)
    areas = metric.weights.sum(axis=1)
    known = np.isfinite(points[base.triangles]).all(axis=(1, 2))
    stretches = np.full((len(areas), 2), np.nan)
    if not known.any():
        return Distortion(stretches, areas, float("nan"))
    part = _Metric(base.triangles[known], metric.gradients[known], metric.weights[known])
    tensor = part.tensor(points)
    mean = np.einsum("mq,mqkl->mkl", part.weights, tensor) / areas[known, None, None]
    squares = np.linalg.eigvalsh(mean)[:, ::-1]
    stretches[known] = np.sqrt(np.maximum(squares, np.finfo(float).tiny))
    strain = part.mean([(tensor - np.eye(2)) / 2])
    return Distortion(stretches, areas, float(np.sqrt(strain)))


class Landing(NamedTuple):
    """Where points arrive on a surface.

    ``points`` (n, 3) on it, its unit ``normals`` (n, 3) there, the directions ``frames``
    (n, 3, 2) in which each may slide (0 for none), and the mask ``arrived`` (n,).
    """

    points: Floats
    normals: Floats
    frames: Floats
    arrived: Bools


Ground = Callable[[Floats], Landing]
"""The way from points near a surface onto it."""


def slide(base: Surface, start: Floats, ground: Ground) -> Floats:
    """Points slid on another surface until the map from the base is as isometric as can be.

    Minimizes the integral over the base of the strain's square, half there and half back,
    (E : E + E' : E') / 2 with C = F^T F / s^2, E = (C - 1) / 2 and E' = (1 - C^-1) / 2, F the
    gradient of the map and s^2 the ratio of the areas: a similarity strains nothing, small
    strains count as usual, and a triangle that collapses costs without bound (the Green strain
    E alone would let it, and wrinkle what shrinks below 0.7). Damped Gauss-Newton steps in the
    tangent planes of the other surface, each followed by the way back onto it; a step that
    raises the strain or turns a triangle over is damped more. Where nothing is lost by it (a
    sphere may turn) nothing moves.

    Parameters
    ----------
    base : Surface
        With n nodes.
    start : array (n, 3)
        On the other surface, no triangle turned over.
    ground : callable
        The other surface.

    Returns
    -------
    array (n, 3)

    Raises
    ------
    CorrespondenceError
        C05 if triangles are turned over at the start.

    Warns
    -----
    UserWarning
        C07 if the map has not settled after 100 steps.

    Notes
    -----
    Quadratic convergence where the surfaces are nearly isometric: 4 to 5 steps, each a sparse
    factorization of 2 n unknowns, 0.1 s for 4 000 nodes. Where lengths change by 10 % it is
    linear: some ten steps. At most 100.

    References
    ----------
    O. Sorkine and M. Alexa, *As-rigid-as-possible surface modeling*, SGP 2007, minimize the
    same to leading order by turns (local) and a fixed stiffness (global), in many more steps;
    J. Nocedal and S. Wright, *Numerical Optimization*, 2006, section 10.3 (damping).
    """
    if distortion(base, start).strain < _ISOMETRIC:
        return start
    here = ground(start)
    landed = triangle_areas(here.points, base.triangles).sum()
    metric = _metric(base, float(np.sqrt(landed / base.area)))
    check_facing(here.points, base.triangles, here.normals)
    settled = _SETTLED * edge_length(here.points, base.triangles)
    energy, damping = metric.energy(metric.tensor(here.points)), 1e-3
    for _ in range(_STEPS):
        if energy < _ISOMETRIC**2:
            break
        matrix, slope = metric.equations(here.points, here.frames)
        while damping < _MOST_DAMPING:
            step = np.einsum("ndc,nc->nd", here.frames, _solve(matrix, slope, damping))
            there = ground(here.points + step)
            lower = metric.energy(metric.tensor(there.points))
            if there.arrived.all() and lower < energy and _faces(there, base.triangles):
                break
            damping *= 10
        else:
            break
        length = float(np.linalg.norm(there.points - here.points, axis=1).max())
        settling = length < settled or energy - lower < _GAIN * energy
        here, energy, damping = there, lower, max(damping / 10, _DAMPING)
        if settling:
            break
    else:
        warnings.warn(
            f"the map of least strain has not settled after {_STEPS} steps: where the surface can "
            "slide almost freely the places of points are uncertain [C07]",
            stacklevel=2,
        )
    return here.points


def tangent_frames(normals: Floats) -> Floats:
    """Two unit vectors at right angles to each normal and each other, (n, 3, 2)."""
    away = np.eye(3)[np.abs(normals).argmin(axis=1)]
    first = np.cross(normals, away)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    frames: Floats = np.stack([first, np.cross(normals, first)], axis=-1)
    return frames


def check_facing(points: Floats, triangles: Ints, normals: Floats) -> None:
    """Raise CorrespondenceError C05 if a triangle does not face along the normals (n, 3)."""
    turned = facing(points, triangles, normals) <= 0
    if turned.any():
        raise CorrespondenceError(
            "C05",
            f"triangles: expected all carried ones to face outward, got {turned.sum()} turned "
            f"over, first {np.flatnonzero(turned)[:5].tolist()}; the surfaces are too far apart "
            "for their features: go in smaller steps of the parameter, or compare with normal_rays",
        )


def facing(points: Floats, triangles: Ints, normals: Floats) -> Floats:
    """Least product (m,) of a triangle's own normal at its nodes and the nodes' normals."""
    jacobian = tangents(points, triangles, node_places(1 if triangles.shape[1] == 3 else 2))
    own = np.cross(jacobian[..., 0], jacobian[..., 1])
    least: Floats = np.einsum("mqd,mqd->mq", own, normals[triangles]).min(axis=1)
    return least


def _faces(landing: Landing, triangles: Ints) -> bool:
    return bool((facing(landing.points, triangles, landing.normals) > 0).all())


@dataclass(frozen=True, eq=False)
class _Metric:
    """Gradients (m, q, i, 2) of the shape functions in orthonormal coordinates, and weights."""

    triangles: Ints
    gradients: Floats
    weights: Floats

    def map_gradients(self, points: Floats) -> Floats:
        """F (m, q, 3, 2) at the quadrature points."""
        gradients: Floats = np.einsum("mid,mqik->mqdk", points[self.triangles], self.gradients)
        return gradients

    def tensor(self, points: Floats) -> Floats:
        """F^T F (m, q, 2, 2)."""
        gradients = self.map_gradients(points)
        tensor: Floats = np.einsum("mqdk,mqdl->mqkl", gradients, gradients)
        return tensor

    def mean(self, strains: Sequence[Floats]) -> float:
        """Mean over the surface of the squares of some strains (m, q, 2, 2)."""
        total = sum(np.einsum("mq,mqkl,mqkl->", self.weights, e, e) for e in strains)
        return float(total / self.weights.sum())

    def energy(self, tensor: Floats) -> float:
        """Mean square of the strain there and back; infinite where a triangle has collapsed."""
        determinant = np.linalg.det(tensor)
        if not (determinant > np.finfo(float).tiny).all():
            return float("inf")
        return self.mean(_strains(tensor, np.asarray(np.linalg.inv(tensor), dtype=float))) / 2

    def equations(self, points: Floats, frames: Floats) -> tuple[csc_array, Floats]:
        """Gauss-Newton matrix (2n, 2n) and slope (2n,) for moves along the frames."""
        from scipy.sparse import coo_array

        gradients = self.map_gradients(points)
        along = np.einsum("mqdk,midc->mqick", gradients, frames[self.triangles])
        change = np.einsum("mqick,mqil->mqickl", along, self.gradients)
        count, rule, width = self.gradients.shape[:3]
        change = (change + np.swapaxes(change, -1, -2)).reshape(count, rule, 2 * width, 2, 2) / 2
        tensor = np.einsum("mqdk,mqdl->mqkl", gradients, gradients)
        back = np.linalg.inv(tensor)
        change_back = np.einsum("mqij,mqajk,mqkl->mqail", back, change, back, optimize=True)
        rows = np.concatenate([_entries(change), _entries(change_back)], axis=-1)
        wanted = np.concatenate([_entries(e) for e in _strains(tensor, back)], axis=-1)
        weighted = rows * self.weights[..., None, None]
        local = np.einsum("mqae,mqbe->mab", weighted, rows, optimize=True)
        numbers = (2 * self.triangles[:, :, None] + np.arange(2)).reshape(count, -1)
        size = 2 * len(points)
        places = np.repeat(numbers, 2 * width, axis=1).ravel(), np.tile(numbers, 2 * width).ravel()
        matrix = coo_array((local.ravel(), places), shape=(size, size)).tocsc()
        slope = np.einsum("mqae,mqe->ma", weighted, wanted)
        return matrix, np.bincount(numbers.ravel(), slope.ravel(), size).astype(float)


def _strains(tensor: Floats, back: Floats) -> tuple[Floats, Floats]:
    """Strains there, (C - 1) / 2, and back, (1 - C^-1) / 2."""
    return (tensor - np.eye(2)) / 2, (np.eye(2) - back) / 2


def _entries(symmetric: Floats) -> Floats:
    """Three numbers (..., 3) whose squares sum to those of a symmetric (..., 2, 2)."""
    mixed = np.sqrt(2) * symmetric[..., 0, 1]
    return np.stack([symmetric[..., 0, 0], symmetric[..., 1, 1], mixed], axis=-1)


def _metric(base: Surface, scale: float = 1.0) -> _Metric:
    """Of the base, scaled, at one quadrature point of a flat triangle and six of a curved one."""
    barycentric, weights = _rule(base.order)
    jacobian = tangents(base.points, base.triangles, barycentric)
    first = np.einsum("mqdk,mqdl->mqkl", jacobian, jacobian)
    lower = np.linalg.cholesky(first)
    inward = np.swapaxes(np.linalg.inv(lower), -1, -2)
    local = shape_gradients(barycentric, base.order)
    gradients = np.einsum("qik,mqkl->mqil", local, inward) / scale
    measure = lower[..., 0, 0] * lower[..., 1, 1] * (weights / 2)
    return _Metric(base.triangles, gradients, measure)


def _rule(order: int) -> tuple[Floats, Floats]:
    """Quadrature exact to degree 1 for flat and 4 for curved triangles (Dunavant 1985)."""
    if order == 1:
        return np.full((1, 3), 1 / 3), np.ones(1)
    orbits = ((0.445948490915965, 0.223381589678011), (0.091576213509771, 0.109951743655322))
    places = [np.roll([1 - 2 * b, b, b], k) for b, _ in orbits for k in range(3)]
    weights = np.repeat([weight for _, weight in orbits], 3)
    return np.array(places), weights / weights.sum()


def _solve(matrix: csc_array, slope: Floats, damping: float) -> Floats:
    """Move (n, 2) along the frames of a damped Gauss-Newton step."""
    from scipy.sparse import diags_array
    from scipy.sparse.linalg import splu

    diagonal = matrix.diagonal()
    scale = float(diagonal.mean()) or 1.0
    held = diagonal <= 1e-12 * scale
    damped = matrix + diags_array(damping * diagonal + held * scale)
    factors = splu(
        damped.tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    move: Floats = factors.solve(-slope).reshape(-1, 2)
    return move
