"""Fields and surfaces that several tests share."""

from __future__ import annotations

import numpy as np
import pytest

import isovary as iv


def ellipsoid_field(axes=(1.0, 1.0, 2.0), samples=25, margin=1.4, shift=(0.0, 0.0, 0.0), turn=None):
    """exp(-|x / axes|^2 / 2): the isosurface at exp(-1/2) is the ellipsoid with these semi-axes."""
    turn = np.eye(3) if turn is None else turn
    high = margin * np.max(axes) * np.ones(3)

    def value(points):
        local = (points - np.array(shift)) @ turn
        return np.exp(-0.5 * ((local / np.array(axes)) ** 2).sum(axis=-1))

    return iv.ScalarField.from_function(value, (-high, high), (samples,) * 3, logarithmic=True)


ELLIPSOID_ISOVALUE = float(np.exp(-0.5))


@pytest.fixture(scope="session")
def ellipsoid() -> iv.Surface:
    return iv.marching_cubes(ellipsoid_field(), ELLIPSOID_ISOVALUE, vertices=400)


@pytest.fixture(scope="session")
def sphere_pairs() -> iv.Eigenpairs:
    return iv.eigenpairs(iv.fem(iv.icosphere(3)), 100)
