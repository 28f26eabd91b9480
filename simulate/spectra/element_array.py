"""An array of elements at given positions, in metres, and the array of a gateway, whichever kind it is."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any

import numpy as np
from jaxtyping import Float

from scenes.files.errors import InputError, ParameterError, require_positive, require_whole
from scenes.scene.antennas import (
    FARTHEST_ELEMENT,
    MOST_ELEMENTS,
    MOST_IN_A_ROW,
    WIDEST_SPACING,
    Gateway,
    as_positions,
    fault_of,
)
from scenes.scene.description import SPEED_OF_LIGHT
from scenes.scene.frequency import read_frequency
from scenes.scene.orientation import Vector3
from simulate.spectra.array import STRAIGHT, Array, PlanarArray

SPACING_DIGITS = 9  # Decimals of a spacing that is found from positions, wavelengths

DIGITS = 12  # Decimals of the positions of ``ElementArray.circle``, metres


@dataclass(frozen=True)
class ElementArray(Array):
    """An array of elements at given positions: a circle, an oblique line, or any other shape.

    The positions are in metres, so the array stays the same at another frequency, whereas a ``PlanarArray`` stays the
    same in wavelengths. They are relative to the gateway's position, which need not be their centre. The order of the
    elements is that of the responses.

    Attributes:
        positions_m: position x, y, z of each element, metres, gateway frame, [elements, 3]; 1 to 1024 elements, each
            at a place of its own, at most 100 m from the gateway along each axis. Any array-like is accepted.
        frequency: carrier frequency, Hz, or a text such as "915 MHz". ``write_dataset`` and datasets give the array
            their own. None: not known yet; then there are no positions in wavelengths.

    Raises:
        ParameterError: the positions are not as described, or the frequency is not from 1 MHz to 1 THz.

    Example:
        Eight elements on a circle of 16 cm:

        >>> import bisplat, numpy as np
        >>> array = bisplat.ElementArray.circle(8, radius_m=0.16).at("915 MHz")
        >>> array.in_words
        '8 elements at given positions, 0.98 λ across'
        >>> array.manifold(np.radians(200.0), np.radians(40.0)).shape
        (8,)

        Three elements on an oblique line, which tells only the angle to this line:

        >>> line = bisplat.ElementArray([[0, 0, 0], [0.1, 0, 0.1], [0.2, 0, 0.2]])
        >>> line.is_line, line.axis.round(3).tolist()
        (True, [0.707, 0.0, 0.707])
    """

    positions_m: tuple[Vector3, ...]
    frequency: float | str | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "positions_m", as_positions("positions_m", self.positions_m))
        fault = fault_of(self.positions_m)
        if fault is not None:
            raise ParameterError("positions_m", fault)
        if self.frequency is not None:
            object.__setattr__(self, "frequency", read_frequency(self.frequency))

    @classmethod
    def circle(cls, elements: int, radius_m: float) -> ElementArray:
        """Elements at equal distances on a circle in the gateway's x–y plane.

        Element m is at the azimuth 360° m / elements.

        Args:
            elements: number of elements, 1 to 1024.
            radius_m: radius of the circle, metres, above 0 and at most 100.

        Returns:
            The array, without a frequency.

        Raises:
            ParameterError: the number or the radius is out of its range.

        Example:
            >>> import bisplat
            >>> bisplat.ElementArray.circle(4, radius_m=0.1).positions_m[1]
            (0.0, 0.1, 0.0)
        """
        require_whole(1, MOST_ELEMENTS, elements=elements)
        require_positive(radius_m=radius_m)
        if radius_m > FARTHEST_ELEMENT:
            raise ParameterError("radius_m", f"expected at most {FARTHEST_ELEMENT:g} metres, found {radius_m:g}")
        azimuth = 2 * np.pi * np.arange(elements) / elements
        circle = radius_m * np.stack([np.cos(azimuth), np.sin(azimuth), 0 * azimuth], axis=1)
        return cls(as_positions("elements", circle.round(DIGITS)))

    @property
    def elements(self) -> int:
        return len(self.positions_m)

    @cached_property
    def positions(self) -> Float[np.ndarray, "elements 3"]:
        """Position d_m of each element, wavelengths, gateway frame, [elements, 3].

        Raises:
            ParameterError: the array has no frequency.

        Example:
            >>> import bisplat
            >>> array = bisplat.ElementArray([[0, 0, 0], [0.15, 0, 0]])
            >>> array.at(1e9).positions.round(3).tolist()
            [[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]]
        """
        if self.frequency is None:
            raise ParameterError(
                "frequency", "expected the frequency of the ElementArray, which turns its metres into wavelengths, "
                "found none; array.at(frequency) states it"
            )  # fmt: skip
        return np.array(self.positions_m) * (float(self.frequency) / SPEED_OF_LIGHT)

    @property
    def _places(self) -> Float[np.ndarray, "elements 3"]:
        return np.array(self.positions_m)

    @property
    def in_words(self) -> str:
        """The array, for a sentence.

        >>> ElementArray(((0.0, 0.0, 0.0), (0.15, 0.0, 0.0)), 915e6).in_words
        '2 elements at given positions, 0.46 λ across'
        """
        if self.elements == 1:
            return "1 element at a given position"
        count, rows = f"{self.elements} elements at given positions", self._places
        across = max(float(np.linalg.norm(rows - each, axis=1).max()) for each in rows)
        if self.frequency is None:
            return f"{count}, {across:.3g} m across"
        return f"{count}, {across * float(self.frequency) / SPEED_OF_LIGHT:.2f} λ across"

    def at(self, frequency: float | str) -> ElementArray:
        """The same array, in metres, at a carrier frequency.

        Args:
            frequency: Hz, or a text with a unit such as "2.4 GHz".

        Raises:
            ParameterError: the frequency is not from 1 MHz to 1 THz.

        Example:
            >>> import bisplat
            >>> bisplat.ElementArray.circle(8, radius_m=0.16).at("2.4 GHz").frequency
            2400000000.0
        """
        return replace(self, frequency=read_frequency(frequency))

    def stated(self) -> dict[str, Any]:
        return {"positions_m": [list(each) for each in self.positions_m]}

    def of_gateway(self) -> dict[str, Any]:
        return {"elements": self.positions_m}


def array_of(gateway: Gateway, frequency: float) -> Array:
    """The array of a gateway: a ``PlanarArray``, or an ``ElementArray`` if its element positions are given."""
    if gateway.elements is None:
        return PlanarArray.of(gateway)
    return ElementArray(gateway.elements, frequency)


def array_kind(stated: object) -> type[Array]:
    """The class of an array as metadata.json or config.json states it."""
    return ElementArray if isinstance(stated, dict) and "positions_m" in stated else PlanarArray


@cache
def uniform(array: Array) -> PlanarArray | None:
    """The uniform planar array that an array is, to a thousandth of the spacing, or None."""
    if isinstance(array, PlanarArray):
        return array
    places = array.positions - array.positions.mean(axis=0)
    if len(places) == 1:
        return PlanarArray(1, 1)
    spacing = round(float(np.linalg.norm(places[1] - places[0])), SPACING_DIGITS)
    for rows in range(1, min(len(places), MOST_IN_A_ROW) + 1):
        columns = len(places) // rows
        if rows * columns == len(places) and columns <= MOST_IN_A_ROW and 0 < spacing <= WIDEST_SPACING:
            planar = PlanarArray(rows, columns, spacing)
            if np.abs(planar.positions - places).max() <= STRAIGHT * spacing:
                return planar
    return None


def require_planar(array: Array, what: str) -> PlanarArray:
    planar = uniform(array)
    if planar is not None:
        return planar
    raise InputError(f"{what}: expected a uniform planar array, found {array.in_words}")
