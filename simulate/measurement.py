"""What a real receiver adds to the ideal element responses: errors of its elements, drift while it measures, noise.

    y'_m = g_m e^{jψ_m} e^{jε_m} y_m + n_m

The errors of gain and phase belong to the array and are the same in every spectrum; ε and n are drawn anew for each.
How such errors act on a beamformer: Van Trees, Optimum Array Processing (Wiley, 2002), chapter 2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float, Int

from scenes.errors import InputError

# Every effect has its own stream of random numbers: turning one on leaves what the others draw as it was. None is 0,
# since NumPy seeds [seed, 0, 0] like the bare seed, from which the positions and the split are drawn.
GAIN_ERROR, PHASE_ERROR, PHASE_NOISE, THERMAL_NOISE = 1, 2, 3, 4


@dataclass(frozen=True)
class Measurement:
    """Imperfections of the receiver, all off by default.

    Attributes:
        snr_db: thermal noise: the mean of |y_m|² over the array, of that spectrum's ideal responses, over the noise
            power of an element, dB. None: no noise.
        gain_error_db: standard deviation of an element's gain, 20 log10 g_m, dB; drawn once per array.
        phase_error_deg: standard deviation of an element's phase ψ_m, degrees; drawn once per array.
        phase_noise_deg: standard deviation of a phase ε_m drawn for each element and each spectrum, degrees: an array
            that is switched through its elements one after another while the oscillator drifts.
        seed: what all of it is drawn from.
    """

    snr_db: float | None = None
    gain_error_db: float = 0.0
    phase_error_deg: float = 0.0
    phase_noise_deg: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        if self.snr_db is not None and not math.isfinite(self.snr_db):
            raise InputError(f"--snr: expected a finite number of dB, found {self.snr_db}")
        for option, deviation, unit in (
            ("gain-error", self.gain_error_db, "dB"),
            ("phase-error", self.phase_error_deg, "degrees"),
            ("phase-noise", self.phase_noise_deg, "degrees"),
        ):
            if not (math.isfinite(deviation) and deviation >= 0):
                raise InputError(f"--{option}: expected a standard deviation of 0 {unit} or more, found {deviation}")
        if self.seed < 0:
            raise InputError(f"--seed: expected a number of 0 or more, found {self.seed}")

    @property
    def off(self) -> bool:
        """Whether the receiver is ideal."""
        return self.snr_db is None and not (self.gain_error_db or self.phase_error_deg or self.phase_noise_deg)

    def apply(
        self, responses: Complex[np.ndarray, "K elements"], numbers: Int[np.ndarray, " K"]
    ) -> Complex[np.ndarray, "K elements"]:
        """Responses as the receiver measures them: y'_m = g_m e^{jψ_m} e^{jε_m} y_m + n_m.

        n_m is circular complex Gaussian of power E|n_m|² = (Σ_m |y_m|² / MN) / 10^(SNR/10), independent from element
        to element. A spectrum that receives nothing stays zero.

        Args:
            responses: ideal responses y.
            numbers: each spectrum's number in its dataset. With the seed it alone decides what is drawn for the
                spectrum: a dataset made in parts, in any order, is the same dataset.

        >>> y, drifting = np.ones((2, 16), complex), Measurement(phase_noise_deg=10)
        >>> np.array_equal(drifting.apply(y, np.array([3, 7]))[1:], drifting.apply(y[1:], np.array([7])))
        True
        """
        if self.off:
            return responses
        elements = responses.shape[1]
        gain = 10 ** (self.gain_error_db * self._normal(GAIN_ERROR, 0, elements) / 20)
        errors = gain * _turn(self.phase_error_deg * self._normal(PHASE_ERROR, 0, elements))
        measured = responses.astype(complex)
        # One by one: sums of a whole batch may be rounded otherwise than those of a single spectrum.
        for y, number in zip(measured, numbers.tolist(), strict=True):
            power = np.mean(np.abs(y) ** 2)
            y *= errors * _turn(self.phase_noise_deg * self._normal(PHASE_NOISE, number, elements))
            if self.snr_db is not None:
                real, imaginary = self._normal(THERMAL_NOISE, number, 2 * elements).reshape(2, elements)
                y += np.sqrt(power / 10 ** (self.snr_db / 10) / 2) * (real + 1j * imaginary)
        return measured.astype(responses.dtype)

    def _normal(self, stream: int, number: int, count: int) -> Float[np.ndarray, " count"]:
        """Standard normal numbers of one effect for one spectrum (0 for what belongs to the array)."""
        return np.random.default_rng([self.seed, stream, number]).standard_normal(count)


def _turn(degrees: Float[np.ndarray, " elements"]) -> Complex[np.ndarray, " elements"]:
    return np.exp(1j * np.radians(degrees))
