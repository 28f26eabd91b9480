"""A model of ``bisplat train`` as a method for spectra."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import torch
from jaxtyping import Float

from learn.models.base import SpectrumModel
from learn.quantities.known import Known
from learn.quantities.quantity import Prediction
from learn.training.config import Config, read_config
from learn.training.registry import MODELS, model_class, model_entry
from learn.training.run_files import TrainingFile, read_training, untrained_model
from learn.training.run_folder import SpectrumRun, load_spectra
from learn.training.train import train_run
from learn.training.validation_part import Learned
from simulate.dataset.dataset import Dataset


@dataclass
class TrainedModel:
    """A model trained as by ``bisplat train``, for the asked steps or for as many as fit into its minutes."""

    model: str  # its name in the registry
    # options of the model that differ from those of its registry entry
    options: dict[str, Any] = field(default_factory=dict)
    # folder of a finished run of the same model, with whose weights training starts. None: random weights.
    init: str | None = None

    @classmethod
    def named(cls, name: str) -> TrainedModel:
        """A model of the registry, at a reduced size if it has one for want of a GPU."""
        small = {} if torch.cuda.is_available() else MODELS[name].options_without_gpu
        return cls(name, dict(small))

    def fit(self, known: Known) -> None:
        assert known.folder is not None
        began = time.perf_counter()
        begun = (known.folder / "config.json").exists()
        config, learned = (read_config(known.folder).config, None) if begun else self._config(known)
        left = None  # the time that timing a few steps took counts
        if known.minutes is not None:
            left = max(known.minutes - (time.perf_counter() - began) / 60, 0.0)
        train_run(config, known.folder, dataset=known.dataset, learned=learned, minutes=left)
        self._run: SpectrumRun = load_spectra(known.folder)

    def _config(self, known: Known) -> tuple[Config, Learned | None]:
        """Settings of the run, and the responses to learn from. None: nobody has looked for them yet."""
        assert known.how is not None
        config = Config(
            dataset=str(known.dataset.folder.resolve()),
            model=self.model,
            split=known.how.kind,
            guard=known.how.guard,
            seed=known.seed,
            split_seed=known.how.seed,
            train_size=known.how.train_size,
            options=self.options,
        )
        entry = model_entry(self.model)
        if entry.by_steps is None:
            return config, None
        by_steps = replace(entry.by_steps, steps=known.steps or 1, init=self.init)
        learned = None
        if known.minutes is not None:
            from learn.training.budget import timed

            model = untrained_model(config, known.dataset, known.parts)
            by_steps, learned, _ = timed(known.minutes, model, by_steps, known.dataset, known.parts, known.seed)
        return replace(config, by_steps=by_steps), learned

    def predict(self, positions: Float[np.ndarray, "K 3"], given: Any = None) -> Prediction:
        return Prediction(self._run.predict(positions).spectra)

    def unsuited(self, dataset: Dataset) -> str | None:
        """Why the model cannot be fitted to a dataset, for the user. None: it can be."""
        return self.model_class.unsuited(dataset)

    @property
    def reduced(self) -> bool:
        """Whether it is smaller than published, because there is no GPU."""
        small = MODELS[self.model].options_without_gpu if self.model in MODELS else {}
        return bool(small) and self.options == small

    @property
    def model_class(self) -> type[SpectrumModel]:
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
