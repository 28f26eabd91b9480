"""Folders of other programs: told for what they are, and converted."""

import shutil

import numpy as np
import pytest
from PIL import Image

from scenes.files.errors import InputError, ParameterError
from simulate.dataset.dataset_folder import inspect, read_dataset
from simulate.dataset.index_files import write_index
from simulate.dataset.spectra_folder import write_gateway
from simulate.exchange.convert import convert
from simulate.exchange.reading_options import Conversion
from simulate.positions.positions import write_positions
from simulate.spectra import explanation
from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.spectrum import picture

COUNT = 8
NAMES = [f"{number:05d}" for number in range(1, COUNT + 1)]
GENERATOR = np.random.default_rng(1)
PICTURES = picture(Beamformer(PlanarArray(spacing=0.48)).spectrum(GENERATOR.normal(size=(COUNT, 16, 2)) @ [1, 1j]))
POSITIONS = GENERATOR.uniform(-2, 2, (COUNT, 3)).round(6)


@pytest.fixture(autouse=True)
def short_search(monkeypatch):
    """Where no array explains the pictures, only small ones are tried."""
    monkeypatch.setattr(explanation, "SQUARES", explanation.SQUARES[:2])
    monkeypatch.setattr(explanation, "LINES_ALONG_X", explanation.LINES_ALONG_X[:1])
    monkeypatch.setattr(explanation, "LINES_ALONG_Y", explanation.LINES_ALONG_Y[:1])


@pytest.fixture
def foreign(tmp_path):
    """A measured folder, to be spoilt."""
    folder = tmp_path / "foreign"
    (folder / "spectrum").mkdir(parents=True)
    save(folder, PICTURES)
    write_positions(folder / "tx_pos.csv", POSITIONS)
    write_gateway(folder / "gateway_info.yml", "foreign", (0, 0, 1), (0, 0, 0, 1))
    write_index(folder / "train_index.txt", NAMES[:6])
    write_index(folder / "test_index.txt", NAMES[6:])
    return folder


def save(folder, pictures, names=NAMES):
    shutil.rmtree(folder / "spectrum")
    (folder / "spectrum").mkdir()
    for name, image in zip(names, pictures, strict=True):
        Image.fromarray(image).save(folder / "spectrum" / f"{name}.png")


def numbered_from_0(folder):
    save(folder, PICTURES, [str(number) for number in range(COUNT)])
    indices_from_0(folder)


def indices_from_0(folder):
    write_index(folder / "train_index.txt", [str(number) for number in range(6)])
    write_index(folder / "test_index.txt", ["6", "7"])


SPOILT = {
    "upside-down": lambda folder: save(folder, PICTURES[:, ::-1]),
    "7 more pictures": lambda folder: save(folder, PICTURES.transpose(0, 2, 1).copy()),
    "mode RGB": lambda folder: save(folder, np.repeat(PICTURES[..., None], 3, axis=-1)),
    "mode I;16": lambda folder: save(folder, PICTURES.astype(np.uint16)),
    "0.png": numbered_from_0,
    "GSRF": indices_from_0,
}
"""Ways to spoil the folder, by a part of the sentence that tells each."""


@pytest.mark.parametrize("told", SPOILT)
def test_foreign_folder_is_told_for_what_it_is_and_mended(told, foreign, tmp_path):
    SPOILT[told](foreign)
    found = inspect(foreign)
    assert any(told in problem for problem in found.problems), found.problems
    assert len(found.problems) <= 2  # one for each index file
    assert convert(foreign, tmp_path / "mended")
    mended = read_dataset(tmp_path / "mended")
    assert mended.names == NAMES and (mended.pictures == PICTURES).all()
    assert (mended.positions == POSITIONS).all()
    assert mended.train.tolist() == list(range(6)) and mended.test.tolist() == [6, 7]
    assert mended.identification.source == "fitted" and mended.array == PlanarArray(spacing=0.48)


def test_folder_without_index_files_is_valid(foreign, tmp_path):
    for label in ("train", "test"):
        (foreign / f"{label}_index.txt").unlink()
    found = inspect(foreign)
    assert not found.problems and "use the split random" in found.warnings[0]
    assert any("no index files" in sentence for sentence in convert(foreign, tmp_path / "mended"))


def test_several_pictures_of_one_position_are_warned_of_and_one_of_each_is_kept(foreign, tmp_path):
    write_positions(foreign / "tx_pos.csv", np.repeat(POSITIONS[:4], 2, axis=0))
    found = inspect(foreign)
    assert not found.problems and "8 of 8 pictures share their position" in found.warnings[-1]
    convert(foreign, tmp_path / "mended", Conversion(one_per_position=2))
    mended = read_dataset(tmp_path / "mended")
    assert (mended.positions == POSITIONS[:4]).all() and (mended.pictures == PICTURES[1::2]).all()
    assert mended.train.tolist() == [0, 1, 2] and mended.test.tolist() == [3]
    with pytest.raises(ParameterError, match="found 3"):
        convert(foreign, tmp_path / "again", Conversion(one_per_position=3))


def test_other_resolution_is_sampled_at_the_directions_it_has(foreign, tmp_path):
    """A ramp over elevation 0…90° (91 rows) and azimuth −90…90° (181 columns); elsewhere there is nothing."""
    ramp = (np.arange(91)[:, None] + np.arange(181)[None]).astype(np.uint8)  # elevation + azimuth + 90
    save(foreign, np.stack([ramp] * COUNT))
    convert(foreign, tmp_path / "mended", Conversion(False, elevations=(0, 90), azimuths=(-90, 90)))
    found = inspect(tmp_path / "mended").dataset.pictures[0]
    assert found[40, 0] == 40 + 90 and found[40, 30] == 40 + 120 and found[40, 300] == 40 + 30
    assert found[40, 180] == 0


def test_columns_all_around_are_sampled_between_the_last_and_the_first(foreign, tmp_path):
    """Two steps of 180 columns at 0°, 2°, …, 358°; 359° lies between the last column and the first."""
    coarse = np.zeros((90, 180), np.uint8)
    coarse[:, -1], coarse[:, 0] = 100, 200
    save(foreign, np.stack([coarse] * COUNT))
    convert(foreign, tmp_path / "mended", Conversion(azimuths=(0, 358)))
    found = inspect(tmp_path / "mended").dataset.pictures[0, 40, [357, 358, 359, 0, 1]]
    assert found.tolist() == [50, 100, 150, 200, 100]


TURNS = {
    "half a turn": (np.roll(PICTURES, 180, axis=2), (-180, 179)),
    "mirrored": (np.roll(PICTURES[:, :, ::-1], 1, axis=2), (0, -359)),
    "361 columns": (np.concatenate([PICTURES, PICTURES[:, :, :1]], axis=2), (0, 360)),
}


@pytest.mark.parametrize("turn", TURNS)
def test_azimuths_are_taken_as_stated(turn, foreign, tmp_path):
    pictures, azimuths = TURNS[turn]
    save(foreign, pictures)
    convert(foreign, tmp_path / "mended", Conversion(azimuths=azimuths))
    assert (read_dataset(tmp_path / "mended").pictures == PICTURES).all()


def test_90_rows_are_kept_and_their_elevations_stated(foreign, tmp_path):
    convert(foreign, tmp_path / "kept", Conversion(elevations=(1, 90)))
    kept = read_dataset(tmp_path / "kept")
    assert (kept.pictures == PICTURES).all() and kept.grid == AngularGrid(1.0)
    convert(foreign, tmp_path / "turned", Conversion(elevations=(89, 0)))
    turned = read_dataset(tmp_path / "turned")
    assert (turned.pictures == PICTURES[:, ::-1]).all() and turned.grid == AngularGrid()
    with pytest.raises(ParameterError, match="flip_elevation: "):
        convert(foreign, tmp_path / "both", Conversion(flip_elevation=True, elevations=(89, 0)))


def test_rows_outside_the_stated_elevations_are_not_invented(foreign, tmp_path):
    ramp = np.repeat(np.arange(10, 81, dtype=np.uint8)[:, None], 360, axis=1)  # level = elevation from 10° to 80°
    save(foreign, np.stack([3 * ramp] * COUNT))
    convert(foreign, tmp_path / "mended", Conversion(elevations=(10, 80)))
    mended = read_dataset(tmp_path / "mended")
    assert mended.grid.elevations_deg[[0, -1]].tolist() == [10, 80]
    np.testing.assert_allclose(mended.pictures[0, :, 7], 3 * mended.grid.elevations_deg, atol=0.51)


def test_powers_are_told_and_their_root_is_taken(foreign, tmp_path):
    power = (PICTURES[:4, :, :, None] / 255.0) ** 2  # of spectra whose minimum is nearly 0
    save(foreign, np.round(255 * power[..., 0]).astype(np.uint8), NAMES[:4])
    (foreign / "test_index.txt").write_text("00004\n")
    (foreign / "train_index.txt").write_text("00001\n00002\n")
    said = convert(foreign, tmp_path / "mended", Conversion(quantity="power"))
    assert any("square root" in sentence for sentence in said)
    mended = read_dataset(tmp_path / "mended")
    assert np.abs(mended.pictures.astype(int) - PICTURES[:4])[PICTURES[:4] > 64].max() <= 2


def test_decibels_need_a_range_that_nothing_shows(foreign, tmp_path):
    noise = GENERATOR.integers(0, 256, (COUNT, 90, 360), dtype=np.uint8)
    save(foreign, noise)
    with pytest.raises(ParameterError, match="decibels: "):
        convert(foreign, tmp_path / "mended", Conversion(quantity="decibels", elevations=(0, 89)))
    convert(foreign, tmp_path / "mended", Conversion(quantity="decibels", decibels=40, elevations=(0, 89)))
    expected = (10 ** (40 * (noise / 255 - 1) / 20) - 0.01) / 0.99
    np.testing.assert_allclose(inspect(tmp_path / "mended").dataset.pictures, 255 * expected, atol=0.51)


def test_frequency_is_read_stated_and_kept(foreign, tmp_path):
    """freq.txt in GHz; a metadata.json by hand is no reason to refuse; an option is stronger than neither."""
    convert(foreign, tmp_path / "stated", Conversion(frequency="2.4 GHz"))
    found = read_dataset(tmp_path / "stated").frequency
    assert (found.hertz, found.source) == (2.4e9, "metadata")
    (foreign / "freq.txt").write_text("3.5\n" * COUNT)
    convert(foreign, tmp_path / "listed")
    assert read_dataset(tmp_path / "listed").wavelength == pytest.approx(0.0857, abs=1e-4)
    (foreign / "metadata.json").write_text('{"frequency_hz": 3.5e9, "room": "attic"}')
    convert(foreign, tmp_path / "both")
    assert read_dataset(tmp_path / "both").metadata["room"] == "attic"
    with pytest.raises(ParameterError, match=r"frequency: .* found 2\.4 GHz"):
        convert(foreign, tmp_path / "other", Conversion(frequency="2.4e9"))


def test_a_picture_left_out_shifts_no_position(foreign, tmp_path):
    """Picture 4 keeps row 4, as check reads it."""
    (foreign / "spectrum" / "00003.png").unlink()
    write_index(foreign / "train_index.txt", ["1", "2", "4"])
    write_index(foreign / "test_index.txt", ["8"])
    convert(foreign, tmp_path / "mended")
    mended = read_dataset(tmp_path / "mended")
    assert (mended.positions == np.delete(POSITIONS, 2, axis=0)).all()
    assert (mended.pictures[mended.test[0]] == PICTURES[7]).all()


def test_only_new_folders_are_written_and_ours_are_not_converted(foreign, tmp_path):
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / "thesis.tex").write_text("precious")
    with pytest.raises(InputError, match="expected a new folder"):
        convert(foreign, tmp_path / "old")
    (foreign / "metadata.json").write_text('{"scene_file": "scene/scene.yaml"}')
    with pytest.raises(InputError, match="found one that bisplat simulated"):
        convert(foreign, tmp_path / "new")


def of_another_size(folder):
    save(folder, [np.zeros((91, 181), np.uint8)] * COUNT)


def of_colours(folder):
    image = np.zeros((90, 360, 3), np.uint8)
    image[..., 0] = 200
    Image.fromarray(image).save(folder / "spectrum" / "00003.png")


def in_both_indices(folder):
    write_index(folder / "test_index.txt", NAMES[:1])


@pytest.mark.parametrize(
    ("spoil", "found"),
    [(of_another_size, "181 × 91"), (of_colours, r"00003\.png: "), (in_both_indices, r"test_index\.txt: ")],
)
def test_what_would_be_no_dataset_is_refused(spoil, found, foreign, tmp_path):
    spoil(foreign)
    with pytest.raises(InputError, match=found):
        convert(foreign, tmp_path / "mended")
    assert not (tmp_path / "mended").exists()


def test_what_moves_is_stated(foreign, tmp_path):
    said = convert(foreign, tmp_path / "as it is")
    assert any("state --moving receiver" in each for each in said)
    assert not any("state --moving" in each for each in convert(foreign, tmp_path / "o", Conversion(moving="receiver")))
    assert read_dataset(tmp_path / "o").moving == "receiver"
    convert(tmp_path / "o", tmp_path / "kept")
    assert read_dataset(tmp_path / "kept").moving == "receiver"


def test_both_ends_are_kept(foreign, tmp_path):
    with pytest.raises(InputError, match=r"rx_pos\.csv: expected a CSV of positions, found no such file"):
        convert(foreign, tmp_path / "out", Conversion(moving="both"))
    write_positions(foreign / "rx_pos.csv", POSITIONS + 1)
    with pytest.raises(InputError, match='expected "moving": "both" in metadata'):
        read_dataset(foreign)
    assert any("left out" in each and "rx_pos.csv" in each for each in convert(foreign, tmp_path / "one"))
    write_positions(foreign / "tx_pos.csv", POSITIONS.round(0) * 0)  # one place of the transmitter, which is no fault
    (foreign / "spectrum" / f"{NAMES[2]}.png").unlink()
    write_index(foreign / "train_index.txt", [NAMES[0]])
    convert(foreign, tmp_path / "out", Conversion(moving="both"))
    made = read_dataset(tmp_path / "out")
    np.testing.assert_allclose(made.receivers, np.delete(POSITIONS + 1, 2, axis=0), atol=1e-6)
    assert made.moving == "both" and not made.transmitters.any()
