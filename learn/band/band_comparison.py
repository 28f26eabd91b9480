"""The scores of predicted responses over a band, and the table of them that ``compare_band`` returns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Complex, Float

from learn.band.band_methods import PredictedBand
from learn.channels.channel_scores import SCORES, correlation, coverage, snr_db
from learn.comparison.score_table import Measure, ScoreTable
from learn.comparison.scored_methods import FitRow
from simulate.dataset.dataset import Dataset
from simulate.spectra.band import delay_spread


def score_band(
    predicted: PredictedBand, truth: Complex[np.ndarray, "K elements subcarriers"], bandwidth: float
) -> dict[str, Any]:
    """Score predicted responses over a band."""
    snr = snr_db(predicted.responses, truth)
    heard = ~np.isnan(snr)
    if not heard.any():
        return dict.fromkeys(SCORES)
    found, truth, snr = predicted.responses[heard], truth[heard], snr[heard]
    off = np.abs(delay_spread(found, bandwidth) - delay_spread(truth, bandwidth))
    return {
        "snr_median_db": float(np.median(snr)),
        "snr_mean_db": float(snr.mean()),
        "snr_p10_db": float(np.quantile(snr, 0.1)),
        "correlation_median": float(np.median(correlation(found, truth))),
        "delay_spread_error_median_ns": 1e9 * float(np.median(off)),
        "coverage_90": None if predicted.deviation is None else coverage(found - truth, predicted.deviation[heard]),
    }


class BandRow(FitRow, frozen=True, kw_only=True):
    """The entries that every kept row has."""

    snr_median_db: float | None
    snr_mean_db: float | None


@dataclass(frozen=True, kw_only=True, repr=False)
class BandComparison(ScoreTable):
    """Rows measured by ``compare_band``.

    ``pandas.DataFrame(comparison)`` makes a table of the rows. ``print(comparison)`` shows the averages over the seeds,
    the best first, and a notebook shows the same as HTML. ``len(comparison)`` and iteration are those of ``rows``.

    A row has "label", the name of the method, "seed" of the fit, "train_size", the number of training positions asked
    for (None: all), "known", the number of known positions, "found", what the fit found in words (None: it says
    nothing), "steps" of training (None: the method has none), "seconds" for the fit and the predictions, "source" of a
    class of your own, a hash that tells when it has to be measured again, and these scores:

    - "snr_median_db", "snr_mean_db" and "snr_p10_db" (10th percentile) of the signal-to-noise ratio of the predicted
      responses over all elements and subcarriers of a position, 10 log₁₀ ‖y‖² / ‖y − ŷ‖², dB;
    - "correlation_median", of ``|ŷ^H y|`` / (‖ŷ‖ ‖y‖), which a wrong level or common phase leaves as it is;
    - "delay_spread_error_median_ns", of the absolute error of the root mean square delay spread, ns;
    - "coverage_90", the share of the real and imaginary parts of the responses within the stated 90 % intervals; None
      if the method states none.

    Attributes:
        folder: the dataset's folder.
        split: how the test part was chosen.
        seed: seed of the split.
        guard: known positions nearer than this to a test position were left out, wavelengths.
        minutes: training time of each method that is trained by steps.
        parts: training, validation and test part; of several sizes, those of the largest.
        rows: a dictionary for each method, seed and size, in the order in which they were measured. ``averages()`` and
            ``table()`` average them over the seeds.
        distances: how far the test positions are from the known ones.
        dataset: the spectra, with their responses over the band.
        snr_db: SNR of each test position, dB, [test], of the first seed, by the name of the row in the table.

    Example:
        >>> import bisplat, numpy as np
        >>> places = np.random.default_rng(0).uniform(0, 0.2, (60, 3))
        >>> delays = np.linalg.norm(places - [4, 0, 0], axis=1) / 3e8
        >>> waves = np.exp(-2j * np.pi * delays[:, None] * (2.4e9 + 1.25e6 * (np.arange(16) - 8)))
        >>> array = bisplat.PlanarArray(1, 4)
        >>> wide = bisplat.write_dataset("data/hall", places, waves[:, None] * np.ones((4, 1)), array, "2.4 GHz",
        ...                              bandwidth="20 MHz")
        >>> comparison = bisplat.compare_band(wide, ["nearest", "helmholtz"], split="random")
        >>> [row["label"] for row in comparison.table()]  # the best first
        ['helmholtz', 'nearest']
        >>> comparison
        BandComparison('data/hall': 2 methods, 48 known and 12 test positions, split random)
    """

    COLUMNS: ClassVar[Mapping[str, str]] = {
        "snr_median_db": "median SNR (dB)",
        "snr_mean_db": "mean SNR (dB)",
        "snr_p10_db": "10th % (dB)",
        "correlation_median": "median correlation",
        "delay_spread_error_median_ns": "delay spread off (ns)",
        "coverage_90": "in 90 % interval",
        "steps": "steps",
        "seconds": "seconds",
    }
    MEASURE: ClassVar[Measure] = Measure(
        "snr", "snr_median_db", "snr_mean_db", False, "SNR of the predicted responses (dB)", "share of positions"
    )
    RANKED_BY: ClassVar[str] = MEASURE.key
    THINGS: ClassVar[str] = "positions"

    dataset: Dataset = field(repr=False)
    snr_db: Mapping[str, Float[np.ndarray, " K"]]

    def of_each(self) -> dict[str, Float[np.ndarray, "..."]]:
        return dict(self.snr_db)
