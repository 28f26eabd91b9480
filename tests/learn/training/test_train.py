"""Training: resumes exactly, refuses what is not its own, and leaves a run folder that can be used again."""

import csv
import json
import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import torch
from PIL import Image
from safetensors.torch import load_file
from torch.utils.data.distributed import DistributedSampler

import bisplat
from learn.data.metrics import ssim
from learn.evaluation.evaluate import evaluate
from learn.fitted.runs import load_run
from learn.models.capabilities import WEAK
from learn.models.model_settings import Steps
from learn.models.networks.aperture import BiSplatAperture
from learn.models.networks.mlp import ResponseMLP
from learn.models.quadrature import L1_WEIGHT, SSIM_WEIGHT, composite_loss, quadrature
from learn.reports.evaluation_report import write_evaluation
from learn.reports.provenance import Provenance
from learn.training import train as training
from learn.training import validation_part as epochs
from learn.training.config import read_config
from learn.training.gradient_steps import Batches, Training
from learn.training.registry import model_class
from learn.training.train import train_run
from scenes.files.errors import InputError
from scenes.files.output_folder import locked
from simulate.dataset.dataset_folder import read_dataset
from simulate.dataset.index_files import write_index
from simulate.dataset.spectra_folder import write_gateway
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.spectrum import normalise, spectrum_of

pytestmark = pytest.mark.usefixtures("small_models")


def weights(folder):
    return load_file(folder / "weights.safetensors")


def assert_same_weights(found, expected):
    found, expected = weights(found), weights(expected)
    assert found.keys() == expected.keys()
    for name, tensor in expected.items():
        assert torch.equal(found[name], tensor), name


@pytest.fixture
def stop_at(monkeypatch):
    """Function: makes training raise an exception at an optimiser step, counted from the run's start."""
    whole = Training.training_step

    def arm(step, exception):
        def training_step(self, batch, index):
            if self.trainer.global_step == step:
                raise exception
            return whole(self, batch, index)

        monkeypatch.setattr(Training, "training_step", training_step)

    yield arm
    monkeypatch.setattr(Training, "training_step", whole)


# Loss


def test_loss_is_seven_tenths_l1_and_three_tenths_dissimilarity(plane_waves):
    assert (L1_WEIGHT, SSIM_WEIGHT) == (0.7, 0.3)
    waves = np.array([plane_waves((1, azimuth, 30), (0.5, 200, 60)) for azimuth in (100, 130)])
    here, there = (torch.from_numpy(x)[None].float() for x in normalise(Beamformer().spectrum(waves)))
    assert composite_loss(here, here).item() == pytest.approx(0, abs=1e-6)
    assert composite_loss(here, (here + 0.1)).item() > 0.7 * 0.1
    # The loss's SSIM has another window than scikit-image's: near, not equal.
    similarity = ssim(here.double().numpy(), there.double().numpy())[0]
    expected = 0.7 * (here - there).abs().mean().item() + 0.3 * (1 - similarity)
    assert composite_loss(here, there).item() == pytest.approx(expected, abs=0.3 * 0.1)


# Interruption


@pytest.mark.parametrize(
    ("steps", "exception"),
    [((4,), KeyboardInterrupt), ((8,), KeyboardInterrupt), ((3, 7, 11), RuntimeError)],
    ids=["Ctrl-C before the first validation", "Ctrl-C after it", "three crashes"],
)
def test_resumed_training_gives_the_weights_of_an_uninterrupted_one(
    tmp_path, tiny_config, finished_run, stop_at, steps, exception
):
    folder = tmp_path / "run"
    for step in steps:
        stop_at(step, exception("stopped by the test"))
        with pytest.raises(exception):
            train_run(tiny_config, folder)
        assert not (folder / "weights.safetensors").exists()
    with pytest.raises(InputError, match="expected a finished run"):
        evaluate(folder)

    stop_at(None, None)
    train_run(tiny_config, folder)
    assert_same_weights(folder, finished_run)
    # Lightning replaces a log by a new one of the same name: the part before the interruption must still be there.
    logs = [pd.read_csv(path) for path in (folder / "logs").rglob("metrics.csv")]
    logged = pd.concat(logs)["step"]
    assert logged.max() == 11
    if steps != (4,):
        assert logged.min() <= 5, "the log of the steps before the interruption is gone"


def test_a_resumed_model_draws_what_it_would_have_drawn(tmp_path, tiny_config, changed, stop_at):
    """NeRF² draws pixels at random in each step."""
    config = changed(tiny_config, model="nerf2", options={"samples": 2, "rays": 40, "width": 8})
    train_run(config, tmp_path / "whole")
    stop_at(8, RuntimeError())
    with pytest.raises(RuntimeError):
        train_run(config, tmp_path / "stopped")
    stop_at(-1, None)
    train_run(config, tmp_path / "stopped")
    assert_same_weights(tmp_path / "stopped", tmp_path / "whole")


def test_interrupted_training_leaves_the_programs_own_answer_to_ctrl_c(tmp_path, tiny_config, stop_at):
    before = signal.getsignal(signal.SIGINT)
    stop_at(1, KeyboardInterrupt())
    with pytest.raises(KeyboardInterrupt):
        train_run(tiny_config, tmp_path / "run")
    assert signal.getsignal(signal.SIGINT) is before


def test_asked_steps_are_taken_and_an_epoch_ends_at_each_validation(
    tmp_path, tiny_config, changed, stop_at, monkeypatch
):
    monkeypatch.setattr(epochs, "STEPS_PER_VALIDATION", 3)
    config = changed(tiny_config, steps=7, batch_size=2)  # a pass has more than six batches
    train_run(config, tmp_path / "whole")
    assert json.loads((tmp_path / "whole" / "training.json").read_text())["steps"] == 7
    validated = pd.read_csv(tmp_path / "whole" / "logs" / "version_0" / "metrics.csv").dropna(subset="validation_ssim")
    assert validated["step"].tolist() == [3, 6]

    stop_at(4, RuntimeError())
    with pytest.raises(RuntimeError):
        train_run(config, tmp_path / "stopped")
    stop_at(-1, None)
    train_run(config, tmp_path / "stopped")
    assert_same_weights(tmp_path / "stopped", tmp_path / "whole")


def test_training_stops_when_validation_no_longer_rises_and_at_the_same_step_if_resumed(
    tmp_path, tiny_config, changed, stop_at, monkeypatch, capsys
):
    def falling(self):
        self.log("validation_ssim", -float(self.global_step))

    monkeypatch.setattr(Training, "on_validation_epoch_end", falling)
    config, whole = changed(tiny_config, steps=90, patience=3), tmp_path / "whole"
    train_run(config, whole)
    stop_at(20, RuntimeError())
    with pytest.raises(RuntimeError):
        train_run(config, tmp_path / "stopped")
    stop_at(24, AssertionError("a step too many"))
    train_run(config, tmp_path / "stopped")
    assert_same_weights(tmp_path / "stopped", whole)
    (whole / "weights.safetensors").unlink()  # killed after the last checkpoint
    train_run(config, whole)
    assert capsys.readouterr().err.count("stopped after 24 of 90 steps: validation has not risen since step 6") == 3
    assert_same_weights(tmp_path / "stopped", whole)
    assert json.loads((whole / "training.json").read_text())["steps"] == 24


@pytest.mark.parametrize(
    ("asked", "patience"), [({}, 5), ({"steps": 9}, 0), ({"steps": 9, "patience": 2}, 2), ({"preset": "paper"}, 0)]
)
def test_steps_that_are_asked_for_are_all_taken(tiny, tmp_path, monkeypatch, asked, patience):
    begun = []
    monkeypatch.setattr(training, "train_run", lambda config, *_, **__: begun.append(config.by_steps.patience))
    monkeypatch.setattr(training, "load_spectra", lambda _: None)
    (tmp_path / "config.json").touch()  # a preset is timed before it begins
    bisplat.train(tiny, tmp_path, **{"model": "mlp"} | asked if "preset" not in asked else asked)
    assert begun == [patience]


# The folder


def test_finished_run_returns_at_once(tiny_config, finished_run, stop_at):
    stop_at(0, AssertionError("trained again"))
    files = sorted((path, path.stat().st_mtime_ns) for path in finished_run.rglob("*") if path.is_file())
    train_run(tiny_config, finished_run)
    assert files == sorted((path, path.stat().st_mtime_ns) for path in finished_run.rglob("*") if path.is_file())


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("dataset", "elsewhere"),
        ("model", "bisplat"),
        ("split", "blocked"),
        ("seed", 4),
        ("steps", 24),
        ("batch_size", 4),
        ("learning_rate", 1e-3),
        ("encoding", "octaves"),
    ],
)
def test_run_folder_of_another_run_is_refused(tiny_config, changed, finished_run, write_folder, tmp_path, name, value):
    if name == "dataset":
        value = str(write_folder(tmp_path / value))
    with pytest.raises(InputError, match=f"{finished_run}: expected .* found one with {name} "):
        settings = {"options": {name: value}} if name == "encoding" else {name: value}
        train_run(changed(tiny_config, **settings), finished_run)


def test_second_process_is_refused_and_a_finished_run_needs_no_lock(tiny_config, finished_run, tmp_path):
    (tmp_path / "run").mkdir()
    with locked(tmp_path / "run"), pytest.raises(InputError, match=f"process {os.getpid()} .* is writing to"):
        train_run(tiny_config, tmp_path / "run")
    assert not list((tmp_path / "run").iterdir())
    with locked(finished_run):
        train_run(tiny_config, finished_run)


def test_run_folder_says_what_was_trained(tiny, tiny_config, finished_run):
    config, beamformer, *_ = read_config(finished_run)
    assert config == tiny_config and beamformer == Beamformer()
    parts = json.loads((finished_run / "split.json").read_text())
    assert parts.keys() == {"train", "validation", "test"}
    names = [name for part in parts.values() for name in part]
    assert len(names) == len(set(names)) == 24
    assert sorted(parts["test"]) == (tiny / "test_index.txt").read_text().split()
    assert len(parts["validation"]) == 2


def test_saved_weights_are_those_with_the_best_validation(tiny, tiny_config, finished_run):
    run, dataset = load_run(finished_run), read_dataset(tiny)
    validation = run.split(dataset).validation
    prediction = run.predict(dataset.positions[validation]).spectra
    found = np.median(ssim(prediction, spectrum_of(dataset.pictures[validation])))
    (path,) = (finished_run / "logs").rglob("metrics.csv")
    assert found == pytest.approx(pd.read_csv(path)["validation_ssim"].max(), abs=1e-4)


@pytest.mark.parametrize("model", ["bisplat", "bisplat-plus"])
def test_other_models_train_predict_and_load_too(tmp_path, monkeypatch, tiny_config, changed, model):
    folder = tmp_path / "run"
    monkeypatch.setattr(epochs, "STEPS_PER_VALIDATION", 1)
    config = changed(tiny_config, model=model, steps=1, batch_size=17, options={"bypass": ("bst",)})
    train_run(config, folder)
    run = load_run(folder)
    assert run.config == config and run.model.bypass == {"bst"}
    positions = np.array([[1.0, 0.5, 1.0]] * 18)  # more than one batch
    prediction = run.predict(positions)
    assert prediction.spectra.shape == (18, 90, 360) and prediction.responses is None


def test_loaded_run_predicts_what_its_weights_say(finished_run, tiny):
    run, dataset = load_run(finished_run), read_dataset(tiny)
    known = dataset.positions[run.split(dataset).known]
    np.testing.assert_allclose(run.model.region.cpu(), [known.min(0), np.maximum(known.max(0), known.min(0) + 1e-3)])
    positions = dataset.positions[:20]
    prediction = run.predict(positions)
    pictures, responses = prediction.spectra, prediction.responses
    assert (pictures.shape, pictures.dtype) == ((20, 90, 360), np.float32)
    assert (responses.shape, responses.dtype) == ((20, 16), np.complex64)
    np.testing.assert_allclose(pictures, normalise(Beamformer().spectrum(responses)), atol=1e-5)


def test_training_begins_with_the_weights_of_another_run(finished_run, tmp_path, tiny_config, changed, write_folder):
    """At a rate of nothing they stay what they were, but for the box that positions are scaled by."""
    other = str(write_folder(tmp_path / "other", count=31))
    config = changed(tiny_config, dataset=other, init=str(finished_run), learning_rate=1e-30)
    train_run(config, tmp_path / "run")
    found, expected = weights(tmp_path / "run"), weights(finished_run)
    assert not torch.equal(found.pop("region"), expected.pop("region"))
    torch.testing.assert_close(found, expected)
    with pytest.raises(InputError, match="expected a run of the same model and size"):
        train_run(changed(config, model="mlp"), tmp_path / "third")


def test_weights_of_a_run_that_has_learned_test_spectra_are_refused(tiny, tmp_path):
    short = {"model": "mlp", "steps": 1, "find_phases": False}
    bisplat.train(tiny, tmp_path / "before", split="random", seed=1, **short)
    with pytest.raises(
        InputError, match=r"before: expected a run that has not learned the test spectra, found one that"
    ):
        bisplat.train(tiny, tmp_path / "after", init=tmp_path / "before", **short)
    assert not (tmp_path / "after").exists()
    bisplat.train(tiny, tmp_path / "same", init=tmp_path / "before", split="random", seed=1, **short)


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (
            "index",
            "expected the split that .* was begun with, found another one, as if the index files had",
        ),
        ("frequency", "expected 915 MHz as .* was begun with, found 1830 MHz; train on it into another folder"),
        ("array", "expected 4 × 4 elements .* was begun with, found 2 × 8 elements"),
    ],
)
def test_a_run_is_not_gone_on_with_if_its_dataset_states_other_things_now(change, expected, tiny, tmp_path):
    data, short = shutil.copytree(tiny, tmp_path / "data"), {"model": "mlp", "steps": 1, "find_phases": False}
    bisplat.train(data, tmp_path / "run", **short)
    bisplat.train(data, tmp_path / "run", **short)
    metadata = json.loads((data / "metadata.json").read_text())
    if change == "index":
        (data / "train_index.txt").write_text("\n".join(f"{number:05d}" for number in range(5, 25)))
        (data / "test_index.txt").write_text("\n".join(f"{number:05d}" for number in range(1, 5)))
    elif change == "frequency":
        (data / "metadata.json").write_text(json.dumps(metadata | {"frequency_hz": 1.83e9}))
    else:
        array = {"rows": 2, "columns": 8, "spacing": 0.5}
        (data / "metadata.json").write_text(json.dumps(metadata | {"array": array}))
    with pytest.raises(InputError, match=expected):
        bisplat.train(data, tmp_path / "run", **short)


# Evaluation


@pytest.mark.slow
def test_evaluation_scores_the_test_part_beside_the_baselines(tiny, finished_run, tmp_path):
    found = evaluate(finished_run)
    write_evaluation(found, tmp_path / "evaluation")
    dataset = read_dataset(tiny)
    assert sorted(found.test) == sorted(dataset.test)

    metrics = json.loads((tmp_path / "evaluation" / "metrics.json").read_text())
    assert metrics.pop("provenance")["dataset"] == "tiny"
    assert metrics == found.metrics()
    assert metrics["test_spectra"] == 5
    assert metrics["baselines"].keys() == {"mean_picture", "nearest", "inverse_distance", "array_ceiling"}
    truth, known = dataset.spectra[found.test].astype(float), np.setdiff1d(np.arange(24), found.test)
    prediction = load_run(finished_run).predict(dataset.positions[found.test]).spectra.astype(float)
    assert metrics["ssim_median"] == pytest.approx(np.median(ssim(prediction, truth)), abs=1e-6)
    distance = np.linalg.norm(dataset.positions[found.test][:, None] - dataset.positions[known], axis=-1)
    copies = dataset.spectra[known[distance.argmin(axis=1)]].astype(float)
    assert metrics["baselines"]["nearest"]["ssim_median"] == pytest.approx(np.median(ssim(copies, truth)), abs=1e-6)
    mean = np.stack([dataset.spectra[known].astype(float).mean(axis=0)] * 5)
    found_mean = metrics["baselines"]["mean_picture"]
    assert found_mean["mae_mean"] == pytest.approx(np.abs(mean - truth).mean(), abs=1e-6)

    rows = pd.read_csv(tmp_path / "evaluation" / "per_sample.csv", dtype={"name": str}).set_index("name")
    assert sorted(rows.index) == (tiny / "test_index.txt").read_text().split()
    assert rows["ssim"].median() == pytest.approx(metrics["ssim_median"], abs=1e-5)
    assert rows["ssim_nearest"].median() == pytest.approx(metrics["baselines"]["nearest"]["ssim_median"], abs=1e-5)
    np.testing.assert_allclose(rows.loc["00003", ["x", "y", "z"]].to_numpy(float), dataset.positions[2])
    for name in ("ssim_cdf.png", "examples.png"):
        with Image.open(tmp_path / "evaluation" / name) as image:
            image.load()


@pytest.mark.usefixtures("no_ceiling")
def test_evaluation_on_an_index_tests_on_exactly_that(tmp_path, finished_run):
    write_index(tmp_path / "index.txt", ["00023", "00003"])
    assert sorted(evaluate(finished_run, index=tmp_path / "index.txt").test) == [2, 22]


@pytest.mark.parametrize("part", ["train", "validation"])
def test_index_that_names_a_spectrum_the_run_has_seen_is_refused(tmp_path, tiny, finished_run, part):
    seen = json.loads((finished_run / "split.json").read_text())[part][0]
    write_index(tmp_path / "index.txt", ["00003", seen])
    for dataset in (None, tiny):
        with pytest.raises(InputError, match=f"trained on, such as {seen}"):
            evaluate(finished_run, dataset, tmp_path / "index.txt")


@pytest.mark.usefixtures("no_ceiling")
def test_evaluation_on_another_dataset_tests_on_all_of_it_against_baselines_from_the_training_one(
    tmp_path, tiny, finished_run, write_folder
):
    other = write_folder(tmp_path / "other", count=3)
    found = evaluate(finished_run, other)
    assert found.test.tolist() == [0, 1, 2] and found.metrics()["test_spectra"] == 3
    ours, theirs = read_dataset(tiny), read_dataset(other)
    known = load_run(finished_run).split(ours).known
    near = known[np.linalg.norm(theirs.positions[:, None] - ours.positions[known], axis=-1).argmin(axis=1)]
    expected = ssim(ours.spectra[near].astype(float), theirs.spectra.astype(float))
    np.testing.assert_allclose(found.scores["nearest"].ssim, expected, atol=1e-6)
    made = Provenance.of_evaluation(found)
    assert made.dataset == "tiny" and made.split.endswith("tested on all spectra of other")


@pytest.mark.parametrize(
    ("metadata", "expected"),
    [
        ({"frequency_hz": 1.83e9}, "other: expected spectra at 915 MHz, as .*, found 1830 MHz"),
        (
            {"array": {"rows": 8, "columns": 2, "spacing": 0.5}},
            "other: expected spectra of 4 × 4 elements .*, found 8 × 2 elements",
        ),
        ({"moving": "receiver"}, "expected spectra for which the transmitter moves, as for .*, found some for which"),
    ],
    ids=["frequency", "array", "moving"],
)
def test_spectra_that_are_not_what_the_run_predicts_are_refused(
    metadata, expected, tmp_path, finished_run, write_folder
):
    other = write_folder(tmp_path / "other", count=3)
    stated = json.loads((other / "metadata.json").read_text())
    (other / "metadata.json").write_text(json.dumps(stated | metadata))
    with pytest.raises(InputError, match=expected):
        evaluate(finished_run, other)


@pytest.mark.usefixtures("no_ceiling")
def test_spectra_of_a_gateway_elsewhere_are_scored_with_a_warning(tmp_path, finished_run, write_folder, capsys):
    other = write_folder(tmp_path / "other", count=3)
    evaluate(finished_run, other)
    assert "warning: the gateway" not in capsys.readouterr().err
    write_gateway(other / "gateway_info.yml", "tiny", (0, 2, 1), (0, 0, 0, 1))
    evaluate(finished_run, other)
    assert f"the gateway of {other} is 2 m away from that of {finished_run}" in capsys.readouterr().err


def test_every_pass_has_an_order_of_its_own_whatever_the_epochs():
    def drawn(first, count):
        sampler = DistributedSampler(range(17), 1, 0, seed=0, drop_last=True)
        return list(Batches(sampler, 5, first, count))

    whole = drawn(0, 9)
    # Two spectra are left out of each pass.
    passes = [[index for batch in whole[start : start + 3] for index in batch] for start in (0, 3, 6)]
    assert all(len(set(each)) == 15 for each in passes) and len({tuple(each) for each in passes}) == 3
    assert drawn(0, 4) + drawn(4, 5) == whole  # a resumed run sees what an uninterrupted one would have seen


# Several processes


def losses(run: Path) -> list[tuple[int, float]]:
    rows = csv.DictReader((run / "logs" / "version_0" / "metrics.csv").open())
    return [(int(row["step"]), float(row["loss"])) for row in rows if row.get("loss")]


TWO_PROCESSES = """
import sys
from pathlib import Path
import torch
from torch.utils.data.distributed import DistributedSampler
import learn.training.validation_part
from learn.models.model_settings import Steps
from learn.training.config import Config
from learn.training.train import train_run

learn.training.validation_part.STEPS_PER_VALIDATION = 6
torch.optim.AdamW = lambda parameters, lr, **_: torch.optim.SGD(parameters, lr)
train_run({config!r}, Path(sys.argv[1]), {{"devices": 2}})
"""


@pytest.mark.slow
def test_two_processes_have_the_loss_curve_of_one(tiny_config, changed, small, tmp_path, monkeypatch):
    """The same global batches, gradients averaged: equal but for rounding. By plain descent, since Adam divides by the
    gradient's size and so makes whole steps of rounding errors."""
    config = changed(tiny_config, model="bisplat", options=small, batch_size=4, learning_rate=0.03)
    monkeypatch.setattr(torch.optim, "AdamW", lambda parameters, lr, **_: torch.optim.SGD(parameters, lr))
    train_run(config, tmp_path / "one")
    script = tmp_path / "two_processes.py"
    script.write_text(TWO_PROCESSES.format(config=config))
    environment = os.environ | {"OMP_NUM_THREADS": "1", "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, script, tmp_path / "two"]
    subprocess.run(command, check=True, capture_output=True, timeout=300, env=environment)
    one, two = losses(tmp_path / "one"), losses(tmp_path / "two")
    assert len(one) >= 2
    assert [step for step, _ in one] == [step for step, _ in two]
    np.testing.assert_allclose(two, one, rtol=1e-4)
    assert one[-1][1] < 0.98 * one[0][1]


@pytest.mark.parametrize(
    ("trainer", "expected"),
    [
        ({"devices": 3}, "batch_size: expected a multiple of the number of devices, 3, found 2"),
        ({"num_nodes": 3}, "batch_size: expected a multiple of the number of devices, 3, found 2"),
        ({"devices": 0}, "trainer: expected arguments of Lightning's Trainer"),
        ({"max_epochs": 2}, "trainer: expected some of accelerator, devices, num_nodes, strategy, found 'max_epochs'"),
    ],
)
def test_place_of_a_training_that_is_impossible_is_refused(tiny_config, changed, tmp_path, trainer, expected):
    config = changed(tiny_config, batch_size=2)
    with pytest.raises(InputError, match=re.escape(expected)):
        train_run(config, tmp_path / "run", {"accelerator": "cpu", **trainer})
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("steps", [1, 12, 100])
def test_learning_rate_rises_linearly_then_falls_along_a_half_cosine(steps):
    model, pixels = ResponseMLP(np.array([[0.0, 0, 0], [1, 1, 1]]), Beamformer(), 0.3), quadrature(Beamformer())
    chosen = Training(model, Steps(steps=steps, learning_rate=2e-3), pixels).configure_optimizers()
    optimiser, schedule = chosen["optimizer"], chosen["lr_scheduler"]["scheduler"]
    found = []
    for _ in range(steps):
        found.append(optimiser.param_groups[0]["lr"])
        optimiser.step()
        schedule.step()
    warm_up = max(1, round(0.05 * steps))
    rising = (np.arange(warm_up) + 1) / warm_up
    falling = 0.5 * (1 + np.cos(np.pi * np.arange(steps - warm_up) / max(1, steps - warm_up)))
    np.testing.assert_allclose(found, 2e-3 * np.concatenate([rising, falling]), atol=1e-12)


def test_all_weights_but_those_of_primitives_decay(small_aperture, region):
    model = BiSplatAperture(region, Beamformer(), 0.33, **small_aperture)
    module = Training(model, Steps(steps=10, weight_decay=10.0), quadrature(Beamformer()))
    optimiser = module.configure_optimizers()["optimizer"]
    before = {name: parameter.detach().clone() for name, parameter in model.named_parameters()}
    for parameter in model.parameters():
        parameter.grad = torch.zeros_like(parameter)
    optimiser.step()
    left = 1 - 10.0 * optimiser.param_groups[0]["lr"]
    for name, parameter in model.named_parameters():
        factor = 1.0 if name.startswith("primitives.") else left
        assert torch.allclose(parameter, before[name] * factor), name


def test_known_responses_are_learned_by_the_models_that_predict_them(region):
    positions, pictures = torch.rand(2, 3), torch.zeros(2, 90, 360, dtype=torch.uint8)
    responses, unknown = torch.rand(2, 16, 2), torch.zeros(2, 0, 2)
    for name, by_responses in (("mlp-responses", True), ("mlp", False)):
        torch.manual_seed(0)
        model = model_class(name)(region, Beamformer(), 0.33)
        module = Training(model, Steps(), quadrature(Beamformer()))
        of_pictures = composite_loss(model(positions), pictures / 255)
        expected = model.responses_loss(positions, responses) if by_responses else of_pictures
        torch.testing.assert_close(module.loss(positions, pictures, responses, coarse=False), expected)
        torch.testing.assert_close(module.loss(positions, pictures, unknown, coarse=False), of_pictures)


def test_loss_of_responses_is_the_relative_error_of_each_spectrum(monkeypatch, region):
    model = model_class("mlp-responses")(region, Beamformer(), 0.33)
    truth = torch.stack([torch.ones(16, 2), 10 * torch.ones(16, 2)])
    monkeypatch.setattr(model, "responses", lambda positions: 1.1 * truth)
    expected = (0.01 * 2 / (2 + WEAK) + 0.01 * 200 / (200 + WEAK)) / 2
    assert float(model.responses_loss(torch.zeros(2, 3), truth)) == pytest.approx(expected, rel=1e-4)


def test_training_on_responses_brings_the_spectra_near(tmp_path, write_folder):
    """Of a path that is sampled every seventh of a wavelength: a network of plane waves predicts what is between."""
    dataset = read_dataset(write_folder(tmp_path / "data", count=80, keep_responses=True))
    run = bisplat.train(dataset, tmp_path / "run", model="mlp-responses", steps=100, batch_size=32)
    truth = dataset.spectra[dataset.test]
    assert np.median(ssim(run.predict(dataset.positions[dataset.test]).spectra, truth)) > 0.9
    assert float(run.model.wavelength) == pytest.approx(dataset.wavelength)
