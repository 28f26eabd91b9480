"""How to read the pictures of another program's folder: the options of ``bisplat convert``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from scenes.files.errors import ParameterError, require_within
from scenes.scene.frequency import read_frequency
from simulate.dataset.moving import Moving


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
    """Check the options before anything is read."""
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
