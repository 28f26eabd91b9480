"""Tolerances of a scene's description. The command line's help needs this module, so it imports little."""

from __future__ import annotations

from dataclasses import dataclass

from scenes.files.errors import require_within
from scenes.files.options import check_kinds


@dataclass(frozen=True)
class Tolerances:
    """Standard deviations of the errors in a scene's description.

    ``calibrate`` assumes that the errors are independent and Gaussian. A value with a tolerance of 0 is assumed to be
    right and does not change.

    Attributes:
        position: standard deviation of each coordinate of the gateway, metres, 0 to 10.
        rotation: standard deviation of the gateway's rotation about each axis, degrees, 0 to 90.
        objects: standard deviation of each horizontal coordinate of an object inside the room, metres, 0 to 10.
        materials: relative standard deviation of each material's permittivity, conductivity and thickness, 0 to 2.
        carrier: relative standard deviation of the carrier frequency, 0 to 2; 0 if it is known.

    Raises:
        ParameterError: a number is outside its range.
    """

    position: float = 0.02
    rotation: float = 2.0
    objects: float = 0.03
    materials: float = 0.2
    carrier: float = 0.0

    def __post_init__(self) -> None:
        check_kinds(self)
        require_within(0, 10, "metres", position=self.position, objects=self.objects)
        require_within(0, 90, "degrees", rotation=self.rotation)
        require_within(0, 2, "a relative deviation", materials=self.materials, carrier=self.carrier)
