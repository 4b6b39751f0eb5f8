"""The eigensolve: complete, reproducible, honest about its errors."""

from __future__ import annotations

import os
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import sphere_eigenvalues
from scipy.linalg import eigh, eigvalsh
from scipy.sparse import block_diag, csr_array, diags_array, random_array

import isovary as iv
from isovary.spectrum import _eigenpairs, _lanczos, _threads, _warm, count_below
from isovary.spectrum._accuracy import first_gap
from isovary.spectrum._factorization import factorize, signed_factor
from isovary.spectrum._memory import predicted_memory

AXES = np.array([1.0, 1.2, 0.8])


def unit_area(laplacian):
    return laplacian.stiffness, laplacian.mass / laplacian.area


def dimpled(subdivisions, depth):
    """The unit sphere with a dimple of width 0.3 at the north pole, order 2."""
    sphere = iv.icosphere(subdivisions)
    angle = np.arccos(np.clip(sphere.points[:, 2], -1, 1))
    points = sphere.points * (1 - depth * np.exp(-((angle / 0.3) ** 2)))[:, None]
    return iv.fem(iv.Surface(points, sphere.triangles))


def signature(pairs, like):
    """Heat kernel signature at 30 times of the pairs ``like``, relative to its mean."""
    times = iv.diffusion_times(like, 30)
    return iv.heat_kernel_signature(pairs, times) / iv.heat_trace_scale(like, times)


def rms(signatures):
    """Root mean square over the nodes, at the worst time."""
    return np.sqrt((signatures**2).mean(axis=0)).max()


@pytest.mark.parametrize("count", [20, 100])  # shift below the spectrum, and in its middle
def test_lanczos_equals_lapack(count):
    """Oracle: peer. LAPACK's dense solver, 642 nodes: values to 1e-9, spaces to 1e-7."""
    stiffness, mass = unit_area(iv.fem(iv.icosphere(2)))
    values, vectors = _lanczos.lanczos(stiffness, mass, count, 1e-12)
    exact, basis = eigh(stiffness.toarray(), mass.toarray())
    np.testing.assert_allclose(values[1:], exact[1 : len(values)], rtol=1e-9)
    shell = 81 if count == 100 else 16  # whole shells: 9^2, 4^2
    gram = basis[:, :shell].T @ (mass @ vectors[:, :shell])
    np.testing.assert_allclose(np.linalg.svd(gram)[1], 1, atol=1e-7)


@pytest.mark.parametrize("count", [9, 20, 50, 121])
def test_no_copy_of_a_repeated_eigenvalue_is_missed(count):
    """Oracle: analytic. l (l + 1), 2 l + 1 times: the copies are counted, not only the values."""
    values = iv.eigenpairs(iv.fem(iv.icosphere(3)), count).values
    # 1 % tells l from l + 1 up to l = 100; the mesh itself errs by 0.4 % at l = 10
    np.testing.assert_allclose(values[1:], sphere_eigenvalues(len(values))[1:], rtol=1e-2)


def losing(function, lost):
    """A _ritz that forgets one pair."""

    def forgetful(operator, projected, remainder, count):
        pairs = function(operator, projected, remainder, count + 1)
        kept = np.delete(np.arange(count + 1), lost)
        return _lanczos._Ritz(
            pairs.values[kept], pairs.ritz[kept], pairs.modes[:, kept], pairs.missed[:, kept]
        )

    return forgetful


@pytest.mark.parametrize("lost", [0, 5, 17, 39])  # below the shift, and above
def test_a_missed_pair_is_noticed(monkeypatch, lost):
    """Oracle: algebra. A solver that loses one pair is caught by the inertia."""
    monkeypatch.setattr(_lanczos, "_ritz", losing(_lanczos._ritz, lost))
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


def test_the_threads_do_not_change_the_bits(monkeypatch):
    """Oracle: symmetry. One thread or two: the pieces of the work are the same."""
    laplacian = iv.fem(iv.icosphere(4))  # 10 242 nodes: two pieces of rows
    assert len(_threads.pieces(laplacian.mass.shape[0])) == 2
    results = []
    for cores in (1, 2):
        monkeypatch.setattr(_threads.os, "cpu_count", lambda cores=cores: cores)
        first = iv.eigenpairs(laplacian, 80)
        results.append([first, iv.eigenpairs(laplacian, 60, start=first)])
    for one, two in zip(*results, strict=True):
        np.testing.assert_array_equal(one.values, two.values)
        np.testing.assert_array_equal(one.vectors, two.vectors)


@pytest.mark.parametrize("tolerance", [1e-5, 1e-7])
def test_the_signature_is_as_accurate_as_asked(tolerance):
    """Oracle: peer. Mean error over the sphere's nodes against LAPACK, 2 562 nodes."""
    laplacian = dimpled(3, 0.1)
    found = iv.eigenpairs(laplacian, 110, tolerance=tolerance)
    values, vectors = eigh(*(m.toarray() for m in unit_area(laplacian)), subset_by_index=(0, 109))
    exact = iv.Eigenpairs(
        values / laplacian.area, vectors / np.sqrt(laplacian.area), 0 * values, laplacian.area
    )
    error = np.abs(signature(found, exact) - signature(exact, exact)).mean(axis=0).max()
    assert 1e-13 < error < tolerance


@pytest.mark.parametrize("asked", [2e-3, 2e-4])
def test_a_start_gives_the_same_signature(asked):
    """Oracle: peer (the cold solver). A dimple deeper by 1 %: rms as small as asked."""
    base = iv.eigenpairs(dimpled(3, 0.10), 120)
    deeper = dimpled(3, 0.11)
    cold = iv.eigenpairs(deeper, 100)
    warm = iv.eigenpairs(deeper, 100, start=base, tolerance_of_change=asked)
    assert (cold.solver, warm.solver) == ("Lanczos", "from start")
    np.testing.assert_allclose(warm.values, cold.values, rtol=1e-7, atol=1e-7)
    change = np.abs(signature(cold, base) - signature(base.truncate(100), base))
    error = np.abs(signature(warm, base) - signature(cold, base))
    assert change.max() > 1e-3
    assert rms(error) < asked * rms(change)
    assert error.max() < 2 * asked * change.max()


def test_a_start_that_is_too_far_away_is_not_used():
    """Oracle: algebra. Unrelated vectors, or too few: the cold solver's bits, and a word of it."""
    laplacian = iv.fem(iv.icosphere(3))
    cold = iv.eigenpairs(laplacian, 50)
    noise = np.random.default_rng(1).standard_normal(cold.vectors.shape)
    far = iv.Eigenpairs(np.linspace(0, 60, len(cold.values)), noise, cold.residuals, cold.area)
    for start, count in ((far, 40), (cold, 50)):
        found = iv.eigenpairs(laplacian, count, start=start)
        assert found.solver == "Lanczos (start too far away)"
        np.testing.assert_array_equal(found.vectors, iv.eigenpairs(laplacian, count).vectors)


def test_a_pair_lost_from_a_start_is_noticed(monkeypatch):
    """Oracle: algebra. A warm solver that loses a pair is caught, and the cold one takes over."""
    honest = _warm._refined

    def forgetful(*arguments):
        values, vectors, errors = honest(*arguments)
        return np.delete(values, 7), np.delete(vectors, 7, axis=1), np.delete(errors, 7)

    base, deeper = iv.eigenpairs(dimpled(3, 0.10), 120), dimpled(3, 0.11)
    assert iv.eigenpairs(deeper, 100, start=base).solver == "from start"
    monkeypatch.setattr(_warm, "_refined", forgetful)
    found = iv.eigenpairs(deeper, 100, start=base)
    assert found.solver == "Lanczos (start too far away)"


@pytest.mark.parametrize("weakest", [1.0, 1e-3, 1e-5, 1e-8, 1e-12, 0.0])
@pytest.mark.parametrize("seed", range(6))
def test_blocks_are_orthonormal_however_uneven(weakest, seed):
    """Oracle: algebra. V^T M V = 1 and block = unit remainder, with lengths 1 to ``weakest``."""
    mass = _threads.in_pieces(unit_area(iv.fem(iv.icosphere(2)))[1])
    rng = np.random.default_rng(seed)
    basis = np.asfortranarray(rng.standard_normal((642, 16)))
    lower = np.linalg.cholesky(basis[:, :8].T @ (mass @ basis[:, :8]))
    basis[:, :8] = basis[:, :8] @ np.linalg.inv(lower).T
    block = rng.standard_normal((642, 8)) @ np.diag(np.geomspace(1, weakest or 1e-16, 8))
    block = block @ np.linalg.qr(rng.standard_normal((8, 8)))[0]
    block -= basis[:, :8] @ (basis[:, :8].T @ (mass @ block))
    image, remainder = _lanczos._append(block, basis, mass)
    np.testing.assert_allclose(basis.T @ (mass @ basis), np.eye(16), atol=1e-12)
    np.testing.assert_allclose(image, mass @ basis[:, 8:], atol=1e-12)
    np.testing.assert_allclose(basis[:, 8:] @ remainder, block, atol=1e-7)


@pytest.mark.parametrize("subdivisions", [2, 3])  # LAPACK and Lanczos
@pytest.mark.parametrize("count", [38, 40, 60])
def test_a_repeated_eigenvalue_is_never_cut(subdivisions, count):
    """Oracle: symmetry. The icosahedral group allows multiplets of 1, 3, 4 and 5."""
    laplacian = iv.fem(iv.icosphere(subdivisions))
    more = iv.eigenpairs(laplacian, count + 20).values
    found = iv.eigenpairs(laplacian, count).values
    assert count <= len(found) <= count + 4
    np.testing.assert_allclose(found, more[: len(found)], rtol=1e-7, atol=1e-7)
    assert more[len(found)] - found[-1] > 1e-6 * found[-1]


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
    assert len(pairs.values) == 120  # 30 zeros, and 30 times the three of l = 1
    assert pairs.zero_count == 30
    np.testing.assert_allclose(pairs.values[30:], iv.eigenpairs(one, 4).values[1], rtol=1e-9)


@pytest.mark.parametrize("mass_added", [0.0, 0.01])  # with zeros, and without
def test_copies_missing_below_the_shift_are_noticed(mass_added):
    """Oracle: LAPACK. 39 small ellipsoids beside a large one: more zeros than columns."""

    def ellipsoid(subdivisions, axes):
        sphere = iv.icosphere(subdivisions, order=1)
        return iv.fem(iv.Surface(sphere.points * axes, sphere.triangles))

    sizes = np.random.default_rng(1).uniform(0.5, 1.5, 39)
    parts = [ellipsoid(3, [3, 3.7, 2.5])] + [ellipsoid(1, size * AXES) for size in sizes]
    mass = csr_array(block_diag([part.mass for part in parts]))
    stiffness = csr_array(block_diag([part.stiffness for part in parts]) + mass_added * mass)
    found = iv.eigenpairs(iv.Laplacian(stiffness, mass), 200).values
    exact = eigvalsh(stiffness.toarray(), mass.toarray())[: len(found)]
    np.testing.assert_allclose(found, exact, rtol=1e-7, atol=1e-8)


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
    """Oracle: algebra. 42 nodes: at most 40 pairs may be asked for; here 40 cut a quintet."""
    laplacian = iv.fem(iv.icosphere(1, order=1))
    assert len(iv.eigenpairs(laplacian, 40).values) == 42
    with pytest.raises(iv.ArgumentError, match="M09") as caught:
        iv.eigenpairs(laplacian, count)
    assert f"1 to 40 eigenpairs for 42 unknowns, got {count}" in str(caught.value)


def test_memory_is_predicted_before_the_work(monkeypatch):
    """Oracle: faults.md W08. 1 GB is not enough for 1 000 pairs of 200 000 unknowns."""
    import psutil

    laplacian = iv.Laplacian(*[csr_array(diags_array(np.ones(200_000)))] * 2)
    monkeypatch.setattr(psutil, "virtual_memory", lambda: SimpleNamespace(available=1e9))
    with pytest.raises(iv.RunError, match=r"W08") as caught:
        iv.eigenpairs(laplacian, 1000)
    assert "got 1.0 GB free" in str(caught.value)
    assert 2.9e9 < predicted_memory(200_000, 7 * 200_000, 300) < 4e9  # measured: 2.9e9


@pytest.mark.parametrize(
    ("options", "code"), [({"tolerance": 0.1}, "A02"), ({"tolerance": 0.0}, "A02")]
)
def test_senseless_tolerances(options, code):
    """Oracle: faults.md."""
    with pytest.raises(iv.ArgumentError, match=code):
        iv.eigenpairs(iv.fem(iv.icosphere(1)), 10, **options)


def test_a_start_on_other_nodes_is_refused():
    """Oracle: faults.md A03."""
    start = iv.eigenpairs(iv.fem(iv.icosphere(1)), 10)
    with pytest.raises(iv.ArgumentError, match="expected eigenvectors on 642 nodes, got 162"):
        iv.eigenpairs(iv.fem(iv.icosphere(2)), 10, start=start)


def test_what_is_not_finite_is_refused():
    """Oracle: faults.md A02."""
    laplacian = iv.fem(iv.icosphere(1))
    broken = laplacian.stiffness.copy()
    broken.data[3] = np.nan
    with pytest.raises(iv.ArgumentError, match="A02"):
        iv.eigenpairs(iv.Laplacian(broken, laplacian.mass), 10)
    start = iv.eigenpairs(laplacian, 10)
    vectors = np.where(start.vectors > 0, np.nan, start.vectors)
    begun = iv.Eigenpairs(start.values, vectors, start.residuals, start.area)
    with pytest.raises(iv.ArgumentError, match="A02"):
        iv.eigenpairs(laplacian, 10, start=begun)


def test_a_stiffness_with_negative_eigenvalues_is_refused():
    """Oracle: faults.md S06."""
    laplacian = iv.fem(iv.icosphere(1))
    shifted = csr_array(laplacian.stiffness - 0.5 * laplacian.mass)
    with pytest.raises(iv.SpectrumError, match="S06"):
        iv.eigenpairs(iv.Laplacian(shifted, laplacian.mass), 10)


@st.composite
def symmetric_matrices(draw):
    """Sparse, symmetric, sometimes in several components, diagonally dominant of either sign."""
    size = draw(st.integers(1, 120))
    density, seed = draw(st.sampled_from([0.0, 0.01, 0.05, 0.3])), draw(st.integers(0, 999))
    rng = np.random.default_rng(seed)
    half = random_array((size, size), density=density, rng=rng)
    matrix = half + half.T
    diagonal = 1 + np.abs(matrix).sum(axis=1)
    signs = rng.choice([-1.0, 1.0], size) if draw(st.booleans()) else np.ones(size)
    return csr_array(matrix + diags_array(diagonal * signs))


def test_the_panels_solve_where_entries_cancel():
    """Oracle: algebra. Whole numbers cancel exactly, and SuperLU leaves such entries out of L."""
    tried = 0
    for seed in range(400):
        rng = np.random.default_rng(seed)
        half = np.tril(rng.random((60, 60)) < 0.06, -1).astype(float)
        matrix = csr_array(half + half.T + np.diag(rng.integers(1, 4, 60)))
        if np.linalg.cond(matrix.toarray()) > 1e4:
            continue
        try:
            factor = factorize(signed_factor(matrix)[0])
        except iv.SpectrumError:  # a pivot near zero
            continue
        right = rng.standard_normal((60, 3))
        solution = np.empty_like(right)
        solution[factor.order] = factor.solve(right[factor.order])
        np.testing.assert_allclose(matrix @ solution, right, atol=1e-8)
        tried += 1
    assert tried > 30


@settings(max_examples=60, deadline=None)
@given(symmetric_matrices(), st.integers(1, 5))
def test_the_panels_solve_and_count(matrix, columns):
    """Oracle: algebra and LAPACK. A x = b, and as many negative pivots as eigenvalues."""
    raw, negative = signed_factor(matrix)
    factor = factorize(raw)
    right = np.random.default_rng(0).standard_normal((matrix.shape[0], columns))
    solution = np.empty_like(right)
    solution[factor.order] = factor.solve(right[factor.order])
    np.testing.assert_allclose(matrix @ solution, right, atol=1e-10)
    assert negative == (eigvalsh(matrix.toarray()) < 0).sum()


def test_large_residuals_and_slanted_vectors_are_refused(monkeypatch):
    """Oracle: faults.md S02. A solver that returns wrong vectors is caught by the matrices."""
    laplacian = iv.fem(iv.icosphere(1))
    honest = _eigenpairs._dense
    pairs = honest(*unit_area(laplacian), 20)
    mixed, slanted = pairs[1].copy(), pairs[1].copy()
    mixed[:, [0, 8]] = pairs[1][:, [0, 8]] @ np.array([[0.8, -0.6], [0.6, 0.8]])
    slanted[:, 3] = pairs[1][:, 3] + 1e-6 * pairs[1][:, 2]  # both of the shell l = 1
    for wrong, said in ((mixed, "residuals"), (slanted, "mass-orthonormal")):
        monkeypatch.setattr(_eigenpairs, "_dense", lambda *_, w=wrong: (pairs[0], w))
        with pytest.raises(iv.SpectrumError, match=rf"{said}.*S02"):
            iv.eigenpairs(laplacian, 20)


def test_a_gap_is_one_only_beyond_the_errors_of_the_values():
    """Oracle: algebra. 3 and 4 are apart by 1, their errors 0.3 each: no gap is sure until 4."""
    values, errors = np.array([1.0, 2.0, 3.0, 4.0, 6.0]), np.array([0.0, 0.0, 0.3, 0.3, 0.1])
    assert first_gap(values, errors, 2) == 2
    assert first_gap(values, errors, 3) == 4
    assert first_gap(values, 4 * errors, 3) == 0
    assert first_gap(np.array([1.0, 1.0, 1.0, 2.0]), np.zeros(4), 1) == 3


def test_blas_has_one_thread_within_a_solve_and_its_own_after_it(tmp_path):
    """Oracle: data. In a fresh process, SciPy's BLAS too, which is loaded late."""
    script = """
import numpy as np, threadpoolctl
from isovary.spectrum._threads import one_blas_thread
def threads():
    libraries = threadpoolctl.threadpool_info()
    return [one["num_threads"] for one in libraries if one["user_api"] == "blas"]
before = threads()
with one_blas_thread():
    import scipy.linalg
    inside = threads()
assert len(inside) >= 1 and set(inside) == {1}, inside
assert threads()[:len(before)] == before == [2] * len(before), (before, threads())
"""
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "2"}
    subprocess.run([sys.executable, "-c", script], check=True, env=environment, cwd=tmp_path)


def test_a_zero_too_many_is_refused():
    """Oracle: faults.md S05. Two spheres joined by a bond of 1e-12 have one constant, not two."""
    one = iv.fem(iv.icosphere(1))
    stiffness, mass = (block_diag([m, m]).tolil() for m in (one.stiffness, one.mass))
    for i, j, bond in ((0, 162, -1e-12), (162, 0, -1e-12), (0, 0, 1e-12), (162, 162, 1e-12)):
        stiffness[i, j] += bond
    with pytest.raises(iv.SpectrumError, match=r"expected a zero for each of 1 .*S05"):
        iv.eigenpairs(iv.Laplacian(csr_array(stiffness), csr_array(mass)), 20)


def test_a_matrix_without_pivots_on_its_diagonal_is_refused():
    """Oracle: algebra. [[0, 1], [1, 0]] has no L D L^T; its signs would mean nothing."""
    with pytest.raises(iv.SpectrumError, match="S01"):
        count_below(csr_array([[0.0, 1.0], [1.0, 0.0]]), csr_array(np.eye(2)), 0.0)


@pytest.mark.parametrize("wanted", [50.0, 200.0])
@pytest.mark.parametrize("power", [0.5, 1.0, 2.0])
def test_next_shift_between_two_counts_follows_the_power(power, wanted):
    """Oracle: analytic. counts = 10 s^power: the shift that leaves ``wanted`` below it."""
    tried = [(s, round(10 * s**power)) for s in (1.0, 10_000.0)]
    found = _lanczos._next_shift(tried, wanted)
    assert found == pytest.approx((wanted / 10) ** (1 / power), rel=1e-3)


def test_strip_with_fixed_sides():
    """Oracle: peer. The spectrum begins far from 0 and lies close: SciPy finds the same.

    1 : 400, so at unit area the first eigenvalue is 400 pi^2, and the next ones lie 1e-5 apart.
    The shift is found in the middle of them.
    """
    from scipy.sparse.linalg import eigsh

    laplacian = iv.fem(iv.sheet(1.0, 400.0, (3, 900), order=1), dirichlet=True)
    found = iv.eigenpairs(laplacian, 40)
    assert found.solver == "Lanczos"
    sigma = 0.999 * found.values[0]
    peer = eigsh(laplacian.stiffness, 40, laplacian.mass, sigma=sigma, return_eigenvectors=False)
    np.testing.assert_allclose(found.values[:40], np.sort(peer), rtol=1e-9)
    unit = laplacian.mass / laplacian.area
    operator = _lanczos._middle(laplacian.stiffness, unit, 40)
    assert 0 < operator.below <= 32


@pytest.mark.parametrize("left", [0.0, 1e-16, 1e-8])
def test_a_block_of_which_nothing_is_left_is_replaced(left):
    """Oracle: algebra. All in the span of the columns before, or nearly: random ones instead."""
    mass = _threads.in_pieces(unit_area(iv.fem(iv.icosphere(2)))[1])
    rng = np.random.default_rng(5)
    basis = np.asfortranarray(rng.standard_normal((642, 16)))
    lower = np.linalg.cholesky(basis[:, :8].T @ (mass @ basis[:, :8]))
    basis[:, :8] = basis[:, :8] @ np.linalg.inv(lower).T
    block = basis[:, :8] @ rng.standard_normal((8, 8)) + left * rng.standard_normal((642, 8))
    image, _ = _lanczos._append(block, basis, mass)
    np.testing.assert_allclose(basis.T @ (mass @ basis), np.eye(16), atol=1e-12)
    np.testing.assert_allclose(image, mass @ basis[:, 8:], atol=1e-12)
