"""Where the positions of a simulation come from: its options. This module imports little, as the help must."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from jaxtyping import Float
from tyro.conf import arg

from scenes.files.errors import require_seed, require_whole
from scenes.files.options import check_kinds
from simulate.positions.given_positions import MOST_POSITIONS

LEAST_POSITIONS = 2
"""Fewest positions of a dataset: one to train on and one to test on."""

NO_FILE = "(default: None)"
"""What the help says of a file that need not be given. The help of tyro would say ['None'], for its constructor."""


@dataclass(frozen=True)
class Places:
    """The positions of a simulated dataset.

    Attributes:
        n: number of transmitter positions to draw.
        placement: how positions are drawn. uniform: at random; grid: evenly; path: along a smooth curve.
        positions: CSV file of positions to use instead (header x,y,z; metres, world frame). In Python also an array.
        seed: seed of the positions, the split, the rays and the receiver's errors or the shadowing.

    Raises:
        ParameterError: ``n`` is no whole number from ``LEAST_POSITIONS`` to ``MOST_POSITIONS``, the seed is not valid,
            or ``placement`` is no placement.
    """

    n: Annotated[int, arg(name="number", aliases=["-n"])] = 6000
    placement: Literal["uniform", "grid", "path"] = "uniform"
    positions: Annotated[
        Float[np.ndarray, "K 3"] | str | Path | None, arg(constructor=Path, metavar="PATH", help_behavior_hint=NO_FILE)
    ] = None
    seed: int = 0

    def __post_init__(self) -> None:
        check_kinds(self)
        require_whole(LEAST_POSITIONS, MOST_POSITIONS, n=self.n)
        require_seed(seed=self.seed)
