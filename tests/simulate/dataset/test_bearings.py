"""Which turns pictures of an array cannot show, and the azimuths that the positions show in line of sight."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scenes.scene.orientation import facing
from simulate.dataset.bearings import Turn, bearing_of, turns_of
from simulate.dataset.dataset import Dataset
from simulate.dataset.receivers import ArrayReceiver
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.identification import Identification
from simulate.spectra.lags import fit_lags
from simulate.spectra.spectrum import picture, spectrum_of

ORIENTATION = np.array(facing((1, 0.2, 0)))
GATEWAY = np.array([0.0, 0.0, 1.5])


def turned(pictures: np.ndarray, turn: Turn) -> np.ndarray:
    """The pictures of a program whose column c shows the azimuth ±c + by."""
    columns = (turn.by + (-1 if turn.mirrored else 1) * np.arange(360)) % 360
    return pictures[:, :, columns]


def line_of_sight(array: PlanarArray) -> Dataset:
    generator = np.random.default_rng(0)
    local = generator.uniform([0.7, 1.7, 0.5], [0.9, 1.9, 0.8], (30, 3))  # far from all axes of symmetry
    positions = GATEWAY + Rotation.from_quat(ORIENTATION).apply(local)
    azimuth, height = np.arctan2(local[:, 1], local[:, 0]), local[:, 2] / np.linalg.norm(local, axis=1)
    beamformer = Beamformer(array)
    pictures = picture(beamformer.spectrum(array.manifold(azimuth, np.arcsin(height))))
    names, nothing = [f"{number:05d}" for number in range(1, 31)], np.zeros(0, int)
    known = Identification(beamformer, "fitted", "fitted")
    gateway = ArrayReceiver(GATEWAY, ORIENTATION, known)
    return Dataset(Path("seen"), names, {"spectrum": pictures}, gateway, positions, nothing, nothing)


@pytest.mark.parametrize(("shape", "count"), [((3, 3), 8), ((2, 3), 4)])
def test_turns_that_an_array_explains_are_those_that_leave_it_the_same(shape, count):
    beamformer = Beamformer(PlanarArray(*shape))
    responses = np.random.default_rng(1).normal(size=(4, beamformer.array.elements, 2)) @ [1, 1j]
    pictures = picture(beamformer.spectrum(responses))
    every = [Turn(mirrored, by) for mirrored in (False, True) for by in (0, 45, 90, 180, 270)]
    explained = [
        turn for turn in every if fit_lags(spectrum_of(turned(pictures, turn)), beamformer).median_residual < 0.4
    ]
    assert explained == turns_of(beamformer.array) and len(explained) == count


@pytest.mark.parametrize("turn", turns_of(PlanarArray())[1:], ids=str)
def test_positions_in_sight_show_a_turn_and_its_option_undoes_it(turn):
    dataset = line_of_sight(PlanarArray())
    straight = bearing_of(dataset)
    assert straight.error < 4 and straight.turn is None and straight.doubt(dataset.grid) is None
    # Column c of the turned pictures has the azimuth that the straight ones have in column ±c + by.
    found = bearing_of(dataset.with_values(spectrum=turned(dataset.pictures, turn)))
    assert found.turn == turn and found.error_after == pytest.approx(straight.error, abs=0.1)
    first, last = (float(word) for word in found.turn.option(dataset.grid).split()[1:])
    assert first % 360 == turn.by and last - first == (-359 if turn.mirrored else 359)
    assert found.turn.option(dataset.grid) in found.doubt(dataset.grid)


def test_grating_lobes_are_named_instead_of_a_turn():
    dataset = line_of_sight(PlanarArray(spacing=1.0))
    for pictures in (dataset.pictures, turned(dataset.pictures, Turn(by=90))):
        found = bearing_of(dataset.with_values(spectrum=pictures))
        assert found.turn is None and found.error_if_moved is None and found.grating == 1
        if found.error > 30:
            assert "elements 1 wavelengths apart have grating lobes" in found.doubt(dataset.grid)
    assert found.error > 30


def test_out_of_sight_nothing_is_believed():
    dataset = line_of_sight(PlanarArray())
    shuffled = np.random.default_rng(0).integers(0, 256, dataset.pictures.shape, dtype=np.uint8)
    assert bearing_of(dataset.with_values(spectrum=shuffled)).turn is None
    assert np.isnan(bearing_of(dataset.with_values(spectrum=0 * shuffled)).error)
