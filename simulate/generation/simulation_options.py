"""The options of a simulation. This module imports little, so that the command line shows its help quickly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from jaxtyping import Float
from tyro.conf import arg

from scenes.files.errors import ParameterError, require_whole, shown
from scenes.scene.frequency import read_frequency
from simulate.dataset.dataset_kinds import Moving
from simulate.positions.positions import NO_FILE, Places
from simulate.spectra.band import Band, stated_band
from simulate.spectra.measurement import Measurement

LEAST_TRANSMITTERS = 2
"""Fewest places of the transmitter if both ends move. If it has one, the receiver alone moves."""

MOST_TRANSMITTERS = 100
"""Most places of the transmitter if both ends move. Each has chains of its own, which are kept in memory."""


@dataclass(frozen=True)
class Simulation(Places):
    """What a simulated dataset of spectra holds, whatever the engine, with the options of ``Places``.

    Attributes:
        n: number of transmitter positions to draw.
        measurement: errors that the receiver adds.
        power_db: also write the absolute power of each spectrum in dB, to power_db/NNNNN.tif.
        bandwidth: also write the responses at subcarriers over this bandwidth around the carrier: hertz, or a text with
            a unit such as "20 MHz". The pictures are those of the carrier.
        subcarriers: number of these subcarriers.
        frequencies: simulate every position at each of these frequencies, one after the other; freq.txt lists them. The
            array keeps its size in metres. Hertz, or texts with a unit. Empty: the frequency of the scene.
        moving: what moves. transmitter: the array stands at the gateway's position. receiver: the array moves in the
            region, with the gateway's orientation, and the transmitter stands at the gateway's position. both: the
            array moves so, and the transmitter is at one of several places in the region.
        transmitters: if both ends move, number of places of the transmitter to draw. Each serves as many spectra as the
            others, in random order, and takes one search for paths.
        receivers: if both ends move, CSV file of the array's places, a row for each of the transmitter's in the file of
            positions. In Python also an array.

    Raises:
        ParameterError: as ``Places``; or one of ``bandwidth`` and ``subcarriers`` is out of its range or lacks the
            other, ``frequencies`` are not different frequencies, or ``transmitters`` or ``receivers`` are given or
            missing where the rest says otherwise.
    """

    n: Annotated[int, arg(name="spectra", aliases=["-n"])] = 6000
    measurement: Measurement = Measurement()
    power_db: bool = False
    bandwidth: float | str | None = None
    subcarriers: int | None = None
    frequencies: tuple[float | str, ...] = ()
    moving: Moving = "transmitter"
    transmitters: int | None = None
    receivers: Annotated[
        Float[np.ndarray, "K 3"] | str | Path | None, arg(constructor=Path, metavar="PATH", help_behavior_hint=NO_FILE)
    ] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        _ = self.band, self.hertz
        self._require_pairs()
        if self.band is not None and self.frequencies:
            raise ParameterError("bandwidth", "expected no band beside several frequencies, found one")

    def _require_pairs(self) -> None:
        drawn, both = self.positions is None, self.moving == "both"
        for name, given in (("transmitters", self.transmitters), ("receivers", self.receivers)):
            if given is not None and not both:
                found = f"found some beside moving {self.moving}"
                raise ParameterError(name, f"expected none unless both ends move, {found}")
        if self.transmitters is not None:
            if not drawn:
                raise ParameterError("transmitters", "expected none beside positions, which are theirs, found some")
            require_whole(LEAST_TRANSMITTERS, min(self.n, MOST_TRANSMITTERS), transmitters=self.transmitters)
        elif both and drawn:
            wrong = "expected how many places the transmitter has, since both ends move, found none"
            raise ParameterError("transmitters", wrong)
        if self.receivers is not None and drawn:
            raise ParameterError("receivers", "expected positions of the transmitter beside them, found none")
        if self.receivers is None and both and not drawn:
            wrong = "expected the array's places beside the transmitters' positions, found none"
            raise ParameterError("receivers", wrong)

    @property
    def hertz(self) -> tuple[float, ...]:
        """The frequencies, Hz, rising."""
        if not isinstance(self.frequencies, Sequence) or isinstance(self.frequencies, str):
            raise ParameterError("frequencies", f"expected a list of frequencies, found {shown(self.frequencies)}")
        try:
            found = tuple(sorted(read_frequency(each) for each in self.frequencies))
        except ParameterError as error:
            raise ParameterError("frequencies", error.message) from None
        if len(set(found)) < len(found):
            raise ParameterError("frequencies", f"expected different frequencies, found {shown(self.frequencies)}")
        return found

    @property
    def band(self) -> Band | None:
        """The subcarriers; None if only the carrier is simulated."""
        return stated_band(self.bandwidth, self.subcarriers)
