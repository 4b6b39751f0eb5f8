"""Which component is which: every event on fields whose components are known."""

from __future__ import annotations

import numpy as np
import pytest

import isovary as iv
from isovary.geometry import components
from isovary.matching import component_table, describe, match_components, part_of

BOX = ((-3.0, -1.6, -1.6), (3.0, 1.6, 1.6))
SHAPE = (61, 33, 33)


def union(*parts):
    """The distance to the nearest of several shapes, below 0 inside: their union."""
    return lambda p: np.min([part(p) for part in parts], axis=0)


def ball(radius, *center):
    return lambda p: np.linalg.norm(p - np.array(center), axis=-1) - radius


def ring(radius, tube, *center):
    def distance(p):
        x, y, z = np.moveaxis(p - np.array(center), -1, 0)
        return np.hypot(np.hypot(x, y) - radius, z) - tube

    return distance


def without(solid, *holes):
    return lambda p: np.max([solid(p), *(-hole(p) for hole in holes)], axis=0)


def surface(distance, box=BOX, shape=SHAPE):
    """The isosurface distance = 0 with normals outward."""
    return iv.contour(iv.ScalarField.from_function(lambda p: -distance(p), box, shape), 0.0)


def events(base, perturbed):
    """Events with the places of both components, along x, rounded."""
    return [
        (
            match.event,
            None if match.base_part is None else round(match.base_part.centre[0], 1),
            None if match.perturbed_part is None else round(match.perturbed_part.centre[0], 1),
        )
        for match in match_components(base, perturbed)
    ]


def test_components_that_move_and_grow_are_matched():
    """Oracle: analytic. Three balls, moved by less than their size, whatever their numbers."""
    base = surface(union(ball(0.6, -2, 0, 0), ball(0.5, 0, 0, 0), ball(0.7, 2, 0, 0)))
    moved = union(ball(0.5, -1.9, 0.2, 0), ball(0.7, 0.1, -0.3, 0), ball(0.6, 1.8, 0, 0.2))
    perturbed = surface(moved)
    order = np.argsort(-components(perturbed.triangles), kind="stable")  # the last comes first
    points, triangles = perturbed.points[::-1], len(perturbed.points) - 1 - perturbed.triangles
    other = iv.Surface(points, triangles[order])
    assert component_table(other)[0].centre[0] > 1  # renumbered, indeed
    found = match_components(base, other)
    assert [match.base for match in found] == [0, 1, 2]
    assert all(match.same for match in found)
    for match in found:
        shift = np.subtract(match.perturbed_part.centre, match.base_part.centre)
        assert np.linalg.norm(shift) < 0.33


@pytest.mark.parametrize("gap", [0.2, 1.0])
def test_an_island_vanishes_or_is_born(gap):
    """Oracle: analytic. A droplet beside a large one is lost, near or far; backwards it is born."""
    large, small = ball(1.2, -1.4, 0, 0), ball(0.4, 0.2 + gap, 0, 0)
    both, one = surface(union(large, small)), surface(ball(1.25, -1.4, 0, 0))
    place = round(0.2 + gap, 1)
    expected = [("lost", place, None), ("matched", -1.4, -1.4)]
    assert sorted(events(both, one)) == expected
    assert sorted(events(one, both), key=str) == [
        ("born", None, place),
        ("matched", -1.4, -1.4),
    ]


def test_two_equal_droplets_of_which_one_vanishes():
    """Oracle: analytic. What is left is its own successor, not a merger of both."""
    both = surface(union(ball(0.7, -0.8, 0, 0), ball(0.7, 0.8, 0, 0)))
    one = surface(ball(0.7, -0.8, 0, 0))
    assert sorted(events(both, one)) == [("lost", 0.8, None), ("matched", -0.8, -0.8)]


@pytest.mark.parametrize("radius", [0.95, 0.35])
def test_droplets_merge_and_split(radius):
    """Oracle: analytic. A neck joins a droplet to another; spheres stay spheres, yet not same."""
    first, second = ball(0.95, -1.0, 0, 0), ball(radius, radius + 0.05, 0, 0)
    apart = surface(union(first, second))
    joined = surface(union(first, second, ball(0.25, 0, 0, 0)))
    found = match_components(apart, joined)
    assert {match.event for match in found} == {"merged"}
    assert [(match.base, match.perturbed) for match in found] == [(0, 0), (1, 0)]
    assert not any(match.same for match in found)
    assert all(match.base_topology == match.perturbed_topology for match in found)
    back = match_components(joined, apart)
    assert [(m.event, m.base, m.perturbed) for m in back] == [("split", 0, 0), ("split", 0, 1)]


def test_a_droplet_that_is_half_swallowed_has_merged():
    """Oracle: analytic. Less than half of the small ball's surface is left outside."""
    large = ball(1.0, -1, 0, 0)
    apart = surface(union(large, ball(0.5, 0.65, 0, 0)))
    joined = surface(union(large, ball(0.5, 0.2, 0, 0)))
    assert [match.event for match in match_components(apart, joined)] == ["merged", "merged"]


def test_a_third_droplet_takes_no_part_in_a_merger():
    """Oracle: analytic. Two of three balls are joined by a neck; the third only moves."""
    first, second = ball(0.6, -2.2, 0, 0), ball(0.6, -0.8, 0, 0)
    base = surface(union(first, second, ball(0.6, 1.5, 0, 0)))
    joined = union(first, second, ball(0.3, -1.5, 0, 0), ball(0.6, 1.7, 0.1, 0))
    assert [event for event, *_ in events(base, surface(joined))] == ["merged", "merged", "matched"]


def test_a_hole_closes():
    """Oracle: analytic. A ring whose hole is filled by a ball: genus 1 and 0."""
    solid = ring(1.0, 0.45, 0, 0, 0)
    (match,) = match_components(surface(solid), surface(union(solid, ball(0.62, 0, 0, 0))))
    assert match.event == "handle"
    assert (match.base_topology.genus, match.perturbed_topology.genus) == (1, 0)


def test_a_rim_opens():
    """Oracle: analytic. A ball pushed through a face of the box has one boundary loop."""
    inside, cut = surface(ball(0.8, 2.0, 0, 0)), surface(ball(0.8, 2.4, 0, 0))
    (match,) = match_components(inside, cut)
    assert match.event == "rim"
    assert match.perturbed_topology.boundary_loops == 1


def test_a_pocket_that_fills_is_lost():
    """Oracle: analytic. The wall of a thin hollow ball faces the other way than its outside."""
    box, shape = ((-1.5,) * 3, (1.5,) * 3), (49, 49, 49)
    hollow = surface(without(ball(1.2, 0, 0, 0), ball(0.95, 0, 0, 0)), box, shape)
    full = surface(ball(1.1, 0, 0, 0), box, shape)
    found = {match.event: match for match in match_components(hollow, full)}
    assert set(found) == {"matched", "lost"}
    assert found["lost"].base_part.volume < 0 < found["matched"].base_part.volume
    assert found["lost"].base_part.size == pytest.approx(0.95, rel=0.01)


def test_an_onion_that_fills_is_no_merger():
    """Oracle: analytic. A core in a hollow ball, of which only the outside is left."""
    box, shape = ((-1.5,) * 3, (1.5,) * 3), (61, 61, 61)
    shell = without(ball(1.2, 0, 0, 0), ball(1.05, 0, 0, 0))
    onion = surface(union(shell, ball(0.9, 0, 0, 0)), box, shape)
    full = surface(ball(1.2, 0, 0, 0), box, shape)
    found = match_components(onion, full)
    assert sorted(match.event for match in found) == ["lost", "lost", "matched"]
    found = match_components(full, onion)
    assert sorted(match.event for match in found) == ["born", "born", "matched"]


def test_a_pocket_is_never_an_island():
    """Oracle: symmetry. Inside and outside change places: the same points, facing each other."""
    island = surface(ball(0.8, 0, 0, 0))
    pocket = surface(lambda p: -ball(0.8, 0, 0, 0)(p))
    assert events(island, pocket) == [("lost", 0.0, None), ("born", None, 0.0)]


def test_a_leap_farther_than_the_own_size_is_no_match():
    """Oracle: analytic. A ball that moves by 1.2 radii is the same one; by 4 radii another."""
    start = surface(ball(0.5, -2, 0, 0))
    assert events(start, surface(ball(0.5, -1.4, 0, 0))) == [("matched", -2.0, -1.4)]
    gone = events(start, surface(ball(0.5, 0, 0, 0)))
    assert gone == [("lost", -2.0, None), ("born", None, 0.0)]


@pytest.mark.parametrize("whole", [0, 1])
def test_equal_topology_breaks_ties(whole):
    """Oracle: symmetry. Of two spheres equally far, one lacks a triangle: the whole one is it.

    At 1.78 radii they share too little, 26 % of the area, to be linked.
    """
    sphere = iv.icosphere(3, order=1)
    shift = np.array([0, 0, 1.78])
    triangles = [sphere.triangles, sphere.triangles + len(sphere.points)]
    triangles[1 - whole] = triangles[1 - whole][:-1]
    points = np.vstack([sphere.points + shift, sphere.points - shift])
    normals = np.vstack([sphere.normals, sphere.normals])
    found = match_components(sphere, iv.Surface(points, np.vstack(triangles), normals))
    assert [(m.base, m.perturbed, m.event) for m in found] == [
        (0, whole, "matched"),
        (-1, 1 - whole, "born"),
    ]


def test_facts_of_components():
    """Oracle: analytic. Areas, volumes, places and sizes of a sphere and a ring; chords err 1 %.

    The ring's size is the integral of its squared distance from the centre over the angle
    around its tube, with the area element as weight.
    """
    both = surface(union(ball(0.7, -1.9, 0.1, 0), ring(1.0, 0.4, 1.2, 0, 0)))
    table = sorted(component_table(both), key=lambda part: part.centre[0])
    assert [part.topology.genus for part in table] == [0, 1]
    areas = [4 * np.pi * 0.7**2, 4 * np.pi**2 * 0.4]
    volumes = [4 / 3 * np.pi * 0.7**3, 2 * np.pi**2 * 0.4**2]
    np.testing.assert_allclose([part.area for part in table], areas, rtol=0.01)
    np.testing.assert_allclose([part.volume for part in table], volumes, rtol=0.015)
    np.testing.assert_allclose(table[0].centre, [-1.9, 0.1, 0], atol=2e-3)
    np.testing.assert_allclose(table[1].centre, [1.2, 0, 0], atol=2e-3)
    angle = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    weight = 1 + 0.4 * np.cos(angle)
    square = weight @ (weight**2 + (0.4 * np.sin(angle)) ** 2) / weight.sum()
    np.testing.assert_allclose([p.size for p in table], [0.7, np.sqrt(square)], rtol=5e-3)
    assert sum(part.nodes for part in table) == len(both.points)
    np.testing.assert_allclose(sum(part.area for part in table), both.area, rtol=1e-12)


def test_facts_of_a_curved_mesh():
    """Oracle: algebra. A curved icosphere's nodes are the points of the next finer flat one."""
    (curved,) = component_table(iv.icosphere(1))
    (flat,) = component_table(iv.icosphere(2, order=1))
    assert curved.nodes == flat.nodes
    for name in ("area", "volume", "size"):
        assert getattr(curved, name) == pytest.approx(getattr(flat, name), rel=1e-12)


def test_an_open_component_has_no_volume():
    """Oracle: algebra. Nothing is enclosed: NaN, not a number that depends on the origin."""
    (cut,) = component_table(surface(ball(0.8, 2.6, 0, 0)))
    assert np.isnan(cut.volume)
    assert cut.topology.boundary_loops == 1


@pytest.mark.parametrize("order", [1, 2])
def test_part_of_keeps_points_and_normals(order):
    """Oracle: algebra. The parts of a surface together are the surface, midpoints included."""
    sphere, ring_ = iv.icosphere(1, order=order), iv.torus(1.0, 0.4, (9, 6), order=order)
    points = np.vstack([sphere.points, ring_.points + np.array([5, 0, 0])])
    triangles = np.vstack([sphere.triangles, ring_.triangles + len(sphere.points)])
    normals = np.vstack([sphere.normals, ring_.normals])
    whole = iv.Surface(points, triangles, normals)
    for numbers, expected in ((0, sphere), (1, ring_), ([1, 0], whole)):
        part, nodes = part_of(whole, numbers)
        assert part.order == order
        np.testing.assert_array_equal(part.points, whole.points[nodes])
        np.testing.assert_array_equal(part.normals, whole.normals[nodes])
        np.testing.assert_array_equal(part.triangles, expected.triangles)
    for wrong in (2, -1, []):
        with pytest.raises(iv.ArgumentError, match="A02"):
            part_of(whole, wrong)


def test_the_description_names_every_component():
    """Oracle: analytic. Numbers, places and events in words, a line each."""
    base = surface(union(ball(1.0, -1.5, 0, 0), ball(0.5, 0.5, 0, 0)))
    perturbed = surface(union(ball(1.0, -1.5, 0, 0), ball(0.5, 2.2, 0, 0)))
    lines = describe(match_components(base, perturbed)).splitlines()
    assert len(lines) == 3
    assert lines[0].startswith("component 0 of the base (genus 0, 0 loops, near (-1.5, 0, 0), area")
    assert lines[0].endswith(": matched")
    assert "component 1 of the base" in lines[1]
    assert lines[1].endswith("-> lost")
    assert lines[2].startswith("component 1 of the perturbed (genus 0, 0 loops, near (2.2, 0, 0)")
    assert lines[2].endswith(": born")
