"""A model of the user's own, the example of docs/how-to/add-my-own-model.md.

It is trained, resumed, evaluated, viewed, and used to predict.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch

import bisplat
from learn.training.gradient_steps import Training
from learn.view.subject import subject
from scenes.files.errors import InputError, ParameterError
from tests.docs.pages import saved

ROOT = Path(__file__).parents[3]
EXAMPLE = saved("docs/how-to/add-my-own-model.md", "level.py")

CLOSED = """
import torch
import bisplat

class Mean(bisplat.SpectrumModel):
    def __init__(self, region, beamformer, wavelength):
        super().__init__(region, wavelength)
        self.register_buffer("mean", torch.zeros(90, 360))

    def forward(self, positions):
        return self.mean.expand(len(positions), 90, 360)

    def fit(self, dataset, known):
        self.refit(dataset, known)
        return "the mean of all"

    def refit(self, dataset, known):
        self.mean = torch.from_numpy(dataset.pictures[known].mean(axis=0)).float() / 255
"""

WAVE = """
import torch
import bisplat

class Wave(bisplat.PredictsResponses):
    def __init__(self, region, beamformer, wavelength):
        super().__init__(region, beamformer, wavelength)
        self.wave = torch.nn.Parameter(torch.randn(beamformer.array.elements, 2))

    def responses(self, positions):
        return self.wave.expand(len(positions), -1, -1)
"""


@pytest.fixture
def here(tmp_path, monkeypatch):
    """The current folder, with modules ``own_level``, ``own_mean`` and ``own_wave``, which are forgotten at the end."""
    for name, text in (("own_level", EXAMPLE), ("own_mean", CLOSED), ("own_wave", WAVE)):
        (tmp_path / f"{name}.py").write_text(text)
    monkeypatch.chdir(tmp_path)
    yield tmp_path
    for name in ("own_level", "own_mean", "own_wave"):
        sys.modules.pop(name, None)


@pytest.mark.slow
def test_the_commands_know_it(here, tiny):
    """In processes that do not have the current folder on Python's path, as the installed script ``bisplat``."""
    environment = os.environ | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}

    def run(*arguments) -> str:
        command = [sys.executable, "-P", "-m", "bisplat", *map(str, arguments)]
        done = subprocess.run(command, capture_output=True, text=True, env=environment, cwd=here)
        assert done.returncode == 0, done.stderr
        return done.stdout

    run("train", tiny, "-o", "run", "--model", "own_level:Level", "--steps", 3)
    assert json.loads((here / "run" / "config.json").read_text())["model"] == "own_level:Level"
    assert "ssim_median" in run("evaluate", "run", "--json")
    (here / "places.csv").write_text("x,y,z\n1,0,1\n2,0,1\n")
    run("predict", "run", "--positions", "places.csv", "-o", "out.npz")
    assert np.load("out.npz")["spectra"].shape == (2, 90, 360)


def test_an_interrupted_training_is_resumed(here, tiny, monkeypatch):
    monkeypatch.setattr("learn.training.validation_part.STEPS_PER_VALIDATION", 2)
    given = {"model": "own_level:Level", "steps": 6, "options": {"start": 0.5}}
    whole = bisplat.train(tiny, "whole", **given)
    steps: list[int] = []

    def interrupted(self, *arguments, **named):
        steps.append(self.global_step)
        if len(steps) == 5:
            raise KeyboardInterrupt
        return loss(self, *arguments, **named)

    loss = Training.loss
    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(Training, "loss", interrupted)
        bisplat.train(tiny, "resumed", **given)
    assert not (here / "resumed" / "weights.safetensors").exists()
    resumed = bisplat.train(tiny, "resumed", **given)
    assert torch.equal(resumed.model.level, whole.model.level) and 0.3 < whole.model.level.item() < 0.5
    seen = subject("resumed")
    assert next(iter(seen.predictors)) == "own_level:Level" and not seen.has_primitives
    assert np.ptp(seen.predictors["own_level:Level"](np.array([1.0, 0, 1]))) == 0


def test_what_it_can_do_is_used(here, tiny, write_folder):
    mean = bisplat.train(tiny, "mean", model="own_mean:Mean")
    assert mean.config.by_steps is None and mean.predict([[1, 0, 1]]).responses is None
    with pytest.raises(ParameterError, match="steps: expected a model trained by steps, found own_mean:Mean"):
        bisplat.train(tiny, "other", model="own_mean:Mean", steps=3)
    data = write_folder(here / "data", keep_responses=True)
    wave = bisplat.train(data, "wave", model="own_wave:Wave", steps=2)
    assert wave.predict([[1, 0, 1]]).responses.shape == (1, 16) and subject("wave").field(np.ones(3)).shape == (90, 360)
    compared = bisplat.compare(data, ["own_wave:Wave"], steps=2)
    assert any(row["label"] == "own_wave:Wave" and row["steps"] == 2 for row in compared)


def test_a_run_whose_module_is_gone_says_so(here, tiny):
    bisplat.train(tiny, "run", model="own_level:Level", steps=1)
    (here / "own_level.py").unlink()
    del sys.modules["own_level"]
    with pytest.raises(
        InputError, match=r"run/config\.json: model: expected a class at own_level:Level, found no mod.*"
    ):
        bisplat.load_run("run")


def test_the_current_folder_does_not_stay_on_pythons_path(here, tiny):
    before = list(sys.path)
    with pytest.raises(ParameterError, match="expected a class at own_level:Missing, found AttributeError"):
        bisplat.train(tiny, "run", model="own_level:Missing")
    assert sys.path == before and not (here / "run").exists()


WRONG = """
import torch
import bisplat

class Right(bisplat.SpectrumModel):
    def __init__(self, region, beamformer, wavelength):
        super().__init__(region, wavelength)
        self.level = torch.nn.Parameter(torch.zeros(1))

    def forward(self, positions):
        return torch.sigmoid(self.level) * torch.ones(len(positions), 90, 360)

class Turned(Right):
    def forward(self, positions):
        return super().forward(positions).mT

class Double(Right):
    def forward(self, positions):
        return super().forward(positions).double()

class Nothing(Right):
    def forward(self, positions):
        return None

class Detached(Right):
    def forward(self, positions):
        return super().forward(positions).detach()

class Leaves(Right):
    def __init__(self, *arguments):
        raise SystemExit(0)

class Fails(Right):
    def coarse_loss(self, *arguments):
        return 1 / 0
"""


@pytest.mark.parametrize("name", ["Turned", "Double", "Nothing", "Detached", "Leaves", "Fails"])
def test_what_a_model_returns_or_raises_wrongly_is_a_sentence_that_names_it(here, tiny, name, monkeypatch):
    (here / "own_wrong.py").write_text(WRONG)
    with pytest.raises(InputError, match=f"own_wrong:{name}: expected .*, found"):
        bisplat.train(tiny, "wrong", model=f"own_wrong:{name}", steps=1)
    assert not (here / "wrong" / "weights.safetensors").exists()
