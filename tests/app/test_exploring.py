"""The exploring part of the page without a browser: sliders, points, links, groups, views."""

from __future__ import annotations

import asyncio
import threading
from dataclasses import replace
from typing import ClassVar
from urllib.parse import parse_qsl

import numpy as np
import pytest
from saved_folder import dented_ball, folder_of, half_lost, noisy
from stubs import StubGateway, StubServer, StubViews, in_loop, settings_of, settled, stub_jobs

from isovary.app import _exploring, _views
from isovary.app._exploring import Exploring
from isovary.app._exploring_widgets import facts
from isovary.app._group_cache import find_groups, name_of
from isovary.app._groupings import COUNTS, groupings, palettes
from isovary.app._jobs import Failed, Finished, Progress
from isovary.app._opened_result import open_folder
from isovary.app._painting import paint_change, paint_groups, paint_signature
from isovary.app._saved_result import read_result
from isovary.app._scene import Mesh, Scene, camera_at
from isovary.app._views import NAMES, PRESETS, Views
from isovary.shapes import icosphere

LINK = "view=groups&column=5&at=5&groups=7&noise=4.5&node=12"


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Opened results by name, each read once."""
    place = tmp_path_factory.mktemp("explored")
    made = {"dented": dented_ball(), "lost": half_lost(), "noisy": noisy()}
    one = dented_ball().clusters
    one = replace(one, labels=np.minimum(one.labels, 0), centers=one.centers[:1])
    made["one group"] = replace(dented_ball(), clusters=one)
    return {name: open_folder(folder_of(result, place / name)) for name, result in made.items()}


@pytest.fixture(scope="module")
def grouped(results, tmp_path_factory):
    """Files of all groups of the dented ball, as a session keeps them."""
    cache = tmp_path_factory.mktemp("kept")
    find_groups(results["dented"].saved.folder, cache, lambda *_: None)
    return sorted(cache.iterdir())


class Part:
    """The exploring part on stubs; results are opened at once."""

    def __init__(self, folder, monkeypatch, results):
        self.results, self.jobs = results, stub_jobs(monkeypatch)
        monkeypatch.setattr(_exploring, "open_folder", self.opened)
        monkeypatch.setattr(_exploring, "offer", lambda *_: [{"name": "a", "size": "1 B"}])
        self.server = StubServer(part="explore", layout="four", arrived=True)
        self.views, self.gateway = StubViews(), StubGateway()
        self.settings = settings_of(folder)
        self.exploring = Exploring(self.server, self.views, self.settings, self.gateway.turns)
        self.server.begin()
        self.state = self.server.state

    def opened(self, folder):
        found = self.results[folder.name]
        if isinstance(found, Exception):
            raise found
        return found

    async def open(self, name="dented"):
        await self.exploring.open_result(self.results[name].saved.folder)
        await settled()
        return self.results[name]

    async def set(self, **values):
        self.server.browser_sets(**values)
        await settled()

    def keep(self, files, counts, name=None):
        """Put the groups for these counts into the cache, under the name of a result."""
        for path in files:
            own, _, count = path.stem.rpartition("-")
            if int(count) in counts:
                kept = self.settings.cache / f"{name or own}-{count}.npz"
                kept.write_bytes(path.read_bytes())

    def follow(self, link):
        with self.state:
            self.exploring.follow(link)

    @property
    def link(self):
        return dict(parse_qsl(self.state.link))

    def shows(self, name, painted):
        """Whether a view has these colours."""
        return np.array_equal(self.views.colors[name], painted.colors)


@pytest.fixture
def part(tmp_path, monkeypatch, results):
    return Part(tmp_path, monkeypatch, dict(results))


@in_loop
async def test_a_result_is_shown_in_all_views(part):
    """Oracle: other package. Each view has the colours that its painter makes of the sliders."""
    opened = await part.open()
    assert set(part.views.meshes) == set(NAMES)
    assert (part.state.has_result, part.state.problem) == (True, "")
    for column, mean, factor in ((2, True, 2.0), (17, False, 0.0), (9, False, 6.5)):
        await part.set(column=column, mean=mean, factor=factor)
        result = opened.saved
        at = None if mean else column
        assert part.shows("base", paint_signature(result, "base", column, opened.base))
        perturbed = paint_signature(result, "perturbed", column, opened.perturbed)
        assert part.shows("perturbed", perturbed)
        assert part.shows("change", paint_change(result, at, factor, opened.base))
        assert part.shows("groups", paint_groups(result, opened.groups, opened.base))


@in_loop
async def test_sliders_that_move_together_paint_once(part):
    """Oracle: definition. Each view once, with the last position, however often it moved."""
    opened = await part.open()
    part.views.calls.clear()
    for column in range(3, 19):
        part.server.browser_sets(column=column)
    await settled()
    assert part.views.calls.count("paint") == 2
    assert part.shows("base", paint_signature(opened.saved, "base", 18, opened.base))


@pytest.mark.parametrize("elsewhere", ["compare", "dimple"])
@in_loop
async def test_other_parts_are_not_drawn_over(part, grouped, elsewhere):
    """Oracle: definition. Sliders, links and groups that are found wait for their part."""
    opened = await part.open()
    part.server.browser_sets(factor=7.5)  # asked for, and left before it was painted
    part.server.browser_sets(part=elsewhere)
    part.state.titles, part.state.keys = {"base": "other"}, {"base": "other"}
    part.views.calls.clear()
    await settled()
    await part.set(column=4, count=7)
    part.follow(LINK)
    part.keep(grouped, COUNTS)
    part.jobs[-1].tell(Progress("7 groups", 0.5, 1.0, None))
    part.jobs[-1].tell(Finished(None, 1.0))
    await settled()
    assert part.views.calls == []
    assert part.state.titles == part.state.keys == {"base": "other"}
    await part.set(part="explore")
    part.exploring.enter()
    assert part.shows("change", paint_change(opened.saved, None, 7.5, opened.base))
    assert part.state.titles["groups"].startswith("7 groups")


@in_loop
async def test_a_result_brings_its_part_to_the_front(part):
    """Oracle: definition. Opened from another part, it fills the views when its part is entered."""
    part.server.browser_sets(part="compare")
    entered = []

    def enter(**_):
        entered.append(list(part.views.calls))
        part.exploring.enter()

    part.state.change("part")(enter)
    await part.open()
    assert part.state.part == "explore"
    assert entered == [[]]  # nothing was drawn before
    assert set(part.views.meshes) == set(NAMES)


@in_loop
async def test_entering_without_a_result_shows_nothing(part):
    """Oracle: definition. What another part left in the views is gone."""
    part.views.meshes |= dict.fromkeys(NAMES, "left")
    part.exploring.enter()
    part.exploring.pick("base", np.zeros(3))
    assert part.exploring.words_at("base", np.zeros(3)) == ""
    assert part.views.meshes == {}
    assert part.state.titles == {}


@in_loop
async def test_what_is_no_result_is_told(part):
    """Oracle: definition. The folder by its name; what was open stays."""
    await part.open()
    folder = part.settings.folder / "other"
    part.results["other"] = OSError("no such file")
    await part.exploring.open_result(folder)
    assert part.state.problem == "other cannot be shown: no such file"
    assert part.state.has_result
    await part.open("lost")
    assert part.state.problem == ""


@in_loop
async def test_the_address_keeps_the_state(part, tmp_path, monkeypatch, results):
    """Oracle: inverse. The link that a state has leads another session to the same state."""
    await part.open()
    part.follow(LINK)
    keys = "layout", "column", "mean", "count", "factor", "node"
    state = {key: part.state[key] for key in keys}
    assert state == dict(zip(keys, ("groups", 5, False, 7, 4.5, 12), strict=True))
    assert part.link == dict(parse_qsl(LINK))
    (tmp_path / "second").mkdir()
    second = Part(tmp_path / "second", monkeypatch, results)
    second.follow(part.state.link)  # before there is a result
    await second.open()
    assert {key: second.state[key] for key in keys} == state
    assert second.state.node_words == part.state.node_words != ""
    await part.set(mean=True, layout="four")
    assert (part.link["column"], part.link["view"], part.link["at"]) == ("mean", "four", "5")
    part.exploring.pick("base", np.array([0.0, 0, 1]))
    assert int(part.link["node"]) == part.state.node


@pytest.mark.parametrize(
    "link",
    [
        "node=474",
        "node=99999999999999999999",
        "node=-2",
        "node=nan&at=nan&groups=inf&noise=nan",
        "node=x&at=y&groups=z&noise=w",
        "at=20&groups=1&noise=11",
        "at=-1&groups=13&noise=-0.5",
        "view=other",
        "view=",
        "node&&&==;%00=%ff",
        "part=dimple&running=1&legend=x&state=1",
        "",
    ],
)
@pytest.mark.parametrize("early", [True, False])
@in_loop
async def test_links_that_make_no_sense_are_left_aside(part, link, early):
    """Oracle: definition. As without a link, whether it comes before the result or after it."""
    if early:
        part.follow(link)
    await part.open()
    part.follow(link)
    state = part.state
    assert (state.layout, state.column, state.mean) == ("four", 6, True)
    assert (state.count, state.factor, state.node) == (3, 2.0, -1)
    assert (state.part, state.legend == "x") == ("explore", False)
    assert "node" not in part.link
    part.follow("node=3")  # and a good one counts
    assert state.node == 3


@in_loop
async def test_a_point_tells_of_its_node(part):
    """Oracle: data. The nearest node's curve and cross, also after another scale."""
    opened = await part.open()
    place = opened.saved.base.points[40]
    part.exploring.pick("groups", place * 1.01)
    assert part.state.node == 40
    assert part.state.node_words.startswith("Node 40 at (")
    np.testing.assert_allclose(part.views.strokes["base"][-1, 0], place)
    np.testing.assert_allclose(part.views.strokes["perturbed"][-1, 0], opened.saved.partners[40])
    curves = part.state.curves
    await part.set(column=1)
    assert part.state.curves != curves  # its mark moved
    assert len(part.state.node_values) == len(opened.saved.columns)
    part.exploring.pick("perturbed", np.array([9.0, 9, 9]))  # beside it
    assert part.state.node == 40


@in_loop
async def test_a_point_without_a_partner(part):
    """Oracle: data. No cross on the perturbed surface, and words; beside a partner no node."""
    opened = await part.open("lost")
    node = int(opened.saved.base.points[:, 0].argmax())
    part.exploring.pick("base", opened.saved.base.points[node])
    assert part.state.group_words == "no partner, change unknown"
    assert len(part.views.strokes["perturbed"]) == 0
    assert len(part.views.strokes["base"]) > 0
    place = opened.saved.perturbed.points[opened.saved.perturbed.points[:, 0].argmax()]
    assert part.exploring.words_at("perturbed", place) == "no partner near"
    assert part.exploring.words_at("base", None) == ""


@in_loop
async def test_words_tell_change_noise_and_group(part):
    """Oracle: data. Groups by the numbers of the files; within the noise there is none."""
    opened = await part.open("noisy")
    for node in range(0, len(opened.norm), 9):
        words = part.exploring.words_at("base", opened.saved.base.points[node])
        assert words.startswith(f"node {node}: mean change ")
        kept, label = opened.saved.significant[node], opened.groups.labels[node]
        assert ("within the noise" in words) == (not kept)
        assert words.endswith(f"group {label}" if label >= 0 else "no group")


@in_loop
async def test_groups_are_shown_as_they_are_found(part, grouped):
    """Oracle: other package. Until then the saved ones, and words; then those of groupings."""
    opened = await part.open()
    await part.set(count=7)
    job = part.jobs[-1]
    assert job.function is find_groups
    assert job.arguments == (opened.saved.folder, part.settings.cache)
    assert "still being computed" in part.state.count_words
    assert part.shows("groups", paint_groups(opened.saved, opened.groups, opened.base))
    part.keep(grouped, [2, 4])
    job.tell(Progress("2 groups", 0.1, 1.0, None))
    await settled()
    assert "still being computed" in part.state.count_words
    part.keep(grouped, [7])
    job.tell(Progress("7 groups", 0.5, 1.0, None))
    await settled()
    assert part.state.count_words == ""
    assert part.state.titles["groups"].startswith("7 groups")
    ((_, seven),) = groupings(opened.saved, [7])
    found = {3: opened.groups, **dict(groupings(opened.saved, [2, 4, 7]))}
    palette = palettes(found, 3, opened.areas)[7]
    assert part.shows("groups", paint_groups(opened.saved, seven, opened.base, palette=palette))
    assert len(part.state.legend) == len(seven.centers)


@in_loop
async def test_kept_groups_need_no_search(part, grouped):
    """Oracle: definition. What another session found is there at once."""
    part.keep(grouped, COUNTS)
    await part.open()
    await part.set(count=9)
    assert part.jobs == []
    assert part.state.count_words == ""
    assert part.state.titles["groups"].startswith("9 groups")


@pytest.mark.parametrize("kept", [(2, 3), COUNTS[:-1], COUNTS[1:], ()])
@pytest.mark.parametrize("name", ["dented", "one group"])
@in_loop
async def test_some_kept_groups_do_not_stop_the_search(part, grouped, kept, name):
    """Oracle: definition. As long as a count is missing, also where the result has one group."""
    opened = part.results[name]
    part.keep(grouped, kept, name=name_of(opened.saved.folder))
    await part.open(name)
    missing = set(COUNTS) - set(kept) - {opened.saved.count}
    assert len(part.jobs) == bool(missing)
    part.keep(grouped, COUNTS, name=name_of(opened.saved.folder))
    for job in part.jobs:
        job.tell(Finished(None, 1.0))
    await settled()
    before = len(part.jobs)
    part.exploring.find_groups()
    await settled()
    assert len(part.jobs) == before  # now all are there
    for count in COUNTS:
        await part.set(count=count)
        assert part.state.count_words == ""


@in_loop
async def test_a_search_makes_way_and_goes_on(part):
    """Oracle: definition. Ended for another run, it is asked for anew; never two at a time."""
    await part.open()
    part.exploring.find_groups()
    await settled()
    assert len(part.jobs) == 1
    await part.exploring.pause()
    assert not part.jobs[0].running
    assert part.gateway.notes[-1] == {"busy": False}
    part.exploring.find_groups()
    await settled()
    assert len(part.jobs) == 2
    part.jobs[1].tell(Failed("too large"))
    await settled()
    await part.set(factor=3.0, count=9)  # said of a count that is missing, and as long as it is
    assert part.state.count_words == "not computed (too large); the saved ones are shown"
    await part.exploring.close()


@in_loop
async def test_groups_of_the_result_before_are_not_taken(part, grouped):
    """Oracle: definition. Another result ends the search, and its own groups stay."""
    await part.open()
    first = part.jobs[0]
    lost = await part.open("lost")
    assert not first.running
    assert len(part.jobs) == 2
    assert part.jobs[1].arguments[0] == lost.saved.folder
    part.keep(grouped, COUNTS)
    await part.set(count=9)
    assert part.state.count_words != ""
    assert part.shows("groups", paint_groups(lost.saved, lost.groups, lost.base))


@in_loop
async def test_without_a_browser_nothing_is_searched(tmp_path, monkeypatch, results):
    """Oracle: definition. A session ahead of its browser leaves the places to others."""
    part = Part(tmp_path, monkeypatch, results)
    part.state.arrived = False
    await part.open()
    assert part.jobs == []
    part.follow("")
    await settled()
    assert len(part.jobs) == 1


@in_loop
async def test_the_result_is_read_and_offered(tmp_path, monkeypatch, results):
    """Oracle: data. Nothing stubbed: facts of the folder, its files, all four views."""
    server, views, gateway = StubServer(part="explore"), StubViews(), StubGateway()
    settings = settings_of(tmp_path)
    exploring = Exploring(server, views, settings, gateway.turns)
    server.begin()
    folder = results["noisy"].saved.folder
    await exploring.open_result(folder)
    names = ["change.vtu", "perturbed.vtu", "summary.json"]
    assert [file["name"] for file in server.state.files] == names
    assert sorted(path.name for path in (settings.folder / "out").iterdir()) == names
    assert set(views.meshes) == set(NAMES)
    share = read_result(folder).significant.mean()
    facts = {fact["name"]: fact["value"] for fact in server.state.facts}
    assert float(facts["Above the noise"].split()[0].rstrip("%")) == pytest.approx(
        100 * share, rel=0.05
    )


def mesh(shift=0.0):
    ball = icosphere(1, order=1)
    return Mesh(ball.points + shift, ball.normals, ball.triangles)


def in_view(camera, points):
    """Points as a camera sees them: sideways and up, from -1 to 1 at a view angle of 30 degrees."""
    position, focus, up = (np.array(camera[key]) for key in ("position", "focalPoint", "viewUp"))
    ahead = (focus - position) / np.linalg.norm(focus - position)
    side = np.cross(ahead, up) / np.linalg.norm(np.cross(ahead, up))
    away = points - position
    axes = np.array([side, np.cross(side, ahead)])
    return away @ axes.T / (away @ ahead)[:, None] / np.tan(np.radians(15))


@pytest.mark.parametrize("direction", PRESETS)
def test_a_camera_sees_the_whole_mesh(direction):
    """Oracle: analytic. A sphere fills eight tenths of the half angle; up is up."""
    seen = mesh(np.array([5.0, -3, 100]))
    towards, up = PRESETS[direction]
    camera = camera_at(seen, towards, up)
    at = in_view(camera, seen.points)
    reached = np.arcsin(0.8 * np.sin(np.radians(15)))
    limit = np.tan(reached) / np.tan(np.radians(15))
    assert 0.9 * limit < np.linalg.norm(at, axis=1).max() <= limit + 1e-9
    top = in_view(camera, seen.center + 0.1 * np.array([up, towards]))
    assert top[0, 1] > 0
    np.testing.assert_allclose(top[1], 0, atol=1e-9)


def actors(scene):
    """A scene's surface and its lines, as VTK has them."""
    return list(scene.window.GetRenderers().GetFirstRenderer().GetActors())


def visible(scene):
    return [bool(actor.GetVisibility()) for actor in actors(scene)]


def test_a_scene_shows_what_it_was_given_last():
    """Oracle: definition. Nothing at first and after it is cleared; no strokes, no lines."""
    scene, seen = Scene(), mesh()
    colors = np.zeros((len(seen.triangles), 3), np.uint8)
    assert visible(scene) == [False, False]
    scene.show(seen, colors)
    assert visible(scene) == [True, False]
    scene.draw_lines(np.zeros((4, 2, 3)))
    assert visible(scene) == [True, True]
    scene.draw_lines(np.zeros((0, 2, 3)))
    assert visible(scene) == [True, False]
    scene.draw_lines(np.zeros((1, 2, 3)))
    scene.clear()
    assert visible(scene) == [False, False]
    scene.show(seen, colors)
    assert visible(scene) == [True, False]


def test_places_are_those_of_the_surface_wherever_it_lies():
    """Oracle: inverse. Coordinates are sent from the middle; an event comes back from there."""
    server = StubServer()
    views = Views(server)
    far = mesh(np.array([1e6, 0, -2e6]))
    views.frame(far, *PRESETS["+z"])
    np.testing.assert_allclose(server.state.camera["focalPoint"], 0, atol=1e-6)
    event = {"worldPosition": [0.0, 0.5, 1.0]}
    np.testing.assert_array_equal(views.place(event), far.center + event["worldPosition"])
    before = server.state.camera
    views.look(*PRESETS["-x"])
    assert server.state.camera != before
    np.testing.assert_allclose(server.state.camera["position"][1:], 0, atol=1e-6)
    assert server.state.camera["position"][0] < 0


class Sheet:
    """A scene that keeps what it is given."""

    made: ClassVar[list] = []

    def __init__(self):
        self.made.append(self)
        self.points, self.ends = None, None

    def show(self, mesh, _colors):
        self.points = mesh.points

    def draw_lines(self, ends):
        self.ends = ends

    def __getattr__(self, name):
        return lambda *_: None


def test_a_surface_far_away_is_sent_as_precisely_as_a_near_one(monkeypatch):
    """Oracle: algebra. In single precision 1e8 away nothing would be left of a unit sphere."""
    monkeypatch.setattr(Sheet, "made", [])
    monkeypatch.setattr(_views, "Scene", Sheet)
    views, far = Views(StubServer()), mesh(np.array([1e8, 0, -1e8]))
    views.frame(far, *PRESETS["+z"])
    views.show("base", far, np.zeros((len(far.triangles), 3), np.uint8))
    (sheet,) = (sheet for sheet in Sheet.made if sheet.points is not None)
    np.testing.assert_allclose(sheet.points.astype(np.float32), mesh().points, atol=3e-8)
    views.draw_lines(far.points[None, :2], ("base",))
    np.testing.assert_allclose(sheet.ends.astype(np.float32), mesh().points[None, :2], atol=3e-8)
    assert [sheet.ends is not None for sheet in Sheet.made].count(True) == 1


@pytest.mark.parametrize(
    "event", [None, {}, {"worldPosition": None}, {"worldPosition": [0.0, float("nan"), 1.0]}]
)
def test_beside_the_surface_there_is_no_place(event):
    """Oracle: definition. No position, or one that is none, is beside it."""
    views = Views(StubServer())
    views.frame(mesh(), *PRESETS["+z"])
    assert views.place(event) is None
    Views(StubServer()).look(*PRESETS["+z"])  # before anything is there


@in_loop
async def test_the_search_goes_on_when_a_result_cannot_be_shown(part):
    """Oracle: definition. The result that stays still wants its groups."""
    await part.open()
    await part.exploring.pause()  # for a run, of which
    part.results["other"] = OSError("no such file")
    await part.exploring.open_result(part.settings.folder / "other")
    await settled()
    assert part.jobs[-1].running


@in_loop
async def test_an_old_link_is_not_for_the_next_result(part):
    """Oracle: definition. A link that came beside another part is no longer there."""
    await part.open()
    part.state.change("part")(lambda **_: part.exploring.enter())
    await part.set(part="compare")
    part.follow("node=12&view=groups")  # a browser that came back to the open result
    await part.open("noisy")
    assert part.state.node == -1


class Widget:
    """Counts how often its scene was sent."""

    def __init__(self):
        self.sent = 0

    def update(self):
        self.sent += 1


@in_loop
async def test_the_last_of_quick_scenes_is_sent_once_more(monkeypatch):
    """Oracle: definition. Once for each push, and once more when quiet follows quick ones."""
    monkeypatch.setattr(_views, "_QUIET", 0.1)
    views = Views(StubServer())
    views._widgets = widgets = {name: Widget() for name in NAMES}
    views.push("groups")
    for _ in range(5):
        views.push("change")
    assert [widgets[name].sent for name in NAMES] == [0, 0, 5, 1]
    while widgets["change"].sent == 5:
        await asyncio.sleep(0.01)
    assert not views._again  # nothing more is to come
    assert [widgets[name].sent for name in NAMES] == [0, 0, 6, 1]


@in_loop
async def test_a_push_right_after_the_second_sending_has_one_of_its_own(monkeypatch):
    """Oracle: definition. The second sending may be overtaken like any other."""
    monkeypatch.setattr(_views, "_QUIET", 0.2)
    views = Views(StubServer())
    views._widgets = widgets = {name: Widget() for name in NAMES}
    views.push("change")
    views.push("change")
    while widgets["change"].sent == 2:
        await asyncio.sleep(0.005)
    views.push("change")
    assert "change" in views._again


@in_loop
async def test_a_start_folder_that_fails_leaves_the_reader_where_he_is(part):
    """Oracle: definition. Its words wait in the exploring part."""
    await part.set(part="dimple")
    part.results["bad"] = OSError("no such file")
    await part.exploring.open_result(part.settings.folder / "bad", reveal=False)
    assert part.state.part == "dimple"
    assert "no such file" in part.state.problem


@in_loop
async def test_an_older_result_does_not_replace_a_later_one(part, monkeypatch):
    """Oracle: definition. The result is the one that was asked for last."""
    asked, answer = threading.Event(), threading.Event()

    def slow(folder):
        if folder.name == part.results["lost"].saved.folder.name:
            asked.set()
            answer.wait(30)
        return part.opened(folder)

    monkeypatch.setattr(_exploring, "open_folder", slow)
    first = asyncio.ensure_future(part.exploring.open_result(part.results["lost"].saved.folder))
    await asyncio.to_thread(asked.wait, 30)
    later = await part.open("dented")
    answer.set()
    await first
    assert part.exploring._opened is later


@in_loop
async def test_the_words_of_a_point_follow_the_number_of_groups(part, grouped):
    """Oracle: data. The group is that of the groups that are shown."""
    part.keep(grouped, COUNTS)
    opened = await part.open("dented")
    node = int(np.nanargmax(opened.norm))
    part.exploring.pick("base", opened.saved.base.points[node])
    seen = set()
    for path in grouped:
        await part.set(count=int(path.stem.rpartition("-")[2]))
        with np.load(path) as file:
            seen.add(words := f"group {file['labels'][node]}")
        assert part.state.group_words.endswith(words)
    assert len(seen) > 1


def test_the_files_are_named(results):
    """Oracle: definition. By their names, and by the array where it is not the field's own."""
    saved = results["noisy"].saved
    files = [
        {"path": "/a/first.vti", "array": "rho"},
        {"path": "m"},
        {"path": "/b/s.npz", "array": "q[2]"},
    ]
    told = replace(saved, summary=saved.summary | {"choices": {"field": "rho", "files": files}})
    rows = {row["name"]: row["value"] for row in facts(told)}
    assert (rows["Base"], rows["Perturbed"]) == ("first.vti", "s.npz, q[2]")
    without = replace(saved, summary=saved.summary | {"choices": {"field": "rho"}})
    assert "Base" not in {row["name"] for row in facts(without)}


@in_loop
async def test_the_title_is_that_of_the_groups_that_are_shown(part):
    """Oracle: definition. Until those asked for are there, the saved ones are counted."""
    opened = await part.open("dented")
    saved = len(opened.groups.centers)
    await part.set(count=12)
    assert part.state.titles["groups"] == f"{saved} groups of like change"


@in_loop
async def test_a_search_that_makes_way_is_said_to_be_none(part):
    """Oracle: definition. Nobody computes what is missing while another run has the place."""
    await part.open("dented")
    await part.set(count=12)
    assert part.state.count_words.startswith("still being computed")
    await part.exploring.pause()
    assert part.state.count_words.startswith("not computed")


@in_loop
async def test_the_page_knows_which_views_are_filled():
    """Oracle: definition. A view without a surface says why; one with a surface shows it."""
    server = StubServer()
    views = Views(server)
    colors = np.zeros((len(mesh().triangles), 3), dtype=np.uint8)
    for name in ("change", "base"):
        views.show(name, mesh(), colors)
    assert server.state.filled == ["base", "change"]
    views.clear("base")
    assert server.state.filled == ["change"]
