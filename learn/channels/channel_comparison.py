"""The table of scores that ``compare_channels`` returns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from jaxtyping import Complex, Float, Int

from learn.comparison.kept_fits import FitRow
from learn.comparison.score_table import Measure, ScoreTable
from simulate.csi.csi_dataset import CsiDataset


class ChannelRow(FitRow, frozen=True, kw_only=True):
    """The entries that every kept row has."""

    snr_median_db: float | None
    snr_mean_db: float | None


@dataclass(frozen=True, kw_only=True, repr=False)
class ChannelComparison(ScoreTable):
    """Rows measured by ``compare_channels``.

    ``pandas.DataFrame(comparison)`` makes a table of the rows. ``print(comparison)`` shows the averages over the seeds,
    the best first, and a notebook shows the same as HTML. ``len(comparison)`` and iteration are those of ``rows``.

    A row has "label", the name of the method, "seed" of the fit, "train_size", the number of training rows asked for
    (None: all), "known", the number of known rows, "steps" of training (None: the method has none), "seconds" for the
    fit and the predictions, "source" of a class of your own, a hash that tells when it has to be measured again, and
    these scores:

    - "rows", the number of test rows that the scores refer to, those whose downlink is not zero;
    - "snr_median_db", "snr_mean_db" and "snr_p10_db" (10th percentile) of the signal-to-noise ratio of the predicted
      downlink, 10 log₁₀ ‖h‖² / ‖h − ĥ‖² for each row, dB, at most 200;
    - "correlation_median", of ``|ĥ^H h|`` / (‖ĥ‖ ‖h‖), which a wrong level or common phase leaves as it is;
    - "delay_spread_error_median_ns", of the absolute error of the downlink's root mean square delay spread, ns; None if
      the folder states no bandwidth;
    - "coverage_90", the share of the real and imaginary parts of the channels within the stated 90 % intervals; None if
      the method states none.

    They are None if no test row has a downlink.

    Attributes:
        folder: the dataset's folder.
        split: how the test part was chosen.
        seed: seed of the split.
        guard: known positions nearer than this to a test position were left out, wavelengths.
        minutes: training time of each method that is trained by steps.
        parts: training, validation and test part; of several sizes, those of the largest.
        rows: a dictionary for each method, seed and size, in the order in which they were measured. ``averages()`` and
            ``table()`` average them over the seeds.
        distances: how far the test positions are from the known ones. None: positions or frequency are not known.
        dataset: the channels.
        snr_db: SNR of each test row, dB, [test], of the first seed, by the name of the row in the table; NaN where the
            downlink is zero.
        shown: which of the test rows ``examples`` are, at most 1,000, evenly spread.
        examples: predicted downlinks of these rows, [shown, antennas, subcarriers], of the first seed, by the name of
            the row in the table.

    Example:
        >>> import bisplat, numpy as np
        >>> array = bisplat.PlanarArray(1, 8)
        >>> ramps = np.exp(-1j * np.linspace(0.1, 0.3, 20)[:, None, None] * np.arange(52)) * np.ones((8, 1))
        >>> y = np.random.default_rng(0).uniform(1, 2, (20, 1, 1)) * ramps
        >>> wide = bisplat.write_dataset("data/ramps", np.eye(20, 3), y, array, "2.4 GHz", bandwidth="20 MHz")
        >>> bisplat.export_csi(wide, "ramps")
        >>> comparison = bisplat.compare_channels("ramps", ["copy", "ramp"], split="random")
        >>> [row["label"] for row in comparison.table()]  # the best first
        ['ramp', 'copy']
        >>> comparison.snr_db["copy"].shape
        (4,)
        >>> comparison
        ChannelComparison('ramps': 2 methods, 16 known and 4 test rows, split random)
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
        "snr", "snr_median_db", "snr_mean_db", False, "SNR of the predicted downlink (dB)", "share of rows"
    )
    RANKED_BY: ClassVar[str] = MEASURE.key
    THINGS: ClassVar[str] = "rows"

    dataset: CsiDataset = field(repr=False)
    snr_db: Mapping[str, Float[np.ndarray, " K"]]
    shown: Int[np.ndarray, " E"]
    examples: Mapping[str, Complex[np.ndarray, "E A S"]]

    def of_each(self) -> dict[str, Float[np.ndarray, "..."]]:
        return dict(self.snr_db)
