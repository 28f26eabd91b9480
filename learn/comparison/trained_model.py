"""A model of the registry as a method of a comparison."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from jaxtyping import Float

from learn.comparison.task import Task
from learn.models.capabilities import unsuited
from learn.training.config import Config, read_config
from learn.training.registry import model_class, model_entry
from learn.training.run_files import TrainingFile, read_training, untrained_model
from learn.training.run_folder import Run, load_run
from learn.training.train import train_run
from learn.training.validation_part import Learned
from simulate.dataset.dataset import Dataset


@dataclass
class TrainedModel:
    """A model trained as by ``bisplat train``, for the task's steps or for as many as fit into its minutes."""

    model: str  # its name in the registry
    # options of the model that differ from those of its registry entry
    options: dict[str, Any] = field(default_factory=dict)
    # folder of a finished run of the same model, with whose weights training starts. None: random weights.
    init: str | None = None

    def fit(self, task: Task) -> None:
        begun = (task.folder / "config.json").exists()
        config, learned = (read_config(task.folder).config, None) if begun else self._config(task)
        train_run(config, task.folder, dataset=task.dataset, learned=learned)
        self._run: Run = load_run(task.folder)

    def _config(self, task: Task) -> tuple[Config, Learned | None]:
        """Settings of the run, and the responses to learn from. None: nobody has looked for them yet."""
        config = Config(
            dataset=str(task.dataset.folder.resolve()),
            model=self.model,
            split=task.kind,
            guard=task.guard,
            seed=task.seed,
            split_seed=task.split_seed,
            train_size=task.train_size,
            options=self.options,
        )
        entry = model_entry(self.model)
        if entry.by_steps is None:
            return config, None
        by_steps = replace(entry.by_steps, steps=task.steps or 1, init=self.init)
        learned = None
        if task.minutes is not None:
            from learn.training.budget import timed

            model = untrained_model(config, task.dataset, task.parts)
            by_steps, learned, _ = timed(task.minutes, model, by_steps, task.dataset, task.parts, task.seed)
        return replace(config, by_steps=by_steps), learned

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, "K 90 360"]:
        return self._run.predict(positions).spectra

    def unsuited(self, dataset: Dataset) -> str | None:
        """Why the model cannot be fitted to a dataset, for the user. None: it can be."""
        return unsuited(self.model_class, dataset)

    @property
    def model_class(self) -> type:
        """The class of the model, which may be the user's."""
        return model_class(self.model)

    @property
    def parameters(self) -> int:
        """Number of trainable parameters."""
        return sum(parameter.numel() for parameter in self._run.model.parameters())

    @property
    def steps(self) -> int | None:
        """Number of training steps. None: the model is not trained by steps."""
        return None if self._run.config.by_steps is None else self._training.steps

    @property
    def seconds(self) -> float:
        """Training time, seconds, including the time before an interruption."""
        return self._training.seconds

    @property
    def _training(self) -> TrainingFile:
        return read_training(self._run.folder)
