"""How wrong the description of a scene may be. This module imports little, for the help of the command line."""

from __future__ import annotations

from dataclasses import dataclass

from scenes.files.errors import require_within


@dataclass(frozen=True)
class Tolerances:
    """Standard deviations of what a description may have wrong.

    Attributes:
        position: error of each coordinate of the gateway, metres.
        rotation: error of the gateway's orientation about each axis, degrees.
        objects: error of each horizontal coordinate of an object in the room, metres.
        materials: relative error of permittivity, conductivity and thickness.
        frequency: relative error of the carrier frequency; 0 if it is known.

    Raises:
        ParameterError: a number that is negative or absurdly large.

    >>> Tolerances(position=0.01, rotation=1)
    Tolerances(position=0.01, rotation=1, objects=0.03, materials=0.2, frequency=0.0)
    """

    position: float = 0.02
    rotation: float = 2.0
    objects: float = 0.03
    materials: float = 0.2
    frequency: float = 0.0

    def __post_init__(self) -> None:
        require_within(0, 10, "metres", position=self.position, objects=self.objects)
        require_within(0, 90, "degrees", rotation=self.rotation)
        require_within(0, 2, "a relative deviation", materials=self.materials, frequency=self.frequency)
