"""Frames and components: what is told in place, what is aligned, what is left out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import isovary as iv

UNEVEN = np.array([1.0, 1.1, 1.3])


def balls(*droplets, box=3.0, samples=49):
    """Ellipsoids (centre, radius), each 0 on its surface; the largest value of all."""

    def value(p):
        parts = [1 - (((p - np.array(c)) / (r * UNEVEN)) ** 2).sum(axis=-1) for c, r in droplets]
        return np.max(parts, axis=0)

    return iv.ScalarField.from_function(value, ((-box,) * 3, (box,) * 3), (samples,) * 3)


STAYS, GOES = ((-1.0, 0.0, 0.0), 0.6), ((1.6, 0.0, 0.0), 0.45)
COMES = ((-1.0, 0.0, 2.0), 0.3)


def small(*fields, **options):
    return iv.compare(*fields, 0.0, **({"vertices": 300, "pairs": 60, "times": 10} | options))


def test_a_lost_droplet_does_not_move_the_others():
    """Oracle: symmetry. One droplet stays as it is, one is gone: that one alone is named, in its
    place, and the other has not changed, nor moved.
    """
    with pytest.raises(iv.CorrespondenceError, match="C01") as caught:
        small(balls(STAYS, GOES), balls(STAYS))
    assert caught.value.message.count("-> lost") == 1
    assert "born" not in caught.value.message
    result = small(balls(STAYS, GOES), balls(STAYS), only_matching=True)
    assert np.abs(result.motion.apply(result.base.points) - result.base.points).max() < 1e-5
    there = result.base.points[:, 0] < 0.3
    np.testing.assert_array_equal(result.correspondence.found, there)
    assert np.nanmax(np.abs(result.change)) < 1e-5  # the kink between droplets reaches that far
    assert np.isnan(result.change[~there]).all()
    assert np.isnan(result.noise_floor[~there]).all()
    assert set(result.kinds[there]) == {iv.Kind.UNCHANGED}


def turned(field, motion):
    """The field sampled on its own grid after a rigid motion."""
    low, high = field.bounds
    moved = iv.MovedField(field, motion)

    def value(p):
        flat = p.reshape(-1, 3)
        return np.nan_to_num(moved.level_set(flat, 0.0)[0], nan=-5.0).reshape(p.shape[:-1])

    return iv.ScalarField.from_function(value, (low, high), field.values.shape)


def blob(depth=0.0):
    """Four overlapping balls of unequal size, not in one plane: no symmetry."""
    centres = np.array([[0, 0, 0], [0.8, 0.1, 0], [0.1, 0.8, 0.3], [-0.2, -0.3, 0.9]])

    def value(p):
        parts = [
            w * np.exp(-((p - c) ** 2).sum(axis=-1) / 0.5)
            for w, c in zip((1.0, 0.7, 0.5 + depth, 0.6), centres, strict=True)
        ]
        return sum(parts) - 0.4

    return iv.ScalarField.from_function(value, ((-3,) * 3, (3.4,) * 3), (45, 45, 45))


def test_a_mirrored_turned_and_shifted_copy_with_a_change():
    """Oracle: symmetry. The change is that of the unmoved pair; files are in the field's place."""
    plain = small(blob(), blob(0.01))
    motion = iv.RigidMotion(np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, 1]]), [0.2, -0.3, 0.1])
    there = turned(blob(0.01), motion)
    result = small(blob(), there)
    assert result.motion.mirrored
    difference = np.sqrt(((result.change - plain.change) ** 2).mean())
    assert difference < 0.01 * np.sqrt((plain.change**2).mean())
    in_place = result.perturbed_in_place
    assert np.abs(there.value(in_place.points)).max() < 1e-9
    own = iv.Surface(in_place.points, in_place.triangles).normals
    assert (own * in_place.normals).sum(axis=1).min() > 0.9  # outward still
    partners = result.base.points + result.displacement
    assert np.abs(there.value(partners)).max() < 1e-9
    # rays on a mesh of its own, aligned: same story, but for the mesh
    rays = small(blob(), there, correspondence=iv.normal_rays, vertices=500)
    assert rays.motion.mirrored
    assert rays.coverage > 0.95
    reached = rays.base.points + rays.displacement
    assert np.nanmax(np.abs(there.value(reached[rays.correspondence.found]))) < 0.02


def test_a_pure_shift_is_a_rigid_move():
    """Oracle: analytic. Every place is moved rigidly: not bent, not stretched; and by how much."""
    shift = np.array([0.4, 0.0, -0.2])
    base = blob()
    result = small(base, replace(base, origin=base.origin + shift))
    assert set(result.kinds) == {iv.Kind.MOVED}
    assert result.kind_shares["moved rigidly"] == pytest.approx(1)
    said = result.extrinsic()
    along = result.base.normals @ shift
    assert said["normal_displacement_largest_size"] == pytest.approx(np.abs(along).max(), rel=1e-4)
    assert said["hausdorff_distance_aligned"] < 1e-6


def test_what_comes_is_left_out_of_every_way():
    """Oracle: symmetry. One droplet grows by a tenth, another is born: the change is the first's
    alone, carried, by closest points, and on a mesh made anew.
    """
    grown = (STAYS[0], 0.66)
    alone = small(balls(STAYS), balls(grown), vertices=200)
    expected = np.sqrt((alone.change**2).mean())
    for options in ({}, {"correspondence": iv.closest_point}):
        result = small(balls(STAYS), balls(COMES, grown), only_matching=True, **options)
        assert [m.event for m in result.components].count("born") == 1
        assert len(set(iv.component_table(result.perturbed))) == 1
        assert np.sqrt((result.change**2).mean()) == pytest.approx(expected, rel=0.02)
        assert any("born" in note and "C01" in note for note in result.notes)


def test_a_mesh_made_anew_leaves_out_what_comes(monkeypatch):
    """Oracle: symmetry. The same, with the carried mesh refused."""
    from isovary import levels

    monkeypatch.setattr(levels, "_fit_for_elements", lambda surface, image: False)
    grown = (STAYS[0], 0.66)
    result = small(balls(STAYS), balls(COMES, grown), only_matching=True, vertices=400)
    assert len(iv.component_table(result.perturbed)) == 1
    assert result.perturbed.area == pytest.approx(1.21 * result.base.area, rel=1e-3)
    assert any("M16" in note for note in result.notes)


def test_boxes_that_cut_differently_are_refused():
    """Oracle: algebra. A tube cut at z = 1 and 1.06: I05 says to crop; uncut faces may differ."""

    def tube(high, side=1.5):
        return iv.ScalarField.from_function(
            lambda p: 1 - p[..., 0] ** 2 - 1.3 * p[..., 1] ** 2,
            ((-side, -side, -1), (side, side, high)),
            (21, 21, 17),
        )

    with pytest.raises(iv.FieldError, match=r"crop both.*I05"):
        small(tube(1.0), tube(1.06))
    result = small(tube(1.0), tube(1.0, side=1.7))
    assert np.sqrt((result.change**2).mean()) < 1e-6


def test_members_and_matches_do_not_go_together():
    """Oracle: algebra. Only a carried mesh goes through members."""
    with pytest.raises(iv.ArgumentError, match=r"through.*A02"):
        small(blob(), blob(0.02), through=[blob(0.01)], correspondence=iv.normal_rays)


@pytest.mark.parametrize("isometric", [True, False])
def test_members_carry_farther(isometric):
    """Oracle: convergence. Through a member halfway the change is the same as at once."""
    options = {"isometric": isometric}
    once = small(blob(), blob(0.04), **options)
    twice = small(blob(), blob(0.04), through=[blob(0.02)], **options)
    difference = np.sqrt(((once.change - twice.change) ** 2).mean())
    limit = 1e-3 if isometric else 0.1  # the normals of the halfway surface are others
    assert difference < limit * np.sqrt((once.change**2).mean())
    assert difference > 0


def test_rounding_is_noise():
    """Oracle: symmetry. A copy a million sizes away: what rounding leaves is not significant."""
    base = blob()
    there = replace(base, origin=base.origin + 4e6)
    result = small(replace(base, origin=base.origin + 2e6), there)
    assert result.significant.mean() < 0.01
