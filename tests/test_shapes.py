"""Surfaces with known answers: on the true surface, with its normals, topology and area."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from oracles import spheroid_area

from isovary import ArgumentError, Surface
from isovary.geometry import node_normals, rim_nodes, topology, triangle_quality
from isovary.shapes import cylinder, disk, ellipsoid, hemisphere, icosphere, sheet, torus


def split(points):
    """Distance from the z axis, and z."""
    return np.hypot(points[:, 0], points[:, 1]), points[:, 2]


@dataclass(frozen=True)
class Truth:
    """What is known of a surface: its mesh of a level, level set, gradient, area and topology."""

    mesh: Callable[[int, int], Surface]  # of a level and an order
    level_set: Callable  # of points; zero on the surface
    gradient: Callable  # of points; outward, of any length
    area: float
    topology: tuple  # components, rims, Euler number, genus
    nodes: Callable[[int, int], int]  # how many a mesh has
    quality: float = 0.7


def radial(points):
    return points * [1, 1, 0]


def from_ring(points):
    """Of the torus of ring 1: from the nearest point of the circle of radius 1."""
    return points - radial(points) / split(points)[0][:, None]


SHAPES = {
    "icosphere": Truth(
        lambda n, order: icosphere(n, order=order),
        lambda p: (p**2).sum(axis=1) - 1,
        lambda p: p,
        4 * np.pi,
        (1, 0, 2, 0),
        lambda n, order: 10 * 4 ** (n + order - 1) + 2,
    ),
    "ellipsoid": Truth(
        lambda n, order: ellipsoid((1.0, 1.0, 1.5), n, order=order),
        lambda p: (p**2 / [1, 1, 2.25]).sum(axis=1) - 1,
        lambda p: p / [1, 1, 2.25],
        spheroid_area(1.5),
        (1, 0, 2, 0),
        lambda n, order: 10 * 4 ** (n + order - 1) + 2,
    ),
    "torus": Truth(
        lambda n, order: torus(1.0, 0.4, (12 * 2**n, 5 * 2**n), order=order),
        lambda p: (split(p)[0] - 1) ** 2 + p[:, 2] ** 2 - 0.16,
        from_ring,
        4 * np.pi**2 * 0.4,
        (1, 0, 0, 1),
        lambda n, order: 60 * 4 ** (n + order - 1),
    ),
    "cylinder": Truth(
        lambda n, order: cylinder(0.5, 2.0, (6 * 2**n, 4 * 2**n), order=order),
        lambda p: split(p)[0] - 0.5,
        radial,
        2 * np.pi,
        (1, 2, 0, 0),
        lambda n, order: 6 * order * 2**n * (4 * order * 2**n + 1),
    ),
    "disk": Truth(
        lambda n, order: disk(1.3, 2**n, order=order),
        lambda p: p[:, 2],
        lambda p: np.tile([0.0, 0.0, 2.0], (len(p), 1)),
        1.69 * np.pi,
        (1, 1, 1, 0),
        lambda n, order: 1 + 3 * order * 2**n * (order * 2**n + 1),
    ),
    "hemisphere": Truth(
        lambda n, order: hemisphere(2**n, order=order),
        lambda p: (p**2).sum(axis=1) - 1,
        lambda p: p,
        2 * np.pi,
        (1, 1, 1, 0),
        lambda n, order: 1 + 3 * order * 2**n * (order * 2**n + 1),
    ),
    "rolled sheet": Truth(
        lambda n, order: sheet(3.0, 1.0, (6 * 2**n, 2 * 2**n), bend=0.5, order=order),
        lambda p: p[:, 0] ** 2 + (p[:, 2] + 2) ** 2 - 4,
        lambda p: (p - np.array([0, 0, -2])) * [1, 0, 1],
        3.0,
        (1, 1, 1, 0),
        lambda n, order: (6 * order * 2**n + 1) * (2 * order * 2**n + 1),
    ),
}

both = pytest.mark.parametrize("order", [1, 2])
every = pytest.mark.parametrize("truth", SHAPES.values(), ids=SHAPES)


@both
@every
def test_nodes_and_normals_are_the_surfaces(truth, order):
    """Oracle: analytic. Each node, midpoints included, on the surface; its gradient; rounding."""
    surface = truth.mesh(3, order)
    assert surface.order == order
    assert np.abs(truth.level_set(surface.points)).max() < 1e-14
    gradient = truth.gradient(surface.points)
    exact = gradient / np.linalg.norm(gradient, axis=1, keepdims=True)
    np.testing.assert_allclose(surface.normals, exact, atol=1e-14)
    of_triangles = node_normals(surface.points, surface.triangles)
    assert ((of_triangles * exact).sum(axis=1) > 0.98).all(), "triangles turn inward"


@both
@every
def test_topology_and_counts(truth, order):
    """Oracle: analytic. Components, rims, Euler number, genus and number of nodes."""
    for level in (1, 2):
        surface = truth.mesh(level, order)
        found = topology(surface.triangles)
        parts = found.components, found.boundary_loops, found.euler, found.genus
        assert parts == truth.topology
        assert len(surface.points) == truth.nodes(level, order)
        assert triangle_quality(surface.points, surface.corners).min() > truth.quality


@both
@every
def test_area_converges(truth, order):
    """Oracle: order. The area: order 2 for flat, 4 for curved triangles, on exact nodes.

    Or better than that: flat triangles are exact on a flat sheet. 0.3 for the coarse meshes.
    """
    levels = np.array([2, 3, 4])
    errors = [abs(truth.mesh(n, order).area / truth.area - 1) for n in levels]
    slope = -np.polyfit(levels, np.log2(errors), 1)[0]
    assert abs(slope - 2 * order) < 0.3, f"fitted order {slope:.2f}, errors {errors}"


@both
def test_rims_lie_where_they_should(order):
    """Oracle: analytic. Rims of the cylinder at both ends, of the disk on its circle, ..."""
    tube = cylinder(0.5, 2, (6, 4), order=order)
    flat, half = disk(1.3, 4, order=order), hemisphere(4, order=order)
    ends = np.unique(tube.points[rim_nodes(tube.triangles), 2])
    assert ends.tolist() == [0.0, 2.0]
    distance = split(flat.points[rim_nodes(flat.triangles)])[0]
    np.testing.assert_allclose(distance, 1.3, rtol=1e-15)
    equator = rim_nodes(half.triangles)
    assert (half.points[equator, 2] == 0).all()  # exactly: the image formula mirrors there
    assert (np.delete(half.points[:, 2], equator) > 0.1).all()
    assert len(equator) == 6 * 4 * order


@pytest.mark.parametrize("bend", [0.0, 0.2, 1.0, 2 * np.pi / 3])
def test_rolling_keeps_lengths(bend):
    """Oracle: symmetry. Arcs along x and straight lines along y are as long as on the flat sheet.

    Chords between nodes h apart are 2 / bend sin(bend h / 2), to rounding.
    """
    flat, rolled = (sheet(3.0, 1.0, (10, 4), bend=b, order=1) for b in (0.0, bend))
    assert (flat.points[:, 2] == 0).all()
    edges = flat.corners[:, [0, 1]]
    step = np.diff(flat.points[edges], axis=1)[:, 0]
    chord = np.linalg.norm(np.diff(rolled.points[edges], axis=1)[:, 0], axis=1)
    arc = step[:, 0] * np.sinc(bend * step[:, 0] / (2 * np.pi))
    np.testing.assert_allclose(chord, np.hypot(arc, step[:, 1]), rtol=1e-13)
    np.testing.assert_array_equal(rolled.points[:, 1], flat.points[:, 1])
    middle = np.abs(flat.points[:, 0]) < 1e-12
    np.testing.assert_allclose(rolled.points[middle][:, [0, 2]], 0.0, atol=1e-12)


def test_a_sheet_may_be_rolled_to_a_full_turn():
    """Oracle: analytic. At the bend 2 pi / width opposite sides meet; beyond it is refused."""
    width = 3.0
    rolled = sheet(width, 1.0, (12, 4), bend=2 * np.pi / width)
    left, right = rolled.points[:9], rolled.points[-9:]  # the nodes of each side, by y
    np.testing.assert_allclose(left, right, atol=1e-14)


def test_torus_cells_have_one_aspect():
    """Oracle: analytic. Conformal: sides of the cells in proportion to first order everywhere."""
    counts = (300, 131)  # sqrt(1 - 0.16) / 0.4 = 2.2913 = 300 / 130.9: squares
    surface = torus(1.0, 0.4, counts, order=1)
    lower = surface.points[surface.corners[: len(surface.corners) // 2]]
    around = np.linalg.norm(lower[:, 1] - lower[:, 0], axis=1)
    along = np.linalg.norm(lower[:, 2] - lower[:, 1], axis=1)
    np.testing.assert_allclose(along / around, 1.0, atol=0.03)  # O(h / tube) = 0.03


@pytest.mark.parametrize(
    "make",
    [
        lambda: icosphere(-1),
        lambda: icosphere(9),
        lambda: icosphere(1, order=3),
        lambda: ellipsoid((1, 1, 0), 1),
        lambda: ellipsoid((1, 1, np.nan), 1),
        lambda: torus(1.0, 1.0, (9, 9)),
        lambda: torus(1.0, 0.4, (2, 9)),
        lambda: torus(1.0, 0.4, (9, 2)),
        lambda: torus(1.0, 0.4, (9, 9, 9)),
        lambda: cylinder(0.0, 1.0, (6, 4)),
        lambda: cylinder(1.0, np.inf, (6, 4)),
        lambda: cylinder(1.0, 1.0, (2, 4)),
        lambda: cylinder(1.0, 1.0, (6, 0)),
        lambda: disk(-1.0, 3),
        lambda: disk(1.0, 0),
        lambda: hemisphere(0),
        lambda: hemisphere(2, order=0),
        lambda: sheet(1.0, 1.0, (0, 1)),
        lambda: sheet(1.0, 1.0, (2, 2), bend=-0.1),
        lambda: sheet(1.0, 1.0, (2, 2), bend=6.3),
        lambda: sheet(1.0, 1.0, (2, 2), bend=np.nan),
        lambda: sheet(1.0, 1.0, (2, 2), order=3),
    ],
)
def test_arguments_out_of_range(make):
    """Oracle: algebra. What no surface belongs to is refused, with the name of the argument."""
    with pytest.raises(ArgumentError, match=r"^\w+(, \w+)*: expected .*, got .* \[A02\]$"):
        make()


def test_wrong_number_of_axes():
    """Oracle: algebra. An ellipsoid has three."""
    with pytest.raises(ArgumentError, match=r"axes: expected 3 numbers, got shape \(2,\) \[A03\]"):
        ellipsoid((1, 2), 1)


@both
def test_smallest_meshes(order):
    """Oracle: analytic. The edge values of the counts work: 3 around, 1 along, 1 ring."""
    smallest = [
        (icosphere(0, order=order), 2),
        (torus(1.0, 0.4, (3, 3), order=order), 0),
        (cylinder(1.0, 1.0, (3, 1), order=order), 0),
        (disk(1.0, 1, order=order), 1),
        (hemisphere(1, order=order), 1),
        (sheet(1.0, 1.0, (1, 1), order=order), 1),
    ]
    for surface, euler in smallest:
        assert isinstance(surface, Surface)
        assert topology(surface.triangles).euler == euler
