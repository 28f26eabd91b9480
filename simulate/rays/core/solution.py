"""The paths that solved chains give, from which a caller takes what it needs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from simulate.rays.core.terms import Paths, Terms


class Course(NamedTuple):
    """Where paths run. The attributes are those of ``Terms``."""

    vertices: Float[np.ndarray, "paths n+2 3"]
    objects: Int[np.ndarray, "paths n"]
    kinds: Int[np.ndarray, "paths n"]


class Solution(NamedTuple):
    """A batch of paths. The paths of one target do not depend on the other targets.

    Attributes:
        chain: index of each path's chain.
        paths: the same paths with each of several sets of materials, or at several frequencies. A blocked path has the
            response 0.
        course: computes where the paths run.
        travelled: length of each path, metres.
    """

    chain: Int[np.ndarray, " paths"]
    paths: Sequence[Paths]
    course: Callable[[], Course]
    travelled: Float[np.ndarray, " paths"]

    def arriving(self) -> tuple[Int[np.ndarray, " arriving"], Paths]:
        """The chains and the paths, with the first set of materials, without blocked ones."""
        kept = self.paths[0].responses != 0
        return self.chain[kept], Paths(*(each[kept] for each in self.paths[0]))

    def terms(self) -> Terms:
        """The paths of ``arriving`` with their vertices."""
        kept = self.paths[0].responses != 0
        return Terms(*(each[kept] for each in (*self.paths[0], *self.course())))


def largest_shares(
    solutions: Iterable[Solution], chains: int, others: Float[np.ndarray, "targets sources"]
) -> Float[np.ndarray, " chains"]:
    """The largest share of the power between two antennas that each chain carries.

    Args:
        solutions: the paths of the chains.
        chains: number of chains.
        others: power between the antennas on paths of other chains.
    """
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
