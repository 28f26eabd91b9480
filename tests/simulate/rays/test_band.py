"""The responses over a band, and at several frequencies, by rays."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.files.errors import ParameterError
from scenes.scene.description import SPEED_OF_LIGHT
from scenes.scene.materials import RadioMaterial
from simulate.rays.core.propagation import Propagation
from simulate.rays.tracer import Tracer
from simulate.spectra.band import Band
from tests.small_scene import CABINET, small_scene

BAND = Band(20e6, 9)
CARRIER = 915e6


def at(scene, frequency):
    """The scene at another frequency, with the same values of its materials and the same array in metres."""
    spacing = scene.gateway.spacing * frequency / scene.frequency
    return replace(scene, frequency=float(frequency), gateway=replace(scene.gateway, spacing=spacing))


def off_db(found, truth):
    return 20 * np.log10(np.linalg.norm(found - truth) / np.linalg.norm(truth))


@pytest.fixture(scope="module")
def scene():
    return small_scene(CABINET)


@pytest.fixture(scope="module")
def positions(scene):
    return np.random.default_rng(0).uniform(*scene.transmitter.region, (5, 3))


def test_line_of_sight_in_closed_form(scene, positions):
    tracer = Tracer(scene, Propagation(max_depth=0))
    found = tracer.band_responses(positions, BAND)
    distance = np.linalg.norm(positions[:, None] - tracer.elements.positions, axis=-1)[..., None]
    wavelength = SPEED_OF_LIGHT / BAND.frequencies(CARRIER)
    expected = wavelength / (4 * np.pi * distance) * np.exp(-2j * np.pi * distance / wavelength)
    assert found.shape == (5, 16, 9)
    assert off_db(found, expected) < -90


def test_band_is_one_tracer_for_each_subcarrier(scene, positions):
    """With reflections, transmissions and diffraction, which change with the frequency, too."""
    tracer = Tracer(scene, Propagation(max_depth=2, rays=20_000))
    found = tracer.band_responses(positions, BAND)
    assert off_db(found[..., BAND.carrier], tracer.responses(positions)) < -50
    for number in (0, 8):
        other = tracer.at_frequency(at(scene, BAND.frequencies(CARRIER)[number]))
        assert off_db(found[..., number], other.responses(positions)) < -50


def test_diffuse_reflection_over_a_band(positions):
    rough = RadioMaterial("rough", 5.0, 0.02, 0.1, scattering_coefficient=0.7)
    scene = small_scene(CABINET)
    floor = replace(scene.objects[0], material="rough")
    scene = replace(scene, objects=(floor, CABINET), materials={**scene.materials, "rough": rough})
    propagation = Propagation(max_depth=1, los=False, specular=False, diffraction=False, diffuse=True, patches=100)
    many, tracer = Band(20e6, 32), Tracer(scene, propagation)
    found = tracer.band_responses(positions, many)  # 32 subcarriers are interpolated from fewer frequencies
    for number in (0, 31):
        other = Tracer(at(scene, many.frequencies(CARRIER)[number]), propagation)
        assert off_db(found[..., number], other.responses(positions)) < -60


def test_sionnas_solver_knows_no_band(scene, positions):
    with pytest.raises(ParameterError, match="expected no band where Sionna's path solver is used"):
        Tracer(scene, Propagation(max_depth=1, sionna=True, rays=500)).band_responses(positions, BAND)


def test_frequency_at_which_a_conductor_is_none_is_refused(scene):
    weak = replace(scene.materials["metal"], conductivity=100.0)  # a loss of 1965 at 915 MHz, 599 at 3 GHz
    scene = replace(scene, materials={**scene.materials, "metal": weak})
    tracer = Tracer(scene, Propagation(max_depth=1, diffraction=False, rays=500))
    with pytest.raises(ParameterError, match="frequencies: expected frequencies at which the same objects are"):
        tracer.at_frequency(at(scene, 3e9))


def test_sums_at_fewer_frequencies_tell_all_subcarriers(scene, positions):
    """256 subcarriers are more than the sums are made at, 8 are fewer."""
    tracer = Tracer(scene, Propagation(max_depth=2, rays=20_000))
    many, few = Band(20e6, 256), Band(20e6, 8)
    found, expected = tracer.band_responses(positions, many), tracer.band_responses(positions, few)
    assert off_db(found[..., ::32], expected) < -80
