"""The graph Laplacians: their common scale, their edges, and when they refuse or warn."""

from __future__ import annotations

import re

import numpy as np
import pytest
from conftest import ELLIPSOID_ISOVALUE, ellipsoid_field
from oracles import sphere_signature
from scipy.sparse.csgraph import minimum_spanning_tree
from scipy.spatial.distance import pdist, squareform

import isovary as iv
from isovary.geometry import edges_of, linear_triangles
from isovary.laplacian._graph import connecting_radius
from isovary.laplacian._sites import Sites

GRAPHS = {"uniform": iv.uniform_graph, "knn": iv.knn_graph, "epsilon": iv.epsilon_graph}
every_graph = pytest.mark.parametrize("graph", GRAPHS.values(), ids=GRAPHS)


def lattice(count=7):
    """count x count points of a square lattice of step 1."""
    return np.array([[float(i), float(j), 0.0] for i in range(count) for j in range(count)])


def off_diagonal(laplacian):
    weights = -laplacian.stiffness.toarray()
    np.fill_diagonal(weights, 0)
    return weights


# ------------------------------------------------------------------ the scale


@pytest.mark.parametrize("random_walk", [False, True])
@pytest.mark.parametrize("order", [1, 2])
@every_graph
def test_energy_of_the_coordinates(graph, order, random_walk):
    """Oracle: algebra. trace(X^T stiffness X) = 2 area, as for linear elements; mass sums to it."""
    field = ellipsoid_field((1.0, 0.8, 1.3), samples=17)
    surface = iv.marching_cubes(field, ELLIPSOID_ISOVALUE, vertices=150, order=order)
    laplacian = graph(surface, random_walk=random_walk)
    x = surface.points
    assert np.trace(x.T @ (laplacian.stiffness @ x)) == pytest.approx(2 * surface.area, rel=1e-12)
    assert laplacian.area == pytest.approx(surface.area, rel=1e-12)
    if order == 1:
        elements = iv.fem(surface).stiffness
        assert np.trace(x.T @ (elements @ x)) == pytest.approx(2 * surface.area, rel=1e-12)


def test_equilateral_triangles_get_the_cotangent_weight():
    """Oracle: analytic. On an icosahedron each weight is 1/sqrt(3) = (cot 60 + cot 60)/2."""
    solid = iv.icosphere(0, order=1)
    weights = off_diagonal(iv.uniform_graph(solid))
    np.testing.assert_allclose(weights[weights > 0], 1 / 3**0.5, rtol=1e-12)
    np.testing.assert_allclose(weights, off_diagonal(iv.cotangent(solid)), atol=1e-12)


@pytest.mark.parametrize("random_walk", [False, True])
@every_graph
def test_lambda_2_of_a_sphere(graph, random_walk):
    """Oracle: analytic. Coordinates have the mean Rayleigh quotient 2; each one, to 2 %."""
    sphere = iv.icosphere(4, order=1)
    laplacian = graph(sphere, random_walk=random_walk)
    x = sphere.points
    energy, moment = (np.trace(x.T @ (m @ x)) for m in (laplacian.stiffness, laplacian.mass))
    assert energy / moment == pytest.approx(2, rel=1e-12)
    np.testing.assert_allclose(iv.eigenpairs(laplacian, 4).values[1:], 2, rtol=0.02)


@every_graph
def test_random_walk(graph):
    """Oracle: algebra. mass^-1 stiffness is a multiple of I - D^-1 W: equal diagonal, 0 rows."""
    surface = iv.icosphere(2, order=1)
    walk, plain = graph(surface, random_walk=True), graph(surface)
    operator = walk.stiffness.toarray() / walk.mass.diagonal()[:, None]
    diagonal = operator.diagonal()
    np.testing.assert_allclose(diagonal, diagonal[0], rtol=1e-12)
    assert abs(walk.stiffness - plain.stiffness).max() < 1e-12
    np.testing.assert_allclose(plain.mass.diagonal(), surface.area / 162, rtol=1e-12)


# ------------------------------------------------------------------ the edges


def test_uniform_graph_has_the_edges_of_the_flat_pieces():
    """Oracle: algebra. Equal weights on the edges of the mesh, none elsewhere."""
    surface = iv.icosphere(1)
    weights = off_diagonal(iv.uniform_graph(surface))
    edges = edges_of(linear_triangles(surface.triangles))[0]
    expected = np.zeros_like(weights)
    expected[edges[:, 0], edges[:, 1]] = expected[edges[:, 1], edges[:, 0]] = weights.max()
    np.testing.assert_array_equal(weights, expected)


def test_uniform_graph_of_the_nearest():
    """Oracle: algebra. A fan with uneven spokes: an edge stays if it is an end's shortest."""
    angles, lengths = np.array([0.0, 0.6, 1.5, 3.0, 4.5]), np.array([1.0, 1.2, 1.4, 1.1, 1.3])
    rim = np.stack([lengths * np.cos(angles), lengths * np.sin(angles), 0 * angles], axis=1)
    fan = iv.Surface(np.vstack([[0.0, 0, 0], rim]), [[0, k, k % 5 + 1] for k in range(1, 6)])
    weights = off_diagonal(iv.uniform_graph(fan, nearest=1))
    distances = np.where(off_diagonal(iv.uniform_graph(fan)) > 0, squareform(pdist(fan.points)), 9)
    expected = np.zeros((6, 6), dtype=bool)
    expected[np.arange(6), distances.argmin(axis=1)] = True
    np.testing.assert_array_equal(weights > 0, expected | expected.T)
    assert 5 < (weights > 0).sum() < 20  # neither only spokes nor everything
    whole = iv.uniform_graph(fan)
    assert abs(iv.uniform_graph(fan, nearest=5).stiffness - whole.stiffness).max() < 1e-15


@pytest.mark.parametrize(("neighbours", "degree"), [(4, 4), (5, 8), (8, 8), (9, 12)])
def test_knn_on_a_lattice(neighbours, degree):
    """Oracle: analytic. Rings of 4, 4, 4 points at 1, sqrt 2, 2; a ring stays whole, or is out."""
    weights = off_diagonal(iv.knn_graph(lattice(11), neighbours, heat=None))
    middle = weights[60]
    assert (middle > 0).sum() == degree
    np.testing.assert_allclose(middle[middle > 0], middle.max(), rtol=1e-12)


def test_an_edge_stays_if_either_end_keeps_it():
    """Oracle: analytic. A lonely point names the lattice's corner, which does not name it."""
    points = np.vstack([lattice(), [[-1.5, -1.5, 0.0]]])
    weights = off_diagonal(iv.knn_graph(points, 3, heat=None))
    np.testing.assert_array_equal(np.flatnonzero(weights[49]), [0, 1, 7])
    assert weights[0, 49] == weights[49, 0] > 0


@pytest.mark.parametrize("heat", [1.0, 0.3])
def test_heat_weights(heat):
    """Oracle: analytic. Within radius 1.5 a lattice has d^2 = 1 (84 edges) and 2 (72 edges)."""
    points = lattice()
    mean = (84 * 1 + 72 * 2) / (84 + 72)
    weights = off_diagonal(iv.epsilon_graph(points, 1.5, heat=heat))
    assert (weights > 0).sum() == 2 * (84 + 72)
    assert weights[24, 25] / weights[24, 32] == pytest.approx(np.exp(1 / (heat * mean)), rel=1e-12)
    binary = off_diagonal(iv.epsilon_graph(points, 1.5, heat=None))
    assert binary[24, 25] == pytest.approx(binary[24, 32], rel=1e-12)


@pytest.mark.parametrize(("radius", "degree"), [(1.0, 4), (1.4, 4), (1.42, 8), (2.0, 12)])
def test_epsilon_on_a_lattice(radius, degree):
    """Oracle: analytic. Points at 1, sqrt 2 and 2; a point at the radius counts."""
    weights = off_diagonal(iv.epsilon_graph(lattice(), radius))
    assert (weights[24] > 0).sum() == degree


def test_default_radius_is_four_edges():
    """Oracle: analytic. All edges of an icosahedron are equal, and 4 of them reach all 12 nodes."""
    solid = iv.icosphere(1, order=1)
    edges = edges_of(solid.triangles)[0]
    mean = np.linalg.norm(solid.points[edges[:, 0]] - solid.points[edges[:, 1]], axis=1).mean()
    default, explicit = iv.epsilon_graph(solid), iv.epsilon_graph(solid, 4 * mean)
    assert abs(default.stiffness - explicit.stiffness).max() < 1e-12


def test_bare_points_have_the_area_of_their_cells():
    """Oracle: analytic. 7 x 7 lattice points: area 36, shared equally, and twice it as energy."""
    points = lattice()
    laplacian = iv.knn_graph(points, 8)
    np.testing.assert_allclose(laplacian.mass.diagonal(), 36 / 49, rtol=1e-12)
    energy = np.trace(points.T @ (laplacian.stiffness @ points))
    assert energy == pytest.approx(72, rel=1e-12)


# ------------------------------------------------------------------ components


def two_spheres(gap):
    """Two unit spheres with a gap between them."""
    sphere = iv.icosphere(2, order=1)
    shifted = sphere.points + np.array([2 + gap, 0, 0])
    return iv.Surface(
        np.vstack([sphere.points, shifted]), np.vstack([sphere.triangles, sphere.triangles + 162])
    )


def test_two_components_have_two_zeros():
    """Oracle: algebra. A graph with the surface's components, and no more."""
    for graph in (iv.uniform_graph, iv.epsilon_graph, iv.mesh_laplacian, iv.point_cloud):
        assert iv.eigenpairs(graph(two_spheres(3.0)), 5).zero_count == 2


def test_a_graph_that_falls_apart_names_the_radius_that_connects():
    """Oracle: algebra. The radius of the message connects; 1 % less does not."""
    surface = two_spheres(3.0)
    with pytest.raises(iv.SpectrumError, match=r"expected 2 component\(s\), got 324.*\[S08\]") as e:
        iv.epsilon_graph(surface, 0.1)
    radius = float(re.search(r"from the radius ([\d.]+) on", str(e.value))[1])
    iv.epsilon_graph(surface, radius)
    with pytest.raises(iv.SpectrumError, match="S08"):
        iv.epsilon_graph(surface, 0.99 * radius)


def test_a_graph_that_bridges_a_gap_is_refused():
    """Oracle: analytic. Spheres 0.1 apart, edges of 0.3: the default radius joins them."""
    surface = two_spheres(0.1)
    for graph, remedy in (
        (iv.epsilon_graph, "use a smaller radius"),
        (iv.knn_graph, "use fewer neighbours"),
        (iv.mesh_laplacian, "use a time of less than"),
    ):
        with pytest.raises(iv.SpectrumError, match=rf"bridges a gap.*{remedy}.*\[S08\]"):
            graph(surface)


def test_as_many_parts_but_not_the_same():
    """Oracle: analytic. One strip torn in two, one half joined to the other: two parts, refused."""
    row = np.array([[x, y, 0.0] for x in (0.0, 1.0, 11.0, 12.0) for y in (0.0, 1.0)])
    cells = [[[k, k + 2, k + 1], [k + 1, k + 2, k + 3]] for k in (0, 2, 4)]
    above = row[:4] + np.array([0, 0, 0.5])
    triangles = np.concatenate([*cells, np.array(cells[0]) + 8])
    surface = iv.Surface(np.vstack([row, above]), triangles)
    with pytest.raises(iv.SpectrumError, match=r"between the 2 .*, got 2 components.*\[S08\]"):
        iv.epsilon_graph(surface, 1.6)


def test_neighbours_that_do_not_connect():
    """Oracle: analytic. Two lattices 20 apart; four neighbours stay at home."""
    points = np.vstack([lattice(), lattice() + np.array([26.0, 0, 0])])
    with pytest.raises(iv.SpectrumError, match=r"got 2; use more neighbours.*20\.02.*\[S08\]"):
        iv.knn_graph(points, 4)
    iv.knn_graph(points, 52)
    strip = iv.Surface([[0, 0, 0], [0, 1, 0], [3, 0, 0], [3, 1, 0]], [[0, 2, 1], [1, 2, 3]])
    with pytest.raises(iv.SpectrumError, match=r"got 2; use a larger `nearest`.*\[S08\]"):
        iv.uniform_graph(strip, nearest=1)


def test_connecting_radius_is_the_spanning_trees_longest_edge():
    """Oracle: peer. SciPy's minimum spanning tree of all distances, part by part."""
    points = np.random.default_rng(61).standard_normal((120, 3))
    parts = np.repeat([0, 1], 60)
    found = connecting_radius(Sites(points, np.ones(120), 1.0, np.ones(120), 1.0, parts))
    trees = [minimum_spanning_tree(squareform(pdist(points[parts == k]))) for k in (0, 1)]
    assert found == pytest.approx(max(tree.max() for tree in trees), rel=1e-12)


@pytest.mark.parametrize(
    ("call", "code"),
    [
        (lambda: iv.knn_graph(lattice(), 0), "A02"),
        (lambda: iv.knn_graph(lattice(), 49), "A02"),
        (lambda: iv.knn_graph(lattice(), 8, heat=0.0), "A02"),
        (lambda: iv.epsilon_graph(lattice(), -1.0), "A02"),
        (lambda: iv.epsilon_graph(lattice(), heat=np.inf), "A02"),
        (lambda: iv.epsilon_graph(np.zeros(3)), "A03"),
        (lambda: iv.uniform_graph(iv.icosphere(0), nearest=0), "A02"),
    ],
)
def test_arguments_out_of_range(call, code):
    """Oracle: analytic. The text says what is expected."""
    with pytest.raises(iv.ArgumentError, match=rf"expected .*, got .*\[{code}\]"):
        call()


def test_the_largest_number_of_neighbours():
    """Oracle: analytic. All others: the complete graph."""
    weights = off_diagonal(iv.knn_graph(lattice(), 48))
    assert (weights > 0).sum() == 49 * 48


# ------------------------------------------------------------------ density


def graded(ratio):
    """Icosphere under a conformal map: edges at one pole are so many times those at the other."""
    sphere = iv.icosphere(3, order=1)
    speed = (ratio - 1) / (ratio + 1)
    below = 1 + speed * sphere.points[:, 2]
    plane = sphere.points[:, :2] * np.sqrt(1 - speed**2) / below[:, None]
    return iv.Surface(np.c_[plane, (sphere.points[:, 2] + speed) / below], sphere.triangles)


@every_graph
def test_graded_density_warns(graph):
    """Oracle: data. Edges graded 3:1, and the message tells what does not mind."""
    with pytest.warns(UserWarning, match=r"see the density .* fem and cotangent do not \[L01\]$"):
        graph(graded(3))


@pytest.mark.parametrize("graph", [iv.knn_graph, iv.epsilon_graph])
def test_graded_density_spoils_the_signature(graph):
    """Oracle: analytic. Edges graded 3:1 on a sphere: the HKS at t = 0.2 is off by over half.

    (Not for the uniform graph: it takes this conformal image of an even sphere for that.)
    """
    with pytest.warns(UserWarning, match="L01"):
        pairs = iv.eigenpairs(graph(graded(3)), 60)
    time = np.array([0.2])
    signature = iv.heat_kernel_signature(pairs, time)
    assert np.abs(signature / sphere_signature(time) - 1).max() > 0.5


def test_graded_bare_points_warn():
    """Oracle: analytic. The same without triangles."""
    with pytest.warns(UserWarning, match=r"\[L01\]$") as caught:
        iv.knn_graph(graded(3).points)
    assert caught[0].filename == __file__


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("axes", [(1.0, 1.0, 1.0), (1.0, 1.0, 0.5), (1.0, 1.0, 2.0)])
def test_even_density_does_not_warn(axes, order):
    """Oracle: data. Remeshed isosurfaces and their nodes (warnings are errors here)."""
    field = ellipsoid_field(axes)
    surface = iv.marching_cubes(field, ELLIPSOID_ISOVALUE, vertices=400, order=order)
    iv.uniform_graph(surface)
    iv.epsilon_graph(surface.points)


def test_rims_and_random_points_do_not_warn():
    """Oracle: data. Nodes of a rim have half the area; random points have cells of all sizes."""
    points = np.random.default_rng(5).standard_normal((2000, 3))
    iv.knn_graph(points / np.linalg.norm(points, axis=1, keepdims=True))
    field = iv.ScalarField.from_function(
        lambda p: p[..., 2] + 0.2 * np.sin(3 * p[..., 0]), ((-1, -1, -1), (1, 1, 1)), (17, 17, 17)
    )
    open_surface = iv.marching_cubes(field, 0.0, vertices=150)
    iv.uniform_graph(open_surface)


# ------------------------------------------------------------------ differential coordinates


@pytest.mark.parametrize("random_walk", [False, True])
def test_differential_coordinates_are_the_neighbours_mean(ellipsoid, random_walk):
    """Oracle: algebra. v_i minus the mean of its neighbours; L x = D delta."""
    laplacian = iv.uniform_graph(ellipsoid, random_walk=random_walk)
    delta = iv.differential_coordinates(laplacian, ellipsoid.points)
    edges = edges_of(linear_triangles(ellipsoid.triangles))[0]
    for node in (0, 200, len(ellipsoid.points) - 1):
        near = np.append(edges[edges[:, 0] == node, 1], edges[edges[:, 1] == node, 0])
        expected = ellipsoid.points[node] - ellipsoid.points[near].mean(axis=0)
        np.testing.assert_allclose(delta[node], expected, atol=1e-14)


def test_differential_coordinates_far_away(ellipsoid):
    """Oracle: symmetry. Points in steps of 2^-20 can be shifted by 2^20 exactly: 1e-13 stays."""
    laplacian = iv.uniform_graph(ellipsoid)
    points = np.round(ellipsoid.points * 2**20) / 2**20
    near, far = (iv.differential_coordinates(laplacian, points + s) for s in (0.0, 2.0**20))
    np.testing.assert_allclose(far, near, atol=1e-13)


def test_mean_curvature_normal_of_a_sphere():
    """Oracle: analytic. 2 H n = 2 x on the unit sphere with the cotangent operator: 1 %."""
    sphere = iv.icosphere(3, order=1)
    found = iv.differential_coordinates(iv.cotangent(sphere), sphere.points, per_area=True)
    np.testing.assert_allclose(found, 2 * sphere.points, atol=0.02)


def test_cotangent_coordinates_are_the_gradient_of_the_area(ellipsoid):
    """Oracle: algebra. stiffness x = d area / d x: central differences at one node, to 1e-8."""
    surface = iv.Surface(ellipsoid.points, linear_triangles(ellipsoid.triangles))
    laplacian = iv.cotangent(surface)
    found = iv.differential_coordinates(laplacian, surface.points, per_area=True)
    node, step = 7, 1e-5
    for axis in range(3):
        areas = []
        for sign in (1, -1):
            points = surface.points.copy()
            points[node, axis] += sign * step
            areas.append(iv.Surface(points, surface.triangles).area)
        slope = (areas[0] - areas[1]) / (2 * step)
        assert found[node, axis] * laplacian.mass.diagonal()[node] == pytest.approx(slope, abs=1e-8)


def test_differential_coordinates_need_all_nodes(ellipsoid):
    """Oracle: analytic. Fixed nodes, or points of another surface, are refused."""
    laplacian = iv.uniform_graph(ellipsoid)
    with pytest.raises(iv.ArgumentError, match="A03"):
        iv.differential_coordinates(laplacian, ellipsoid.points[1:])
    with pytest.raises(iv.ArgumentError, match=r"and 1 fixed.*A03"):
        iv.differential_coordinates(iv.fix_nodes(laplacian, [0]), ellipsoid.points)


def test_area_coordinates_need_a_diagonal_mass():
    """Oracle: algebra. Row sums of a quadratic mass are no areas: nearly 0 at corners."""
    surface = iv.icosphere(1)
    with pytest.raises(iv.ArgumentError, match=r"laplacian: expected a diagonal mass.*A02"):
        iv.differential_coordinates(iv.fem(surface), surface.points, per_area=True)


def test_few_bare_points_are_enough_for_few_neighbours():
    """Oracle: algebra. 15 points of a lattice, the neighbours that were asked for; not 7 points."""
    lattice = np.array([[i, j, 0.0] for i in range(5) for j in range(3)])
    assert iv.knn_graph(lattice, 4).nodes == 15
    with pytest.raises(iv.ArgumentError, match=r"points: expected at least 8.*got 7"):
        iv.knn_graph(lattice[:7], 4)
    with pytest.raises(iv.ArgumentError, match=r"neighbours: .* got 4\.5"):
        iv.knn_graph(lattice, 4.5)


def test_the_remedy_of_a_torn_kernel_connects_it():
    """Oracle: algebra. The time that the text names is enough, a tenth less is not."""
    surface = iv.icosphere(2, order=1)
    with pytest.raises(iv.SpectrumError, match="S08") as caught:
        iv.mesh_laplacian(surface, time=1e-6)
    named = float(str(caught.value).split("a time of at least ")[1].split()[0])
    assert iv.mesh_laplacian(surface, time=1.01 * named).nodes == 162
    with pytest.raises(iv.SpectrumError, match="S08"):
        iv.mesh_laplacian(surface, time=0.9 * named)
