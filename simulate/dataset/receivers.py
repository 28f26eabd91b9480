"""The receivers of a dataset: one array, or antennas of one element each."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from simulate.spectra.identification import Identification


@dataclass(frozen=True)
class ArrayReceiver:
    """A gateway with an array, which measures spectra and element responses."""

    position: Float[np.ndarray, 3]  # where the gateway stands, metres, world frame
    orientation: Float[np.ndarray, 4]  # unit quaternion (x, y, z, w) that turns the gateway frame into the world frame
    identification: Identification = field(default_factory=Identification)  # array and grid, and how they are known
    moving: Float[np.ndarray, "K 3"] | None = None  # the middle of the array for each row, if both ends move, metres


@dataclass(frozen=True)
class Antennas:
    """Antennas of one element each: gateways that measure powers, or a base station that measures channels."""

    names: list[str]
    positions: Float[np.ndarray, "G 3"]  # metres, world frame
