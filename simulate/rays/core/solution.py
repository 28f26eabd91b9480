"""Batches of paths that the ray tracer has solved, in its own arrays."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Int

from simulate.rays.core.multipath import Multipath, Paths
from simulate.rays.core.ray_tracer import dr, mi

Course = tuple[Float[np.ndarray, "paths n+2 3"], Int[np.ndarray, "paths n"], Int[np.ndarray, "paths n"]]
"""Where paths run: ``vertices``, ``objects`` and ``kinds`` of ``Multipath``."""

Amplitude = tuple[mi.Float64, mi.Float64]
"""Real and imaginary part of the amplitude of each path, not computed yet."""


class Solution(NamedTuple):
    """A batch of paths. The paths of one target do not depend on the other targets."""

    chain: Int[np.ndarray, " paths"]  # index of each path's chain
    targets: Int[np.ndarray, " paths"]  # index of each path's target
    sources: Int[np.ndarray, " paths"]  # index of each path's source
    travelled: mi.Float64  # length of each path, metres
    # amplitude a of each path with each of several sets of materials, or at several frequencies, 0 if the path is
    # blocked. Its contribution to the response is a e^{−j2πfτ}.
    parts: Sequence[Amplitude]
    wavelengths: Sequence[float]  # that of each of these sets, metres
    course: Callable[[], Course]  # computes where the paths run

    @property
    def amplitudes(self) -> list[Complex[np.ndarray, " paths"]]:
        """The amplitudes, with each set of materials."""
        dr.eval(self.parts, self.travelled)
        return [_complex(*each) for each in self.parts]

    @property
    def paths(self) -> list[Paths]:
        """The contributions of the paths, with each set of materials."""
        responses = []
        for (real, imaginary), wavelength in zip(self.parts, self.wavelengths, strict=True):
            turns = self.travelled / dr.opaque(mi.Float64, wavelength)
            # Whole turns are taken out, or the phase would lose digits.
            sine, cosine = dr.sincos(-2 * dr.pi * (turns - dr.floor(turns)))
            responses.append((real * cosine - imaginary * sine, real * sine + imaginary * cosine))
        dr.eval(responses)
        return [Paths(self.targets, self.sources, _complex(*each)) for each in responses]

    def arriving(self) -> tuple[Int[np.ndarray, " arriving"], Paths]:
        """The chains and the paths, with the first set of materials, without blocked ones."""
        paths = self.paths[0]
        kept = np.flatnonzero(paths.responses)
        return self.chain[kept], Paths(*(each[kept] for each in paths))

    def multipath(self) -> Multipath:
        """The paths of ``arriving`` with their vertices."""
        paths = self.paths[0]
        kept = np.flatnonzero(paths.responses)
        return Multipath(*(each[kept] for each in (*paths, *self.course())))


def _complex(real: mi.Float64, imaginary: mi.Float64) -> Complex[np.ndarray, " paths"]:
    found = np.empty(dr.width(real), np.complex128)
    found.real, found.imag = real.numpy(), imaginary.numpy()
    return found


def largest_shares(
    solutions: Iterable[Solution], chains: int, others: Float[np.ndarray, "targets sources"]
) -> Float[np.ndarray, " chains"]:
    """The largest share of the power between two antennas that each chain carries."""
    whole, found = others.copy(), []
    for solution in solutions:
        chain, paths = solution.arriving()
        power = np.abs(paths.responses) ** 2
        np.add.at(whole, (paths.targets, paths.sources), power)
        found.append((chain, paths, power))
    result = np.zeros(chains)
    for chain, paths, power in found:
        np.maximum.at(result, chain, power / np.maximum(whole[paths.targets, paths.sources], 1e-30))
    return result
