"""Ensembles of runs: the mean of their predictions, and how far it may be off, judged by how much the runs differ."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from learn.training.deviation import EVERY, Deviation, fit_deviation, pixel_errors
from learn.training.lightning_module import Spectra
from learn.training.run_folder import Run
from scenes.files.errors import InputError
from simulate.dataset.dataset_folder import Dataset
from simulate.spectra.spectrum import evenly, spectrum_of


class Mean(NamedTuple):
    """Mean and variance of the predictions of several runs.

    Attributes:
        spectra: mean of the predicted spectra, 0…1.
        variance: mean over a spectrum's values of their variance over the runs.
    """

    spectra: Float[np.ndarray, "K 90 360"]
    variance: Float[np.ndarray, " K"]


@dataclass(frozen=True)
class Ensemble:
    """Runs of one dataset and split, such as those that ``bisplat compare --seeds`` trains.

    Attributes:
        runs: at least two.

    Raises:
        InputError: the runs are not all of the same dataset and split.
    """

    runs: Sequence[Run]

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

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> Mean:
        """The mean of the predicted spectra, and how far the runs differ.

        Args:
            positions: transmitter positions, metres, in the world frame of the dataset of the runs.

        Raises:
            ParameterError: the positions do not have the shape [K, 3], or are not finite numbers.
            InputError: a model predicts values that are not finite.
        """
        spectra = [run.predict(positions).spectra for run in self.runs]
        variance = np.var([each[:, ::EVERY, ::EVERY] for each in spectra], axis=0, dtype=float)
        return Mean(np.mean(spectra, axis=0), variance.mean(axis=(1, 2)))

    def deviation(self, variance: Float[np.ndarray, " K"]) -> Float[np.ndarray, " K"] | None:
        """How far the means may be off: standard deviations of their values, 0…1, as by ``Run.deviation``.

        Args:
            variance: variance of the predictions, from ``predict``.

        Returns:
            The standard deviations. None: the runs have too few validation spectra.
        """
        return None if self._fitted is None else self._fitted.at(variance, len(variance))

    @cached_property
    def _data(self) -> Dataset:
        return self.runs[0].dataset()

    @cached_property
    def _validation(self) -> Int[np.ndarray, " n"]:
        return self.runs[0].split(self._data).validation

    @cached_property
    def _fitted(self) -> Deviation | None:
        """The deviation, fitted to validation spectra, on which no run was trained."""
        data, validated = self._data, evenly(self._validation, Spectra.VALIDATED)
        if not len(validated):
            return None
        mean = self.predict(data.positions[validated])
        return fit_deviation(pixel_errors(mean.spectra, spectrum_of(data.pictures[validated])), mean.variance)
