"""Charts of the page: valid, safe, and with every curve where its numbers belong."""

from __future__ import annotations

import re
from itertools import pairwise
from xml.etree import ElementTree

import numpy as np
import pytest

from isovary.app._charts import curve_values, curves_svg, histogram_svg
from isovary.errors import ArgumentError
from isovary.signature import (
    global_point_signature,
    heat_kernel_signature,
    signature_kind,
    wave_kernel_signature,
)

SVG = "{http://www.w3.org/2000/svg}"
HEAT = signature_kind(heat_kernel_signature)
TIMES = np.geomspace(0.1, 10.0, 41)
BASE = 1 / (4 * np.pi * TIMES)
CHANGE = 0.02 * np.sin(np.log(TIMES))
NOISE = np.full(41, 0.005)


def chart(kind=HEAT, columns=TIMES, base=BASE, perturbed=0.9 * BASE, **options):
    change, noise = options.pop("change", CHANGE), options.pop("noise", NOISE)
    options = {"title": "Node 7"} | options
    text = curves_svg(columns, base, perturbed, change, noise, kind=kind, **options)
    return ElementTree.fromstring(text)


def words(root):
    return [element.text for element in root.iter(f"{SVG}text")]


def of_class(root, name):
    return [element for element in root.iter() if name in element.get("class", "").split()]


def path(root, name):
    (element,) = of_class(root, name)
    numbers = re.findall(r"[ML](-?[\d.]+) (-?[\d.]+)", element.get("d"))
    return np.array(numbers, dtype=float).reshape(-1, 2)


def ticks(root, axis, inside):
    """Values and pixels of an axis's labels, of the panel between two heights."""
    found = [element for element in of_class(root, "tick") if axis in element.get("class").split()]
    found = [
        element for element in found if inside[0] - 20 <= float(element.get("y")) <= inside[1] + 20
    ]
    way = "y" if axis == "y" else "x"
    shift = -4 if axis == "y" else 0  # letters hang a third of their height below the tick
    values = [float(element.get("data-value")) for element in found]
    return np.array(values), np.array([float(element.get(way)) + shift for element in found])


def panels(root):
    boxes = [
        [float(p.get(k)) for k in ("x", "y", "width", "height")] for p in of_class(root, "panel")
    ]
    return [(x, y, x + w, y + h) for x, y, w, h in boxes]


def test_curves_stand_where_their_numbers_belong():
    """Oracle: analytic. Labels tell the logarithmic map; each point of a curve follows it."""
    root = chart()
    upper, lower = panels(root)
    values, places = ticks(root, "x", (lower[3], lower[3]))
    across = np.polyfit(np.log(values), places, 1)
    np.testing.assert_allclose(
        np.polyval(across, np.log(TIMES)), path(root, "base")[:, 0], atol=0.03
    )
    assert path(root, "base")[[0, -1], 0].tolist() == [upper[0], upper[2]]
    values, places = ticks(root, "y", (upper[1] + 20, upper[3] - 20))
    up = np.polyfit(np.log(values), places, 1)
    for name, curve in (("base", BASE), ("perturbed", 0.9 * BASE)):
        expected = np.polyval(up, np.log(curve))
        np.testing.assert_allclose(path(root, name)[:, 1], expected, atol=0.1)
    values, places = ticks(root, "y", (lower[1] + 20, lower[3] - 20))
    up = np.polyfit(values, places, 1)
    np.testing.assert_allclose(path(root, "change")[:, 1], np.polyval(up, 100 * CHANGE), atol=0.05)
    (band,) = of_class(root, "noise")
    heights = {float(pair.split(",")[1]) for pair in band.get("points").split()}
    np.testing.assert_allclose(sorted(heights), np.polyval(up, [0.5, -0.5]), atol=0.05)


def test_radii_stand_over_their_times():
    """Oracle: analytic. The radius r is at the time r^2 / 4."""
    root = chart()
    upper, _ = panels(root)
    values, places = ticks(root, "radius", (upper[1], upper[1]))
    assert len(values) >= 3
    start, end = upper[0], upper[2]
    share = np.log(values**2 / 4 / TIMES[0]) / np.log(TIMES[-1] / TIMES[0])
    np.testing.assert_allclose(places, start + share * (end - start), atol=0.02)


def test_the_chosen_column_is_marked():
    """Oracle: analytic. The middle of logarithmic times is the middle of the panel."""
    root = chart(column=20)
    (marker,) = of_class(root, "marker")
    (left, _, right, _), _ = panels(root)
    assert float(re.match(r"M([\d.]+)", marker.get("d"))[1]) == (left + right) / 2
    dots = [float(dot.get("cx")) for dot in root.iter(f"{SVG}circle")]
    assert dots == [(left + right) / 2] * 3
    assert not of_class(chart(), "marker")


def test_labels_lie_inside_and_apart():
    """Oracle: brute force. No tick of an axis is within half a letter of another."""
    for times in (TIMES, np.geomspace(1e-7, 1e3, 41), np.geomspace(1.0, 1.01, 41), TIMES[:1]):
        count = len(times)
        root = chart(
            columns=times,
            base=1 / times,
            perturbed=2 / times,
            change=CHANGE[:count],
            noise=NOISE[:count],
        )
        for axis in ("x", "radius"):
            found = [e for e in of_class(root, "tick") if axis in e.get("class").split()]
            assert len(found) >= 2
            ends = sorted((float(e.get("x")), 3 * len(e.text)) for e in found)
            for (a, half), (b, other) in pairwise(ends):
                assert a + half < b - other, (axis, times[0])
        for element in root.iter(f"{SVG}text"):
            assert float(element.get("font-size")) >= 11
            assert 0 <= float(element.get("x")) <= 460
            assert 0 <= float(element.get("y")) <= 420


def test_titles_are_text_and_nothing_else():
    """Oracle: data. Markup in a title is shown as it was written, in the label, too."""
    title = '<script>alert("1")</script> & \x00 ]]>'
    root = chart(title=title)
    assert not [element for element in root.iter() if "script" in element.tag]
    assert words(root)[0] == title.replace("\x00", "")
    assert root.get("aria-label").startswith(title.replace("\x00", ""))
    assert root.get("role") == "img"
    text = histogram_svg([1], [0, 1], 0.5, title=title, unit='"><script>')
    assert "<script" not in text
    ElementTree.fromstring(text)
    for forbidden in ("href", "url(", "style=", "onload"):
        assert forbidden not in text


def test_colours_follow_the_theme():
    """Oracle: data. Lines and letters have the colour of the text around, but for one."""
    root = chart(column=3)
    used = {element.get(key) for element in root.iter() for key in ("fill", "stroke")}
    assert used == {None, "none", "currentColor", "#d55e00"}
    assert {element.get("fill") for element in root.iter(f"{SVG}text")} == {"currentColor"}
    (dashed,) = of_class(root, "perturbed")
    assert dashed.get("stroke-dasharray")


def test_without_a_partner_there_are_words():
    """Oracle: data. NaN is told, not drawn."""
    nan = np.full(41, np.nan)
    root = chart(perturbed=nan, change=nan, noise=nan, column=3)
    assert not of_class(root, "change")
    assert not len(path(root, "perturbed"))
    assert len(path(root, "base")) == 41
    assert "the change here is unknown" in words(root)
    assert "perturbed: no partner" in words(root)
    assert "unknown" in root.get("aria-label")
    text = ElementTree.tostring(root, "unicode")
    assert "nan" not in text
    root = chart(base=nan, perturbed=nan, change=nan, noise=nan)
    assert "the signature here is unknown" in words(root)


def test_a_gap_cuts_the_curve():
    """Oracle: data. Two runs of known values are two lines, a single value is a dot."""
    change = CHANGE.copy()
    change[[10, 12]] = np.nan
    (line,) = of_class(chart(change=change), "change")
    assert line.get("d").count("M") == 3
    assert line.get("d").count("h0") == 1
    assert "nan" not in line.get("d")


def test_keys_stand_clear_of_the_curves():
    """Oracle: brute force. No letter of a key lies on the curve that it names."""
    root = chart(column=20)
    for name, curve in (
        ("base", "base"),
        ("perturbed", "perturbed"),
        ("base − perturbed", "change"),
    ):
        (element,) = (e for e in root.iter(f"{SVG}text") if e.text == name)
        left, bottom = float(element.get("x")), float(element.get("y"))
        inside = path(root, curve)
        hit = (inside[:, 0] > left) & (inside[:, 0] < left + 6 * len(name))
        hit &= (inside[:, 1] > bottom - 11) & (inside[:, 1] < bottom + 2)
        assert not hit.any(), name


@pytest.mark.parametrize("method", [wave_kernel_signature, global_point_signature])
def test_other_signatures_have_their_own_axis(method):
    """Oracle: data. No diffusion radius, and a plain axis for eigenpairs, with values below 0."""
    kind = signature_kind(method)
    columns, wave = np.arange(1.0, 42.0), np.sin(np.arange(41))
    root = chart(kind, columns, wave, wave + 0.1)
    assert kind.axis in words(root)
    assert not [e for e in of_class(root, "tick") if "radius" in e.get("class").split()]
    steps = np.diff(path(root, "base")[:, 0])
    assert np.allclose(steps, steps[0], atol=0.02) == (not kind.logarithmic)


def test_no_change_at_all_is_told():
    """Oracle: limits. A change of 0 without noise is drawn as a line and told in words."""
    root = chart(change=0 * CHANGE, noise=0 * NOISE)
    assert "no change at all" in words(root)
    assert np.ptp(path(root, "change")[:, 1]) == 0


def test_the_table_has_the_numbers():
    """Oracle: analytic. Ends of the columns, radii 2 sqrt(t), and percent."""
    table = curve_values(TIMES, BASE, 2 * BASE, CHANGE, NOISE, kind=HEAT, most=5)
    assert len(table) == 6
    assert {len(row) for row in table} == {6}
    assert table[1][0] == "0.1"
    assert table[-1][:2] == ["10", "6.32"]
    assert table[1][2:] == ["0.796", "1.59", "−1.49", "0.5"]  # 1 / (0.4 pi), 2 sin(ln 0.1)
    energy = signature_kind(wave_kernel_signature)
    table = curve_values(TIMES, BASE, BASE, CHANGE, NOISE, kind=energy)
    assert len(table) == 26
    assert len(table[0]) == 5


def test_bars_and_isovalue_stand_where_they_belong():
    """Oracle: analytic. Heights in decades, places in proportion."""
    root = ElementTree.fromstring(histogram_svg([1000, 0, 10], [0, 1, 2, 4], 1.0, title="rho"))
    ((left, top, right, bottom),) = panels(root)
    (bars,) = of_class(root, "bars")
    found = re.findall(r"M([\d.]+) [\d.]+V([\d.]+)H([\d.]+)V[\d.]+Z", bars.get("d"))
    (x0, high, x1), (x2, low, x3) = np.array(found, dtype=float)
    np.testing.assert_allclose([x0, x1, x2, x3], left + (right - left) * np.array([0, 1, 2, 4]) / 4)
    values, places = ticks(root, "y", (top + 20, bottom - 20))
    decade = np.polyfit(np.log10(values), places, 1)[0]
    assert low - high == pytest.approx(-2 * decade, abs=0.1)
    (mark,) = of_class(root, "isovalue")
    assert float(re.match(r"M([\d.]+)", mark.get("d"))[1]) == left + (right - left) / 4
    assert "isovalue 1" in words(root)


def test_histograms_on_a_logarithm_and_isovalues_outside():
    """Oracle: analytic. The middle of 0.01 to 100 is 1; what lies outside is told."""
    ends = np.geomspace(0.01, 100, 9)
    options = {"title": "rho", "logarithmic": True}
    root = ElementTree.fromstring(histogram_svg(np.ones(8), ends, 1.0, **options))
    ((left, _, right, _),) = panels(root)
    (mark,) = of_class(root, "isovalue")
    assert float(re.match(r"M([\d.]+)", mark.get("d"))[1]) == (left + right) / 2
    root = ElementTree.fromstring(histogram_svg(np.zeros(8), ends, 200.0, **options))
    assert not of_class(root, "isovalue")
    assert "isovalue 200 lies outside the values" in words(root)


def test_the_isovalue_is_told_clear_of_the_bars():
    """Oracle: geometry. Its words stand above the panel, between its ends, wherever it is."""
    for isovalue in (0.0, 2.0, 4.0, 9.0):
        root = ElementTree.fromstring(histogram_svg([9, 99], [0, 1, 4], isovalue, title="rho"))
        ((left, top, right, _),) = panels(root)
        (said,) = [e for e in root.iter(f"{SVG}text") if e.text.startswith("isovalue")]
        assert float(said.get("y")) < top
        half = 6.4 * len(said.text) / 2
        assert left <= float(said.get("x")) - half
        assert float(said.get("x")) + half <= right


def test_wrong_calls_are_told():
    """Oracle: data. Each error has the code of the fault."""
    calls = [
        ("A02", lambda: chart(column=41)),
        ("A02", lambda: chart(column=-1)),
        ("A03", lambda: chart(change=CHANGE[1:])),
        ("A03", lambda: chart(columns=TIMES[::-1])),
        ("A03", lambda: chart(columns=np.full(41, np.nan))),
        ("A02", lambda: curve_values(TIMES, BASE, BASE, CHANGE, NOISE, kind=HEAT, most=0)),
        ("A03", lambda: histogram_svg([], [0], None, title="")),
        ("A03", lambda: histogram_svg([1, 2], [0, 1], None, title="")),
        ("A03", lambda: histogram_svg([1], [1, 1], None, title="")),
        ("A02", lambda: histogram_svg([-1], [0, 1], None, title="")),
        ("A02", lambda: histogram_svg([1], [0, 1], None, title="", logarithmic=True)),
    ]
    for number, (code, call) in enumerate(calls):
        with pytest.raises(ArgumentError) as told:
            call()
        assert told.value.code == code, number
