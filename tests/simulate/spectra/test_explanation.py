"""Arrays, grids and quantities that explain pictures of other programs, on pictures made from the equations."""

import numpy as np
import pytest

from simulate.spectra import explanation
from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.explanation import explain
from simulate.spectra.lags import LagSpace, decibel_residual, median_residual, power_residual
from simulate.spectra.spectrum import magnitudes, normalise, picture, spectrum_of
from tests.simulate.spectra.random_spectra import random_spectra


def in_decibels(spectra: np.ndarray, floor: float) -> np.ndarray:
    """Levels that are cut at a floor below each maximum, as many programs draw them."""
    return (20 * np.log10(spectra / spectra.max(axis=(1, 2), keepdims=True))).clip(-floor)


@pytest.fixture
def up_to_3(monkeypatch):
    """A short search: squares of up to 3 × 3, lines of up to 5."""
    for name, few in (("SQUARES", 2), ("LINES_ALONG_X", 4), ("LINES_ALONG_Y", 4)):
        monkeypatch.setattr(explanation, name, getattr(explanation, name)[:few])


@pytest.mark.usefixtures("up_to_3")
@pytest.mark.parametrize("shape", [(1, 5), (3, 3), (3, 2)])
@pytest.mark.parametrize("quantity", ["magnitude", "power", "decibels"])
def test_array_and_quantity_are_found(shape, quantity):
    truth = Beamformer(PlanarArray(*shape, 0.48), AngularGrid(1.0))
    spectra = random_spectra(truth)
    drawn = {"magnitude": spectra, "power": spectra**2, "decibels": in_decibels(spectra, 40)}[quantity]
    found = explain(picture(drawn))
    assert (found.beamformer, found.scale) == (truth, quantity) and found.residual < 0.4


@pytest.mark.usefixtures("up_to_3")
def test_nothing_explains_noise_or_pictures_without_levels():
    noise = np.random.default_rng(0).integers(0, 256, (4, 90, 360), dtype=np.uint8)
    assert explain(noise) is None and explain(noise // 100) is None


def test_quantity_of_a_known_array():
    truth = Beamformer(PlanarArray(2, 5, 0.7), AngularGrid(89.0, -1.0))
    found = explain(picture(random_spectra(truth) ** 2), truth.array)
    assert (found.beamformer, found.scale) == (truth, "power")
    assert explain(picture(random_spectra(truth) ** 2), PlanarArray(2, 5, 0.5)) is None


def test_power_of_an_array_is_not_taken_for_the_magnitude_of_a_larger_one():
    """The square of a spectrum of 4 × 4 elements has the lags of 7 × 7."""
    small, large = Beamformer(), Beamformer(PlanarArray(7, 7))
    pictures = picture(random_spectra(small) ** 2)
    assert median_residual(spectrum_of(pictures), large, "magnitude") < 0.6
    assert power_residual(LagSpace.of(small), spectrum_of(pictures)).max() < 0.35


@pytest.mark.parametrize("floor", [20.0, 45.0])
def test_range_in_decibels_and_magnitudes_are_found(floor):
    beamformer = Beamformer(PlanarArray(2, 3))
    spectra = random_spectra(beamformer)
    levels = spectrum_of(picture(in_decibels(spectra, floor)))
    residual, decibels = decibel_residual(LagSpace.of(beamformer), levels)
    reached = 20 * np.log10(spectra.max(axis=(1, 2)) / spectra.min(axis=(1, 2)))
    np.testing.assert_allclose(decibels, np.minimum(floor, reached), rtol=0.02)
    assert residual.max() < 0.6
    low = spectra.max(axis=(1, 2), keepdims=True) * 10 ** (-np.minimum(floor, reached)[:, None, None] / 20)
    expected = normalise(np.maximum(spectra, low))
    assert np.abs(magnitudes(levels, "decibels", decibels) - expected).max() < 0.02


def test_grid_whose_last_column_repeats_the_first_is_found(monkeypatch):
    monkeypatch.setattr(explanation, "SQUARES", [(4, 4)])
    monkeypatch.setattr(explanation, "LINES_ALONG_X", [(1, 2)])
    monkeypatch.setattr(explanation, "LINES_ALONG_Y", [(2, 1)])
    truth = Beamformer(PlanarArray(spacing=0.5), AngularGrid(90.0, -1.0, 360 / 359))  # WideGS
    assert explain(picture(random_spectra(truth))).beamformer == truth
