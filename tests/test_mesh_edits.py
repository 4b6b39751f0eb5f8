"""Edges split, collapsed and flipped: the surface stays what it was, whatever is asked."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import Delaunay

import isovary as iv
from isovary.geometry import edges_of, frozen, node_normals, rim_nodes
from isovary.meshing._edits import collapse, compact, edges_with_sides, flip, split

WIDTH, HEIGHT = 2.0, 1.0
MESHES = {
    "icosphere": iv.icosphere(2, order=1),
    "torus": iv.torus(1.0, 0.4, (20, 9), order=1),
    "cylinder": iv.cylinder(0.5, HEIGHT, (14, 6), order=1),
    "sheet": iv.sheet(WIDTH, HEIGHT, (10, 6), order=1),
}
every_mesh = pytest.mark.parametrize("name", MESHES)


def mesh_of(name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points and triangles that cannot be written to, and ranks: 1 on rims, 2 at corners."""
    surface = MESHES[name]
    rank = np.zeros(len(surface.points), dtype=np.int64)
    rank[rim_nodes(surface.triangles)] = 1
    rank[is_corner(surface.points)] = 2 if name == "sheet" else 0
    return surface.points, surface.triangles, rank


def is_corner(points: np.ndarray) -> np.ndarray:
    x, y, _ = points.T
    return (np.abs(x) == WIDTH / 2) & ((y == 0) | (y == HEIGHT))


def on_rim_curve(name: str, points: np.ndarray) -> np.ndarray:
    """Whether points lie on the rims of the mesh that they come from, to the last bit."""
    x, y, z = points.T
    if name == "cylinder":
        return (z == 0) | (z == HEIGHT)
    return (z == 0) & ((np.abs(x) == WIDTH / 2) | (y == 0) | (y == HEIGHT))


def check_manifold(triangles: np.ndarray, topology: iv.Topology) -> None:
    """Every directed edge once, every edge at most twice, one fan of triangles at each vertex."""
    size = int(triangles.max()) + 1
    a, b, c = triangles.T
    directed = np.concatenate([a * size + b, b * size + c, c * size + a])
    assert len(np.unique(directed)) == len(directed), "an edge runs the same way twice"
    assert edges_of(triangles)[2].max() <= 2
    assert len(np.unique(np.sort(triangles, axis=1), axis=0)) == len(triangles), "doubled"
    hub = triangles.ravel()
    ends = [np.roll(triangles, -k, axis=1).ravel() for k in (1, 2)]
    spokes, place = np.unique(hub * size + np.array(ends), return_inverse=True)
    i, j = place.reshape(2, -1)
    links = coo_array((np.ones(len(i)), (i, j)), shape=(len(spokes),) * 2)
    assert connected_components(links)[0] == len(np.unique(triangles)), "fans share a vertex"
    assert iv.topology(triangles) == topology


def volume(points: np.ndarray, triangles: np.ndarray) -> float:
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return float(np.einsum("nd,nd->", a, np.cross(b, c)) / 6)


# ------------------------------------------------------------------ edges


@every_mesh
def test_edges_know_their_sides(name):
    """Oracle: algebra. The edges of geometry.edges_of, and each side found by a plain search."""
    _, triangles, _ = mesh_of(name)
    edges = edges_with_sides(triangles)
    ends, _, counts = edges_of(triangles)
    np.testing.assert_array_equal(edges.ends, ends)
    np.testing.assert_array_equal(edges.on_rim, counts == 1)
    around = [set(t) for t in triangles.tolist()]
    cyclic = [{(t[0], t[1]), (t[1], t[2]), (t[2], t[0])} for t in triangles.tolist()]
    for (i, j), sides, opposite, forward in zip(
        edges.ends.tolist(), edges.triangles, edges.opposite, edges.forward, strict=True
    ):
        found = {k for k, corners in enumerate(around) if {i, j} <= corners}
        assert found == set(sides[sides >= 0].tolist())
        for side, tip in zip(sides[sides >= 0], opposite, strict=False):
            assert around[side] == {i, j, tip}
        assert ((i, j) if forward else (j, i)) in cyclic[sides[0]]


def test_compact_drops_what_is_not_used():
    """Oracle: algebra. A triangle that names a point twice goes, with the points only it had."""
    points = np.arange(15.0).reshape(5, 3)
    kept, triangles, old = compact(points, np.array([[0, 4, 4], [4, 1, 3]]))
    np.testing.assert_array_equal(old, [1, 3, 4])
    np.testing.assert_array_equal(kept, points[[1, 3, 4]])
    np.testing.assert_array_equal(triangles, [[2, 0, 1]])


# ------------------------------------------------------------------ long sequences


@pytest.mark.parametrize("seed", range(3))
@every_mesh
def test_long_random_sequences_keep_the_surface(name, seed):
    """Oracle: algebra. Manifold, topology and orientation, rims and corners, after each change."""
    random = np.random.default_rng(seed)
    points, triangles, rank = mesh_of(name)
    topology, sign = iv.topology(triangles), np.sign(volume(points, triangles))
    if seed % 2 and name != "sheet":  # uneven inside, even the rims as they were
        jitter = 0.03 * random.normal(size=points.shape)
        points = frozen(points + np.where(rank[:, None] > 0, 0.0, jitter))
    sheet_area = MESHES["sheet"].area
    for _ in range(30):
        before, most = len(points), int(random.integers(1, 60))
        edges = edges_with_sides(triangles)
        wish = random.normal(size=len(edges.ends)) + random.choice([-1.0, 0.0, 5.0])
        kind = "split" if before < 40 else random.choice(["split", "collapse", "flip"])
        if kind == "split" and before < 600:
            points, triangles, halved = split(points, triangles, wish, edges, most)
            assert len(points) - before == len(halved) <= most
            assert len(np.unique(edges.triangles[halved])) >= len(halved)
            rank = np.append(rank, edges.on_rim[halved].astype(np.int64))
        elif kind == "collapse":
            longest = np.full(before, np.inf)
            points, triangles, old = collapse(
                points, triangles, node_normals(points, triangles), wish, edges, rank, longest, most
            )
            assert 0 <= before - len(points) <= most
            rank = rank[old]
        else:
            normals = node_normals(points, triangles)
            triangles, _ = flip(points, triangles, normals)
        points, triangles, rank = frozen(points), frozen(triangles, np.int64), frozen(rank, int)
        check_manifold(triangles, topology)
        rim = rim_nodes(triangles)
        np.testing.assert_array_equal(np.flatnonzero(rank), rim)
        assert on_rim_curve(name, points[rim]).all()
        if name == "sheet":
            assert is_corner(points).sum() == 4
            a, b, c = (points[triangles[:, k], :2] for k in range(3))
            doubled = np.linalg.det(np.stack([b - a, c - a], axis=1))
            assert (doubled > 0).all()
            assert doubled.sum() / 2 == pytest.approx(sheet_area, rel=1e-12)
        elif name != "cylinder":
            assert np.sign(volume(points, triangles)) == sign


@every_mesh
def test_collapses_end_at_the_smallest_mesh_of_the_surface(name):
    """Oracle: analytic. All edges asked to go, again and again: no sphere below 4 vertices, no
    torus below 7, no cylinder below 6, no rectangle below its 4 corners; and never another
    topology.
    """
    least = {"icosphere": 4, "torus": 7, "cylinder": 6, "sheet": 4}[name]
    points, triangles, rank = mesh_of(name)
    topology, random = iv.topology(triangles), np.random.default_rng(7)
    for _ in range(60):
        edges = edges_with_sides(triangles)
        lack = random.uniform(1, 2, len(edges.ends))
        longest = np.full(len(points), np.inf)
        points, triangles, old = collapse(
            points,
            triangles,
            node_normals(points, triangles),
            lack,
            edges,
            rank,
            longest,
            len(points),
        )
        rank = rank[old]
        check_manifold(triangles, topology)
        assert len(points) >= least
    assert len(points) < len(MESHES[name].points) / 3


@pytest.mark.parametrize(
    "triangles",
    [
        [[0, 1, 2]],
        [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]],
        [[0, 1, 3], [0, 2, 1], [0, 3, 2]],
    ],
    ids=["triangle", "tetrahedron", "cup"],
)
def test_the_smallest_meshes_cannot_vanish(triangles):
    """Oracle: analytic. A triangle is the smallest disk, a tetrahedron the smallest sphere; one
    without its base may become a triangle, but no less.
    """
    points = np.array([[0.0, 0, 1], [1, 0, 0], [-0.5, 0.9, 0], [-0.5, -0.9, 0]])
    triangles = np.array(triangles)
    points = points[: triangles.max() + 1]
    topology = iv.topology(triangles)
    for _ in range(3):
        edges = edges_with_sides(triangles)
        rank = np.zeros(len(points), dtype=np.int64)
        rank[rim_nodes(triangles)] = 1
        points, triangles, _ = collapse(
            points,
            triangles,
            node_normals(points, triangles),
            np.arange(1.0, len(edges.ends) + 1),
            edges,
            rank,
            np.full(len(points), np.inf),
            9,
        )
        assert len(triangles) > 0
        check_manifold(triangles, topology)


# ------------------------------------------------------------------ what each is asked


@every_mesh
def test_the_greatest_excess_is_split_first(name):
    """Oracle: algebra. One edge only: the longest, its middle a new point, its length halved."""
    points, triangles, _ = mesh_of(name)
    edges = edges_with_sides(triangles)
    excess = np.random.default_rng(3).permutation(len(edges.ends)) - 5.0
    more, replaced, halved = split(points, triangles, excess, edges, 1)
    assert halved.tolist() == [int(excess.argmax())]
    np.testing.assert_array_equal(more[:-1], points)
    np.testing.assert_array_equal(more[-1], points[edges.ends[halved[0]]].mean(axis=0))
    assert len(replaced) == len(triangles) + 2 - edges.on_rim[halved[0]]
    flat = iv.Surface(more, replaced)
    assert flat.area == pytest.approx(iv.Surface(points, triangles).area, rel=1e-12)
    many, _, several = split(points, triangles, excess, edges, len(edges.ends))
    assert (excess[several] > 0).all()
    assert len(many) == len(points) + len(several)


def test_the_greatest_lack_collapses_first():
    """Oracle: algebra. Two equal ends meet in the middle; the higher rank stays where it is."""
    points, triangles, rank = mesh_of("sheet")
    edges = edges_with_sides(triangles)
    longest = np.full(len(points), np.inf)
    ranks = rank[edges.ends]
    for wanted in ((0, 0), (0, 1), (1, 1), (1, 2)):
        fits = (np.sort(ranks, axis=1) == wanted).all(axis=1)
        if wanted == (1, 1):
            fits &= edges.on_rim
        edge = int(np.flatnonzero(fits)[len(np.flatnonzero(fits)) // 2])
        lack = np.where(np.arange(len(fits)) == edge, 2.0, 0.0)
        fewer, _, old = collapse(
            points, triangles, node_normals(points, triangles), lack, edges, rank, longest, 5
        )
        assert len(fewer) == len(points) - 1
        ends = edges.ends[edge]
        if wanted[0] == wanted[1]:
            expected = points[ends].mean(axis=0)
        else:
            expected = points[ends[ranks[edge].argmax()]]
        assert (fewer == expected).all(axis=1).sum() == 1
        others = np.setdiff1d(np.arange(len(points)), ends)
        assert set(others) <= set(old.tolist())


def test_collapses_leave_no_edge_too_long():
    """Oracle: algebra. No new edge exceeds the limits at its ends."""
    points, triangles, rank = mesh_of("icosphere")
    random = np.random.default_rng(11)
    longest = np.full(len(points), 0.45)
    for _ in range(30):
        edges = edges_with_sides(triangles)
        lack = random.uniform(0.1, 1, len(edges.ends))
        points, triangles, old = collapse(
            points, triangles, node_normals(points, triangles), lack, edges, rank, longest, 20
        )
        longest, rank = longest[old], rank[old]
    i, j = edges_of(triangles)[0].T
    length = np.linalg.norm(points[i] - points[j], axis=1)
    assert length.max() <= 0.45
    assert len(points) < 140


def test_collapses_turn_no_triangle_over():
    """Oracle: analytic. Flat star around an end behind a notch: the middle would fold it."""
    points = np.array(
        [[0.0, 0, 0], [1, 0, 0], [0.9, 0.05, 0], [1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]]
    )
    hull = Delaunay(points[:, :2]).simplices.astype(np.int64)
    a, b, c = (points[hull[:, k], :2] for k in range(3))
    turned = np.linalg.det(np.stack([b - a, c - a], axis=1)) < 0
    hull[turned] = hull[turned][:, ::-1]
    rank = np.array([0, 1, 0, 2, 2, 2, 2])
    edges = edges_with_sides(hull)
    for edge in range(len(edges.ends)):
        lack = np.where(np.arange(len(edges.ends)) == edge, 1.0, 0.0)
        fewer, left, _ = collapse(
            points, hull, node_normals(points, hull), lack, edges, rank, np.full(7, np.inf), 1
        )
        a, b, c = (fewer[left[:, k], :2] for k in range(3))
        assert (np.linalg.det(np.stack([b - a, c - a], axis=1)) > 0).all()


# ------------------------------------------------------------------ flips


@pytest.mark.parametrize("seed", range(5))
def test_flips_end_at_the_delaunay_triangulation(seed):
    """Oracle: peer. scipy.spatial.Delaunay of the same points, from that of stretched ones."""
    random = np.random.default_rng(seed)
    flat = random.uniform(size=(120, 2))
    points = np.column_stack([flat, np.zeros(120)])
    triangles = Delaunay(flat * [1, 9]).simplices.astype(np.int64)
    a, b, c = (flat[triangles[:, k]] for k in range(3))
    turned = np.linalg.det(np.stack([b - a, c - a], axis=1)) < 0
    triangles[turned] = triangles[turned][:, ::-1]
    normals = np.tile([0.0, 0, 1], (120, 1))
    topology = iv.topology(triangles)
    for _ in range(200):
        triangles, flips = flip(points, triangles, normals)
        check_manifold(triangles, topology)
        if flips == 0:
            break
    found = {tuple(t) for t in np.sort(triangles, axis=1).tolist()}
    assert found == {tuple(t) for t in np.sort(Delaunay(flat).simplices, axis=1).tolist()}


def test_flips_make_no_edge_twice():
    """Oracle: algebra. Turning the flat base of a tetrahedron would double its other edge."""
    points = np.array([[0.0, 0, 0.01], [1, 0, 0], [-0.5, 0.9, 0], [-0.5, -0.9, 0]])
    triangles = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
    for normals in (node_normals(points, triangles), -points, points):
        turned, _ = flip(points, triangles, normals)
        check_manifold(turned, iv.Topology(1, 0, 2, 0))
