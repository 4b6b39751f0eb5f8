"""Signatures against those of another program."""

from __future__ import annotations

import numpy as np
import pytest

import isovary as iv


@pytest.fixture(scope="module")
def peer():
    return pytest.importorskip("pyFM.signatures", reason="pyFM (pyfmaps) is not installed")


@pytest.fixture(scope="module")
def pairs():
    sphere = iv.icosphere(2)
    surface = iv.Surface(sphere.points * [1.0, 1.2, 1.7], sphere.triangles)
    return iv.eigenpairs(iv.fem(surface), 80)


def test_heat_kernel_signature_is_that_of_pyfm(peer, pairs):
    """Oracle: peer. pyFM's HKS of the same eigenpairs, unscaled; rounding only."""
    times = iv.diffusion_times(pairs, 30)
    other = peer.HKS(pairs.values, pairs.vectors, times)
    np.testing.assert_allclose(iv.heat_kernel_signature(pairs, times), other, rtol=1e-10)


def test_wave_kernel_signature_is_that_of_pyfm(peer, pairs):
    """Oracle: peer. pyFM's scaled WKS; it takes the logarithms of the energies."""
    energies = iv.wave_energies(pairs, 30)
    for steps in (7, 3):
        width = steps * np.log(energies[1] / energies[0])
        ours = iv.wave_kernel_signature(pairs, energies, width=width)
        other = peer.WKS(pairs.values, pairs.vectors, np.log(energies), width, scaled=True)
        np.testing.assert_allclose(ours, other, rtol=1e-10)


def test_heat_kernel_is_that_of_pyfm(peer, pairs):
    """Oracle: peer. pyFM's HKS "of landmarks": its columns are the times of one source each."""
    times = iv.diffusion_times(pairs, 7)
    sources = [3, 40]
    other = peer.lm_HKS(pairs.values, pairs.vectors, sources, times)
    ours = iv.heat_kernel(pairs, times, sources).reshape(len(pairs.vectors), -1)
    np.testing.assert_allclose(ours, other, rtol=1e-10, atol=1e-12 * other.max())
