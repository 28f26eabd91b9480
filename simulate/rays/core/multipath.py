"""The multipath components of responses, and how their lengths change when things move a little.

A response is y = Σ a e^{−jkL} over paths of length L. An end of a path, or a surface or edge that it touches, may move
by a small δ. To first order, the length then changes by δ·(u − u′), with the unit vectors u and u′ of the wave before
and behind that point. The point also slides along the surface or edge, but this changes nothing, since the length of a
path is stationary there (Fermat). The amplitude a changes little over a fraction of a wavelength.
"""

from __future__ import annotations

from collections.abc import Iterable
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Int

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
        place = self.targets * total.shape[1] + self.sources
        sums = (np.bincount(place, part, total.size) for part in (self.responses.real, self.responses.imag))
        total.real += next(sums).reshape(total.shape)
        total.imag += next(sums).reshape(total.shape)


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
