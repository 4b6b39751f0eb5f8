"""A result made ready for the page: its nodes, its downloads, the groups that sessions share."""

from __future__ import annotations

import errno
import os
import shutil
from dataclasses import replace

import numpy as np
import pytest
from saved_folder import dented_ball, edit_summary, folder_of, half_lost, with_signature
from scipy.spatial import cKDTree

from isovary.app import _group_cache
from isovary.app._group_cache import find_groups, kept_groups, name_of
from isovary.app._groupings import counts_around, groupings
from isovary.app._opened_result import offer, open_folder, size
from isovary.app._saved_result import read_result
from isovary.clustering import fuzzy_c_means
from isovary.errors import IsovaryError
from isovary.geometry import edge_length


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return folder_of(dented_ball(), tmp_path_factory.mktemp("opened") / "out")


@pytest.fixture(scope="module")
def opened(folder):
    return open_folder(folder)


@pytest.fixture(scope="module")
def lost(tmp_path_factory):
    return open_folder(folder_of(half_lost(), tmp_path_factory.mktemp("half") / "out"))


def nearest(points, place):
    return int(np.linalg.norm(points - place, axis=1).argmin())


@pytest.mark.parametrize("view", ["base", "change", "groups"])
def test_the_nearest_node_of_the_base(opened, view):
    """Oracle: brute force. In every view of the base, beside the surface as well as on it."""
    points = opened.saved.base.points
    for place in np.random.default_rng(1).normal(size=(20, 3)):
        assert opened.node_at(view, place) == nearest(points, place)
    assert opened.node_at(view, np.array([9.0, 0, 0])) is not None


def test_the_nearest_partner_in_the_view_of_the_perturbed(lost):
    """Oracle: brute force. The base's node whose partner is nearest; None two edges from all."""
    base, partners = lost.saved.base, lost.saved.partners
    near = 2 * edge_length(base.points, base.triangles)
    known = np.flatnonzero(np.isfinite(partners).all(axis=1))
    assert 0 < len(known) < len(partners)
    answers = []
    for place in lost.saved.perturbed.points[::7]:
        node, away = nearest(partners[known], place), np.nanmin(distances(partners, place))
        answers.append(lost.node_at("perturbed", place))
        assert answers[-1] == (int(known[node]) if away < near else None)
    assert None in answers  # the part without partners
    assert len(set(answers)) > 20
    assert lost.node_at("perturbed", np.array([9.0, 0, 0])) is None


def distances(points, place):
    return np.linalg.norm(points - place, axis=1)


def test_without_any_partner_there_is_no_node(opened):
    """Oracle: limits. No partner, so no node anywhere on the perturbed surface."""
    none = replace(opened, partnered=np.empty(0, int), partners=cKDTree(np.empty((0, 3))))
    assert none.node_at("perturbed", none.saved.perturbed.points[0]) is None
    assert none.node_at("base", none.saved.base.points[5]) == 5


def test_folders_that_are_no_result_are_refused(folder, tmp_path):
    """Oracle: definition. An error in words, whatever is missing."""
    for name in ("change.vtu", "perturbed.vtu", "summary.json"):
        copy = shutil.copytree(folder, tmp_path / name)
        (copy / name).unlink()
        with pytest.raises(IsovaryError):
            open_folder(copy)


def made(path, text):
    path.write_text(text)
    return path


@pytest.fixture
def places(tmp_path):
    """A folder of a result, and one for downloads."""
    for name in ("result", "out"):
        (tmp_path / name).mkdir()
    return tmp_path / "result", tmp_path / "out"


def test_plain_files_are_offered(places):
    """Oracle: definition. With their sizes, by name; no link, hidden file, nor folder."""
    result, out = places
    made(result / "b.txt", "12345")
    made(result / "a.vtu", "123")
    made(result / ".hidden", "secret")
    (result / "folder").mkdir()
    made(result / "folder" / "c.txt", "inside")
    secret = made(result.parent / "secret", "secret")
    (result / "link.txt").symlink_to(secret)
    (result / "inner.txt").symlink_to(result / "a.vtu")
    (result / "gone.txt").symlink_to(result / "nothing")
    (result / "there").symlink_to(result / "folder")
    assert offer(result, out) == [
        {"name": "a.vtu", "size": "3 B"},
        {"name": "b.txt", "size": "5 B"},
    ]
    assert {path.name: path.read_text() for path in out.iterdir()} == {
        "a.vtu": "123",
        "b.txt": "12345",
    }


def test_a_newer_result_replaces_the_older_ones_files(places):
    """Oracle: definition. Under the same name stands the newer file; the older folder stays."""
    older, out = places
    newer = older.with_name("newer")
    newer.mkdir()
    kept = made(older / "report.html", "old")
    made(newer / "report.html", "newer")
    offer(older, out)
    assert offer(newer, out) == [{"name": "report.html", "size": "5 B"}]
    assert (out / "report.html").read_text() == "newer"
    assert kept.read_text() == "old"
    offer(newer, out)  # once more
    assert (out / "report.html").read_text() == "newer"


def test_a_link_left_in_the_downloads_is_not_followed(places):
    """Oracle: definition. The offered file replaces the link; what it leads to stays as it was."""
    result, out = places
    made(result / "a.txt", "new")
    other = made(result.parent / "other", "untouched")
    (out / "a.txt").symlink_to(other)
    offer(result, out)
    assert not (out / "a.txt").is_symlink()
    assert (out / "a.txt").read_text() == "new"
    assert other.read_text() == "untouched"


def test_on_another_file_system_files_are_copied(places, monkeypatch):
    """Oracle: definition. The same files, where the system makes no links across."""
    result, out = places
    made(result / "a.txt", "123")

    def refused(*_, **__):
        raise OSError(errno.EXDEV, "Invalid cross-device link")

    monkeypatch.setattr(os, "link", refused)
    assert offer(result, out) == [{"name": "a.txt", "size": "3 B"}]
    made(result / "a.txt", "changed")
    assert (out / "a.txt").read_text() == "123"  # a file of its own
    offer(result, out)
    assert (out / "a.txt").read_text() == "changed"


@pytest.mark.parametrize(
    ("count", "words"),
    [(0, "0 B"), (999, "999 B"), (1000, "1 kB"), (2_345_678, "2.35 MB"), (5 * 10**9, "5 GB")],
)
def test_sizes_in_words(tmp_path, count, words):
    """Oracle: definition. Three digits, in units of a thousand; a file may have holes."""
    with open(tmp_path / "a", "wb") as file:
        file.truncate(count)
    assert size(tmp_path / "a") == words


@pytest.fixture
def few(monkeypatch):
    """Offer a few counts only, for speed."""
    monkeypatch.setattr(_group_cache, "COUNTS", range(2, 5))
    return counts_around(3, range(2, 5))


def found(folder, cache):
    """The counts, in words, that a search has told of."""
    cache.mkdir(exist_ok=True)
    told = []
    find_groups(folder, cache, lambda words, done: told.append((words, done)))
    return told


def test_groups_are_kept_for_each_count(folder, tmp_path, few):
    """Oracle: other package. What groupings makes, from the nearest count outward, and told."""
    told = found(folder, tmp_path / "cache")
    assert [words for words, _ in told] == [f"{count} groups" for count in few]
    np.testing.assert_allclose([done for _, done in told], [1 / 3, 2 / 3, 1])
    kept = kept_groups(tmp_path / "cache", name_of(folder))
    assert sorted(kept) == sorted(few)
    for count, clusters in groupings(read_result(folder), few):
        np.testing.assert_array_equal(kept[count].labels, clusters.labels)
        np.testing.assert_array_equal(kept[count].centers, clusters.centers)
        assert kept[count].memberships is None
    assert len(list((tmp_path / "cache").iterdir())) == len(few)  # nothing half-written


def test_soft_groups_keep_their_memberships(folder, tmp_path, few):
    """Oracle: other package. fuzzy_c_means's own memberships come back."""
    copy = shutil.copytree(folder, tmp_path / "out")
    choices = {"clustering": "fuzzy_c_means(metric='l2')", "seed": 3}
    edit_summary(copy, lambda summary: summary["choices"].update(choices))
    found(copy, tmp_path / "cache")
    kept = kept_groups(tmp_path / "cache", name_of(copy))
    result = read_result(copy)
    ((_, expected),) = groupings(result, [2])
    assert expected.memberships is not None
    assert fuzzy_c_means.__name__ in result.choices["clustering"]
    np.testing.assert_array_equal(kept[2].memberships, expected.memberships)


def test_a_search_goes_on_where_another_ended(folder, tmp_path, few, monkeypatch):
    """Oracle: definition. What is kept after a stop stays as it is; only the others are made."""
    cache = tmp_path / "cache"
    cache.mkdir()

    def stop(_words, done):
        if done > 0.4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        find_groups(folder, cache, stop)
    name = name_of(folder)
    first = kept_groups(cache, name)
    assert sorted(first) == sorted(few[:2])
    made_of = {path: path.stat().st_mtime_ns for path in cache.iterdir()}
    asked = []

    def counted(result, counts):
        asked.extend(counts)
        return groupings(result, counts)

    monkeypatch.setattr(_group_cache, "groupings", counted)
    told = found(folder, cache)
    assert asked == few[2:]
    assert told[-1][1] == 1
    assert sorted(kept_groups(cache, name)) == sorted(few)
    assert {path: path.stat().st_mtime_ns for path in made_of} == made_of
    assert found(folder, cache) == []


def test_two_sessions_may_search_at_once(folder, tmp_path, few, monkeypatch):
    """Oracle: definition. One searches while the other writes: no half file is read, all end."""
    cache, name = tmp_path / "cache", name_of(folder)
    cache.mkdir()
    save, told = np.savez, []

    def slowly(file, **arrays):
        if not told:
            file.write(b"half")
            file.flush()
            assert kept_groups(cache, name) == {}
            told.append([])
            told[0] = found(folder, cache)
            file.seek(0)
        save(file, **arrays)

    monkeypatch.setattr(np, "savez", slowly)
    find_groups(folder, cache, lambda *_: None)
    assert [words for words, _ in told[0]] == [f"{count} groups" for count in few]
    kept = kept_groups(cache, name)
    for count, clusters in groupings(read_result(folder), few):
        np.testing.assert_array_equal(kept[count].labels, clusters.labels)
        np.testing.assert_array_equal(kept[count].centers, clusters.centers)
    assert len(list(cache.iterdir())) == len(few)


def test_results_do_not_share_groups_that_differ(folder, tmp_path):
    """Oracle: definition. Another seed, method or content has another name; a copy the same."""
    copy = shutil.copytree(folder, tmp_path / "elsewhere")
    assert name_of(copy) == name_of(folder)
    names = {name_of(folder)}
    for key, value in (("seed", 5), ("clustering", "k_medoids"), ("area_weighted", True)):
        edit_summary(copy, lambda s, key=key, value=value: s["choices"].update({key: value}))
        names.add(name_of(copy))
    other = folder_of(with_signature(dented_ball().methods.signature), tmp_path / "other")
    names.add(name_of(other))
    assert len(names) == 5
    edit_summary(copy, lambda summary: summary["choices"].update({"isovalue": 9.0}))
    assert name_of(copy) in names  # nothing to do with its groups


def test_one_group_is_searched_around_two(tmp_path, few):
    """Oracle: definition. Counts begin with two, where the result has one group or none."""
    result = dented_ball()
    one = replace(result, clusters=replace(result.clusters, labels=0 * result.clusters.labels))
    told = found(folder_of(one, tmp_path / "out"), tmp_path / "cache")
    assert [words for words, _ in told] == [f"{count} groups" for count in sorted(few)]
