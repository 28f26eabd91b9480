"""Fingerprints of channels over subcarriers that do not depend on their level, common phase and timing."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Int

from learn.channels.timing import strongest_ramp, without_ramp

DIRECTIONS = 8
"""Directions of beams per antenna. A planar array sees half of them twice."""

MOST_DIRECTIONS = 256
"""Largest number of directions."""

FINER = 2
"""Delays per subcarrier."""

MOST_DELAYS = 64
"""Largest number of delays: those with the largest mean power of the known rows."""

LEAST_POWER = 0.01
"""Added to powers before the logarithm, as a share of a row's mean power. Weaker ones are side lobes or noise."""


class Fingerprint(NamedTuple):
    """Two fingerprints of n rows."""

    # channels of length 1 whose strongest delay is taken off; the squared scalar product of two tells whether they
    # agree phase by phase, as only places within a fraction of a wavelength do
    waves: Complex[np.ndarray, "n E"]
    # powers of directions and delays, dB, which also tell places that are farther apart
    powers: Float[np.ndarray, "n F"]


class ChannelFingerprints:
    """Fingerprints of the channels of one base station."""

    def __init__(
        self, antennas: Float[np.ndarray, "A 3"], wavelength: float, known: Complex[np.ndarray, "n A S"]
    ) -> None:
        directions = _over_a_sphere(min(DIRECTIONS * len(antennas), MOST_DIRECTIONS))
        self._beams = np.exp(-2j * np.pi / wavelength * directions @ (antennas - antennas.mean(axis=0)).T)
        self._delays = np.arange(FINER * known.shape[2])
        if len(self._delays) > MOST_DELAYS:
            delayed = np.fft.ifft(_level(known), FINER * known.shape[2], axis=2)
            power = np.square(np.abs(delayed)).sum(axis=(0, 1))
            self._delays = np.sort(power.argsort()[-MOST_DELAYS:])

    def of(self, channels: Complex[np.ndarray, "n A S"]) -> Fingerprint:
        """Fingerprints of channels, none of them zero."""
        level = _level(channels)
        waves = level.reshape(len(level), -1)
        return Fingerprint(waves, np.stack([self._powers(row) for row in level]))

    def _powers(self, row: Complex[np.ndarray, "A S"]) -> Float[np.ndarray, " F"]:
        delayed = np.fft.ifft(row, FINER * row.shape[1], axis=1)[:, self._delays]
        power = np.square(np.abs(self._beams @ delayed)).ravel()
        return 10 * np.log10(power / power.mean() + LEAST_POWER)


def unlike(here: Fingerprint, there: Fingerprint) -> tuple[Float[np.ndarray, "n m"], Float[np.ndarray, "n m"]]:
    """How unlike fingerprints are: 1 − ``|ρ|²`` of the waves, and the mean squared difference of the powers, dB²."""
    waves = 1 - np.square(np.abs(here.waves.conj() @ there.waves.T))
    squares = (np.square(each.powers).sum(axis=1) for each in (here, there))
    powers = np.add.outer(*squares) - 2 * here.powers @ there.powers.T
    return np.maximum(waves, 0), np.maximum(powers, 0) / here.powers.shape[1]


def _level(channels: Complex[np.ndarray, "n A S"]) -> Complex[np.ndarray, "n A S"]:
    """Rows of length 1 without the delay of their strongest path."""
    scale = np.abs(channels).max(axis=(1, 2), keepdims=True)
    aligned = without_ramp(channels / scale, strongest_ramp(channels / scale))
    return aligned / np.linalg.norm(aligned.reshape(len(aligned), -1), axis=1)[:, None, None]


def _over_a_sphere(count: int) -> Float[np.ndarray, "count 3"]:
    """Unit vectors spread evenly over a sphere: a Fibonacci lattice."""
    number: Int[np.ndarray, " count"] = np.arange(count)
    height = 1 - (2 * number + 1) / count
    turn = np.pi * (1 + 5**0.5) * number
    across = np.sqrt(1 - height**2)
    return np.stack([across * np.cos(turn), across * np.sin(turn), height], axis=1)
