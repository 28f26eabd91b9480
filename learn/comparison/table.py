"""The table of scores that ``compare``, ``ablate`` and ``sweep`` return."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from learn.baselines.array_ceiling import CEILING, shown_name
from learn.comparison.averaged_table import AveragedTable, average_name, averaged, doubts_of, remark_on
from learn.comparison.experiment import Experiment, read_scores
from learn.comparison.results_folder import Settings, row_name
from learn.data.split_distances import SplitDistances
from simulate.spectra.array import Array

HEADINGS = {
    "ssim_median": "SSIM",
    "ssim_spread": "± seeds",
    "ssim_p05": "5th %",
    "aoa_error_median_deg": "AoA (°)",
    "training_seconds": "train (s)",
    "milliseconds_per_spectrum": "ms each",
}
"""Headings of a printed table, by the keys of a row."""


@dataclass(frozen=True)
class Comparison(AveragedTable):
    """Rows measured by ``compare``, ``ablate`` or ``sweep``.

    ``pandas.DataFrame(comparison)`` makes a table of the rows. ``print(comparison)`` shows the averages over the seeds,
    the best first, and a notebook shows the same as HTML. ``len(comparison)`` and iteration are those of ``rows``.

    Each row is a flat dictionary with these entries:

    - "label", "seed", and "train_size", the number of training spectra asked for (None: the whole training part);
    - "test", the number of test spectra;
    - "ssim_median", "ssim_mean", "ssim_p05" (5th percentile), "psnr_mean" (dB), "mae_mean" and "aoa_error_median_deg"
      (degrees);
    - "test_to_known_least_m", "test_to_known_median_m", the same in wavelengths, and
      "test_nearer_than_half_a_wavelength" (number of test positions): distances to the known positions;
    - "date";
    - except for the array's ceiling: "train" and "known" (numbers of training spectra, and of training and validation
      spectra together: a model trained by steps chooses its checkpoint by the validation part, and all other methods
      learn from all known spectra), "parameters", "training_seconds", "milliseconds_per_spectrum" and "steps"
      ("parameters" and "steps" are None for a method that has none), and "mean_picture_ssim_median", which the mean of
      the known spectra reaches on the same test spectra;
    - for a class of your own: "source", a hash of its source and its settings, by which an edited class is noticed.

    Attributes:
        folder: the experiment's folder, with results.jsonl, per_sample/ and runs/.
        settings: what all rows have in common: dataset, split, training time and device.
        rows: a dictionary for each method, seed and size, in the order in which they were measured.
        distances: how far the test positions are from the known ones of the whole training and validation part.
        array: the array of the dataset.

    Example:
        >>> import bisplat
        >>> comparison = bisplat.compare("data/lab", ["mean-picture", "nearest"], test_spectra=4)
        >>> len(comparison), [row["label"] for row in comparison]
        (3, ['mean-picture', 'nearest', "array's ceiling"])
        >>> [row["label"] for row in comparison.table()]  # the best first, and the bound last
        ['nearest', 'mean-picture', "array's ceiling"]
        >>> comparison  # print(comparison) shows the table
        Comparison(...: 3 rows, 2 methods, split files)
    """

    folder: Path
    settings: Settings
    rows: list[dict[str, Any]]
    distances: SplitDistances | None = None
    array: Array | None = None

    @classmethod
    def of(cls, experiment: Experiment) -> Comparison:
        """All rows that were measured in an experiment's folder, by this call and earlier ones."""
        data = experiment.dataset
        return cls(experiment.folder, experiment.settings, experiment.kept.rows, experiment.distances, data.array)

    def __repr__(self) -> str:
        methods = len({row["label"] for row in self.rows} - {CEILING})
        return f"Comparison({str(self.folder)!r}: {len(self)} rows, {methods} methods, split {self.settings.split})"

    def averages(self) -> list[dict[str, Any]]:
        """Average the rows over the seeds.

        Returns:
            A flat dictionary for each method and size, in the order in which they were measured. It has the entries of
            ``rows`` that are numbers, and also "seeds" (number of seeds) and, of several seeds, "ssim_spread" (standard
            deviation of "ssim_median" over the seeds).

        Example:
            >>> import bisplat
            >>> comparison = bisplat.compare("data/lab", ["nearest"], seeds=2, test_spectra=4)
            >>> [(row["label"], row["seeds"]) for row in comparison.averages()]
            [('nearest', 2), ("array's ceiling", 1)]
        """
        names = ("label", "train_size")
        rows = averaged(self.rows, names, "ssim_median")
        return [{key: value for key, value in row.items() if key in names or value is not None} for row in rows]

    def table(self) -> list[dict[str, Any]]:
        """Sort the averages by median SSIM.

        Returns:
            The dictionaries of ``averages``, with the highest median SSIM first. The array's ceiling, which is not a
            method, is last.
        """
        return sorted(self.averages(), key=lambda row: (row["label"] == CEILING, -row["ssim_median"]))

    def per_sample(self, row: Mapping[str, Any]) -> dict[str, Float[np.ndarray, " K"]]:
        """Read the scores of each of the K test spectra of a row.

        Args:
            row: one of ``rows``.

        Returns:
            Arrays [K] by name: "ssim", "psnr_db" (dB), "mae" and "aoa_error_deg" (degrees).

        Raises:
            InputError: the row's file in ``folder`` is missing or damaged.

        Example:
            >>> import bisplat
            >>> comparison = bisplat.compare("data/lab", ["nearest"], test_spectra=4)
            >>> comparison.per_sample(comparison.rows[0])["aoa_error_deg"].shape
            (4,)
        """
        return read_scores(self.folder / "per_sample" / f"{row_name(row)}.csv")

    def doubts(self) -> dict[str, str]:
        """Say of which rows the scores are doubtful, and why.

        Returns:
            What is doubtful, by the name of the row in the table: it took fewer than 100 training steps, or it is below
            the mean of the known spectra. Rows without doubts are left out.

        Example:
            >>> settings = Settings("data/lab", "files", 0, None, 50, "1 CPU threads")
            >>> row = {"label": "mlp", "seed": 0, "train_size": None, "ssim_median": 0.5, "steps": 50}
            >>> Comparison(Path("runs/table"), settings, [row]).doubts()
            {'mlp': 'only 50 training steps'}
        """
        return doubts_of(self.averages())

    def remark(self) -> str | None:
        """Name the models that had too few training steps, and those below the mean of the known spectra.

        Returns:
            One or two sentences for the user. None: there are no such models.

        Example:
            >>> settings = Settings("data/lab", "files", 0, 0.1, None, "1 CPU threads")
            >>> row = {"label": "mlp", "seed": 0, "train_size": None, "ssim_median": 0.5, "steps": 2}
            >>> print(Comparison(Path("runs/table"), settings, [row]).remark())
            only a few training steps fit into 0.1 minutes: mlp (2); such a score says little, so give ...
        """
        return remark_on(self.averages(), self.settings.minutes)

    def cells(self) -> list[list[str]]:
        return table_cells(self.table())


def table_cells(averages: Sequence[Mapping[str, Any]]) -> list[list[str]]:
    """The texts of a table's cells, headings first. Columns without any value are left out."""
    keys = [key for key in HEADINGS if any(key in row for row in averages)]
    lines = [["", *(HEADINGS[key] for key in keys)]]
    for row in averages:
        lines.append([shown_name(average_name(row)), *(f"{row[key]:.4g}" if key in row else "" for key in keys)])
    return lines
