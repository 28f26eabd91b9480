"""How to read what other programs wrote: the options of ``bisplat dataset``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from scenes.files.errors import ParameterError, require_within
from scenes.scene.frequency import read_frequency
from simulate.dataset.dataset_kinds import Moving, Phases


@dataclass(frozen=True)
class Conversion:
    """How to read the pictures. Most folders need none of these options.

    Attributes:
        flip_elevation: turn the pictures upside down. None: only if an array then explains them better.
        elevations: elevations of the first and last row above the array plane, degrees. 90 rows are kept and these
            angles stated; others are sampled.
        azimuths: azimuths of the first and last column, degrees. The pictures are sampled at 0° to 359°.
        one_per_position: number of the picture to keep at each position, from 1. None: keep all.
        frequency: frequency of the pictures, hertz, or such as "3.5 GHz". If freq.txt lists several, only the pictures
            of this one are kept.
        quantity: what the grey levels stand for. None: magnitude, unless only power or decibels of an array explain
            them.
        decibels: range from black to white, for pictures in decibels. None: the range of each picture that an array
            explains.
        moving: what moves. receiver: tx_pos.csv holds the places of the array, as in SwiftWRF's own data. both: it
            holds those of the transmitter, and rx_pos.csv those of the array. None: what metadata.json says; without
            it, the transmitter.
    """

    flip_elevation: bool | None = None
    elevations: tuple[float, float] | None = None
    azimuths: tuple[float, float] | None = None
    one_per_position: int | None = None
    frequency: str | None = None
    quantity: Literal["magnitude", "power", "decibels"] | None = None
    decibels: float | None = None
    moving: Moving | None = None


def require_valid(conversion: Conversion) -> None:
    for name, ends in (("elevations", conversion.elevations), ("azimuths", conversion.azimuths)):
        for end in ends or ():
            require_within(-360, 360, "angles in degrees", **{name: end})
        if ends is not None and ends[0] == ends[1]:
            raise ParameterError(name, f"expected two different angles, found {ends[0]:g} twice")
        if ends is not None and abs(ends[1] - ends[0]) > 360:
            raise ParameterError(name, f"expected at most one turn of 360°, found {ends[0]:g} to {ends[1]:g}")
    if conversion.flip_elevation and conversion.elevations is not None:
        raise ParameterError("flip_elevation", "expected no --elevations beside it, since they state the order of rows")
    if conversion.frequency is not None:
        read_frequency(conversion.frequency)
    if conversion.decibels is not None:
        require_within(1, 200, "a range in dB", decibels=conversion.decibels)
        if conversion.quantity != "decibels":
            raise ParameterError("decibels", "expected --quantity decibels beside it")


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
