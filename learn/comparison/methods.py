"""Everything that can stand in a table: it sees some spectra, then predicts others.

``fit`` and ``predict`` are all a method of one's own needs: docs/compare.md.
"""

from __future__ import annotations

import importlib
import json
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, partial
from io import BytesIO
from pathlib import Path
from typing import Protocol

import numpy as np
import torch
from jaxtyping import Complex, Float

from learn.baselines.array_ceiling import responses_of
from learn.baselines.kriging import krige_pictures, krige_responses
from learn.baselines.neighbours import inverse_distance, mean_picture, nearest
from learn.metrics import ssim
from learn.models.bisplat import Bypass
from learn.splits import Split, SplitKind, split
from learn.training.lightning_module import Spectra, Training
from learn.training.run_folder import LEARNING_RATE, Config, ModelName, Run, build_model, load_run, read_config
from learn.training.train import STEPS_PER_VALIDATION, box_of, train
from scenes.errors import InputError
from simulate.array import PlanarArray
from simulate.dataset import Dataset

BATCH_SIZE = 8


@dataclass(frozen=True)
class Task:
    """What a method may learn from, and how long.

    Attributes:
        dataset: the folder; its test part is not to be looked at.
        kind: of the split.
        split_seed: of the split.
        train_size: cut the training part to so many; None: all.
        seed: of whatever a method draws.
        minutes: of training; None: as many as the steps take.
        steps: of training, for what is trained by steps; None: as many as the minutes hold.
        folder: the method's own; what it leaves there is kept, so that interrupted training goes on.
    """

    dataset: Dataset
    kind: SplitKind
    split_seed: int
    train_size: int | None
    seed: int
    minutes: float | None
    steps: int | None
    folder: Path

    @cached_property
    def parts(self) -> Split:
        """Training, validation and test part."""
        return split(self.dataset, self.kind, self.split_seed, self.train_size)

    @property
    def positions(self) -> Float[np.ndarray, "n 3"]:
        """Known transmitter positions, metres."""
        return self.dataset.positions[self.parts.known]

    @property
    def pictures(self) -> Float[np.ndarray, "n 90 360"]:
        """Known pictures, 0…1."""
        return self.dataset.pictures[self.parts.known] / np.float32(255)

    @property
    def responses(self) -> Complex[np.ndarray, "n elements"] | None:
        """Known element responses, where the dataset has them."""
        return None if self.dataset.responses is None else self.dataset.responses[self.parts.known]

    @property
    def array(self) -> PlanarArray:
        """The gateway's array."""
        return self.dataset.array


class Method(Protocol):
    """What stands in a table. Attributes ``parameters`` (a count) and ``seconds`` (of training) are shown if there."""

    def fit(self, task: Task) -> None:
        """Learn from the known spectra."""

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, "K 90 360"]:
        """Predicted pictures, 0…1."""


class MeanPicture:
    """The mean of the known pictures."""

    _predict: Callable[[Float[np.ndarray, "K 3"]], Float[np.ndarray, "K 90 360"]]

    def fit(self, task: Task) -> None:
        self._predict = partial(mean_picture, task.pictures)

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, "K 90 360"]:
        return self._predict(positions)


class Nearest(MeanPicture):
    """A copy of the nearest known picture."""

    def fit(self, task: Task) -> None:
        self._predict = partial(nearest, task.positions, task.pictures)


class InverseDistance(MeanPicture):
    """The four nearest known pictures, weighted by 1 / distance."""

    def fit(self, task: Task) -> None:
        self._predict = partial(inverse_distance, task.positions, task.pictures)


class Kriging(MeanPicture):
    """Gaussian process over the pictures."""

    def fit(self, task: Task) -> None:
        self._predict = krige_pictures(task.positions, task.pictures, task.seed)


class KrigingResponses(MeanPicture):
    """Gaussian process over the element responses: the dataset's own, or the ones that show its pictures best.

    Responses found from pictures have no common phase; theirs is chosen so that the strongest element's is zero.
    """

    def fit(self, task: Task) -> None:
        responses = task.responses
        if responses is None:
            responses = responses_of(task.pictures, task.array)
            strongest = responses[:, np.abs(responses).mean(axis=0).argmax()]
            responses = responses * np.exp(-1j * np.angle(strongest))[:, None]
            responses /= np.linalg.norm(responses, axis=1, keepdims=True)
        self._predict = krige_responses(task.positions, responses, task.array, task.seed)


@dataclass
class Trained:
    """A model that ``bisplat train`` trains, for the task's steps or as many as its minutes hold.

    Attributes:
        model: which.
        bypass: branches switched off.
        size: arguments of the model that differ from its own.
        init: a finished run of the same model to begin with.
    """

    model: ModelName
    bypass: tuple[Bypass, ...] = ()
    size: dict[str, int] = field(default_factory=dict)
    init: str | None = None

    def fit(self, task: Task) -> None:
        if (task.folder / "config.json").exists():
            config, _ = read_config(task.folder)
        else:
            config = self._config(task, steps=task.steps or 1)
            if task.minutes is not None and self.model != "helmholtz":  # which takes no steps
                config = self._config(task, max(1, round(60 * task.minutes / _seconds_per_step(config, task))))
        train(config, task.folder)
        self._run: Run = load_run(task.folder)

    def _config(self, task: Task, steps: int) -> Config:
        return Config(
            dataset=str(task.dataset.folder.resolve()),
            model=self.model,
            split=task.kind,
            seed=task.seed,
            split_seed=task.split_seed,
            steps=steps,
            batch_size=BATCH_SIZE,
            learning_rate=LEARNING_RATE[self.model],
            bypass=self.bypass,
            size=self.size,
            train_size=task.train_size,
            init=self.init,
        )

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, "K 90 360"]:
        return self._run.predict(positions).spectra

    @property
    def parameters(self) -> int:
        return sum(parameter.numel() for parameter in self._run.model.parameters())

    @property
    def seconds(self) -> float:
        return json.loads((self._run.folder / "training.json").read_text())["seconds"]


def _seconds_per_step(config: Config, task: Task) -> float:
    """Of a training step and its share of a validation and a checkpoint, timed on throwaway weights."""
    module = Training(build_model(config, box_of(task.positions), task.array), config.learning_rate, 100)
    device = "cuda" if torch.cuda.is_available() else "cpu"
    module.to(device)
    optimiser = module.configure_optimizers()["optimizer"]
    some = np.arange(config.batch_size) % len(task.parts.train)
    positions = torch.from_numpy(task.positions[some]).float().to(device)
    pictures = torch.from_numpy(task.pictures[some]).to(device)
    times = []
    for _ in range(4):
        began = time.perf_counter()
        optimiser.zero_grad()
        value = module.model.loss(positions, pictures)
        value.backward()
        optimiser.step()
        value.item()  # waits for a GPU
        times.append(time.perf_counter() - began)
    began = time.perf_counter()
    with torch.no_grad():
        prediction = module.model(positions).cpu().numpy()
    ssim(prediction, pictures.cpu().numpy())
    validation = (time.perf_counter() - began) / len(some) * min(Spectra.VALIDATED, len(task.parts.validation))
    began = time.perf_counter()
    torch.save([module.state_dict(), optimiser.state_dict()], BytesIO())
    checkpoint = 2 * (time.perf_counter() - began)  # the last and the best
    return float(np.median(times[1:])) + (validation + checkpoint) / STEPS_PER_VALIDATION


ON_A_CPU = {"nerf2": {"samples": 16, "rays": 1024, "width": 128}}
"""Sizes a CPU can train at all; tables say so."""

METHODS: dict[str, Callable[[], Method]] = {
    "mean-picture": MeanPicture,
    "nearest": Nearest,
    "inverse-distance": InverseDistance,
    "kriging": Kriging,
    "kriging-responses": KrigingResponses,
    "mlp": partial(Trained, "mlp"),
    "mlp-responses": partial(Trained, "mlp-responses"),
    "nerf2": partial(Trained, "nerf2", size={} if torch.cuda.is_available() else ON_A_CPU["nerf2"]),
    "swiftwrf": partial(Trained, "swiftwrf"),
    "helmholtz": partial(Trained, "helmholtz"),
    "bisplat": partial(Trained, "bisplat"),
    "bisplat-plus": partial(Trained, "bisplat-plus"),
    "bisplat-aperture": partial(Trained, "bisplat-aperture"),
}


def method_named(name: str) -> Callable[[], Method]:
    """One of ``METHODS``, or a class of one's own as ``module:Class``.

    Raises:
        InputError: neither.
    """
    if name in METHODS:
        return METHODS[name]
    module, _, attribute = name.partition(":")
    if not attribute:
        raise InputError(f"--models: expected one of {', '.join(METHODS)}, or module:Class, found {name}")
    try:
        return getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError) as error:
        raise InputError(f"--models: expected a class at {name}, found {error}") from error
