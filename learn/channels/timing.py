"""The delay that all paths of a row have in common: the phase ramp over subcarriers that it makes."""

from __future__ import annotations

import numpy as np
from jaxtyping import Complex, Float

FINER = 16
"""Delays of the search for the strongest one, per subcarrier."""


def strongest_ramp(channels: Complex[np.ndarray, "*rows A S"]) -> Float[np.ndarray, "*rows"]:
    """Phase step per subcarrier of the strongest path of each row, radians; exact if it is the only one.

    The largest power of a finely sampled Fourier transform, summed over the antennas, gives it roughly. The mean phase
    between subcarriers that are half a band apart gives the rest.

    Example:
        >>> float(strongest_ramp(np.exp(-0.3j * np.arange(26))[None]).round(6))
        -0.3
    """
    count = channels.shape[-1]
    power = np.square(np.abs(np.fft.fft(channels, FINER * count))).sum(axis=-2)
    rough = np.angle(np.exp(2j * np.pi * power.argmax(axis=-1) / (FINER * count)))
    if count < 2:
        return rough
    level = without_ramp(channels, rough)
    apart = count // 2
    return rough + np.angle((level[..., apart:] * level[..., :-apart].conj()).sum(axis=(-2, -1))) / apart


def without_ramp(
    channels: Complex[np.ndarray, "*rows A N"], step: Float[np.ndarray, "*rows"], first: int = 0
) -> Complex[np.ndarray, "*rows A N"]:
    """Channels after a phase ramp is taken off."""
    return channels * np.exp(-1j * step[..., None, None] * (first + np.arange(channels.shape[-1])))
