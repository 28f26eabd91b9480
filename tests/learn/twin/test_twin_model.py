"""The twin: of a wrongly described scene and a few known spectra it predicts others, and is kept in a run folder."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from learn.data.splits import split
from learn.fitted.runs import load_run
from learn.reports.export import export
from learn.training.config import Config
from learn.training.prediction import predict
from learn.training.train import train_run
from learn.twin import twin_model as scene_weight
from learn.twin.twin_model import Twin
from scenes.files.errors import InputError, ParameterError
from scenes.scene.description import Scene
from scenes.scene.tolerances import Tolerances
from scenes.scene.unknowns import unknowns, vary
from scenes.storage.scene_writing import write_scene
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import read_dataset
from simulate.engines.rays_engine import Rays
from simulate.generation.generate import generate
from simulate.generation.request import Request
from simulate.rays.core.propagation import Propagation
from tests.small_scene import CABINET, small_scene

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def true() -> Scene:
    return small_scene(CABINET)


@pytest.fixture(scope="module")
def data(true, tmp_path_factory) -> Dataset:
    """Forty spectra of the small scene."""
    folder = tmp_path_factory.mktemp("twin") / "data"
    positions = np.random.default_rng(0).uniform(*true.transmitter.region, (40, 3))
    generate(Request(true, positions, "given", Rays(Propagation(rays=20_000)), 0), folder)
    return read_dataset(folder)


@pytest.fixture(scope="module")
def wrong(true, tmp_path_factory) -> str:
    """The small scene as described."""
    which = unknowns(true, Tolerances(materials=0))  # test_calibrate.py has materials, which take long
    draw = np.random.default_rng(1).normal(size=len(which)) * [each.tolerance for each in which]
    return str(write_scene(vary(true, which, draw), tmp_path_factory.mktemp("twin") / "wrong"))


@pytest.fixture(scope="module")
def run(data, wrong, tmp_path_factory):
    folder: Path = tmp_path_factory.mktemp("twin") / "run"
    config = Config(
        dataset=str(data.folder),
        model="twin",
        split="random",
        train_size=10,
        options={"scene": wrong, "materials": 0.0},
    )
    train_run(config, folder)
    return load_run(folder)


def correlation(a, b) -> float:
    """Median over positions, of element responses."""
    product = np.abs((a.conj() * b).sum(axis=1))
    return float(np.median(product / np.linalg.norm(a, axis=1) / np.linalg.norm(b, axis=1)))


def test_a_dozen_spectra_correct_the_scene(data, run, wrong):
    test = split(data, "random", 0).test
    positions, truth = data.positions[test], data.responses[test]
    described = Twin(run.model.region.numpy(), data.beamformer, data.wavelength, scene=wrong)
    assert correlation(predict(described, positions).responses, truth) < 0.99
    assert correlation(run.predict(positions).responses, truth) > 0.998


def test_pictures_correct_the_scene_too(data, wrong):
    known, test = np.arange(12), np.arange(20, 40)
    pictures = data.pictures.copy()
    pictures[3] = 0  # a black one says nothing
    twin = Twin(data.positions[[0, 1]], data.beamformer, data.wavelength, scene=wrong, materials=0.0)
    twin.fit(data.with_values(spectrum=pictures, response=None), known)
    found = correlation(predict(twin, data.positions[test]).responses, data.responses[test])
    assert found > 0.995  # as described: below 0.99
    assert len(twin.rest.places) == 11


def test_gains_of_chains_are_found(data, true, tmp_path):
    """The true responses are those of the described scene, with other gains of its chains."""
    twin = Twin(true.transmitter.region, data.beamformer, data.wavelength, scene=str(write_scene(true, tmp_path / "s")))
    tracer, known, test = twin._tracer, np.arange(30), np.arange(30, 40)
    traced = tracer.responses(data.positions)
    np.testing.assert_allclose(
        tracer.responses_by_chain(data.positions).sum(-1), traced, atol=1e-6 * np.abs(traced).max()
    )
    factors = 1 + 0.5 * np.random.default_rng(3).normal(size=(tracer.chains, 2)) @ [1, 1j]
    responses = tracer.responses(data.positions, factors)
    assert correlation(traced[test], responses[test]) < 0.96
    twin.refit(data.with_values(response=responses), known)
    assert correlation(predict(twin, data.positions[test]).responses, responses[test]) > 0.995


def test_a_run_whose_scene_has_changed_is_refused(data, run, tmp_path):
    changed = small_scene(replace(CABINET, mesh=CABINET.mesh.copy().apply_translation((0, 3, 0))))
    scene = str(write_scene(changed, tmp_path / "changed"))
    twin = Twin(run.model.region.numpy(), data.beamformer, data.wavelength, scene=scene, materials=0.0)
    twin.load_state_dict(run.model.state_dict())
    with pytest.raises(InputError, match="expected the scene that the twin was trained with"):
        predict(twin, data.positions[:1])


def test_known_responses_are_predicted_as_they_are(data, run):
    known = split(data, "random", 0, train_size=10).known
    found = run.predict(data.positions[known]).responses
    assert correlation(found, data.responses[known]) > 0.999
    uncertain = run.model.uncertainty(run.model.rest.places)
    assert float(uncertain.max()) < 0.2
    far = run.model.uncertainty(run.model.rest.places + 100)
    torch.testing.assert_close(far, (run.model.power / run.model.whole_power).expand(len(far)))  # what rays leave open


@pytest.mark.parametrize("right", [True, False])
def test_the_scene_counts_by_how_well_it_predicts(data, wrong, monkeypatch, right):
    """Once it traces the true responses but for a little noise, once noise alone."""
    monkeypatch.setattr(scene_weight, "LEAST_KNOWN", 10)
    noise = np.random.default_rng(2).normal(size=(*data.responses.shape, 2)) @ [1, 1j] * np.abs(data.responses).mean()
    responses = (data.responses + 0.05 * noise if right else noise).astype(np.complex64)
    monkeypatch.setattr(Twin, "_traced", lambda twin, positions: responses[: len(positions)])
    monkeypatch.setattr(Twin, "_fit_gains", lambda twin, positions, *_: responses[: len(positions)])
    twin = Twin(data.positions[[0, 1]], data.beamformer, data.wavelength, scene=wrong)
    twin.refit(data, np.arange(len(data.positions)))
    assert float(twin.trust) == (1.0 if right else 0.0)
    mixed = twin.responses(torch.from_numpy(data.positions).float())
    scale = float((twin.power if right else twin.whole_power).sqrt())
    alone = scale * (twin.rest if right else twin.whole).responses(torch.from_numpy(data.positions).float())
    expected = alone + torch.view_as_real(torch.from_numpy(responses)) if right else alone
    torch.testing.assert_close(mixed, expected)


def test_a_scene_is_needed_and_has_the_frequency(data, true, tmp_path):
    with pytest.raises(ParameterError, match="scene: expected a value, which the model twin needs"):
        train_run(Config(dataset=str(data.folder), model="twin"), tmp_path / "run")
    assert not (tmp_path / "run").exists()
    elsewhere = str(write_scene(true.at_frequency(1.83e9), tmp_path / "other"))
    with pytest.raises(InputError, match="found 1830 MHz"):
        Twin(true.transmitter.region, data.beamformer, data.wavelength, scene=elsewhere).fit(data, np.arange(9))


def test_it_is_not_exported_since_it_traces_rays(run, tmp_path):
    with pytest.raises(InputError, match="expected a model that needs no ray tracer, found twin"):
        export(run, tmp_path / "twin.onnx")
    assert not list(tmp_path.iterdir())
