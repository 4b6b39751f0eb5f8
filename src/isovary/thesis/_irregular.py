"""Irregular meshes of ellipsoids, and dimples made at exact places on whatever mesh."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..deform import Projectile, Region, shoot
from ..geometry import Floats, with_midpoints
from ..records import Surface
from ..shapes import icosphere


def irregular_ellipsoid(
    axes: Sequence[float], subdivisions: int, shift: float, seed: int, *, order: int = 2
) -> Surface:
    """An ellipsoid whose mesh has no symmetry; its poles on z are vertices all the same.

    Parameters
    ----------
    axes : sequence of 3 floats
        Semi-axes; length.
    subdivisions : int
        Of an icosahedron, at least 1: before that the poles are none of its vertices.
    shift : float
        How far vertices are moved at random along the surface, in edge lengths; up to 0.25 or so
        no triangle is turned over.
    seed : int
        Of the shifts.
    order : int
    """
    sphere = icosphere(subdivisions, order=1)
    points = np.array(sphere.points)
    edge = float(np.linalg.norm(np.diff(points[sphere.triangles[:, :2]], axis=1), axis=2).mean())
    steps = np.random.default_rng(seed).uniform(-1, 1, points.shape)
    steps[np.abs(points[:, 2]) > 1 - 1e-12] = 0
    points = _unit(points + shift * edge * steps)
    triangles = sphere.triangles
    if order == 2:
        points, triangles = with_midpoints(points, triangles)
    stretch = np.asarray(axes, dtype=float)
    sphere_points = _unit(points)
    return Surface(sphere_points * stretch, triangles, normals=_unit(sphere_points / stretch))


def scattered_ellipsoid(axes: Sequence[float], count: int, shift: float, seed: int) -> Surface:
    """Flat triangles of vertices on a spiral, turned and shifted at random.

    Neither places nor connectivity have anything in common with :func:`irregular_ellipsoid`, but
    with the same shift the triangles are about as irregular.

    Parameters
    ----------
    axes : sequence of 3 floats
        Semi-axes; length.
    count : int
        Of vertices.
    shift : float
        How far they are moved at random along the sphere, in edge lengths.
    seed : int
        Of the turn and the shifts.
    """
    from scipy.spatial import ConvexHull

    step = np.arange(count)
    height = 1 - (2 * step + 1) / count
    angle = step * np.pi * (3 - 5**0.5)  # the golden one: neighbours are never in line
    ring = np.sqrt(1 - height**2)
    spiral = np.stack([ring * np.cos(angle), ring * np.sin(angle), height], axis=1)
    generator = np.random.default_rng(seed)
    turn = np.linalg.qr(generator.normal(size=(3, 3)))[0]
    edge = (4 * np.pi / count * 2 / 3**0.5) ** 0.5  # of equilateral triangles
    points = _unit(spiral @ turn + shift * edge * generator.uniform(-1, 1, spiral.shape))
    triangles = ConvexHull(points).simplices.astype(np.int64)
    inward = np.linalg.det(points[triangles]) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    stretch = np.asarray(axes, dtype=float)
    return Surface(points * stretch, triangles, normals=_unit(points / stretch))


def polar_dimple(
    surface: Surface, height: float, radius: float, alpha: float, *, steps: int = 20
) -> Surface:
    """A dimple at the pole (0, 0, height), the same map of space on whatever mesh.

    The flight is that of :func:`isovary.dimple`; this one does not ask the mesh for the normal.
    """
    place = np.array([0.0, 0.0, height])
    out = np.array([0.0, 0.0, np.sign(height)])
    start, end = (place + far * radius * out for far in (1.0, 0.5))
    flight = Projectile(start, end, steps=steps, dt=0.2 / steps)
    return shoot(surface, flight, Region(place, radius), alpha=alpha)


def _unit(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))
