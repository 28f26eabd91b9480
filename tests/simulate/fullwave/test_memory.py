"""Runs that this machine has no memory for are refused before anything is written, with a value that fits."""

import re

import pytest

from scenes.files.errors import InputError, ParameterError
from scenes.storage.scene_yaml import load_scene
from simulate.fullwave import run_cost
from simulate.fullwave.run_cost import memory_of_runs, require_memory, runs_at_once
from simulate.fullwave.run_plan import plan
from simulate.parallel import machines
from simulate.parallel.machines import machine_memory

CLOSET = load_scene("closet")
REGION = CLOSET.transmitter.region
FINE, COARSE = plan(CLOSET, REGION, 0.01), plan(CLOSET, REGION, 0.02)


@pytest.fixture
def machine(monkeypatch):
    """Function: let the machine have so many bytes of memory."""
    return lambda size: monkeypatch.setattr(run_cost, "machine_memory", lambda: size)


def test_memory_of_this_machine_and_of_a_container(tmp_path, monkeypatch):
    assert 1e8 < machine_memory() < 1e14
    (tmp_path / "max").write_text("max\n")
    (tmp_path / "limit").write_text("2000000\n")
    monkeypatch.setattr(machines, "LIMITS", (tmp_path / "max", tmp_path / "limit", tmp_path / "none"))
    assert machine_memory() == 2e6


def test_cells_that_do_not_fit_are_refused_with_some_that_do(machine):
    machine(memory_of_runs(COARSE, 1) * 1.2)
    require_memory(COARSE)
    with pytest.raises(ParameterError, match=r"cell: expected about [\d.]+ m, since cells of 0.01 m take") as error:
        require_memory(FINE)
    (proposed,) = re.findall(r"about ([\d.]+) m", str(error.value))
    require_memory(plan(CLOSET, REGION, float(proposed)))


def test_runs_at_a_time_that_do_not_fit_are_refused_with_a_number_that_does(machine):
    machine(memory_of_runs(COARSE, 4) * 1.01)
    with pytest.raises(ParameterError, match="workers: expected at most 4, since 8 runs take"):
        require_memory(COARSE, 8)
    require_memory(COARSE, 4)
    assert 1 <= runs_at_once(COARSE) <= 4


def test_scene_for_which_no_cells_fit(machine):
    machine(10**6)
    with pytest.raises(InputError, match="closet: expected a smaller scene"):
        require_memory(COARSE)
