"""The paths that solved chains give, from which a caller takes what it needs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
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
        paths: the same paths with each of several sets of materials. A blocked path has the response 0.
        course: computes where the paths run.
    """

    chain: Int[np.ndarray, " paths"]
    paths: Sequence[Paths]
    course: Callable[[], Course]

    def arriving(self) -> tuple[Int[np.ndarray, " arriving"], Paths]:
        """The chains and the paths, with the first set of materials, without blocked ones."""
        kept = self.paths[0].responses != 0
        return self.chain[kept], Paths(*(each[kept] for each in self.paths[0]))

    def terms(self) -> Terms:
        """The paths of ``arriving`` with their vertices."""
        kept = self.paths[0].responses != 0
        return Terms(*(each[kept] for each in (*self.paths[0], *self.course())))
