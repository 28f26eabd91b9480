"""Errors of a real receiver: gain and phase of its elements, drift of its phase while it measures, thermal noise.

    y'_m = g_m e^{jψ_m} e^{jε_m} y_m + n_m

The errors g_m and ψ_m belong to the array and are the same in every spectrum; ε_m and n_m are drawn for each spectrum.
How such errors act on a beamformer: [vantrees2002], chapter 2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from jaxtyping import Complex, Float, Int
from tyro.conf import arg

from scenes.files.errors import require_within

# Every effect has its own stream of random numbers, so that turning one on leaves the draws of the others unchanged.
# No stream is 0: NumPy seeds [seed, 0, 0] like the bare seed, from which the positions and the split are drawn.
GAIN_ERROR, PHASE_ERROR, PHASE_NOISE, THERMAL_NOISE = 1, 2, 3, 4


@dataclass(frozen=True)
class Measurement:
    """Errors of the receiver, all off by default.

    Attributes:
        snr_db: ratio of the mean signal power to the noise power of an element, dB. None: no thermal noise.
        gain_error_db: standard deviation of the elements' gains 20 log10 g_m, dB, drawn once per array.
        phase_error_deg: standard deviation of the elements' phases ψ_m, degrees, drawn once per array.
        phase_noise_deg: standard deviation of the phases ε_m, degrees, drawn for each element and each spectrum. They
            arise if the oscillator drifts while the receiver switches through the elements.

    Raises:
        ParameterError: an SNR outside ±200 dB, or a standard deviation outside 0 to 60 dB or 0 to 360 degrees.

    >>> Measurement().off
    True
    >>> Measurement(phase_error_deg=float("nan"))
    Traceback (most recent call last):
    scenes.files.errors.ParameterError: phase_error_deg: expected a standard deviation in degrees from 0 to 360, ...
    """

    snr_db: Annotated[float | None, arg(aliases=["--snr"])] = None
    gain_error_db: Annotated[float, arg(aliases=["--gain-error"])] = 0.0
    phase_error_deg: Annotated[float, arg(aliases=["--phase-error"])] = 0.0
    phase_noise_deg: Annotated[float, arg(aliases=["--phase-noise"])] = 0.0

    def __post_init__(self) -> None:
        if self.snr_db is not None:
            require_within(-200, 200, "an SNR in dB", snr_db=self.snr_db)
        require_within(0, 60, "a standard deviation in dB", gain_error_db=self.gain_error_db)
        phases = {"phase_error_deg": self.phase_error_deg, "phase_noise_deg": self.phase_noise_deg}
        require_within(0, 360, "a standard deviation in degrees", **phases)

    @property
    def off(self) -> bool:
        """Whether the receiver is ideal."""
        return self.snr_db is None and not (self.gain_error_db or self.phase_error_deg or self.phase_noise_deg)

    def apply(
        self, responses: Complex[np.ndarray, "K elements"], numbers: Int[np.ndarray, " K"], seed: int
    ) -> Complex[np.ndarray, "K elements"]:
        """Responses as the receiver measures them: y'_m = g_m e^{jψ_m} e^{jε_m} y_m + n_m.

        n_m is circular complex Gaussian of power E|n_m|² = (Σ_m |y_m|² / MN) / 10^(SNR/10), independent from element
        to element. A spectrum whose ideal responses are all zero stays zero.

        Args:
            responses: ideal responses y.
            numbers: each spectrum's number in its dataset. The seed and the number alone decide what is drawn for the
                spectrum, so a dataset made in parts, in any order, is the same dataset.
            seed: seed of the draws, 0 or more; one seed stands for one receiver.

        Returns:
            The measured responses, of the type of the ideal ones; the ideal ones themselves where all errors are off.

        >>> y, drifting = np.ones((2, 16), complex), Measurement(phase_noise_deg=10)
        >>> both, second = drifting.apply(y, np.array([3, 7]), seed=0), drifting.apply(y[1:], np.array([7]), seed=0)
        >>> np.array_equal(both[1:], second)
        True
        """
        if self.off:
            return responses
        elements = responses.shape[1]
        gain = 10 ** (self.gain_error_db * _normal(seed, GAIN_ERROR, 0, elements) / 20)
        errors = gain * _phasor(self.phase_error_deg * _normal(seed, PHASE_ERROR, 0, elements))
        measured = responses.astype(complex)
        # One spectrum after another: a sum over a whole batch may be rounded differently from that of one spectrum.
        for y, number in zip(measured, numbers.tolist(), strict=True):
            power = np.mean(np.abs(y) ** 2)
            y *= errors * _phasor(self.phase_noise_deg * _normal(seed, PHASE_NOISE, number, elements))
            if self.snr_db is not None:
                real, imaginary = _normal(seed, THERMAL_NOISE, number, 2 * elements).reshape(2, elements)
                y += np.sqrt(power / 10 ** (self.snr_db / 10) / 2) * (real + 1j * imaginary)
        return measured.astype(responses.dtype)


def _normal(seed: int, stream: int, number: int, count: int) -> Float[np.ndarray, " count"]:
    """Standard normal numbers of one effect for one spectrum (number 0 for the errors that belong to the array)."""
    return np.random.default_rng([seed, stream, number]).standard_normal(count)


def _phasor(degrees: Float[np.ndarray, " elements"]) -> Complex[np.ndarray, " elements"]:
    return np.exp(1j * np.radians(degrees))
