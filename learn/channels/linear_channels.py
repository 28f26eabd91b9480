"""Linear estimates of the downlink: from the powers of delays, over all antennas, and with the known rows nearby."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Complex, Float

from learn.channels.known_channels import KnownChannels, strongest_ramp, without_ramp
from learn.models.kriging.band_field import BandField
from learn.models.kriging.delay_powers import delay_paths, fit_delay_powers, profile_covariance
from learn.models.kriging.deviation_curve import size_of
from learn.quantities.complex_scores import snr_db
from learn.quantities.known import Known
from learn.quantities.quantity import Prediction
from scenes.files.plain_text import say
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.spectrum import evenly


class Delays:
    """Each antenna's downlink by Gaussian-process regression over frequency on its uplink.

    Receivers often start each row at another time, which shifts all its delays. So each row's strongest delay is taken
    off first where this predicts left-out known rows better.
    """

    aligned: bool  # whether the strongest delay is taken off. Set by ``fit``, as the next.
    # that of the subcarriers of both links, with the noise, in units of the rows' mean power
    covariance: Complex[np.ndarray, "2S 2S"]

    def fit(self, known: Known) -> None:
        self.fit_to(KnownChannels.of(known))

    def fit_to(self, known: KnownChannels) -> None:
        """Learn from both links of known rows."""
        scores = {aligned: _left_out_score(known.rows(aligned)) for aligned in (False, True)}
        self.aligned = scores[True] > scores[False]
        self.covariance, _ = fit_profile(known.rows(self.aligned))

    def predict(self, positions: Float[np.ndarray, "K 3"] | None, given: Complex[np.ndarray, "K A S"]) -> Prediction:
        return Prediction(predict_aligned(lambda rows: _of_each(self.covariance, rows), given, self.aligned))


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


SHARES = (0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 0.97)
"""Shares of the known rows' own covariance to choose from; the rest is that of the model."""

NOISES = (1e-9, 1e-7, 1e-5, 1e-3, 1e-2, 1e-1)
"""Powers of the noise to choose from, as shares of the mean power of the rows."""

FOLDS = 3
"""Parts of the known rows, each of which is predicted from the others to choose the share and the noise."""

LEAST_ROWS = 2 * FOLDS
"""With fewer known rows, the model alone is used, and ``FEW_ROWS_NOISE``; their places are not."""

MOST_NUMBERS = 4096
"""Largest product of antennas and subcarriers. Covariances of 2 AS × AS numbers, several at once, then take 3 GB."""

FEW_ROWS_NOISE = 1e-3  # Noise if too few rows are known to choose one


class HelmholtzChannels:
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

    def fit(self, known: Known) -> None:
        self.fit_to(KnownChannels.of(known))

    def fit_to(self, known: KnownChannels) -> None:
        """Learn from both links of known rows."""
        delays = Delays()
        delays.fit_to(known)
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

    def predict(self, positions: Float[np.ndarray, "K 3"] | None, given: Complex[np.ndarray, "K A S"]) -> Prediction:
        if self._alone is not None:
            return self._alone.predict(positions, given)

        def of_all(rows: Complex[np.ndarray, "K A S"]) -> Complex[np.ndarray, "K A S"]:
            return regression(self._covariance, rows.reshape(len(rows), -1)).reshape(rows.shape)

        deviation = None if self.deviation is None else self.deviation * _level(given.reshape(len(given), -1))
        return Prediction(predict_aligned(of_all, given, self.aligned), deviation=deviation)


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


MOST_LEFT_OUT = 400  # Largest number of known rows, evenly spread, that are predicted from the others

LEAST_GAIN = 0.01
"""If the places explain a smaller share of the power of left-out rows, they are not used."""


class HelmholtzPositions:
    """Both links as one field over the place, and what it leaves of the downlink from what it leaves of the uplink.

    ``BandField`` predicts both links of a row from the known rows nearby. Of a row's own uplink, it leaves y_u − ŷ_u.
    ``HelmholtzChannels``, fitted to what is left of known rows that are predicted from the others, estimates y_d − ŷ_d
    from it. Two such steps are the linear minimum-mean-square-error estimate from the row's own uplink and its
    neighbours together. If the places tell nothing, as where each row has a phase of its own, this is
    ``HelmholtzChannels`` alone. The stated deviation is in proportion to what is left of the row's uplink, which shows
    how well the places predict it.
    """

    # the fitted field of both links. None: the places are not used. Set by ``fit``, as the next.
    field: BandField | None
    found: str  # what the fit found, in words

    def fit(self, taught: Known) -> None:
        known = KnownChannels.of(taught)
        self.field, self.found = None, "does not use places"
        self._rest = HelmholtzChannels()
        both = np.concatenate([known.uplink, known.downlink], axis=2).astype(complex)
        if known.positions is None:
            say("helmholtz-positions: the positions (tx_pos.csv) are not known, so it is the same as helmholtz")
        elif len(both) >= LEAST_ROWS:
            left = self._left_by_places(both, known.positions, known.wavelength)
            if self.field is not None:
                known = KnownChannels(*np.split(left, 2, axis=2), seed=known.seed)
        self._rest.fit_to(known)

    def _left_by_places(
        self, both: Complex[np.ndarray, "n A 2S"], positions: Float[np.ndarray, "n 3"], wavelength: float
    ) -> Complex[np.ndarray, "m A 2S"]:
        """Fit the field, and return what it leaves of known rows that it predicts from the others."""
        region = np.stack([positions.min(axis=0), positions.max(axis=0)])
        field = BandField(region, Beamformer(PlanarArray(1, both.shape[1])), wavelength)
        found = field.fit_to(positions, both, np.arange(len(both), dtype=float))
        out = evenly(np.arange(len(both)), MOST_LEFT_OUT)
        left = both[out] - field.at(positions[out], out)[0]
        power, unexplained = (float(np.square(np.abs(each)).sum()) for each in (both[out], left))
        if unexplained < (1 - LEAST_GAIN) * power:
            self.field, self.found = field, f"{found}; places explain {1 - unexplained / power:.0%} of the power"
            say(f"helmholtz-positions: {self.found}")
        return left

    def predict(self, positions: Float[np.ndarray, "K 3"] | None, given: Complex[np.ndarray, "K A S"]) -> Prediction:
        if self.field is None or positions is None:
            return self._rest.predict(None, given)
        up, down = np.split(self.field.at(positions)[0], 2, axis=2)
        rest = self._rest.predict(None, given - up)
        return Prediction(down + rest.value, deviation=rest.deviation)
