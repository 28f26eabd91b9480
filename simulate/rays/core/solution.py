"""The paths that solved chains give, from which a caller takes what it needs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numba
import numpy as np
from jaxtyping import Complex, Float, Int

from simulate.parallel import ONE_KERNEL
from simulate.parallel.compiled import compiled
from simulate.rays.core.terms import Paths, Terms


class Course(NamedTuple):
    """Where paths run. The attributes are those of ``Terms``."""

    vertices: Float[np.ndarray, "paths n+2 3"]
    objects: Int[np.ndarray, "paths n"]
    kinds: Int[np.ndarray, "paths n"]


class Solution(NamedTuple):
    """A batch of paths. The paths of one target do not depend on the other targets."""

    chain: Int[np.ndarray, " paths"]  # index of each path's chain
    targets: Int[np.ndarray, " paths"]  # index of each path's target
    sources: Int[np.ndarray, " paths"]  # index of each path's source
    travelled: Float[np.ndarray, " paths"]  # length of each path, metres
    # amplitude a of each path with each of several sets of materials, or at several frequencies, 0 if the path is
    # blocked. Its contribution to the response is a e^{−j2πfτ}.
    amplitudes: Sequence[Complex[np.ndarray, " paths"]]
    wavelengths: Sequence[float]  # that of each of these sets, metres
    course: Callable[[], Course]  # computes where the paths run

    @property
    def paths(self) -> list[Paths]:
        """The contributions of the paths, with each set of materials."""
        with ONE_KERNEL:
            responses = [
                _delayed(amplitudes, self.travelled, wavelength)  # type: ignore[call-arg]
                for amplitudes, wavelength in zip(self.amplitudes, self.wavelengths, strict=True)
            ]
        return [Paths(self.targets, self.sources, each) for each in responses]

    def arriving(self) -> tuple[Int[np.ndarray, " arriving"], Paths]:
        """The chains and the paths, with the first set of materials, without blocked ones."""
        kept = self.amplitudes[0] != 0
        return self.chain[kept], Paths(*(each[kept] for each in self.paths[0]))

    def terms(self) -> Terms:
        """The paths of ``arriving`` with their vertices."""
        kept = self.amplitudes[0] != 0
        return Terms(*(each[kept] for each in (*self.paths[0], *self.course())))


@compiled(parallel=True)
def _delayed(amplitudes, travelled, wavelength):
    """a e^{−j2πL/λ}; whole turns are taken out, or the phase would lose digits."""
    responses = np.empty(len(amplitudes), np.complex128)
    for path in numba.prange(len(amplitudes)):
        angle = -2 * np.pi * (travelled[path] / wavelength % 1)
        responses[path] = amplitudes[path] * complex(np.cos(angle), np.sin(angle))
    return responses


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
