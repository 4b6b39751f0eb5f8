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

import isovary as iv
from isovary import cli
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
    offered = {getattr(f, "func", f) for f in cli._LAPLACIANS.values()}
    assert offered == {f for f in OPERATORS.values() if not isinstance(f, partial)}
    assert set(cli._SIGNATURES.values()) == set(SIGNATURES.values())
    hints = get_type_hints(cli.compare_files)
    assert set(get_args(hints["laplacian"])) == set(cli._LAPLACIANS)
    assert set(get_args(hints["signature"])) == set(cli._SIGNATURES)


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
