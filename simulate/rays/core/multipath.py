"""The multipath components of responses, and how their lengths change when things move a little.

A response is y = Σ a e^{−jkL} over paths of length L. An end of a path, or a surface or edge that it touches, may move
by a small δ. To first order, the length then changes by δ·(u − u′), with the unit vectors u and u′ of the wave before
and behind that point. The point also slides along the surface or edge, but this changes nothing, since the length of a
path is stationary there (Fermat). The amplitude a changes little over a fraction of a wavelength.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from enum import IntEnum
from typing import NamedTuple

import numba
import numpy as np
from jaxtyping import Complex, Float, Int

from simulate.parallel.compiled import ONE_KERNEL, compiled

STRAIGHT = -1  # Stands for no object: nothing changes the direction of the wave here


class Interaction(IntEnum):
    """What happens to a wave on its way. The numbers are those of Sionna RT's ``InteractionType``."""

    NONE = 0
    REFLECTION = 1
    SCATTERING = 2
    TRANSMISSION = 4
    DIFFRACTION = 8


class Paths(NamedTuple):
    """The contribution of each path."""

    targets: Int[np.ndarray, " paths"]  # index of each path's target
    sources: Int[np.ndarray, " paths"]  # index of each path's source
    # a e^{−j2πfτ}, complex128. The amplitude a contains the free-space factor λ/4π. So the sum y of all paths gives
    # the channel gain ``|y|²``.
    responses: Complex[np.ndarray, " paths"]

    def add_to(self, total: Complex[np.ndarray, "targets sources"]) -> None:
        """Add every path to the response between its target and its source, one after another."""
        np.add.at(total, (self.targets, self.sources), self.responses)


class Multipath(NamedTuple):
    """Paths between elements and transmitters, with the contribution of each."""

    targets: Int[np.ndarray, " paths"]  # index of each path's transmitter
    sources: Int[np.ndarray, " paths"]  # index of each path's element
    responses: Complex[np.ndarray, " paths"]  # a e^{−jkL}
    # element, interactions, transmitter, metres, world frame; paths with fewer interactions repeat the last vertex
    vertices: Float[np.ndarray, "paths n+2 3"]
    # index of the object of each interaction; ``STRAIGHT`` for a transmission, or if there is none
    objects: Int[np.ndarray, "paths n"]
    # the ``Interaction`` at each vertex between the ends, ``NONE`` after the last one. Transmissions are left out,
    # unless ``with_transmissions`` found them.
    kinds: Int[np.ndarray, "paths n"]

    def lengths(self) -> Float[np.ndarray, " paths"]:
        """Length of each path, metres."""
        return np.linalg.norm(np.diff(self.vertices, axis=1), axis=-1).sum(axis=1)

    def length_derivatives(self) -> tuple[Float[np.ndarray, "paths 3"], Float[np.ndarray, "paths n 3"]]:
        """Derivatives of each path's length by the place of its element, and by that of each interaction's object."""
        steps = np.diff(self.vertices, axis=1)
        size = np.linalg.norm(steps, axis=-1, keepdims=True)
        units = np.divide(steps, size, out=np.zeros_like(steps), where=size > 1e-9)
        return -units[:, 0], (units[:, :-1] - units[:, 1:]) * (self.objects != STRAIGHT)[..., None]


class TracedPath(NamedTuple):
    """A path between an element of the gateway and a transmitter.

    Attributes:
        vertices: the element, the points of interaction and the transmitter; metres, world frame, [vertices, 3].
        response: complex contribution a e^{−j2πfτ} of the path to the element's response.
    """

    vertices: Float[np.ndarray, "vertices 3"]
    response: complex


def strongest_first(batches: Iterable[Multipath]) -> list[TracedPath]:
    """The single paths of some batches, strongest first, without the vertices that paths repeat."""
    found = []
    for batch in batches:
        for vertices, response in zip(batch.vertices, batch.responses, strict=True):
            moved = np.append(True, (np.diff(vertices, axis=0) != 0).any(axis=1))
            found.append(TracedPath(vertices[moved], response))
    return sorted(found, key=lambda path: -abs(path.response))


Course = tuple[Float[np.ndarray, "paths n+2 3"], Int[np.ndarray, "paths n"], Int[np.ndarray, "paths n"]]
"""Where paths run: ``vertices``, ``objects`` and ``kinds`` of ``Multipath``."""


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

    def multipath(self) -> Multipath:
        """The paths of ``arriving`` with their vertices."""
        kept = self.amplitudes[0] != 0
        return Multipath(*(each[kept] for each in (*self.paths[0], *self.course())))


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
