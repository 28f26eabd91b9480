"""A folder of another kind than a command takes is named, with the commands that take it."""

import re

import numpy as np
import pytest

import bisplat
from bisplat.commands.command_groups import COMMANDS
from learn.evaluation.check import check
from learn.training.config import read_config
from scenes.files.errors import InputError
from simulate.dataset import dataset_kinds
from simulate.dataset.dataset_kinds import QUANTITIES, ROOMS
from simulate.exchange.convert import convert

MARKS = {name: each.mark for name, each in QUANTITIES.items() if each.mark} | {"rooms": ROOMS}


@pytest.fixture
def folder(tmp_path):
    """Function: name of a file, or a folder -> a folder with it alone."""

    def make(mark: str):
        (tmp_path / mark).mkdir() if mark == "spectrum" else (tmp_path / mark).write_text("{}")
        return tmp_path

    return make


@pytest.mark.parametrize("kind", MARKS)
def test_what_is_found_is_named_where_a_run_or_spectra_are_expected(folder, kind):
    place, words = folder(MARKS[kind]), QUANTITIES[kind].words if kind in QUANTITIES else "several rooms"
    for read in (read_config, lambda place: convert(place, place / "out")):
        if kind == "spectrum" and read is not read_config:
            continue
        with pytest.raises(InputError) as error:
            read(place)
        assert f"found {words}" in str(error.value)
    assert dataset_kinds.quantity_of(place) == (kind if kind in QUANTITIES else None)


def test_a_quantity_that_a_dataset_lacks_is_asked_for_in_vain(tmp_path):
    given = {"powers": [[-50.0], [-60.0], [-57.0]], "gateways": {"door": (0, 0, 1)}, "frequency": 2.4e9}
    heard = bisplat.write_dataset(tmp_path / "hall", np.eye(3), **given)
    for name in ("pictures", "spectra", "responses", "uplink", "array", "gateway_position", "band_responses"):
        with pytest.raises(InputError, match=f"^{heard.folder}: expected "):
            getattr(heard, name)
    for given in (heard, heard.folder):
        with pytest.raises(InputError, match=f"^{heard.folder}: expected spectra"):
            bisplat.train(given, tmp_path / "run", quantity="spectrum")
    assert not (tmp_path / "run").exists()


def test_every_command_that_takes_a_folder_exists():
    named = (dataset_kinds.TAKE_POWERS, dataset_kinds.TAKE_CHANNELS, dataset_kinds.TAKE_PLACED_CHANNELS)
    for words in named:
        assert set(re.findall("(?<!-)[a-z]{3,}", words.replace(" and ", ", "))) <= set(COMMANDS)


def test_rooms_are_a_problem_that_check_names(folder):
    (problem,) = check(folder(ROOMS)).problems
    assert "several rooms" in problem
