"""Several runs of one split as one."""

from dataclasses import replace

import numpy as np
import pytest

from bisplat.commands.predict_command import predict
from learn.training.config import Config
from learn.training.ensemble import Ensemble
from learn.training.registry import MODELS
from learn.training.run_folder import load_run
from learn.training.train import train_run
from scenes.files.errors import InputError, ParameterError

POSITIONS = np.array([[2.0, 0.5, 1.0], [1.0, 0.0, 1.0], [3.0, 0.2, 1.0]])


@pytest.fixture(scope="module")
def runs(tmp_path_factory, write_folder):
    folder = tmp_path_factory.mktemp("ensemble")
    steps = replace(MODELS["mlp"].by_steps, steps=4)
    config = Config(dataset=str(write_folder(folder / "data", 150)), model="mlp", split_seed=0, by_steps=steps)
    for seed in (0, 1, 2):
        train_run(replace(config, seed=seed), folder / f"run-{seed}")
    return [load_run(folder / f"run-{seed}") for seed in (0, 1, 2)]


def test_mean_of_the_runs(runs):
    each = np.stack([run.predict(POSITIONS).spectra for run in runs])
    np.testing.assert_allclose(Ensemble(runs).predict(POSITIONS), each.mean(axis=0), atol=1e-6)


def test_deviations_hold_the_errors_of_validation(runs):
    together = Ensemble(runs)
    data = runs[0].dataset()
    validated = runs[0].split(data).validation
    stated = together.deviation(data.positions[validated])[:, None, None]
    errors = np.abs(data.spectra[validated] - together.predict(data.positions[validated]))[:, ::5, ::5]
    assert np.mean(errors <= 1.6449 * stated) == pytest.approx(0.9, abs=0.01)


@pytest.mark.usefixtures("quick_fits")
def test_runs_that_have_learned_the_validation_spectra_state_no_deviation(runs, tmp_path):
    closed = replace(runs[0].config, model="helmholtz", by_steps=None)
    train_run(closed, tmp_path / "run")
    together = Ensemble([runs[0], load_run(tmp_path / "run")])
    assert together.deviation(POSITIONS) is None and together.predict(POSITIONS).shape == (3, 90, 360)
    (tmp_path / "places.csv").write_text("x,y,z\n1,0,1\n")
    predict((runs[0].folder, tmp_path / "run"), tmp_path / "out.npz", tmp_path / "places.csv")
    with np.load(tmp_path / "out.npz") as found:
        assert set(found) == {"spectra"}


def test_command_writes_the_mean(runs, tmp_path):
    (tmp_path / "places.csv").write_text("x,y,z\n" + "".join(f"{x},{y},{z}\n" for x, y, z in POSITIONS))
    output = tmp_path / "out.npz"
    predict(tuple(run.folder for run in runs), output, tmp_path / "places.csv")
    with np.load(output) as found:
        np.testing.assert_allclose(found["spectra"], Ensemble(runs).predict(POSITIONS), atol=1e-6)
        assert found["deviation"].shape == (3,) and "channels" not in found
    with pytest.raises(ParameterError, match="at least one run"):
        predict((), tmp_path / "other.npz", tmp_path / "places.csv")


def test_runs_of_another_split_are_refused(runs, tmp_path):
    other = replace(runs[0].config, split="random", split_seed=5)
    train_run(other, tmp_path / "run")
    with pytest.raises(InputError, match="same dataset and split"):
        Ensemble([runs[0], load_run(tmp_path / "run")])
