"""What every Laplacian promises; finite elements, cotangent, robust and heat-kernel ones apart."""

from __future__ import annotations

import builtins
from functools import partial

import numpy as np
import pytest
from conftest import ELLIPSOID_ISOVALUE, ellipsoid_field
from oracles import sphere_eigenvalues, sphere_signature

import isovary as iv
from isovary import laplacian as room
from isovary.geometry import linear_triangles, rim_nodes, triangle_areas
from isovary.laplacian._heat_kernel import CUT
from isovary.laplacian._sites import cloud_areas

# What the mass sums to: the area of the curved triangles, that of their flat pieces, or an estimate
CURVED, FLAT, ESTIMATED = "curved", "flat", "estimated"
METHODS = {
    "fem": (room.fem, CURVED),
    "fem lumped": (partial(room.fem, lumped=True), CURVED),
    "cotangent": (room.cotangent, FLAT),
    "robust": (room.robust, FLAT),
    "uniform_graph": (room.uniform_graph, CURVED),
    "uniform_graph nearest": (partial(room.uniform_graph, nearest=4, random_walk=True), CURVED),
    "knn_graph": (room.knn_graph, CURVED),
    "knn_graph binary": (partial(room.knn_graph, heat=None, random_walk=True), CURVED),
    "epsilon_graph": (room.epsilon_graph, CURVED),
    "epsilon_graph binary": (partial(room.epsilon_graph, heat=None, random_walk=True), CURVED),
    "mesh_laplacian": (room.mesh_laplacian, FLAT),
    "point_cloud": (room.point_cloud, ESTIMATED),
}
SURFACES = {"flat": iv.icosphere(2, order=1), "curved": iv.icosphere(2)}
every_method = pytest.mark.parametrize("name", METHODS)


def flat_pieces(surface):
    return iv.Surface(surface.points, linear_triangles(surface.triangles))


@pytest.mark.parametrize("surface", SURFACES.values(), ids=SURFACES)
@every_method
def test_contract(name, surface):
    """Oracle: algebra. Symmetric; constants in the kernel; semidefinite; mass sums to the area."""
    method, kind = METHODS[name]
    points, triangles = surface.points.copy(), surface.triangles.copy()
    laplacian = method(surface)
    np.testing.assert_array_equal(surface.points, points)
    np.testing.assert_array_equal(surface.triangles, triangles)
    stiffness, mass = laplacian.stiffness.toarray(), laplacian.mass.toarray()
    np.testing.assert_array_equal(stiffness, stiffness.T)
    np.testing.assert_array_equal(mass, mass.T)
    np.testing.assert_allclose(stiffness.sum(axis=1), 0, atol=1e-12)
    values = np.linalg.eigvalsh(stiffness)
    assert values[0] > -1e-12
    assert values[1] > 1e-3  # only constants are in the kernel
    assert np.linalg.eigvalsh(mass).min() > 0
    area = surface.area if kind == CURVED else flat_pieces(surface).area
    assert mass.sum() == pytest.approx(area, rel=0.03 if kind == ESTIMATED else 1e-12)


def assert_close(first, second, tolerance):
    """The entries of two sparse matrices agree, relative to the largest."""
    assert abs(first - second).max() <= tolerance * abs(second).max()


ASKEW = iv.marching_cubes(
    ellipsoid_field((1.0, 0.8, 1.3), samples=17), ELLIPSOID_ISOVALUE, vertices=150
)


@pytest.mark.parametrize("surface", [SURFACES["flat"], ASKEW], ids=["icosphere", "ellipsoid"])
@every_method
def test_rigid_motion_and_renumbering(name, surface):
    """Oracle: symmetry. They permute the matrices, to 1e-9, and equal distances stay equal."""
    method = METHODS[name][0]
    rng = np.random.default_rng(2718)
    turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    order = rng.permutation(len(surface.points))
    triangles = np.argsort(order)[surface.triangles][rng.permutation(len(surface.triangles))]
    moved = iv.Surface(surface.points[order] @ turn.T + [3.0, -1.0, 2.0], triangles)
    first, second = method(surface), method(moved)
    assert_close(second.stiffness, first.stiffness[order][:, order], 1e-9)
    assert_close(second.mass, first.mass[order][:, order], 1e-9)


@pytest.mark.parametrize("scale", [1e-12, 1e12])
@every_method
def test_scaling(name, scale):
    """Oracle: symmetry. Lengths by s leave the stiffness and multiply the mass by s^2, to 1e-9."""
    method = METHODS[name][0]
    first = method(ASKEW)
    second = method(iv.Surface(scale * ASKEW.points, ASKEW.triangles))
    assert_close(second.stiffness, first.stiffness, 1e-9)
    assert_close(second.mass / scale**2, first.mass, 1e-9)


@every_method
def test_far_origin(name):
    """Oracle: symmetry. A shift by 1e6 rounds points by 1e-10, a 1e-9th of an edge: 1e-7."""
    method = METHODS[name][0]
    first = method(ASKEW)
    second = method(iv.Surface(ASKEW.points + 1e6, ASKEW.triangles))
    assert_close(second.stiffness, first.stiffness, 1e-7)
    assert_close(second.mass, first.mass, 1e-7)


# Operators that average over four edge lengths reach their order on finer meshes.
@pytest.mark.parametrize(
    ("name", "finest", "tolerance"),
    [
        ("fem lumped", 4, 0.1),
        ("cotangent", 4, 0.1),
        ("robust", 4, 0.1),
        pytest.param("mesh_laplacian", 5, 0.25, marks=pytest.mark.slow),
        pytest.param("point_cloud", 5, 0.25, marks=pytest.mark.slow),
    ],
)
def test_sphere_eigenvalues_converge(name, finest, tolerance):
    """Oracle: order. lambda_1..24 of icospheres against l (l + 1): order 2."""
    method = METHODS[name][0]
    exact = sphere_eigenvalues(25)[1:]
    errors = []
    for subdivisions in (finest - 2, finest - 1, finest):
        pairs = iv.eigenpairs(method(iv.icosphere(subdivisions, order=1)), 25)
        errors.append(np.abs(pairs.values[1:25] / exact - 1).mean())
    order = -np.polyfit([0, 1, 2], np.log2(errors), 1)[0]
    assert abs(order - 2) < tolerance, f"fitted order {order:.2f}, errors {errors}"


# ------------------------------------------------------------------ finite elements


def patch(order):
    """Two flat triangles making a parallelogram, tilted in space, with their midpoints."""
    corners = np.array([[0.0, 0, 0], [2, 0.3, 0.1], [2.4, 1.3, 0.9], [0.4, 1.0, 0.8]])
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    if order == 1:
        return iv.Surface(corners, triangles)
    from isovary.geometry import edges_of

    edges, of_triangle, _ = edges_of(triangles)
    return iv.Surface(
        np.vstack([corners, corners[edges].mean(axis=1)]), np.hstack([triangles, of_triangle + 4])
    )


@pytest.mark.parametrize("order", [1, 2])
def test_polynomials_are_integrated_exactly(order):
    """Oracle: analytic. Energies and moments of polynomials of the element's order on a flat patch.

    For u = a.x (and u = (a.x)^2 with order 2): u^T K u = integral |grad u|^2 and
    u^T M u = integral u^2, by a quadrature of the polynomial itself.
    """
    surface = patch(order)
    laplacian = iv.fem(surface)
    a, b = surface.points[1], surface.points[3]
    rng = np.random.default_rng(77)
    direction = rng.standard_normal(3)
    u = surface.points @ direction
    s, t = np.meshgrid(*2 * [np.polynomial.legendre.leggauss(6)[0] / 2 + 0.5], indexing="ij")
    w = np.multiply.outer(*2 * [np.polynomial.legendre.leggauss(6)[1] / 2])
    jacobian = np.linalg.norm(np.cross(a, b))
    normal = np.cross(a, b) / jacobian
    tangential = direction - (direction @ normal) * normal
    at = (s[..., None] * a + t[..., None] * b) @ direction
    for power in range(1, order + 1):
        value = u**power
        energy = jacobian * (w * (power * at ** (power - 1)) ** 2).sum() * (tangential @ tangential)
        moment = jacobian * (w * at ** (2 * power)).sum()
        assert value @ (laplacian.stiffness @ value) == pytest.approx(energy, rel=1e-12)
        assert value @ (laplacian.mass @ value) == pytest.approx(moment, rel=1e-12)


def test_linear_fem_equals_lapy():
    """Oracle: peer. Stiffness and mass of LaPy's linear FEM, to 1e-12."""
    lapy = pytest.importorskip("lapy", reason="LaPy is not installed")
    surface = iv.icosphere(3, order=1)
    solver = lapy.Solver(lapy.TriaMesh(surface.points, surface.triangles), lump=False)
    ours = iv.fem(surface)
    assert abs(ours.stiffness - solver.stiffness).max() < 1e-12
    assert abs(ours.mass - solver.mass).max() < 1e-12


def test_folded_triangle_is_refused():
    """Oracle: analytic. A midpoint pulled across the opposite corner folds the element."""
    flat = patch(2)
    points = flat.points.copy()
    points[flat.triangles[0, 3]] = points[2] + (points[2] - points[0])
    with pytest.raises(iv.MeshError, match=r"M03") as caught:
        iv.fem(iv.Surface(points, flat.triangles))
    assert "got 1 degenerate or folded, first [0]" in str(caught.value)


def test_zero_area_triangle_is_refused():
    """Oracle: analytic. Three corners on a line have no metric."""
    line = iv.Surface([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]], normals=np.eye(3))
    with pytest.raises(iv.MeshError, match=r"M03"):
        iv.fem(line)


# ------------------------------------------------------------------ cotangent weights


def rough_surface():
    """A sphere squeezed and shaken: a quarter of its triangles are obtuse, none degenerate."""
    sphere = SURFACES["flat"]
    shaken = sphere.points + np.random.default_rng(31).uniform(-0.06, 0.06, sphere.points.shape)
    return iv.Surface(shaken * [1.0, 0.6, 1.7], sphere.triangles)


def obtuse_share(surface):
    corner = surface.points[surface.triangles]
    ahead, behind = np.roll(corner, 1, axis=1) - corner, np.roll(corner, -1, axis=1) - corner
    return ((ahead * behind).sum(axis=2) < 0).any(axis=1).mean()


def test_cotangent_equals_libigl():
    """Oracle: peer. Stiffness and mixed Voronoi areas of libigl, obtuse triangles too; to 1e-12."""
    igl = pytest.importorskip("igl", reason="libigl is not installed")
    surface = rough_surface()
    assert 0.2 < obtuse_share(surface) < 0.8
    ours = iv.cotangent(surface)
    points, triangles = surface.points.copy(), surface.triangles.copy()
    mass = igl.massmatrix(points, triangles, igl.MASSMATRIX_TYPE_VORONOI)
    assert abs(ours.stiffness + igl.cotmatrix(points, triangles)).max() < 1e-12
    assert abs(ours.mass - mass).max() < 1e-12


def test_cotangent_stiffness_is_that_of_linear_elements():
    """Oracle: algebra. Two ways to the same integrals, on a rough mesh."""
    surface = rough_surface()
    assert_close(iv.cotangent(surface).stiffness, iv.fem(surface).stiffness, 1e-13)


@pytest.mark.parametrize(
    ("triangle", "areas"),
    [
        ([[0, 0, 0], [4, 0, 0], [2, 1, 0]], [0.5, 0.5, 1.0]),  # obtuse: quarters and a half of 2
        ([[0, 0, 0], [2, 0, 0], [1, 2, 0]], [0.6875, 0.6875, 0.625]),  # circumcentre (1, 3/4)
    ],
)
def test_mixed_areas_by_hand(triangle, areas):
    """Oracle: analytic. Half at an obtuse corner; else the kites to the circumcentre."""
    mass = iv.cotangent(iv.Surface(triangle, [[0, 1, 2]])).mass
    np.testing.assert_allclose(mass.diagonal(), areas, rtol=1e-14)


def test_cotangent_refuses_a_triangle_without_area():
    """Oracle: analytic. Three corners on a line have no angles."""
    line = iv.Surface([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]], normals=np.eye(3))
    with pytest.raises(iv.MeshError, match=r"got 1 degenerate, first \[0\].*\[M03\]"):
        iv.cotangent(line)


def sheet(count):
    """Unit square of count x count cells, two triangles each."""
    u, v = (a.ravel() for a in np.meshgrid(*2 * [np.linspace(0, 1, count + 1)], indexing="ij"))
    i, j = (a.ravel() for a in np.meshgrid(*2 * [np.arange(count)], indexing="ij"))
    first = i * (count + 1) + j
    lower = np.stack([first, first + count + 1, first + count + 2], axis=1)
    upper = np.stack([first, first + count + 2, first + 1], axis=1)
    return iv.Surface(np.stack([u, v, 0 * u], axis=1), np.concatenate([lower, upper]))


def test_dirichlet_square():
    """Oracle: analytic. On a square lattice lambda_1 = (4 - 4 cos(pi h)) / h^2, near 2 pi^2."""
    square = sheet(12)
    laplacian = iv.cotangent(square, dirichlet=True)
    rim = rim_nodes(square.triangles)
    np.testing.assert_array_equal(np.sort(np.append(laplacian.unknowns, rim)), np.arange(169))
    pairs = iv.eigenpairs(laplacian, 1)
    assert pairs.values[0] == pytest.approx(4 * 144 * (1 - np.cos(np.pi / 12)), rel=1e-12)
    assert (pairs.vectors[rim] == 0).all()


# ------------------------------------------------------------------ robust


def three_sheets():
    """Three rough sheets that share an edge line: not a manifold there."""
    square = sheet(4)
    rng = np.random.default_rng(19)
    angle = np.array([0.0, 2.0, 4.0])
    across, along = square.points[5:, 0], square.points[5:, 1]  # the first five lie on the line
    across = across + rng.uniform(-0.05, 0.05, (3, 20))
    points = [np.stack([0 * along[:5], square.points[:5, 1], 0 * along[:5]], axis=1)]
    triangles = []
    for k in range(3):
        arm = [across[k] * np.cos(angle[k]), along, across[k] * np.sin(angle[k])]
        points.append(np.stack(arm, axis=1))
        shift = np.where(square.triangles < 5, 0, 20 * k)
        triangles.append(square.triangles + shift)
    return iv.Surface(np.concatenate(points), np.concatenate(triangles))


def test_robust_on_a_non_manifold_mesh():
    """Oracle: peer. robust_laplacian called directly: centring and scaling change nothing."""
    peer = pytest.importorskip("robust_laplacian", reason="robust_laplacian is not installed")
    surface = three_sheets()
    stiffness, mass = peer.mesh_laplacian(surface.points.copy(), surface.triangles.copy())
    ours = iv.robust(surface)
    assert_close(ours.stiffness, stiffness, 1e-12)
    assert_close(ours.mass, mass, 1e-12)
    assert ours.area == pytest.approx(surface.area, rel=1e-12)
    assert iv.eigenpairs(ours, 3).zero_count == 1


def test_robust_is_cotangent_on_a_delaunay_mesh():
    """Oracle: algebra. An icosphere's triangles are acute, so no edge is flipped."""
    surface = iv.icosphere(3, order=1)
    assert obtuse_share(surface) == 0
    assert_close(iv.robust(surface).stiffness, iv.cotangent(surface).stiffness, 1e-12)


def test_robust_has_no_negative_weights():
    """Oracle: algebra. Opposite angles of a Delaunay edge sum to at most 180 degrees."""
    surface = rough_surface()
    off = iv.robust(surface).stiffness.copy()
    off.setdiag(0)
    assert off.max() <= 1e-12
    off = iv.cotangent(surface).stiffness.copy()
    off.setdiag(0)
    assert off.max() > 0.1


def test_robust_survives_a_triangle_without_area():
    """Oracle: analytic. A sliver in a unit square: the area stays 1 but for its opening.

    Sides that are longer by d than a flat triangle's of length 1 make a height of about
    the root of d, here 3e-3.
    """
    points = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 0]]
    square = iv.Surface(points, [[0, 1, 2], [0, 2, 4], [0, 4, 3], [4, 2, 3]])
    with pytest.raises(iv.MeshError, match="M03"):
        iv.cotangent(square)
    laplacian = iv.robust(square)
    assert laplacian.area == pytest.approx(1, abs=5e-3)
    assert iv.eigenpairs(laplacian, 2).zero_count == 1
    line = iv.Surface([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]], normals=np.eye(3))
    with pytest.raises(iv.MeshError, match=r"use a `mollify` above 0 \[M03\]"):
        iv.robust(line, mollify=0)
    assert 0 < iv.robust(line).area < 5e-3


def test_robust_without_its_package(monkeypatch):
    """Oracle: analytic. The error names the package and the command."""
    real = builtins.__import__

    def absent(name, *rest):
        if name == "robust_laplacian":
            raise ImportError(name)
        return real(name, *rest)

    monkeypatch.setattr(builtins, "__import__", absent)
    with pytest.raises(iv.RunError, match=r"pip install robust_laplacian \[W10\]"):
        iv.robust(SURFACES["flat"])
    with pytest.raises(iv.ArgumentError, match=r"mollify: .* got -1 \[A02\]"):
        iv.robust(SURFACES["flat"], mollify=-1)


# ------------------------------------------------------------------ heat kernels


def test_mesh_laplacian_is_the_papers_sum():
    """Oracle: algebra. The sum of Belkin, Sun and Wang, triangle by triangle, on a rough mesh."""
    surface = rough_surface()
    time = 1.0  # the kernel reaches everything before it is cut
    stiffness = iv.mesh_laplacian(surface, time=time).stiffness.toarray()
    field = np.random.default_rng(8).standard_normal(len(surface.points))
    thirds = triangle_areas(surface.points, surface.triangles) / 3
    areas = iv.mesh_laplacian(surface).mass.diagonal()
    restored = 1 - (1 + CUT) * np.exp(-CUT)
    for node in (0, 17, 161):
        total = 0.0
        for third, triangle in zip(thirds, surface.triangles, strict=True):
            for corner in triangle:
                square = ((surface.points[corner] - surface.points[node]) ** 2).sum()
                assert square <= 4 * CUT * time
                total += third * np.exp(-square / (4 * time)) * (field[node] - field[corner])
        expected = total / (4 * np.pi * time**2) / restored
        assert (stiffness[node] @ field) / areas[node] == pytest.approx(expected, rel=1e-12)


def test_the_cut_kernel_keeps_its_second_moment():
    """Oracle: analytic. Inside a fine flat sheet L |x|^2 / 4 = -1, a Gaussian's second moment.

    2e-4: at the cut the kernel has fallen to exp(-9) = 1e-4; cut at exp(-4) it errs by 6e-3.
    """
    square = sheet(40)
    laplacian = iv.mesh_laplacian(square, time=(1.25 / 40) ** 2)  # reaches 0.19
    field = (square.points**2).sum(axis=1) / 4
    found = laplacian.stiffness @ field / laplacian.mass.diagonal()
    inside = (np.abs(square.points[:, :2] - 0.5) < 0.2).all(axis=1)
    np.testing.assert_allclose(found[inside], -1, rtol=2e-4)


def test_point_cloud_is_the_mesh_laplacian_with_its_own_areas():
    """Oracle: algebra. W_ij / (a_i a_j) is the same kernel, whatever the areas."""
    surface = rough_surface()
    first, second = iv.mesh_laplacian(surface, time=0.1), iv.point_cloud(surface, time=0.1)
    kernels = []
    for laplacian in (first, second):
        areas = laplacian.mass.diagonal()
        kernel = laplacian.stiffness.toarray() / np.outer(areas, areas)
        kernels.append(kernel[~np.eye(len(areas), dtype=bool)])
    np.testing.assert_allclose(*kernels, rtol=1e-12)
    assert abs(first.mass - second.mass).max() > 1e-3


def random_sphere(count, seed=5):
    points = np.random.default_rng(seed).standard_normal((count, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def test_areas_of_a_cloud():
    """Oracle: analytic. Random points of the unit sphere share 4 pi (2 %); lattices have cells."""
    assert cloud_areas(random_sphere(2000)).sum() == pytest.approx(4 * np.pi, rel=0.02)
    lattice = np.array([[i, 0.5 * j, 0.0] for i in range(8) for j in range(9)])
    np.testing.assert_allclose(cloud_areas(lattice).sum(), 28, rtol=1e-12)
    skew = lattice + np.outer(lattice[:, 1], [0.4, 0, 0])
    inside = (np.abs(lattice - [3.5, 2.0, 0]) < [2, 1.2, 1]).all(axis=1)
    np.testing.assert_allclose(cloud_areas(skew)[inside], 0.5, rtol=1e-12)


def test_point_cloud_of_random_points():
    """Oracle: analytic. lambda_1..3 = 2 and lambda_4..8 = 6 on random points of the sphere: 5 %."""
    values = iv.eigenpairs(iv.point_cloud(random_sphere(2000)), 9).values
    np.testing.assert_allclose(values[1:4], 2, rtol=0.05)
    np.testing.assert_allclose(values[4:9], 6, rtol=0.08)


def graded_sphere(ratio, subdivisions=4):
    """Icosphere under a conformal map: edges at one pole are so many times those at the other."""
    sphere = iv.icosphere(subdivisions, order=1)
    speed = (ratio - 1) / (ratio + 1)
    below = 1 + speed * sphere.points[:, 2]
    plane = sphere.points[:, :2] * np.sqrt(1 - speed**2) / below[:, None]
    return iv.Surface(np.c_[plane, (sphere.points[:, 2] + speed) / below], sphere.triangles)


@pytest.mark.parametrize("name", ["fem", "cotangent", "robust", "mesh_laplacian", "point_cloud"])
def test_uneven_nodes_are_no_shape(name):
    """Oracle: analytic. Edges graded 3:1 on a sphere: the HKS at t = 0.2 stays even, to 10 %."""
    pairs = iv.eigenpairs(METHODS[name][0](graded_sphere(3)), 60)
    signature = iv.heat_kernel_signature(pairs, np.array([0.2]))
    np.testing.assert_allclose(signature, sphere_signature(np.array([0.2]))[0], rtol=0.1)


@pytest.mark.parametrize(
    ("call", "code"),
    [
        (lambda: iv.mesh_laplacian(SURFACES["flat"], time=0.0), "A02"),
        (lambda: iv.point_cloud(random_sphere(50), neighbours=5), "A02"),
        (lambda: iv.point_cloud(random_sphere(20)), "A02"),
        (lambda: iv.point_cloud(np.zeros((9, 2))), "A03"),
        (lambda: iv.point_cloud(np.full((30, 3), np.nan)), "I01"),
        (lambda: iv.point_cloud(np.tile(random_sphere(30), (2, 1))), "M03"),
        (lambda: iv.point_cloud(np.outer(np.arange(30.0), [1, 2, 3])), "M03"),
        (lambda: iv.mesh_laplacian(SURFACES["flat"], time=1e-6), "S08"),
    ],
)
def test_what_a_kernel_cannot_do(call, code):
    """Oracle: analytic. Each of these has no answer, and says so."""
    with pytest.raises(iv.IsovaryError) as caught:
        call()
    assert caught.value.code == code


@pytest.mark.parametrize(
    "method",
    [room.fem, room.cotangent, room.uniform_graph, room.mesh_laplacian, room.robust],
)
def test_bare_points_have_no_triangles(method):
    """Oracle: algebra. The text names the operators that take points; the next step says so too."""
    with pytest.raises(iv.ArgumentError, match=r"surface: expected a Surface, got ndarray.*A03"):
        method(iv.icosphere(1).points)
    with pytest.raises(iv.ArgumentError, match=r"laplacian: expected a Laplacian, got Surface"):
        iv.eigenpairs(iv.icosphere(1), 4)
