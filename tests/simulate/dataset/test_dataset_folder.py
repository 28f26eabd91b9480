"""The NeRF² folder: what we write is what the published loaders read, and bad input gets one plain sentence."""

import shutil
import struct
from pathlib import Path

import numpy as np
import pandas
import pytest
import yaml
from PIL import Image

from scenes.files.errors import InputError
from scenes.files.npz_file import write_arrays
from simulate.dataset.dataset_folder import inspect, read_dataset
from simulate.dataset.index_files import write_index
from simulate.dataset.metadata import write_metadata
from simulate.dataset.picture_files import encode_picture, read_picture
from simulate.dataset.responses_file import write_responses
from simulate.spectra.beamformer import Beamformer
from tests.simulate.dataset.conftest import (
    COUNT,
    METADATA,
    NAMES,
    ORIENTATION,
    PICTURES,
    POSITIONS,
    RESPONSES,
    TEST,
    TRAIN,
)

MEASURED = Path(__file__).parents[4] / "shared" / "data" / "rfid-s23-160"


def test_what_was_written_is_read_back(folder):
    dataset = read_dataset(folder)
    assert dataset.names == NAMES
    assert (dataset.pictures == PICTURES).all()
    assert (dataset.positions == POSITIONS).all()
    assert (dataset.responses == RESPONSES).all()
    assert dataset.responses.dtype == np.complex64
    assert dataset.gateway_position.tolist() == [1, 2, 1.5]
    assert dataset.gateway_orientation.tolist() == ORIENTATION
    assert dataset.train.tolist() == [0, 2, 3, 4]
    assert dataset.test.tolist() == [1]
    assert dataset.beamformer == Beamformer()
    assert dataset.identification.source == "metadata"
    assert dataset.spectra.max() == 1
    assert inspect(folder).warnings == []


def test_published_loaders_read_it_their_way(folder):
    """np.loadtxt(index, dtype=str), read_csv(tx_pos.csv).values, tx_pos[int(name) - 1], imread / 255, the YAML."""
    positions = pandas.read_csv(folder / "tx_pos.csv").values
    assert positions.shape == (COUNT, 3)
    for index, names in (("train_index.txt", TRAIN), ("test_index.txt", TEST)):
        found = np.atleast_1d(np.loadtxt(folder / index, dtype=str))
        assert found.tolist() == names
        for name in found:
            assert positions[int(name) - 1] == pytest.approx(POSITIONS[NAMES.index(name)])
            image = np.asarray(Image.open(folder / "spectrum" / f"{name}.png")) / 255
            assert image.shape == (90, 360)
            assert (image == PICTURES[NAMES.index(name)] / 255).all()
    gateway = yaml.safe_load((folder / "gateway_info.yml").read_text())
    assert gateway["dataset_name"] == "tiny"
    assert gateway["gateway1"]["position"] == [1.0, 2.0, 1.5]
    assert gateway["gateway1"]["orientation"] == ORIENTATION


def test_folder_without_what_we_add_is_a_dataset(folder):
    """channels.npz and metadata.json are ours; the array and the grid are then found from the pictures."""
    (folder / "channels.npz").unlink()
    (folder / "metadata.json").unlink()
    dataset = read_dataset(folder)
    assert "response" not in dataset.values
    assert dataset.beamformer == Beamformer()
    assert dataset.identification.source == "fitted"


def test_pictures_take_the_row_of_their_number(folder):
    """A picture left out shifts nothing: spectrum 4 keeps row 4 of positions and responses."""
    (folder / "spectrum" / "00003.png").unlink()
    write_index(folder / "train_index.txt", ["00001", "00004", "00005"])
    dataset = read_dataset(folder)
    assert dataset.names == ["00001", "00002", "00004", "00005"]
    assert (dataset.positions == POSITIONS[[0, 1, 3, 4]]).all()
    assert (dataset.responses == RESPONSES[[0, 1, 3, 4]]).all()
    assert dataset.train.tolist() == [0, 2, 3]


# --- bad input ---------------------------------------------------------------------------------------------


def line(number, text):
    """Change: another text on a line of tx_pos.csv, counted from 1; None takes the line out."""

    def change(folder):
        lines = (folder / "tx_pos.csv").read_text().splitlines()
        lines[number - 1 : number] = [] if text is None else [text]
        (folder / "tx_pos.csv").write_text("".join(f"{entry}\n" for entry in lines))

    return change


def holding(name, content):
    return lambda folder: (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())


def showing(image):
    return lambda folder: image.save(folder / "spectrum" / "00002.png")


def cut(name, share):
    def change(folder):
        content = (folder / name).read_bytes()
        (folder / name).write_bytes(content[: int(share * len(content))])

    return change


def with_responses(shape):
    return lambda folder: write_responses(folder / "channels.npz", np.zeros(shape))


GREY = np.zeros((90, 360), np.uint8)
BAD = {
    "no positions": (lambda folder: (folder / "tx_pos.csv").unlink(), ["tx_pos.csv", "no such file"]),
    "no pictures' folder": (lambda folder: shutil.rmtree(folder / "spectrum"), ["spectrum", "nothing there"]),
    "picture's size": (showing(Image.fromarray(GREY.T)), ["00002.png", "360 × 90", "90 × 360"]),
    "picture that is text": (holding("spectrum/00002.png", "no"), ["00002.png", "whole PNG", "damaged"]),
    "picture not there": (holding("test_index.txt", "00002\n00009\n"), ["test_index.txt, row 2", "00009"]),
    "index not padded": (holding("test_index.txt", "2\n"), ["test_index.txt, row 1", "found '2'"]),
    "same name twice": (holding("test_index.txt", "00003\n"), ["test_index.txt", "00003", "both"]),
    "position not a number": (line(3, "1,nan,2"), ["tx_pos.csv", "position 2 (line 3)", "1,nan,2"]),
    "fewer rows than pictures": (line(6, None), ["tx_pos.csv", "5 pictures", "4 rows", "00005.png"]),
    "too few channels": (with_responses((4, 16)), ["channels.npz", "5 positions", "(4, 16)"]),
    "channels of another array": (with_responses((5, 9)), ["channels.npz", "16 elements", "(5, 9)"]),
    "truncated channels": (cut("channels.npz", 0.5), ["channels.npz"]),
    "metadata that is no JSON": (holding("metadata.json", "{"), ["metadata.json", "JSON", "found"]),
    "array of metadata": (holding("metadata.json", '{"array": {"cols": 4}}'), ["metadata.json", "columns", "cols"]),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_gets_one_sentence_that_says_where_and_what(case, folder):
    """One cause, one problem: file and row, what was expected, what was found; no further errors in its wake."""
    change, words = BAD[case]
    change(folder)
    found = inspect(folder)
    assert found.dataset is None
    (problem,) = found.problems
    assert all(word in problem for word in [str(folder), "expected", "found", *words]) and "\n" not in problem
    with pytest.raises(InputError) as error:
        read_dataset(folder)
    assert str(error.value) == problem


def test_every_problem_is_reported_not_only_the_first(folder):
    (folder / "gateway_info.yml").unlink()
    line(3, "1,nan,2")(folder)
    showing(Image.new("RGB", (360, 90)))(folder)
    assert len(inspect(folder).problems) == 3
    with pytest.raises(InputError, match=r"\(2 more problems\)"):
        read_dataset(folder)


def test_picture_cut_anywhere_is_refused(tmp_path):
    """Never a traceback of the picture library, never half a picture."""
    path = tmp_path / "00001.png"
    whole = encode_picture(PICTURES[0])
    end = whole.index(b"IDAT") + 4 + struct.unpack(">I", whole[whole.index(b"IDAT") - 4 :][:4])[0]
    for length in [*range(0, 60), *range(60, end - 60, 997)]:
        path.write_bytes(whole[:length])
        with pytest.raises(InputError, match="expected a whole PNG"):
            read_picture(path)


def test_what_is_odd_but_readable_is_a_warning(folder):
    write_index(folder / "train_index.txt", ["00001", "00001", "00003"])
    with (folder / "tx_pos.csv").open("a") as file:
        file.write("0,0,0\n")
    write_responses(folder / "channels.npz", np.ones((6, 16)))
    found = inspect(folder)
    assert found.problems == []
    assert len(found.warnings) == 3  # a row without a picture, a name twice, spectra in neither index
    assert found.dataset.train.tolist() == [0, 2]


def test_band_is_read_if_metadata_states_it(folder):
    write_arrays(folder / "channels.npz", {"channels": RESPONSES, "band": np.stack([RESPONSES] * 3, axis=-1)})
    assert inspect(folder).dataset.band is None
    write_metadata(folder / "metadata.json", METADATA | {"band": {"bandwidth": 2e7, "subcarriers": 3}})
    assert inspect(folder).warnings == [] and inspect(folder).dataset.band_responses.shape == (COUNT, 16, 3)


def test_measured_rfid_dataset_reads():
    if not MEASURED.is_dir():
        pytest.skip(f"{MEASURED} is not on this machine")
    found = inspect(MEASURED)
    assert found.problems == []
    assert found.dataset.pictures.shape == (160, 90, 360)
    assert len(found.dataset.train) == 128
    assert len(found.dataset.test) == 32
    assert "response" not in found.dataset.values
