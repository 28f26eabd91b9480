"""The two ends of a link: the gateway with its array, and the transmitter that moves in a region."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from scenes.files.errors import ParameterError, check_array, shown
from scenes.files.options import check_kinds
from scenes.scene.orientation import Quaternion, Vector3, boresight_of, unit_quaternion

PATTERNS = ("iso", "dipole", "hw_dipole", "tr38901")
POLARIZATIONS = ("V", "H")
MOST_IN_A_ROW = 64  # Most rows or columns of an array; it has at most ``MOST_ELEMENTS`` elements
WIDEST_SPACING = 100.0  # Largest spacing of the elements of an array, wavelengths
BOTH_ARRAYS = "expected either the positions of the elements or rows, columns and spacing, found both"


def _vector(parameter: str, given: Sequence[float]) -> Vector3:
    x, y, z = check_array(parameter, given, (3,), "a position x, y, z", finite=False).tolist()
    return x, y, z


@dataclass(frozen=True)
class Gateway:
    """The receiver: a uniform planar array, or elements at given places, at a fixed position.

    In the gateway frame, the array lies in the x–y plane. It is centred on the origin, and its boresight is +z. Element
    m = row · columns + column, counted from 0, is at::

        d_m = spacing · λ · (column − (columns − 1)/2, row − (rows − 1)/2, 0),

    so the column varies fastest. The polarisation "V" is along the gateway's +y axis and "H" along its +x axis. A
    gateway on a wall therefore has its +y axis up, as ``facing`` arranges it and as NeRF² [zhao2023] has it.

    The constructor scales a quaternion of nearly unit length to length 1 and checks nothing else. ``simulate``,
    ``load_scene``, ``write_scene`` and ``import_scene`` check the values.

    Attributes:
        position: centre of the array, metres, world frame.
        orientation: unit quaternion (x, y, z, w) that rotates the gateway frame into the world frame, as in SciPy's
            ``Rotation.from_quat``.
        rows: number of elements along y, 1 to 64.
        columns: number of elements along x, 1 to 64; rows × columns is at most 1024.
        spacing: distance between neighbouring elements, wavelengths, above 0 and at most 100.
        pattern: antenna pattern of each element: "iso", "dipole" (short dipole), "hw_dipole" (half-wave dipole) or
            "tr38901" (3GPP TR 38.901).
        polarization: "V" or "H". A dipole lies along this axis. The field of other patterns has, for "V", the direction
            θ̂ of the spherical angles around +y, and φ̂ for "H".
        elements: position x, y, z of each element, metres, gateway frame, instead of rows, columns and spacing. They
            stay the same at another frequency. ``ElementArray`` states the limits. None: the array is planar.

    Raises:
        ParameterError: both ``elements`` and rows, columns or spacing are given, or an argument has another shape.

    Example:
        >>> import bisplat
        >>> gateway = bisplat.Gateway(position=(0, 0, 1.5), orientation=bisplat.facing((-1, 0, 0)), rows=2)
        >>> gateway.count, gateway.boresight.round(6).tolist()
        (8, [-1.0, 0.0, 0.0])
        >>> circle = bisplat.ElementArray.circle(8, radius_m=0.16)
        >>> bisplat.Gateway((0, 0, 1.5), bisplat.facing((-1, 0, 0)), elements=circle.positions_m).count
        8
    """

    position: Vector3
    orientation: Quaternion
    rows: int = 4
    columns: int = 4
    spacing: float = 0.5
    pattern: str = "iso"
    polarization: str = "V"
    elements: tuple[Vector3, ...] | None = None

    def __post_init__(self) -> None:
        check_kinds(self)
        object.__setattr__(self, "position", _vector("position", self.position))
        object.__setattr__(self, "orientation", unit_quaternion(self.orientation))
        object.__setattr__(self, "spacing", float(self.spacing))
        if self.elements is not None:
            object.__setattr__(self, "elements", as_positions("elements", self.elements))
            if (self.rows, self.columns, self.spacing) != (Gateway.rows, Gateway.columns, Gateway.spacing):
                raise ParameterError("elements", BOTH_ARRAYS)

    def __repr__(self) -> str:
        """The arguments that state it.

        The digest of a scene is made from it, so that of a planar array stays as it was before there were others.
        """
        return f"Gateway({', '.join(f'{name}={value!r}' for name, value in stated(self).items())})"

    @property
    def count(self) -> int:
        """Number of elements."""
        return self.rows * self.columns if self.elements is None else len(self.elements)

    @property
    def array_in_words(self) -> str:
        """The array, for a sentence or a title.

        >>> Gateway((0, 0, 1), (0, 0, 0, 1)).array_in_words
        '4 × 4 elements 0.5 wavelengths apart'
        """
        if self.elements is None:
            return f"{self.rows} × {self.columns} elements {self.spacing:g} wavelengths apart"
        return f"{self.count} element{'s' * (self.count > 1)} at given positions"

    @property
    def boresight(self) -> Float[np.ndarray, " 3"]:
        """Direction that the gateway looks in, as a unit vector [3] in the world frame."""
        return boresight_of(self.orientation)


@dataclass(frozen=True)
class Transmitter:
    """The moving transmitter: one antenna and the region it moves in.

    The region is a box whose edges are parallel to the axes of the world frame. The antenna's frame is that of Sionna
    RT [hoydis2023]: the polarisation "V" is along its +z axis, which is world +z unless ``orientation`` turns it, and
    "H" is along its +y axis.

    Attributes:
        region_min: corner of the region with the lowest coordinates, metres, world frame.
        region_max: corner of the region with the highest coordinates, metres, world frame.
        pattern: antenna pattern: "iso", "dipole" (short dipole), "hw_dipole" (half-wave dipole) or "tr38901" (3GPP
            TR 38.901).
        polarization: "V" or "H". A dipole lies along this axis. The field of other patterns has, for "V", the direction
            θ̂ of the spherical angles around +z, and φ̂ for "H".
        orientation: unit quaternion (x, y, z, w) that rotates the transmitter frame into the world frame. It is the
            same at every position.

    Example:
        >>> import bisplat
        >>> transmitter = bisplat.Transmitter(region_min=(-4, -1, 0.5), region_max=(-2, 1, 2))
        >>> transmitter.region.tolist()
        [[-4.0, -1.0, 0.5], [-2.0, 1.0, 2.0]]
        >>> transmitter.corners().shape
        (8, 3)
    """

    region_min: Vector3
    region_max: Vector3
    pattern: str = "iso"
    polarization: str = "V"
    orientation: Quaternion = (0.0, 0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        for corner in ("region_min", "region_max"):
            object.__setattr__(self, corner, _vector(corner, getattr(self, corner)))
        object.__setattr__(self, "orientation", unit_quaternion(self.orientation))

    @property
    def region(self) -> Float[np.ndarray, "2 3"]:
        """Lowest and highest corner of the region, [2, 3], metres, world frame."""
        return np.array([self.region_min, self.region_max])

    def corners(self) -> Float[np.ndarray, "8 3"]:
        """Return the eight corners of the region.

        Returns:
            The corners, [8, 3], metres, world frame. The z coordinate varies fastest.
        """
        axes = zip(self.region_min, self.region_max, strict=True)
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(8, 3)


def stated(antenna: Gateway | Transmitter) -> dict[str, Any]:
    """The keys of an antenna in a file. A gateway has either elements or rows, columns and spacing."""
    keys = {each.name: getattr(antenna, each.name) for each in fields(antenna)}
    if isinstance(antenna, Transmitter):
        return {"region": {"min": keys.pop("region_min"), "max": keys.pop("region_max")}, **keys}
    for key in ("elements",) if antenna.elements is None else ("rows", "columns", "spacing"):
        del keys[key]
    return keys


PATTERN = re.compile(r"(\d{1,4})[x×X](\d{1,4})(?:@(\d{1,9}(?:\.\d{1,9})?|\.\d{1,9}))?")


def read_array(text: str) -> tuple[int, int, float | None]:
    """Read the number of elements of a planar array, and their spacing."""
    match = PATTERN.fullmatch(text) if isinstance(text, str) else None
    if match is None:
        expected = "expected ROWSxCOLUMNS or ROWSxCOLUMNS@SPACING in wavelengths, such as 8x8 or 4x4@0.491"
        raise ParameterError("array", f"{expected}, found {shown(text)}")
    return int(match[1]), int(match[2]), float(match[3]) if match[3] else None


MOST_ELEMENTS = 1024  # Most elements of an array. Memory grows with the elements, or with their square.

FARTHEST_ELEMENT = 100.0
"""Metres. Largest coordinate of an element in the gateway frame. An array of millimetres read as metres exceeds it."""

SAME_PLACE = 1e-6  # Metres. Two elements that are nearer to each other are at one place.

Positions = tuple[tuple[float, float, float], ...]
"""Positions x, y, z of elements, metres, gateway frame."""


def as_positions(parameter: str, given: ArrayLike) -> Positions:
    """Turn positions of elements from a user into tuples."""
    if isinstance(given, list | tuple) and not given:
        return ()  # which ``fault_of`` refuses
    rows = check_array(parameter, given, (None, 3), "rows of x, y, z of each element, metres", finite=False)
    return tuple((x, y, z) for x, y, z in (rows + 0.0).tolist())


def fault_of(positions: Positions) -> str | None:
    """What is wrong with the positions of an array's elements, "expected ..., found ..."; None: nothing."""
    if not 1 <= len(positions) <= MOST_ELEMENTS:
        return f"expected 1 to {MOST_ELEMENTS} elements, found {len(positions)}"
    rows = np.array(positions)
    bad = ~np.isfinite(rows).all(axis=1)
    if bad.any():
        first = int(bad.argmax())
        return f"expected finite positions, found element {first} at {rows[first].tolist()}"
    far = np.abs(rows).max(axis=1) > FARTHEST_ELEMENT
    if far.any():
        first = int(far.argmax())
        found = f"element {first} at {rows[first].tolist()}"
        return f"expected elements within ±{FARTHEST_ELEMENT:g} m of the gateway, found {found}; are they in metres?"
    pairs = cKDTree(rows).query_pairs(SAME_PLACE)
    if pairs:
        first, second = min(pairs)
        found = f"elements {first} and {second} at one place, {rows[first].tolist()}"
        return f"expected each element at a place of its own, found {found}"
    return None
