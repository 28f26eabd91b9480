"""A folder of another kind than a command takes is named, with the commands that take it."""

import re

import pytest

from bisplat.commands.command_groups import COMMANDS
from learn.evaluation.check import check
from learn.training.config import read_config
from scenes.files.errors import InputError
from simulate.dataset import dataset_kinds
from simulate.dataset.dataset_folder import read_dataset
from simulate.exchange.convert import convert

POWERS, CHANNELS, ROOMS = dataset_kinds.POWERS, dataset_kinds.CHANNELS, dataset_kinds.ROOMS


@pytest.fixture
def folder(tmp_path):
    """Function: name of a file, or a folder -> a folder with it alone."""

    def make(mark: str):
        (tmp_path / mark).mkdir() if mark == "spectrum" else (tmp_path / mark).write_text("{}")
        return tmp_path

    return make


@pytest.mark.parametrize(
    ("mark", "found"),
    [
        (POWERS, "received powers"),
        (CHANNELS, "channels over subcarriers"),
        (ROOMS, "several rooms"),
        ("spectrum", "spectra"),
    ],
)
def test_what_is_found_is_named_wherever_another_kind_is_expected(folder, mark, found):
    place = folder(mark)
    with pytest.raises(InputError, match=f"expected a run folder made by bisplat train, found {found}"):
        read_config(place)
    if mark != "spectrum":
        for read in (read_dataset, lambda place: convert(place, place / "out")):
            with pytest.raises(InputError, match=f"expected a dataset of spectra, found {found}"):
                read(place)
    if mark != POWERS:
        with pytest.raises(InputError, match=rf"expected received powers \(gateway_rssi\.csv\), found {found}"):
            read_dataset(place)
    if mark != CHANNELS:
        with pytest.raises(InputError, match=rf"expected channels \(csidata\.npy\), found {found}"):
            read_dataset(place)


def test_every_command_that_takes_a_folder_exists():
    named = (dataset_kinds.TAKE_POWERS, dataset_kinds.TAKE_CHANNELS, dataset_kinds.TAKE_PLACED_CHANNELS)
    for words in named:
        assert set(re.findall("[a-z]{3,}", words.replace(" and ", ", ").replace("--hdf5", ""))) <= set(COMMANDS)


def test_rooms_are_a_problem_that_check_names(folder):
    (problem,) = check(folder(ROOMS)).problems
    assert "expected a dataset of spectra, found several rooms" in problem
