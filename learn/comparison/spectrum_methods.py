"""The methods of a comparison of spectra by name: baselines, models of the registry, and the user's own classes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
import torch
from jaxtyping import Float

from learn.baselines.kriging import krige_responses, krige_spectra
from learn.baselines.neighbours import inverse_distance, mean_picture, nearest
from learn.comparison.known_spectra import KnownSpectra, Method
from learn.comparison.predictions import Predictions
from learn.models.base import SpectrumModel
from learn.models.capabilities import no_comparable_phases, unsuited
from learn.training.config import Config, read_config
from learn.training.registry import MODELS, model_class, model_entry, own_class
from learn.training.run_files import TrainingFile, read_training, untrained_model
from learn.training.run_folder import Run, load_run
from learn.training.train import train_run
from learn.training.validation_part import Learned
from scenes.files.errors import InputError, ParameterError, shown
from simulate.dataset.dataset import Dataset


@dataclass
class TrainedModel:
    """A model trained as by ``bisplat train``, for the asked steps or for as many as fit into its minutes."""

    model: str  # its name in the registry
    # options of the model that differ from those of its registry entry
    options: dict[str, Any] = field(default_factory=dict)
    # folder of a finished run of the same model, with whose weights training starts. None: random weights.
    init: str | None = None

    def fit(self, known: KnownSpectra) -> None:
        begun = (known.folder / "config.json").exists()
        config, learned = (read_config(known.folder).config, None) if begun else self._config(known)
        train_run(config, known.folder, dataset=known.dataset, learned=learned)
        self._run: Run = load_run(known.folder)

    def _config(self, known: KnownSpectra) -> tuple[Config, Learned | None]:
        """Settings of the run, and the responses to learn from. None: nobody has looked for them yet."""
        config = Config(
            dataset=str(known.dataset.folder.resolve()),
            model=self.model,
            split=known.kind,
            guard=known.guard,
            seed=known.seed,
            split_seed=known.split_seed,
            train_size=known.train_size,
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


class MeanPicture:
    """The mean of the known spectra."""

    _predict: Callable[[Float[np.ndarray, "K 3"]], Float[np.ndarray, "K 90 360"]]

    def fit(self, known: KnownSpectra) -> None:
        self._predict = partial(mean_picture, known.spectra)

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, "K 90 360"]:
        return self._predict(positions)


class Nearest(MeanPicture):
    """A copy of the spectrum at the nearest known position."""

    def fit(self, known: KnownSpectra) -> None:
        self._predict = partial(nearest, known.positions, known.spectra)


class InverseDistance(MeanPicture):
    """The mean of the four nearest known spectra, weighted by 1 / distance."""

    def fit(self, known: KnownSpectra) -> None:
        self._predict = partial(inverse_distance, known.positions, known.spectra)


class Kriging(MeanPicture):
    """Kriging (Gaussian-process interpolation) of the spectra."""

    def fit(self, known: KnownSpectra) -> None:
        self._predict = krige_spectra(known.positions, known.spectra, known.seed)


class KrigingResponses(MeanPicture):
    """Kriging of the recorded element responses."""

    def unsuited(self, dataset: Dataset) -> str | None:
        """As for ``TrainedModel``."""
        return no_comparable_phases(dataset) if "response" not in dataset.values else None

    def fit(self, known: KnownSpectra) -> None:
        if known.responses is None:
            raise InputError(f"{known.dataset.folder}: {no_comparable_phases(known.dataset)}")
        self._predict = krige_responses(known.positions, known.responses, known.beamformer, known.seed)


BASELINES: dict[str, Callable[[], Method]] = {
    "mean-picture": MeanPicture,
    "nearest": Nearest,
    "inverse-distance": InverseDistance,
    "kriging": Kriging,
    "kriging-responses": KrigingResponses,
}
"""The baselines by name."""


def method_names() -> list[str]:
    """Names of all baselines and of the models that need no options."""
    return [*BASELINES, *(name for name, entry in MODELS.items() if not entry.needs)]


def is_reduced(name: str) -> bool:
    """Whether a model is compared at a reduced size because there is no GPU."""
    return name in MODELS and bool(MODELS[name].options_without_gpu) and not torch.cuda.is_available()


def method_named(name: str) -> Callable[[], Method]:
    """The function that makes a new, unfitted method."""
    if not isinstance(name, str):
        raise ParameterError("models", f"expected names of methods, found {shown(name)}")
    if name in BASELINES:
        return BASELINES[name]
    label, predicted, folder = name.partition("=")
    if predicted:
        if not label.strip() or not folder or label in usual_methods():
            expected = "expected LABEL=FOLDER with a label that no method here has"
            raise ParameterError("models", f"{expected}, found {shown(name)}")
        return partial(Predictions, folder)
    if name in MODELS:
        if MODELS[name].needs:
            needed = ", ".join(MODELS[name].needs)
            raise ParameterError(
                "models",
                f"expected models that need no option, found {name}, which needs {needed}; bisplat train has it",
            )
        return _trained(name)
    if not name.partition(":")[2]:
        known = ", ".join(method_names())
        raise ParameterError(
            "models", f"expected one of {known}, module:Class or LABEL=FOLDER of predictions, found {shown(name)}"
        )
    found = own_class(name, "models")
    if isinstance(found, type) and issubclass(found, SpectrumModel):
        return partial(TrainedModel, name)
    return found


def usual_methods() -> dict[str, Callable[[], Method]]:
    """The functions that make our methods, by name, also of the models that need options."""
    return {**BASELINES, **{name: _trained(name) for name in MODELS}}


def _trained(name: str) -> Callable[[], Method]:
    return partial(TrainedModel, name, options=dict(MODELS[name].options_without_gpu) if is_reduced(name) else {})
