"""Training for a given time, presets, and options of a model on the command line."""

import pytest

import bisplat
from bisplat.commands.training_commands import read_option
from learn.training import budget, presets
from learn.training.config import read_config
from scenes.files.errors import InputError, ParameterError


def test_a_budget_is_turned_into_steps_once(tiny, tmp_path, monkeypatch, capsys):
    timed = []
    monkeypatch.setattr(budget, "steps_within", lambda minutes, *_: timed.append(minutes) or 3)
    for _ in range(2):
        run = bisplat.train(tiny, tmp_path / "run", model="mlp", budget=2.0)
    assert timed == [2.0] and run.config.by_steps.steps == 3
    assert "3 steps fit into 2 minutes" in capsys.readouterr().err
    with pytest.raises(InputError, match="an earlier run with seed 1, found one with seed 0"):
        bisplat.train(tiny, tmp_path / "run", model="mlp", budget=2.0, seed=1)


def test_a_short_budget_is_a_few_steps_of_real_training(tiny, tmp_path):
    steps = bisplat.train(tiny, tmp_path / "run", model="mlp", budget=0.01).config.by_steps.steps
    assert 1 <= steps < 200


def test_a_budget_does_not_claim_a_folder_of_something_else(tiny, tmp_path):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "letter.txt").write_text("")
    with pytest.raises(InputError, match="found other files"):
        bisplat.train(tiny, tmp_path / "run", model="mlp", budget=0.01)
    assert [each.name for each in (tmp_path / "run").iterdir()] == ["letter.txt"]


def test_a_preset_is_a_model_and_its_steps_and_what_is_given_differs_from_it(tiny, tmp_path, monkeypatch):
    monkeypatch.setitem(presets.PRESETS, "paper", presets.Preset("bisplat", 2))
    small = {"primitives": 4}
    config = bisplat.train(tiny, tmp_path / "run", preset="paper", options=small, batch_size=2).config
    assert (config.model, config.by_steps.steps, config.by_steps.batch_size) == ("bisplat", 2, 2)
    assert bisplat.train(tiny, tmp_path / "one", preset="paper", options=small, steps=1).config.by_steps.steps == 1
    with pytest.raises(ParameterError, match="expected none beside the preset paper, found mlp"):
        bisplat.train(tiny, tmp_path / "other", preset="paper", model="mlp")
    for preset in presets.PRESETS.values():
        assert preset.model in ("bisplat", "bisplat-plus")


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("a=250", 250),
        ("a=1e-3", 1e-3),
        ("a=true", True),
        ("a=waves", "waves"),
        ('a=["bst"]', ["bst"]),
        ("a=b=c", "b=c"),
    ],
)
def test_values_of_options(text, value):
    name, found = read_option(text)
    assert name == "a" and found == value and type(found) is type(value)


def test_the_recorded_options_are_those_of_the_command_line(tiny, tmp_path, monkeypatch):
    words = ("bisplat", "train", str(tiny), "-o", str(tmp_path / "run"), "--model", "bisplat", "--steps", "1")
    monkeypatch.setattr("sys.argv", [*words, "--option", "primitives=8", "encoding=octaves"])
    from bisplat.__main__ import main

    main()
    assert read_config(tmp_path / "run").config.options == {"primitives": 8, "encoding": "octaves"}
