"""The comparing part of the page without a browser: files, isovalue, choices, a run and its end."""

from __future__ import annotations

import asyncio

import numpy as np
import pytest
from stubs import (
    StubExploring,
    StubGateway,
    StubServer,
    StubViews,
    in_loop,
    npy,
    settings_of,
    settled,
    stub_jobs,
)

from isovary.app import _comparing
from isovary.app._comparing import Comparing
from isovary.app._jobs import Cancelled, Failed, Finished, Progress, compare_files_job
from isovary.app._opened_field import OpenedField, preview


def grid(count=9):
    return np.meshgrid(*[np.linspace(-1.5, 1.5, count)] * 3, indexing="ij")


def sphere(scale=1.0):
    return scale * np.sqrt(sum(axis**2 for axis in grid()))


def field(edges, values=None, name="density", bad=0):
    """An opened field with this histogram."""
    edges = np.asarray(edges, dtype=float)
    return OpenedField(
        name=name,
        array=None,
        arrays=(),
        values=sphere() if values is None else values,
        spacing=np.ones(3),
        origin=np.zeros(3),
        counts=np.ones(len(edges) - 1, int),
        edges=edges,
        logarithmic=bool(edges[0] > 0 and not np.allclose(np.diff(edges, 2), 0)),
        isovalue=float(edges[len(edges) // 3]),
        reason="",
        bad=bad,
    )


class Part:
    """The comparing part on stubs."""

    def __init__(self, folder, monkeypatch, part="compare", **settings):
        self.jobs = stub_jobs(monkeypatch, _comparing)
        self.server, self.views = StubServer(part=part), StubViews()
        self.exploring, self.gateway = StubExploring(), StubGateway()
        self.settings = settings_of(folder, **settings)
        self.comparing = Comparing(
            self.server, self.views, self.settings, self.gateway.turns, self.exploring
        )
        self.folder, self.state = self.settings.folder, self.server.state
        self.server.begin()

    def send(self, role, name):
        """A file comes from the browser; returns what reads it."""
        path = self.folder / "in" / f"{len(self.jobs):032x}.npy"
        self.reading = asyncio.ensure_future(self.comparing.uploaded(role, path, name))
        return path

    async def take(self, role, found, name="a.npy"):
        """The same, read at once."""
        path = self.send(role, name)
        await settled()
        self.jobs[-1].tell(Finished(found, 0.1))
        await self.reading
        await settled()
        return path

    async def ready(self):
        """Both fields, at an isovalue of 1; returns their paths."""
        paths = [await self.take("base", field(np.linspace(0, 2, 65)), "first.npy")]
        paths.append(await self.take("perturbed", field(np.linspace(0, 2, 65)), "second.npy"))
        await self.set(isovalue="1")
        return paths

    async def set(self, **values):
        self.server.browser_sets(**values)
        await settled()

    async def run(self):
        """Press the button; returns the job, or None if none started."""
        before = len(self.jobs)
        with self.state:
            await self.comparing._run()
        await settled()
        return self.jobs[-1] if len(self.jobs) > before else None


@pytest.fixture
def part(tmp_path, monkeypatch):
    return Part(tmp_path, monkeypatch)


@in_loop
async def test_two_fields_can_be_compared(part):
    """Oracle: definition. One alone cannot; the run has both paths, the isovalue, the choices."""
    assert not part.state.ready_to_run
    assert await part.run() is None
    await part.take("base", field(np.linspace(0, 2, 65)))
    assert not part.state.ready_to_run
    assert await part.run() is None
    base, perturbed = await part.ready()
    assert part.state.ready_to_run
    job = await part.run()
    assert job.function is compare_files_job
    assert job.arguments[:3] == (base, perturbed, 1.0)
    assert job.arguments[3].items() >= {"groups": 3, "order": 2}.items()
    assert "array" not in job.arguments[3]
    assert job.arguments[4].parent == part.folder
    assert part.state.running
    assert part.exploring.told == ["pause"]
    assert await part.run() is None  # one at a time


@in_loop
async def test_a_slower_earlier_file_does_not_replace_a_later_one(part):
    """Oracle: definition. Whatever comes first, the field is that of the file taken last."""
    await part.take("perturbed", field(np.linspace(0, 2, 65)))
    part.send("base", "slow.npy")
    slow = part.reading
    await settled()
    later = part.send("base", "later.npy")
    await settled()
    part.jobs[2].tell(Finished(field(np.linspace(0, 8, 65), name="later"), 0.1))
    await settled()
    words, isovalue = part.state.base_facts, part.state.isovalue
    histogram = part.state.histogram
    assert words.startswith("later: ")
    part.jobs[1].tell(Finished(field(np.linspace(0, 1, 65), name="slow"), 9.0))
    await asyncio.gather(slow, part.reading)
    await settled()
    assert part.state.base_name == "later.npy"
    assert (part.state.base_facts, part.state.isovalue) == (words, isovalue)
    assert part.state.histogram == histogram
    job = await part.run()
    assert job.arguments[0] == later


@in_loop
async def test_a_slower_earlier_failure_is_not_told(part):
    """Oracle: definition. The file that failed is no longer asked for; the later one stays."""
    await part.take("perturbed", field(np.linspace(0, 2, 65)))
    part.send("base", "slow.npy")
    await settled()
    part.send("base", "later.npy")
    await settled()
    part.jobs[2].tell(Finished(field(np.linspace(0, 8, 65)), 0.1))
    await settled()
    part.jobs[1].tell(Failed("slow.npy: expected numbers, got none [F06]"))
    await settled()
    assert part.state.run_problem == ""
    assert part.state.base_name == "later.npy"
    assert part.state.ready_to_run


@in_loop
async def test_both_roles_are_read_at_once(part):
    """Oracle: definition. A file for one role does not put off the other role's."""
    part.send("base", "one.npy")
    await settled()
    part.send("perturbed", "two.npy")
    await settled()
    for job in part.jobs:
        job.tell(Finished(field(np.linspace(0, 2, 65)), 0.1))
        await settled()
    assert part.state.ready_to_run
    assert (part.state.base_name, part.state.perturbed_name) == ("one.npy", "two.npy")


@pytest.mark.parametrize("role", ["base", "perturbed"])
@in_loop
async def test_while_a_file_is_read_nothing_runs(part, role):
    """Oracle: definition. The earlier file is not run in place of the one that was taken."""
    await part.ready()
    part.send(role, "other.npy")
    await settled()
    assert not part.state.ready_to_run
    before = len(part.jobs)
    assert await part.run() is None
    assert len(part.jobs) == before
    part.jobs[-1].tell(Cancelled())
    await settled()
    assert part.state.run_problem


@pytest.mark.parametrize("role", ["base", "perturbed"])
@in_loop
async def test_a_failed_read_leaves_no_earlier_file_behind(part, role):
    """Oracle: definition. Told by the file's own name; no path, no run, until another is read."""
    await part.ready()
    path = part.send(role, "my file.npy")
    await settled()
    path.write_bytes(b"\x93NUMPY")
    part.jobs[-1].run()
    await settled()
    words = part.state.run_problem
    assert words.startswith("my file.npy")
    assert "expected" in words
    assert str(part.folder) not in words
    assert path.name not in words
    assert part.state[f"{role}_name"] == part.state[f"{role}_facts"] == ""
    assert not part.state.ready_to_run
    assert await part.run() is None
    await part.take(role, field(np.linspace(0, 2, 65)))
    assert part.state.ready_to_run
    assert part.state.run_problem == ""


@pytest.mark.parametrize("role", ["base", "perturbed"])
@in_loop
async def test_values_that_are_not_finite_are_told_and_not_run(part, role):
    """Oracle: definition. I01 by name, although it is shown; another file for it mends that."""
    await part.ready()
    await part.take(role, field(np.linspace(0, 2, 65), bad=3), "holes.npy")
    assert "holes.npy" in part.state.run_problem
    assert "[I01]" in part.state.run_problem
    assert "3 without a value" in part.state[f"{role}_facts"]
    assert not part.state.ready_to_run
    assert await part.run() is None
    other = "perturbed" if role == "base" else "base"
    await part.take(other, field(np.linspace(0, 2, 65)), "good.npy")
    assert "holes.npy" in part.state.run_problem  # still
    assert "good.npy" not in part.state.run_problem
    assert not part.state.ready_to_run
    await part.take(role, field(np.linspace(0, 2, 65)))
    assert part.state.run_problem == ""
    assert part.state.ready_to_run


RANGES = {
    "linear": np.linspace(0, 2.6, 65),
    "around zero": np.linspace(-3e-5, 1e-5, 65),
    "logarithmic": np.geomspace(1e-7, 40, 65),
    "far from zero": np.linspace(1e6, 1e6 + 0.5, 65),
    "far below zero": np.linspace(-1e9 - 20, -1e9, 65),
}


@pytest.mark.parametrize("name", RANGES)
@in_loop
async def test_slider_and_number_agree(part, name):
    """Oracle: inverse. A position gives a number that gives that position; all of them differ."""
    edges = RANGES[name]
    await part.take("base", field(edges))
    numbers = []
    for place in [*range(0, 1001, 7), 1, 999, 1000]:
        await part.set(slide=place)
        assert part.state.slide == place
        number = part.state.isovalue
        numbers.append((place, float(number)))
        await part.set(slide=0 if place > 500 else 1000)
        await part.set(isovalue=number)
        assert part.state.slide == place
        assert part.state.isovalue == number
    values = [number for _, number in sorted(numbers)]
    assert (np.diff(values) > 0).all()
    width = edges[-1] - edges[0]
    assert values[0] == pytest.approx(edges[0], abs=1e-3 * width)
    assert values[-1] == pytest.approx(edges[-1], abs=1e-3 * width)


@in_loop
async def test_a_typed_number_stays_as_it_was_typed(part):
    """Oracle: definition. The slider goes to its nearest position, and changes nothing typed."""
    await part.take("base", field(np.linspace(0, 2, 65)))
    for text, place in (("1.000123", 500), ("0.5004", 250), ("99", 1000), ("-1", 0)):
        await part.set(isovalue=text)
        assert (part.state.isovalue, part.state.slide) == (text, place)


@pytest.mark.parametrize("text", ["", "abc", "0,05", "nan", "inf", "-", None, "1e999", "1 2"])
@in_loop
async def test_what_is_no_number_moves_no_slider(part, text):
    """Oracle: definition. Nothing fails, no surface is drawn, and the next number counts again."""
    await part.ready()
    assert set(part.views.meshes) == {"base", "perturbed"}
    await part.set(isovalue=text)
    assert part.state.slide == 500
    assert part.state.isovalue == text
    assert part.views.meshes == {}
    await part.set(isovalue="1.5")
    assert part.state.slide == 750
    assert set(part.views.meshes) == {"base", "perturbed"}
    await part.set(isovalue=text)
    await part.set(slide=500)
    assert float(part.state.isovalue) == pytest.approx(1.0, abs=2e-3)


@in_loop
async def test_the_preview_is_the_isosurface(part):
    """Oracle: analytic. Points at the isovalue's radius, up to the error of the lines between."""
    spheres = field(np.linspace(0, 2.6, 65))
    await part.take("base", spheres)
    for radius in (0.8, 1.2):
        await part.set(isovalue=str(radius))
        points = part.views.meshes["base"].points * 3 / 8 - 1.5
        away = np.linalg.norm(points, axis=1)
        assert np.abs(away - radius).max() < (3 / 8) ** 2 / 8 / (radius - 0.1)
    assert "perturbed" not in part.views.meshes
    assert part.state.preview_words.startswith("Base: one piece, closed.")


@pytest.mark.parametrize("elsewhere", ["explore", "dimple"])
@in_loop
async def test_other_parts_are_not_drawn_over(tmp_path, monkeypatch, elsewhere):
    """Oracle: definition. A field that is read late is drawn when its part is entered."""
    part = Part(tmp_path, monkeypatch, part=elsewhere)
    await part.ready()
    await part.set(isovalue="1.2")
    assert part.views.calls == []
    await part.set(part="compare")
    part.comparing.enter()
    assert set(part.views.meshes) == {"base", "perturbed"}
    part.views.calls.clear()
    part.server.browser_sets(isovalue="0.7")  # asked for here,
    part.server.browser_sets(part=elsewhere)  # and left before it was drawn
    await settled()
    assert part.views.calls == []


@in_loop
async def test_entering_without_a_field_shows_nothing(part):
    """Oracle: definition. What another part left in the views is gone."""
    part.views.meshes |= dict.fromkeys(("base", "perturbed"), "left")
    part.comparing.enter()
    assert part.views.meshes == {}


def test_preview_of_noise_has_a_bound():
    """Oracle: bound. 65^3 random samples have 1.3 million triangles, of which 600 000 may be
    drawn: every second sample is contoured."""
    noise = np.random.default_rng(1).random((65, 65, 65)).astype(np.float32)
    shown = preview(field(np.linspace(0, 1, 65), noise), 0.5)
    assert shown.stride == 2
    assert 0 < len(shown.triangles) <= 600_000
    assert "second" in shown.words
    assert preview(field(np.linspace(0, 1, 65), noise[::2, ::2, ::2]), 0.5).stride == 1


@pytest.mark.parametrize("text", ["many", "12.5", "1e3", "0x10", "1 000", "--"])
@in_loop
async def test_vertices_that_are_no_whole_number_are_refused(part, text):
    """Oracle: definition. In words, with what was typed; nothing runs."""
    await part.ready()
    await part.set(wanted_vertices=text)
    assert await part.run() is None
    assert part.state.run_problem.startswith("vertices: expected a whole number")
    assert f"got {text}" in part.state.run_problem
    assert not part.state.running
    assert part.exploring.told == []  # the search for groups goes on
    await part.set(wanted_vertices="900")
    job = await part.run()
    assert job.arguments[3]["vertices"] == 900
    assert part.state.run_problem == ""


@pytest.mark.parametrize("text", ["", "   ", None])
@in_loop
async def test_without_vertices_the_accuracy_decides(part, text):
    """Oracle: definition. Nothing typed, nothing passed; the other choices are."""
    await part.ready()
    await part.set(wanted_vertices=text, wanted_groups=5, wanted_order=1)
    job = await part.run()
    assert job.arguments[3].items() >= {"groups": 5, "order": 1}.items()
    assert "vertices" not in job.arguments[3]


@in_loop
async def test_an_array_is_chosen_for_both_roles(part):
    """Oracle: data. Both are read anew, of the array; what is taken later, too; the run is told."""
    for role in ("base", "perturbed"):
        path = part.send(role, f"{role}.npz").with_suffix(".npz")
        np.savez(path, p=sphere(), q=sphere(3.0))
        await settled()
        part.jobs[-1].arguments = path, part.jobs[-1].arguments[1]
        part.jobs[-1].run()
        await part.reading
    assert part.state.arrays == ["p", "q"]
    assert part.state.array == "p"
    assert (await part.run()).arguments[3]["array"] == "p"
    await part.comparing.close()
    paths = [job.arguments[0] for job in part.jobs[:2]]
    await part.set(array="q")
    for number, role in enumerate(("base", "perturbed")):
        job = part.jobs[3 + number]
        job.arguments = paths[number], job.arguments[1]
        job.run()
        await settled()
        assert part.state[f"{role}_facts"].startswith("q: ")
        assert part.state[f"{role}_name"] == f"{role}.npz"
    assert part.state.array == "q"
    assert len(part.jobs) == 5
    part.send("perturbed", "third.npz")
    await settled()
    part.jobs[-1].arguments = paths[0], part.jobs[-1].arguments[1]
    part.jobs[-1].run()
    await settled()
    assert part.state.perturbed_facts.startswith("q: ")
    assert (await part.run()).arguments[3]["array"] == "q"


@in_loop
async def test_files_of_the_folders_are_offered_and_read(tmp_path, monkeypatch):
    """Oracle: data. By their names below each folder; an array that is chosen counts here, too."""
    roots = tmp_path / "one", tmp_path / "two"
    for root in roots:
        (root / "deep").mkdir(parents=True)
    npy(roots[0] / "a.npy", sphere())
    np.savez(roots[1] / "deep" / "b.npz", p=sphere(), q=sphere(2.0))
    part = Part(tmp_path, monkeypatch, roots=roots)
    await part.comparing.list_files()
    assert [choice["title"] for choice in part.state.choices] == ["a.npy", "deep/b.npz"]
    await part.comparing._choose("base", part.state.choices[0]["value"])
    await part.set(array="q")
    await part.comparing._choose("perturbed", part.state.choices[1]["value"])
    assert (part.state.base_name, part.state.perturbed_name) == ("a.npy", "b.npz")
    assert part.state.perturbed_facts.startswith("q: ")
    assert part.state.ready_to_run
    assert part.jobs == []  # one's own files are read here
    (roots[0] / "a.npy").write_bytes(b"\x93NUMPY")
    await part.comparing._choose("base", part.state.choices[0]["value"])
    assert part.state.run_problem.startswith("a.npy")
    assert str(tmp_path) not in part.state.run_problem


@pytest.mark.parametrize("choice", ["0/../secret.npy", "1/a.npy", "x/a.npy", "", "0//etc/a.npy"])
@in_loop
async def test_files_outside_of_the_folders_are_refused(tmp_path, monkeypatch, choice):
    """Oracle: definition. Whatever a browser sends, nothing else is read, and no path told."""
    root = tmp_path / "root"
    root.mkdir()
    npy(tmp_path / "secret.npy", sphere())
    part = Part(tmp_path, monkeypatch, roots=(root,))
    await part.comparing._choose("base", choice)
    assert part.state.run_problem.startswith("file: expected one of the list")
    assert part.state.base_name == ""


@in_loop
async def test_progress_is_told_and_the_result_opened(part):
    """Oracle: definition. Position, stage, part done, time left; then the folder, for exploring."""
    await part.ready()
    job = await part.run()
    job.tell(Progress("eigenpairs", 0.456, 1.0, None))
    await settled()
    told = part.state.stage, part.state.stage_done, part.state.stage_words
    assert told == ("eigenpairs", 46, "")
    job.tell(Progress("noise", 0.9, 45.0, 5.2))
    await settled()
    assert part.state.stage_words == "about 5 s left"
    job.tell(Finished(job.arguments[4], 50.0))
    await settled()
    assert part.exploring.told == ["pause", job.arguments[4]]
    assert (part.state.running, part.state.stage, part.state.stage_words) == (False, "", "")
    assert part.state.ready_to_run
    other = await part.run()
    assert other.arguments[4] != job.arguments[4]  # a folder of its own


@in_loop
async def test_a_failed_run_is_told_by_the_files_names(part):
    """Oracle: definition. No path of ours; the search for groups goes on."""
    base, perturbed = await part.ready()
    job = await part.run()
    job.tell(Failed(f"{base}: unlike {perturbed}; crop one [F09]"))
    await settled()
    assert part.state.run_problem == "first.npy: unlike second.npy; crop one [F09]"
    assert not part.state.running
    assert part.exploring.told == ["pause", "find_groups"]


@in_loop
async def test_a_cancelled_run_opens_nothing(part):
    """Oracle: definition. Its process has ended, the groups are searched again, one may rerun."""
    await part.ready()
    await part.comparing._cancel()  # nothing runs
    assert part.state.stage_words == ""
    job = await part.run()
    await part.comparing._cancel()
    assert not job.running
    assert (part.state.running, part.state.stage_words) == (False, "cancelled")
    assert part.state.run_problem == ""
    assert part.exploring.told == ["pause", "find_groups"]
    assert await part.run() is not None
    await part.comparing.close()
    assert not part.jobs[-1].running


@pytest.mark.parametrize("role", ["base", "perturbed"])
@in_loop
async def test_a_failed_run_is_told_by_the_names_that_it_ran_with(part, role):
    """Oracle: definition. Another file was taken meanwhile."""
    base, perturbed = await part.ready()
    job = await part.run()
    await part.take(role, field(np.linspace(0, 2, 65)), "third.npy")
    job.tell(Failed(f"{base}: unlike {perturbed}; crop one [F09]"))
    await settled()
    assert part.state.run_problem == "first.npy: unlike second.npy; crop one [F09]"


@in_loop
async def test_a_failed_read_clears_its_preview(part):
    """Oracle: definition. A field that could not be read shows nothing of the one before."""
    await part.ready()
    part.send("base", "bad.npy")
    await settled()
    part.jobs[-1].tell(Failed("bad"))
    await settled()
    assert "base" not in part.views.meshes
    assert "Base" not in part.state.preview_words


@in_loop
async def test_nothing_chosen(part):
    """Oracle: definition. The list's own cross sends no name: nothing happens."""
    await part.comparing._choose("base", None)


@in_loop
async def test_run_pressed_twice(part, monkeypatch):
    """Oracle: definition. One run, also while the first still waits for the search to end."""
    await part.ready()
    gate = asyncio.Event()

    async def pause():
        await gate.wait()

    monkeypatch.setattr(part.exploring, "pause", pause)
    both = [asyncio.ensure_future(part.comparing._run()) for _ in range(2)]
    await settled()
    gate.set()
    await asyncio.gather(*both)
    await settled()
    asked = [n for n in part.gateway.notes if n.get("job") == "ask"]
    assert len(asked) == 1
    assert len(part.jobs) == 3


@in_loop
async def test_cancel_while_the_run_begins(part, monkeypatch):
    """Oracle: definition. What is cancelled before it began does not run."""
    await part.ready()
    gate = asyncio.Event()

    async def pause():
        await gate.wait()

    monkeypatch.setattr(part.exploring, "pause", pause)
    run = asyncio.ensure_future(part.comparing._run())
    await settled()
    assert part.state.running
    await part.comparing._cancel()
    gate.set()
    await run
    await settled()
    assert not part.state.running
    assert len(part.jobs) == 2


@in_loop
async def test_the_demo_does_not_replace_what_was_chosen_after_it(part):
    """Oracle: definition. A later file stays, and keeps its isovalue."""
    demo = asyncio.ensure_future(part.comparing._demo())
    await settled()
    await part.take("base", field(np.linspace(100, 200, 65)), "mine.npy")
    isovalue = part.state.isovalue
    await demo
    assert part.state.base_name == "mine.npy"
    assert part.state.isovalue == isovalue


@in_loop
async def test_the_choices_reach_the_run(part):
    """Oracle: definition. By the names of the command; an empty field passes nothing."""
    await part.ready()
    part.server.browser_sets(
        wanted_cluster="norm-bins", wanted_align=False, wanted_smooth="0.25", wanted_vertices="600"
    )
    job = await part.run()
    options = job.arguments[3]
    assert options["cluster"] == "norm-bins"
    assert options["align"] is False
    assert (options["smooth"], options["vertices"]) == (0.25, 600)
    assert "eigenpairs" not in options


@pytest.mark.parametrize(
    ("name", "value"),
    [("smooth", "-1"), ("smooth", "wide"), ("eigenpairs", "9"), ("vertices", "2.5")],
)
@in_loop
async def test_wrong_choices_are_told_and_nothing_runs(part, name, value):
    """Oracle: definition. Beside the field at once, and at the button."""
    await part.ready()
    before = len(part.jobs)
    part.server.browser_sets(**{f"wanted_{name}": value})
    assert list(part.state.wrong_choices) == [name]
    await part.comparing._run()
    assert part.state.run_problem.startswith(f"{name}: expected")
    assert len(part.jobs) == before
    part.server.browser_sets(**{f"wanted_{name}": ""})
    assert part.state.wrong_choices == {}
