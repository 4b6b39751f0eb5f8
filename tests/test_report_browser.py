"""The report in a real browser: turned, clicked, read. Its picture is left in build/."""

from __future__ import annotations

import shutil
from base64 import b64decode
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_hex

import isovary as iv
from isovary.color import group_colors
from isovary.data import water_pair
from isovary.geometry import linear_triangles, triangle_areas
from isovary.view import write_report
from isovary.view._borders import group_pieces, node_labels
from isovary.view._paint import NEUTRAL, node_samples
from isovary.view._report_data import mode_colors, other_surface

BROWSER = shutil.which("chromium") or shutil.which("chromium-browser")
SWITCHES = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-gl=swiftshader",
    "--enable-unsafe-swiftshader",
]
PICTURE = Path(__file__).parents[1] / "build" / "report.png"

pytestmark = pytest.mark.skipif(BROWSER is None, reason="needs Chromium (apt install chromium)")


@pytest.fixture(scope="module")
def result():
    base, perturbed = (iv.read_field(path) for path in water_pair())
    return iv.compare(base, perturbed, 0.05, vertices=250, pairs=60, times=40)


@pytest.fixture(scope="module")
def rays():
    base, perturbed = (iv.read_field(path) for path in water_pair())
    options = {"vertices": 150, "pairs": 50, "times": 8, "correspondence": iv.normal_rays}
    return iv.compare(base, perturbed, 0.05, **options)


@pytest.fixture(scope="module")
def browser():
    sync_playwright = pytest.importorskip("playwright.sync_api").sync_playwright
    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=BROWSER, args=SWITCHES)
        yield browser
        browser.close()


def opened(browser, result, path):
    """The opened report, what it wrote to the console, and what it asked the network for."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ISOVARY_NO_OPENGL", "1")
        write_report(result, path)
    page = browser.new_page(viewport={"width": 1200, "height": 900})
    page.complaints, page.requests = [], []
    page.on("console", lambda said: page.complaints.append((said.type, said.text)))
    page.on("pageerror", lambda error: page.complaints.append(("error", str(error))))
    page.on("request", lambda request: page.requests.append(request.url))
    page.goto(path.as_uri())
    page.wait_for_selector("#surface canvas")
    page.wait_for_selector("#curves .main-svg")
    return page


@pytest.fixture(scope="module")
def page(browser, result, tmp_path_factory):
    return opened(browser, result, tmp_path_factory.mktemp("report") / "report.html")


def marked(page):
    """Names and values of the last three curves."""
    traces = page.evaluate(
        "document.getElementById('curves').data.slice(-3).map(t => [t.name, Array.from(t.x), "
        "Array.from(t.y)])"
    )
    return [name for name, _, _ in traces], [np.array(part) for part in traces[2][1:]]


def trace(name):
    return f"document.getElementById('surface').data.find(trace => trace.name === '{name}')"


def faces(page):
    return page.evaluate(f"Array.from({trace('groups')}.facecolor)")


def shot(page):
    return page.locator("#surface").screenshot()


def test_a_clicked_point_shows_its_curves(page, result):
    """Oracle: algebra. The curve's values are the comparison's at the node that was clicked."""
    box = page.locator("#surface").bounding_box()
    middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(*middle)
    page.wait_for_selector("#surface .hovertext")
    page.mouse.down()
    page.wait_for_timeout(300)  # a finger is slower than a drawn frame
    page.mouse.up()
    page.wait_for_selector("#where:has-text('At node')")
    names, (columns, change) = marked(page)
    node = int(page.input_value("#node"))
    assert names[2] == f"node {node}: base − perturbed"
    expected = 100 * result.change[node]
    step = np.ptp(100 * result.change) / 65_534
    at = np.searchsorted(result.times, columns * (1 - 1e-4))
    np.testing.assert_allclose(columns, result.times[at], rtol=1e-5)
    np.testing.assert_allclose(change, expected[at], atol=step)
    assert f"group {result.clusters.labels[node]}" in page.inner_text("#chosen")


def test_a_node_is_found_by_its_number(page, result):
    """Oracle: algebra. Typed: the text tells its change, to three digits."""
    page.fill("#node", "7")
    page.press("#node", "Enter")
    page.wait_for_selector("#where:text-is('At node 7')")
    said = page.inner_text("#chosen")
    assert f"mean change {100 * result.change_norm[7]:.3g} %" in said
    ring = page.evaluate(
        "['x', 'y', 'z'].map(k => Array.from(document.getElementById('surface').data[1][k]))"
    )
    size = np.ptp(result.base.points, axis=0).max()
    away = np.linalg.norm(np.transpose(ring) - result.base.points[7], axis=1)
    np.testing.assert_allclose(away, size * np.hypot(0.03, 0.006), rtol=1e-3)
    page.fill("#node", "100000")  # none such: nothing happens
    page.press("#node", "Enter")
    assert page.inner_text("#where") == "At node 7"
    assert page.input_value("#node") == "7"


def test_it_turns_and_shows_the_other_side(page):
    """Oracle: symmetry. The opposite side's eye is the negative; dragging moves it."""
    eye = "document.getElementById('surface')._fullLayout.scene._scene.getCamera().eye"
    page.click("#front")
    first = page.evaluate(eye)
    page.click("#back")
    page.wait_for_timeout(300)
    assert page.evaluate(eye) == pytest.approx({k: -v for k, v in first.items()}, rel=1e-6)
    box = page.locator("#surface").bounding_box()
    page.mouse.move(box["x"] + 300, box["y"] + 200)
    page.mouse.down()
    page.mouse.move(box["x"] + 420, box["y"] + 260, steps=5)
    page.mouse.up()
    turned = page.evaluate(eye)
    assert np.hypot.reduce([turned[k] + first[k] for k in "xyz"]) > 0.1
    page.click("#front")


def test_modes_groups_and_wireframe_change_the_picture(page, result):
    """Oracle: data. Each mode paints otherwise; a group switched off turns grey; edges appear."""
    pictures = {}
    for mode in page.locator(".modes button").all():
        mode.click()
        page.wait_for_timeout(200)
        pictures[mode.inner_text()] = shot(page)
    assert len(set(pictures.values())) == len(pictures)
    page.click("[data-mode=groups] >> nth=0")
    page.wait_for_timeout(200)
    before, colors = shot(page), faces(page)
    page.click(".group[data-group='0']")
    page.wait_for_timeout(200)
    first, grey = (
        to_hex(color) for color in (group_colors(len(result.clusters.centers))[0], NEUTRAL)
    )
    assert faces(page) == [grey if color == first else color for color in colors]
    assert first in colors
    assert shot(page) != before
    page.click(".group[data-group='0']")
    page.check("#wireframe")
    page.wait_for_timeout(200)
    assert shot(page) != before
    x, y, z = page.evaluate(f"['x', 'y', 'z'].map(k => Array.from({trace('wireframe')}[k]))")
    lines = np.array([x, y, z], dtype=float).T.reshape(-1, 4, 3)
    surface = result.perturbed
    assert len(lines) == 3 * len(np.unique(surface.corners)) - 6  # each edge of a sphere once
    assert np.isnan(lines[:, 3]).all()
    middle = (lines[:, 0] + lines[:, 2]) / 2
    length = np.linalg.norm(lines[:, 2] - lines[:, 0], axis=1)
    assert (np.linalg.norm(lines[:, 1] - middle, axis=1) < 0.2 * length).all()
    page.uncheck("#wireframe")


def test_groups_are_drawn_with_their_borders(page, result):
    """Oracle: algebra. Each group's area on the page is that of the triangles cut in Python."""
    page.click("[data-mode=groups] >> nth=0")
    page.wait_for_timeout(200)
    parts = page.evaluate(
        f"['x', 'y', 'z', 'i', 'j', 'k'].map(k => Array.from({trace('groups')}[k]))"
    )
    points = np.transpose(parts[:3])
    triangles = np.transpose(parts[3:]).astype(int)
    found = triangle_areas(points, triangles)
    made = node_samples(result)
    pieces, labels = group_pieces(result.base, made), node_labels(made)
    whole = linear_triangles(result.base.triangles)
    whole = whole[(labels[whole] == labels[whole[:, :1]]).all(axis=1)]
    places = np.vstack([result.base.points, pieces.points(result.base.points)])
    areas = triangle_areas(places, np.vstack([whole, pieces.triangles]))
    owners = np.concatenate([labels[whole[:, 0]], pieces.labels])
    assert len(pieces.triangles) > 100
    colors = np.array(faces(page))
    for group, color in enumerate(group_colors(len(result.clusters.centers))):
        area = found[colors == to_hex(color)].sum()
        assert area == pytest.approx(areas[owners == group].sum(), rel=1e-5)


def test_both_surfaces_are_seen_from_one_side(page, result):
    """Oracle: data. The perturbed surface beside the base, at its places, with one camera."""
    page.check("#beside")
    page.wait_for_selector("#second canvas")
    page.wait_for_timeout(300)
    places = page.evaluate(
        "['x', 'y', 'z'].map(k => Array.from(document.getElementById('second').data[0][k]))"
    )
    np.testing.assert_allclose(np.transpose(places), result.perturbed.points, atol=1e-6)
    eyes = "['surface', 'second'].map(k => document.getElementById(k).layout.scene.camera.eye)"
    for scene in ("#surface", "#second"):
        before = page.evaluate(eyes)[0]
        page.locator(scene).scroll_into_view_if_needed()
        box = page.locator(scene).bounding_box()
        page.mouse.move(box["x"] + 200, box["y"] + 200)
        page.mouse.down()
        page.mouse.move(box["x"] + 290, box["y"] + 230, steps=5)
        page.mouse.up()
        page.wait_for_timeout(300)
        first, second = page.evaluate(eyes)
        assert first == second
        assert np.hypot.reduce([first[k] - before[k] for k in "xyz"]) > 0.1
    page.uncheck("#beside")
    page.click("#front")


def test_it_says_the_answer_and_asks_for_nothing(page, result):
    """Oracle: data. No request but the file, no complaint; the answer names the place."""
    text = page.inner_text("#answer")
    most = result.base.points[np.nanargmax(result.change_norm)]
    near = [float(x) for x in text.split("near (")[1].split(")")[0].split(", ")]
    np.testing.assert_allclose(near, most, atol=0.01)
    assert "signal over noise" in text
    assert page.locator("table.groups tbody tr").count() == len(result.group_table)
    PICTURE.parent.mkdir(exist_ok=True)
    page.screenshot(path=PICTURE, full_page=True)
    assert [url for url in page.requests if not url.startswith(("file:", "data:", "blob:"))] == []
    assert [said for kind, said in page.complaints if kind == "error"] == []


@pytest.mark.parametrize("first", ["change", "groups"])
def test_a_mesh_of_its_own_stands_beside_in_its_colours(browser, rays, tmp_path, first):
    """Oracle: data. Each node has the colour of the nearest partner's base node, in every mode,
    whatever was shown when the second scene was opened; the base's transparency stays its own.
    """
    nodes = np.array(other_surface(rays)["nodes"])
    page = opened(browser, rays, tmp_path / "report.html")
    page.click(f"[data-mode={first}] >> nth=0")
    page.check("#clear")
    page.check("#beside")
    page.wait_for_selector("#second canvas")
    page.wait_for_timeout(500)
    for mode in (first, "displacement", "groups", "change"):
        page.click(f"[data-mode={mode}] >> nth=0")
        page.wait_for_timeout(300)
        shown = page.evaluate(
            "(({visible, vertexcolor, opacity}) => [visible, Array.from(vertexcolor), opacity])"
            "(document.getElementById('second').data[0])"
        )
        rgb = np.frombuffer(b64decode(mode_colors(rays)[mode]), np.uint8).reshape(-1, 3)
        assert shown[0] is True
        assert shown[1] == [f"rgb({r},{g},{b})" for r, g, b in rgb[nodes]]
        assert shown[2] in (None, 1)
    page.fill("#node", str(nodes[4]))
    page.press("#node", "Enter")
    page.wait_for_timeout(300)
    ring = page.evaluate(
        "['x', 'y', 'z'].map(k => Array.from(document.getElementById('second').data[1][k]))"
    )
    first_of = int(np.flatnonzero(nodes == nodes[4])[0])
    middle = np.mean(np.transpose(ring)[:-1], axis=0)
    size = np.ptp(rays.base.points, axis=0).max()
    assert np.linalg.norm(middle - rays.perturbed.points[first_of]) < 0.01 * size
    assert [said for kind, said in page.complaints if kind == "error"] == []
