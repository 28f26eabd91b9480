"""What a method learns from, what it predicts, and the interface of a method."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from jaxtyping import Complex, Float, Int

from scenes.files.errors import InputError
from simulate.dataset.dataset import Dataset


@dataclass(frozen=True)
class KnownBand:
    """Responses over a band at n known positions, from which a method learns.

    Attributes:
        dataset: the dataset; a method must use no other positions of it than the known ones.
        known: indices of the known positions, rising.
        seed: seed of everything that is random in a method.
        minutes: training time of a method that is trained by steps.

    Raises:
        InputError: the dataset has no responses over a band.
    """

    dataset: Dataset
    known: Int[np.ndarray, " n"]
    seed: int = 0
    minutes: float = 5.0

    def __post_init__(self) -> None:
        require_band(self.dataset)

    @property
    def positions(self) -> Float[np.ndarray, "n 3"]:
        """Known positions, metres, world frame."""
        return self.dataset.positions[self.known]

    @property
    def responses(self) -> Complex[np.ndarray, "n elements subcarriers"]:
        """Known responses, as recorded, not normalised."""
        assert self.dataset.band_responses is not None
        return self.dataset.band_responses[self.known]

    @property
    def frequencies(self) -> Float[np.ndarray, " subcarriers"]:
        """Frequencies of the subcarriers, rising, Hz."""
        return band_frequencies(self.dataset)


@dataclass(frozen=True)
class PredictedBand:
    """Responses that a method predicts at K positions, in the units of the known ones."""

    responses: Complex[np.ndarray, "K elements subcarriers"]  # the predicted responses
    # stated standard deviation of the real and of the imaginary part of each response, the same for all elements and
    # subcarriers of a position. About 90 % of these parts are within 1.645 deviations. None: the method states none.
    deviation: Float[np.ndarray, " K"] | None = None


class BandMethod(Protocol):
    """A method that learns from known responses over a band and predicts others."""

    def fit(self, known: KnownBand) -> None:
        """Learn from known responses."""

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> PredictedBand:
        """Predict responses at positions in metres, world frame."""


def band_frequencies(dataset: Dataset) -> Float[np.ndarray, " subcarriers"]:
    """Frequencies of the subcarriers of a dataset with a band, rising, Hz."""
    assert dataset.band is not None
    return dataset.band.frequencies(dataset.frequency.hertz)


def require_band(dataset: Dataset) -> None:
    """Refuse a dataset without responses over a band."""
    if dataset.band_responses is None:
        found = "responses at the carrier alone" if dataset.responses is not None else "spectra alone"
        raise InputError(
            f"{dataset.folder}: expected responses over a band (bisplat simulate --bandwidth 20MHz --subcarriers 32), "
            f"found {found}"
        )
