"""What every Laplacian promises; and linear FEM against LaPy."""

from __future__ import annotations

import numpy as np
import pytest

import isovary as iv

METHODS = {"fem": iv.fem}
SURFACES = {"flat": iv.icosphere(2, order=1), "curved": iv.icosphere(2)}


@pytest.mark.parametrize("surface", SURFACES.values(), ids=SURFACES)
@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
def test_contract(method, surface):
    """Oracle: algebra. Symmetric; constants in the kernel; semidefinite; mass sums to the area."""
    laplacian = method(surface)
    stiffness, mass = laplacian.stiffness.toarray(), laplacian.mass.toarray()
    np.testing.assert_array_equal(stiffness, stiffness.T)
    np.testing.assert_array_equal(mass, mass.T)
    np.testing.assert_allclose(stiffness.sum(axis=1), 0, atol=1e-12)
    assert np.linalg.eigvalsh(stiffness).min() > -1e-12
    assert np.linalg.eigvalsh(mass).min() > 0
    assert mass.sum() == pytest.approx(surface.area, rel=1e-13)


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
