"""What the report says in words and numbers: each cell against the value that it stands for."""

from __future__ import annotations

import re
from base64 import b64decode
from dataclasses import replace
from html import unescape

import numpy as np
import pytest
from pictures import ball, compare, dented, field

import isovary as iv
from isovary.data import water_pair
from isovary.extrinsic import Kind
from isovary.noise import SIGNIFICANCE
from isovary.view import _paint as paint
from isovary.view._overview import prepare
from isovary.view._report import _sources
from isovary.view._report_data import (
    border_pieces,
    mode_colors,
    modes,
    other_surface,
    scale_bytes,
    scale_limit,
)
from isovary.view._report_keys import legends
from isovary.view._report_plots import surface_figure
from isovary.view._report_tables import group_rows, repeat, tables
from isovary.view._words import percent

COMMAND = "isovary compare '/a <b> & \"c\".vti' /b.vti --isovalue 1 --array 'it'\"'\"'s'"
FILES = [
    {"path": '/a <b> & "c".vti', "array": "rho<1>", "sha256": "ab" * 32},
    {"path": "/d/b.vti", "array": "rho2", "sha256": "cd" * 32},
]


@pytest.fixture(scope="module")
def plain():
    return compare(field(ball), field(dented))


@pytest.fixture(scope="module")
def result(plain):
    """With facts that are all different, so that no cell can stand for another."""
    audit = replace(
        plain.audit,
        nodes=1000,
        lost=70,
        lost_inside=20,
        base_coverage=0.93,
        perturbed_coverage=0.81,
        several=0.053,
        folded=0.021,
        area_ratios=np.array([0.5, 0.61, 1.0, 1.42, 1.9]),
    )
    noises = {"mesh": 0.031, "samples": 0.0412, "pairs": 0.0513, "rounding": float("nan")}
    choices = plain.choices | {f"noise_of_the_{part}": noise for part, noise in noises.items()}
    choices |= {"command": COMMAND, "files": FILES}
    significant = plain.significant.copy()
    significant[:37] = False
    return replace(plain, audit=audit, choices=choices, significant=significant)


def text(html: str) -> str:
    return unescape(re.sub(r"<[^>]*>", "", html)).strip()


def rows_of(html: str) -> list[list[str]]:
    """The cells of each row of the tables."""
    return [
        [text(cell) for cell in re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row, re.S)]
        for row in re.findall(r"<tr>(.*?)</tr>", html, re.S)
    ]


def table(html: str, name: str) -> dict[str, str]:
    part = html.split(f"<h3>{name}</h3>")[1].split("</table>")[0]
    return dict(rows_of(part))


def legend(html: str, mode: str) -> str:
    return html.split(f'<div data-mode="{mode}">')[1].split('<div data-mode="')[0]


def ends(html: str, mode: str) -> list[str]:
    part = legend(html, mode).split('<div class="ends">')[1]
    return [text(span) for span in re.findall(r"<span>(.*?)</span>", part)[:3]]


def test_the_noise_floor_and_its_parts(result):
    """Oracle: algebra. Each part of the noise, the whole, and how many nodes exceed it."""
    said = table(tables(result), "Noise floor")
    assert said["all together"] == f"{percent(result.relative_noise)} of the change (rms)"
    assert said["of the mesh"] == "3.1 % of the change"
    assert said["of the samples"] == "4.1 % of the change"
    assert said["of the pairs"] == "5.1 % of the change"
    assert said["of the rounding"] == "unknown"
    assert said["nodes above twice the floor"] == percent(float(result.significant.mean()))
    assert said["floor of the strain"] == percent(float(np.median(result.strain_floor)))


def test_what_the_correspondence_covers(result):
    """Oracle: algebra. The audit, fact by fact."""
    said = table(tables(result), "Correspondence")
    assert said["nodes without a partner"] == "70 of 1000"
    assert said["of the base covered"] == "93 %"
    assert said["of the perturbed covered"] == "81 %"
    assert said["folded"] == "2.1 %"
    assert said["with several partners to choose from"] == "5.3 %"
    assert said["area of a triangle after / before"] == "0.61 to 1.42 (5 to 95 %)"
    assert said["faults"].startswith("70 of 1000 nodes without a partner")


def test_what_became_of_the_components(result):
    """Oracle: algebra. Matched, lost or born, with the parts that they are."""
    [match] = result.components
    lost = replace(match, perturbed=-1, perturbed_part=None, event="lost")
    said = table(tables(replace(result, components=(match, lost))), "Components")
    assert list(said) == ["0", "1"]
    assert said["0"].endswith("matched")
    assert said["1"].endswith("lost")


def test_how_to_repeat_it(result):
    """Oracle: algebra. The command and the files as they are, nothing of them markup."""
    html = repeat(result)
    assert "<b>" not in html
    assert "rho<1>" not in html
    assert text(html.split("<pre>")[1].split("</pre>")[0]) == COMMAND
    assert f"with isovary {iv.__version__}" in html
    expected = [[file["path"], file["array"], file["sha256"]] for file in FILES]
    assert rows_of(html)[1:] == expected
    assert _sources(result) == 'base a <b> & "c".vti against perturbed b.vti'
    assert repeat(replace(result, choices={})) == ""


def test_the_fields_by_their_samples(result):
    """Oracle: algebra. Each field has its own digest."""
    said = table(tables(result), "Fields")
    for name in ("base", "perturbed"):
        assert result.choices[name]["sha256"][:12] in said[name]
    assert said["base"] != said["perturbed"]


def test_the_groups_by_rank(plain):
    """Oracle: algebra. Area, mean change, median with its sign, and place of each group."""
    rows = rows_of(group_rows(plain))[1:]
    facts = sorted(plain.group_table, key=lambda group: group.rank)
    assert len(rows) == len(facts) >= 2
    for cells, group in zip(rows, facts, strict=True):
        assert cells[0] == str(group.number)
        assert cells[1] == percent(group.area_share)
        assert cells[2] == percent(group.mean_change)
        number = float(cells[3].removesuffix(" %"))
        median = np.median(plain.change[plain.clusters.labels == group.number, group.column])
        assert number == pytest.approx(100 * median, rel=0.06)
        place = [float(x) for x in cells[5].strip("()").split(", ")]
        np.testing.assert_allclose(place, group.place, atol=0.01)


def test_the_ends_of_the_legends(plain):
    """Oracle: algebra. Each scale ends at the largest value that it shows."""
    html = legends(prepare(plain))
    change, noise = plain.change_norm[plain.significant].max(), iv.change_norm(plain.noise_floor)
    assert ends(html, "change")[::2] == ["0 %", percent(change)]
    clear = np.abs(plain.change) > SIGNIFICANCE * plain.noise_floor
    scale = percent(np.abs(plain.change[clear]).max())
    assert ends(html, "scale")[::2] == [f"−{scale}", scale]
    moved = np.abs(plain.correspondence.distance).max()
    assert ends(html, "displacement")[::2] == [f"{-moved:.3g}", f"{moved:.3g}"]
    assert ends(html, "strain")[2] == percent(plain.strain.max())
    assert ends(html, "noise")[2] == percent(noise.max())
    assert "less than twice the noise floor" in legend(html, "change")
    for group in plain.group_table:
        words = f"group {group.number}: {percent(group.area_share)} of the area"
        assert words in legend(html, "groups")
    shares = plain.kind_shares
    for kind in (kind for kind in Kind if shares[kind.words] > 0):
        assert f"{kind.words}: {percent(shares[kind.words])}" in legend(html, "kinds")


def test_what_is_noise_is_no_change_at_one_scale(plain):
    """Oracle: algebra. A change of 1.9 floors is neutral, one of 2.1 is not, nor is the limit."""
    floor = np.full_like(plain.change, 0.01)
    change = np.full_like(plain.change, 0.019)
    change[3] = 0.021
    made = replace(plain, change=change, noise_floor=floor)
    assert scale_limit(made) == 0.021
    code = np.frombuffer(b64decode(scale_bytes(made)["bytes"]), np.uint8)
    shown = code.reshape(-1, len(change)) != 1
    assert shown[:, 3].all()
    assert shown.sum() == len(shown)


def test_what_is_unknown_has_no_colour(plain):
    """Oracle: algebra. A partner but no signature: unknown in every mode but the displacement."""
    change = plain.change.copy()
    change[5:25] = np.nan
    gone = replace(plain, change=change, significant=plain.significant & ~np.isnan(change[:, 0]))
    colors = mode_colors(gone)
    unknown = np.round(255 * np.array(paint.NO_PARTNER)).astype(np.uint8)
    for mode in ("change", "groups", "likeness"):
        rgb = np.frombuffer(b64decode(colors[mode]), np.uint8).reshape(-1, 3)
        np.testing.assert_array_equal(rgb[5:25], np.tile(unknown, (20, 1)))
    moved = np.frombuffer(b64decode(colors["displacement"]), np.uint8).reshape(-1, 3)
    assert (moved[5:25] != unknown).any(axis=1).all()
    assert (np.array(border_pieces(gone)["node_labels"])[5:25] == -2).all()


def test_likeness_is_of_the_changes(plain):
    """Oracle: algebra. Nodes of equal change have equal colours; those farthest apart have not."""
    change = plain.change.copy()
    change[10] = change[20] = change[30]
    colors = np.frombuffer(
        b64decode(mode_colors(replace(plain, change=change))["likeness"]), np.uint8
    ).reshape(-1, 3)
    assert (np.ptp(colors[[10, 20, 30]].astype(int), axis=0) <= 1).all()
    top, low = plain.base.points[:, 2].argmax(), plain.base.points[:, 2].argmin()
    assert np.abs(colors[top].astype(int) - colors[low]).max() > 50


def test_rims_have_a_mode_of_their_own():
    """Oracle: analytic. On a cut ball the colour of a node is that of its distance to the rim."""

    def half(function):
        box = ((-1.6, -1.6, -1.6), (1.6, 1.6, 0.3))
        return iv.ScalarField.from_function(function, bounds=box, shape=(25, 25, 17))

    cut = compare(half(ball), half(lambda p: ball(p) * 1.1 + 0.02 * p[..., 0]), vertices=160)
    assert "rim" in modes(cut)
    height = 0.3 - cut.base.points[:, 2]
    rgb = np.frombuffer(b64decode(mode_colors(cut)["rim"]), np.uint8).reshape(-1, 3).astype(int)
    order = np.argsort(height)
    light = rgb @ [2, 7, 1]  # viridis grows lighter
    assert light[order[-20:]].mean() > light[order[:20]].mean() + 500
    assert ends(legends(prepare(cut)), "rim")[2] == f"{cut.rim_distance.max():.3g}"


def test_a_mesh_of_its_own_knows_the_nearest_nodes():
    """Oracle: data. Beside the base, each node has the base's node whose partner lies nearest."""
    base, perturbed = (iv.read_field(path) for path in water_pair())
    rays = iv.compare(
        base, perturbed, 0.05, vertices=150, pairs=50, times=8, correspondence=iv.normal_rays
    )
    other = other_surface(rays)
    assert other["triangles"] is not None
    nodes = np.array(other["nodes"])
    away = np.linalg.norm(rays.partners[nodes] - rays.perturbed.points, axis=1)
    every = np.linalg.norm(rays.partners[:, None] - rays.perturbed.points, axis=2)
    np.testing.assert_allclose(away, np.nanmin(every, axis=0))
    assert (nodes >= 0).all()


def test_places_keep_their_digits_in_any_unit(plain):
    """Oracle: algebra. In units of 1e-9 the page's places are those of the base, to 1e-6 of it."""
    small = replace(plain, base=replace(plain.base, points=1e-9 * plain.base.points))
    view = prepare(plain)
    drawn = surface_figure(small, view.camera, None).data[0]
    places = np.column_stack([np.asarray(drawn[axis], dtype=float) for axis in "xyz"])
    np.testing.assert_allclose(places, small.base.points, atol=1e-15)
