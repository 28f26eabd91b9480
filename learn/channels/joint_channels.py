"""The linear estimate of the downlink from all antennas and subcarriers of the uplink together."""

from __future__ import annotations

import numpy as np
from jaxtyping import Complex, Float

from learn.channels.channel_scores import snr_db
from learn.channels.delay_profile import Delays, fit_profile, predict_aligned, regression
from learn.channels.known_channels import KnownChannels, PredictedChannels
from learn.models.kriging.deviation_curve import size_of
from scenes.files.plain_text import say

SHARES = (0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 0.97)
"""Shares of the known rows' own covariance to choose from; the rest is that of the model."""

NOISES = (1e-9, 1e-7, 1e-5, 1e-3, 1e-2, 1e-1)
"""Powers of the noise to choose from, as shares of the mean power of the rows."""

FOLDS = 3
"""Parts of the known rows, each of which is predicted from the others to choose the share and the noise."""

LEAST_ROWS = 2 * FOLDS
"""With fewer known rows, the model alone is used, and ``FEW_ROWS_NOISE``."""

MOST_NUMBERS = 4096
"""Largest product of antennas and subcarriers. Covariances of 2 AS × AS numbers, several at once, then take 3 GB."""

FEW_ROWS_NOISE = 1e-3
"""Noise if too few rows are known to choose one."""


class JointChannels:
    """The linear minimum-mean-square-error estimate over antennas and subcarriers.

    Its covariance is a mean of two: that of the known rows, which is right about every pair of antennas and subcarriers
    but noisy, and the Kronecker product of an antenna covariance and a delay profile, which has few parameters but
    takes delays and directions for independent. Left-out known rows choose the share and the noise, and their errors
    tell the stated deviation: it is in proportion to the root mean square of the row's uplink. With more than
    ``MOST_NUMBERS`` numbers in a row, each antenna is predicted by itself, as by ``Delays``.
    """

    aligned: bool  # whether each row's strongest delay is taken off, as in ``Delays``. Set by ``fit``, as the next.
    share: float  # chosen share of the known rows' own covariance
    noise: float  # chosen power of the noise, as a share of the mean power of the rows
    # stated deviation of a row whose uplink has the root mean square 1. None: too few rows are known.
    deviation: float | None
    _alone: Delays | None

    def fit(self, known: KnownChannels) -> None:
        delays = Delays()
        delays.fit(known)
        self.aligned, self._alone = delays.aligned, None
        _, antennas, subcarriers = known.uplink.shape
        if antennas * subcarriers > MOST_NUMBERS:
            say(
                f"helmholtz: {antennas} antennas × {subcarriers} subcarriers are more than {MOST_NUMBERS} numbers, so "
                "each antenna is predicted by itself"
            )
            self._alone = delays
            return
        rows = known.rows(self.aligned)
        self.share, self.noise, self.deviation = _chosen(rows)
        self._covariance = _mixed(_model(rows), _sample(rows), self.share, self.noise)

    def predict(
        self, uplink: Complex[np.ndarray, "K A S"], positions: Float[np.ndarray, "K 3"] | None = None
    ) -> PredictedChannels:
        if self._alone is not None:
            return self._alone.predict(uplink, positions)

        def of_all(rows: Complex[np.ndarray, "K A S"]) -> Complex[np.ndarray, "K A S"]:
            return regression(self._covariance, rows.reshape(len(rows), -1)).reshape(rows.shape)

        deviation = None if self.deviation is None else self.deviation * _level(uplink.reshape(len(uplink), -1))
        return PredictedChannels(predict_aligned(of_all, uplink, self.aligned), deviation)


def _chosen(rows: Complex[np.ndarray, "n A 2S"]) -> tuple[float, float, float | None]:
    """The share and the noise with the largest mean SNR of left-out rows, and the size of their errors.

    The errors are relative to the uplink's root mean square.
    """
    if len(rows) < LEAST_ROWS:
        return 0.0, FEW_ROWS_NOISE, None
    folds = []
    for fold in range(FOLDS):
        out = np.arange(len(rows)) % FOLDS == fold
        folds.append((_model(rows[~out]), _sample(rows[~out]), *np.split(_in_links(rows[out]), 2, axis=1)))
    scores = np.zeros((len(SHARES), len(NOISES)))
    for i, share in enumerate(SHARES):
        for j, noise in enumerate(NOISES):
            for model, sample, up, down in folds:
                found = regression(_mixed(model, sample, share, noise), up)
                scores[i, j] += snr_db(found[:, None], down[:, None]).sum()
    best = np.unravel_index(scores.argmax(), scores.shape)
    share, noise = SHARES[best[0]], NOISES[best[1]]
    errors = [
        (regression(_mixed(model, sample, share, noise), up) - down) / _level(up)[:, None]
        for model, sample, up, down in folds
    ]
    return share, noise, float(size_of(np.concatenate(errors).view(float).ravel()))


def _level(channels: Complex[np.ndarray, "K N"]) -> Float[np.ndarray, " K"]:
    """Root mean square of each row."""
    return np.sqrt(np.square(np.abs(channels)).mean(axis=1))


def _in_links(rows: Complex[np.ndarray, "n A 2S"]) -> Complex[np.ndarray, "n 2AS"]:
    """Each row as one vector: all of the uplink, then all of the downlink."""
    _, antennas, both = rows.shape
    return np.stack(np.split(rows, 2, axis=2), axis=1).reshape(len(rows), antennas * both)


def _sample(rows: Complex[np.ndarray, "n A 2S"]) -> Complex[np.ndarray, "2AS AS"]:
    """Covariance of the rows, for the columns of the uplink."""
    vectors = _in_links(rows)
    return vectors.T @ vectors[:, : vectors.shape[1] // 2].conj() / max(len(rows), 1)


def _model(rows: Complex[np.ndarray, "n A 2S"]) -> Complex[np.ndarray, "2AS AS"]:
    """Kronecker product of the covariance of antennas and that of a delay profile, for the columns of the uplink."""
    _, antennas, both = rows.shape
    profile, noise = fit_profile(rows)
    profile = (profile - noise * np.eye(both)).reshape(2, both // 2, 2, both // 2)[:, :, 0]
    across = np.einsum("nas,nbs->ab", rows, rows.conj(), optimize=True)
    level = np.trace(across).real / antennas
    across = across / level if level > 0 else np.eye(antennas)
    return np.einsum("ab,lst->lasbt", across, profile).reshape(antennas * both, -1)


def _mixed(
    model: Complex[np.ndarray, "2AS AS"], sample: Complex[np.ndarray, "2AS AS"], share: float, noise: float
) -> Complex[np.ndarray, "2AS AS"]:
    """The covariance of a share and a noise, for the columns of the uplink."""
    covariance = (1 - share) * model + share * sample
    covariance[np.diag_indices(covariance.shape[1])] += noise
    return covariance
