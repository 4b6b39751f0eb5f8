"""The exploring part of the page in a real browser: every slider, click and link of it."""

from __future__ import annotations

import io
import re
from urllib.parse import urlsplit

import numpy as np
import pytest
from browser import (
    VIEWS,
    World,
    browsing,
    cameras,
    check_manners,
    click_at,
    difference,
    drag,
    needs_browser,
    saturation,
    saved,
    serving,
    settled,
    slider,
    state,
    table,
    until,
    until_changed,
    until_picture,
    until_state,
    until_table,
    view_box,
    where,
)
from saved_folder import folder_of, noisy

from isovary.app._charts import curve_values
from isovary.app._exploring_widgets import legend
from isovary.app._groupings import group_rows, groupings
from isovary.app._saved_result import read_result
from isovary.signature import diffusion_radius

pytestmark = needs_browser

SCALE, NOISE, COUNT = "Scale", "Threshold", "Number of groups"
RESULT = "text=Above the noise"

_SIDEWAYS = """() => {
  const hidden = getComputedStyle(document.documentElement).overflowX === "hidden";
  const beyond = [...document.querySelectorAll(".v-application *")].filter((e) =>
    e.checkVisibility() && e.getBoundingClientRect().right > window.innerWidth + 1);
  return hidden ? beyond.map((e) => e.outerHTML.slice(0, 80)) : ["it scrolls"];
}"""  # what lies beyond the right edge

_WATCH = """
window.bare = []; window.told = new Set();
const look = () => {
  for (const view of document.querySelectorAll(".iso-view")) {
    const words = view.querySelector(".iso-wait");
    const seen = words && words.checkVisibility() && words.innerText.trim();
    if (seen) window.told.add(words.innerText.trim());
    else if (view.checkVisibility() && !view.hasAttribute("data-drawn")) window.bare.push(view.id);
  }
  requestAnimationFrame(look);
};
look();
"""  # views that have neither picture nor words, frame by frame

_MANY = """() => window.trame.state.set("keys", { ...window.trame.state.get("keys"), groups: {
  low: "", high: "", unit: "", colors: [], patches: [...Array(12).keys()].map((k) =>
    ({ color: "#345678", words: `${k + 1}: 8.2 %` })) } })"""  # a key of twelve groups


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return folder_of(noisy(), tmp_path_factory.mktemp("explore") / "result")


@pytest.fixture(scope="module")
def result(folder):
    return read_result(folder)


@pytest.fixture(scope="module")
def world(folder):
    with browsing(folder.parent, folder) as world:
        yield world


@pytest.fixture(scope="module")
def context(world):
    return world.context()


@pytest.fixture(scope="module")
def opened(world, context):
    page = world.tab(context, ready=RESULT)
    for view in VIEWS:
        settled(page, view)
    until_state(page, count_words="")
    return page


@pytest.fixture
def page(opened):
    """The same page for all tests, with four views."""
    if state(opened, "layout") != "four":
        opened.click("button[value=four]")
        until_state(opened, layout="four")
        opened.wait_for_selector("#view_base")
    return opened


@pytest.fixture(scope="module")
def sized(world):
    """A page of another size for each test."""
    page = world.tab(world.context(), ready=RESULT)
    until_state(page, count_words="")
    settled(page, "groups")
    return page


def marked_node(page):
    """The node that the panel tells of."""
    return int(re.search(r"Node (\d+)", page.inner_text("#node_words"))[1])


def seen(page, view, points):
    """Pixels (n, 2) from the middle of a view where its camera sees points (n, 3)."""
    position, focal, up = cameras(page)[view]
    ahead = (focal - position) / np.linalg.norm(focal - position)
    right = np.cross(ahead, up) / np.linalg.norm(np.cross(ahead, up))
    away = points - position
    far = view_box(page, view)["height"] / 2 / np.tan(np.radians(15)) / (away @ ahead)
    return np.column_stack([far * (away @ right), -far * (away @ np.cross(right, ahead))])


def test_the_result_is_shown(page, result):
    """Oracle: data. Its numbers stand on the page, and each view has colours of its own."""
    said = page.inner_text(".v-navigation-drawer")
    assert f"{len(result.base.points)} nodes" in said
    assert f"{100 * result.significant.mean():.0f} % of the nodes" in said
    assert state(page, "count") == result.count
    pictures = [settled(page, view) for view in VIEWS]
    for picture in pictures:
        assert 0.1 < (saturation(picture) > 30).mean() < 0.9
    assert difference(pictures[2], pictures[3]) > 0.05


def test_the_scale_moves_both_signatures(page, result):
    """Oracle: theory. The words are 2 sqrt(time) of the next column; the mean view stays."""
    before = {view: settled(page, view) for view in VIEWS}
    column = state(page, "column")
    slider(page, SCALE).press("ArrowRight")
    until_state(page, column=column + 1)
    time = result.columns[column + 1]
    wanted = f"radius {2 * np.sqrt(time):.3g} (time {time:.3g})"
    assert float(diffusion_radius(time)) == pytest.approx(2 * np.sqrt(time))
    page.wait_for_selector(f"#column_words:text-is('{wanted}')")
    for view in ("base", "perturbed"):
        until_changed(page, view, before[view])
        assert wanted in page.inner_text(f"#view_{view}")
    assert difference(settled(page, "change"), before["change"]) == 0
    page.get_by_label("Change: mean over all scales").uncheck()
    page.wait_for_selector(f"#view_change:has-text('base − perturbed, {wanted}')")
    until_changed(page, "change", before["change"])
    assert difference(settled(page, "groups"), before["groups"]) == 0
    page.get_by_label("Change: mean over all scales").check()
    until_picture(page, "change", lambda now: difference(now, before["change"]) == 0)


def test_the_number_of_groups_moves_the_legend(page, result):
    """Oracle: data. For each count the table is that of the groups that the method finds."""
    before = {view: settled(page, view) for view in ("change", "groups")}
    found = dict(groupings(result, (2, 5)))
    for key, count in (("Home", 2), ("ArrowRight", 3), ("ArrowRight", 4), ("ArrowRight", 5)):
        slider(page, COUNT).press(key)
        until_state(page, count=count)
        if count not in found:
            continue
        rows = [
            [str(row["number"]), row["area"], row["change"], row["radius"]]
            for row in legend(group_rows(result, found[count]))
        ]
        until_table(page, "#legend", rows)
        assert sum(float(row[1].rstrip(" %")) for row in rows) == pytest.approx(50, abs=8)
        title = f"{len(rows)} groups of like change"
        page.wait_for_selector(f"#view_groups .iso-title:text-is('{title}')")
        until_changed(page, "groups", before["groups"])
    assert difference(settled(page, "change"), before["change"]) == 0
    slider(page, COUNT).press("Home")
    slider(page, COUNT).press("ArrowRight")
    until_picture(page, "groups", lambda now: difference(now, before["groups"]) == 0)


def test_the_threshold_takes_the_colours_away(page):
    """Oracle: theory. Nothing is above 10 noise floors, half of the nodes is above 2 of them."""
    half = settled(page, "change")
    coloured = (saturation(half) > 30).mean()
    slider(page, NOISE).press("End")
    page.wait_for_selector("#factor_words:text-is('shown above 10 times the noise floor')")
    until_picture(page, "change", lambda now: (saturation(now) > 30).mean() < 0.1 * coloured)
    slider(page, NOISE).press("Home")
    page.wait_for_selector("#factor_words:text-is('everything is shown')")
    until_picture(page, "change", lambda now: (saturation(now) > 30).mean() > 1.2 * coloured)
    for factor in ("0.5", "1", "1.5", "2"):
        before = settled(page, "change")
        slider(page, NOISE).press("ArrowRight")
        page.wait_for_selector(f"#factor_words:has-text('above {factor} times')")
        if float(factor) > 1:
            until_changed(page, "change", before)
    until_picture(page, "change", lambda now: difference(now, half) == 0)


def test_the_last_of_quick_moves_is_what_is_drawn(page):
    """Oracle: data. Back where it was, the slider gives the picture it gave, however quick."""
    before = settled(page, "change")
    slider(page, NOISE).press("Home")
    until_changed(page, "change", before)
    for _ in range(4):
        slider(page, NOISE).press("ArrowRight")
    until_state(page, factor=2)
    until_picture(page, "change", lambda now: difference(now, before) == 0)


def test_one_view_can_have_all_the_room(page):
    """Oracle: geometry. One view is as wide and high as four, and shows the same surface."""
    four = [view_box(page, view) for view in VIEWS]
    page.click("button[value=groups]")
    page.wait_for_selector("#view_base", state="hidden")
    until(page, "() => document.getElementById('view_groups').offsetHeight > 500")
    box = view_box(page, "groups")
    assert box["width"] == pytest.approx(four[0]["width"] + four[1]["width"], abs=2)
    assert box["height"] == pytest.approx(four[0]["height"] + four[2]["height"], abs=2)
    large = settled(page, "groups")
    assert (saturation(large) > 30).mean() > 0.05
    page.click("button[value=four]")
    for view, before in zip(VIEWS, four, strict=True):
        page.wait_for_selector(f"#view_{view}")
        until(
            page,
            "([id, width]) => Math.abs(document.getElementById(id).offsetWidth - width) < 2",
            [f"view_{view}", before["width"]],
        )


def test_all_views_turn_together(page):
    """Oracle: symmetry. Four equal cameras after a drag; new colours leave them alone."""
    before, picture = cameras(page), settled(page, "perturbed")
    assert set(before) == set(VIEWS)
    drag(page, "change", 70, 40)
    until_changed(page, "perturbed", picture)
    turned = cameras(page)
    for camera in turned.values():
        np.testing.assert_allclose(camera, turned["change"], atol=1e-9)
    assert np.abs(turned["base"][0] - before["base"][0]).max() > 0.1
    assert state(page, "node") == -1  # the end of a drag is no click
    colours = settled(page, "base")
    slider(page, SCALE).press("ArrowLeft")
    until_changed(page, "base", colours)
    after = cameras(page)
    for view in VIEWS:
        np.testing.assert_array_equal(after[view], turned[view])


def test_a_preset_looks_along_an_axis(page):
    """Oracle: geometry. The camera stands on the axis, and what is up is up."""
    for name, axis in (("-x", (-1, 0, 0)), ("+z", (0, 0, 1))):
        page.get_by_role("button", name=f"Look from {name}").click()
        until(
            page,
            "([axis, sign]) => { const c = window.trame.refs.view_base.getCamera(); const d ="
            " c.position.map((x, i) => x - c.focalPoint[i]); const r = Math.hypot(...d);"
            " return sign * d[axis] > 0.999999 * r }",
            [int(np.abs(axis).argmax()), int(np.sum(axis))],
        )
        for position, focal, up in cameras(page).values():
            away = (position - focal) / np.linalg.norm(position - focal)
            np.testing.assert_allclose(away, axis, atol=1e-6)
            assert abs(up @ away) < 1e-6


def test_a_click_tells_the_curves(page, result):
    """Oracle: geometry and data. The node under the pointer, and its numbers in the result."""
    across, down = 0.56, 0.47
    points = result.base.points - (result.base.points.max(0) + result.base.points.min(0)) / 2
    box, camera = view_box(page, "base"), cameras(page)["base"]
    clicked = np.array([(across - 0.5) * box["width"], (down - 0.5) * box["height"]])
    away = np.linalg.norm(seen(page, "base", points) - clicked, axis=1)
    front = points @ (camera[0] - camera[1]) > 0
    click_at(page, "base", across, down)
    page.wait_for_selector("#point")
    node = marked_node(page)
    assert front[node]
    assert away[node] < away[front].min() + 6
    curves = (
        result.columns,
        result.base_signature[node],
        result.perturbed_signature[node],
        result.change[node],
        result.noise_floor[node],
    )
    shown = table(page, "#values")
    assert shown == curve_values(*curves, kind=result.kind)[1:]
    times, base = (np.array([float(row[k]) for row in shown]) for k in (0, 2))
    at = np.abs(result.columns - times[:, None]).argmin(axis=1)
    np.testing.assert_allclose(base, result.base_signature[node][at], rtol=1e-2)
    assert page.locator("#point svg").count() == 1
    assert f"node={node}" in urlsplit(where(page)).fragment


def test_the_pointer_tells_a_node(page, result):
    """Oracle: data. The words are the numbers of the node; beside the surface there are none."""
    box = view_box(page, "groups")
    page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 0.52 * box["height"])
    page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 0.55 * box["height"], steps=3)
    words = page.wait_for_selector(".iso-hover:has-text('node')").inner_text()
    node, change = re.match(r"node (\d+): mean change ([\d.]+) %", words).groups()
    norm = 100 * result.change_norm[int(node)]
    assert float(change) == pytest.approx(norm, rel=0.06)
    assert ("within the noise" in words) == (not result.significant[int(node)])
    assert ("no group" in words) == (result.labels[int(node)] < 0)
    page.mouse.move(box["x"] + 3, box["y"] + box["height"] - 3, steps=3)
    page.wait_for_selector(".iso-hover", state="detached")


def test_the_keyboard_reaches_everything(page):
    """Oracle: theory. Tab goes to each slider, which then has a ring (WCAG 2.2, 2.4.7)."""
    page.evaluate("document.activeElement.blur()")
    page.locator(".v-app-bar-nav-icon").focus()
    reached = []
    for _ in range(40):
        page.keyboard.press("Tab")
        name, ring = page.evaluate(
            "() => { const e = document.activeElement; const s = getComputedStyle(e);"
            " return [e.getAttribute('aria-label'), e.getAttribute('role') === 'slider' &&"
            " (s.outlineStyle !== 'none' && parseFloat(s.outlineWidth) >= 1)] }"
        )
        if ring:
            reached.append(name)
        if name == COUNT:
            break
    assert [name.split(":")[0].split(" in ")[0] for name in reached] == [SCALE, NOISE, COUNT]
    before = state(page, "count")
    page.keyboard.press("ArrowRight")
    until_state(page, count=before + 1)
    page.keyboard.press("ArrowLeft")
    until_state(page, count=before)


def test_an_address_keeps_the_state(world, context, page):
    """Oracle: data. Its sliders, view and point come back in a session of their own."""
    kept = ("count", "column", "factor", "node", "layout")
    slider(page, COUNT).press("End")
    slider(page, NOISE).press("ArrowRight")
    page.click("button[value=change]")
    until_state(page, count=12, factor=2.5, layout="change")
    until(
        page,
        "() => ['view=change', 'groups=12', 'noise=2.5'].every((x) => location.hash.includes(x))",
    )
    wanted, link = state(page, *kept), urlsplit(where(page))
    other = world.tab(context, f"{world.origin}/#{link.fragment}", ready=RESULT)
    until_state(other, **dict(zip(kept, wanted, strict=True)))
    other.wait_for_selector("#view_base", state="hidden")
    assert urlsplit(where(other)).path != link.path
    assert marked_node(other) == wanted[3]
    assert other.locator(".iso-view:visible").count() == 1
    slider(other, COUNT).press("Home")
    other.click("button[value=four]")
    until_state(other, count=2, layout="four")
    assert state(page, *kept) == wanted  # sessions do not see one another
    other.goto("about:blank")  # the same address again: the same session
    other.goto(where(page))
    other.wait_for_selector(RESULT)
    until_state(other, **dict(zip(kept, wanted, strict=True)))
    assert urlsplit(where(other)).path == link.path
    other.close()


def test_reloading_keeps_the_state(page):
    """Oracle: data. The same session, and the same picture of the same node."""
    kept = ("count", "column", "factor", "node", "layout")
    wanted, address = state(page, *kept), where(page)
    page.reload()
    page.wait_for_selector(RESULT)
    assert where(page) == address
    assert state(page, *kept) == wanted
    until_picture(page, "change", lambda now: (saturation(now) > 30).mean() > 0.01)
    page.click("button[value=four]")
    until_state(page, layout="four")


def test_a_lost_connection_resumes(page):
    """Oracle: data. The page comes back by itself, with its state, and its sliders work."""
    kept = ("count", "column", "factor", "node", "layout")
    wanted, session = state(page, *kept), urlsplit(where(page)).path
    page.evaluate("window.sockets.forEach(socket => socket.close())")
    page.wait_for_selector(RESULT, state="detached")
    page.wait_for_selector(RESULT)
    assert state(page, *kept) == wanted
    assert urlsplit(where(page)).path == session
    before = settled(page, "groups")
    slider(page, COUNT).press("Home")
    slider(page, COUNT).press("ArrowRight")
    page.wait_for_selector("#view_groups .iso-title:text-is('3 groups of like change')")
    until_changed(page, "groups", before)  # of 12 that were asked for, noise left two


def test_dark_and_light(page):
    """Oracle: theory. Ground and words change places: more than 7 : 1 in both (WCAG 1.4.6)."""
    ratios, grounds = [], []
    for dark in (False, True, False):
        if state(page, "dark") != dark:
            page.get_by_role("button", name="Light or dark").click()
        until_state(page, dark=dark)
        picture = until_picture(
            page, "base", lambda now, dark=dark: (now[-4:, :4].mean() < 100) == dark
        )
        grounds.append(picture[-4:, :4].mean())
        ratios.append(contrast(page, "#view_base .iso-title", picture[-2, 1]))
    assert grounds[0] == grounds[2] == 255
    assert grounds[1] < 40
    assert min(ratios) > 7


def contrast(page, selector, ground):
    """The contrast of words on a ground, as WCAG 2.2 defines it."""
    color = page.locator(selector).evaluate("e => getComputedStyle(e).color")
    both = [[float(x) for x in re.findall(r"[\d.]+", color)[:3]], list(ground)]
    linear = [((np.array(one) / 255 + 0.055) / 1.055) ** 2.4 for one in both]
    low, high = sorted(float(one @ [0.2126, 0.7152, 0.0722]) for one in linear)
    return (high + 0.05) / (low + 0.05)


def test_the_picture_of_the_views_is_saved(page, tmp_path):
    """Oracle: data. A PNG with the colours that stand on the page, as large as the views."""
    from PIL import Image

    shown = {view: settled(page, view) for view in VIEWS}
    data = saved(page, lambda: page.click("#screenshot"), tmp_path / "isovary.png")
    assert data.startswith(b"\x89PNG")
    picture = np.asarray(Image.open(io.BytesIO(data)).convert("RGB")).astype(int)
    height, width = picture.shape[:2]
    boxes = [view_box(page, view) for view in VIEWS]
    assert width == pytest.approx(boxes[0]["width"] + boxes[1]["width"], abs=2)
    for view, box in zip(VIEWS, boxes, strict=True):
        left = round(box["x"] - boxes[0]["x"])
        top = round(height - (boxes[3]["y"] + boxes[3]["height"] - box["y"]))
        part = picture[top : top + round(box["height"]), left : left + round(box["width"])]
        coloured = (saturation(shown[view]) > 30).mean()
        assert (saturation(part) > 30).mean() == pytest.approx(coloured, rel=0.2), view


def test_the_picture_can_have_twice_the_pixels(page, tmp_path):
    """Oracle: geometry. Twice as wide and high, the same shares of colour, the views as before."""
    from PIL import Image

    before = {view: settled(page, view) for view in VIEWS}
    pictures = []
    for button in ("#screenshot", "#screenshot_large"):
        data = saved(page, lambda button=button: page.click(button), tmp_path / "isovary.png")
        picture = Image.open(io.BytesIO(data)).convert("RGB")
        pictures.append(np.asarray(picture).astype(int))
    small, large = pictures
    assert large.shape == (2 * small.shape[0], 2 * small.shape[1], 3)
    parts = [(saturation(picture) > 30).mean() for picture in pictures]
    assert parts[1] == pytest.approx(parts[0], rel=0.05)
    for view in VIEWS:
        until_picture(page, view, lambda now, view=view: difference(now, before[view]) == 0)


def test_the_files_are_those_of_the_folder(page, folder, tmp_path):
    """Oracle: data. Each file of the result is offered, and is the same byte by byte."""
    names = sorted(path.name for path in folder.iterdir())
    links = page.locator("a[download]:visible")
    assert links.all_inner_texts() == names
    for name in names:
        link = page.locator(f"a[download='{name}']:visible")
        assert saved(page, link.click, tmp_path / name) == (folder / name).read_bytes()


def test_no_view_is_empty_without_a_word(world):
    """Oracle: theory. In each frame a view has a picture or says why not; then no more words."""
    context = world.context()
    context.add_init_script(_WATCH)
    page = world.tab(context, ready=RESULT)
    for view in VIEWS:
        page.wait_for_selector(f"#view_{view}[data-drawn] .iso-wait", state="hidden")
        settled(page, view)
    assert page.evaluate("window.bare") == []
    assert "drawing…" in page.evaluate("[...window.told]")
    page.get_by_role("tab", name="Compare").click()
    page.wait_for_selector("#view_perturbed .iso-wait:visible:text-is('no field is open')")
    page.get_by_role("tab", name="Explore").click()
    page.wait_for_selector("#view_perturbed[data-drawn] .iso-wait", state="hidden")
    page.close()


def test_twelve_groups_have_a_short_key(sized):
    """Oracle: geometry. Three rows at most in a view 320 wide, and the words stay inside."""
    page = sized
    page.set_viewport_size({"width": 990, "height": 700})  # 330 of them for the drawer
    page.evaluate(_MANY)
    page.wait_for_selector("#view_groups .iso-patches > div >> nth=11")
    until(page, "() => document.getElementById('view_groups').offsetWidth < 335")
    key = page.locator("#view_groups .iso-patches").bounding_box()
    box = view_box(page, "groups")
    assert key["height"] <= 3 * 16
    assert key["x"] + key["width"] <= box["x"] + box["width"]
    ends = page.eval_on_selector_all(
        "#view_groups .iso-patches > div", "all => all.map(e => e.getBoundingClientRect().right)"
    )
    assert max(ends) <= box["x"] + box["width"]


def test_the_values_of_a_point_fit(sized):
    """Oracle: geometry. Nothing of the table lies beyond its panel."""
    page = sized
    page.set_viewport_size({"width": 1100, "height": 700})
    settled(page, "base")
    click_at(page, "base", 0.56, 0.47)
    page.click("#point summary")
    page.wait_for_selector("#values:visible")
    room, width = page.eval_on_selector("#point details", "e => [e.clientWidth, e.scrollWidth]")
    assert width <= room
    assert page.eval_on_selector("#point", "e => e.scrollWidth <= e.clientWidth")


def test_a_drawer_that_is_open_lies_over_narrow_views(sized):
    """Oracle: geometry. The views keep the width of the window, and the drawer closes with it."""
    page = sized
    page.get_by_role("button", name="Close the point").click()
    until_state(page, drawer=True)
    page.set_viewport_size({"width": 650, "height": 700})
    until_state(page, drawer=False)
    whole = "() => document.querySelector('.iso-grid').offsetWidth === 650"
    until(page, whole)
    page.locator(".v-app-bar-nav-icon").click()
    until_state(page, drawer=True)
    until(page, whole)
    page.set_viewport_size({"width": 1100, "height": 700})
    until_state(page, drawer=True)
    until(page, "() => document.querySelector('.iso-grid').offsetWidth === 770")


def test_all_tabs_have_room_on_the_smallest_telephone(world):
    """Oracle: geometry. 320 pixels, the least that WCAG 2.2 asks for (1.4.10)."""
    page = world.tab(world.context(320, 700), ready="#view_change canvas")
    button = page.get_by_role("button", name="Light or dark").bounding_box()
    for tab in page.get_by_role("tab").all():
        box = tab.bounding_box()
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= button["x"] + 1
    page.close()


def test_a_server_that_ended_is_told(world, folder):
    """Oracle: theory. First that the page tries to come back, then that there is nobody."""
    with serving(folder.parent, folder) as address:
        other = World(world.browser, address)
        page = other.tab(other.context(), ready=RESULT)
        page.get_by_role("button", name="Light or dark").click()
        until_state(page, dark=True)
    page.wait_for_selector("#lost_words:text-is('Trying to come back…')")
    page.wait_for_selector("#lost_words:has-text('The server has ended')")
    assert page.locator("#lost_reload").is_hidden()
    ground = page.eval_on_selector(".v-application", "e => getComputedStyle(e).backgroundColor")
    ground = np.array([float(x) for x in re.findall(r"[\d.]+", ground)[:3]])
    assert contrast(page, "#lost_words", ground) > 7
    page.close()


def test_a_telephone_has_room_for_it(world):
    """Oracle: geometry. No scrolling aside; the view fills the screen; the drawer opens."""
    context = world.context(390, 844)
    page = world.tab(context, ready="#view_change canvas")
    page.wait_for_selector("#view_change .iso-title:has-text('Change')")
    until_state(page, layout="change")
    page.wait_for_selector("#view_base", state="hidden")
    assert page.locator(".iso-view:visible").count() == 1
    box = view_box(page, "change")
    assert box["width"] == pytest.approx(390, abs=2)
    assert box["height"] > 600
    until_picture(page, "change", lambda now: (saturation(now) > 30).mean() > 0.05)
    assert page.evaluate(_SIDEWAYS) == []
    drawer = page.locator(".v-navigation-drawer")
    assert drawer.bounding_box()["x"] < -300
    page.locator(".v-app-bar-nav-icon").click()
    until(
        page, "() => document.querySelector('.v-navigation-drawer').getBoundingClientRect().x >= 0"
    )
    slider(page, COUNT).press("End")
    until_state(page, count=12)
    assert page.evaluate(_SIDEWAYS) == []
    tabs = [tab.bounding_box() for tab in page.get_by_role("tab").all()]
    button = page.get_by_role("button", name="Light or dark").bounding_box()
    assert all(tab["x"] >= 0 and tab["x"] + tab["width"] <= button["x"] + 1 for tab in tabs)
    page.close()


def test_nobody_else_is_asked(world, page):
    """Oracle: theory. No other host, no complaint, a policy that names the page alone."""
    assert page.locator("canvas").count() == 4
    check_manners(world)
