"""Ensembles of runs: the mean of their predictions, and how far it may be off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from learn.training.conformal_deviation import Deviation, fit_deviation, nearest_known, pixel_errors
from learn.training.prediction import uncertainty
from learn.training.run_files import read_training
from learn.training.run_folder import SpectrumRun, stated_deviation
from learn.training.validation_part import validation_sample
from scenes.files.errors import InputError
from simulate.dataset.dataset import Dataset
from simulate.spectra.spectrum import spectrum_of


@dataclass(frozen=True)
class Ensemble:
    """Runs of one dataset and split, such as those that ``bisplat compare --seeds`` trains."""

    runs: Sequence[SpectrumRun]  # at least two

    def __post_init__(self) -> None:
        first = self.runs[0]
        for run in self.runs[1:]:
            same = (run.config.dataset, run.dataset_sha256) == (first.config.dataset, first.dataset_sha256)
            other = run.split(self._data) if same else None
            if other is None or not np.array_equal(other.validation, self._validation):
                raise InputError(
                    f"{run.folder}: expected a run of the same dataset and split as {first.folder}, found another one; "
                    "bisplat compare --seeds trains runs of the same split"
                )

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, "K 90 360"]:
        """The mean of the spectra that the runs predict, 0…1."""
        total = self.runs[0].predict(positions).spectra
        for run in self.runs[1:]:
            total += run.predict(positions).spectra
        total /= len(self.runs)
        return total

    def deviation(self, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, " K"] | None:
        """How far the means may be off, as by ``Run.deviation``, with the errors over gaps of the first run."""
        return None if self._fitted is None else stated_deviation(self.runs[0], self._fitted, positions)

    @cached_property
    def _data(self) -> Dataset:
        return self.runs[0].dataset()

    @cached_property
    def _validation(self) -> Int[np.ndarray, " n"]:
        return self.runs[0].split(self._data).validation

    @cached_property
    def _fitted(self) -> Deviation | None:
        """The deviation, fitted to validation spectra, on which no run was trained."""
        data, validated = self._data, validation_sample(self._validation)
        if not len(validated) or any(run.config.by_steps is None for run in self.runs):
            return None
        first, of_first = self.runs[0], read_training(self.runs[0].folder).deviation
        positions = data.positions[validated]
        error = pixel_errors(self.predict(positions), spectrum_of(data.pictures[validated]))
        if of_first is None or not of_first.gaps:
            return fit_deviation(error, None)
        known = data.positions[first.split(data).train]
        over_distance = of_first.over == "distance"
        gap = nearest_known(known, positions, data.wavelength) if over_distance else uncertainty(first.model, positions)
        return fit_deviation(error, gap, of_first.over, (of_first.gaps, of_first.errors), of_first.nothing)
