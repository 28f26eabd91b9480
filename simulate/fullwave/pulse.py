"""A pulse as the source of a run, and the running Fourier sums of the field that it causes.

A pulse gives the field of one frequency or of many in one run: with the current i(t) and the field E(t), the field of
a current of amplitude 1 is

    E(f) = Σ_n E(nqΔt) e^{−j2πf nqΔt} q / Σ_n i(nΔt) e^{−j2πf nΔt}.

The field is sampled every q time steps. The sampling rate is above the sum of the highest frequency that is wanted and
the pulse's highest one, so that no other frequency is taken for one that is wanted.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float, Float32

WIDTH = 0.12
"""Standard deviation of the pulse's spectrum, as a share of the carrier. It falls by 3 dB over a band of
20 %."""

REACH = 5.0
"""Standard deviations from the pulse's middle at which it begins and ends, and up to which its spectrum matters."""

BLOCK = 16  # Samples that are kept before they are added to the sums, by one product of matrices


@dataclass(frozen=True)
class Pulse:
    """An oscillation with a Gaussian envelope."""

    frequency: float  # carrier, hertz

    @property
    def deviation(self) -> float:
        """Standard deviation of the envelope, seconds."""
        return 1 / (2 * np.pi * WIDTH * self.frequency)

    @property
    def duration(self) -> float:
        """Time until the pulse has ended, seconds."""
        return 2 * REACH * self.deviation

    def current(self, times: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """The current, relative to its largest amplitude."""
        after = times - REACH * self.deviation
        envelope = np.exp(-np.square(after / self.deviation) / 2) * (np.abs(after) <= REACH * self.deviation)
        return envelope * np.cos(2 * np.pi * self.frequency * after)

    def level(self, frequency: float) -> float:
        """The pulse's spectrum at a frequency, relative to that at the carrier."""
        return math.exp(-(((frequency / self.frequency - 1) / WIDTH) ** 2) / 2)

    def samples_every(self, time_step: float, highest: float) -> int:
        """Number q of time steps between two samples of the field."""
        return max(1, math.floor(1 / (((1 + REACH * WIDTH) * self.frequency + highest) * time_step)))


class FourierSums:
    """Running Fourier sums of the fields of several sources, each of which is summed as if it were alone."""

    def __init__(self, frequencies: Float[np.ndarray, " F"], shape: tuple[int, int], time_step: float, every: int):
        sources, points = shape
        self._turn = 2 * np.pi * frequencies * time_step
        self._every = every
        self._sums = np.zeros((sources, 2 * len(frequencies), points), np.float32)
        self._samples = np.zeros((sources, BLOCK, points), np.float32)
        self._steps: list[int] = []

    def add(self, step: int, field: Float32[np.ndarray, "sources points"]) -> None:
        self._samples[:, len(self._steps)] = field
        self._steps.append(step)
        if len(self._steps) == BLOCK:
            self._flush()

    def _flush(self) -> None:
        angles = np.outer(self._turn, self._steps)
        factors = np.concatenate([np.cos(angles), -np.sin(angles)]).astype(np.float32)
        self._sums += factors @ self._samples[:, : len(self._steps)]
        self._steps = []

    def total(self) -> Complex[np.ndarray, "sources F points"]:
        """The sums, times q."""
        self._flush()
        real, imaginary = np.split(self._sums, 2, axis=1)
        return (self._every * (real + 1j * imaginary)).astype(np.complex64)


def spectrum(
    current: Float[np.ndarray, " steps"], frequencies: Float[np.ndarray, " F"], time_step: float
) -> Complex[np.ndarray, " F"]:
    """The sum Σ_n i e^{−j2πft_n} of a current at the middles of the time steps."""
    times = time_step * (np.arange(len(current)) + 0.5)
    return np.exp(-2j * np.pi * np.outer(frequencies, times)) @ current
