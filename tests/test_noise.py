"""Noise floor and rigid part, on known errors and motions."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import ELLIPSOID_ISOVALUE, ellipsoid_field

import isovary as iv


@pytest.mark.parametrize("order", [1, 2])
def test_floor_is_extrapolated_by_the_meshes_refinement(order):
    """Oracle: algebra. With r times fewer vertices and a difference d: d / (r^order - 1), or d."""
    fine, coarse = (
        iv.marching_cubes(ellipsoid_field(), ELLIPSOID_ISOVALUE, vertices=count, order=order)
        for count in (400, 320)
    )
    ratio = len(np.unique(fine.corners)) / len(np.unique(coarse.corners))
    factor = max(1.0, 1 / (ratio**order - 1))
    assert factor > 1.2
    change, other = np.full((len(fine.points), 2), 0.3), np.full((len(coarse.points), 2), 0.1)
    np.testing.assert_allclose(iv.noise_floor(fine, change, coarse, other), 0.2 * factor)


def test_unknown_nodes_do_not_dilute_the_floor(ellipsoid):
    """Oracle: algebra. Where half of the nodes are NaN, the floor is that of the rest."""
    coarse = iv.marching_cubes(ellipsoid_field(), ELLIPSOID_ISOVALUE, vertices=150)
    change = np.full((len(ellipsoid.points), 1), 0.3)
    change[ellipsoid.points[:, 2] > 0] = np.nan
    floor = iv.noise_floor(ellipsoid, change, coarse, np.full((len(coarse.points), 1), 0.1))
    known = np.isfinite(floor)
    np.testing.assert_allclose(floor[known], 0.2)
    assert known[ellipsoid.points[:, 2] <= 0].all()
    assert not known.all()
