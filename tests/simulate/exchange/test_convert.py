"""Folders of other programs: told for what they are, and converted."""

import shutil

import numpy as np
import pytest
from PIL import Image

from scenes.files.errors import InputError, ParameterError
from simulate.dataset.dataset_folder import inspect, read_dataset
from simulate.dataset.dataset_writer import write_gateway, write_index, write_positions
from simulate.exchange.conversion import Conversion
from simulate.exchange.convert import convert
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.spectrum import picture

COUNT = 8
NAMES = [f"{number:05d}" for number in range(1, COUNT + 1)]
GENERATOR = np.random.default_rng(1)
PICTURES = picture(Beamformer(PlanarArray(spacing=0.48)).spectrum(GENERATOR.normal(size=(COUNT, 16, 2)) @ [1, 1j]))
POSITIONS = GENERATOR.uniform(-2, 2, (COUNT, 3)).round(6)


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


def upside_down(folder):
    save(folder, PICTURES[:, ::-1])


def transposed(folder):
    save(folder, PICTURES.transpose(0, 2, 1).copy())


def in_colour(folder):
    save(folder, np.repeat(PICTURES[..., None], 3, axis=-1))


def in_16_bits(folder):
    save(folder, PICTURES.astype(np.uint16) * 257)


def numbered_from_0(folder):
    save(folder, PICTURES, [str(number) for number in range(COUNT)])
    indices_from_0(folder)


def indices_from_0(folder):
    write_index(folder / "train_index.txt", [str(number) for number in range(6)])
    write_index(folder / "test_index.txt", ["6", "7"])


SPOILT = {
    upside_down: "found upside-down pictures",
    transposed: "bisplat convert transposes it back; 7 more pictures have the same fault",
    in_colour: "found 360 × 90 of mode RGB",
    in_16_bits: "bisplat convert turns it into 8-bit grey",
    numbered_from_0: "found 0.png",
    indices_from_0: "as GSRF writes them: bisplat convert adds them",
}


@pytest.mark.parametrize("spoil", SPOILT)
def test_foreign_folder_is_told_for_what_it_is_and_mended(spoil, foreign, tmp_path):
    spoil(foreign)
    found = inspect(foreign)
    assert any(SPOILT[spoil] in problem for problem in found.problems), found.problems
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
    assert not found.problems and "split random or blocked" in found.warnings[0]
    assert "no index files" in convert(foreign, tmp_path / "mended")[0]


def test_unfinished_simulation_is_not_a_folder_without_index_files(foreign):
    (foreign / "metadata.json").write_text('{"scene_file": "scene/scene.yaml"}')
    (foreign / "train_index.txt").unlink()
    (foreign / "test_index.txt").unlink()
    assert len(inspect(foreign).problems) == 2


def test_several_pictures_of_one_position_are_a_problem_and_one_of_each_is_kept(foreign, tmp_path):
    write_positions(foreign / "tx_pos.csv", np.repeat(POSITIONS[:4], 2, axis=0))
    assert "found 8 pictures of 4 positions" in inspect(foreign).problems[0]
    convert(foreign, tmp_path / "mended", Conversion(one_per_position=2))
    mended = read_dataset(tmp_path / "mended")
    assert (mended.positions == POSITIONS[:4]).all() and (mended.pictures == PICTURES[1::2]).all()
    assert mended.train.tolist() == [0, 1, 2] and mended.test.tolist() == [3]
    with pytest.raises(ParameterError, match="expected a number from 1 to 2, found 3"):
        convert(foreign, tmp_path / "again", Conversion(one_per_position=3))


def test_some_shared_positions_are_a_warning(foreign):
    write_positions(foreign / "tx_pos.csv", [*POSITIONS[:-1], POSITIONS[0]])
    found = inspect(foreign)
    assert not found.problems and len(found.warnings) == 1 and "2 of 8 pictures" in found.warnings[0]


def test_one_position_for_all_is_a_problem(foreign):
    write_positions(foreign / "tx_pos.csv", np.ones((COUNT, 3)))
    assert "found [1.0, 1.0, 1.0] for all 8" in inspect(foreign).problems[0]


def test_other_resolution_is_sampled_at_the_directions_it_has(foreign, tmp_path):
    """A ramp over elevation 0…90° (91 rows) and azimuth −90…90° (181 columns); elsewhere there is nothing."""
    ramp = (np.arange(91)[:, None] + np.arange(181)[None]).astype(np.uint8)  # elevation + azimuth + 90
    save(foreign, np.stack([ramp] * COUNT))
    with pytest.raises(InputError, match="expected 360 × 90 pixels, found 181 × 91; give the angles"):
        convert(foreign, tmp_path / "mended")
    assert not (tmp_path / "mended").exists()
    convert(foreign, tmp_path / "mended", Conversion(False, elevations=(0, 90), azimuths=(-90, 90)))
    found = inspect(tmp_path / "mended").dataset.pictures[0]
    assert found[40, 0] == 40 + 90 and found[40, 30] == 40 + 120 and found[40, 300] == 40 + 30
    assert found[40, 180] == 0


def test_only_new_folders_are_written_and_ours_are_not_converted(foreign, tmp_path):
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / "thesis.tex").write_text("precious")
    with pytest.raises(InputError, match="expected a new folder"):
        convert(foreign, tmp_path / "old")
    (foreign / "metadata.json").write_text("{}")
    with pytest.raises(InputError, match=r"metadata\.json of bisplat"):
        convert(foreign, tmp_path / "new")


def test_picture_of_colours_is_refused(foreign, tmp_path):
    image = np.zeros((90, 360, 3), np.uint8)
    image[..., 0] = 200
    Image.fromarray(image).save(foreign / "spectrum" / "00003.png")
    with pytest.raises(InputError, match=r"00003\.png: expected grey levels"):
        convert(foreign, tmp_path / "mended")
    assert not (tmp_path / "mended").exists()


def test_gateway_that_check_would_refuse_is_refused(foreign, tmp_path):
    (foreign / "gateway_info.yml").write_text("gateway1:\n  position: [0, 0]\n  orientation: [0, 0, 0, 1]\n")
    with pytest.raises(InputError, match=r"gateway_info\.yml: gateway1\.position"):
        convert(foreign, tmp_path / "ours")
    assert not (tmp_path / "ours").exists()


def test_what_would_be_no_dataset_is_refused(foreign, tmp_path):
    both = foreign / "test_index.txt"
    both.write_text(both.read_text() + (foreign / "train_index.txt").read_text().splitlines()[0] + "\n")
    with pytest.raises(InputError, match=r"test_index\.txt: expected names that are not in train_index\.txt"):
        convert(foreign, tmp_path / "out")
    assert not (tmp_path / "out").exists()
