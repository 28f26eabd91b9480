"""Cross-validation compares a run with what its own gateway would see at new places."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

from learn.evaluation.crossvalidate import crossvalidate
from learn.fitted.runs import load_run, train
from learn.reports.evaluation_report import write_crossvalidation
from scenes.files.errors import InputError
from scenes.places.built_in import lab
from scenes.scene.antennas import Transmitter
from scenes.scene.description import Scene
from scenes.scene.shapes import bounding_box
from simulate.generation.simulation import simulate
from simulate.positions.placement import free_positions
from simulate.rays.chain_solver import ChainSolver
from simulate.rays.core.propagation import Propagation
from tests.simulate.engines.told import Told
from tests.small_scene import small_scene

pytestmark = pytest.mark.usefixtures("small_models")


class Known:
    """A tracer whose answer is known: every place is seen as one plane wave from boresight."""

    def responses(self, positions):
        self.positions = positions
        return np.ones((len(positions), 16), np.complex64)


@pytest.fixture
def run(finished_run, tmp_path):
    return shutil.copytree(finished_run, tmp_path / "run")


@pytest.fixture
def hall() -> Scene:
    """The lab with its gateway where the tiny dataset has it: at (0, 0, 1), looking up."""
    gateway = replace(lab().gateway, position=(0.0, 0.0, 1.0), orientation=(0.0, 0.0, 0.0, 1.0))
    return replace(lab(), gateway=gateway, transmitter=Transmitter((0, 0, 0.5), (4, 1, 1.5)))


def test_new_places_are_in_the_box_of_the_training_positions(run, hall):
    tracer = Known()
    result = crossvalidate(run, hall, 12, 5, Told(tracer))
    assert result.prediction.shape == result.truth.shape == (12, 90, 360)
    assert (tracer.positions == result.positions).all()
    assert (result.positions[:, :2] >= 0).all() and (result.positions <= [4, 1, 1.01]).all()
    assert result.truth[:, -1].min() > 0.99  # boresight is the maximum
    assert (result.run_name, result.scene_name) == ("run", "lab") and result.known_positions.shape == (19, 3)
    assert result.correlation.shape == (12,) and result.correlation.max() <= 1


@pytest.mark.slow
def test_new_places_are_not_those_of_a_dataset_with_the_same_seed(run, hall):
    known = load_run(run).dataset().positions
    drawn = free_positions(hall, bounding_box(known), 12, np.random.default_rng(5))  # as simulate --seed 5 does
    found = crossvalidate(run, hall, 12, 5, Told(Known())).positions
    assert np.linalg.norm(found[:, None] - drawn, axis=-1).min() > 0.01


def test_report_is_written_apart_from_the_comparison(run, hall, tmp_path):
    before = sorted(path.name for path in run.iterdir())
    result = crossvalidate(load_run(run), hall, 4, 5, Told(Known()))
    assert sorted(path.name for path in run.iterdir()) == before
    write_crossvalidation(result, tmp_path / "report")
    written = json.loads((tmp_path / "report" / "crossvalidation.json").read_text())
    assert written.pop("provenance")["seed"] == str(result.origin.seed)
    assert written == result.metrics()
    figures = ("map", "distance", "examples", "polar")
    expected = {f"crossvalidation_{name}.{suffix}" for name in figures for suffix in ("png", "pdf")}
    found = {path.name for path in (tmp_path / "report").iterdir()}
    assert found == expected | {"crossvalidation.html", "crossvalidation.json"}
    assert "run against what was told in lab" in (tmp_path / "report" / "crossvalidation.html").read_text()


def test_of_several_gateways_the_datasets_is_taken(run, hall):
    elsewhere = replace(hall.gateway, position=(1.0, 2.0, 1.0), rows=2)
    both = replace(hall, gateway=elsewhere, further_gateways={"the-one": hall.gateway})
    expected = crossvalidate(run, hall, 4, 5, Told(Known())).metrics()
    assert crossvalidate(run, both, 4, 5, Told(Known())).metrics() == expected


def test_scene_without_the_datasets_gateway_is_refused(run):
    with pytest.raises(InputError, match=r"lab: expected a gateway at \[0.0, 0.0, 1.0\].*found \[7.2, 3.0, 1.4\]"):
        crossvalidate(run, lab(), 4, 5, Told(Known()))


def test_a_dataset_by_rays_is_compared_without_a_second_search(tmp_path, monkeypatch):
    quick = Propagation(max_depth=1, rays=20_000)
    run = train(simulate(small_scene(), tmp_path / "data", n=12, propagation=quick), tmp_path / "run", split="random")
    monkeypatch.delattr(ChainSolver, "_search")
    assert crossvalidate(run, small_scene(), 4).truth_by == "fresh ray tracing"
