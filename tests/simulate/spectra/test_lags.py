"""Lags of an array: the space of its spectra, and the grid and spacing found again from spectra alone."""

from pathlib import Path

import numpy as np
import pytest

from simulate.dataset.dataset_folder import read_dataset
from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.identification import fit_grids
from simulate.spectra.lags import EXAMINED, fit_lags, lag_functions, lag_vectors
from simulate.spectra.phase_retrieval import GOOD, retrieve_responses
from simulate.spectra.spectrum import evenly, normalise, picture, spectrum_of
from tests.simulate.spectra.random_spectra import random_responses

MEASURED = Path(__file__).parents[4] / "shared" / "data" / "rfid-s23-160"


def spectra_of(responses: np.ndarray, array: PlanarArray, grid: AngularGrid) -> np.ndarray:
    """|Σ y_m e^{-jk u·d_m}| on a grid, written once more from the equations; magnitudes, any unit."""
    elevation, azimuth = np.meshgrid(np.radians(grid.elevations_deg), np.radians(grid.azimuths_deg), indexing="ij")
    field = np.zeros((len(responses), 90, 360), complex)
    for m, (x, y, _) in enumerate(array.positions):
        phase = 2 * np.pi * np.cos(elevation) * (x * np.cos(azimuth) + y * np.sin(azimuth))
        field += responses[:, m, None, None] * np.exp(-1j * phase)
    return np.abs(field)


@pytest.mark.parametrize(("rows", "columns", "functions"), [(4, 4, 49), (1, 2, 3), (2, 3, 15)])
def test_an_array_has_so_many_lag_functions_and_they_are_independent(rows, columns, functions):
    array = PlanarArray(rows, columns, 0.45)
    values = lag_functions(array, *np.random.default_rng(0).uniform(0, [[2 * np.pi], [np.pi / 2]], (2, 500)))
    assert values.shape == (500, functions) and np.linalg.matrix_rank(values) == functions
    assert len(lag_vectors(array)) == (functions + 1) / 2


@pytest.mark.parametrize("first", [0.0, 1.0])
def test_lags_of_a_spectrum_are_those_of_its_responses(first):
    array, grid = PlanarArray(3, 4, 0.48), AngularGrid(first)
    responses = random_responses(3, 12)
    spectra = spectra_of(responses, array, grid)
    span = np.ptp(spectra, axis=(1, 2))
    found = fit_lags(normalise(spectra), Beamformer(array, grid))
    assert found.residual.max() < 1e-6
    np.testing.assert_allclose(found.offset * span, spectra.min(axis=(1, 2)), atol=1e-6)
    x, y = np.arange(12) % 4, np.arange(12) // 4
    for index, (dx, dy, dz) in enumerate(np.round(lag_vectors(array) / array.spacing, 9)):
        assert dz == 0
        apart = (x[:, None] - x == dx) & (y[:, None] - y == dy)
        expected = (responses[:, :, None] * responses[:, None].conj() * apart).sum(axis=(1, 2)) / span**2
        # S² = Σ R e^{-jk u·Δ} without the 1/MN of a beamformer, whose spectra are smaller by √MN
        np.testing.assert_allclose(found.lags[:, index] / array.elements, expected, atol=1e-6)


@pytest.mark.parametrize(("first", "spacing"), [(0.0, 0.491), (1.0, 0.5), (0.0, 0.56)])
def test_grid_and_spacing_are_found_from_pictures(first, spacing):
    spectra = spectra_of(random_responses(12, 16), PlanarArray(spacing=spacing), AngularGrid(first))
    residual, found = fit_grids(spectrum_of(picture(spectra)))[0]
    assert found.grid == AngularGrid(first)
    assert found.array.spacing == pytest.approx(spacing, abs=1e-3)
    assert 0.25 < residual < 0.35  # rounding to 8 bits


def test_another_array_is_told_by_its_residual():
    spectra = normalise(spectra_of(random_responses(8, 64), PlanarArray(8, 8), AngularGrid()))
    assert fit_grids(spectra)[0][0] > 5
    assert fit_lags(spectra, Beamformer(PlanarArray(8, 8))).median_residual < 0.1


@pytest.mark.skipif(not MEASURED.is_dir(), reason="the measured sample is not beside this checkout")
def test_measured_pictures_begin_at_the_horizon_and_their_array_is_16_cm_at_920_mhz():
    spectra = spectrum_of(read_dataset(MEASURED).pictures)
    _, found = fit_grids(evenly(spectra, EXAMINED))[0]
    assert found.grid == AngularGrid(0.0)
    assert found.array.spacing == pytest.approx(0.491, abs=0.003)
    residual = fit_lags(spectra, found).median_residual
    assert residual < 0.35
    assert fit_lags(spectra, Beamformer(PlanarArray(spacing=0.5), AngularGrid(1.0))).median_residual > 5 * residual
    assert (retrieve_responses(spectra[::8], found).residual < GOOD).all()
