"""What ``check`` says about doubtful pictures, and that its advice can be followed."""

import re
import shlex

import numpy as np
import pytest
from PIL import Image

from learn.evaluation.check import check
from simulate.dataset.dataset_folder import read_dataset
from simulate.dataset.metadata import write_metadata
from simulate.dataset.spectra_folder import write_gateway
from simulate.exchange.convert import convert
from simulate.exchange.reading_options import Conversion
from simulate.positions.positions import write_positions
from simulate.spectra import explanation
from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.spectrum import normalise, picture

COUNT = 12
RESPONSES = np.random.default_rng(3).normal(size=(COUNT, 16, 2)) @ [1, 1j]
ARRAY = PlanarArray(spacing=0.48)
SPECTRA = Beamformer(ARRAY).spectrum(RESPONSES)


@pytest.fixture(autouse=True)
def short_search(monkeypatch):
    monkeypatch.setattr(explanation, "SQUARES", [(4, 4)])
    monkeypatch.setattr(explanation, "LINES_ALONG_X", [(1, 8)])
    monkeypatch.setattr(explanation, "LINES_ALONG_Y", [(8, 1)])


@pytest.fixture
def write(tmp_path):
    """Function: pictures -> a folder that states its frequency alone."""

    def written(pictures: np.ndarray):
        folder = tmp_path / "foreign"
        (folder / "spectrum").mkdir(parents=True)
        for number, image in enumerate(pictures, start=1):
            Image.fromarray(image).save(folder / "spectrum" / f"{number:05d}.png")
        write_positions(folder / "tx_pos.csv", np.random.default_rng(0).uniform(-1, 1, (len(pictures), 3)))
        write_gateway(folder / "gateway_info.yml", "foreign", (0, 0, 3), (1, 0, 0, 0))
        (folder / "freq.txt").write_text("2.4")
        return folder

    return written


PICTURES = {
    "power": (picture(SPECTRA**2), "Powers of an array of 4 × 4 elements 0.48 wavelengths apart"),
    "decibels": (
        picture((20 * np.log10(SPECTRA / SPECTRA.max(axis=(1, 2), keepdims=True))).clip(-40)),
        "Powers in decibels of an array of 4 × 4 elements 0.48 wavelengths apart",
    ),
    "a line": (
        picture(Beamformer(PlanarArray(1, 8)).spectrum(RESPONSES[:, :8])),
        "Magnitudes of an array of 1 × 8 elements 0.5 wavelengths apart",
    ),
    "other rows": (
        picture(Beamformer(ARRAY, AngularGrid(0.0, 90 / 89)).spectrum(RESPONSES)),
        "Magnitudes of an array of 4 × 4 elements 0.48 wavelengths apart",
    ),
    "dark": (picture(SPECTRA) // 4, "no picture is brighter than level 63 of 255"),
}


@pytest.mark.parametrize("kind", PICTURES)
def test_pictures_are_told_for_what_they_are_and_the_advice_works(kind, write, tmp_path):
    pictures, words = PICTURES[kind]
    folder = write(pictures)
    found = check(folder)
    (warning,) = [each for each in found.warnings if words in each]
    assert "bisplat dataset" in warning and found.valid
    convert(folder, tmp_path / "mended")
    mended = check(tmp_path / "mended")
    assert not [each for each in mended.warnings if "index" not in each], mended.warnings
    known = mended.dataset.identification
    assert known.source != "assumed" and known.residual < 3
    if kind in ("power", "decibels"):
        assert np.abs(mended.dataset.spectra - normalise(SPECTRA))[SPECTRA > SPECTRA.max() / 4].max() < 0.03


def test_what_is_to_be_written_to_metadata_json_can_be(write):
    folder = write(PICTURES["a line"][0])
    content = re.search(r"write (\{.*\}) there", "".join(check(folder).warnings))[1]
    (folder / "metadata.json").write_text(content)
    assert read_dataset(folder).array == PlanarArray(1, 8) and len(check(folder).warnings) == 1


def test_few_levels_one_level_and_one_pixel(write):
    pictures = picture(SPECTRA) // 16 * 16  # 16 levels
    pictures[0], pictures[1] = 7, 0
    pictures[1, 3, 5] = 255
    said = "\n".join(check(write(pictures)).warnings)
    assert "11 of 12 pictures that were examined have fewer than 32 different grey levels" in said
    assert "1 of 12 pictures have one grey level" in said
    assert "an array of" not in said and "black" not in said


def test_phases_alone_are_told(write):
    phases = picture(Beamformer(ARRAY).spectrum(RESPONSES / np.abs(RESPONSES)))
    assert any("made from phases only" in each for each in check(write(phases)).warnings)


def test_other_azimuths_are_told_by_the_positions(write, tmp_path):
    """A gateway at (0, 0, 3) that looks down and sees each transmitter."""
    folder = write(picture(SPECTRA))
    positions = np.random.default_rng(5).uniform([0.5, 0.5, 0], [2, 1, 1], (COUNT, 3)).round(6)
    write_positions(folder / "tx_pos.csv", positions)
    x, y, z = (positions - [0, 0, 3]).T * [[1], [-1], [-1]]  # the gateway's frame, turned about x
    responses = ARRAY.manifold(np.arctan2(y, x), np.arctan2(z, np.hypot(x, y)))
    for number, image in enumerate(np.roll(picture(Beamformer(ARRAY).spectrum(responses)), 180, axis=2), start=1):
        Image.fromarray(image).save(folder / "spectrum" / f"{number:05d}.png")
    (warning,) = [each for each in check(folder).warnings if "strongest directions" in each]
    options = shlex.split(re.search(r"bisplat dataset (--azimuths \S+ \S+)", warning)[1])
    convert(folder, tmp_path / "mended", Conversion(azimuths=(float(options[1]), float(options[2]))))
    assert not [each for each in check(tmp_path / "mended").warnings if "strongest directions" in each]


def test_grating_lobes_of_elements_far_apart_are_told(write):
    array = PlanarArray(spacing=2.7)
    folder = write(picture(Beamformer(array).spectrum(RESPONSES)))
    write_metadata(folder / "metadata.json", {"array": array.stated()})
    (warning,) = [each for each in check(folder).warnings if "strongest directions" in each]
    assert "elements 2.7 wavelengths apart have grating lobes" in warning and "bisplat dataset" not in warning


def test_array_that_moves_is_told_by_the_positions(write, tmp_path):
    """An array that looks up moves below a transmitter at (0, 0, 3), and sees it."""
    folder = write(picture(SPECTRA))
    positions = np.random.default_rng(5).uniform([0.5, 0.5, 0], [2, 1, 1], (COUNT, 3)).round(6)
    write_positions(folder / "tx_pos.csv", positions)
    write_gateway(folder / "gateway_info.yml", "moved", (0, 0, 3), (0, 0, 0, 1))
    x, y, z = ([0, 0, 3] - positions).T
    responses = ARRAY.manifold(np.arctan2(y, x), np.arctan2(z, np.hypot(x, y)))
    for number, image in enumerate(picture(Beamformer(ARRAY).spectrum(responses)), start=1):
        Image.fromarray(image).save(folder / "spectrum" / f"{number:05d}.png")
    found = check(folder)
    (warning,) = [each for each in found.warnings if "strongest directions" in each]
    assert warning.endswith("bisplat dataset --moving receiver states it")
    assert found.description()["moving"].startswith("the transmitter (assumed")
    convert(folder, tmp_path / "stated", Conversion(moving="receiver"))
    stated = check(tmp_path / "stated")
    assert not [each for each in stated.warnings if "strongest directions" in each]
    assert stated.description()["moving"] == "the receiver, with its array"
