"""The baselines of ``learn.baselines`` as methods of a comparison."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from jaxtyping import Float

from learn.baselines.kriging import krige_responses, krige_spectra
from learn.baselines.neighbours import inverse_distance, mean_picture, nearest
from learn.comparison.task import Method, Task
from learn.data.comparable_phases import no_comparable_phases
from scenes.files.errors import InputError
from simulate.dataset.dataset import Dataset


class MeanPicture:
    """The mean of the known spectra."""

    _predict: Callable[[Float[np.ndarray, "K 3"]], Float[np.ndarray, "K 90 360"]]

    def fit(self, task: Task) -> None:
        self._predict = partial(mean_picture, task.spectra)

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, "K 90 360"]:
        return self._predict(positions)


class Nearest(MeanPicture):
    """A copy of the spectrum at the nearest known position."""

    def fit(self, task: Task) -> None:
        self._predict = partial(nearest, task.positions, task.spectra)


class InverseDistance(MeanPicture):
    """The mean of the four nearest known spectra, weighted by 1 / distance."""

    def fit(self, task: Task) -> None:
        self._predict = partial(inverse_distance, task.positions, task.spectra)


class Kriging(MeanPicture):
    """Kriging (Gaussian-process interpolation) of the spectra."""

    def fit(self, task: Task) -> None:
        self._predict = krige_spectra(task.positions, task.spectra, task.seed)


class KrigingResponses(MeanPicture):
    """Kriging of the recorded element responses."""

    def unsuited(self, dataset: Dataset) -> str | None:
        """As for ``TrainedModel``."""
        return no_comparable_phases(dataset) if dataset.responses is None else None

    def fit(self, task: Task) -> None:
        if task.responses is None:
            raise InputError(f"{task.dataset.folder}: {no_comparable_phases(task.dataset)}")
        self._predict = krige_responses(task.positions, task.responses, task.beamformer, task.seed)


BASELINES: dict[str, Callable[[], Method]] = {
    "mean-picture": MeanPicture,
    "nearest": Nearest,
    "inverse-distance": InverseDistance,
    "kriging": Kriging,
    "kriging-responses": KrigingResponses,
}
"""The baselines by name."""
