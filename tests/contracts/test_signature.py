"""What every signature promises, and what each of them means."""

from __future__ import annotations

from functools import partial

import numpy as np
import oracles
import pytest

import isovary as iv

METHODS = {
    "heat_kernel_signature": iv.heat_kernel_signature,
    "scale_invariant_heat_kernel_signature": iv.scale_invariant_heat_kernel_signature,
    "wave_kernel_signature": iv.wave_kernel_signature,
    "global_point_signature": iv.global_point_signature,
}

# Methods that the arbitrary choice of eigenvectors does not reach.
WELL_DEFINED = {name: method for name, method in METHODS.items() if "point" not in name}

LEVELS = np.exp([-np.inf, 0.0, 2.0])  # eigenvalues 0, 1 and e^2


def samples_for(method, pairs, count=20):
    return iv.signature_kind(method).samples(pairs, count)


def made(values, vectors, area=1.0):
    """Eigenpairs of no surface, of which only values and vectors matter."""
    return iv.Eigenpairs(values, vectors, np.zeros(len(values)), area)


def spheroid(scale=1.0, level=2):
    sphere = iv.icosphere(level)
    return iv.Surface(sphere.points * [scale, 1.2 * scale, 1.7 * scale], sphere.triangles)


@pytest.fixture(scope="module")
def sphere_laplacian():
    return iv.fem(iv.icosphere(3))


@pytest.fixture(scope="module")
def spheroid_pairs():
    return iv.eigenpairs(iv.fem(spheroid()), 60)


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
def test_a_row_for_each_node_and_a_column_for_each_value_of_the_axis(method, sphere_pairs):
    """Oracle: algebra. Shape (n, columns), finite; the samples are not changed, nothing shared."""
    samples = samples_for(method, sphere_pairs)
    before = samples.copy()
    signature = method(sphere_pairs, samples)
    columns = iv.signature_kind(method).columns(samples)
    assert signature.shape == (len(sphere_pairs.vectors), len(columns))
    assert signature.dtype == np.float64
    assert np.isfinite(signature).all()
    np.testing.assert_array_equal(samples, before)
    np.testing.assert_array_equal(method(sphere_pairs, samples), signature)
    assert not np.shares_memory(signature, sphere_pairs.vectors)
    assert signature.flags.writeable


def turned(pairs):
    """The same pairs, the l = 1 shell exactly repeated, and with other vectors for it."""
    rng = np.random.default_rng(29)
    vectors = pairs.vectors * rng.choice([-1, 1], len(pairs.values))
    turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    vectors[:, 1:4] = vectors[:, 1:4] @ turn
    values = pairs.values.copy()
    values[1:4] = values[1:4].mean()
    return made(values, pairs.vectors, pairs.area), made(values, vectors, pairs.area)


@pytest.mark.parametrize("method", WELL_DEFINED.values(), ids=WELL_DEFINED)
def test_signs_and_rotations_do_not_matter(method, sphere_pairs):
    """Oracle: symmetry. Signs, and rotations within a repeated eigenvalue, change nothing."""
    pairs, other = turned(sphere_pairs)
    samples = samples_for(method, pairs)
    np.testing.assert_allclose(method(other, samples), method(pairs, samples), rtol=1e-11)


def test_the_columns_of_the_global_point_signature_are_arbitrary(sphere_pairs):
    """Oracle: symmetry. Signs and rotations do change them, but no sum of squares over a shell."""
    pairs, other = (iv.global_point_signature(p) for p in turned(sphere_pairs))
    assert np.abs(other - pairs)[:, :3].max() > 0.1
    assert np.abs(np.abs(other) - np.abs(pairs))[:, :3].max() > 0.1  # not by signs alone
    np.testing.assert_allclose(np.abs(other[:, 3:]), np.abs(pairs[:, 3:]), rtol=1e-12)
    whole = ((s[:, :3] ** 2).sum(axis=1) for s in (pairs, other))
    np.testing.assert_allclose(*whole, rtol=1e-12)


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
def test_the_order_of_the_nodes_does_not_matter(method, spheroid_pairs):
    """Oracle: symmetry. Renumbered nodes, renumbered rows, but for rounding in the eigensolve."""
    surface = spheroid()
    new = np.random.default_rng(17).permutation(len(surface.points))  # new number of each node
    points = np.empty_like(surface.points)
    points[new] = surface.points
    pairs = iv.eigenpairs(iv.fem(iv.Surface(points, new[surface.triangles])), 60)
    samples = samples_for(method, spheroid_pairs)
    first, second = method(spheroid_pairs, samples), method(pairs, samples)[new]
    if method is iv.global_point_signature:
        first, second = np.abs(first), np.abs(second)  # this surface has no repeated eigenvalue
    np.testing.assert_allclose(second, first, rtol=1e-6, atol=1e-8 * np.abs(first).max())


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
def test_the_unit_says_how_a_signature_scales(method, spheroid_pairs):
    """Oracle: symmetry. A surface three times as large, samples in its units: as ``unit`` says."""
    p, kind = spheroid_pairs, iv.signature_kind(method)
    larger = made(p.values / 9, p.vectors / 3, 9 * p.area)
    expected = (
        method(p, kind.samples(p, 20)) * {"1 / length²": 1 / 9, "dimensionless": 1}[kind.unit]
    )
    np.testing.assert_allclose(method(larger, kind.samples(larger, 20)), expected, rtol=1e-10)


def test_times_are_those_of_sun_et_al(sphere_pairs):
    """Oracle: analytic. From 4 ln 10 / lambda_100 to 4 ln 10 / lambda_2 = 2 ln 10, logarithmic."""
    times = iv.diffusion_times(sphere_pairs)
    assert len(times) == 100
    assert times[-1] == pytest.approx(2 * np.log(10), rel=1e-4)
    assert times[0] == pytest.approx(4 * np.log(10) / sphere_pairs.values[-1], rel=1e-14)
    np.testing.assert_allclose(np.diff(np.log(times)), np.log(times[1] / times[0]), rtol=1e-9)


def test_large_times_tend_to_one_over_the_area(sphere_pairs):
    """Oracle: analytic. All heat is spread evenly: HKS -> 1 / (4 pi)."""
    late = iv.heat_kernel_signature(sphere_pairs, [50.0])
    np.testing.assert_allclose(late, 1 / sphere_pairs.area, rtol=1e-9)


def test_heat_kernel_signature_of_the_sphere(sphere_pairs):
    """Oracle: analytic. The sum over all shells; what 100 pairs lack at t = 0.3 is exp(-33)."""
    times = np.geomspace(0.3, 5, 7)
    expected = np.broadcast_to(oracles.sphere_signature(times), (len(sphere_pairs.vectors), 7))
    signature = iv.heat_kernel_signature(sphere_pairs, times)
    np.testing.assert_allclose(signature, expected, rtol=5e-5)  # the mesh: 1.4e-5


def test_curvature_of_the_sphere():
    """Oracle: analytic. 1 + t/5 + 4 t^2/105 on the unit sphere, a quarter of it at radius 2."""
    times = np.array([0.03, 0.1])
    series = 1 + times / 5 + 4 * times**2 / 105
    exact = oracles.sphere_signature(times)[None]
    np.testing.assert_allclose(iv.implied_curvature(exact, times), [series], rtol=1e-5)
    double = iv.implied_curvature(exact / 4, 4 * times)
    np.testing.assert_allclose(double, [series / 4], rtol=1e-5)


def test_curvature_of_a_meshed_sphere(sphere_laplacian):
    """Oracle: analytic. 1 + t/5, at the smallest time that 225 pairs and this mesh resolve."""
    pairs = iv.eigenpairs(sphere_laplacian, 225)
    time = np.array([0.1])
    curvature = iv.implied_curvature(iv.heat_kernel_signature(pairs, time), time)
    # an error of 1e-4 in 4 pi t HKS is one of 3e-4 / t = 3e-3
    np.testing.assert_allclose(curvature, 1.0204, atol=5e-3)


def test_radius_of_the_heat_in_the_plane():
    """Oracle: analytic. The second moment of exp(-r^2 / 4t) / (4 pi t), summed on rings."""
    time = 0.7
    step = 0.001
    r = np.arange(step / 2, 30, step)
    ring = np.exp(-(r**2) / (4 * time)) / (4 * np.pi * time) * 2 * np.pi * r * step
    assert iv.diffusion_radius([time])[0] == pytest.approx(np.sqrt((ring * r**2).sum()), rel=1e-6)


def test_heat_kernel_is_a_symmetric_semigroup_that_keeps_heat(sphere_laplacian, sphere_pairs):
    """Oracle: algebra. k(x,y) = k(y,x); k_t k_s = k_(t+s) in the mass; integral 1; diagonal HKS."""
    nodes = np.array([0, 17, 401])
    times = np.array([0.2, 0.5, 0.7])
    kernel = iv.heat_kernel(sphere_pairs, times, nodes)
    assert kernel.shape == (len(sphere_pairs.vectors), 3, 3)
    among = kernel[nodes]
    np.testing.assert_allclose(among, among.transpose(1, 0, 2), rtol=1e-10, atol=1e-12)
    both = kernel[:, :, 0].T @ (sphere_laplacian.mass @ kernel[:, :, 1])
    np.testing.assert_allclose(both, among[:, :, 2], rtol=1e-10, atol=1e-12)
    weights = sphere_laplacian.mass @ np.ones(len(sphere_pairs.vectors))
    np.testing.assert_allclose(np.einsum("n,nst->st", weights, kernel), 1, rtol=1e-10)
    signature = iv.heat_kernel_signature(sphere_pairs, times)[nodes]
    np.testing.assert_allclose(np.einsum("sst->st", among), signature, rtol=1e-10)
    late = iv.heat_kernel(sphere_pairs, [30.0], nodes)
    np.testing.assert_allclose(late, 1 / sphere_pairs.area, rtol=1e-10)


def test_heat_kernel_of_the_sphere(sphere_pairs):
    """Oracle: analytic. Sum over l of (2 l + 1) / (4 pi) exp(-l (l + 1) t) P_l(cos angle)."""
    points = iv.icosphere(3).points
    degree = np.arange(30)
    for time in (0.3, 1.0):
        series = (2 * degree + 1) / (4 * np.pi) * np.exp(-degree * (degree + 1) * time)
        expected = np.polynomial.legendre.legval(points @ points[[5, 300]].T, series)
        kernel = iv.heat_kernel(sphere_pairs, [time], [5, 300])[:, :, 0]
        np.testing.assert_allclose(kernel, expected, atol=2e-4 * expected.max())


def test_a_wave_kernel_between_two_levels():
    """Oracle: analytic. Halfway, the mean of two squares; at a level, weights 1 and exp(-2)."""
    squares = np.array([[5.0, 1.0, 3.0], [5.0, 2.0, 0.0]])
    signature = iv.wave_kernel_signature(made(LEVELS, np.sqrt(squares)), np.exp([0, 1]), width=1.0)
    far = np.exp(-2.0)
    at_first = (squares[:, 1] + far * squares[:, 2]) / (1 + far)
    np.testing.assert_allclose(signature[:, 0], at_first, rtol=1e-14)
    np.testing.assert_allclose(signature[:, 1], squares[:, 1:].mean(axis=1), rtol=1e-14)


def test_an_energy_without_eigenvalues_gets_the_nearest():
    """Oracle: analytic. All weights underflow, their ratios do not: no NaN and no warning."""
    squares = np.array([[5.0, 1.0, 3.0], [5.0, 2.0, 0.0]])
    pairs = made(LEVELS, np.sqrt(squares))
    signature = iv.wave_kernel_signature(pairs, [1e-300, 1e300], width=0.01)
    np.testing.assert_allclose(signature, squares[:, 1:], rtol=1e-14)


def test_wave_kernel_signature_of_the_sphere(sphere_pairs):
    """Oracle: analytic. Every shell is even, so is each mean of them: 1 / (4 pi)."""
    signature = iv.wave_kernel_signature(sphere_pairs, iv.wave_energies(sphere_pairs))
    np.testing.assert_allclose(signature, 1 / (4 * np.pi), rtol=1e-2)  # l = 9 on this mesh


def test_energies_lie_two_widths_inside_the_eigenvalues(spheroid_pairs):
    """Oracle: analytic. log E + 2 sigma ends at log lambda_k, with sigma = 7 steps by default."""
    for count in (5, 100):
        energies = iv.wave_energies(spheroid_pairs, count)
        steps = np.diff(np.log(energies))
        assert len(energies) == count
        np.testing.assert_allclose(steps, steps[0], rtol=1e-9)
        ends = energies[[0, -1]] * np.exp([-14 * steps[0], 14 * steps[0]])
        np.testing.assert_allclose(ends, spheroid_pairs.values[[1, -1]], rtol=1e-12)
        wide = iv.wave_kernel_signature(spheroid_pairs, energies, width=7 * steps[0])
        default = iv.wave_kernel_signature(spheroid_pairs, energies)
        np.testing.assert_allclose(default, wide, rtol=1e-9)


def test_global_point_signature_of_the_sphere(sphere_pairs):
    """Oracle: analytic. The squares of a shell sum up to (2 l + 1) / (4 pi l (l + 1))."""
    for degree in range(1, 6):
        numbers = np.arange(degree**2, (degree + 1) ** 2)
        signature = iv.global_point_signature(sphere_pairs, numbers)
        expected = (2 * degree + 1) / (4 * np.pi * degree * (degree + 1))
        squares = (signature**2).sum(axis=1)
        np.testing.assert_allclose(squares, expected, rtol=2e-3)  # the mesh at l = 5: 1e-3


def test_numbers_choose_columns(sphere_pairs):
    """Oracle: algebra. From 1, the first nonzero eigenvalue, to the last, 99 of 100 pairs."""
    every = iv.global_point_signature(sphere_pairs)
    some = iv.global_point_signature(sphere_pairs, [99, 1.0, 2])
    np.testing.assert_array_equal(some, every[:, [98, 0, 1]])
    first = sphere_pairs.vectors[:, 1] / np.sqrt(sphere_pairs.values[1])
    np.testing.assert_array_equal(every[:, 0], first)


def test_shape_dna_of_spheres(sphere_pairs):
    """Oracle: analytic. l (l + 1), times 4 pi at unit area whatever the radius."""
    half = made(4 * sphere_pairs.values, 2 * sphere_pairs.vectors, sphere_pairs.area / 4)
    expected = oracles.sphere_eigenvalues(36).astype(float)
    np.testing.assert_allclose(iv.shape_dna(sphere_pairs)[:36], expected, rtol=1e-3)
    np.testing.assert_allclose(iv.shape_dna(half)[:36], 4 * expected, rtol=1e-3)
    for pairs in (sphere_pairs, half):
        even = iv.shape_dna(pairs, unit_area=True)
        np.testing.assert_allclose(even[:36], 4 * np.pi * expected, rtol=1e-3)
    iv.shape_dna(sphere_pairs)[0] = 7.0  # a copy, not the record's own array


def test_spectrum_of_one_small_exponential():
    """Oracle: analytic. log(1 + e exp(-t)) ~ e exp(-t): |Gamma(1 + 2 pi i f)| e, in closed form.

    |Gamma(1 + i w)|^2 = pi w / sinh(pi w). The next term is e/2 times the first; the sum
    over log t leaves less, t squared at the window's lower end.
    """
    small = 1e-6
    pairs = made([0.0, 1.0], np.sqrt([[1.0, small]]))
    times = np.geomspace(0.05, 20, 80)
    spectrum = iv.scale_invariant_heat_kernel_signature(pairs, times, frequencies=8)[0]
    w = 2 * np.pi * iv.signature_kind(iv.scale_invariant_heat_kernel_signature).columns(times)[:8]
    expected = small * np.sqrt(np.pi * w[1:] / np.sinh(np.pi * w[1:]))
    np.testing.assert_allclose(spectrum[0], small, rtol=1e-5)
    np.testing.assert_allclose(spectrum[1:], expected, rtol=1e-5)


@pytest.mark.parametrize("scale", [0.5, 0.8, 1.25, 2.0, 3.0])
def test_size_does_not_matter_to_the_scale_invariant_signature(scale, spheroid_pairs):
    """Oracle: symmetry. A scaled surface, the same times: the same, in every column.

    Divided by each column's mean, as a comparison does it, so the small columns count as
    much. What is left at scales 0.5 and 3 is an end of the window, which they come close to.
    """
    times = iv.diffusion_times(spheroid_pairs)
    method = iv.scale_invariant_heat_kernel_signature
    base = method(spheroid_pairs, times)
    scaled = method(iv.eigenpairs(iv.fem(spheroid(scale)), len(spheroid_pairs.values)), times)
    relative = np.abs(scaled - base) / base.mean(axis=0)
    assert relative.max() < (5e-3 if scale <= 2 else 0.1)
    assert relative[:, :8].max() < 2e-3
    assert (base.std(axis=0) / base.mean(axis=0))[1:].min() > 1e-2  # it tells places apart


def test_the_sampling_of_time_does_not_matter_to_the_spectrum(spheroid_pairs):
    """Oracle: convergence. Twice as many times in the same window; the same frequencies."""
    method = iv.scale_invariant_heat_kernel_signature
    times = 0.3 * 10 ** (np.arange(20) / 10), 0.3 * 10 ** (np.arange(40) / 20)
    axes = (iv.signature_kind(method).columns(t) for t in times)
    np.testing.assert_allclose(*axes, rtol=1e-12)
    spectra = (method(spheroid_pairs, t) for t in times)
    np.testing.assert_allclose(*spectra, rtol=1e-4)


def test_rims_where_every_eigenvector_is_zero_are_unknown():
    """Oracle: algebra. NaN at fixed nodes; elsewhere only lambda_i - lambda_1 counts."""
    rng = np.random.default_rng(5)
    vectors = rng.uniform(0.5, 1.0, (6, 4))
    vectors[[1, 4]] = 0.0
    times = np.geomspace(0.01, 10, 60)
    gaps = np.array([0.0, 3.0, 4.0, 9.0])
    fixed, free = (
        iv.scale_invariant_heat_kernel_signature(made(gaps + lowest, vectors), times)
        for lowest in (2.0, 0.0)
    )
    assert np.isnan(fixed[[1, 4]]).all()
    assert np.isfinite(fixed[[0, 2, 3, 5]]).all()
    np.testing.assert_allclose(fixed, free, rtol=1e-10)


def test_kinds_follow_the_function():
    """Oracle: algebra. A partial is known by what it wraps; an own function is like the HKS."""
    for short, method in zip(("hks", "sihks", "wks", "gps"), METHODS.values(), strict=True):
        assert iv.signature_kind(method).short == short
        assert iv.signature_kind(partial(partial(method), width=1)).short == short
        assert iv.signature_kind(method).per_time == (short == "hks")
    times = np.geomspace(0.1, 10, 50)
    si = iv.scale_invariant_heat_kernel_signature
    nested = partial(partial(si, frequencies=9), frequencies=8)
    for method, count in ((si, 16), (partial(si, frequencies=8), 8), (nested, 8)):
        pairs = made([0.0, 1.0], np.ones((2, 2)))
        assert len(iv.signature_kind(method).columns(times)) == count
        assert method(pairs, times).shape == (2, count)

    def squares(pairs, times):
        return pairs.vectors**2

    own = iv.signature_kind(squares)
    assert (own.short, own.title) == ("squares", "squares")
    assert own.samples is iv.diffusion_times
    assert own.per_time
    assert own.unit == "1 / length²"
    assert iv.signature_kind(lambda pairs, times: times).short == "signature"


def test_no_more_columns_are_asked_for_than_there_are_eigenpairs():
    """Oracle: algebra. Two nonzero pairs of three, 20 asked for: 1 and 2."""
    samples = samples_for(iv.global_point_signature, made(LEVELS, np.ones((4, 3))))
    np.testing.assert_array_equal(samples, [1.0, 2.0])


GOOD = made(LEVELS, np.ones((4, 3)))
SI = partial(iv.scale_invariant_heat_kernel_signature, GOOD)
WAVE = partial(iv.wave_kernel_signature, GOOD)
SPOILT = {  # the call, the argument that the error names, its code
    "times not logarithmic": (partial(SI, np.linspace(1, 3, 30)), "times", "A02"),
    "times descending": (partial(SI, np.geomspace(4, 1, 30)), "times", "A02"),
    "one time": (partial(SI, [1.0]), "times", "A02"),
    "time 0": (partial(SI, [0.0, 1.0]), "times", "A02"),
    "time infinite": (partial(SI, [1.0, 2.0, np.inf]), "times", "A02"),
    "equal times": (partial(SI, [2.0, 2.0, 2.0]), "times", "A02"),
    "no frequency": (partial(SI, [1.0, 2.0], frequencies=0), "frequencies", "A02"),
    # a step of one decade: a window of 2 + 4 samples has 4 frequencies
    "frequency 5 of 4": (partial(SI, [1.0, 10.0], frequencies=5), "frequencies", "A02"),
    "energy 0": (partial(WAVE, [0.0, 1.0], width=1.0), "energies, width", "A02"),
    "width 0": (partial(WAVE, [1.0], width=0.0), "energies, width", "A02"),
    "no width": (partial(WAVE, [1.0]), "energies", "A02"),
    "only zeros": (
        partial(iv.wave_kernel_signature, made([0.0], np.ones((4, 1))), [1.0], width=1.0),
        "energies, width",
        "A02",
    ),
    "one energy": (partial(iv.wave_energies, GOOD, 1), "count", "A02"),
    "one level": (partial(iv.wave_energies, made(LEVELS[:2], np.ones((4, 2)))), "count", "A02"),
    "number 0": (partial(iv.global_point_signature, GOOD, [0]), "numbers", "A02"),
    "number 3 of 2": (partial(iv.global_point_signature, GOOD, [3]), "numbers", "A02"),
    "number 1.5": (partial(iv.global_point_signature, GOOD, [1.5]), "numbers", "A02"),
    "node 4 of 4": (partial(iv.heat_kernel, GOOD, [1.0], [4]), "sources", "A02"),
    "node -1": (partial(iv.heat_kernel, GOOD, [1.0], [-1]), "sources", "A02"),
    "node 0.0": (partial(iv.heat_kernel, GOOD, [1.0], [0.0]), "sources", "A02"),
    "no node": (partial(iv.heat_kernel, GOOD, [1.0], []), "sources", "A02"),
    "time -1": (partial(iv.diffusion_radius, [-1.0]), "times", "A02"),
    "curvature at 0": (partial(iv.implied_curvature, np.ones((2, 1)), [0.0]), "times", "A02"),
    "two times, one column": (
        partial(iv.implied_curvature, np.ones((2, 1)), [1.0, 2.0]),
        "signature, times",
        "A03",
    ),
    "areas": (partial(iv.mean_size, np.ones((2, 1)), np.ones(3)), "signature, areas", "A03"),
    "zero column": (partial(iv.mean_size, np.array([[1.0, 0.0]]), np.ones(1)), "signature", "A02"),
    "nothing known": (partial(iv.mean_size, np.array([[np.nan]]), np.ones(1)), "signature", "A02"),
}


@pytest.mark.parametrize(("call", "name", "code"), SPOILT.values(), ids=SPOILT)
def test_what_makes_no_sense_is_refused(call, name, code):
    """Oracle: algebra. Each of these is an ArgumentError, with no warning before it."""
    with pytest.raises(iv.ArgumentError, match=f"^{name}: expected .* got .*{code}"):
        call()


def test_the_last_allowed_values_are_taken():
    """Oracle: algebra. The edges beside those that are refused: node 3 of 4, 4 frequencies, ..."""
    assert iv.heat_kernel(GOOD, [1.0], 3).shape == (4, 1, 1)
    assert iv.global_point_signature(GOOD, 2).shape == (4, 1)
    method = iv.scale_invariant_heat_kernel_signature
    assert method(GOOD, [1.0, 10.0], frequencies=4).shape == (4, 4)
    rounded = np.geomspace(1, 10, 10).round(4)  # times read from a text file
    assert method(GOOD, rounded).shape == (4, 16)


def test_change_is_divided_by_the_bases_mean_signature(sphere_pairs):
    """Oracle: algebra. A signature 1 % smaller everywhere changes by its share of the mean."""
    times = iv.diffusion_times(sphere_pairs, 30)
    signature = iv.heat_kernel_signature(sphere_pairs, times)
    scale = iv.heat_trace_scale(sphere_pairs, times)
    change = iv.signature_difference(signature, 0.99 * signature, scale)
    np.testing.assert_allclose(change, 0.01 * signature / scale, rtol=1e-9)
    np.testing.assert_allclose(change, 0.01, rtol=0.01)  # a sphere: the mean is everywhere
    halved = iv.signature_difference(signature, 0.99 * signature, scale, parameter_step=2.0)
    np.testing.assert_allclose(halved, change / 2)


def test_mean_size_is_the_heat_trace(spheroid_pairs):
    """Oracle: algebra. The mean of the HKS over the surface is sum exp(-lambda_i t) / area."""
    areas = iv.fem(spheroid()).mass @ np.ones(len(spheroid_pairs.vectors))
    times = np.geomspace(0.5, 5, 9)
    signature = iv.heat_kernel_signature(spheroid_pairs, times)
    trace = iv.heat_trace_scale(spheroid_pairs, times)
    np.testing.assert_allclose(iv.mean_size(signature, areas), trace, rtol=1e-3)
    np.testing.assert_allclose(iv.mean_size(-signature, areas), trace, rtol=1e-3)
    signature[iv.icosphere(2).points[:, 2] < 0] = np.nan  # one of two equal halves
    np.testing.assert_allclose(iv.mean_size(signature, areas), trace, rtol=1e-2)


def test_wrong_shapes_are_refused():
    """Oracle: algebra. Unequal shapes, weights of zero, a step of zero."""
    two = np.ones((3, 2))
    for arguments, step, code in (
        ((two, two[:2], np.ones(2)), 1.0, "A03"),
        ((two, two, np.ones(3)), 1.0, "A03"),
        ((two, two, np.zeros(2)), 1.0, "A02"),
        ((two, two, np.ones(2)), 0.0, "A02"),
    ):
        with pytest.raises(iv.ArgumentError, match=code):
            iv.signature_difference(*arguments, parameter_step=step)


@pytest.mark.parametrize("size", [0.2, 5.0])
def test_times_of_another_size_are_refused(size, sphere_pairs):
    """Oracle: analytic. Five times the size shifts log t by 3.2: heat then meets the window's end.

    A factor of 2.5 still passes.
    """
    times = iv.diffusion_times(sphere_pairs, 60)
    iv.scale_invariant_heat_kernel_signature(sphere_pairs.scaled(2.5**2 * 4 * np.pi), times)
    other = sphere_pairs.scaled(size**2 * sphere_pairs.area)
    with pytest.raises(iv.ArgumentError, match=r"times: expected so wide a range.*A02"):
        iv.scale_invariant_heat_kernel_signature(other, times)
