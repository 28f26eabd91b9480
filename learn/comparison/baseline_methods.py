"""The baselines of ``learn.baselines`` as methods of a comparison."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from jaxtyping import Float

from learn.baselines.array_ceiling import has_ceiling
from learn.baselines.kriging import krige_responses, krige_spectra
from learn.baselines.neighbours import inverse_distance, mean_picture, nearest
from learn.comparison.task import Method, Task
from simulate.dataset.dataset_folder import Dataset
from simulate.spectra.phase_retrieval import retrieve_responses


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
    "this method needs recorded responses, or a uniform planar array behind whose pictures they are found, which the "
    "dataset has not"
)
"""Why ``KrigingResponses`` cannot be used on a dataset, for the user."""


class KrigingResponses(MeanPicture):
    """Kriging of the element responses.

    If the dataset has no responses, the method uses those that reproduce its spectra best. Their common phase is
    unknown. It is chosen such that the element with the largest mean magnitude has phase zero.
    """

    def unsuited(self, dataset: Dataset) -> str | None:
        """As for ``TrainedModel``."""
        return None if has_ceiling(dataset) else NO_RESPONSES

    def fit(self, task: Task) -> None:
        responses = task.responses
        if responses is None:
            responses = retrieve_responses(task.spectra, task.beamformer).responses
            strongest_element = responses[:, np.abs(responses).mean(axis=0).argmax()]
            responses = responses * np.exp(-1j * np.angle(strongest_element))[:, None]
            norm = np.linalg.norm(responses, axis=1, keepdims=True)
            responses /= np.where(norm > 0, norm, 1)  # a picture of a single grey level has responses of 0
        self._predict = krige_responses(task.positions, responses, task.beamformer, task.seed)


BASELINES: dict[str, Callable[[], Method]] = {
    "mean-picture": MeanPicture,
    "nearest": Nearest,
    "inverse-distance": InverseDistance,
    "kriging": Kriging,
    "kriging-responses": KrigingResponses,
}
"""The baselines by name."""
