"""The responses over a band, from paths that are solved at a few frequencies of the band.

A path of length L contributes a(f) e^{−j2πfL/c}. The exponential turns many times over a band, whereas the amplitude a
with its reflections and diffractions hardly changes. So each path is solved at a few frequencies f_n, and between them
f a is interpolated by polynomials (Lagrange), f a(f) = Σ_n ℓ_n(f) f_n a(f_n).
"""

from __future__ import annotations

import numba
import numpy as np
from jaxtyping import Complex, Float

from scenes.scene.description import SPEED_OF_LIGHT
from simulate.parallel import ONE_KERNEL
from simulate.parallel.compiled import compiled
from simulate.rays.core.solution import Solution
from simulate.spectra.band_interpolation import chebyshev_points

SHARES = 0.03, 0.08
"""Bandwidths, as shares of the carrier, up to which amplitudes are interpolated between two and between three
frequencies. In wider bands there are five."""


def solved_frequencies(frequencies: Float[np.ndarray, " subcarriers"]) -> Float[np.ndarray, " n"]:
    """The frequencies at which paths are solved for a band: Chebyshev's points, Hz.

    >>> solved_frequencies(np.linspace(905e6, 925e6, 9)).round(-5).tolist()
    [907900000.0, 922100000.0]
    """
    first, last = frequencies[0], frequencies[-1]
    share = (last - first) / ((first + last) / 2)
    return chebyshev_points(first, last, (2, 3, 5)[int(np.searchsorted(SHARES, share))])


class BandSum:
    """Adds up paths to responses at all subcarriers.

    Args:
        frequencies: frequencies of the subcarriers, evenly spaced, Hz.
        targets: number of targets.
        sources: number of sources.

    Attributes:
        solved: the frequencies at which paths must be solved, Hz.
        total: the sum of the paths so far.
    """

    total: Complex[np.ndarray, "targets sources subcarriers"]

    def __init__(self, frequencies: Float[np.ndarray, " subcarriers"], targets: int, sources: int):
        self.solved = solved_frequencies(frequencies)
        self.total = np.zeros((targets, sources, len(frequencies)), np.complex128)
        self._first, self._step = float(frequencies[0]), float(frequencies[1] - frequencies[0])
        # The factor λ/4π of the amplitudes needs no interpolation.
        self._weights = np.stack(
            [_lagrange(self.solved, n, frequencies) * each / frequencies for n, each in enumerate(self.solved)], axis=1
        )

    def add(self, solution: Solution) -> None:
        """Add paths that have been solved at the frequencies ``solved``."""
        delays = solution.travelled / SPEED_OF_LIGHT
        responses = np.stack([paths.responses for paths in solution.paths])
        # Whole turns are taken out, or the phase would lose digits.
        amplitudes = responses * np.exp(2j * np.pi * (self.solved[:, None] * delays % 1))
        targets, sources = solution.paths[0].targets, solution.paths[0].sources
        if not len(targets):
            return
        begins = np.flatnonzero(np.diff(targets, prepend=-1))  # the paths are ordered by target
        bounds = np.append(begins, len(targets))
        with ONE_KERNEL:
            _add(  # type: ignore[call-arg]
                bounds, targets, sources, delays, amplitudes, self._weights, self._first, self._step, self.total
            )


def _lagrange(points: Float[np.ndarray, " n"], which: int, at: Float[np.ndarray, " m"]) -> Float[np.ndarray, " m"]:
    """The polynomial that is 1 at one of the points and 0 at the others."""
    others = np.delete(points, which)
    return np.prod((at[:, None] - others) / (points[which] - others), axis=1)


@compiled(parallel=True)
def _add(bounds, targets, sources, delays, amplitudes, weights, first, step, total):
    """Add paths to ``total`` [targets, sources, subcarriers]; ``bounds`` separate the paths of different targets."""
    for block in numba.prange(len(bounds) - 1):
        for path in range(bounds[block], bounds[block + 1]):
            row = total[targets[path], sources[path]]
            begin, turn = -2 * np.pi * (first * delays[path] % 1), -2 * np.pi * step * delays[path]
            phase, turned = complex(np.cos(begin), np.sin(begin)), complex(np.cos(turn), np.sin(turn))
            for subcarrier in range(len(row)):
                amplitude = 0j
                for n in range(len(amplitudes)):
                    amplitude += weights[subcarrier, n] * amplitudes[n, path]
                row[subcarrier] += amplitude * phase
                phase *= turned
