"""Subcarriers, and responses that are interpolated over a band."""

import numpy as np
import pytest

from scenes.files.errors import ParameterError
from simulate.spectra.band import Band, chebyshev_points, interpolated, stated_band


@pytest.mark.parametrize("subcarriers", [5, 64])
def test_one_subcarrier_is_the_carrier(subcarriers):
    band = Band(20e6, subcarriers)
    frequencies = band.frequencies(915e6)
    assert frequencies[band.carrier] == 915e6
    np.testing.assert_allclose(np.diff(frequencies), 20e6 / subcarriers)


@pytest.mark.parametrize(
    ("bandwidth", "subcarriers"),
    [(20e6, None), (None, 64), ("20 megahertz", 64), (0, 64), (20e6, 1), (20e6, 10_000)],
)
def test_band_that_is_none_is_refused(bandwidth, subcarriers):
    with pytest.raises(ParameterError, match=r"(bandwidth|subcarriers): expected"):
        stated_band(bandwidth, subcarriers)


def test_band_that_is_too_wide_is_refused():
    with pytest.raises(ParameterError, match=r"bandwidth: .* 183 MHz, found 200 MHz"):
        Band(200e6, 64).frequencies(915e6)


def test_responses_with_delays_are_interpolated():
    """Paths of up to 100 ns over 20 MHz turn twice; 12 frequencies tell all 64."""
    frequencies, generator = Band(20e6, 64).frequencies(915e6), np.random.default_rng(0)
    at, delays = chebyshev_points(frequencies[0], frequencies[-1], 12), generator.uniform(0, 100e-9, 50)
    truth = np.exp(-2j * np.pi * np.outer(delays, frequencies))
    found = interpolated(at, np.exp(-2j * np.pi * np.outer(delays, at)), frequencies, 50e-9)
    assert np.abs(found - truth).max() < 1e-4
