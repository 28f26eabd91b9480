"""Chains with diffractions: an arm from the source to an edge, perhaps a link to another edge, an arm to the target.

Objects that a path passes through are not part of the chain. They are found when the path is solved.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Int

from simulate.rays.diffraction.arms import Arms
from simulate.rays.diffraction.links import Links

NO_LINK = -1


@dataclass(frozen=True)
class DiffractedChains:
    """Pairs of arms that meet at an edge, or at the two edges of a link."""

    near: Arms  # the arms from the sources
    far: Arms  # the arms from the targets
    links: Links  # the links between edges
    pairs: Int[np.ndarray, "chains 2"]  # index of each chain's near arm and far arm
    link: Int[np.ndarray, " chains"]  # index of each chain's link, or ``NO_LINK``

    def __len__(self) -> int:
        return len(self.pairs)

    def subset(self, index: Int[np.ndarray, " k"] | Bool[np.ndarray, " chains"]) -> DiffractedChains:
        """The chains with these indices, or those that a mask selects, with the arms and links that they need."""
        near, near_index = np.unique(self.pairs[index, 0], return_inverse=True)
        far, far_index = np.unique(self.pairs[index, 1], return_inverse=True)
        link = self.link[index]
        linked, link_index = np.unique(link[link != NO_LINK], return_inverse=True)
        renumbered = np.full(len(link), NO_LINK)
        renumbered[link != NO_LINK] = link_index
        pairs = np.column_stack([near_index, far_index])
        return DiffractedChains(
            self.near.subset(near), self.far.subset(far), self.links.subset(linked), pairs, renumbered
        )

    @property
    def edges(self) -> Int[np.ndarray, "chains 2"]:
        """Indices of the two edges of each chain; without a link, one edge twice."""
        return np.column_stack([self.near.edges[self.pairs[:, 0]], self.far.edges[self.pairs[:, 1]]])

    @property
    def shapes(self) -> Int[np.ndarray, "chains 3"]:
        """Numbers of reflections before each chain's edges, of diffractions, and of reflections after its edges."""
        before, after = self.near.reflections[self.pairs[:, 0]], self.far.reflections[self.pairs[:, 1]]
        return np.column_stack([before, 1 + (self.link != NO_LINK), after])


def chains_of(near: Arms, far: Arms, links: Links, most_reflections: tuple[int, int]) -> DiffractedChains:
    """All chains up to a number of reflections: pairs of arms at an edge, then pairs at the ends of a link."""
    edges = np.intersect1d(near.edges, far.edges)
    once, _ = _pairs(near, far, np.column_stack([edges, edges]), most_reflections[0])
    twice, link = _pairs(near, far, links.edges, most_reflections[1])
    numbers = np.concatenate([np.full(len(once), NO_LINK), link])
    return DiffractedChains(near, far, links, np.concatenate([once, twice]), numbers)


def _pairs(
    near: Arms, far: Arms, edges: Int[np.ndarray, "n 2"], most_reflections: int
) -> tuple[Int[np.ndarray, "pairs 2"], Int[np.ndarray, " pairs"]]:
    """Pairs of arms at some pairs of edges, in lexical order, and the pair of edges that each belongs to."""
    found, where = [np.zeros((0, 2), np.int64)], [np.zeros(0, np.int64)]
    for number, (begin, end) in enumerate(edges):
        a, b = np.nonzero(near.edges == begin)[0], np.nonzero(far.edges == end)[0]
        pairs = np.stack(np.meshgrid(a, b, indexing="ij"), axis=-1).reshape(-1, 2)
        total = near.reflections[pairs[:, 0]] + far.reflections[pairs[:, 1]]
        found.append(pairs[total <= most_reflections])
        where.append(np.full(len(found[-1]), number))
    pairs, which = np.concatenate(found), np.concatenate(where)
    order = np.lexsort((which, pairs[:, 1], pairs[:, 0]))
    return pairs[order], which[order]
