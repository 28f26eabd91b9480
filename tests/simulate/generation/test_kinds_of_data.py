"""Datasets over a band, of several frequencies, and of a receiver that moves: what is written, and read again."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import bisplat
from learn.evaluation.check import check
from scenes.checks.occupancy import element_positions
from scenes.files.errors import InputError
from scenes.scene.description import SPEED_OF_LIGHT
from simulate.dataset.dataset_folder import read_dataset
from simulate.exchange.convert import convert
from simulate.exchange.reading_options import Conversion
from simulate.generation.reciprocity import element_offsets, reciprocal
from simulate.generation.simulation import simulate
from simulate.rays.chain_solver import Found
from simulate.rays.core.propagation import Propagation
from simulate.rays.core.shooting import reversed_sequences
from simulate.rays.tracer import Tracer
from simulate.spectra.band import Band
from simulate.spectra.measurement import Measurement
from simulate.spectra.spectrum import normalise
from tests.folders import contents
from tests.small_scene import small_scene

SIGHT = Propagation(max_depth=0)


@pytest.fixture(scope="module")
def scene():
    found = small_scene()
    return replace(found, gateway=replace(found.gateway, rows=2, columns=3))


@pytest.fixture(scope="module")
def over_band(scene, tmp_path_factory):
    folder = tmp_path_factory.mktemp("band") / "data"
    return simulate(scene, folder, 4, propagation=SIGHT, bandwidth="20 MHz", subcarriers=6)


@pytest.fixture(scope="module")
def of_three(scene, tmp_path_factory):
    folder = tmp_path_factory.mktemp("three") / "data"
    simulate(scene, folder, 5, propagation=SIGHT, frequencies=("2.4 GHz", 915e6, 1e9))
    return folder


@pytest.fixture(scope="module")
def moving(scene, tmp_path_factory):
    return simulate(scene, tmp_path_factory.mktemp("moving") / "data", 4, propagation=SIGHT, moving="receiver")


def sight(distance, frequency):
    wavelength = SPEED_OF_LIGHT / frequency
    return wavelength / (4 * np.pi * distance) * np.exp(-2j * np.pi * distance / wavelength)


def test_band_is_in_the_folder(over_band):
    assert over_band.band == Band(20e6, 6) and over_band.band_responses.shape == (4, 6, 6)
    np.testing.assert_array_equal(over_band.band_responses[..., 3], over_band.responses)
    assert "6 subcarriers over 20 MHz" in repr(over_band)
    assert "delay spread" in check(over_band.folder).description()["band"]


@pytest.mark.parametrize(
    "kind",
    [
        {"bandwidth": "20 MHz", "subcarriers": 3},
        {"frequencies": ("2.4 GHz", "5 GHz"), "moving": "receiver"},
        {"moving": "both", "transmitters": 2, "power_db": True},
        {"measurement": Measurement(snr_db=20, phase_noise_deg=5), "placement": "path"},
    ],
)
def test_each_kind_is_made_again_to_the_last_byte(kind, tmp_path):
    """With a place whose objects do not use the materials in the order in which they are listed."""
    simulate("closet", tmp_path / "first", 4, propagation=SIGHT, **kind)
    simulate(tmp_path / "first", tmp_path / "again")
    assert contents(tmp_path / "again") == contents(tmp_path / "first")


def test_noise_is_independent_at_each_subcarrier(scene, tmp_path):
    kind = {"propagation": SIGHT, "bandwidth": 20e6, "subcarriers": 8}
    noisy = simulate(scene, tmp_path / "noisy", 4, measurement=Measurement(snr_db=0), **kind)
    ideal = simulate(scene, tmp_path / "ideal", 4, **kind)
    noise = noisy.band_responses - ideal.band_responses
    assert np.abs(np.diff(noise, axis=-1)).min() > 1e-3 * np.abs(noise).max()
    # The pictures are those of the carrier, whose noise no other subcarrier has.
    np.testing.assert_array_equal(noisy.band_responses[..., 4], noisy.responses)
    of_carrier = noisy.beamformer.spectrum(noisy.responses)
    np.testing.assert_allclose(noisy.spectra, normalise(of_carrier), atol=0.51 / 255)


@pytest.mark.usefixtures("quick_fits")
def test_a_model_of_one_of_several_frequencies_is_evaluated_at_this_one(scene, tmp_path):
    simulate(scene, tmp_path / "two", 40, propagation=SIGHT, frequencies=("2.4 GHz", 915e6))
    run = bisplat.train(read_dataset(tmp_path / "two", "2.4 GHz"), tmp_path / "run")
    assert run.dataset().frequency.hertz == 2.4e9 and bisplat.load_run(tmp_path / "run").frequency == 2.4e9
    assert bisplat.evaluate(run, ceiling=False).metrics()["ssim_median"] > 0.5


def test_every_frequency_has_every_position(scene, of_three):
    positions = read_dataset(of_three, 1e9).positions
    for hertz in (915e6, 1e9, 2.4e9):
        found = read_dataset(of_three, hertz)
        np.testing.assert_array_equal(found.positions, positions)
        distance = np.linalg.norm(
            positions[:, None] - element_positions(scene.gateway, scene.wavelength), axis=-1
        )  # the array keeps its size in metres
        np.testing.assert_allclose(found.responses, sight(distance, hertz), rtol=2e-3)
        assert found.array.spacing == pytest.approx(0.5 * hertz / 915e6)
        assert sorted([*found.train, *found.test]) == list(range(5))
        assert found.identification.residual is None or found.identification.residual < 0.6
    assert (of_three / "freq.txt").read_text().split()[::5] == ["0.915", "1", "2.4"]
    parts = [set(map(int, (of_three / f"{part}_index.txt").read_text().split())) for part in ("train", "test")]
    assert {(number - 1) % 5 for number in parts[0]}.isdisjoint((number - 1) % 5 for number in parts[1])


def test_frequency_that_a_folder_lacks_is_refused(of_three, over_band):
    for folder, asked, found in (
        (of_three, "5 GHz", "5 GHz, found those of 915 MHz, 1 GHz, 2.4 GHz"),
        (over_band.folder, "5 GHz", "5 GHz, found those of 915 MHz"),
        (of_three, None, "found 915 MHz to 2.4 GHz"),
        (of_three, 2.4, "frequency: expected hertz"),
    ):
        with pytest.raises(InputError, match=found):
            read_dataset(folder, asked)


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (lambda lines: None, "found no such file"),
        (lambda lines: lines[::-1], "found another order"),
        (lambda lines: ["0.9", *lines[1:]], "found 900 MHz, 915 MHz, 1 GHz, 2.4 GHz"),
    ],
)
def test_frequencies_that_differ_from_those_simulated_are_a_problem(of_three, tmp_path, fault, words):
    folder = shutil.copytree(of_three, tmp_path / "data")
    lines = fault((folder / "freq.txt").read_text().split())
    (folder / "freq.txt").unlink() if lines is None else (folder / "freq.txt").write_text("\n".join(lines))
    expected = "freq.txt: expected 915 MHz, 1 GHz, 2.4 GHz, as metadata.json lists, "
    assert any(expected in each and each.endswith(words) for each in check(folder).problems)
    with pytest.raises(InputError, match=expected):
        read_dataset(folder, "2.4 GHz")


def test_one_frequency_becomes_a_dataset_of_its_own(of_three, tmp_path):
    said = convert(of_three, tmp_path / "one", Conversion(frequency="2.4 GHz"))
    one, of_folder = read_dataset(tmp_path / "one"), read_dataset(of_three, "2.4 GHz")
    assert said == ["kept the spectra of 2.4 GHz: 5 (freq.txt lists 915 MHz, 1 GHz, 2.4 GHz)"]
    for name in ("pictures", "responses", "positions", "train", "test"):
        np.testing.assert_array_equal(getattr(one, name), getattr(of_folder, name))


KINDS = {
    "frequencies_hz": {"frequencies": ("2.4 GHz",)},
    "moving": {"moving": "receiver"},
    "band": {"bandwidth": "20 MHz", "subcarriers": 4},
}


@pytest.mark.parametrize("key", KINDS)
def test_a_plain_simulation_does_not_take_a_folder_of_another_kind(scene, tmp_path, key):
    positions = scene.transmitter.region_min + np.array([[0.3], [0.4], [0.5]])
    simulate(scene, tmp_path, positions=positions, propagation=SIGHT, **KINDS[key])
    before = contents(tmp_path)
    with pytest.raises(InputError, match=f"{key} is .*, not"):
        simulate(scene, tmp_path, positions=positions, propagation=SIGHT)
    assert contents(tmp_path) == before


def test_array_that_moves_in_closed_form(scene, moving):
    elements = moving.positions[:, None] + element_offsets(scene.gateway, scene.wavelength)
    distance = np.linalg.norm(elements - scene.gateway.position, axis=-1)
    np.testing.assert_allclose(moving.responses, sight(distance, 915e6), rtol=2e-3)
    low, high = scene.transmitter.region
    assert (elements.min((0, 1)) >= low - 1e-6).all() and (elements.max((0, 1)) <= high + 1e-6).all()
    assert json.loads((moving.folder / "metadata.json").read_text())["moving"] == "receiver"


def test_array_that_moves_over_a_band_in_closed_form(scene, tmp_path):
    made = simulate(
        scene, tmp_path / "data", 3, propagation=SIGHT, moving="receiver", bandwidth="40 MHz", subcarriers=5
    )
    elements = made.positions[:, None] + element_offsets(scene.gateway, scene.wavelength)
    distance = np.linalg.norm(elements - scene.gateway.position, axis=-1)
    for subcarrier, hertz in enumerate(made.band.frequencies(915e6)):
        np.testing.assert_allclose(made.band_responses[..., subcarrier], sight(distance, hertz), rtol=2e-3)


@pytest.mark.parametrize(
    ("pattern", "received", "sent"), [("iso", "V", "V"), ("dipole", "V", "V"), ("dipole", "V", "H"), ("iso", "H", "V")]
)
def test_moving_array_receives_what_a_fixed_one_does(scene, pattern, received, sent):
    """Reciprocity, with reflections, patterns and polarisations: the same pairs of places, the chains reversed."""
    tilted = tuple(Rotation.from_euler("x", 20, True).as_quat())
    scene = replace(
        scene,
        gateway=replace(scene.gateway, pattern=pattern, polarization=received),
        transmitter=replace(scene.transmitter, pattern=pattern, polarization=sent, orientation=tilted),
    )
    propagation = Propagation(max_depth=2, diffraction=False, rays=20_000)
    moves = Tracer(reciprocal(scene, scene.gateway.position), propagation)
    offsets = element_offsets(scene.gateway, scene.wavelength)
    found = Found(np.ascontiguousarray(reversed_sequences(moves.found.reflected)), None)
    place = np.array([[2.4, 0.1, 1.3]])
    stands = Tracer(replace(scene, gateway=replace(scene.gateway, position=tuple(place[0]))), propagation, found=found)
    expected = stands.responses(np.array([scene.gateway.position]))[0]
    error = np.linalg.norm(moves.responses(place + offsets)[:, 0] - expected) / np.linalg.norm(expected)
    assert len(stands.found.reflected) == 2 and error < 1e-5
