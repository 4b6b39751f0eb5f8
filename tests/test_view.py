from __future__ import annotations

import json
import re
import sys
from base64 import b64decode
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from matplotlib.collections import PolyCollection
from pictures import ball as _ball
from pictures import check_texts as _check_texts
from pictures import compare as _compare
from pictures import dented as _dented
from pictures import field as _field
from pictures import without_partners
from pictures import words as _words

import isovary as iv
from isovary.geometry import triangle_areas
from isovary.records import Clusters
from isovary.shapes import icosphere
from isovary.view import _opengl, _paint, overview, write_report
from isovary.view._camera import choose_camera, in_sight
from isovary.view._overview import prepare
from isovary.view._report_data import packed
from isovary.view._tessellate import (
    at_pieces,
    edge_lines,
    lattice,
    nearest_nodes,
    tessellate,
)
from isovary.view._words import percent, verdict


@pytest.fixture(scope="module")
def dented():
    return _compare(_field(_ball), _field(_dented))


@pytest.fixture(scope="module")
def identical():
    return _compare(_field(_ball), _field(_ball))


@pytest.fixture(scope="module")
def half_lost(dented):
    """The dented ball as if the nodes with x > 0.2 had found no partner."""
    notes = ("C02: some nodes found no partner.",)
    return replace(without_partners(dented, dented.base.points[:, 0] > 0.2), notes=notes)


@pytest.fixture
def no_opengl(monkeypatch):
    monkeypatch.setenv("ISOVARY_NO_OPENGL", "1")


def test_lattice_covers_the_triangle_once():
    """Oracle: algebra. split^2 pieces, all turning like the whole, each 1/split^2 of its area."""
    barycentric, triangles = lattice(5)
    a, b, c = (barycentric[triangles[:, k], 1:] for k in range(3))
    areas = ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2
    np.testing.assert_allclose(areas, 0.5 / 25, rtol=1e-12)


def test_pieces_lie_on_a_quadratic_patch():
    """Oracle: analytic. z = x^2 + x y - y^2 is a quadratic patch, so corners lie on it exactly."""
    corners = np.array([[0.0, 0], [1, 0], [0.2, 0.9]])
    flat = np.vstack(
        [corners, [(corners[i] + corners[j]) / 2 for i, j in ((0, 1), (1, 2), (2, 0))]]
    )

    def height(p):
        return p[..., 0] ** 2 + p[..., 0] * p[..., 1] - p[..., 1] ** 2

    patch = iv.Surface(np.column_stack([flat, height(flat)]), [[0, 1, 2, 3, 4, 5]])
    pieces = tessellate(patch, 7)
    np.testing.assert_allclose(pieces.points[:, 2], height(pieces.points), atol=1e-14)
    lines, _ = edge_lines(patch, 7)
    assert lines.shape == (3, 8, 3)
    np.testing.assert_allclose(lines[..., 2], height(lines), atol=1e-14)


def test_area_of_pieces_converges():
    """Oracle: order. Flat pieces of a curved surface lose area with the square of their size."""
    surface = icosphere(2)
    exact = triangle_areas(surface.points, surface.triangles).sum()
    errors = [exact - tessellate(surface, split).areas.sum() for split in (2, 4, 8)]
    slopes = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(slopes, 2.0, atol=0.1)


@pytest.mark.parametrize("order", [1, 2])
def test_values_at_pieces(order):
    """Oracle: algebra. A linear function of place is exact at the pieces; NaN takes the others."""
    surface = icosphere(1) if order == 2 else iv.Surface(icosphere(1).points, _flat(icosphere(1)))
    barycentric, small = lattice(3)
    values = surface.points @ [1.0, -2.0, 0.5]
    pieces = tessellate(surface, 60)
    there = at_pieces(surface, 60, values)
    size = 2.0 / 60  # a piece's own bulge is below its size squared
    np.testing.assert_allclose(there, pieces.middles @ [1.0, -2.0, 0.5], atol=size**2)
    holed = np.ones(len(values))
    holed[surface.triangles[0, 0]] = np.nan
    np.testing.assert_allclose(at_pieces(surface, 3, holed), 1.0)
    assert at_pieces(surface, 3, np.empty((len(values), 0))).shape == (
        9 * len(surface.triangles),
        0,
    )
    assert len(nearest_nodes(surface, 3)) == len(surface.triangles) * len(small)
    assert len(barycentric) == 10


def _flat(surface):
    from isovary.geometry import linear_triangles

    return linear_triangles(surface.triangles)


def test_camera_sees_the_mark():
    """Oracle: symmetry. On a sphere with its weight at one pole, the pole faces the viewer."""
    pieces = tessellate(icosphere(2), 2)
    pole = np.array([0.6, 0.0, 0.8])
    weight = np.exp(-(np.linalg.norm(pieces.middles - pole, axis=1) ** 2)) * pieces.areas
    camera = choose_camera(pieces.middles, pieces.facing, weight, (pole, pole))
    assert 0.45 <= camera.axes[2] @ pole <= 0.8
    np.testing.assert_allclose(camera.axes @ camera.axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(camera.axes) > 0
    assert in_sight(pole[None], pieces.middles, camera.axes[2])[0]
    assert not in_sight(-pole[None], pieces.middles, camera.axes[2])[0]
    left, right, bottom, top = camera.window(2.0)
    assert (right - left) / (top - bottom) == pytest.approx(2.0)


def test_grey_is_grey(half_lost):
    """Oracle: algebra. Insignificant nodes are neutral, unknown ones no-partner, in every mode."""
    quiet = half_lost.base.points[:, 1] > 0.5
    result = replace(
        half_lost,
        significant=half_lost.significant & ~quiet,
        clusters=Clusters(
            np.where(quiet, -1, half_lost.clusters.labels), half_lost.clusters.centers
        ),
    )
    samples, lost = _paint.node_samples(result), ~result.correspondence.found
    grey = ~result.significant & ~lost
    norm = _paint.paint_norm(samples, _paint.norm_limit(result))
    groups = _paint.paint_groups(samples)
    for colors in (norm, groups):
        assert (colors[grey] == _paint.NEUTRAL).all()
        assert not (colors[result.significant] == _paint.NEUTRAL).all(axis=1).any()
    for colors in (norm, groups, _paint.paint_displacement(samples, 0.1)):
        assert (colors[lost] == _paint.NO_PARTNER).all()
        assert not (colors[~lost] == _paint.NO_PARTNER).all(axis=1).any()
    assert grey.any()
    assert lost.any()


def test_every_node_keeps_its_group(dented):
    """Oracle: algebra. Groups by interpolated scores agree with labels, even arbitrary ones."""
    rng = np.random.default_rng(8361)
    for labels in (dented.clusters.labels, rng.integers(-1, 3, len(dented.base.points))):
        clusters = Clusters(labels, dented.clusters.centers)
        samples = _paint.node_samples(replace(dented, clusters=clusters))
        np.testing.assert_array_equal(samples.groups, labels)


def test_pieces_near_a_lost_node_are_unknown(half_lost):
    """Oracle: algebra. Pieces take known from their nearest node; the rest have numbers."""
    split = 4
    samples = _paint.piece_samples(half_lost, split)
    near = nearest_nodes(half_lost.base, split)
    np.testing.assert_array_equal(samples.known, half_lost.correspondence.found[near])
    assert np.isfinite(samples.norm[samples.known > 0]).all()
    assert (samples.groups[samples.known == 0] == -1).all()


@pytest.mark.parametrize("opengl", [True, False])
def test_figure_of_identical_fields_says_so(identical, opengl, monkeypatch):
    """Oracle: algebra. No change is a headline, not a stretched colour scale."""
    if not opengl:
        monkeypatch.setenv("ISOVARY_NO_OPENGL", "1")
    words = _words(overview(identical))
    assert "No change: the two isosurfaces are identical" in words
    assert "no displacement" in words
    assert "0 at every time" in words
    assert "% of its mean" not in words


def test_change_below_the_noise_is_not_drawn_as_change(dented, no_opengl):
    """Oracle: algebra. Nothing significant: grey surface, no colour bar, and the title says it."""
    count = len(dented.base.points)
    quiet = replace(
        dented,
        significant=np.zeros(count, dtype=bool),
        clusters=Clusters(np.full(count, -1), np.empty((0, len(dented.times)))),
        noise_floor=2 * np.abs(dented.change),
    )
    figure = overview(quiet)
    words = _words(figure)
    assert "No significant change" in words
    assert "% of its mean" not in words
    assert prepare(quiet).significant_share == 0


def test_texts_do_not_overlap(half_lost, no_opengl):
    """Oracle: algebra. All texts lie in the figure, apart from each other, with long notes too."""
    notes = ("A rather long remark about what may have gone wrong here. " * 4,) * 5
    choices = {**half_lost.choices, "field": "velocity_magnitude_of_the_second_phase_" * 3}
    figure = overview(replace(half_lost, notes=notes, choices=choices))
    _check_texts(figure)


def test_dollars_and_underscores_are_no_formulas(dented, no_opengl):
    """Oracle: algebra. A field's name stands in the figure as it is."""
    figure = overview(replace(dented, choices={**dented.choices, "field": "a$b_c$"}))
    assert r"a\$b_c\$ = 0" in _words(figure)


def test_fallback_draws_the_surface(half_lost, no_opengl):
    """Oracle: algebra. Without OpenGL three panels hold polygons, and the footer says why."""
    figure = overview(half_lost)
    painted = [axes for axes in figure.axes if axes.findobj(PolyCollection)]
    surfaces = [axes for axes in painted if not axes.axison]
    assert len(surfaces) == 3
    assert "ISOVARY_NO_OPENGL" in _words(figure)
    assert "no partner: unknown" in _words(figure)


def test_both_renderers_draw_the_same_picture(half_lost, monkeypatch):
    """Oracle: peer. VTK and matplotlib differ by anti-aliasing at edges, in few pixels."""
    if not iv_can_draw():
        pytest.skip("no OpenGL here")
    images = []
    for value in ("0", "1"):
        monkeypatch.setenv("ISOVARY_NO_OPENGL", value)
        figure = overview(half_lost)
        figure.set_dpi(160)
        from matplotlib.backends.backend_agg import FigureCanvasAgg

        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        image = np.asarray(canvas.buffer_rgba())[:, :, :3].astype(float)
        images.append(image[200:850, 40:780])  # the large panel
    far = np.abs(images[0] - images[1]).max(axis=2) > 60
    assert far.mean() < 0.03


def iv_can_draw():
    from isovary.view import can_draw

    return can_draw()


def test_other_surfaces_are_drawn(no_opengl):
    """Oracle: algebra. Order 1, two components, an open surface: figures without a fault."""
    centers = np.array([[-0.8, 0, 0], [0.8, 0, 0]])

    def two(radius):
        def field(p):
            away = np.linalg.norm(p[..., None, :] - centers, axis=-1)
            return np.max(np.array([0.5, radius]) - away, axis=-1)

        return field

    pair = _compare(_field(two(0.5)), _field(two(0.53)), order=1, vertices=300)
    assert "2 components" in _words(overview(pair))
    bowl = _compare(
        _field(lambda p: p[..., 2] - 0.3 * p[..., 0] ** 2),
        _field(lambda p: p[..., 2] - 0.33 * p[..., 0] ** 2),
        order=1,
        vertices=300,
    )
    assert "1 boundary loop" in _words(overview(bowl))


def test_percent_never_rounds_to_a_whole():
    """Oracle: algebra. 100 % means all, 0 % means none."""
    assert [percent(x) for x in (0, 0.00012, 0.5, 0.994, 0.9999, 1)] == [
        "0 %",
        "0.012 %",
        "50 %",
        "99.4 %",
        "> 99.9 %",
        "100 %",
    ]


def test_verdict_names_the_largest_change(dented):
    """Oracle: algebra. The headline's number is the largest significant norm."""
    most = percent(float(dented.change_norm[dented.significant].max()))
    assert f"up to {most} (mean over scales);" in verdict(dented, 0.5)


def test_probe_survives_a_crash():
    """Oracle: algebra. A child that dies by a signal gives a text with the packages that help."""
    crash = (sys.executable, "-c", "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)")
    problem = _opengl.probe(crash)
    assert "signal 11" in problem
    assert "libegl1 libgl1-mesa-dri" in problem
    assert "within 0.1 s" in _opengl.probe((sys.executable, "-c", "while 1: 0"), 0.1)
    assert "code 3" in _opengl.probe((sys.executable, "-c", "raise SystemExit(3)"))
    assert "started" in _opengl.probe(("/no/such/program",))
    assert _opengl.probe((sys.executable, "-c", "")) is None


def test_a_crashing_child_means_fallback(monkeypatch):
    """Oracle: algebra. can_draw is no, and no exception, when the test drawing crashes."""
    monkeypatch.delenv("ISOVARY_NO_OPENGL", raising=False)
    crash = (sys.executable, "-c", "import os, signal; os.kill(os.getpid(), signal.SIGABRT)")
    monkeypatch.setattr(_opengl, "_COMMAND", crash)
    assert not _opengl.can_draw()


class _Loads(HTMLParser):
    """Collects everything in a page that could load something, and its scripts."""

    def __init__(self):
        super().__init__()
        self.loads, self.tags, self.policy, self.texts = [], [], None, []
        self._in_script = False

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        names = dict(attrs)
        if names.get("http-equiv") == "Content-Security-Policy":
            self.policy = names["content"]
        for name in ("src", "href", "srcset", "poster", "data", "action"):
            if name in names:
                self.loads.append((tag, names[name]))
        if tag == "script":
            self._in_script = names.get("id") == "data"
            self.texts.append("")

    def handle_data(self, text):
        if self._in_script:
            self.texts[-1] += text

    def handle_endtag(self, tag):
        self._in_script = False


@pytest.fixture(scope="module")
def page(half_lost, tmp_path_factory):
    path = tmp_path_factory.mktemp("report") / "report.html"
    name = "<script>alert(1)</script>{{data}}"
    result = replace(
        half_lost,
        choices={**half_lost.choices, "field": name, "list": [1.5, 2]},
        notes=("A <b>note</b> & more",),
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ISOVARY_NO_OPENGL", "1")
        write_report(result, path)
    return result, path.read_text(encoding="utf-8")


def test_report_loads_nothing(page):
    """Oracle: algebra. Only data: images; the policy forbids the rest; a sensible size."""
    _, text = page
    parser = _Loads()
    parser.feed(text)
    assert [(tag, load[:22]) for tag, load in parser.loads] == [
        ("img", "data:image/png;base64,")
    ] * 3
    assert "default-src 'none'" in parser.policy
    assert "http" not in parser.policy
    assert "@import" not in text.split("<script>")[0]
    assert "url(" not in text.split("<script>")[0]
    assert len(text) < 8e6


def test_report_escapes_names(page):
    """Oracle: algebra. A field called <script> makes no element, a brace no substitution."""
    _, text = page
    parser = _Loads()
    parser.feed(text)
    assert parser.tags.count("script") == 3
    assert "b" not in parser.tags
    assert "&lt;script&gt;alert(1)&lt;/script&gt;{{data}}" in text
    assert "<script>alert" not in text


def test_report_data(page):
    """Oracle: algebra. Each mode has a colour for each node; bytes decode to the change."""
    result, text = page
    parser = _Loads()
    parser.feed(text)
    data = json.loads(next(t for t in parser.texts if t))
    count = len(result.base.points)
    assert all(len(b64decode(colors)) == 3 * count for colors in data["colors"].values())
    assert set(data["colors"]) | {"scale"} == set(re.findall(r'<div data-mode="(\w+)"', text))
    code = np.frombuffer(b64decode(data["scales"]["bytes"]), dtype=np.uint8)
    code = code.reshape(len(result.times), count).T.astype(float)
    assert len(data["scales"]["words"]) == len(result.times)
    lost, clear = np.isnan(result.change), np.abs(result.change) > 2 * result.noise_floor
    assert (code[lost] == 0).all()
    assert (code[~lost & ~clear] == 1).all()
    limit = np.abs(result.change[clear]).max()
    shown = (code[clear] - 128) / 126 * limit
    np.testing.assert_allclose(shown, result.change[clear], atol=0.51 * limit / 126)
    assert len(data["nodes"]["group"]) == count


def test_packed_values_unpack():
    """Oracle: algebra. To half a 65 534th of the column's range; unknown stays unknown."""
    values = np.random.default_rng(8).standard_normal((50, 3)) * [1e-6, 1.0, 1e9]
    values[7, 1], values[:, 2] = np.nan, 4.0
    parts = packed(values)
    codes = np.frombuffer(b64decode(parts["codes"]), dtype="<u2").reshape(50, 3)
    found = np.where(codes == 65_535, np.nan, parts["low"] + parts["step"] * codes.astype(float))
    span = np.ptp(np.nan_to_num(values), axis=0)
    assert (np.abs(found - values)[np.isfinite(values)] <= 0.51 * span.max() / 65_534).all()
    assert (np.abs(found[:, 0] - values[:, 0]) <= 0.51 * span[0] / 65_534).all()
    np.testing.assert_array_equal(found[:, 2], 4.0)
    np.testing.assert_array_equal(np.isnan(found), np.isnan(values))


def test_closed_surfaces_are_seen_from_outside():
    """Oracle: symmetry. A surface and the same with its normals inward, as a distance has them."""
    ball = iv.icosphere(1)
    swapped = ball.triangles[:, [0, 2, 1, 5, 4, 3]]
    inside_out = iv.Surface(ball.points, swapped, -ball.normals)
    for surface in (ball, inside_out):
        pieces = tessellate(surface, 3)
        for normals, places in ((pieces.facing, pieces.middles), (pieces.normals, pieces.points)):
            assert (normals * places).sum(axis=1).min() > 0.9
        a, b, c = pieces.points[pieces.triangles].transpose(1, 0, 2)
        assert (np.cross(b - a, c - a) * a).sum(axis=1).min() > 0
        points, normals = edge_lines(surface, 4)
        assert (points * normals).sum(axis=-1).min() > 0.9


def test_kinds_and_strain_in_their_colours(half_lost):
    """Oracle: algebra. Each kind has its own colour, unknown nodes the colour of no partner; the
    largest strain has the scale's last colour.
    """
    colors = _paint.paint_kinds(half_lost)
    for kind in iv.Kind:
        rows = colors[half_lost.kinds == kind]
        np.testing.assert_array_equal(rows, np.tile(_paint.KIND_COLORS[kind], (len(rows), 1)))
    assert len({tuple(color) for color in _paint.KIND_COLORS.values()}) == len(iv.Kind)
    lost = replace(half_lost, strain=np.where(half_lost.kinds < 0, np.nan, half_lost.strain))
    strain = _paint.paint_strain(lost)
    np.testing.assert_array_equal(strain[lost.kinds < 0][0], _paint.NO_PARTNER)
    top = np.nanargmax(lost.strain)
    np.testing.assert_allclose(strain[top], _paint.NORM_MAP(1.0)[:3])


def test_kinds_share_the_area(half_lost):
    """Oracle: analytic. The nodes with x > 0.2 of a unit ball are unknown: 0.4 of its area."""
    shares = half_lost.kind_shares
    assert sum(shares.values()) == pytest.approx(1)
    assert shares["unknown"] == pytest.approx(0.4, abs=0.03)
