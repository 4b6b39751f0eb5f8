"""The eigensolve: complete, reproducible, honest about its residuals."""

from __future__ import annotations

import numpy as np
import pytest
from oracles import sphere_eigenvalues
from scipy.linalg import eigh
from scipy.sparse import block_diag, csr_array

import isovary as iv
from isovary import spectrum


def test_lanczos_equals_lapack():
    """Oracle: peer. LAPACK's dense solver, 642 nodes: values to 1e-10, spaces to 1e-7."""
    laplacian = iv.fem(iv.icosphere(2))
    stiffness, mass = laplacian.stiffness, laplacian.mass / laplacian.area
    values, vectors = spectrum._block_lanczos(stiffness, mass, 100, width=8)
    exact, basis = eigh(stiffness.toarray(), mass.toarray())
    np.testing.assert_allclose(values[1:], exact[1:100], rtol=1e-10)
    gram = basis[:, :81].T @ (mass @ vectors[:, :81])  # 81 = 9^2: whole shells
    np.testing.assert_allclose(np.linalg.svd(gram)[1], 1, atol=1e-7)


@pytest.mark.parametrize("count", [9, 20, 50, 121])
def test_no_copy_of_a_repeated_eigenvalue_is_missed(count):
    """Oracle: analytic. l (l + 1), 2 l + 1 times: the copies are counted, not only the values."""
    laplacian = iv.fem(iv.icosphere(3))
    values = spectrum._certified(laplacian.stiffness, laplacian.mass, count)[0]
    # 1 % tells l from l + 1 up to l = 100; the mesh itself errs by 0.4 % at l = 10
    np.testing.assert_allclose(values[1:], sphere_eigenvalues(count)[1:], rtol=1e-2)


def test_a_missed_pair_is_noticed(monkeypatch):
    """Oracle: algebra. A solver that loses one copy of lambda = 6 is caught by the inertia."""
    honest = spectrum._block_lanczos

    def forgetful(stiffness, mass, count, width):
        values, vectors = honest(stiffness, mass, count + 1, width)
        return np.delete(values, 5), np.delete(vectors, 5, axis=1)

    monkeypatch.setattr(spectrum, "_block_lanczos", forgetful)
    with pytest.raises(iv.SpectrumError, match="S01"):
        iv.eigenpairs(iv.fem(iv.icosphere(3)), 40)


def test_eigenvectors_are_mass_orthonormal_with_small_residuals(sphere_pairs):
    """Oracle: algebra. Phi^T M Phi = 1 to 1e-9; |K phi - lambda M phi| small."""
    laplacian = iv.fem(iv.icosphere(3))
    gram = sphere_pairs.vectors.T @ (laplacian.mass @ sphere_pairs.vectors)
    np.testing.assert_allclose(gram, np.eye(100), atol=1e-9)
    assert sphere_pairs.residuals.max() < 1e-7
    assert sphere_pairs.values[0] == 0
    assert (np.diff(sphere_pairs.values) >= 0).all()


def test_the_same_input_gives_the_same_bits(sphere_pairs):
    """Oracle: symmetry. The start vectors are fixed."""
    again = iv.eigenpairs(iv.fem(iv.icosphere(3)), 100)
    np.testing.assert_array_equal(again.values, sphere_pairs.values)
    np.testing.assert_array_equal(again.vectors, sphere_pairs.vectors)


def test_each_component_has_its_own_zero():
    """Oracle: analytic. Two spheres: every eigenvalue twice, two zeros."""
    one = iv.fem(iv.icosphere(3))
    two = iv.Laplacian(
        csr_array(block_diag([one.stiffness, one.stiffness])),
        csr_array(block_diag([one.mass, one.mass])),
    )
    pairs = iv.eigenpairs(two, 50)
    assert pairs.zero_count == 2
    np.testing.assert_allclose(pairs.values, np.repeat(iv.eigenpairs(one, 25).values, 2), atol=1e-6)


def test_many_equal_components():
    """Oracle: analytic. 30 equal spheres: every eigenvalue 30 times, twice the solver's block."""
    one = iv.fem(iv.icosphere(1))
    stiffness, mass = (csr_array(block_diag([m] * 30)) for m in (one.stiffness, one.mass))
    pairs = iv.eigenpairs(iv.Laplacian(stiffness, mass), 60)
    assert pairs.zero_count == 30
    np.testing.assert_allclose(pairs.values[30:], iv.eigenpairs(one, 4).values[1], rtol=1e-9)


def test_as_many_components_as_pairs():
    """Oracle: analytic. 100 equal icosahedra have 100 zeros."""
    one = iv.fem(iv.icosphere(0, order=1))
    stiffness, mass = (csr_array(block_diag([m] * 100)) for m in (one.stiffness, one.mass))
    pairs = iv.eigenpairs(iv.Laplacian(stiffness, mass), 100)
    np.testing.assert_allclose(pairs.values, 0, atol=1e-9)


@pytest.mark.parametrize("subdivisions", [2, 3])  # LAPACK and Lanczos
def test_the_constant_alone(subdivisions):
    """Oracle: analytic. One pair: 0 and 1 / sqrt(area), with a small residual."""
    pairs = iv.eigenpairs(iv.fem(iv.icosphere(subdivisions)), 1)
    assert pairs.values.tolist() == [0.0]
    np.testing.assert_allclose(np.abs(pairs.vectors), 1 / np.sqrt(pairs.area), rtol=1e-8)
    assert 0 <= pairs.residuals[0] < 1e-6


def test_cut_multiplets():
    """Oracle: analytic. A sphere keeps whole shells l^2; a triaxial ellipsoid keeps every pair."""
    sphere = iv.eigenpairs(iv.fem(iv.icosphere(3)), 110)
    assert len(iv.drop_cut_multiplet(sphere).values) == 100
    whole = sphere.truncate(100)
    assert iv.drop_cut_multiplet(whole) is not None
    assert len(iv.drop_cut_multiplet(whole).values) == 100
    stretched = iv.icosphere(3)
    triaxial = iv.Surface(stretched.points * [1.0, 1.37, 0.81], stretched.triangles)
    assert len(iv.drop_cut_multiplet(iv.eigenpairs(iv.fem(triaxial), 110)).values) == 110


@pytest.mark.parametrize("count", [0, 41, 42, 100])
def test_more_pairs_than_the_mesh_holds(count):
    """Oracle: algebra. 42 nodes carry at most 40 pairs; 40 itself is allowed."""
    laplacian = iv.fem(iv.icosphere(1, order=1))
    assert len(iv.eigenpairs(laplacian, 40).values) == 40
    with pytest.raises(iv.ArgumentError, match="M09") as caught:
        iv.eigenpairs(laplacian, count)
    assert f"1 to 40 eigenpairs for 42 unknowns, got {count}" in str(caught.value)
