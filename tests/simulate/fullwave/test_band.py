"""All frequencies of a band from one full-wave run."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.ledger.exact_fields import free_space_response
from scenes.checks.occupancy import element_positions
from scenes.files.errors import InputError
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.materials import RadioMaterial
from scenes.scene.orientation import facing
from scenes.scene.shapes import sheet
from simulate.fullwave.all_elements import stored_field
from simulate.fullwave.dipole import element_direction, transmitter_direction
from simulate.fullwave.pulse import FourierSums, Pulse, spectrum
from simulate.fullwave.run_plan import BandPlan, Plan
from simulate.fullwave.stored_field import MARGIN, read_stored_field
from simulate.fullwave.yee_grid import YeeGrid, numerical_frequency
from simulate.spectra.band import Band

BAND = Band(40e6, 4)
CARRIER, CELL, STEPS = 915e6, 0.03, 700
FAR = SceneObject("far", sheet((-50, 0, 0), (0, 1, 0), (0, 0, 1)), "metal")  # a scene needs an object


@pytest.fixture(scope="module")
def scene() -> Scene:
    gateway = Gateway((0.0, 0.0, 0.0), facing((-1, 0, 0)), rows=2, columns=1, pattern="dipole")
    region = Transmitter((-0.65, -0.05, -0.05), (-0.55, 0.05, 0.05), pattern="dipole")
    return Scene("free", CARRIER, gateway, region, (FAR,), {"metal": RadioMaterial("metal", 1.0, 1e7, 0.002)})


@pytest.fixture(scope="module")
def field(scene, tmp_path_factory):
    """The field of a small domain without objects."""
    grid, region = YeeGrid((-1.05, -0.54, -0.54), CELL, (48, 36, 36)), scene.transmitter.region
    box = np.stack(
        [
            np.floor((region[0] - grid.origin) / CELL) - MARGIN,
            np.ceil((region[1] - grid.origin) / CELL) + MARGIN,
        ]
    ).astype(int)
    frequencies = BAND.frequencies(CARRIER)
    band = BandPlan(frequencies, frequencies, 5e-9)
    planned = Plan(grid, numerical_frequency(scene.wavelength, CELL), STEPS, box, 500, band)
    return stored_field(scene, planned, tmp_path_factory.mktemp("field"))


def test_every_subcarrier_is_the_field_of_a_dipole(scene, field):
    positions = np.random.default_rng(0).uniform(*scene.transmitter.region, (50, 3))
    found = field.band_responses(positions, BAND)
    elements = element_positions(scene.gateway, scene.wavelength)
    directions = element_direction(scene), transmitter_direction(scene)
    for number, frequency in enumerate(BAND.frequencies(CARRIER)):
        for element, place in enumerate(elements):
            expected = free_space_response(place, directions[0], positions, directions[1], frequency)
            error = np.linalg.norm(found[:, element, number] - expected) / np.linalg.norm(expected)
            assert error < 0.06, (number, element)  # waves along an axis of the cells are too short
    np.testing.assert_allclose(found[..., BAND.carrier], field.responses(positions), rtol=1e-4)


def test_band_is_written_and_read(field, tmp_path):
    field.write(tmp_path / "field.npz")
    again = read_stored_field(tmp_path / "field.npz")
    assert again.band is not None
    np.testing.assert_array_equal(again.band.values, field.band.values)
    np.testing.assert_array_equal(again.band.frequencies, field.band.frequencies)


def test_band_with_other_numbers_of_frequencies_is_refused(field, tmp_path):
    wrong = replace(field, band=replace(field.band, solved=field.band.solved[:-1]))
    wrong.write(tmp_path / "field.npz")
    with pytest.raises(InputError, match="expected the field at each frequency of its band"):
        read_stored_field(tmp_path / "field.npz")


def test_pulse_has_no_direct_current_and_hardly_any_beyond_its_reach():
    pulse, step = Pulse(1e9), 2e-11
    current = pulse.current(step * (np.arange(int(pulse.duration / step)) + 0.5))
    at = np.abs(spectrum(current, np.array([0.0, 0.9e9, 1e9, 1.1e9, 1.7e9]), step))
    assert at[0] < 1e-4 * at[2] and at[4] < 1e-4 * at[2]
    assert 0.7 * at[2] < at[1] < at[2] and 0.7 * at[2] < at[3] < at[2]


def test_fourier_sums_are_those_of_the_whole_signal():
    pulse, step = Pulse(1e9), 2e-11
    every, count = pulse.samples_every(step, 1.05e9), 2 * int(pulse.duration / step)
    frequencies, times = np.array([0.95e9, 1e9, 1.05e9]), step * np.arange(count)
    sums = FourierSums(frequencies, 2, step, every)
    signal = np.stack([pulse.current(times), pulse.current(times - 3e-9)], axis=1)
    for number in range(0, count, every):
        sums.add(number, signal[number].astype(np.float32))
    expected = np.exp(-2j * np.pi * np.outer(frequencies, times)) @ signal
    assert every > 5
    np.testing.assert_allclose(sums.total(), expected, atol=1e-4 * np.abs(expected).max())
