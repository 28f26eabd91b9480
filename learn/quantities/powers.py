"""Received powers (RSSI), in dBm. A power that was not received has no error in dB."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float, Int

from learn.quantities.known_powers import KnownPowers
from learn.quantities.quantity import OfEach, Prediction, Quantity, Scored
from scenes.files.npz_file import Expected
from simulate.dataset.dataset import Dataset


class Powers(Quantity):
    """Powers [G] of G gateways, dBm; NaN where nothing was received, and below the floor where that is predicted.

    The scores are "powers", the number of received ones, and "not_received"; the median, the root mean square and the
    90th percentile of the absolute error of received powers, dB; "received_rightly", the share of all powers of which
    it is predicted rightly whether they are received; "coverage_90", the share of received powers within the stated
    90 % intervals, and "interval_median_db", their median width.
    """

    name = "power"
    things = "positions"
    in_words = "received powers"
    predicted = "powers in dBm"
    kinds = "iuf"
    file = "powers.npy"
    columns: ClassVar[Mapping[str, str]] = {
        "error_median_db": "median error (dB)",
        "rmse_db": "RMSE (dB)",
        "error_p90_db": "90th % (dB)",
        "received_rightly": "received or not, right",
        "coverage_90": "in 90 % interval",
    }
    small_is_good = True
    of_each = OfEach("error_db", "absolute error (dB)", "share of received powers")

    def of(self, dataset: Dataset, rows: Int[np.ndarray, " n"]) -> Float[np.ndarray, "n G"]:
        return dataset.powers[rows]

    def whole(self, dataset: Dataset, rows: Int[np.ndarray, " n"]) -> Float[np.ndarray, "n G"]:
        return KnownPowers.of(dataset, rows).filled

    def trend(
        self, dataset: Dataset, rows: Int[np.ndarray, " n"]
    ) -> Callable[[Float[np.ndarray, "K 3"]], Float[np.ndarray, "K G"]]:
        """The log-distance law of each gateway."""
        known = KnownPowers.of(dataset, rows)
        return lambda positions: known.law(known.distances(positions))

    def score(self, prediction: Prediction, truth: Float[np.ndarray, "K G"], dataset: Dataset) -> Scored:
        interval = {} if prediction.low is None else {"low": prediction.low, "high": prediction.high}
        error = np.abs(prediction.value - truth)
        each = {"error_db": error, "value": prediction.value, **interval}
        return Scored(score_powers(prediction, truth, dataset.floor_dbm), each)

    def arrays(self, shape: tuple[int, ...]) -> dict[str, Expected]:
        kept = {name: Expected("powers", "f", shape) for name in ("error_db", "value")}
        return kept | {name: Expected("powers", "f", shape, optional=True) for name in ("low", "high")}

    def remark(self, rows: Sequence[Mapping[str, Any]]) -> str | None:
        silent = rows[0]["not_received"] if rows else 0
        if not silent:
            return None
        return f"{silent} powers of the test part were not received; they count in the share alone, not in the errors"

    def stated(self, dataset: Dataset) -> str | None:
        if dataset.frequency.source != "assumed":
            return None
        return f"{dataset.folder}: no frequency is stated, so {dataset.frequency.hertz / 1e6:g} MHz is assumed"


def score_powers(prediction: Prediction, truth: Float[np.ndarray, "K G"], floor: float) -> dict[str, Any]:
    """The scores of all powers together."""
    heard = ~np.isnan(truth)
    errors = np.abs(prediction.value - truth)[heard]
    row: dict[str, Any] = {
        "powers": int(heard.sum()),
        "not_received": int((~heard).sum()),
        "error_median_db": float(np.median(errors)) if errors.size else None,
        "error_p90_db": float(np.quantile(errors, 0.9)) if errors.size else None,
        "rmse_db": float(np.sqrt(np.square(errors).mean())) if errors.size else None,
        "received_rightly": float(((prediction.value >= floor) == heard).mean()),
        "coverage_90": None,
        "interval_median_db": None,
    }
    if prediction.low is not None and prediction.high is not None and errors.size:
        within = (prediction.low <= truth) & (truth <= prediction.high)
        row["coverage_90"] = float(within[heard].mean())
        row["interval_median_db"] = float(np.median((prediction.high - prediction.low)[heard]))
    return row
