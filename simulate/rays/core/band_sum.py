"""The responses over a band, from paths that are solved at a few frequencies of the band.

A path of length L contributes a(f) e^{−j2πfL/c}. The exponential turns many times over a band, whereas the amplitude a
with its reflections and diffractions hardly changes. So each path is solved at a few frequencies f_n, and between them
f a is interpolated by polynomials (Lagrange), f a(f) = Σ_n ℓ_n(f) f_n a(f_n).
"""

from __future__ import annotations

import math

import numba
import numpy as np
from jaxtyping import Complex, Float

from scenes.scene.description import SPEED_OF_LIGHT
from simulate.parallel import ONE_KERNEL
from simulate.parallel.compiled import compiled
from simulate.rays.core.solution import Solution
from simulate.spectra.band import chebyshev_points

SHARES = 0.03, 0.08
"""Bandwidths, as shares of the carrier, up to which amplitudes are interpolated between two and between three
frequencies. In wider bands there are five."""


MORE, BEYOND = 14, 0.15
"""Number of frequencies of the sums beyond one for each turn of the longest path, and how far they lie beyond the band,
as a share of it. Both make the error of the interpolation negligible."""


def solved_frequencies(frequencies: Float[np.ndarray, " subcarriers"]) -> Float[np.ndarray, " n"]:
    """The frequencies at which paths are solved for a band: Chebyshev's points, Hz.

    >>> solved_frequencies(np.linspace(905e6, 925e6, 9)).round(-5).tolist()
    [907900000.0, 922100000.0]
    """
    first, last = frequencies[0], frequencies[-1]
    share = (last - first) / ((first + last) / 2)
    return chebyshev_points(first, last, (2, 3, 5)[int(np.searchsorted(SHARES, share))])


def _between(
    few: Float[np.ndarray, " m"], frequencies: Float[np.ndarray, " subcarriers"], longest: float
) -> Complex[np.ndarray, "m subcarriers"]:
    """The factors with which sums of paths at a few frequencies add up to those at the subcarriers.

    They are those that fit all delays up to the longest one best.
    """
    delays = np.linspace(0, longest, 8 * len(few))[:, None]
    known, wanted = (np.exp(-2j * np.pi * (each - few[0]) * delays) for each in (few, frequencies))
    return np.linalg.lstsq(known, wanted, rcond=1e-10)[0]


class BandSum:
    """Adds up paths to responses at all subcarriers.

    The sums are made at fewer frequencies if these tell those of all subcarriers, which depends on the longest path.
    """

    def __init__(self, frequencies: Float[np.ndarray, " subcarriers"], targets: int, sources: int, longest: float):
        self.solved = solved_frequencies(frequencies)
        delay, width = longest / SPEED_OF_LIGHT, float(frequencies[-1] - frequencies[0])
        count = math.ceil(width * delay) + MORE
        self._spread: Complex[np.ndarray, "m subcarriers"] | None = None
        if count < len(frequencies):
            few = np.linspace(frequencies[0] - BEYOND * width, frequencies[-1] + BEYOND * width, count)
            self._spread, frequencies = _between(few, frequencies, delay), few
        self._sums = np.zeros((targets, sources, len(frequencies)), np.complex128)
        self._first, self._step = float(frequencies[0]), float(frequencies[1] - frequencies[0])
        # The factor λ/4π of the amplitudes needs no interpolation.
        self._weights = np.stack(
            [_lagrange(self.solved, n, frequencies) * each / frequencies for n, each in enumerate(self.solved)], axis=1
        )

    @property
    def total(self) -> Complex[np.ndarray, "targets sources subcarriers"]:
        """The sum of the paths so far."""
        return self._sums if self._spread is None else self._sums @ self._spread

    def add(self, solution: Solution) -> None:
        """Add paths that have been solved at the frequencies ``solved``."""
        targets = solution.targets
        if not len(targets):
            return
        delays = solution.travelled / SPEED_OF_LIGHT
        begins = np.flatnonzero(np.diff(targets, prepend=-1))  # the paths are ordered by target
        bounds = np.append(begins, len(targets))
        with ONE_KERNEL:
            _add(  # type: ignore[call-arg]
                *(bounds, targets, solution.sources, delays, tuple(solution.amplitudes), self._weights),
                *(self._first, self._step, self._sums),
            )


def _lagrange(points: Float[np.ndarray, " n"], which: int, at: Float[np.ndarray, " m"]) -> Float[np.ndarray, " m"]:
    """The polynomial that is 1 at one of the points and 0 at the others."""
    others = np.delete(points, which)
    return np.prod((at[:, None] - others) / (points[which] - others), axis=1)


@compiled(inline="always")
def _phasor(turns):
    """e^{−j2πt}; whole turns are taken out, or the phase would lose digits."""
    angle = -2 * np.pi * (turns % 1)
    return complex(np.cos(angle), np.sin(angle))


@compiled(parallel=True)
def _add(bounds, targets, sources, delays, solved, weights, first, step, total):
    """Add paths of some solved amplitudes to ``total`` [targets, sources, subcarriers].

    ``bounds`` separate the paths of different targets.
    """
    for block in numba.prange(len(bounds) - 1):
        for path in range(bounds[block], bounds[block + 1]):
            if solved[0][path] == 0:  # something blocks it
                continue
            row = total[targets[path], sources[path]]
            phase, turned = _phasor(first * delays[path]), _phasor(step * delays[path])
            for subcarrier in range(len(row)):
                amplitude = 0j
                for n in range(len(solved)):
                    amplitude += weights[subcarrier, n] * solved[n][path]
                row[subcarrier] += amplitude * phase
                phase *= turned
