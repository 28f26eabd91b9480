"""Errors of a real receiver: gain and phase of its elements, drift of its phase, thermal noise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from jaxtyping import Complex, Float, Int
from tyro.conf import arg

from scenes.files.errors import check_array, require_seed, require_within
from scenes.files.options import check_kinds

# Every effect has its own stream of random numbers. Turning one effect on leaves the draws of the others unchanged.
# No stream is 0, since NumPy treats the seed [seed, 0, 0] like the bare seed, which draws the positions and the split.
GAIN_ERROR, PHASE_ERROR, PHASE_NOISE, THERMAL_NOISE = 1, 2, 3, 4


@dataclass(frozen=True)
class Measurement:
    """Errors that the receiver adds to the element responses, all off by default.

    Element m measures y′_m = g_m e^{jψ_m} e^{jε_m} y_m + n_m ([vantrees2002], chapter 2). The gain g_m and the phase
    ψ_m belong to the array and are the same in every spectrum. The phase ε_m and the noise n_m are drawn anew for each
    spectrum. All errors are Gaussian and independent from element to element.

    Attributes:
        snr_db: signal-to-noise ratio of an element, dB; no thermal noise if None. The signal is the mean power of the
            spectrum's ideal responses over the array.
        gain_error_db: standard deviation of an element's gain, 20 log10 g_m, dB; drawn once per array.
        phase_error_deg: standard deviation of an element's phase ψ_m, degrees; drawn once per array.
        phase_noise_deg: standard deviation of the phase ε_m, degrees; drawn for each element and each spectrum. It
            models a receiver that switches from element to element while its oscillator drifts.

    Raises:
        ParameterError: an SNR outside −200 to 200 dB, or a standard deviation outside 0 to 60 dB or 0 to 360 degrees.

    Example:
        >>> import bisplat
        >>> bisplat.Measurement().off, bisplat.Measurement(snr_db=20).off
        (True, False)
        >>> bisplat.Measurement(phase_error_deg=-1)
        Traceback (most recent call last):
        scenes.files.errors.ParameterError: phase_error_deg: expected a standard deviation in degrees from 0 to 360, ...
    """

    snr_db: Annotated[float | None, arg(aliases=["--snr"])] = None
    gain_error_db: Annotated[float, arg(aliases=["--gain-error"])] = 0.0
    phase_error_deg: Annotated[float, arg(aliases=["--phase-error"])] = 0.0
    phase_noise_deg: Annotated[float, arg(aliases=["--phase-noise"])] = 0.0

    def __post_init__(self) -> None:
        check_kinds(self)
        if self.snr_db is not None:
            require_within(-200, 200, "an SNR in dB", snr_db=self.snr_db)
        require_within(0, 60, "a standard deviation in dB", gain_error_db=self.gain_error_db)
        phases = {"phase_error_deg": self.phase_error_deg, "phase_noise_deg": self.phase_noise_deg}
        require_within(0, 360, "a standard deviation in degrees", **phases)

    @property
    def off(self) -> bool:
        """Whether all errors are off, so that the receiver is ideal."""
        return self.snr_db is None and not (self.gain_error_db or self.phase_error_deg or self.phase_noise_deg)

    def apply(
        self, responses: Complex[np.ndarray, "K elements *band"], numbers: Int[np.ndarray, " K"], seed: int
    ) -> Complex[np.ndarray, "K elements *band"]:
        """The responses as the receiver measures them: y′_m = g_m e^{jψ_m} e^{jε_m} y_m + n_m.

        The noise n_m is circular complex Gaussian. Its power at each element is the mean of ``|y_m|²`` over the array,
        divided by 10^(SNR/10). A spectrum whose ideal responses are all zero stays zero. Over a band the mean is also
        one over the subcarriers. The noise of each subcarrier is independent, and gains and phases are the same at all.

        Args:
            responses: ideal element responses y of K spectra, [K, elements], or over a band [K, elements, subcarriers].
            numbers: number of each spectrum in its dataset, from 0, [K]. The draws for a spectrum depend only on the
                seed and this number, so a dataset may be made in parts and in any order.
            seed: seed of the draws, a whole number from 0. One seed stands for one receiver.

        Returns:
            The measured responses, of the same shape and data type; the given array itself if all errors are off.

        Raises:
            ParameterError: an array has another shape or is not finite, or the seed is not valid.

        Example:
            The same spectrum gets the same errors, alone or among others:

            >>> import bisplat, numpy as np
            >>> y, drifting = np.ones((2, 16), complex), bisplat.Measurement(phase_noise_deg=10)
            >>> both = drifting.apply(y, np.array([3, 7]), seed=0)
            >>> second = drifting.apply(y[1:], np.array([7]), seed=0)
            >>> np.array_equal(both[1:], second)
            True
        """
        over_band = (None,) * (np.ndim(responses) == 3)
        check_array("responses", responses, (None, None, *over_band), "responses [K, elements]", "c")
        check_array("numbers", numbers, (len(responses),), "a number for each spectrum")
        require_seed(seed=seed)
        if self.off:
            return responses
        elements = responses.shape[1]
        gain = 10 ** (self.gain_error_db * _normal(seed, GAIN_ERROR, 0, elements) / 20)
        errors = gain * _phasor(self.phase_error_deg * _normal(seed, PHASE_ERROR, 0, elements))
        measured = responses.astype(complex)
        # One spectrum at a time, since a sum over a batch may be rounded differently from the sum of one spectrum.
        for y, number in zip(measured, numbers.tolist(), strict=True):
            power = np.mean(np.abs(y) ** 2)
            factors = errors * _phasor(self.phase_noise_deg * _normal(seed, PHASE_NOISE, number, elements))
            y *= factors.reshape(elements, *[1] * (y.ndim - 1))
            if self.snr_db is not None:
                real, imaginary = _normal(seed, THERMAL_NOISE, number, 2 * y.size).reshape(2, *y.shape)
                y += np.sqrt(power / 10 ** (self.snr_db / 10) / 2) * (real + 1j * imaginary)
        return measured.astype(responses.dtype)


def _normal(seed: int, stream: int, number: int, count: int) -> Float[np.ndarray, " count"]:
    """Standard normal numbers of one effect for one spectrum; number 0 for the errors that belong to the array."""
    return np.random.default_rng([seed, stream, number]).standard_normal(count)


def _phasor(degrees: Float[np.ndarray, " elements"]) -> Complex[np.ndarray, " elements"]:
    return np.exp(1j * np.radians(degrees))
