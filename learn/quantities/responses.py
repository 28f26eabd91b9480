"""Responses of the array's elements over a band."""

from __future__ import annotations

import numpy as np
from jaxtyping import Complex, Int

from learn.quantities.complex_scores import OfComplex
from learn.quantities.quantity import OfEach
from scenes.files.errors import InputError
from simulate.dataset.dataset import Dataset


class Responses(OfComplex):
    """Complex responses [elements, subcarriers], not normalised."""

    name = "response"
    things = "positions"
    in_words = "responses over a band"
    predicted = "responses over the band"
    file = "responses.npy"
    of_each = OfEach("snr_db", "SNR of the predicted responses (dB)", "share of positions")

    def require(self, dataset: Dataset) -> None:
        if dataset.band is None:
            found = "responses at the carrier alone" if "response" in dataset.values else "spectra alone"
            raise InputError(
                f"{dataset.folder}: expected responses over a band (bisplat simulate --bandwidth 20MHz --subcarriers "
                f"32), found {found}"
            )

    def of(self, dataset: Dataset, rows: Int[np.ndarray, " n"]) -> Complex[np.ndarray, "n elements subcarriers"]:
        assert dataset.band is not None
        return dataset.band_responses[rows]

    def bandwidth(self, dataset: Dataset) -> float | None:
        return None if dataset.band is None else dataset.band.bandwidth
