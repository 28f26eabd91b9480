"""The terms of responses, one for each path: what it touches, and how its length changes when things move a little.

A response is y = Σ a e^{−jkL} over paths of length L. Where an end of a path, or a surface or an edge that it touches,
moves by a small δ, its length changes to first order by δ·(u − u′), with the unit vectors u and u′ of the wave before
and behind that point. The point's own movement along the surface or the edge changes nothing, since the length of a
path is stationary there (Fermat). The amplitude a changes little within a fraction of a wavelength.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Int

STRAIGHT = -1
"""In place of an object: nothing turns the wave here."""


class Interaction(IntEnum):
    """What happens to a wave on its way; the numbers are those of Sionna RT's ``InteractionType``."""

    NONE = 0
    REFLECTION = 1
    SCATTERING = 2
    TRANSMISSION = 4
    DIFFRACTION = 8


class Terms(NamedTuple):
    """Paths between elements and transmitters, with what each contributes.

    Attributes:
        targets: index of each path's transmitter.
        sources: index of its element.
        responses: a e^{−jkL}.
        vertices: element, interactions, transmitter; metres, world frame. A path with fewer interactions than others
            has its last vertex several times.
        objects: index of the object of each interaction, ``STRAIGHT`` where the wave passes through or there is none.
        kinds: the ``Interaction`` at each vertex between the ends, ``NONE`` after the path's last one. What a path with
            diffraction or diffuse reflection passes through is not among them.
    """

    targets: Int[np.ndarray, " paths"]
    sources: Int[np.ndarray, " paths"]
    responses: Complex[np.ndarray, " paths"]
    vertices: Float[np.ndarray, "paths n+2 3"]
    objects: Int[np.ndarray, "paths n"]
    kinds: Int[np.ndarray, "paths n"]

    def lengths(self) -> Float[np.ndarray, " paths"]:
        """Length of each path, metres."""
        return np.linalg.norm(np.diff(self.vertices, axis=1), axis=-1).sum(axis=1)

    def length_derivatives(self) -> tuple[Float[np.ndarray, "paths 3"], Float[np.ndarray, "paths n 3"]]:
        """Derivatives of each path's length.

        Returns:
            By the position of its element, and by that of the object at each interaction; zero where the wave goes
            straight on.
        """
        steps = np.diff(self.vertices, axis=1)
        size = np.linalg.norm(steps, axis=-1, keepdims=True)
        units = np.divide(steps, size, out=np.zeros_like(steps), where=size > 1e-9)
        return -units[:, 0], (units[:, :-1] - units[:, 1:]) * (self.objects != STRAIGHT)[..., None]
