"""What holds on every mesh: properties of the operators and the signature on random ones."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import isovary as iv
from isovary.laplacian import fem
from isovary.records import Eigenpairs, Surface
from isovary.shapes import icosphere

OPERATORS = {
    "linear": (1, False),
    "quadratic": (2, False),
    "linear, lumped": (1, True),
    "quadratic, lumped": (2, True),
}
every = pytest.mark.parametrize("operator", OPERATORS)
many = settings(max_examples=200, deadline=None, derandomize=True)

seeds = st.integers(0, 2**32 - 1)
amplitudes = st.floats(0.02, 0.25)
logarithms = st.floats(-12, 12)

BASES = {1: icosphere(1, order=1), 2: icosphere(0, order=2)}  # 42 nodes each
TIMES = np.array([0.3, 0.6, 1.5, 4.0, 20.0])  # for surfaces of about unit radius


def lumpy(seed: int, amplitude: float, order: int) -> Surface:
    """A sphere with a random smooth radius, exp(amplitude times a cubic), and a rough part.

    The rough part, a tenth, leaves no symmetry of the icosahedron: no eigenvalue is repeated.
    """
    rng = np.random.default_rng(seed)
    base = BASES[order]
    x = base.points
    powers = np.hstack([x, x**2, x**3, x * np.roll(x, 1, axis=1)])
    smooth = powers @ rng.uniform(-0.5, 0.5, powers.shape[1])
    rough = 0.1 * rng.uniform(-1, 1, len(x))
    return Surface(x * np.exp(amplitude * (smooth + rough))[:, None], base.triangles)


def solved(surface: Surface, lumped: bool) -> Eigenpairs:
    """At least 16 pairs: cut at the widest gap, so that rounding cannot turn the last ones.

    Where two eigenvalues nearly coincide, their vectors are any basis of a plane, and the
    cut must not part them.
    """
    pairs = iv.eigenpairs(fem(surface, lumped=lumped), 32)
    gaps = np.diff(pairs.values[15:32]) / pairs.values[16:32]
    return pairs.truncate(16 + int(np.argmax(gaps)))


def signatures(surface: Surface, lumped: bool, times: np.ndarray = TIMES) -> np.ndarray:
    return iv.heat_kernel_signature(solved(surface, lumped), times)


@every
@many
@given(seed=seeds, amplitude=amplitudes, mirrored=st.booleans(), renumbered=st.booleans())
def test_motion_mirror_and_renumbering(operator, seed, amplitude, mirrored, renumbered):
    """Oracle: symmetry. The HKS sees no motion, reflection or order of naming; relative 1e-8.

    A shift by 10 radii costs one of the sixteen digits; gaps of 1e-3 cost three.
    """
    order, lumped = OPERATORS[operator]
    surface = lumpy(seed, amplitude, order)
    rng = np.random.default_rng(seed + 1)
    turn = Rotation.random(rng=rng).as_matrix() @ np.diag([1, 1, -1 if mirrored else 1])
    points = surface.points @ turn.T + rng.uniform(-10, 10, 3)
    place, triangles = np.arange(len(points)), surface.triangles
    if renumbered:
        place = rng.permutation(len(points))
        triangles = named_anew(rng.permutation(np.argsort(place)[triangles]))
    moved = Surface(points[place], triangles)
    one, two = signatures(surface, lumped), signatures(moved, lumped)
    np.testing.assert_allclose(two, one[place], rtol=1e-8)


def named_anew(triangles: np.ndarray) -> np.ndarray:
    """Every other triangle from its second corner on, every fourth seen from its other side."""
    width = triangles.shape[1]
    triangles[::2] = triangles[::2][:, [1, 2, 0, 4, 5, 3][:width]]
    triangles[::4] = triangles[::4][:, [0, 2, 1, 5, 4, 3][:width]]
    return triangles


@every
@many
@given(seed=seeds, amplitude=amplitudes, logarithm=logarithms)
def test_scaling(operator, seed, amplitude, logarithm):
    """Oracle: symmetry. Lengths by s, 1e-12 to 1e12: lambda s^-2, HKS s^-2 at s^2 t; 1e-8."""
    order, lumped = OPERATORS[operator]
    surface, scale = lumpy(seed, amplitude, order), 10.0**logarithm
    grown = Surface(scale * surface.points, surface.triangles)
    one, two = solved(surface, lumped), solved(grown, lumped)
    assert two.values[0] == one.values[0] == 0
    np.testing.assert_allclose(two.values[1:] * scale**2, one.values[1:], rtol=1e-8)
    first = iv.heat_kernel_signature(one, TIMES)
    second = iv.heat_kernel_signature(two, scale**2 * TIMES)
    np.testing.assert_allclose(second * scale**2, first, rtol=1e-8)


@every
@many
@given(seed=seeds, amplitude=amplitudes)
def test_trace_decrease_and_limit(operator, seed, amplitude):
    """Oracle: algebra. Integral sum exp(-lambda t), to 1e-10; decreasing to 1 / area from above.

    The integral is taken through the mass, which the vectors are orthonormal in; eps of
    1e-12 in the comparisons is rounding.
    """
    order, lumped = OPERATORS[operator]
    surface = lumpy(seed, amplitude, order)
    pairs = solved(surface, lumped)
    times = np.geomspace(1e-3, 1e3, 25)
    signature = iv.heat_kernel_signature(pairs, times)
    decay = np.exp(-np.outer(pairs.values, times))
    mass = fem(surface, lumped=lumped).mass
    integral = ((mass @ pairs.vectors) * pairs.vectors).sum(axis=0) @ decay
    np.testing.assert_allclose(integral, decay.sum(axis=0), rtol=1e-10)
    if lumped:  # then the integral of the nodal values themselves
        np.testing.assert_allclose(mass.diagonal() @ signature, decay.sum(axis=0), rtol=1e-10)
    assert (np.diff(signature, axis=1) <= 1e-12 * signature[:, 1:]).all()
    assert (signature >= (1 - 1e-12) / surface.area).all()
    np.testing.assert_allclose(signature[:, -1], 1 / surface.area, rtol=1e-10)


@every
@many
@given(seed=seeds, amplitude=amplitudes)
def test_operator(operator, seed, amplitude):
    """Oracle: algebra. Symmetric, constants in the kernel, no negative mode, mass sums to the area.

    Rounding is measured against the largest entries: 1e-12 of them.
    """
    order, lumped = OPERATORS[operator]
    surface = lumpy(seed, amplitude, order)
    laplacian = fem(surface, lumped=lumped)
    stiffness, mass = laplacian.stiffness.toarray(), laplacian.mass.toarray()
    np.testing.assert_array_equal(stiffness, stiffness.T)
    np.testing.assert_array_equal(mass, mass.T)
    assert np.abs(stiffness.sum(axis=1)).max() < 1e-12 * np.abs(stiffness).max()
    assert np.linalg.eigvalsh(stiffness)[0] > -1e-12 * np.abs(stiffness).max()
    assert np.linalg.eigvalsh(mass)[0] > 0
    assert mass.sum() == pytest.approx(surface.area, rel=1e-12)
    if lumped:
        assert np.count_nonzero(mass) == len(mass)
