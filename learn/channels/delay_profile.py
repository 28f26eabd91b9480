"""Channels over subcarriers as sums of paths: the downlink that the power of each delay lets expect."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Complex, Float

from learn.channels.channel_scores import snr_db
from learn.channels.known_channels import KnownChannels, PredictedChannels
from learn.channels.timing import strongest_ramp, without_ramp
from learn.models.kriging.delay_powers import delay_paths, fit_delay_powers, profile_covariance


class Delays:
    """Each antenna's downlink by Gaussian-process regression over frequency on its uplink.

    Receivers often start each row at another time, which shifts all its delays. So each row's strongest delay is taken
    off first where this predicts left-out known rows better.
    """

    aligned: bool  # whether the strongest delay is taken off. Set by ``fit``, as the next.
    # that of the subcarriers of both links, with the noise, in units of the rows' mean power
    covariance: Complex[np.ndarray, "2S 2S"]

    def fit(self, known: KnownChannels) -> None:
        scores = {aligned: _left_out_score(known.rows(aligned)) for aligned in (False, True)}
        self.aligned = scores[True] > scores[False]
        self.covariance, _ = fit_profile(known.rows(self.aligned))

    def predict(
        self, uplink: Complex[np.ndarray, "K A S"], positions: Float[np.ndarray, "K 3"] | None = None
    ) -> PredictedChannels:
        return PredictedChannels(predict_aligned(lambda rows: _of_each(self.covariance, rows), uplink, self.aligned))


def predict_aligned(
    predict: Callable[[Complex[np.ndarray, "K A S"]], Complex[np.ndarray, "K A S"]],
    uplink: Complex[np.ndarray, "K A S"],
    aligned: bool,
) -> Complex[np.ndarray, "K A S"]:
    """Predict the downlink, with the strongest delay of each row taken off and put on again if ``aligned``."""
    if not aligned:
        return predict(uplink)
    step = strongest_ramp(uplink)
    return without_ramp(predict(without_ramp(uplink, step)), -step, first=uplink.shape[2])


def _left_out_score(rows: Complex[np.ndarray, "n A 2S"]) -> float:
    """Mean SNR of every third row, predicted from the others, dB."""
    out = np.arange(len(rows)) % 3 == 0
    if out.all():
        return 0.0
    covariance, _ = fit_profile(rows[~out])
    up, down = np.split(rows[out], 2, axis=2)
    return float(snr_db(_of_each(covariance, up), down).mean())


def _of_each(covariance: Complex[np.ndarray, "2S 2S"], uplink: Complex[np.ndarray, "K A S"]) -> np.ndarray:
    """The downlink of each antenna by itself, complex [K, A, S]."""
    return regression(covariance, uplink.reshape(-1, uplink.shape[2])).reshape(uplink.shape)


def fit_profile(rows: Complex[np.ndarray, "n A N"]) -> tuple[Complex[np.ndarray, "N N"], float]:
    """The covariance of subcarriers whose powers of delays suit channels best, with the noise, and the noise alone."""
    power, noise = fit_delay_powers(rows)
    return profile_covariance(delay_paths(rows.shape[2], len(power)), power, noise), noise


def regression(covariance: Complex[np.ndarray, "N M"], given: Complex[np.ndarray, "rows S"]) -> np.ndarray:
    """The linear least-squares estimate of entries from the first S of them, y = K_yx K_xx⁻¹ x."""
    first = given.shape[1]
    return (covariance[first:, :first] @ np.linalg.solve(covariance[:first, :first], given.T.astype(complex))).T
