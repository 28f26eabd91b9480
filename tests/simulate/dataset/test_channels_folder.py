"""Folders of channels over subcarriers: what is read, what is said, and what is wrong with damaged ones."""

import os
from pathlib import Path

import numpy as np
import pytest

import bisplat
from scenes.files.errors import InputError
from simulate.dataset.dataset_folder import inspect
from tests.corpus import ANY_FILE

ANTENNAS, COUNT = 4, 6


def channels(subcarriers: int = 52) -> np.ndarray:
    parts = np.random.default_rng(0).normal(size=(2, COUNT, ANTENNAS, subcarriers))
    return (parts[0] + 1j * parts[1]).astype(np.complex64)


def station(antennas: int = ANTENNAS) -> str:
    return "base_station:\n" + "".join(f"  - [0.0, {0.06 * number:.2f}, 2.0]\n" for number in range(antennas))


@pytest.fixture
def folder(tmp_path) -> Path:
    """A valid folder with what the published one has: no positions and no metadata."""
    folder = tmp_path / "mimo"
    folder.mkdir()
    np.save(folder / "csidata.npy", channels())
    (folder / "base-station.yml").write_text(station())
    (folder / "train_index.txt").write_text("0\n1\n2\n5\n")
    (folder / "test_index.txt").write_text("3\n4\n")
    return folder


def test_published_folder_is_read_and_what_is_assumed_is_said(folder, capsys):
    read = bisplat.read_dataset(folder)
    np.testing.assert_array_equal(np.concatenate([read.uplink, read.downlink], axis=-1), channels())
    assert read.uplink.shape == read.downlink.shape == (COUNT, ANTENNAS, 26)
    np.testing.assert_allclose(read.gateway_positions[3], [0, 0.18, 2])
    assert (read.places, read.frequency.source, read.frequencies) == (None, "assumed", None)
    with pytest.raises(InputError, match="expected positions"):
        _ = read.positions
    assert (read.train.tolist(), read.test.tolist()) == ([0, 1, 2, 5], [3, 4])
    said = capsys.readouterr().err
    assert "took the first 26 of 52 subcarriers for the uplink" in said
    assert "the carrier frequency is not stated" in said


def test_export_and_reading_are_each_others_inverse(tmp_path, capsys):
    places = np.random.default_rng(1).uniform((1, -1, 0), (4, 1, 2), (COUNT, 3))
    array = bisplat.PlanarArray(2, 2)
    wide = bisplat.write_dataset(tmp_path / "wide", places, channels(), array, "2.4 GHz", bandwidth="20 MHz")
    bisplat.export(wide, tmp_path / "csi", "csi")
    capsys.readouterr()
    read = bisplat.read_dataset(tmp_path / "csi")
    np.testing.assert_array_equal(np.concatenate([read.uplink, read.downlink], axis=-1), wide.band_responses)
    np.testing.assert_allclose(read.positions, wide.positions, atol=1e-6)
    np.testing.assert_array_equal(read.frequencies, wide.band.frequencies(2.4e9))
    assert sorted([*read.train, *read.test]) == sorted([*wide.train, *wide.test])
    assert capsys.readouterr().err == ""  # our own folder states everything


def test_channels_from_python_are_read_back(tmp_path):
    at, places = np.array([[0, 0.06 * number, 2] for number in range(ANTENNAS)]), np.eye(COUNT, 3)
    given = {"antennas": at, "frequency": "2.4 GHz", "bandwidth": "20 MHz"}
    made = bisplat.write_dataset(tmp_path / "placed", places, channels=channels(), **given)
    np.testing.assert_array_equal(made.values["channel"], channels())
    np.testing.assert_allclose(made.gateway_positions, at)
    assert made.positions.tolist() == places.tolist() and made.frequencies.shape == (52,)
    assert sorted([*made.train, *made.test]) == [*range(COUNT)]
    unplaced = bisplat.write_dataset(tmp_path / "unplaced", None, channels=channels(), antennas=at, frequency=2.4e9)
    assert unplaced.places is None and unplaced.band is None and unplaced.fingerprint != made.fingerprint


def test_check_describes_it(folder):
    found = bisplat.check(folder)
    described = found.description()
    assert found.valid
    assert "6 rows × 4 antennas × 52 subcarriers" in described["holds"]
    assert (described["positions (m)"], described["frequency"]) == ("not stated", "not stated")
    assert found.figures()["subcarriers_of_each_link"] == 26
    assert "fingerprint" in described and "26 subcarriers" in described["task"]
    (folder / "metadata.json").write_text('{"frequency_hz": "2.4 GHz"}')
    np.savetxt(folder / "tx_pos.csv", np.ones((COUNT, 3)), "%.1f", ",", header="x,y,z", comments="")
    described = bisplat.check(folder).description()
    assert "2.4 GHz" in described["frequency"] and "tx_pos.csv" in described["can be used"]


def _saved(change):
    return lambda folder: np.save(folder / "csidata.npy", change(channels()))


def _written(name: str, text: str):
    return lambda folder: (folder / name).write_text(text)


BAND = '{"frequency_hz": %g, "band": {"bandwidth": 2e7, "subcarriers": %d}}'


@pytest.mark.parametrize(
    ("damage", "file", "place"),
    [
        (_saved(lambda values: values.real), "csidata.npy", ""),
        (_saved(lambda values: values[..., :51]), "csidata.npy", "51"),
        (_saved(lambda values: 0 * values), "csidata.npy", "zeros"),
        (_saved(lambda values: np.where(values == values[2, 1, 7], np.nan, values)), "csidata.npy", "row 2"),
        (lambda folder: os.truncate(folder / "csidata.npy", 128 + 9976), "csidata.npy", "9976"),
        (_written("base-station.yml", station(3)), "base-station.yml", "3"),
        (_written("base-station.yml", "base_station: [0, 0, 2]\n"), "base-station.yml", "base_station[0]"),
        (_written("test_index.txt", "3\n6\n"), "test_index.txt", "row 2"),
        (_written("tx_pos.csv", "x,y,z\n1,1,1\n"), "tx_pos.csv", "6 rows"),
        (_written("metadata.json", BAND % (2.4e9, 64)), "metadata.json", "band.subcarriers"),
        (_written("metadata.json", BAND % (5e7, 52)), "metadata.json", "band.bandwidth"),
    ],
)
def test_a_damage_is_one_problem_that_names_the_place(damage, file, place, folder):
    damage(folder)
    [problem] = inspect(folder).problems
    assert problem.startswith(str(folder / file)) and place in problem
    with pytest.raises(InputError):
        bisplat.read_dataset(folder)


@pytest.mark.parametrize("name", ["csidata.npy", "base-station.yml", "train_index.txt"])
@pytest.mark.parametrize("kind", ANY_FILE)
def test_no_content_ends_in_a_traceback(name, kind, folder):
    (folder / name).unlink()
    ANY_FILE[kind][0](folder / name)
    assert inspect(folder).problems


@pytest.mark.parametrize(
    ("change", "warning"),
    [
        (_saved(lambda values: values[..., :8]), "26 subcarriers"),
        (_saved(lambda values: np.tile(values[..., :26], 2)), "the downlink equals the uplink"),
        (_saved(lambda values: values * (np.arange(6) > 1)[:, None, None]), "2 of 6 rows have a link of zeros alone"),
        (_written("test_index.txt", "3\n"), "1 rows are in neither train_index.txt nor test_index.txt"),
    ],
)
def test_check_warns_of_oddities(change, warning, folder):
    change(folder)
    assert warning in "\n".join(bisplat.check(folder).warnings)
