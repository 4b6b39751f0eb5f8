"""Rims: fixed nodes, where a rim shows, and what a comparison says of it."""

from __future__ import annotations

import numpy as np
import pytest

import isovary as iv
from isovary.geometry import rim_nodes


def strip(order):
    """A flat strip of eight triangles, 4 x 1."""
    x, y = (a.ravel() for a in np.meshgrid(np.arange(5.0), [0.0, 1.0], indexing="ij"))
    lower = 2 * np.arange(4)
    triangles = np.concatenate(
        [
            np.stack([lower, lower + 2, lower + 3], 1),
            np.stack([lower, lower + 3, lower + 1], 1),
        ]
    )
    surface = iv.Surface(np.stack([x, y, 0 * x], axis=1), triangles)
    return surface if order == 1 else surface.quadratic()


def test_rim_nodes_are_those_on_edges_of_one_triangle():
    """Oracle: algebra. All vertices of a strip; of its midpoints those on the outline."""
    assert rim_nodes(strip(1).triangles).tolist() == list(range(10))
    curved = strip(2)
    inside = np.setdiff1d(np.arange(len(curved.points)), rim_nodes(curved.triangles))
    middles = curved.points[inside]
    np.testing.assert_allclose(middles[:, 1], 0.5)  # four diagonals and three rungs
    assert len(inside) == 7
    assert len(rim_nodes(iv.icosphere(1).triangles)) == 0


def test_quadratic_keeps_shape_and_order_2():
    """Oracle: algebra. Midpoints halve the edges, the area stays, a second call changes nothing."""
    flat = iv.icosphere(2, order=1)
    curved = flat.quadratic()
    assert curved.order == 2
    assert curved.area == pytest.approx(flat.area, rel=1e-13)
    assert curved.quadratic() is curved
    for k, (i, j) in enumerate(((0, 1), (1, 2), (2, 0))):
        ends = curved.points[curved.triangles[:, [i, j]]].mean(axis=1)
        np.testing.assert_allclose(curved.points[curved.triangles[:, 3 + k]], ends, atol=1e-15)


@pytest.mark.parametrize("order", [1, 2])
def test_lumped_mass_shares_each_elements_area(order):
    """Oracle: analytic. A third each (order 1); 3/57 and 16/57 of it (order 2, straight)."""
    corners = np.array([[0.0, 0, 0], [2, 0, 0], [0, 3, 0]])
    triangle = iv.Surface(corners, [[0, 1, 2]])
    laplacian = iv.fem(triangle if order == 1 else triangle.quadratic(), lumped=True)
    expected = [1.0] * 3 if order == 1 else [3 / 19] * 3 + [16 / 19] * 3
    np.testing.assert_allclose(laplacian.mass.diagonal(), expected, rtol=1e-12)
    assert laplacian.mass.nnz == len(expected)


def test_fixed_nodes_are_zero_and_the_area_stays():
    """Oracle: algebra. Rows of fixed nodes are 0 in the vectors; the kept ones solve the rest."""
    surface = strip(2)
    laplacian = iv.fem(surface)
    fixed = iv.fix_nodes(laplacian, rim_nodes(surface.triangles))
    direct = iv.fem(surface, dirichlet=True)
    assert abs(fixed.stiffness - direct.stiffness).max() == 0
    assert fixed.area == laplacian.area == pytest.approx(4.0)
    pairs = iv.eigenpairs(fixed, 3)
    assert pairs.vectors.shape == (len(surface.points), 3)
    assert not pairs.vectors[rim_nodes(surface.triangles)].any()
    kept = pairs.vectors[fixed.unknowns]
    np.testing.assert_allclose(kept.T @ (fixed.mass @ kept), np.eye(3), atol=1e-12)
    force, image = fixed.stiffness @ kept, fixed.mass @ kept
    np.testing.assert_allclose(force, image * pairs.values, atol=1e-10)
    assert pairs.zero_count == 0
    twice = iv.fix_nodes(fixed, fixed.unknowns[:2])
    assert twice.unknowns.tolist() == fixed.unknowns[2:].tolist()


def test_start_of_a_dirichlet_solve_gives_the_same_pairs():
    """Oracle: algebra. From the pairs of a similar operator on the same nodes, as without."""
    disk = iv.disk(1.0, 20)
    moved = iv.Surface(disk.points * [1.0, 1.01, 1.0], disk.triangles)
    laplacian = iv.fem(moved, dirichlet=True)
    cold = iv.eigenpairs(laplacian, 60)
    start = iv.eigenpairs(iv.fem(disk, dirichlet=True), 68)
    from_start = iv.eigenpairs(laplacian, 60, start=start, tolerance_of_change=1e-5)
    assert from_start.solver == "from start"
    np.testing.assert_allclose(from_start.values[:60], cold.values[:60], rtol=1e-6)
    assert len(from_start.vectors) == len(moved.points)


@pytest.mark.parametrize(
    ("nodes", "words"),
    [
        ([10], r"indices in \[0, 10\), got 10 to 10"),
        ([-1], "got -1 to -1"),
        (range(10), "got all 10 fixed"),
    ],
)
def test_nodes_that_cannot_be_fixed_are_refused(nodes, words):
    """Oracle: algebra. Beyond the nodes, or none left free."""
    with pytest.raises(iv.ArgumentError, match=words) as caught:
        iv.fix_nodes(iv.fem(strip(1)), list(nodes))
    assert caught.value.code == "A02"


@pytest.mark.parametrize("unknowns", [[0, 1], [0, 0, 1], [0, 1, 3]])
def test_unknowns_that_are_no_distinct_nodes_are_refused(unknowns):
    """Oracle: algebra. One node for each row of the matrices, each below ``nodes``."""
    triangle = iv.fem(iv.Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
    with pytest.raises(iv.ArgumentError, match=r"unknowns: expected 3 distinct.*A03"):
        iv.Laplacian(triangle.stiffness, triangle.mass, unknowns, 3)


def test_near_rim_is_within_twice_the_root_of_the_time():
    """Oracle: analytic. On a disk the rim is 1 - r away; on a sphere there is none."""
    disk = iv.disk(1.0, 12)
    depth = 1 - np.linalg.norm(disk.points, axis=1)
    np.testing.assert_allclose(iv.rim_distance(disk), depth, atol=1e-4)  # sides of 12 degrees / 2
    times = np.array([0.01, 0.04])
    near = iv.near_rim(disk, times)
    clear = np.abs(depth[:, None] - 2 * np.sqrt(times)) > 1e-4
    np.testing.assert_array_equal(near[clear], (depth[:, None] < 2 * np.sqrt(times))[clear])
    assert np.isinf(iv.rim_distance(iv.icosphere(1))).all()
    assert not iv.near_rim(iv.icosphere(1), times).any()


def test_pairs_scaled_to_another_area():
    """Oracle: symmetry. The pairs of the surface itself made larger."""
    small = iv.icosphere(1)
    large = iv.Surface(3 * small.points, small.triangles)
    scaled, direct = (iv.eigenpairs(iv.fem(s), 9) for s in (small, large))
    scaled = scaled.scaled(direct.area)
    times = [0.5, 5.0]
    np.testing.assert_allclose(scaled.values, direct.values, rtol=1e-10, atol=1e-12)
    first, second = (iv.heat_kernel_signature(p, times) for p in (scaled, direct))
    np.testing.assert_allclose(first, second, rtol=1e-10)


def test_a_mask_is_no_list_of_nodes():
    """Oracle: algebra. As indices a mask would fix nodes 0 and 1."""
    laplacian = iv.fem(strip(1))
    for wrong in (np.zeros(10, dtype=bool), [1.7]):
        with pytest.raises(iv.ArgumentError, match=r"nodes: expected indices.*flatnonzero.*A03"):
            iv.fix_nodes(laplacian, wrong)
    assert iv.fix_nodes(laplacian, []).unknowns.tolist() == list(range(10))


@pytest.mark.parametrize("times", [[-1.0], [np.nan, 1.0]])
def test_negative_times_are_refused(times):
    """Oracle: algebra. Heat does not flow back."""
    pairs = iv.eigenpairs(iv.fem(strip(1)), 4)
    for use in (
        lambda: iv.heat_kernel_signature(pairs, times),
        lambda: iv.heat_kernel(pairs, times, [0]),
        lambda: iv.near_rim(strip(1), times),
    ):
        with pytest.raises(iv.ArgumentError, match="times: expected none below 0"):
            use()


def test_a_sliver_is_integrated_and_not_inverted():
    """Oracle: analytic. Height e: cotangents (1 / 2 e of both long sides), to rounding."""
    height = 1e-10
    sliver = iv.Surface([[0, 0, 0], [1, 0, 0], [0.5, height, 0]], [[0, 1, 2]])
    stiffness = iv.fem(sliver).stiffness.toarray()
    assert stiffness[2, 2] == pytest.approx(1 / (2 * height), rel=1e-6)
    np.testing.assert_allclose(stiffness.sum(axis=1), 0, atol=1e-5)
