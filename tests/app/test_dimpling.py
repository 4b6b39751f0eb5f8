"""The dimpling part of the page without a browser: pushes, the way back, comparisons, depths."""

from __future__ import annotations

import asyncio
import threading

import numpy as np
import pytest
import scipy.linalg
from matplotlib import colormaps
from stubs import (
    StubExploring,
    StubGateway,
    StubServer,
    StubViews,
    held,
    in_loop,
    settings_of,
    settled,
    stub_jobs,
)

import isovary as iv
from isovary.app import _dimpling
from isovary.app._dimple_change import change_between
from isovary.app._dimple_depth import strength_for
from isovary.app._dimpling import Dimpling
from isovary.app._jobs import Failed, Finished, Progress
from isovary.app._opened_result import offer
from isovary.app._painting import drawn
from isovary.difference import heat_trace_scale
from isovary.errors import ArgumentError, FileError
from isovary.view._tessellate import at_pieces

NORTH, EAST = np.array([0.0, 0, 1]), np.array([1.0, 0, 0])
SPHERE, TORUS = iv.icosphere(3, order=1), iv.torus(1.0, 0.4, (24, 10), order=1)
OTHER = iv.ellipsoid((1, 1, 2), 3, order=1)


class Part:
    """The dimpling part on stubs, with surfaces of few nodes."""

    def __init__(self, folder, monkeypatch):
        monkeypatch.setitem(_dimpling.SHAPES, "sphere", lambda fine, order: SPHERE)
        monkeypatch.setitem(_dimpling.SHAPES, "torus", lambda fine, order: TORUS)
        monkeypatch.setattr(_dimpling, "read_surface", self.read)
        self.files = {}
        self.jobs = stub_jobs(monkeypatch)
        self.server, self.views = StubServer(part="dimple"), StubViews()
        self.exploring, self.gateway = StubExploring(), StubGateway()
        self.settings = settings_of(folder)
        self.dimpling = Dimpling(
            self.server, self.views, self.settings, self.gateway.turns, self.exploring
        )
        self.server.begin()
        self.state, self.folder = self.server.state, self.settings.folder

    def read(self, path):
        """What reads a file that was sent; a callable is asked."""
        found = self.files[path.name]
        return found() if callable(found) else found

    async def send(self, found, name="mine.obj"):
        path = self.folder / "in" / f"{len(self.files):032x}.obj"
        self.files[path.name] = found
        await self.dimpling.uploaded("surface", path, name)

    async def push(self, center=NORTH, radius=0.6, **values):
        self.dimpling.pick(np.asarray(center))
        self.server.browser_sets(radius=radius, **values)
        with self.state:
            await self.dimpling.deform()

    async def compare(self):
        """Press the button; returns the job."""
        with self.state:
            await self.dimpling.compare()
        await settled()
        return self.jobs[-1]

    def press(self, button):
        with self.state:
            getattr(self.dimpling, button)()

    @property
    def seen(self):
        """Colours of the change, its title and the ends of its key."""
        key = self.state.keys["change"]
        title = self.state.titles["change"]
        return self.views.colors["change"].tobytes(), title, key["low"], key["high"], key["unit"]

    def shows(self, surface):
        """Whether both views show this surface."""
        points = drawn(surface).points
        return all(
            np.array_equal(self.views.meshes[name].points, points)
            for name in ("perturbed", "change")
        )


@pytest.fixture
def part(tmp_path, monkeypatch):
    return Part(tmp_path, monkeypatch)


def made_here(_surface, _quality, folder, **_):
    """What save_mesh leaves, without a mesh."""
    folder.mkdir(exist_ok=True)
    (folder / "mesh.vtu").write_text("made here")


def pushed(surface=SPHERE, center=NORTH, radius=0.6, **numbers):
    nearest = surface.points[np.linalg.norm(surface.points - center, axis=1).argmin()]
    return iv.dimple(surface, nearest, radius, **numbers)


def norms():
    """An answer of a comparison: nothing but growing numbers."""
    return np.linspace(0.0, 0.125, len(SPHERE.points))


@in_loop
async def test_a_push_is_a_dimple(part):
    """Oracle: other package. The points of isovary.dimple with the numbers of the page."""
    part.dimpling.enter()
    assert part.shows(SPHERE)
    await part.push(alpha=7.0, charge=-1.0, decay=0.4, steps=12)
    made = pushed(alpha=7.0, charge=-1.0, decay=0.4, steps=12)
    assert part.shows(made)
    moved = np.linalg.norm(made.points - SPHERE.points, axis=1)
    assert f"{(moved > 0).sum()} of 642 nodes" in part.state.moved_words
    assert (part.state.pushes, part.state.can_undo, part.state.can_redo) == (1, True, False)
    assert "--alpha 7" in part.state.dimple_command


@in_loop
async def test_the_displacement_is_painted_along_the_normal(part):
    """Oracle: analytic. Blue where pushed in, red where drawn out, the ends of the key alike."""
    part.dimpling.enter()
    assert len(np.unique(part.views.colors["change"], axis=0)) == 1  # nothing moved
    for charge, side in ((1.0, -1), (-1.0, 1)):
        await part.push(charge=charge)
        colors = part.views.colors["change"].astype(int)
        red = colors[:, 0] - colors[:, 2]
        middles = part.views.meshes["change"].points[part.views.meshes["change"].triangles]
        top = np.linalg.norm(middles.mean(axis=1) - NORTH, axis=1).argmin()
        assert np.sign(red[top]) == side
        key = part.state.keys["change"]
        assert float(key["low"]) == -float(key["high"]) != 0
        part.press("undo")


@in_loop
async def test_a_comparison_is_painted(part):
    """Oracle: other package. matplotlib's viridis from 0 to the largest, in percent."""
    part.dimpling.enter()
    await part.push()
    job = await part.compare()
    assert job.function is change_between
    assert job.arguments[0] is SPHERE
    np.testing.assert_array_equal(job.arguments[1].points, pushed().points)
    assert part.exploring.told == ["pause"]
    job.tell(Progress("eigenpairs of the start", 0.0, 0.1, None))
    await settled()
    assert part.state.comparing_dimple
    assert part.state.dimple_stage == "eigenpairs of the start"
    before = part.seen
    job.tell(Finished(norms(), 3.0))
    await settled()
    assert not part.state.comparing_dimple
    surface = drawn(pushed())
    share = at_pieces(surface.surface, surface.split, norms()) / 0.125
    expected = np.round(255 * colormaps["viridis"](share)[:, :3])
    np.testing.assert_array_equal(part.views.colors["change"], expected)
    _, title, low, high, unit = part.seen
    assert (float(low), float(high)) == (0.0, 12.5)
    assert "%" in unit
    assert title != before[1]
    assert part.shows(pushed())
    assert part.exploring.told == ["pause", "find_groups"]


@pytest.mark.parametrize("way", ["undo", "push", "shape", "upload", "undo and redo"])
@in_loop
async def test_a_late_comparison_is_not_painted_on_another_surface(part, way):
    """Oracle: definition. What the views show belongs to the surface; nothing compares any more."""
    part.dimpling.enter()
    await part.push()
    job = await part.compare()
    if way == "push":
        await part.push(EAST)
    elif way == "shape":
        part.server.browser_sets(shape="torus")
    elif way == "upload":
        await part.send(OTHER)
    else:
        for button in way.split(" and "):
            part.press(button)
    assert not part.state.comparing_dimple
    before, shown = part.seen, part.views.meshes["change"]
    part.views.calls.clear()
    job.tell(Finished(norms(), 3.0))
    await settled()
    assert part.views.calls == []
    assert part.seen == before
    assert part.views.meshes["change"] is shown
    part.dimpling.enter()  # nor later
    assert part.seen == before
    assert not part.state.comparing_dimple
    assert part.exploring.told == ["pause", "find_groups"]


@in_loop
async def test_undo_and_redo_show_the_change_of_their_own_surface(part):
    """Oracle: inverse. Displacements as before the comparison, and nothing moved at the start."""
    part.dimpling.enter()
    start = part.seen
    await part.push()
    one = part.seen
    await part.push(EAST)
    two = part.seen
    assert len({start, one, two}) == 3
    job = await part.compare()
    job.tell(Finished(norms(), 3.0))
    await settled()
    compared = part.seen
    assert compared not in (start, one, two)
    for button, expected in (("undo", one), ("undo", start), ("redo", one), ("redo", two)):
        part.press(button)
        assert part.seen == expected
    assert part.shows(iv.dimple(SPHERE, [NORTH, EAST], 0.6))


@pytest.mark.parametrize("elsewhere", ["explore", "compare"])
@in_loop
async def test_other_parts_are_not_drawn_over(part, elsewhere):
    """Oracle: definition. Late answers wait until the part is entered again."""
    part.dimpling.enter()
    await part.push()
    job = await part.compare()
    part.server.browser_sets(part=elsewhere)
    part.views.calls.clear()
    job.tell(Finished(norms(), 3.0))
    await settled()
    assert part.views.calls == []
    part.server.browser_sets(part="dimple")
    part.dimpling.enter()
    assert float(part.state.keys["change"]["high"]) == 12.5
    assert part.shows(pushed())
    part.server.browser_sets(part=elsewhere)
    part.views.calls.clear()
    keys = dict(part.state.keys)
    await part.send(OTHER)
    part.press("undo")
    part.server.browser_sets(radius=0.3)
    assert part.views.calls == []
    assert part.state.keys == keys
    part.server.browser_sets(part="dimple")
    part.dimpling.enter()
    assert part.shows(OTHER)


@in_loop
async def test_a_failed_or_cancelled_comparison(part):
    """Oracle: definition. Words, or none; what is painted stays, and one may compare again."""
    part.dimpling.enter()
    with part.state:
        await part.dimpling.compare()  # nothing was pushed
    await settled()
    assert part.jobs == []
    await part.push()
    before = part.seen
    job = await part.compare()
    job.tell(Failed("too large"))
    await settled()
    assert (part.state.dimple_problem, part.state.comparing_dimple) == ("too large", False)
    job = await part.compare()
    await part.dimpling.cancel()
    assert not job.running
    assert not part.state.comparing_dimple
    assert part.seen == before
    assert part.exploring.told == ["pause", "find_groups"] * 2
    job = await part.compare()
    await part.dimpling.close()
    assert not job.running


@in_loop
async def test_an_uploaded_surface_is_told_by_its_own_name(part):
    """Oracle: definition. Its name beside the views and in the command; no path of ours."""
    part.dimpling.enter()
    await part.push()
    await part.send(OTHER, "my surface.obj")
    assert (part.state.shape, part.state.shape_name) == ("", "my surface.obj")
    assert (part.state.pushes, part.state.can_undo, part.state.center) == (0, False, None)
    assert part.shows(OTHER)
    await part.push(EAST)
    assert "my_surface.obj" in part.state.dimple_command
    assert str(part.folder) not in part.state.dimple_command

    def broken():
        path = part.folder / "in" / list(part.files)[-1]
        raise FileError("F06", f"{path}: expected triangles, got none; write it again")

    await part.send(broken, "broken.obj")
    assert part.state.dimple_problem.startswith("broken.obj: expected triangles")
    assert part.state.shape_name == "my surface.obj"  # which is still there
    assert part.state.pushes == 1


@in_loop
async def test_without_a_centre_nothing_is_pushed(part):
    """Oracle: definition. Words that ask for a click; another surface asks for another click."""
    part.dimpling.enter()
    await part.dimpling.deform()
    assert part.state.dimple_problem.startswith("center: expected a click")
    part.dimpling.pick(np.array([0.1, 0.1, 3.0]))
    away = np.linalg.norm(SPHERE.points - [0.1, 0.1, 3.0], axis=1)
    assert part.state.center == list(SPHERE.points[away.argmin()])
    part.server.browser_sets(shape="torus")
    assert part.state.center is None


@in_loop
async def test_the_rim_of_the_next_dimple_is_drawn(part):
    """Oracle: analytic. Its points are a radius away from the centre, in both views."""
    part.dimpling.enter()
    assert len(part.views.strokes["change"]) == 0
    part.dimpling.pick(NORTH)
    for radius in (0.6, 0.3):
        part.server.browser_sets(radius=radius)
        for name in ("perturbed", "change"):
            away = np.linalg.norm(part.views.strokes[name] - NORTH, axis=2)
            np.testing.assert_allclose(away, radius, rtol=1e-9)
    part.server.browser_sets(radius=1e-9)  # too small for any node but the centre
    part.server.browser_sets(radius=0)
    assert part.state.dimple_problem.startswith("radius")


@in_loop
async def test_a_depth_is_reached(part):
    """Oracle: definition. The farthest node moves so far; the strength that does it is shown."""
    part.dimpling.enter()
    await part.push(depth="0.05")
    made = part.views.meshes["perturbed"].points
    moved = np.linalg.norm(made - drawn(SPHERE).points, axis=1).max()
    assert moved == pytest.approx(0.05, rel=2e-3)
    assert part.state.alpha == pytest.approx(strength_for(SPHERE, NORTH, 0.6, 0.05), rel=1e-3)


@pytest.mark.parametrize("depth", ["deep", "0,05", "-1", "nan", "5"])
@in_loop
async def test_a_depth_that_is_none_is_told(part, depth):
    """Oracle: definition. Words about the depth, and no dimple; an empty one asks for none."""
    part.dimpling.enter()
    await part.push(depth=depth)
    assert part.state.dimple_problem.startswith("depth: expected")
    assert part.state.pushes == 0
    await part.push(depth="  ")
    assert (part.state.dimple_problem, part.state.pushes) == ("", 1)


@pytest.mark.parametrize("way", ["undo", "upload"])
@in_loop
async def test_a_depth_found_late_moves_no_other_surface(part, monkeypatch, way):
    """Oracle: definition. The surface that it was asked for is not there any more."""
    part.dimpling.enter()
    await part.push()
    slow, asked, answer = held(5.0)
    monkeypatch.setattr(_dimpling, "strength_for", slow)
    pushing = asyncio.ensure_future(part.push(EAST, depth="0.05"))
    await asyncio.to_thread(asked.wait, 30)
    if way == "undo":
        part.press("undo")
    else:
        await part.send(OTHER)
    before = part.seen
    answer.set()
    await pushing
    assert part.state.pushes == 0
    assert part.seen == before


@in_loop
async def test_numbers_that_turn_triangles_over_are_told(part):
    """Oracle: definition. The code of isovary.dimple; the surface stays."""
    part.dimpling.enter()
    await part.push(alpha=4000.0)
    assert part.state.dimple_problem.endswith("[M03]")
    assert part.shows(SPHERE)
    await part.push(alpha=5.0, steps=10**6)
    assert part.state.dimple_problem.startswith("steps: expected at most")
    assert part.shows(SPHERE)


@in_loop
async def test_what_is_saved_is_what_is_shown(part, monkeypatch):
    """Oracle: definition. Points, displacement, command and script of the surface shown."""
    wrote = []

    def write(surface, _quality, folder, *, arrays, **_):
        wrote.append((surface.points, arrays["displacement"]))
        folder.mkdir(exist_ok=True)
        (folder / "mesh.vtu").write_text("a grid")

    monkeypatch.setattr(_dimpling, "save_mesh", write)
    part.dimpling.enter()
    await part.push()
    await part.dimpling.save()
    np.testing.assert_array_equal(wrote[0][0], pushed().points)
    np.testing.assert_array_equal(wrote[0][1], pushed().points - SPHERE.points)
    names = [file["name"] for file in part.state.dimple_files]
    assert names == ["dimpled.vtu", "dimple.sh", "dimple.py"]
    assert sorted(names) == sorted(path.name for path in (part.folder / "out").iterdir())
    program = (part.folder / "out" / "dimple.py").read_text()
    assert f"iv.dimple(surface, [{NORTH.tolist()}], radius=0.6" in program
    assert (part.folder / "out" / "dimple.sh").read_text() == part.state.dimple_command
    part.press("undo")
    assert part.state.dimple_files == []  # those belong to the other surface


@in_loop
async def test_what_was_sent_is_saved_with_the_rest(part, monkeypatch):
    """Oracle: definition. The command reads a file of that name, so it is offered beside it."""
    monkeypatch.setattr(_dimpling, "save_mesh", made_here)
    await part.send(OTHER, "my surface.obj")
    (part.folder / "in" / next(iter(part.files))).write_text("o mine")
    part.dimpling.enter()
    await part.push(EAST)
    await part.dimpling.save()
    assert (part.folder / "out" / "my_surface.obj").read_text() == "o mine"
    assert {"name": "my_surface.obj", "size": "6 B"} in part.state.dimple_files
    for name in ("dimple.sh", "dimple.py"):
        assert str(part.folder) not in (part.folder / "out" / name).read_text()


@pytest.mark.parametrize(
    ("surface", "center", "radius", "share", "numbers"),
    [
        (SPHERE, NORTH, 0.6, 0.01, {}),
        (SPHERE, NORTH, 0.6, 0.08, {}),
        (SPHERE, EAST, 0.8, 0.05, {"charge": -1.0, "decay": 0.5, "steps": 12}),
        (TORUS, np.array([1.4, 0, 0]), 1.1, 0.03, {"charge": 0.5}),
    ],
)
def test_the_strength_gives_the_depth(surface, center, radius, share, numbers):
    """Oracle: other package. isovary.dimple of that alpha moves the tip so far, to 1 in 1000."""
    alpha = strength_for(surface, center, radius, share * radius, **numbers)
    made = iv.dimple(surface, center, radius, alpha=alpha, **numbers)
    moved = np.linalg.norm(made.points - surface.points, axis=1).max()
    assert moved == pytest.approx(share * radius, rel=1.1e-3)


@pytest.mark.parametrize("depth", [0.0, -0.1, np.nan, np.inf, 5.0])
def test_depths_that_cannot_be_reached_are_refused(depth):
    """Oracle: definition. A02 with the depth; nothing moves by five radii of the sphere."""
    with pytest.raises(ArgumentError, match="depth: expected") as told:
        strength_for(SPHERE, NORTH, 0.6, depth)
    assert told.value.code == "A02"
    assert f"{depth:g}" in str(told.value)


def test_the_change_is_that_of_a_dense_solver():
    """Oracle: brute force. Heat kernel signatures from all eigenpairs of dense matrices.

    The scale is the base's heat trace over its area, the norm the mean of absolute values.
    """
    base = iv.ellipsoid((1, 1.3, 1.7), 2, order=1)
    moved = iv.dimple(base, base.points[0], 1.2)
    told = []
    found = change_between(base, moved, lambda stage, done: told.append((stage, done)))
    assert [done for _, done in told] == [0.0, 0.5]
    assert len({stage for stage, _ in told}) == 2
    pairs = iv.eigenpairs(iv.fem(base), len(base.points) // 4)
    times = iv.diffusion_times(pairs, 60)
    signatures, scales = [], []
    for surface in (base, moved):
        laplacian = iv.fem(surface)
        values, functions = scipy.linalg.eigh(
            laplacian.stiffness.toarray(), laplacian.mass.toarray()
        )
        values, functions = values[: len(pairs.values)], functions[:, : len(pairs.values)]
        decay = np.exp(-np.outer(values, times))
        signatures.append(functions**2 @ decay)
        scales.append(decay.sum(axis=0) / laplacian.mass.sum())
    expected = np.abs((signatures[0] - signatures[1]) / scales[0]).mean(axis=1)
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-7)
    np.testing.assert_allclose(scales[0], heat_trace_scale(pairs, times), rtol=1e-6)
    assert found.max() > 1e-3


def test_no_change_of_what_was_only_turned():
    """Oracle: symmetry. The signature is intrinsic: a turn and a shift change nothing."""
    base = iv.ellipsoid((1, 1.3, 1.7), 2, order=1)
    turn = scipy.linalg.expm(np.cross(np.eye(3), [0.3, -0.8, 0.5]))
    moved = iv.Surface(base.points @ turn + [3.0, 1, 2], base.triangles)
    assert change_between(base, moved, lambda *_: None).max() < 1e-6


@in_loop
async def test_cancel_while_the_dimples_comparison_begins(part, monkeypatch):
    """Oracle: definition. What is cancelled before it began does not run."""
    part.dimpling.enter()
    await part.push()
    gate = asyncio.Event()

    async def pause():
        await gate.wait()

    monkeypatch.setattr(part.exploring, "pause", pause)
    run = asyncio.ensure_future(part.dimpling.compare())
    await settled()
    await part.dimpling.cancel()
    gate.set()
    await run
    await settled()
    assert not part.jobs


@in_loop
async def test_a_slower_earlier_surface_does_not_replace_a_later_one(part):
    """Oracle: definition. The surface is the one that was sent last."""
    part.dimpling.enter()
    slow, asked, answer = held(TORUS)
    first = asyncio.ensure_future(part.send(slow, "slow.obj"))
    await asyncio.to_thread(asked.wait, 30)
    await part.send(OTHER, "later.obj")
    answer.set()
    await first
    assert part.state.shape_name == "later.obj"
    assert part.shows(OTHER)


@in_loop
async def test_a_slower_surface_does_not_replace_a_shape_chosen_later(part):
    """Oracle: definition. The surface is the one that was sent last."""
    part.dimpling.enter()
    slow, asked, answer = held(OTHER)
    first = asyncio.ensure_future(part.send(slow, "slow.obj"))
    await asyncio.to_thread(asked.wait, 30)
    part.server.browser_sets(shape="torus")
    answer.set()
    await first
    assert part.shows(TORUS)


@in_loop
async def test_a_depth_is_pushed_where_it_was_asked_for(part, monkeypatch):
    """Oracle: definition. A click while the strength is sought is for the next dimple."""
    part.dimpling.enter()
    slow, asked, answer = held(5.0)
    monkeypatch.setattr(_dimpling, "strength_for", slow)
    pushing = asyncio.ensure_future(part.push(NORTH, depth="0.05"))
    await asyncio.to_thread(asked.wait, 30)
    assert part.state.deforming
    part.dimpling.pick(EAST)
    answer.set()
    await pushing
    assert not part.state.deforming
    assert part.shows(pushed(SPHERE, NORTH))


@in_loop
async def test_deform_pressed_twice(part, monkeypatch):
    """Oracle: definition. One dimple: the second push finds a surface that has changed."""
    part.dimpling.enter()
    answer = threading.Event()

    def slow(*_, **__):
        answer.wait(30)
        return 5.0

    monkeypatch.setattr(_dimpling, "strength_for", slow)
    pushing = [asyncio.ensure_future(part.push(NORTH, depth="0.05")) for _ in range(2)]
    await settled()
    answer.set()
    await asyncio.gather(*pushing)
    assert part.state.pushes == 1


@in_loop
async def test_a_surface_sent_under_the_results_name_does_not_replace_it(part, monkeypatch):
    """Oracle: definition. A saved result sent again, to go on, is not what is saved."""
    monkeypatch.setattr(_dimpling, "save_mesh", made_here)
    await part.send(OTHER, "dimpled.vtu")
    (part.folder / "in" / next(iter(part.files))).write_text("sent")
    part.dimpling.enter()
    await part.push(EAST)
    await part.dimpling.save()
    names = [file["name"] for file in part.state.dimple_files]
    assert len(set(names)) == len(names)
    assert (part.folder / "out" / "dimpled.vtu").read_text() == "made here"


@in_loop
async def test_a_late_failure_is_not_told_of_another_surface(part):
    """Oracle: definition. What failed belongs to a surface that is not shown any more."""
    part.dimpling.enter()
    await part.push()
    job = await part.compare()
    part.press("undo")
    job.tell(Failed("the process ended"))
    await settled()
    assert part.state.dimple_problem == ""


@in_loop
async def test_words_about_a_radius_go_with_it(part):
    """Oracle: definition. A radius that is well again has no problem."""
    part.dimpling.enter()
    part.dimpling.pick(NORTH)
    part.server.browser_sets(radius=0)
    assert part.state.dimple_problem
    part.server.browser_sets(radius=0.5)
    assert part.state.dimple_problem == ""


def test_strengths_that_are_tried_warn_of_nothing():
    """Oracle: definition. Only the dimple that is made may be doubtful."""
    with pytest.raises(ArgumentError):
        strength_for(SPHERE, NORTH, 0.6, 5.0)


@in_loop
async def test_a_late_fault_of_an_earlier_surface_is_not_told(part):
    """Oracle: definition. Nor does a broken later one keep a good earlier one away."""
    part.dimpling.enter()
    cases = (_broken, lambda: OTHER, "b.obj"), (lambda: OTHER, _broken, "a.obj")
    for first, second, shown in cases:
        answer = threading.Event()

        def slow(made=first, answer=answer):
            answer.wait(30)
            return made()

        earlier = asyncio.ensure_future(part.send(slow, "a.obj"))
        await settled()
        await part.send(second, "b.obj")
        answer.set()
        await earlier
        assert part.state.shape_name == shown
        assert part.state.dimple_problem == ""
        part.server.browser_sets(shape="torus")


def _broken():
    raise FileError("F04", "upload: expected a surface, got none")


@pytest.mark.parametrize("name", ["change.vtu", "perturbed.vtu", "mine.obj"])
@in_loop
async def test_a_save_leaves_the_files_of_a_result_alone(part, monkeypatch, name):
    """Oracle: data. Downloads are links to the reader's own files: none is written through."""
    monkeypatch.setattr(_dimpling, "save_mesh", made_here)
    own = part.folder / "result"
    own.mkdir()
    names = {name, "dimpled.vtu", "dimple.sh", "dimple.py"}
    for each in names:
        (own / each).write_text("the reader's own")
    offer(own, part.folder / "out")
    await part.send(OTHER, name)
    (part.folder / "in" / next(iter(part.files))).write_text("sent")
    part.dimpling.enter()
    await part.push(EAST)
    await part.dimpling.save()
    assert part.state.dimple_problem == ""
    assert {(own / each).read_text() for each in names} == {"the reader's own"}


@in_loop
async def test_another_surface_ends_the_comparison(part):
    """Oracle: definition. Nobody waits for its answer: its place is free."""
    part.dimpling.enter()
    await part.push()
    job = await part.compare()
    await part.push(EAST)
    await settled()
    assert not job.running


@in_loop
async def test_a_comparison_does_not_take_words_away(part):
    """Oracle: definition. What could not be pushed is told until something else is done."""
    part.dimpling.enter()
    await part.push()
    job = await part.compare()
    await part.push(EAST, steps=5000)
    assert "steps" in part.state.dimple_problem
    job.tell(Finished(norms(), 1.0))
    await settled()
    assert "steps" in part.state.dimple_problem
