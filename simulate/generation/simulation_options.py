"""The options of a simulation. This module imports little, so that the command line shows its help quickly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

from tyro.conf import arg

from scenes.files.errors import ParameterError, shown
from scenes.scene.frequency import read_frequency
from simulate.dataset.moving import Moving
from simulate.positions.places import Places
from simulate.spectra.band import Band, stated_band
from simulate.spectra.measurement import Measurement


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
            region, with the gateway's orientation, and the transmitter stands at the gateway's position.

    Raises:
        ParameterError: as ``Places``; or one of ``bandwidth`` and ``subcarriers`` is out of its range or lacks the
            other, or ``frequencies`` are not different frequencies.
    """

    n: Annotated[int, arg(name="spectra", aliases=["-n"])] = 6000
    measurement: Measurement = Measurement()
    power_db: bool = False
    bandwidth: float | str | None = None
    subcarriers: int | None = None
    frequencies: tuple[float | str, ...] = ()
    moving: Moving = "transmitter"

    def __post_init__(self) -> None:
        super().__post_init__()
        _ = self.band, self.hertz
        if self.band is not None and self.frequencies:
            raise ParameterError("bandwidth", "expected no band beside several frequencies, found one")

    @property
    def hertz(self) -> tuple[float, ...]:
        """The frequencies, Hz, rising.

        Raises:
            ParameterError: as the class.
        """
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
        """The subcarriers; None if only the carrier is simulated.

        Raises:
            ParameterError: as the class.
        """
        return stated_band(self.bandwidth, self.subcarriers)
