"""How to read a recording of another program: the options of ``bisplat dataset``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from simulate.dataset.moving import Moving
from simulate.dataset.phases import Phases

Unit = Literal["m", "cm", "mm", "in", "ft"]


@dataclass(frozen=True)
class Recording:
    """How to read a recording. Most files need none of these options.

    Attributes:
        positions: name of the array with the positions (default: the one with a usual name or shape).
        responses: name of the array with the element responses (default: likewise).
        unit: unit of the positions (default: metres, unless the names of their columns state another one).
        columns_first: elements are numbered along y first, then along x (default: as transmitters in sight tell).
        conjugate: the phase rises with the distance (default: as transmitters in sight tell).
        phases: common: phases of different positions can be compared. per-position: each position has an unknown phase
            of its own.
        round_trip: the responses are those of a tag that the same antenna reads, so they are squares of the one-way
            field. Their roots are taken.
        bandwidth: the responses are those of subcarriers over this bandwidth, such as "20 MHz", in rising order of the
            frequency (default: they are those of the carrier).
        moving: what is at the positions. receiver: the middle of the array, while the transmitter stands at the
            gateway's position. both: the transmitter, while the array is at the receivers' positions.
        receivers: name of the array with the receivers' positions if both ends move, in the unit of the others
            (default: the one with a usual name).
    """

    positions: str | None = None
    responses: str | None = None
    unit: Unit | None = None
    columns_first: bool | None = None
    conjugate: bool | None = None
    phases: Phases = "common"
    round_trip: bool = False
    bandwidth: str | None = None
    moving: Moving = "transmitter"
    receivers: str | None = None
