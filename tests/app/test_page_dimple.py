"""The dimpling part of the page in a real browser: pick, push, take back, save."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from browser import (
    browsing,
    check_manners,
    click_at,
    difference,
    needs_browser,
    saturation,
    saved,
    settled,
    slider,
    state,
    until,
    until_changed,
    until_picture,
    until_state,
)

import isovary as iv

pytestmark = needs_browser


@pytest.fixture(scope="module")
def world(tmp_path_factory):
    with browsing(tmp_path_factory.mktemp("dimple")) as world:
        yield world


@pytest.fixture(scope="module")
def page(world, small):
    page = world.tab(world.context(), ready="[role=tab]")
    page.get_by_role("tab", name="Dimple").click()
    page.wait_for_selector("#deform:visible")
    until_picture(page, "perturbed", lambda now: now.std() > 5)
    send(page, "small.obj", small.read_bytes())
    page.wait_for_selector("text=small.obj")
    until_state(page, shape_name="small.obj", pushes=0)
    until_picture(page, "perturbed", lambda now: now.std() > 5)
    return page


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """A small sphere in a file."""
    sphere, path = iv.icosphere(3, order=1), tmp_path_factory.mktemp("surface") / "small.obj"
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in sphere.points.tolist()]
    lines += [f"f {i} {j} {k}" for i, j, k in (sphere.triangles + 1).tolist()]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def sphere(small):
    return iv.read_surface(small)


def send(page, name, data):
    """Upload a surface."""
    file = {"name": name, "mimeType": "application/octet-stream", "buffer": data}
    page.set_input_files("input[type=file] >> nth=-1", file)


def pushed(page, sphere):
    """The sphere as the library itself dents it, with the page's numbers."""
    center, radius, charge, alpha, decay, steps = state(
        page, "center", "radius", "charge", "alpha", "decay", "steps"
    )
    return iv.dimple(
        sphere, center, radius, charge=charge, alpha=alpha, decay=decay, steps=int(steps)
    )


def test_the_disc_shows_the_radius(page, sphere):
    """Oracle: geometry. A line around the clicked node; with the radius it grows."""
    bare = settled(page, "perturbed")
    assert page.locator("#deform").is_disabled()
    click_at(page, "perturbed")
    until(page, "() => window.trame.state.get('center') !== null")
    center = np.array(state(page, "center"))
    assert np.abs(sphere.points - center).max(axis=1).min() < 1e-12
    first = until_changed(page, "perturbed", bare, least=0.0003)
    slider(page, "Radius").press("End")
    until(page, "() => window.trame.state.get('radius') === window.trame.state.get('radius_most')")
    for _ in range(30):
        slider(page, "Radius").press("ArrowLeft")
    until_state(page, radius=0.7)
    second = until_changed(page, "perturbed", first, least=0.0003)
    reach = [extent((one - bare).__abs__().max(axis=2) > 60) for one in (first, second)]
    assert reach[1] == pytest.approx(1.4 * reach[0], rel=0.15)  # 0.7 / 0.5
    assert page.inner_text("#radius_words") == "0.7"


def extent(mask):
    """How wide the marked pixels lie apart."""
    columns = np.flatnonzero(mask.any(axis=0))
    return columns[-1] - columns[0]


def test_a_dimple_is_pushed_taken_back_and_pushed_again(page, sphere):
    """Oracle: theory. As many nodes move, and as far, as the library's own dimple moves."""
    flat = settled(page, "change")
    page.click("#deform")
    until_state(page, pushes=1)
    moved = np.linalg.norm(pushed(page, sphere).points - sphere.points, axis=1)
    words = f"{(moved > 0).sum()} of {len(moved)} nodes moved, at most by {moved.max():.3g}"
    page.wait_for_selector(f"#moved_words:text-is('{words}')")
    dented = until_changed(page, "change", flat)
    assert (saturation(dented) > 60).mean() > 0.001
    page.click("#undo")
    page.wait_for_selector("#moved_words:has-text('0 of')")
    until_picture(page, "change", lambda now: difference(now, flat) < 0.001)
    assert page.locator("#undo").is_disabled()
    page.click("#redo")
    page.wait_for_selector(f"#moved_words:text-is('{words}')")
    until_picture(page, "change", lambda now: difference(now, dented) < 0.001)
    assert page.locator("#redo").is_disabled()


def test_what_is_saved_is_made_again_by_its_command(page, small, sphere, tmp_path, monkeypatch):
    """Oracle: data. The file, the command and the script give the library's own points."""
    page.click("#save_dimple")
    names = ("dimpled.vtu", "dimple.sh", "dimple.py")
    for name in names:
        link = page.locator(f"a[download='{name}']:visible")
        saved(page, link.click, tmp_path / name)
    expected = pushed(page, sphere)
    made = iv.read_surface(tmp_path / "dimpled.vtu")
    np.testing.assert_array_equal(made.points, expected.points)
    np.testing.assert_array_equal(made.triangles, expected.triangles)
    assert (
        page.inner_text("#dimple_command").strip() == (tmp_path / "dimple.sh").read_text().strip()
    )
    shutil.copy(small, tmp_path)  # the surface that was uploaded, by its name
    monkeypatch.chdir(tmp_path)
    beside = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    ran = subprocess.run(
        [shutil.which("sh"), "dimple.sh"],
        env=os.environ | {"PATH": beside},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert ran.returncode == 0, ran.stderr
    again = iv.read_surface(tmp_path / "dimpled" / "mesh.vtu")
    np.testing.assert_array_equal(again.points, expected.points)
    names_of = {}
    exec((tmp_path / "dimple.py").read_text(), names_of)
    np.testing.assert_array_equal(names_of["surface"].points, expected.points)


def test_it_is_compared_with_the_start(page):
    """Oracle: theory. The signatures change most where the dimple is, none on the far side."""
    before = settled(page, "change")
    page.click("#compare_dimple")
    page.wait_for_selector("#view_change:has-text('Change of the HKS')", timeout=60_000)
    until_changed(page, "change", before, least=0.02)
    assert page.locator("#dimple_problem").count() == 0
    key = state(page, "keys")["change"]
    assert float(key["low"]) == 0
    assert float(key["high"]) > 0.1


def test_what_cannot_be_done_is_told(page):
    """Oracle: theory. An upload that is no surface is refused in plain words."""
    send(page, "no.vtp", b"<VTKFile>")
    said = page.wait_for_selector("#dimple_problem").inner_text()
    assert ".vtp" in said
    assert "expected" in said
    assert "got" in said
    assert "Traceback" not in page.inner_text("body")


def test_a_surface_that_is_too_coarse_is_noticed(page):
    """Oracle: data. A tetrahedron: a notice, no error, and nothing is pushed into it."""
    corners = "v 1 1 1\nv 1 -1 -1\nv -1 1 -1\nv -1 -1 1\n"
    send(page, "four.obj", (corners + "f 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n").encode())
    page.wait_for_selector("text=it has 4 nodes, and 100 are the least")
    until_picture(page, "perturbed", lambda now: now.std() > 5)
    click_at(page, "perturbed")
    until(page, "() => window.trame.state.get('center') !== null")
    page.click("#deform")
    page.wait_for_selector("text=it has 4 nodes, and 100 are the least")
    assert state(page, "pushes", "dimple_problem") == [0, ""]


def test_what_is_doubtful_goes_and_comes_with_the_dimple(page):
    """Oracle: theory. A dimple as wide as the ball moves all of it, which is told (M11)."""
    send(page, "ball.obj", ball())
    until_state(page, shape_name="ball.obj", pushes=0)
    until_picture(page, "perturbed", lambda now: now.std() > 5)
    click_at(page, "perturbed")
    until(page, "() => window.trame.state.get('center') !== null")
    page.evaluate("window.trame.state.set('radius', 2.5)")
    until_state(page, radius=2.5)
    page.click("#deform")
    page.wait_for_selector(".v-alert:has-text('M11')")
    page.click("#undo")
    page.wait_for_selector(".v-alert:has-text('M11')", state="detached")
    page.click("#redo")
    page.wait_for_selector(".v-alert:has-text('M11')")


def ball():
    """A sphere of 162 nodes as an OBJ file."""
    sphere = iv.icosphere(2, order=1)
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in sphere.points.tolist()]
    lines += [f"f {i} {j} {k}" for i, j, k in (sphere.triangles + 1).tolist()]
    return "\n".join([*lines, ""]).encode()


def test_nobody_else_is_asked(world):
    """Oracle: theory. No other host, no complaint, a policy that names the page alone."""
    check_manners(world)
