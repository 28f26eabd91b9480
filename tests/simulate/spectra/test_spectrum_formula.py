"""Beamforming against its formula, written out once more in the plainest way."""

import cmath
import math

import numpy as np
import pytest

from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.spectrum import normalise, picture

ARRAYS = [PlanarArray(), PlanarArray(rows=2, columns=3), PlanarArray(rows=3, columns=1, spacing=0.37)]
DIRECTIONS = [(phi, theta) for phi in (0, 1, 45, 90, 133, 180, 270, 359) for theta in (1, 2, 30, 67, 89)]


def phase(array: PlanarArray, m: int, phi: float, theta: float) -> float:
    """k u·d_m: how far element m, counted row by row, is ahead of the centre for a wave from (φ, θ) in degrees."""
    row, column = divmod(m, array.columns)
    x, y = (column - (array.columns - 1) / 2) * array.spacing, (row - (array.rows - 1) / 2) * array.spacing
    phi, theta = math.radians(phi), math.radians(theta)
    return 2 * math.pi * math.cos(theta) * (x * math.cos(phi) + y * math.sin(phi))


@pytest.mark.parametrize("first", [0, 1])
@pytest.mark.parametrize("array", ARRAYS)
def test_spectrum_is_the_magnitude_of_the_steered_sum(array, first):
    """S(φ,θ) = |Σ_m y_m e^{-jk u·d_m}| / √(MN), θ = row + first and φ = column, in degrees."""
    generator = np.random.default_rng(1)
    y = generator.normal(size=(array.elements, 2)) @ [1, 1j]
    found = Beamformer(array, AngularGrid(first)).spectrum(y)
    assert found.shape == (90, 360)
    for phi, theta in DIRECTIONS:
        total = sum(y[m] * cmath.exp(-1j * phase(array, m, phi, theta)) for m in range(array.elements))
        assert found[theta - first, phi] == pytest.approx(abs(total) / math.sqrt(array.elements), abs=1e-9)


def test_manifold_is_the_far_field_of_a_point_source():
    """e^{-jk|s - d_m|} / e^{-jk|s|} -> e^{+jk u·d_m} for a source s = r u, r = 10⁶ wavelengths."""
    array, phi, theta = PlanarArray(), math.radians(217), math.radians(38)
    u = np.array([math.cos(theta) * math.cos(phi), math.cos(theta) * math.sin(phi), math.sin(theta)])
    distance = np.linalg.norm(1e6 * u - array.positions, axis=1)
    expected = np.exp(-2j * np.pi * (distance - 1e6))
    assert array.manifold(np.array(phi), np.array(theta)) == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize(("phi", "theta"), [(0, 30), (359, 30), (200, 40), (90, 75), (17, 5)])
def test_plane_wave_peaks_in_its_own_row_and_column_at_the_array_gain(phi, theta):
    """max S = √(MN) for |y_m| = 1, at row θ and column φ, and nowhere else."""
    array = PlanarArray()
    y = np.exp(1j * np.array([phase(array, m, phi, theta) for m in range(16)]))
    spectrum = Beamformer(array).spectrum(y)
    assert np.argwhere(spectrum > 4 - 1e-9).tolist() == [[theta, phi]]
    assert spectrum.max() == pytest.approx(4)
    u = AngularGrid().dominant_direction(spectrum)
    assert math.degrees(math.asin(u[2])) == pytest.approx(theta)
    assert math.degrees(math.atan2(u[1], u[0])) % 360 == pytest.approx(phi)


def test_last_row_of_a_grid_from_1_degree_is_boresight():
    """At θ = 90° every azimuth is the same direction."""
    beamformer = Beamformer(grid=AngularGrid(1.0))
    y = np.random.default_rng(2).normal(size=(16, 2)) @ [1, 1j]
    assert np.ptp(beamformer.spectrum(y)[89]) < 1e-12
    assert beamformer.spectrum(y)[89, 0] == pytest.approx(abs(y.sum()) / 4)
    assert beamformer.grid.dominant_direction(beamformer.spectrum(np.ones(16))) == pytest.approx([0, 0, 1])


def test_picture_is_magnitude_scaled_from_its_least_to_its_greatest_value():
    """round(255 (S - min S) / (max S - min S))."""
    spectrum = np.full((90, 360), 3.0)
    spectrum[0, 0], spectrum[0, 1], spectrum[0, 2] = 2.0, 7.0, 4.0
    image = picture(spectrum)
    assert image.dtype == np.uint8
    assert image[0, :4].tolist() == [0, 255, 102, 51]
    assert picture(np.full((90, 360), 5.0)).max() == 0
    assert np.isfinite(normalise(np.zeros((90, 360)))).all()
