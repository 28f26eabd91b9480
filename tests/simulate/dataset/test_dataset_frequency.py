"""The frequency of a folder: stated in metadata.json, listed in freq.txt, or assumed and said so."""

import json

import numpy as np
import pytest

from scenes.files.errors import InputError
from simulate.dataset.dataset_folder import read_dataset
from simulate.dataset.dataset_frequency import Frequency, frequency_of, read_frequencies

ROWS = np.arange(3)


@pytest.mark.parametrize(
    ("text", "hertz"),
    [
        ("3.5\n" * 3, [3.5e9] * 3),  # as WideGS writes it
        ("2.4\n5.8\n2.4\n", [2.4e9, 5.8e9, 2.4e9]),
        ("915\n", [915e6] * 3),  # one for all
        ("915 MHz", [915e6] * 3),
        ("28\n" * 5, [28e9] * 3),  # rows without pictures
    ],
)
def test_units_of_freq_txt(text, hertz, tmp_path):
    (tmp_path / "freq.txt").write_text(text)
    assert read_frequencies(tmp_path / "freq.txt", ROWS).tolist() == hertz


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("3.5\nhigh\n3.5\n", "freq.txt, row 2: .* found 'high'"),
        ("-3.5\n", "row 1: expected a frequency"),
        ("３.5\n", "row 1: expected a frequency"),
        ("", "row 1: expected a frequency"),
        ("3.5\n3.5\n", "found 2 rows for 3 pictures"),
    ],
)
def test_bad_rows_are_named(text, words, tmp_path):
    (tmp_path / "freq.txt").write_text(text)
    with pytest.raises(InputError, match=words):
        read_frequencies(tmp_path / "freq.txt", ROWS)


def test_metadata_and_freq_txt(tmp_path):
    assert frequency_of(tmp_path, {}, ROWS)[0] == Frequency(915e6, "assumed")
    assert frequency_of(tmp_path, {"frequency_hz": "3.5 GHz"}, ROWS)[0] == Frequency(3.5e9, "metadata")
    (tmp_path / "freq.txt").write_text("3.5\n")
    assert frequency_of(tmp_path, {}, ROWS)[0] == Frequency(3.5e9, "freq.txt")
    assert frequency_of(tmp_path, {"frequency_hz": 3.5e9}, ROWS)[0].source == "metadata"
    with pytest.raises(InputError, match=r"freq.txt: expected the 915 MHz of metadata.json, found 3.5 GHz"):
        frequency_of(tmp_path, {"frequency_hz": 915e6}, ROWS)
    (tmp_path / "freq.txt").write_text("2.4\n5.8\n5.8\n")
    with pytest.raises(InputError, match=r"found 2.4 GHz to 5.8 GHz"):
        frequency_of(tmp_path, {}, ROWS)


def test_an_assumed_frequency_is_said_once_where_a_dataset_is_read(write_folder, tmp_path, capsys):
    folder = write_folder(tmp_path / "measured", count=8)
    read_dataset(folder)
    assert capsys.readouterr().err == ""
    (folder / "metadata.json").unlink()
    read_dataset(folder)
    said = capsys.readouterr().err
    assert "915 MHz" in said and said.count("\n") == 1
    read_dataset(folder)
    assert capsys.readouterr().err == ""
    (folder / "metadata.json").write_text(json.dumps({"frequency_hz": 2.4e9}))  # as the sentence advises
    assert read_dataset(folder).wavelength == pytest.approx(0.1249, abs=1e-4)
