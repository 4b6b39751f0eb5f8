"""The comparing part of the page in a real browser: files, isovalue, a run and its end."""

from __future__ import annotations

import io
import json

import numpy as np
import pytest
from browser import (
    browsing,
    check_manners,
    needs_browser,
    saturation,
    saved,
    settled,
    state,
    until,
    until_changed,
    until_picture,
    until_state,
    until_table,
    where,
)

from isovary.app._exploring_widgets import legend
from isovary.app._groupings import group_rows, groupings
from isovary.app._saved_result import read_result

pytestmark = needs_browser

LONG = "6000"  # vertices of a run that takes longer than any test waits
PLAIN = "<script>window.hit = 1<script><img src=x onerror='window.hit=1'>.npy"


@pytest.fixture(scope="module")
def world(tmp_path_factory):
    with browsing(tmp_path_factory.mktemp("compare")) as world:
        yield world


@pytest.fixture(scope="module")
def page(world):
    return world.tab(world.context(), ready="#demo")


def npy(values):
    stream = io.BytesIO()
    np.save(stream, values)
    return stream.getvalue()


def upload(page, role, name, data):
    file = {"name": name, "mimeType": "application/octet-stream", "buffer": data}
    page.set_input_files(f"input#upload_{role}", file)


def begin_long(page):
    """Start a run, and wait until it says what it does."""
    page.fill("#wanted_vertices", LONG)
    page.click("#run")
    page.wait_for_selector("#progress [role=status]:text-matches('[a-z]')")
    until(
        page,
        "() => !['', 'starting', 'waiting', 'stopping'].includes(window.trame.state.get('stage'))",
    )


def test_it_begins_with_the_choice_of_fields(page):
    """Oracle: theory. Without a result nothing can be run or explored yet."""
    until_state(page, part="compare")
    assert page.locator("#run").is_disabled()
    page.get_by_role("tab", name="Explore").click()
    page.wait_for_selector("text=No result is open")
    page.get_by_role("tab", name="Compare").click()
    page.wait_for_selector("#demo:visible")


def test_a_broken_file_is_told_plainly(page):
    """Oracle: theory. What was expected and what to do, by the file's own name; no trace."""
    upload(page, "base", "broken.npy", npy(np.zeros((4, 4, 4)))[:90])
    said = page.wait_for_selector("#run_problem").inner_text()
    assert "broken.npy" in said
    assert "expected" in said
    assert "got" in said
    everything = page.inner_text("body")
    for trace in ("Traceback", ".py", "/tmp", "Error("):
        assert trace not in everything.replace(".npy", "")
    assert page.locator("#run").is_disabled()


def test_a_files_name_is_text(page):
    """Oracle: theory. A name with tags stands there letter by letter, and nothing runs."""
    upload(page, "base", PLAIN, npy(np.random.default_rng(1).random((8, 8, 8))))
    until(page, "() => window.trame.state.get('base_facts').includes('8 x 8 x 8')")
    assert "<script>" in page.inner_text("#base_facts")
    assert page.evaluate("window.hit") is None
    assert page.locator("#base_facts script, #base_facts img").count() == 0


def test_the_isovalue_is_previewed(page):
    """Oracle: theory. A higher isovalue of the density encloses less."""
    page.click("#demo")
    until(page, "() => window.trame.state.get('perturbed_facts').includes('samples')")
    until_state(page, isovalue="0.05")
    for role in ("base", "perturbed"):
        until_picture(page, role, lambda now: 0.02 < (saturation(now) > 30).mean() < 0.9)
    low = settled(page, "perturbed")
    page.fill("#isovalue", "0.3")
    high = until_changed(page, "perturbed", low)
    assert (saturation(high) > 30).sum() < 0.9 * (saturation(low) > 30).sum()
    words = page.inner_text("#preview_words")
    assert "Base: one piece, closed" in words
    slide = state(page, "slide")
    page.get_by_role("slider", name="Isovalue").press("PageDown")
    until(page, "slide => window.trame.state.get('slide') < slide", slide)
    until(page, "() => parseFloat(window.trame.state.get('isovalue')) < 0.3")
    page.fill("#isovalue", "0.05")
    size = (saturation(high) > 30).sum()
    until_picture(page, "perturbed", lambda now: (saturation(now) > 30).sum() > 1.1 * size)


def test_a_run_is_cancelled_at_once(world, page):
    """Oracle: data. It ends with a word, long before it would have; the page went on meanwhile."""
    begin_long(page)
    assert page.locator("#run").is_disabled()
    other = world.tab(world.context(), ready="#demo")
    assert state(other, "running", "base_name", "stage") == [False, "", ""]  # another session
    other.close()
    page.get_by_role("tab", name="Dimple").click()  # the page goes on while it runs
    page.wait_for_selector("#deform:visible")
    page.get_by_role("tab", name="Compare").click()
    page.wait_for_selector("#cancel:visible")
    page.click("#cancel")
    page.wait_for_selector("#run_words:text-is('cancelled')")
    assert page.locator("#progress").count() == 0


def test_reloading_finds_the_run_again(page):
    """Oracle: data. The same run goes on, in the same session; then it is cancelled."""
    begin_long(page)
    address = where(page)
    page.reload()
    page.wait_for_selector("#progress:visible")
    assert where(page) == address
    assert state(page, "running") is True
    assert state(page, "isovalue", "wanted_vertices") == ["0.05", LONG]
    page.click("#cancel")
    page.wait_for_selector("#run_words:text-is('cancelled')")


def test_a_run_ends_with_its_result(page, tmp_path):
    """Oracle: data. What is shown is what the files say, and they were made as was asked."""
    page.fill("#wanted_vertices", "300")
    page.locator(".v-select:has(label:text-is('Elements'))").click()
    page.locator(".v-list-item:has-text('flat')").click()
    until_state(page, wanted_order=1, wanted_vertices="300")
    page.click("#run")
    said = page.wait_for_selector("#run_problem:has-text('vertices')").inner_text()
    assert "expected at least" in said  # too few for its eigenpairs
    page.fill("#wanted_vertices", "520")
    page.click("#run")
    page.wait_for_selector("text=Above the noise", timeout=120_000)
    until_state(page, part="explore", running=False)
    names = page.locator("a[download]:visible").all_inner_texts()
    assert {"change.vtu", "perturbed.vtu", "summary.json", "report.html"} <= set(names)
    for name in ("change.vtu", "perturbed.vtu", "summary.json"):
        link = page.locator(f"a[download='{name}']:visible")
        saved(page, link.click, tmp_path / name)
    result = read_result(tmp_path)
    assert result.base.order == 1
    assert 0.7 * 520 < len(result.base.points) < 1.5 * 520
    assert result.summary["isovalue"] == 0.05
    assert f"{len(result.base.points)} nodes, order 1" in page.inner_text(".v-navigation-drawer")
    until_state(page, count_words="")
    (clusters,) = dict(groupings(result, (state(page, "count"),))).values()
    rows = [
        [str(row["number"]), row["area"], row["change"], row["radius"]]
        for row in legend(group_rows(result, clusters))
    ]
    until_table(page, "#legend", rows)
    for view in ("base", "change"):
        until_picture(page, view, lambda now: (saturation(now) > 30).mean() > 0.02)


def test_more_choices_are_checked_before_the_run(page):
    """Oracle: theory. What the command would refuse is told beside its field; nothing runs."""
    page.get_by_role("tab", name="Compare").click()
    page.click("#more_choices summary")
    for name, text in (("smooth", "-1"), ("smooth", "wide"), ("eigenpairs", "9.5")):
        page.fill(f"#wanted_{name}", text)
        page.wait_for_selector(f".v-messages:has-text('{name}: expected'):has-text('got {text}')")
        page.click("#run")
        page.wait_for_selector(f"#run_problem:has-text('{name}: expected')")
        assert state(page, "running") is False
        page.fill(f"#wanted_{name}", "")
        page.wait_for_selector(f".v-messages:has-text('{name}: expected')", state="detached")


def test_more_choices_reach_the_run(page, tmp_path):
    """Oracle: data. The summary tells the options as they were asked for."""
    page.fill("#wanted_smooth", "0.2")
    page.fill("#wanted_eigenpairs", "40")
    page.fill("#wanted_vertices", "150")
    page.locator(".v-select:has(label:text-is('Cluster'))").click()
    page.locator(".v-list-item:has-text('k-medoids')").click()
    page.get_by_label("Align").uncheck()
    until_state(page, wanted_cluster="k-medoids", wanted_align=False)
    page.click("#run")
    page.wait_for_selector("#progress")
    until_state(page, part="explore", running=False)
    link = page.locator("a[download='summary.json']:visible")
    choices = json.loads(saved(page, link.click, tmp_path / "summary.json"))["choices"]
    for option in ("--smooth 0.2", "--eigenpairs 40", "--cluster k-medoids", "--no-align"):
        assert option in choices["command"], choices["command"]


def test_nobody_else_is_asked(world):
    """Oracle: theory. No other host, no complaint, a policy that names the page alone."""
    check_manners(world)
