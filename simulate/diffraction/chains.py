"""Chains with one diffraction: an arm from the source to an edge, and an arm from there to the target.

Objects that a path passes through straight are not part of the chain; they are found when the path is solved.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Int

from simulate.diffraction.arms import Arms


@dataclass(frozen=True)
class DiffractedChains:
    """Pairs of arms that meet at an edge.

    Attributes:
        near: the arms from the sources.
        far: the arms from the targets.
        pairs: index of each chain's near arm and far arm, in lexical order.
    """

    near: Arms
    far: Arms
    pairs: Int[np.ndarray, "chains 2"]

    def __len__(self) -> int:
        return len(self.pairs)

    def subset(self, index: Int[np.ndarray, " k"] | Bool[np.ndarray, " chains"]) -> DiffractedChains:
        """The chains at these indices, or those of a mask, with the arms that they need."""
        near, near_index = np.unique(self.pairs[index, 0], return_inverse=True)
        far, far_index = np.unique(self.pairs[index, 1], return_inverse=True)
        return DiffractedChains(self.near.subset(near), self.far.subset(far), np.column_stack([near_index, far_index]))

    @property
    def shapes(self) -> Int[np.ndarray, "chains 2"]:
        """Number of reflections before and after each chain's edge."""
        return np.column_stack([self.near.reflections[self.pairs[:, 0]], self.far.reflections[self.pairs[:, 1]]])


def chains_of(near: Arms, far: Arms, most_reflections: int) -> DiffractedChains:
    """All pairs of arms at the same edge with so many reflections at most.

    Args:
        near: arms from the sources.
        far: arms from the targets.
        most_reflections: before and after the edge together.
    """
    found = []
    for edge in np.intersect1d(near.edges, far.edges):
        a, b = np.nonzero(near.edges == edge)[0], np.nonzero(far.edges == edge)[0]
        found.append(np.stack(np.meshgrid(a, b, indexing="ij"), axis=-1).reshape(-1, 2))
    pairs = np.concatenate([np.zeros((0, 2), np.int64), *found])
    total = near.reflections[pairs[:, 0]] + far.reflections[pairs[:, 1]]
    pairs = pairs[total <= most_reflections]
    return DiffractedChains(near, far, pairs[np.lexsort(pairs.T[::-1])])
