"""The scores of predicted powers, and the table that ``compare_powers`` returns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from learn.comparison.averaged_table import averaged
from learn.comparison.score_table import Measure, ScoreTable, by_name
from learn.comparison.scored_methods import FitRow
from learn.data.split_distances import distance_bands
from learn.powers.known_powers import PredictedPowers
from simulate.dataset.dataset import Dataset


def absolute_errors(predicted: PredictedPowers, truth: Float[np.ndarray, "K G"]) -> Float[np.ndarray, "K G"]:
    """Absolute error of each power, dB; NaN where nothing was received, since no error in dB is known there."""
    return np.abs(predicted.median - truth)


def score_powers(predicted: PredictedPowers, truth: Float[np.ndarray, "K G"], floor: float) -> dict[str, Any]:
    """Score predicted powers, all gateways together."""
    heard = ~np.isnan(truth)
    errors = absolute_errors(predicted, truth)[heard]
    row: dict[str, Any] = {
        "powers": int(heard.sum()),
        "not_received": int((~heard).sum()),
        "error_median_db": float(np.median(errors)) if errors.size else None,
        "error_p90_db": float(np.quantile(errors, 0.9)) if errors.size else None,
        "rmse_db": float(np.sqrt(np.square(errors).mean())) if errors.size else None,
        "received_rightly": float(((predicted.median >= floor) == heard).mean()),
        "coverage_90": None,
        "interval_median_db": None,
    }
    if predicted.low is not None and predicted.high is not None and errors.size:
        within = (predicted.low <= truth) & (truth <= predicted.high)
        row["coverage_90"] = float(within[heard].mean())
        row["interval_median_db"] = float(np.median((predicted.high - predicted.low)[heard]))
    return row


def of_gateway(predicted: PredictedPowers, gateway: int) -> PredictedPowers:
    """The predictions of one gateway."""
    parts = (predicted.median, predicted.low, predicted.high)
    return PredictedPowers(*(None if each is None else each[:, [gateway]] for each in parts))  # type: ignore[arg-type]


GATEWAYS = "gateways"  # Key of the scores of each gateway in a kept row


class PowerRow(FitRow, frozen=True, kw_only=True):
    """The entries that every kept row has."""

    error_median_db: float | None
    rmse_db: float | None
    not_received: int
    gateways: dict[str, dict[str, float | None]]


@dataclass(frozen=True, kw_only=True)
class PowerComparison(ScoreTable):
    """Rows measured by ``compare_powers``.

    ``pandas.DataFrame(comparison)`` makes a table of the rows. ``print(comparison)`` shows the averages over the seeds,
    the best first, and a notebook shows the same as HTML. ``len(comparison)`` and iteration are those of ``rows``.

    A row has "label", the name of the method, "seed" of the fit, "train_size", the number of training positions asked
    for (None: all), "known", the number of known positions, "steps" of training (None: the method has none), "seconds"
    for the fit and the predictions, "scene" of the twin, the name of the scene that it corrects, "source" of the twin
    and of a class of your own, a hash that tells when it has to be measured again, and these scores:

    - "powers", the number of received powers at the test positions, and "not_received", that of those that were not;
    - "error_median_db", "error_p90_db" (90th percentile) and "rmse_db" of the absolute error of received powers, dB;
      None if none was received. A power that was not received has no error in dB;
    - "received_rightly": share of all powers of which it is predicted rightly whether they are received;
    - "coverage_90": share of the received powers within the stated 90 % intervals, and "interval_median_db", their
      median width; None if the method states none.

    Attributes:
        folder: the dataset's folder.
        split: how the test part was chosen.
        seed: seed of the split.
        guard: known positions nearer than this to a test position were left out, wavelengths.
        minutes: training time of each method that is trained by steps.
        parts: training, validation and test part; of several sizes, those of the largest.
        rows: a dictionary for each method, seed and size with all gateways together, in the order in which they were
            measured. ``averages()`` and ``table()`` average them over the seeds.
        distances: how far the test positions are from the known ones.
        dataset: the received powers.
        gateway_rows: the same as ``rows`` for each gateway; "gateway" is the gateway's name.
        predicted: predicted powers at the test positions, dBm, [test, gateways], of the first seed, by the name of the
            row in the table.

    Example:
        >>> import bisplat, numpy as np
        >>> places = np.random.default_rng(0).uniform(0, 4, (40, 3))
        >>> powers = -40 - 20 * np.log10(np.linalg.norm(places - [0, 0, 5], axis=1))[:, None]
        >>> door = {"door": (0, 0, 5)}
        >>> hall = bisplat.write_dataset("law", places, powers=powers, gateways=door, frequency="2.4 GHz")
        >>> comparison = bisplat.compare_powers(hall, ["mean", "log-distance"], split="random")
        >>> [row["label"] for row in comparison.table()]  # the best first
        ['log-distance', 'mean']
        >>> comparison.errors["mean"].shape
        (8, 1)
        >>> comparison
        PowerComparison('law': 2 methods, 1 gateway, 32 known and 8 test positions, split random)
    """

    COLUMNS: ClassVar[Mapping[str, str]] = {
        "error_median_db": "median error (dB)",
        "error_p90_db": "90th % (dB)",
        "rmse_db": "RMSE (dB)",
        "received_rightly": "received or not, right",
        "coverage_90": "in 90 % interval",
        "steps": "steps",
        "seconds": "seconds",
    }
    MEASURE: ClassVar[Measure] = Measure(
        "error", "error_median_db", "rmse_db", True, "absolute error (dB)", "share of received powers"
    )
    RANKED_BY: ClassVar[str] = MEASURE.key
    THINGS: ClassVar[str] = "positions"

    dataset: Dataset = field(repr=False)
    gateway_rows: list[dict[str, Any]]
    predicted: Mapping[str, PredictedPowers]

    def __repr__(self) -> str:
        count = len(self.dataset.gateway_names)
        gateways = "1 gateway" if count == 1 else f"{count} gateways"
        methods = len({row["label"] for row in self.rows})
        return (
            f"PowerComparison({str(self.folder)!r}: {methods} methods, {gateways}, {self.known} known and "
            f"{self.test} test positions, split {self.split})"
        )

    @cached_property
    def errors(self) -> dict[str, Float[np.ndarray, "K G"]]:
        """Absolute error of each power in dB, [test, gateways], of the first seed, by the name of the row in the table.

        It is NaN where nothing was received.
        """
        truth = self.dataset.powers[self.parts.test]
        return {name: absolute_errors(each, truth) for name, each in self.predicted.items()}

    def of_each(self) -> dict[str, Float[np.ndarray, "..."]]:
        return self.errors

    def gateway_averages(self, gateway: str) -> list[dict[str, Any]]:
        """The averages over the seeds of one gateway, in the order of ``averages``.

        Args:
            gateway: its name.
        """
        rows = [row for row in self.gateway_rows if row["gateway"] == gateway]
        return averaged(rows, ("label", "train_size", "gateway"), self.MEASURE.key)

    def intervals_by_distance(self, name: str) -> list[dict[str, Any]]:
        """How often the stated 90 % intervals hold, by the distance to the nearest known position; first seed.

        Args:
            name: name of the method, or of another row of the table.

        Returns:
            A dictionary for each band of distances that has received powers: "distance" in words, "powers", their
            number, "coverage_90" and "interval_median_db", as in ``rows``. Empty if the method states no intervals.
        """
        predicted, truth = self.predicted[name], self.dataset.powers[self.parts.test]
        if predicted.low is None or predicted.high is None or self.distances is None:
            return []
        within, width = (predicted.low <= truth) & (truth <= predicted.high), predicted.high - predicted.low
        found = []
        for words, near in distance_bands(self.distances.distance / self.distances.wavelength):
            counted = near[:, None] & ~np.isnan(truth)
            if counted.any():
                share, median = float(within[counted].mean()), float(np.median(width[counted]))
                row = {"distance": words, "powers": int(counted.sum())}
                found.append({**row, "coverage_90": share, "interval_median_db": median})
        return found

    def remark(self) -> str | None:
        """Sentences that name methods with too few training steps, and powers that have no error. None: no such."""
        silent = self.rows[0]["not_received"]
        sentence = (
            f"{silent} powers of the test part were not received; they count in the share alone, not in the errors"
        )
        return ". ".join(filter(None, [super().remark(), sentence if silent else None])) or None

    def facts(self) -> dict[str, Any]:
        """All scores and what they are of, for JSON; methods by name, of several sizes with the size."""
        of_gateways = {each: by_name(self.gateway_averages(each), "gateway") for each in self.dataset.gateway_names}
        facts = super().facts()
        facts |= next(({"scene": row["scene"]} for row in self.rows if "scene" in row), {})
        facts["gateways"] = {name: {each: of_gateways[each][name] for each in of_gateways} for name in facts["methods"]}
        return facts
