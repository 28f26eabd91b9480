"""Files of a dataset that are hostile or damaged: each is refused in one sentence, at once and in little memory."""

from __future__ import annotations

import tracemalloc
import warnings

import numpy as np
import pytest

from scenes.files.errors import InputError
from simulate.dataset.dataset_folder import inspect, read_dataset
from simulate.dataset.index_files import read_index
from simulate.dataset.picture_files import read_any_picture, read_picture
from simulate.exchange.convert import convert
from simulate.positions import positions as given_positions
from simulate.positions.positions import FARTHEST, check_points, read_points
from tests import corpus

MEMORY = 60e6  # Bytes that refusing a file may take


def refused(read, word: str) -> None:
    """The call raises one printable sentence with the word, warns of nothing, and takes little memory."""
    tracemalloc.start()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            with pytest.raises(InputError) as error:
                read()
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    sentence = str(error.value)
    assert "expected" in sentence and "found" in sentence and word in sentence, sentence
    assert sentence.isprintable() and len(sentence) < 600
    assert peak < MEMORY


@pytest.mark.parametrize("case", corpus.PICTURES)
def test_pictures(case, tmp_path):
    make, word = corpus.PICTURES[case]
    path = tmp_path / "00001.png"
    make(path)
    refused(lambda: read_picture(path), word)
    refused(lambda: read_any_picture(path), word)


@pytest.mark.parametrize("case", corpus.POSITIONS)
def test_positions(case, tmp_path):
    make, word = corpus.POSITIONS[case]
    path = tmp_path / "tx_pos.csv"
    make(path)
    refused(lambda: read_points(path), word)


ANY = ("spectrum/00003.png", "tx_pos.csv", "metadata.json", "gateway_info.yml")


@pytest.mark.parametrize(
    ("file", "case"),
    [
        *[("channels.npz", case) for case in corpus.RESPONSES],
        *[("test_index.txt", case) for case in corpus.INDEXES],
        *[(file, case) for file in ANY for case in corpus.ANY_FILE],
    ],
)
def test_datasets(file, case, folder):
    make, word = {"channels.npz": corpus.RESPONSES, "test_index.txt": corpus.INDEXES}.get(file, corpus.ANY_FILE)[case]
    (folder / file).unlink()
    make(folder / file)
    assert len(inspect(folder).problems) == 1
    refused(lambda: read_dataset(folder), word)


def test_responses_deflated_and_of_other_types_are_read(folder):
    np.savez_compressed(folder / "channels.npz", channels=corpus.ONES.astype(">c16"), more=np.zeros(9))
    found = read_dataset(folder).responses
    assert found is not None and found.dtype == np.complex64 and (found == 1).all()


@pytest.mark.parametrize(("name", "word"), [("3.png", "00003.png and 3.png"), (f"{'1' * 20}.png", "at most 9 digits")])
def test_names_of_pictures(name, word, folder):
    (folder / "spectrum" / name).write_bytes((folder / "spectrum" / "00003.png").read_bytes())
    refused(lambda: read_dataset(folder), word)


def test_a_million_repeated_names_count_once(folder):
    (folder / "train_index.txt").write_text("00001\n00003\n" * 500_000)
    found = inspect(folder)
    assert found.dataset is not None and found.dataset.train.tolist() == [0, 2]
    assert any("999998" in each for each in found.warnings)
    with pytest.raises(InputError, match="00001 more than once"):
        read_index(folder / "train_index.txt", found.dataset.names)


def test_too_many_positions(folder, monkeypatch):
    monkeypatch.setattr(given_positions, "MOST_POSITIONS", 4)
    refused(lambda: read_points(folder / "tx_pos.csv"), "at most 4 positions")


@pytest.mark.parametrize(
    ("positions", "word"),
    [
        ([[1, 2]], "shape (1, 2)"),
        ([], "shape (0,)"),
        ([[1, 2, "a"]], "[[1, 2, 'a']]"),
        ([[0, 0, 0], [np.nan, 0, 0]], "in row 1"),
        ([[0, 0, 2 * FARTHEST]], "±100000 m"),
        ([[10**400, 0, 0]], "[[1000"),
    ],
)
def test_positions_from_python(positions, word):
    refused(lambda: check_points(positions), word)


@pytest.mark.parametrize("file", ["train_index.txt", "gateway_info.yml", "tx_pos.csv", "spectrum/00002.png"])
def test_convert_opens_no_pipe(file, folder, tmp_path):
    (folder / file).unlink()
    corpus.ANY_FILE["named pipe"][0](folder / file)
    refused(lambda: convert(folder, tmp_path / "new"), "a named pipe")
    assert not (tmp_path / "new").exists()
