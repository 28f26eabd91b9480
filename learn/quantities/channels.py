"""Channels (CSI): the downlink of a row, predicted from its uplink."""

from __future__ import annotations

import numpy as np
from jaxtyping import Complex, Int

from learn.quantities.complex_scores import OfComplex
from learn.quantities.quantity import OfEach, Prediction, Scored
from scenes.files.npz_file import Expected
from simulate.dataset.dataset import Dataset
from simulate.spectra.spectrum import evenly

EXAMPLES = 1000  # Most test rows whose predictions are kept

SMALLEST = 1e-290
"""Smallest number that channels are divided by: complex division by smaller ones overflows."""


class Channels(OfComplex):
    """Complex channels of the downlink [antennas, subcarriers], in units of the dataset's largest number."""

    name = "channel"
    things = "rows"
    in_words = "the downlink, predicted from the uplink"
    predicted = "channels of the downlink"
    file = "channels.npy"
    most_known = 5000
    at_once = 1000
    of_each = OfEach("snr_db", "SNR of the predicted downlink (dB)", "share of rows")

    def of(self, dataset: Dataset, rows: Int[np.ndarray, " n"]) -> Complex[np.ndarray, "n A S"]:
        return dataset.downlink[rows] / level(dataset)

    def given(self, dataset: Dataset, rows: Int[np.ndarray, " n"]) -> Complex[np.ndarray, "n A S"]:
        return dataset.uplink[rows] / level(dataset)

    def bandwidth(self, dataset: Dataset) -> float | None:
        return None if dataset.band is None else dataset.downlink.shape[2] * dataset.band.spacing

    def score(self, prediction: Prediction, truth: Complex[np.ndarray, "K A S"], dataset: Dataset) -> Scored:
        row, each = super().score(prediction, truth, dataset)
        shown = prediction.value[examples(len(truth))].astype(complex)
        return Scored(row, {**each, "examples": level(dataset) * shown})

    def arrays(self, shape: tuple[int, ...]) -> dict[str, Expected]:
        kept = (len(examples(shape[0])), *shape[1:])
        return {**super().arrays(shape), "examples": Expected("channels", "c", kept)}

    def stated(self, dataset: Dataset) -> str | None:
        if dataset.frequencies is not None:
            return None
        return f"{dataset.folder}: assumed that the downlink's subcarriers follow the uplink's at the same distance"


def level(dataset: Dataset) -> float:
    """The largest absolute real or imaginary part: divided by it, no square of a channel is out of a float's range."""
    links = (dataset.uplink, dataset.downlink)
    return max(SMALLEST, *(float(np.abs(part).max()) for link in links for part in (link.real, link.imag)))


def examples(count: int) -> Int[np.ndarray, " E"]:
    """Which of the test rows have their predictions kept, evenly spread."""
    return evenly(np.arange(count), EXAMPLES)
