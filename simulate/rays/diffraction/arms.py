"""Arms: the ways from an antenna to an edge, straight or with reflections."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Int


@dataclass(frozen=True)
class Arms:
    """Sequences of reflections between an antenna and an edge."""

    planes: Int[np.ndarray, "arms most"]  # planes of the reflections, from the antenna on; −1 after the last one
    edges: Int[np.ndarray, " arms"]  # index of each arm's edge

    def __len__(self) -> int:
        return len(self.edges)

    def subset(self, index: Int[np.ndarray, " k"] | Bool[np.ndarray, " arms"]) -> Arms:
        """The arms with these indices, or those that a mask selects."""
        return Arms(self.planes[index], self.edges[index])

    @property
    def reflections(self) -> Int[np.ndarray, " arms"]:
        """Number of reflections of each arm."""
        return (self.planes >= 0).sum(axis=1)
