"""A comparison with other operators and signatures than the usual ones."""

from __future__ import annotations

import subprocess
import sys
from functools import partial
from typing import get_args, get_type_hints

import numpy as np
import pytest
from conftest import ellipsoid_field
from contracts.test_laplacian import METHODS
from contracts.test_signature import METHODS as SIGNATURES
from oracles import hemisphere_signature

import isovary as iv
from isovary import names as words
from isovary.cli import compare_files
from isovary.methods import Methods, method_name

OPERATORS = {name: method for name, (method, _) in METHODS.items()}
BOX = ((-1.6, -1.6, -1.6), (1.6, 1.6, 1.6))


def ball(radius, stretch=1.0):
    """Its isosurface -1 is an ellipsoid with the semi-axes radius, radius, radius * stretch."""
    axes = radius * np.array([1.0, 1.0, stretch])
    return iv.ScalarField.from_function(lambda p: -((p / axes) ** 2).sum(axis=-1), BOX, (17,) * 3)


def small(base, perturbed, **options):
    usual = {"vertices": 150, "pairs": 40, "times": 30, "order": 1}
    return iv.compare(base, perturbed, -1.0, **usual | options)


@pytest.mark.parametrize("name", ["cotangent", "robust", "knn_graph"])
def test_other_operators_can_be_compared_with(name):
    """Oracle: symmetry. A sphere grown by 10 %: no change at all once both have one area.

    The carried mesh is the base's, 1.1 times as large, and every operator scales with it
    (tests/contracts/test_laplacian.py).
    """
    result = small(ball(1.0), ball(1.1), laplacian=OPERATORS[name])
    assert result.choices["laplacian"] == method_name(OPERATORS[name])
    assert np.abs(result.change).max() > 0.03
    assert np.abs(result.unit_area_change).max() < 1e-5


def test_signatures_of_a_grown_sphere():
    """Oracle: symmetry. The scale-invariant one does not change; the wave kernel's does by 1/1.21.

    The wave kernel signature has the mean 1 / area at every energy, so on a sphere, where it
    is the same everywhere, it is divided by the growth of the area.
    """
    base, grown = ball(1.0), ball(1.1)
    pairs = {"pairs": 64, "order": 2, "vertices": 200}  # whole shells
    invariant = small(base, grown, signature=iv.scale_invariant_heat_kernel_signature, **pairs)
    assert np.abs(invariant.change).max() < 1e-2
    assert invariant.columns.shape == (invariant.change.shape[1],)
    wave = small(base, grown, signature=iv.wave_kernel_signature, **pairs)
    np.testing.assert_allclose(wave.change, 1 - 1 / 1.21, atol=5e-3)
    heat = small(base, grown, **pairs)
    assert np.abs(heat.change).max() > 0.05


def test_change_is_that_of_the_steps_by_hand():
    """Oracle: algebra. compare's wave kernel change, repeated from its own surfaces."""
    result = small(ball(1.0, 1.2), ball(1.0, 1.25), signature=iv.wave_kernel_signature)
    before = iv.wave_kernel_signature(result.base_pairs, result.times)
    after = iv.wave_kernel_signature(result.perturbed_pairs, result.times)
    corners = result.base.points[result.base.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    weights = np.bincount(
        result.base.triangles.ravel(), np.repeat(np.linalg.norm(normal, axis=1), 3)
    )
    scale = weights @ before / weights.sum()
    np.testing.assert_allclose(result.change, (before - after) / scale, rtol=1e-9, atol=1e-12)
    assert result.methods.kind.short == "wks"


def test_global_point_signature_says_that_it_cannot_be_compared():
    """Oracle: algebra. The note is there, and the noise floor swallows most of the change."""
    result = small(ball(1.0, 1.2), ball(1.0, 1.25), signature=iv.global_point_signature)
    assert any("[S09]" in note for note in result.notes)
    assert result.significant.mean() < 0.5


def test_a_function_of_ones_own_is_a_signature():
    """Oracle: algebra. Half the heat kernel signature is changed by half as much, scale apart."""

    def halved(pairs, times):
        return 0.5 * iv.heat_kernel_signature(pairs, times)

    own = small(ball(1.0, 1.2), ball(1.0, 1.25), signature=halved)
    usual = small(ball(1.0, 1.2), ball(1.0, 1.25))
    np.testing.assert_allclose(own.times, usual.times)
    np.testing.assert_allclose(own.base_signature, usual.base_signature / 2)
    # scales: mean over the nodes of the signature, the heat trace of the consistent mass
    np.testing.assert_allclose(own.change, usual.change, rtol=0.05, atol=1e-4)


def test_warnings_of_an_operator_become_notes():
    """Oracle: data. A UserWarning of the operator stands among the notes, once."""
    import warnings

    def grumbling(surface):
        warnings.warn("surface: expected better, got this [L99]", UserWarning, stacklevel=2)
        return iv.fem(surface)

    result = small(ball(1.0, 1.2), ball(1.0, 1.25), laplacian=grumbling)
    assert sum("[L99]" in note for note in result.notes) == 1


def test_dirichlet_comparison_of_an_open_surface():
    """Oracle: analytic. A sphere cut by the box: 0 at the rim, NaN nowhere, the rim is told."""
    cap = iv.ScalarField.from_function(
        lambda p: -(p**2).sum(axis=-1), ((-1.5, -1.5, 0), (1.5, 1.5, 1.5)), (17, 17, 9)
    )
    result = small(cap, cap, laplacian=partial(iv.fem, dirichlet=True))
    rim = np.abs(result.base.points[:, 2]) < 1e-9
    assert rim.any()
    assert not result.base_signature[rim].any()
    assert result.base_signature[~rim].min() > 0
    assert (result.change == 0).all()
    assert any("is 0 at a rim" in note and "[I05]" in note for note in result.notes)
    assert result.near_rim[rim].all()
    assert not result.near_rim[result.rim_distance > 2 * np.sqrt(result.times[-1])].any()


def test_only_consistent_finite_elements_have_their_order():
    """Oracle: order. h^4 for quadratic elements; h^2 lumped, or with any other operator."""
    curved = iv.icosphere(1)
    for operator, order in (
        (iv.fem, 2),
        (partial(iv.fem, dirichlet=True), 2),
        (partial(iv.fem, lumped=True), 1),
        (iv.cotangent, 1),
    ):
        assert Methods(operator).order(curved) == order
    assert Methods(iv.fem).order(iv.icosphere(1, order=1)) == 1


def test_the_command_line_offers_every_method():
    """Oracle: data. The words of --laplacian and --signature cover the rooms."""
    offered = {getattr(f, "func", f) for f in words.LAPLACIANS.values()}
    assert offered == {f for f in OPERATORS.values() if not isinstance(f, partial)}
    assert set(words.SIGNATURES.values()) == set(SIGNATURES.values())
    hints = get_type_hints(compare_files)
    assert set(get_args(hints["laplacian"])) == set(words.LAPLACIANS)
    assert set(get_args(hints["signature"])) == set(words.SIGNATURES)


def test_dirichlet_is_refused_where_there_is_none(tmp_path):
    """Oracle: algebra. Exit code 2 and the operators that have one, before any work."""
    field = ellipsoid_field(samples=9)
    np.savez(tmp_path / "a.npz", values=field.values, spacing=field.spacing, origin=field.origin)
    command = [sys.executable, "-m", "isovary", "compare", "a.npz", "a.npz", "--isovalue", "0.6"]
    options = ["-o", "out", "--laplacian", "knn-graph", "--boundary", "dirichlet"]
    done = subprocess.run(
        command + options, cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert "boundary: expected natural with --laplacian knn-graph, got dirichlet" in done.stderr


FEW = {"vertices": 250, "pairs": 50, "times": 20}


def ball_and_drop(radius):
    def value(p):
        ball, drop = (np.linalg.norm(p - [x, 0, 0], axis=-1) for x in (-0.4, 1.1))
        return np.maximum(1.0 - ball, radius - drop)

    return iv.ScalarField.from_function(value, ((-1.6, -1.3, -1.3), (1.6, 1.3, 1.3)), (49, 40, 40))


@pytest.mark.parametrize("name", ["wave_kernel_signature", "global_point_signature"])
def test_other_signatures_of_components_stay_finite(name):
    """Oracle: algebra. Energies and pairs of one component are nothing on another: whole means."""
    fields = ball_and_drop(0.35), ball_and_drop(0.3535)
    result = iv.compare(*fields, 0.0, signature=SIGNATURES[name], **FEW)
    assert np.isfinite(result.change).all()
    assert np.abs(result.change).mean() < 2.0
    assert any("relative to the whole surface's mean" in note for note in result.notes)


def test_each_component_is_compared_with_itself():
    """Oracle: analytic. A droplet grown by 1 % beside a ball that stays: 2 % at late times.

    At late times the signature of a component is 1 / its area, so the droplet's change is
    1 - 1 / 1.01^2 of its own mean; against the mean of both it would be 10 times as much.
    """

    result = iv.compare(ball_and_drop(0.35), ball_and_drop(0.3535), 0.0, **FEW)
    on_drop = result.base.points[:, 0] > 0.7
    np.testing.assert_allclose(result.change[on_drop, -1], 1 - 1.01**-2, rtol=0.05)
    assert np.abs(result.change[~on_drop, -1]).max() < 1e-3
    assert any("relative to its own mean" in note for note in result.notes)


def test_a_graph_of_edges_cannot_be_carried():
    """Oracle: algebra. The edges of a carried mesh are the base's: refused; rays may use it."""
    with pytest.raises(iv.ArgumentError, match=r"laplacian: expected .* sees lengths.*A02"):
        small(ball(1.0), ball(1.1), laplacian=partial(iv.uniform_graph, nearest=4))
    rays = {"correspondence": iv.normal_rays, "vertices": 600}  # two meshes, and their noise
    result = small(ball(1.0), ball(1.1), laplacian=iv.uniform_graph, **rays)
    assert any("[L02]" in note for note in result.notes)
    assert np.abs(result.unit_area_change).mean() < 0.2 * np.abs(result.change).mean()


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("laplacian", "cotangent"),
        ("signature", "wave_kernel_signature"),
        ("correspondence", "normal_rays"),
    ],
)
def test_words_are_no_methods(name, value):
    """Oracle: algebra. The text shows the function to give instead."""
    with pytest.raises(iv.ArgumentError, match=rf"{name}: expected a function such as .*{value}"):
        small(ball(1.0), ball(1.1), **{name: value})


@pytest.mark.parametrize("wrong", [lambda pairs, times: pairs.values, lambda pairs, times: 1.0])
def test_a_signature_has_a_row_for_each_node(wrong):
    """Oracle: algebra. Eigenvalues are no signature of places."""
    with pytest.raises(iv.ArgumentError, match=r"signature: expected .* a row for each node.*A03"):
        small(ball(1.0), ball(1.1), signature=wrong)


def test_noise_floors_are_made_with_the_same_methods(monkeypatch):
    """Oracle: algebra. Two levels and the samples' floor, both surfaces each; order 1 for h^2.

    The samples' floor has three: all samples, every other, and noise added.
    """
    from isovary import levels

    orders, calls = [], []
    own = levels.noise_floor

    def noted(*args, **options):
        orders.append(options["order"])
        return own(*args, **options)

    def operator(surface):
        calls.append(len(surface.points))
        return iv.cotangent(surface)

    monkeypatch.setattr(levels, "noise_floor", noted)
    small(ball(1.0, 1.2), ball(1.0, 1.25), laplacian=operator, order=2)
    assert len(calls) == 2 * (2 + 3)
    assert set(orders) == {1}


def test_dirichlet_change_of_a_cut_sphere():
    """Oracle: analytic. A half sphere grown by 10 %, its rim held at 0: none at one area.

    The image formula gives the hemisphere's signature; near the rim it vanishes with its
    change. The perturbed pairs start from the base's, which are 0 on the rim as well.
    """

    def half(radius):
        return iv.ScalarField.from_function(
            lambda p: -((p / radius) ** 2).sum(axis=-1),
            ((-1.5, -1.5, 0), (1.5, 1.5, 1.5)),
            (25, 25, 13),
        )

    options = {"laplacian": partial(iv.fem, dirichlet=True), "order": 2, "vertices": 400}
    result = small(half(1.0), half(1.1), **options, pairs=100)
    z = result.base.points[:, 2]
    exact = hemisphere_signature(z, result.times, -1)
    scale = exact.mean()
    np.testing.assert_allclose(result.base_signature, exact, atol=0.05 * scale)
    assert result.perturbed_pairs.solver == "from start"
    assert np.abs(result.change).max() > 0.03
    assert np.abs(result.unit_area_change).max() < 1e-3
    assert not result.change[z < 1e-9].any()


def test_near_rim_needs_times():
    """Oracle: algebra. Energies are no times."""
    result = small(ball(1.0), ball(1.0), signature=iv.wave_kernel_signature)
    with pytest.raises(iv.ArgumentError, match="near_rim: expected a signature over times"):
        _ = result.near_rim


def test_the_mesher_and_its_sizing_are_swapped():
    """Oracle: algebra. Edges graded 4 : 1 agree with the sizing, and are told with its name."""
    graded = partial(iv.nonuniform_sizing, ratio=4.0)
    result = small(ball(1.0), ball(1.1), mesher=partial(iv.distmesh, sizing=graded))
    lengths, ratios = result.base_quality.edge_lengths, result.base_quality.edge_ratios
    assert np.log(lengths).std() > 0.2 > np.log(ratios).std()
    assert result.choices["mesher"] == "distmesh(sizing=nonuniform_sizing(ratio=4.0))"
    with pytest.raises(iv.ArgumentError, match=r"mesher: expected one without order.*A02"):
        small(ball(1.0), ball(1.1), mesher=partial(iv.marching_cubes, order=1))


def test_the_noise_floor_has_a_coarser_mesh():
    """Oracle: algebra. A thin rounded plate takes more vertices than are asked for, on both
    meshes: the finer one is refined, or the two would be equal and the noise 0.
    """

    def plate(stretch):
        return iv.ScalarField.from_function(
            lambda p: (
                0.02 - p[..., 2] ** 2 - (p[..., 0] ** 4 + (1 + stretch) * p[..., 1] ** 4) / 200
            ),
            ((-2.2, -2.2, -0.6), (2.2, 2.2, 0.6)),
            (19, 19, 13),
        )

    result = iv.compare(plate(0), plate(0.05), 0.0, vertices=200, pairs=20, times=10, order=1)
    vertices = len(np.unique(result.base.corners))
    assert vertices > 300
    assert result.choices["noise_floor_vertices"][0] < 0.8 * vertices
    assert result.choices["noise_of_the_mesh"] > 1e-4
    assert not any("got 100" in note for note in result.notes)  # nobody asked for half of it


def test_smoothing_is_noted():
    """Oracle: data. The noise floor does not hold what smoothing hides: I09, in the choices."""
    result = small(ball(1.0).smoothed(0.05), ball(1.1).smoothed(0.05))
    assert any("[I09]" in note for note in result.notes)
    assert result.choices["base"]["smoothing"] == 0.05
