"""The baselines of ``learn.baselines`` as methods of a comparison."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from jaxtyping import Float

from learn.baselines.kriging import krige_responses, krige_spectra
from learn.baselines.neighbours import inverse_distance, mean_picture, nearest
from learn.comparison.task import Method, Task
from scenes.files.errors import InputError
from simulate.dataset.dataset_folder import Dataset


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


NO_RESPONSES = (
    "this method needs recorded responses with their phases, which the dataset has not; those behind pictures have "
    "phases of their own each, and may be flipped"
)
"""Why ``KrigingResponses`` cannot be used on a dataset, for the user."""


class KrigingResponses(MeanPicture):
    """Kriging of the recorded element responses."""

    def unsuited(self, dataset: Dataset) -> str | None:
        """As for ``TrainedModel``."""
        return None if dataset.responses is not None else NO_RESPONSES

    def fit(self, task: Task) -> None:
        if task.responses is None:
            raise InputError(NO_RESPONSES)
        self._predict = krige_responses(task.positions, task.responses, task.beamformer, task.seed)


BASELINES: dict[str, Callable[[], Method]] = {
    "mean-picture": MeanPicture,
    "nearest": Nearest,
    "inverse-distance": InverseDistance,
    "kriging": Kriging,
    "kriging-responses": KrigingResponses,
}
"""The baselines by name."""
