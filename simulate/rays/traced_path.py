"""A single path as a user sees it, to draw its course or its delay."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from simulate.rays.core.terms import Terms


class TracedPath(NamedTuple):
    """A path between an element of the gateway and a transmitter.

    Attributes:
        vertices: the element, the points of interaction and the transmitter; metres, world frame, [vertices, 3].
        response: complex contribution a e^{−j2πfτ} of the path to the element's response.
    """

    vertices: Float[np.ndarray, "vertices 3"]
    response: complex


def strongest_first(batches: Iterable[Terms]) -> list[TracedPath]:
    """The single paths of some batches, strongest first, without the vertices that paths repeat."""
    found = []
    for batch in batches:
        for vertices, response in zip(batch.vertices, batch.responses, strict=True):
            moved = np.append(True, (np.diff(vertices, axis=0) != 0).any(axis=1))
            found.append(TracedPath(vertices[moved], response))
    return sorted(found, key=lambda path: -abs(path.response))
