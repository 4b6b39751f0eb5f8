"""The room of the thesis's experiments: they are found, their settings hold, the page is whole."""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from importlib.resources import files

import pytest
from matplotlib.figure import Figure

import isovary as iv
from isovary.thesis import (
    Experiment,
    Finding,
    Outcome,
    Verdict,
    experiment,
    experiments,
    settings_of,
)
from isovary.thesis._drawing import new_figure
from isovary.thesis._gallery import COARSE, make_gallery
from isovary.thesis._register import expected_seconds


def test_every_experiment_has_its_settings():
    """Oracle: data. Each has a file; what is small is among what is full; each number says why."""
    room = files("isovary.thesis")
    for found in experiments():
        text = room.joinpath(f"fig_{found.number.replace('.', '_')}.toml").read_text("utf-8")
        read = tomllib.loads(text)
        assert set(read) == {"full", "small"}, found.number
        assert set(read["small"]) <= set(read["full"]), found.number
        full = text.split("[full]")[1].split("[small]")[0]
        lines = [line for line in full.splitlines() if "=" in line]
        assert [line for line in lines if "#" not in line] == [], found.number


def test_experiments_are_found_by_their_figures():
    """Oracle: algebra. In the thesis's order, each figure once; another number is refused."""
    numbers = [number for found in experiments() for number in (found.number, *found.also)]
    assert len(set(numbers)) == len(numbers)
    order = [[int(part) for part in found.number.split(".")] for found in experiments()]
    assert order == sorted(order)
    for number in numbers:
        assert number in (experiment(number).number, *experiment(number).also)
    with pytest.raises(iv.ArgumentError, match=r"figure: expected one of .*4\.3.*got 9\.9"):
        experiment("9.9")


@pytest.mark.parametrize("words", ["fig4.12", "Fig. 4.12", "Figure 4.12", "4.12", "figure-4.12"])
def test_a_number_may_have_its_word(words):
    """Oracle: data. Figure 4.12 is shown with 4.11, however it is written."""
    assert experiment(words).number == "4.11"


@pytest.mark.parametrize(
    ("number", "meant"), [("9.9", "4.9"), ("3", "3.1"), ("fig3.2", "3.1"), ("5", "5.1 or 5.2")]
)
def test_another_number_is_answered_with_those_like_it(number, meant):
    """Oracle: data. The chapter's figures, or numbers written alike; where titles are."""
    with pytest.raises(iv.ArgumentError, match=f"did you mean .*{meant}.*isovary thesis"):
        experiment(number)


def test_every_experiment_has_its_seconds():
    """Oracle: data. Both settings of each have a time that a user is told."""
    for found in experiments():
        small, full = (expected_seconds(found, small=small) for small in (True, False))
        assert 0 < small <= 12
        assert small <= full


def _made_up(number, ends=False):
    def run(_):
        if ends:
            raise KeyboardInterrupt
        found = (Finding("Water is wet", "1.2", "wet", Verdict.CONFIRMED),)
        return Outcome(found, new_figure(number, "Water", "It is wet"))

    return Experiment(number, "Water", run)


def test_a_coarse_run_says_so(tmp_path):
    """Oracle: data. In the picture, before all claims of the page, and in the summary."""
    outcomes = make_gallery([_made_up("4.3")], tmp_path, small=True)
    assert COARSE in [text.get_text() for text in outcomes[0].figure.texts]
    page = (tmp_path / "gallery.md").read_text("utf-8")
    assert 0 < page.lower().index(COARSE) < page.index("Water is wet")
    assert "--small`" in page
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert (summary["coarse"], summary["note"]) == (True, COARSE)
    full = make_gallery([_made_up("4.3")], tmp_path)
    assert COARSE not in [text.get_text() for text in full[0].figure.texts]
    assert json.loads((tmp_path / "summary.json").read_text())["coarse"] is False


def test_what_is_finished_stays_after_an_interrupt(tmp_path):
    """Oracle: data. The second of three is interrupted: the first is written, the page is whole."""
    made = [_made_up("4.3"), _made_up("4.4", ends=True), _made_up("4.5")]
    assert len(make_gallery(made, tmp_path)) == 1
    assert "1 claims: 1 confirmed." in (tmp_path / "gallery.md").read_text("utf-8")
    assert list(json.loads((tmp_path / "summary.json").read_text())["experiments"]) == ["4.3"]
    assert (tmp_path / "figure-4.3.png").exists()
    with pytest.raises(KeyboardInterrupt):
        make_gallery(made[1:], tmp_path)


def test_an_interrupt_without_a_figure_is_told(tmp_path):
    """Oracle: data. Ctrl-C in the first experiment: nothing is written, a word and code 130."""
    program = (
        "import isovary.thesis._gallery as g, isovary.cli._app as a, sys\n"
        "def stop(*_, **__): raise KeyboardInterrupt\n"
        "g.make_gallery = stop\n"
        "import isovary.cli\n"
        "sys.argv = ['isovary', 'thesis', '4.3', '-o', 'out']\n"
        "a.main()"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        timeout=120,
        check=False,
    )
    assert done.returncode == 130
    assert "stopped; nothing was written" in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_small_settings_lie_over_the_full_ones():
    """Oracle: data. The file of figure 4.3, read by hand."""
    found = experiment("4.3")
    assert settings_of(found)["pairs"][-1] == 500
    assert settings_of(found, small=True)["pairs"][-1] == 200
    assert settings_of(found, small=True)["dimple_alpha"] == 5.0


def test_the_page_has_every_claim(tmp_path):
    """Oracle: algebra. Two made-up experiments: their claims, numbers, verdicts and pictures."""

    def run(_):
        claims = (
            Finding("Water is wet", "1.2", "wet by 3 %", Verdict.CONFIRMED, {"wet": 0.03}),
            Finding("Fire is cold", "1.3", "it is 900 degrees", Verdict.REFUTED),
        )
        return Outcome(claims, Figure((1, 1)))

    made = [Experiment("4.3", "Elements", run), Experiment("4.3", "Again", run, ("9.9",))]
    told = []
    make_gallery(made, tmp_path, tell=lambda name, _: told.append(name))
    text = (tmp_path / "gallery.md").read_text("utf-8")
    assert "4 claims: 2 confirmed, 2 refuted." in text
    assert text.count("| Water is wet | wet by 3 % | ✔ confirmed |") == 2
    assert "## Figure 4.3 (with 9.9): Again" in text
    assert [words.split(" (")[0] for words in told] == ["Figure 4.3: Elements", "Figure 4.3: Again"]
    assert "(2 of 2, about" in told[1]
    assert f"Made by isovary {iv.__version__} on 20" in text
    assert "`isovary thesis 4.3 4.3`" in text
    assert COARSE not in text.lower()
    assert (tmp_path / "figure-4.3.png").stat().st_size > 0
    record = json.loads((tmp_path / "summary.json").read_text())["experiments"]["4.3"]
    assert record["findings"][0]["numbers"] == {"wet": 0.03}
    assert record["settings"]["times"] == 100


def test_a_section_is_not_called_a_figure(tmp_path):
    """Oracle: data. 4.1.5 is a section: in the page, its table, its picture and the list."""
    chosen = experiment("4.1.5")
    assert chosen.listed == "Section 4.1.5"
    assert experiment("4.11").listed == "4.11, 4.12"

    def run(_):
        figure = new_figure(chosen.number, chosen.title, "message")
        assert figure.texts[0].get_text().startswith("Section 4.1.5   ")
        return Outcome((Finding("Water is wet", "1.2", "wet", Verdict.CONFIRMED),), figure)

    make_gallery([Experiment("4.1.5", "Scaling", run)], tmp_path)
    page = (tmp_path / "gallery.md").read_text("utf-8")
    assert "## Section 4.1.5: Scaling" in page
    assert "| [Section 4.1.5](#figure-4-1-5) |" in page
    assert "Figure 4.1.5" not in page


def test_the_command_lists_and_refuses(tmp_path):
    """Oracle: data. Without a figure the list; with a wrong one exit code 2 and no folder."""

    def isovary(*words):
        command = [sys.executable, "-m", "isovary", "thesis", *words]
        return subprocess.run(
            command, capture_output=True, text=True, cwd=tmp_path, timeout=120, check=False
        )

    listed = isovary()
    assert listed.returncode == 0
    lines = listed.stdout.splitlines()
    assert len(lines) == len(experiments()) + 2
    assert all(line.endswith(" s") for line in lines[:-2])
    assert "isovary thesis all" in lines[-2]
    assert "Section 4.1.5 " in listed.stdout
    assert isovary("7.7").returncode == 2
    assert isovary("--small").returncode == isovary("-o", "there").returncode == 2
    assert isovary("all", "4.3").returncode == 2
    assert list(tmp_path.iterdir()) == []
