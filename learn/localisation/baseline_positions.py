"""Errors of located transmitters whose true positions are known, beside those of baselines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Complex, Float, Int

from learn.localisation.channel_regression import unlike
from learn.localisation.locate_channels import fit_regression
from learn.localisation.locate_powers import points_among
from learn.localisation.located_places import Place, share_in_region
from learn.quantities.known_powers import LEAST_DEVIATION, KnownPowers
from simulate.csi.csi_dataset import CsiDataset
from simulate.rssi.rssi_dataset import RssiDataset

NEAREST = (1, 4, 16)  # Numbers of most similar known rows whose positions are averaged


def by_powers(
    dataset: RssiDataset, known: Int[np.ndarray, " n"] | None, heard: Float[np.ndarray, "K G"], seed: int
) -> dict[str, Float[np.ndarray, "K 3"]]:
    """Positions by simpler methods: the nearest fingerprints in dB, and trilateration by the log-distance law.

    A fingerprint is the list of powers, with the dataset's floor for what was not received. Trilateration takes the
    point, of those in ``locate_powers``, with the least squared error of the received powers.
    """
    task = KnownPowers.of(dataset, np.arange(len(dataset)) if known is None else known, seed)
    seen, there = (np.where(np.isnan(each), dataset.floor_dbm, each) for each in (heard, task.powers))
    apart = np.linalg.norm(seen[:, None] - there, axis=2)
    points = points_among(task.positions, seed)
    predicted, deviation = task.law(task.distances(points)), np.maximum(task.law.deviation, LEAST_DEVIATION)
    best = [int(np.nansum(np.square((row - predicted) / deviation), axis=1).argmin()) for row in heard]
    return _by_fingerprint(apart, task.positions) | {"log-distance": points[best]}


def by_channels(
    dataset: CsiDataset, known: Int[np.ndarray, " n"] | None, heard: Complex[np.ndarray, "K A S"], seed: int
) -> dict[str, Float[np.ndarray, "K 3"]]:
    """Positions of the most correlated known rows, up to level, common phase and timing."""
    regression, fingerprints = fit_regression(dataset, known, seed)
    sent = heard.any(axis=(1, 2))
    apart = np.ones((len(heard), len(regression.positions)))
    if sent.any():
        apart[sent] = unlike(fingerprints.of(heard[sent].astype(complex)), regression.known)[0]
    return _by_fingerprint(apart, regression.positions)


def error_rows(
    places: Sequence[Sequence[Place]],
    truth: Float[np.ndarray, "K 3"],
    simpler: Mapping[str, Float[np.ndarray, "K 3"]],
    known: Float[np.ndarray, "n 3"],
) -> list[dict[str, Any]]:
    """A row for each method: median and 90th percentile of the distances to the truth, metres."""
    kept = np.array([bool(each) for each in places])
    first = [each[0] for each in places if each]
    truth = truth[kept]
    if not len(first):
        return []
    positions, within = np.stack([each.position for each in first]), share_in_region(first, truth, known)
    rows: list[dict[str, Any]] = [
        _row("locate", positions, truth) | {"within 90 % region": None if within is None else round(within, 3)}
    ]
    return rows + [_row(name, each[kept], truth) | {"within 90 % region": None} for name, each in simpler.items()]


def _row(name: str, positions: Float[np.ndarray, "K 3"], truth: Float[np.ndarray, "K 3"]) -> dict[str, Any]:
    errors = np.linalg.norm(positions - truth, axis=1)
    median, most = (round(float(np.quantile(errors, share)), 3) for share in (0.5, 0.9))
    return {"method": name, "median, m": median, "90 %, m": most}


def _by_fingerprint(
    apart: Float[np.ndarray, "K n"], positions: Float[np.ndarray, "n 3"]
) -> dict[str, Float[np.ndarray, "K 3"]]:
    """Mean position of the most similar known rows, for each of ``NEAREST``."""
    order = apart.argsort(axis=1)
    names = {count: "fingerprint" if count == 1 else f"fingerprint, mean of {count}" for count in NEAREST}
    return {name: positions[order[:, :count]].mean(axis=1) for count, name in names.items()}
