"""The records: checked once at the door, exact where theory says so."""

from __future__ import annotations

import numpy as np
import pytest

import isovary as iv

BOX = ((-1.0, -2.0, 0.0), (2.0, 1.0, 4.0))


def cubic(p):
    x, y, z = np.moveaxis(np.asarray(p), -1, 0)
    return x**3 - 2 * x * y * z + y**2 * z + 3 * z**3 - x


def cubic_gradient(p):
    x, y, z = p.T
    return np.stack(
        [3 * x**2 - 2 * y * z - 1, -2 * x * z + 2 * y * z, -2 * x * y + y**2 + 9 * z**2]
    ).T


def cubic_hessian(p):
    x, y, z = p.T
    rows = [
        [6 * x, -2 * z, -2 * y],
        [-2 * z, 2 * z, 2 * y - 2 * x],
        [-2 * y, 2 * y - 2 * x, 18 * z],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def points_in(box, count=50):
    return np.random.default_rng(917).uniform(*box, (count, 3))


def test_spline_reproduces_a_cubic_with_its_derivatives():
    """Oracle: analytic. Not-a-knot cubic splines reproduce cubics up to the box's faces."""
    field = iv.ScalarField.from_function(cubic, BOX, (7, 6, 5))
    points = points_in(BOX)
    np.testing.assert_allclose(field.value(points), cubic(points), atol=1e-11)
    np.testing.assert_allclose(field.gradient(points), cubic_gradient(points), atol=1e-10)
    np.testing.assert_allclose(field.hessian(points), cubic_hessian(points), atol=1e-9)


def test_spline_converges_with_order_four():
    """Oracle: order. Halving the spacing divides the error of a smooth field by 16."""
    points, errors = points_in(BOX), []
    for count in (21, 41, 81):
        field = iv.ScalarField.from_function(lambda p: np.sin(p).prod(axis=-1), BOX, (count,) * 3)
        errors.append(np.abs(field.value(points) - np.sin(points).prod(axis=-1)).max())
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert (orders > 3.8).all(), orders


def test_logarithmic_derivatives_match_the_plain_ones():
    """Oracle: analytic. A Gaussian's logarithm is a quadratic, so everything is exact."""
    field = iv.ScalarField.from_function(
        lambda p: np.exp(-(p**2).sum(axis=-1)), BOX, (6, 7, 8), logarithmic=True
    )
    points = points_in(BOX)
    value = np.exp(-(points**2).sum(axis=1))
    np.testing.assert_allclose(field.value(points), value, rtol=1e-9)
    np.testing.assert_allclose(field.gradient(points), -2 * points * value[:, None], atol=1e-9)
    outer = 4 * points[:, :, None] * points[:, None, :] - 2 * np.eye(3)
    np.testing.assert_allclose(field.hessian(points), outer * value[:, None, None], atol=1e-8)


def test_refined_samples_are_the_spline():
    """Oracle: algebra. refine() equals value() at the finer grid's points, in both modes."""
    for logarithmic in (False, True):
        field = iv.ScalarField.from_function(
            lambda p: np.exp(cubic(p) / 50), BOX, (5, 6, 7), logarithmic=logarithmic
        )
        low, high = np.array([1, 0, 2]), np.array([4, 5, 6])
        fine = field.refine(np.array([2, 1, 3]), low, high)
        assert fine.shape == (7, 6, 13)
        axes = [np.linspace(low[a], high[a], fine.shape[a]) for a in range(3)]
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        exact = field.value(field.origin + grid * field.spacing)
        np.testing.assert_allclose(np.exp(fine) if logarithmic else fine, exact, rtol=1e-12)


def test_nothing_is_extrapolated():
    """Oracle: algebra. Outside the box everything is NaN; its faces belong to it."""
    field = iv.ScalarField.from_function(cubic, BOX, (5, 5, 5))
    outside = np.array([[2.001, 0, 1.0], [0, -2.1, 1.0]])
    assert np.isnan(field.value(outside)).all()
    assert np.isnan(field.gradient(outside)).all()
    assert np.isfinite(field.value(np.array(BOX))).all()


@pytest.mark.parametrize("dtype", ["f2", "f4", ">f8", "i2", "u1", "?"])
def test_any_dtype_and_layout_gives_the_same_field(dtype):
    """Oracle: symmetry. Byte order, integer kind, memory order and strides do not matter."""
    values = np.random.default_rng(631).integers(0, 2, (6, 5, 7))
    cast = np.asfortranarray(values.astype(dtype))[::-1][::-1]
    cast.setflags(write=False)
    field = iv.ScalarField(cast)
    np.testing.assert_array_equal(field.values, values)
    assert field.values.dtype == np.float64


def test_records_own_their_arrays():
    """Oracle: algebra. Changing the caller's array changes nothing, and the record is read-only."""
    values = np.random.default_rng(5).random((4, 4, 4))
    field = iv.ScalarField(values)
    kept = field.values.copy()
    values[:] = 0
    np.testing.assert_array_equal(field.values, kept)
    with pytest.raises(ValueError, match="read-only"):
        field.values[0, 0, 0] = 1


def ones(shape=(4, 4, 4), **changes):
    values = np.random.default_rng(4).random(shape)
    for where, value in changes.items():
        values[tuple(int(c) for c in where[1:])] = value
    return values


@pytest.mark.parametrize(
    ("make", "code", "text"),
    [
        (lambda: iv.ScalarField(ones((3, 4, 4))), "A03", "at least 4 samples"),
        (lambda: iv.ScalarField(ones()[0]), "A03", "got shape (4, 4)"),
        (lambda: iv.ScalarField(ones() * 1j), "A03", "complex128"),
        (lambda: iv.ScalarField(ones(), spacing=(1, 1, 0)), "A03", "spacing: expected positive"),
        (lambda: iv.ScalarField(ones(), spacing=(1, 1)), "A03", "spacing: expected 3"),
        (lambda: iv.compare("a.vti", "b.vti", 0.5), "A03", "base: expected a ScalarField, got str"),
        (lambda: iv.ScalarField(ones(), origin=(1, 1, np.nan)), "A03", "origin: expected 3"),
        (lambda: iv.ScalarField(ones(_123=np.nan, _321=np.inf)), "I01", "got 2 NaN or inf within "
         "indices [1, 2, 1] to [3, 2, 3]"),
        (lambda: iv.ScalarField(np.full((4, 4, 4), 2.5)), "I03", "the constant 2.5"),
        (lambda: iv.ScalarField(ones(_000=0.0), logarithmic=True), "I02", "minimum of 0.0"),
        (lambda: iv.ScalarField(ones()).check_isovalue(2.0), "I02", "quantiles 0.5, 0.9 and 0.99"),
        (lambda: iv.Surface(np.zeros((3, 2)), [[0, 1, 2]]), "A03", "points: expected shape (n, 3)"),
        (lambda: iv.Surface(np.eye(3), [[0, 1, 2, 0]]), "A03", "(m, 3) or (m, 6)"),
        (lambda: iv.Surface(np.eye(3), [[0, 1, 3]]), "M01", "in [0, 3), got 3"),
        (lambda: iv.Surface(np.eye(3), [[0, 1, -1]]), "M01", "in [0, 3), got -1"),
        (lambda: iv.Surface(np.eye(4)[:, :3], [[0, 1, 2]]), "M02", "got 1 on none, first 3"),
        (lambda: iv.Surface(np.eye(3), [[0, 1, 2], [0, 1, 1]]), "M03", "first 1"),
        (lambda: iv.Surface(np.diag([1, np.nan, 1.0]), [[0, 1, 2]]), "I01", "got 1 with NaN"),
    ],
)  # fmt: skip
def test_bad_input_is_told_by_name(make, code, text):
    """Oracle: algebra. Each fault gives its code, what was found, and where; edges included."""
    with pytest.raises(iv.IsovaryError) as caught:
        make()
    assert caught.value.code == code
    assert text in str(caught.value)


def test_one_motion_after_another():
    """Oracle: algebra. (A after B)(x) = A(B(x)); mirrors multiply; the inverse undoes."""
    quarter = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    first = iv.RigidMotion(np.diag([1.0, 1, -1]) @ quarter, [1, 2, 3])
    second = iv.RigidMotion(np.roll(quarter, 1, axis=0), [0, -1, 0.5])
    points = np.arange(12.0).reshape(4, 3)
    np.testing.assert_allclose(second.after(first).apply(points), second.apply(first.apply(points)))
    assert second.after(first).mirrored == (first.mirrored != second.mirrored)
    assert first.mirrored
    np.testing.assert_allclose(first.inverse.after(first).apply(points), points)


def test_a_mirrored_surface_keeps_its_outside():
    """Oracle: analytic. An icosphere mirrored: nodes, normals and triangles face outward still."""
    sphere = iv.icosphere(2)
    moved = iv.RigidMotion(np.diag([-1.0, 1, 1]), [5, 0, 0]).surface(sphere)
    np.testing.assert_allclose(moved.points, sphere.points * [-1, 1, 1] + [5, 0, 0])
    own = iv.Surface(moved.points, moved.triangles).normals
    out = moved.points - [5, 0, 0]
    assert (own * out).sum(axis=1).min() > 0.9
    np.testing.assert_allclose(moved.normals, out, atol=1e-12)
    assert moved.area == pytest.approx(sphere.area)
