"""Spectra: the pictures of a dataset as numbers from 0 to 1, scored by SSIM."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from jaxtyping import Float, Int

from learn.data.metrics import require_scorable, scorable, score
from learn.quantities.array_ceiling import CEILING, NO_CEILING, SAMPLES, array_ceiling, has_ceiling
from learn.quantities.quantity import OfEach, Prediction, Quantity, Scored
from scenes.files.npz_file import Expected
from scenes.files.plain_text import say
from simulate.dataset.dataset import Dataset
from simulate.spectra.spectrum import evenly, spectrum_of


class Spectra(Quantity):
    """Magnitudes of beamformed spectra, 0…1, [90, 360]."""

    name = "spectrum"
    things = "spectra"
    in_words = "spectra"
    predicted = "real, finite spectra"
    kinds = "iuf"
    file = "spectra.npy"
    mean = "mean-picture"
    states_intervals = False
    columns: ClassVar[Mapping[str, str]] = {
        "ssim_median": "SSIM",
        "ssim_mean": "SSIM mean",
        "ssim_p05": "5th %",
        "psnr_mean": "PSNR (dB)",
        "mae_mean": "mean abs. error",
        "aoa_error_median_deg": "AoA (°)",
    }
    of_each = OfEach("ssim", "SSIM", "share of test spectra")

    def require(self, dataset: Dataset) -> None:
        require_scorable(dataset.array, str(dataset.folder))

    def of(self, dataset: Dataset, rows: Int[np.ndarray, " n"]) -> Float[np.ndarray, "n 90 360"]:
        return spectrum_of(dataset.pictures[rows])

    def tested(self, dataset: Dataset, rows: Int[np.ndarray, " n"]) -> Int[np.ndarray, " K"]:
        return scorable(dataset, rows)

    def score(self, prediction: Prediction, truth: Float[np.ndarray, "K 90 360"], dataset: Dataset) -> Scored:
        found = score(np.clip(prediction.value, 0, 1), truth, dataset.grid, dataset.array)
        each = {"ssim": found.ssim, "psnr_db": found.psnr, "mae": found.mae, "aoa_error_deg": found.aoa_error}
        return Scored(found.summary(), each)

    def arrays(self, shape: tuple[int, ...]) -> dict[str, Expected]:
        names = ("ssim", "psnr_db", "mae", "aoa_error_deg")
        return {name: Expected("scores of each test spectrum", "f", (None,)) for name in names}

    def bound(
        self, dataset: Dataset, test: Int[np.ndarray, " K"]
    ) -> tuple[str, Prediction, Int[np.ndarray, " k"]] | None:
        if not has_ceiling(dataset):
            say(f"the array's ceiling is left out: {NO_CEILING}")
            return None
        some = evenly(test, SAMPLES)
        recorded = None if "response" not in dataset.values else dataset.responses[some]
        return CEILING, Prediction(array_ceiling(self.of(dataset, some), dataset.beamformer, recorded)), some


class SpectraInRooms(Spectra):
    """Spectra in rooms that methods were not trained in, whose mean SSIM ranks, as few spectra of a room spread."""

    columns: ClassVar[Mapping[str, str]] = {"ssim_mean": "mean SSIM", "ssim_median": "median SSIM"}
    in_words = "spectra in test rooms"
    mean = "mean"

    def bound(self, dataset: Dataset, test: Int[np.ndarray, " K"]) -> None:
        """None: it differs from room to room."""
