"""Channels over subcarriers as sums of paths: the power of each delay, and the downlink that it lets expect.

A band is to delays what an aperture is to directions: the channel at frequency f is Σ a exp(−i 2π f τ) over paths of
delay τ. With independent paths, channels are a Gaussian process over frequency, whose covariance depends on the
difference of two frequencies alone.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Complex, Float

from learn.channels.channel_scores import snr_db
from learn.channels.known_channels import KnownChannels
from learn.channels.timing import strongest_ramp, without_ramp

FINER = 8
"""Delays of the profile, per subcarrier of both links."""

STEPS = 300
"""Steps of the fit of the profile."""

LEAST_NOISE = 1e-8
"""Smallest power of the noise, as a share of the mean power of the channels."""


class Delays:
    """Each antenna's downlink by Gaussian-process regression over frequency on its uplink.

    Receivers often start each row at another time, which shifts all its delays. So each row's strongest delay is taken
    off first where this predicts left-out known rows better.

    Attributes:
        aligned: whether the strongest delay is taken off. Set by ``fit``, as the next.
        covariance: that of the subcarriers of both links, with the noise, in units of the rows' mean power.
    """

    aligned: bool
    covariance: Complex[np.ndarray, "2S 2S"]

    def fit(self, known: KnownChannels) -> None:
        scores = {aligned: _left_out_score(known.rows(aligned)) for aligned in (False, True)}
        self.aligned = scores[True] > scores[False]
        self.covariance, _ = fit_profile(known.rows(self.aligned))

    def predict(
        self, uplink: Complex[np.ndarray, "K A S"], positions: Float[np.ndarray, "K 3"] | None = None
    ) -> Complex[np.ndarray, "K A S"]:
        return predict_aligned(lambda rows: _of_each(self.covariance, rows), uplink, self.aligned)


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
    """Fit powers of delays and of noise to channels by maximum likelihood.

    The covariance is Σ p f f^H + ν, with f = exp(−i 2π n τ) over subcarriers n and a grid of delays τ. Each step
    multiplies each power by the root of f^H R⁻¹ C R⁻¹ f / f^H R⁻¹ f, with the covariance R so far and that C of the
    channels, and the noise likewise. No step lowers the likelihood [stoica2012].

    Args:
        rows: channels over evenly spaced subcarriers. All antennas share the profile.

    Returns:
        The covariance, with the noise, and the noise ν.
    """
    count = rows.shape[2]
    channels = rows.reshape(-1, count)
    paths = np.exp(-2j * np.pi * np.outer(np.arange(count), np.arange(FINER * count)) / (FINER * count))
    found = channels.T @ channels.conj() / max(len(channels), 1)
    power = np.full(FINER * count, 1.0 / (FINER * count))
    noise = max(float(np.linalg.eigvalsh(found)[0]), LEAST_NOISE)
    for _ in range(STEPS):
        inverse = np.linalg.inv(_covariance(paths, power, noise))
        seen = inverse @ found @ inverse
        power = power * np.sqrt(_along(seen, paths) / _along(inverse, paths))
        noise = max(noise * float(np.sqrt(max(np.trace(seen).real, 0) / np.trace(inverse).real)), LEAST_NOISE)
    return _covariance(paths, power, noise), noise


def _covariance(
    paths: Complex[np.ndarray, "N M"], power: Float[np.ndarray, " M"], noise: float
) -> Complex[np.ndarray, "N N"]:
    return (paths * power) @ paths.conj().T + noise * np.eye(len(paths))


def _along(matrix: Complex[np.ndarray, "N N"], paths: Complex[np.ndarray, "N M"]) -> Float[np.ndarray, " M"]:
    """f^H M f for each path."""
    return np.maximum(np.einsum("nm,nm->m", paths.conj(), matrix @ paths).real, np.finfo(float).tiny)


def regression(covariance: Complex[np.ndarray, "N M"], given: Complex[np.ndarray, "rows S"]) -> np.ndarray:
    """The linear least-squares estimate of entries from the first S of them, y = K_yx K_xx⁻¹ x.

    Args:
        covariance: covariance of all N entries, with the noise of the first S, for the columns of those at least.
        given: the first S entries of each row.

    Returns:
        The other entries, complex [rows, N − S].
    """
    first = given.shape[1]
    return (covariance[first:, :first] @ np.linalg.solve(covariance[:first, :first], given.T.astype(complex))).T
