"""A band of subcarriers around a carrier, as OFDM receivers measure it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from jaxtyping import Complex, Float
from msgspec import Meta

from scenes.files.errors import ParameterError, require_positive, require_whole
from scenes.files.options import check_kinds
from scenes.scene.frequency import read_bandwidth

MOST_SUBCARRIERS = 4096  # Largest number of subcarriers of a band, that of 5G

WIDEST = 0.2
"""Largest bandwidth, as a share of the carrier frequency. Paths are solved at the carrier, and a wider band would need
other paths at its ends."""


@dataclass(frozen=True)
class Band:
    """Evenly spaced subcarriers around a carrier.

    Subcarrier n has the frequency ``f + (n − ⌊N/2⌋) B/N``, with the carrier frequency f, the bandwidth B, the number N
    of subcarriers, and n = 0…N−1. So subcarrier ⌊N/2⌋ is the carrier, as in an FFT and in Sionna.

    Attributes:
        bandwidth: B, Hz.
        subcarriers: N, 2 to 4096.

    Raises:
        ParameterError: the bandwidth is not positive, or the number is not from 2 to 4096.

    Example:
        >>> import bisplat
        >>> band = bisplat.Band(bandwidth=20e6, subcarriers=64)
        >>> band.spacing, band.frequencies(915e6)[[0, 32, 63]].tolist()
        (312500.0, [905000000.0, 915000000.0, 924687500.0])
    """

    bandwidth: Annotated[float, Meta(gt=0)]
    subcarriers: Annotated[int, Meta(ge=2, le=MOST_SUBCARRIERS)]

    def __post_init__(self) -> None:
        check_kinds(self)
        require_positive(bandwidth=self.bandwidth)
        require_whole(2, MOST_SUBCARRIERS, subcarriers=self.subcarriers)

    @property
    def spacing(self) -> float:
        """Distance between neighbouring subcarriers, Hz."""
        return self.bandwidth / self.subcarriers

    @property
    def carrier(self) -> int:
        """Index of the subcarrier that is the carrier."""
        return self.subcarriers // 2

    def frequencies(self, carrier: float) -> Float[np.ndarray, " subcarriers"]:
        """Frequencies of the subcarriers, Hz.

        Args:
            carrier: carrier frequency, Hz.

        Returns:
            Frequencies, Hz, rising, [subcarriers].

        Raises:
            ParameterError: the band is wider than a fifth of the carrier frequency.
        """
        require_positive(carrier=carrier)
        if self.bandwidth > WIDEST * carrier:
            raise ParameterError(
                "bandwidth",
                f"expected at most {WIDEST:.0%} of the carrier frequency, {WIDEST * carrier / 1e6:g} MHz, found "
                f"{self.bandwidth / 1e6:g} MHz",
            )
        return carrier + (np.arange(self.subcarriers) - self.carrier) * self.spacing


def stated_band(bandwidth: float | str | None, subcarriers: int | None) -> Band | None:
    if bandwidth is None and subcarriers is None:
        return None
    if bandwidth is None:
        raise ParameterError("subcarriers", f"expected a bandwidth beside it, found {subcarriers} subcarriers alone")
    if subcarriers is None:
        raise ParameterError("subcarriers", "expected their number beside the bandwidth, found none")
    return Band(read_bandwidth(bandwidth), subcarriers)


def delay_spread(responses: Complex[np.ndarray, "K elements subcarriers"], bandwidth: float) -> Float[np.ndarray, " K"]:
    """Root mean square delay spread of each row's power over the delays, seconds, no finer than 1 / bandwidth."""
    power = np.square(np.abs(np.fft.ifft(responses, axis=-1))).sum(axis=1)
    count = power.shape[1]
    # Delays are counted from the strongest one, since they are only known up to a multiple of the whole period.
    steps = (np.arange(count) + count // 2) % count - count // 2
    from_strongest = (power.argmax(axis=1)[:, None] + np.arange(count)) % count
    around = np.take_along_axis(power, from_strongest, axis=1)
    whole = around.sum(axis=1, keepdims=True)
    share = around / np.where(whole > 0, whole, 1)
    mean = share @ steps
    return np.sqrt((share * np.square(steps - mean[:, None])).sum(axis=1)) / bandwidth


def chebyshev_points(first: float, last: float, count: int) -> Float[np.ndarray, " count"]:
    """The points between two frequencies from which polynomials interpolate best, rising, Hz."""
    return (first + last) / 2 - (last - first) / 2 * np.cos(np.pi * (np.arange(count) + 0.5) / count)


def enough_frequencies(
    frequencies: Float[np.ndarray, " subcarriers"], delay: float, more: int
) -> Float[np.ndarray, " n"]:
    """The subcarriers, or fewer frequencies that tell as much: delays over T turn at most BT times in a band B."""
    count = math.ceil(np.pi / 2 * np.ptp(frequencies) * delay) + more
    return chebyshev_points(frequencies[0], frequencies[-1], count) if count < len(frequencies) else frequencies


def interpolated(
    at: Float[np.ndarray, " n"],
    values: Complex[np.ndarray, "*batch n"],
    frequencies: Float[np.ndarray, " subcarriers"],
    delay: float,
) -> Complex[np.ndarray, "*batch subcarriers"]:
    """Responses at the frequencies of a band, from those at a few frequencies of it."""
    if np.array_equal(at, frequencies):
        return values
    from scipy.interpolate import barycentric_interpolate  # slow to import

    turned = values * np.exp(2j * np.pi * delay * at)
    weights = np.stack([barycentric_interpolate(at, each, frequencies) for each in np.eye(len(at))])
    return turned @ weights * np.exp(-2j * np.pi * delay * frequencies)
