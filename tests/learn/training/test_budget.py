"""Training for a given time, presets, and options of a model on the command line."""

import time

import pytest
import torch

import bisplat
from learn.data.splits import split
from learn.models.model_settings import Steps
from learn.training import budget
from learn.training import registry as presets
from learn.training.config import Config, read_config
from learn.training.gradient_steps import Training
from learn.training.run_files import box_of, build_model
from learn.training.validation_part import Learned
from scenes.files.errors import InputError, ParameterError


def test_a_budget_is_turned_into_steps_once(tiny, tmp_path, monkeypatch, capsys):
    measured = []
    monkeypatch.setattr(budget, "measured_speed", lambda *_: measured.append(1) or budget.Speed(40.0, 0.0))
    for _ in range(2):
        run = bisplat.train(tiny, tmp_path / "run", model="mlp", budget=2.0)
    assert measured == [1] and run.config.by_steps.steps == 3
    said = capsys.readouterr().err
    assert "3 steps fit into 2 minutes" in said
    assert "keeps the 3 steps that this run began with, whatever the budget" in said
    with pytest.raises(InputError, match="an earlier run with seed 1, found one with seed 0"):
        bisplat.train(tiny, tmp_path / "run", model="mlp", budget=2.0, seed=1)


def test_a_budget_that_the_search_for_phases_uses_up_is_said(tiny, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(budget, "learned_responses", lambda *_: Learned(None, seconds=150.0))
    run = bisplat.train(tiny, tmp_path / "run", model="mlp", budget=2.0)
    assert run.config.by_steps.steps == 1
    assert "took 2.5 minutes, and the budget is 2, so only one step is trained" in capsys.readouterr().err


@pytest.mark.parametrize("steps", [1, 99, 100, 250, 1499, 1500, 20000])
def test_the_steps_of_a_training_time_are_those_that_take_it(steps):
    speed = budget.Speed(step=0.02, validation=0.5)
    assert speed.steps_in(speed.minutes_of(steps)) == steps
    assert speed.minutes_of(speed.steps_in(3.0)) == pytest.approx(3.0, rel=0.01)


def test_steps_are_timed_and_taken_with_the_asked_precision_of_matrix_products(tiny, tmp_path, monkeypatch):
    whole, found = Training.loss, []
    monkeypatch.setattr(
        Training, "loss", lambda *a, **k: found.append(torch.get_float32_matmul_precision()) or whole(*a, **k)
    )
    run = bisplat.train(tiny, tmp_path / "run", model="mlp", budget=0.002, matmul_precision="medium")
    assert run.config.by_steps.matmul_precision == "medium"
    assert len(found) > run.config.by_steps.steps and set(found) == {"medium"}
    assert torch.get_float32_matmul_precision() == "highest"


def test_timing_steps_does_not_change_the_training(tiny, tmp_path):
    of_time = bisplat.train(tiny, tmp_path / "time", model="mlp", budget=0.002)
    of_steps = bisplat.train(tiny, tmp_path / "steps", model="mlp", steps=of_time.config.by_steps.steps)
    assert of_time.config == of_steps.config
    weights = [(tmp_path / name / "weights.safetensors").read_bytes() for name in ("time", "steps")]
    assert weights[0] == weights[1]


def test_the_speed_counts_what_lightning_does_around_a_step(tiny, tmp_path, monkeypatch):
    data = bisplat.read_dataset(tiny)
    config = Config(dataset=str(tiny), model="mlp-responses", by_steps=Steps(batch_size=2))
    model = build_model(config, box_of(data.positions), data.beamformer, data.wavelength)
    monkeypatch.setattr(Training, "on_train_batch_start", lambda *_: time.sleep(0.03))
    monkeypatch.setattr(Training, "on_validation_batch_start", lambda *_: time.sleep(0.2))
    speed = budget.measured_speed(model, config.by_steps, data, split(data, "files", 0), 0, Learned(None))
    assert 0.03 < speed.step and 0.2 < speed.validation


def test_a_preset_is_a_model_and_its_steps_and_what_is_given_differs_from_it(tiny, tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(presets.PRESETS, "paper", presets.Preset("bisplat", 2))
    small = {"primitives": 4}
    config = bisplat.train(tiny, tmp_path / "run", preset="paper", options=small, batch_size=2).config
    told = capsys.readouterr().err
    assert "preset paper: bisplat with primitives=4, batch_size=2, 2 steps, about " in told
    assert "documentation, Reproduce the paper" in told
    assert (config.model, config.by_steps.steps, config.by_steps.batch_size) == ("bisplat", 2, 2)
    assert bisplat.train(tiny, tmp_path / "one", preset="paper", options=small, steps=1).config.by_steps.steps == 1
    with pytest.raises(ParameterError, match="expected none beside the preset paper, found mlp"):
        bisplat.train(tiny, tmp_path / "other", preset="paper", model="mlp")
    for preset in presets.PRESETS.values():
        assert preset.model in ("bisplat", "bisplat-plus")


def test_the_recorded_options_are_those_of_the_command_line(tiny, tmp_path, monkeypatch):
    words = ("bisplat", "train", str(tiny), "-o", str(tmp_path / "run"), "--model", "bisplat", "--steps", "1")
    monkeypatch.setattr("sys.argv", [*words, "--option", "primitives=8", "clusters=16", "bypass=bst"])
    from bisplat.__main__ import main

    main()
    assert read_config(tmp_path / "run").config.options == {"primitives": 8, "clusters": 16, "bypass": ["bst"]}
