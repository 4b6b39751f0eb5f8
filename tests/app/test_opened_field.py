"""A field before the comparison: what is in the file, and an isosurface to look at."""

from __future__ import annotations

import gzip

import numpy as np
import pytest
import pyvista as pv

import isovary as iv
from isovary.app._jobs import Finished
from isovary.app._opened_field import OpenedField, _Histogram, _spectrum, opened, preview
from isovary.data import water_pair
from isovary.errors import FieldError, FileError
from isovary.geometry import topology


def sphere(count=33, radius=1.0, origin=0.0, spacing=None, order="C", dtype=float):
    """Distance from the middle of a box of 3 radii."""
    step = 3 * radius / (count - 1)
    axes = np.meshgrid(*[np.linspace(-1.5 * radius, 1.5 * radius, count)] * 3, indexing="ij")
    values = np.sqrt(sum(axis**2 for axis in axes)).astype(dtype)
    return made(np.array(values, order=order), step if spacing is None else spacing, origin)


def made(values, spacing=1.0, origin=0.0):
    """An opened field whose histogram does not matter."""
    return OpenedField(
        name="f",
        array=None,
        arrays=(),
        values=values,
        spacing=np.broadcast_to(np.asarray(spacing, float), 3),
        origin=np.broadcast_to(np.asarray(origin, float), 3),
        counts=np.zeros(1, int),
        edges=np.array([0.0, 1.0]),
        logarithmic=False,
        isovalue=0.0,
        reason="",
        bad=0,
    )


def volume(shown):
    """Volume inside of a closed surface, positive if its triangles face outward."""
    a, b, c = np.moveaxis(shown.points[shown.triangles].astype(float), 1, 0)
    return float((a * np.cross(b, c)).sum() / 6)


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("dtype", [np.float64, np.float32, ">f4"])
def test_sphere_has_its_volume_and_one_component(order, dtype):
    """Oracle: analytic. Points within h^2 / 8r of the sphere: the error of linear interpolation
    along an edge, where the distance's second derivative is at most 1/r, r > 0.9.

    The distance grows outward, so that normals towards smaller values point inward.
    """
    shown = preview(sphere(order=order, dtype=dtype), 1.0)
    np.testing.assert_allclose(shown.offset, 1.5)
    radii = np.linalg.norm(shown.points, axis=1)
    assert np.abs(radii - 1).max() < (3 / 32) ** 2 / 8 / 0.9
    assert volume(shown) == pytest.approx(-4 / 3 * np.pi, rel=0.01)
    assert shown.points.dtype == np.float32
    assert shown.triangles.dtype == np.int32
    assert (shown.stride, shown.cut, shown.components, shown.words) == (1, False, 1, "")
    parts = topology(shown.triangles.astype(int))
    assert (parts.components, parts.boundary_loops, parts.genus) == (1, 0, 0)


def test_axes_do_not_change_places():
    """Oracle: analytic. Planes x = 1.25, y = 3 and z = 7.5 in a box of unlike sides."""
    grids = np.meshgrid(np.arange(5.0), np.arange(6.0), np.arange(7.0), indexing="ij")
    spacing, origin = np.array([0.5, 1.0, 2.0]), np.array([0.0, 1.0, 2.0])
    for axis, place in enumerate((1.25, 3.5, 7.5)):
        for order in "CF":
            values = np.array(grids[axis] * spacing[axis] + origin[axis], order=order)
            shown = preview(made(values, spacing, origin), place)
            points = shown.points + shown.offset
            np.testing.assert_allclose(points[:, axis], place, rtol=1e-6)
            others = np.delete(np.arange(3), axis)
            top = origin + spacing * [4, 5, 6]
            np.testing.assert_allclose(points.min(axis=0)[others], origin[others])
            np.testing.assert_allclose(points.max(axis=0)[others], top[others])
            assert shown.cut
            a, b, c = np.moveaxis(points[shown.triangles], 1, 0)
            assert (np.cross(b - a, c - a)[:, axis] < 0).all()  # towards smaller values


def test_far_away_it_looks_the_same():
    """Oracle: symmetry. A box moved by 1e9 of its sizes: the same points about its middle."""
    near, far = (preview(sphere(radius=1e-3, origin=place), 1e-3) for place in (0.0, 1e6))
    np.testing.assert_array_equal(near.points, far.points)
    assert far.offset == pytest.approx(1e6 + 1.5e-3, rel=1e-15)
    assert np.abs(np.linalg.norm(far.points, axis=1) / 1e-3 - 1).max() < 2e-3


def test_small_changes_upon_a_large_value_are_seen():
    """Oracle: symmetry. A constant of 1e9 added to field and isovalue changes the points by less
    than the rounding of the sum, 1e-7 over a step of 0.1."""
    low, high = sphere(), sphere()
    high = made(high.values + 1e9, high.spacing)
    one, other = preview(low, 1.0), preview(high, 1e9 + 1.0)
    np.testing.assert_allclose(one.points, other.points, atol=2e-6)


def test_every_second_sample_of_a_large_field():
    """Oracle: analytic. 129^3 samples are more than 128^3: the sphere is that of every second."""
    shown = preview(sphere(count=129), 1.0)
    assert shown.stride == 2
    assert "second" in shown.words
    radii = np.linalg.norm(shown.points, axis=1)
    assert np.abs(radii - 1).max() < (3 / 64) ** 2 / 8 / 0.9
    assert volume(shown) == pytest.approx(-4 / 3 * np.pi, rel=0.005)


@pytest.mark.parametrize("isovalue", [-1.0, 0.0, 3.0, np.nan, np.inf, -np.inf])
def test_isovalue_outside_the_range_gives_words(isovalue):
    """Oracle: algebra. Distances lie in [0, 1.5 sqrt 3]; at its ends there is no surface either."""
    shown = preview(sphere(), isovalue)
    assert (shown.points.shape, shown.triangles.shape) == ((0, 3), (0, 3))
    assert "the values go from 0 to 2.598" in shown.words
    assert shown.components == 0


def test_surface_between_the_samples_taken_gives_words():
    """Oracle: algebra. One sample that is not taken stands out: every second shows nothing."""
    values = np.zeros((129, 129, 129), np.float32)
    values[63, 63, 63] = 1
    shown = preview(made(values), 0.5)
    assert len(shown.triangles) == 0
    assert "every second sample" in shown.words


def test_components_and_the_box_are_told():
    """Oracle: analytic. Two balls; the isosurface x^2 = 1 cuts the box in two planes."""
    x, y, z = np.meshgrid(*[np.linspace(-2, 2, 33)] * 3, indexing="ij")
    two = np.minimum((x - 1) ** 2, (x + 1) ** 2) + y**2 + z**2
    balls, planes = preview(made(two), 0.5), preview(made(x**2), 1.1)
    assert (balls.components, balls.cut) == (2, False)
    assert (planes.components, planes.cut) == (2, True)


def test_values_that_are_not_finite_leave_a_gap():
    """Oracle: algebra. Finite points, fewer triangles, no unused points."""
    whole, holed = sphere(), sphere()
    holed.values[16:20, 16:20, 24:30] = np.nan
    holed.values[0, 0, 0] = np.inf
    shown = preview(holed, 1.0)
    assert 0 < len(shown.triangles) < len(preview(whole, 1.0).triangles)
    assert np.isfinite(shown.points).all()
    assert len(np.unique(shown.triangles)) == len(shown.points)
    nothing = preview(made(np.full((5, 5, 5), np.nan)), 1.0)
    assert len(nothing.triangles) == 0


def test_preview_of_the_field_that_is_compared():
    """Oracle: peer. The spline of ScalarField is at the isovalue near all points."""
    field = iv.read_field(water_pair()[0])
    shown = preview(field, 0.05)
    values = field.value(shown.points + shown.offset)
    assert np.abs(np.log(values / 0.05)).max() < 0.1
    assert shown.components == 1


def test_what_a_file_holds_is_told():
    """Oracle: peer. Name, shape, spacing, origin and range as read_field has them."""
    path = water_pair()[0]
    told, field = opened(path), iv.read_field(path)
    assert (told.name, told.arrays) == ("electron_density", ("electron_density",))
    np.testing.assert_array_equal(told.values, field.values)
    np.testing.assert_array_equal(told.spacing, field.spacing)
    np.testing.assert_array_equal(told.origin, field.origin)
    assert told.shape == field.values.shape
    assert told.range == (field.values.min(), field.values.max())
    assert told.counts.sum() == field.values.size
    assert (told.bad, told.notes) == (0, ())
    assert told.logarithmic  # over twelve decades
    edges = told.edges
    np.testing.assert_allclose(edges[1:] / edges[:-1], (edges[-1] / edges[0]) ** (1 / 64))
    low, high = told.isovalue * np.array([0.9, 1.1])
    assert field.values.min() < low < high < field.values.max()
    assert not preview(told, told.isovalue).cut


def save(path, values):
    np.savez(path, s=values, spacing=np.full(3, 0.1), origin=np.zeros(3))
    return path


def test_histogram_is_that_of_numpy(tmp_path):
    """Oracle: peer. NumPy's counts between equal steps, for even values; none is lost."""
    values = np.linspace(-1, 1, 1000).reshape(10, 10, 10)
    told = opened(save(tmp_path / "a.npz", values))
    counts, edges = np.histogram(values, 64)
    assert not told.logarithmic
    np.testing.assert_array_equal(told.counts, counts)
    np.testing.assert_allclose(told.edges, edges)


@pytest.mark.parametrize(("power", "logarithmic"), [(1, False), (6, True)])
def test_edges_follow_the_values(tmp_path, power, logarithmic):
    """Oracle: algebra. 1 to 2 evenly fills equal steps evenly; 10^1 to 10^6 evenly equal factors.

    The fuller the bins are alike the larger is the entropy; its maximum is log 64.
    """
    even = np.linspace(1, 2, 4096) if power == 1 else np.geomspace(1, 10.0**power, 4096)
    told = opened(save(tmp_path / "a.npz", even.reshape(16, 16, 16)))
    assert told.logarithmic == logarithmic
    shares = told.counts / told.counts.sum()
    assert -(shares * np.log(shares)).sum() == pytest.approx(np.log(64), abs=1e-3)


def test_suggestion_is_where_the_transition_is_sharpest(tmp_path):
    """Oracle: analytic. tanh((r - 1) / w) is steepest at r = 1, where it is 0, +5 after a shift.

    A bin is a 64th of the range of 2; the mean gradient differs little within two of them.
    """
    axes = np.meshgrid(*[np.linspace(-1.6, 1.6, 65)] * 3, indexing="ij")
    radius = np.sqrt(sum(axis**2 for axis in axes))
    told = opened(save(tmp_path / "a.npz", 5 + np.tanh((radius - 1) / 0.3)))
    assert told.isovalue == pytest.approx(5, abs=2 * 2 / 64)
    assert told.reason == "largest mean gradient of the isosurface, among those inside the box"


def test_mean_gradient_is_that_over_the_isosurface(tmp_path):
    """Oracle: analytic. x (2 + sign y) has gradient 1 on one half of each plane and 3 on the other:
    2 on average over the area; over the volume, which is less where it is steep, 1.5."""
    axes = np.meshgrid(*[np.linspace(-1, 1, 60)] * 3, indexing="ij")
    spacing = np.full(3, 2 / 59)
    told = opened(save(tmp_path / "a.npz", axes[0] * (2 + np.sign(axes[1]))))
    histogram = _Histogram(told.counts, told.edges, told.logarithmic)
    _, middles, _, gradient = _spectrum(told.values, spacing, 1, histogram)
    both = np.abs(middles) < 0.1  # where the step between the halves is low
    assert both.sum() == 2
    np.testing.assert_allclose(gradient[both], 2.0, rtol=0.1)


def test_suggestion_passes_over_a_speck(tmp_path):
    """Oracle: analytic. A bump of one cell's width and height 5 upon one of height 1: steeper, but
    its spheres of less than two cells have less than 50 cell faces."""
    axes = np.meshgrid(*[np.linspace(-1, 1, 65)] * 3, indexing="ij")
    squared = sum(axis**2 for axis in axes)
    told = opened(save(tmp_path / "a.npz", np.exp(-4 * squared) + 5 * np.exp(-1000 * squared)))
    assert told.isovalue < 1.0


def test_a_signed_distance_begins_at_0(tmp_path):
    """Oracle: analytic. r - 0.6 is negative inside and 0.4 or more on the box; its surface is at 0.
    So it is if the box cuts it and the name says what it is."""
    axes = np.meshgrid(*[np.linspace(-1, 1, 41)] * 3, indexing="ij")
    radius = np.sqrt(sum(axis**2 for axis in axes))
    told = opened(save(tmp_path / "a.npz", radius - 0.6))
    assert (told.isovalue, told.reason) == (0.0, "the surface of a signed distance")
    np.savez(tmp_path / "b.npz", signed_distance=radius - 1.1, spacing=np.ones(3))
    assert opened(tmp_path / "b.npz").isovalue == 0.0
    assert opened(save(tmp_path / "c.npz", radius - 1.1)).isovalue != 0.0  # cut, and no name


def test_noise_around_0_is_no_signed_distance(tmp_path):
    """Oracle: analytic. A bump of height 1 over 1e-6 on the border, with one value of -1e-6."""
    axes = np.meshgrid(*[np.linspace(-3, 3, 41)] * 3, indexing="ij")
    bump = np.exp(-sum(axis**2 for axis in axes)) + 1e-6
    bump[20, 20, 2] = -1e-6
    told = opened(save(tmp_path / "a.npz", bump))
    assert 0.1 < told.isovalue < 0.9


def test_suggestion_stays_inside_the_box_if_it_can(tmp_path):
    """Oracle: analytic. The gradient of r^2 grows outward; beyond r = 1 the spheres are cut."""
    axes = np.meshgrid(*[np.linspace(-1, 1, 65)] * 3, indexing="ij")
    told = opened(save(tmp_path / "a.npz", sum(axis**2 for axis in axes)))
    assert 0.9 < told.isovalue < 1.0 + 3 / 64
    plane = opened(save(tmp_path / "b.npz", axes[0] + axes[0] ** 3))
    assert plane.reason == "largest mean gradient of the isosurface"
    few = opened(save(tmp_path / "c.npz", axes[0][::16, ::16, ::16]))
    assert few.reason == "largest isosurface"


def test_files_with_several_arrays_name_them_all(tmp_path):
    """Oracle: data. Each name is one that read_field takes; the first is taken."""
    one = np.random.default_rng(1).random((5, 6, 7))
    np.savez(tmp_path / "a.npz", p=one, q=np.stack([one, 2 * one]), spacing=np.ones(3))
    np.save(tmp_path / "b.npy", np.stack([one, 2 * one, 3 * one]))
    image = pv.ImageData(dimensions=(5, 6, 7))
    image["first"], image["vectors"] = one.ravel(order="F"), np.zeros((210, 3))
    image["second"] = 2 * one.ravel(order="F")
    image.save(tmp_path / "c.vti")
    lines = ["t", "t", "-1 0 0 0", "5 1 0 0", "6 0 1 0", "7 0 0 1", "1 0 0 0 0", "2 8 9"]
    pairs = np.stack([one, 2 * one], axis=-1).ravel()
    text = "\n".join(lines + [repr(float(value)) for value in pairs]) + "\n"
    (tmp_path / "d.cube.gz").write_bytes(gzip.compress(text.encode()))
    expected = {
        "a.npz": ("p", "q[0]", "q[1]"),
        "b.npy": ("[0]", "[1]", "[2]"),
        "c.vti": ("first", "second"),
        "d.cube.gz": ("0", "1"),
    }
    for name, arrays in expected.items():
        told = opened(tmp_path / name)
        assert (told.arrays, told.array) == (arrays, arrays[0])
        np.testing.assert_allclose(told.values, one)
        last = opened(tmp_path / name, arrays[-1])
        np.testing.assert_allclose(last.values, (3 if name == "b.npy" else 2) * one)
    np.save(tmp_path / "e.npy", one)
    told = opened(tmp_path / "e.npy")
    assert (told.arrays, told.array) == ((), None)
    assert "[I07]" in told.notes[0]


def test_values_that_are_not_finite_are_counted(tmp_path):
    """Oracle: data. Three bad values; the histogram has the others."""
    values = np.random.default_rng(2).random((8, 8, 8))
    values[0, 0, :3] = np.nan, np.inf, -np.inf
    told = opened(save(tmp_path / "a.npz", values))
    assert told.bad == 3
    assert told.counts.sum() == 509
    assert "3 values" in told.notes[0]
    assert np.isfinite(told.isovalue)


def test_files_without_a_field_are_refused(tmp_path):
    """Oracle: data. The codes of the faults page."""
    (tmp_path / "a.txt").write_text("hello")
    np.save(tmp_path / "b.npy", np.zeros((4, 4, 4)))
    np.save(tmp_path / "c.npy", np.full((4, 4, 4), np.nan))
    np.save(tmp_path / "d.npy", 1 + np.spacing(1.0) * (np.arange(64.0).reshape(4, 4, 4) % 4))
    np.save(tmp_path / "e.npy", 1.7e308 * np.cos(np.pi * np.arange(64)).reshape(4, 4, 4))
    faults = {
        "d.npy": "I03",
        "e.npy": "I03",
        "a.txt": "F04",
        "b.npy": "I03",
        "c.npy": "I01",
        "none.npy": "F01",
    }
    for name, code in faults.items():
        with pytest.raises((FieldError, FileError)) as caught:
            opened(tmp_path / name)
        assert caught.value.code == code
    with pytest.raises(FileError, match="electron_density") as caught:
        opened(water_pair()[0], "pressure")
    assert caught.value.code == "F09"


def test_it_can_be_opened_by_a_job():
    """Oracle: data. The same values come back from another process."""
    import asyncio

    from isovary.app._jobs import start

    async def run():
        return await start(opened, water_pair()[0]).wait()

    last = asyncio.run(run())
    assert isinstance(last, Finished)
    np.testing.assert_array_equal(last.value.values, opened(water_pair()[0]).values)


@pytest.mark.parametrize("name", ["disturbed", "charge_distribution", "redistanced"])
def test_other_words_name_no_distance(tmp_path, name):
    """Oracle: definition. The same samples begin at the same isovalue, and not at 0."""
    axes = np.meshgrid(*3 * [np.linspace(-3, 3, 24)], indexing="ij")
    values = np.exp(-sum(axis**2 for axis in axes))
    values += 1e-4 * np.random.default_rng(0).standard_normal(values.shape)
    for each in (name, "density"):
        np.save(tmp_path / f"{each}.npy", values)
    found = [opened(tmp_path / f"{each}.npy").isovalue for each in (name, "density")]
    assert found[0] == found[1] != 0
