"""The gateway's array: what every array offers, and the uniform planar array. Lengths are in wavelengths, so k = 2π."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Annotated, Any

import numpy as np
from jaxtyping import Complex, Float
from msgspec import Meta

from scenes.files.errors import ParameterError, check_array, require_positive, require_whole, require_within
from scenes.files.options import check_kinds
from scenes.scene.antennas import MOST_ELEMENTS, MOST_IN_A_ROW, WIDEST_SPACING, Gateway
from scenes.scene.frequency import read_frequency
from simulate.spectra.angular_grid import direction

STRAIGHT = 1e-3
"""Elements lie on a line, or in a plane, if none is farther from it than this part of the array's size."""

LEAST_ELEMENTS = 3  # With fewer elements than this, scores of spectra mean nothing


@dataclass(frozen=True)
class Array:
    """What every array of a gateway offers: its elements, their positions, and the responses to plane waves."""

    @property
    @abstractmethod
    def elements(self) -> int:
        """Number of elements."""

    @property
    @abstractmethod
    def positions(self) -> Float[np.ndarray, "elements 3"]:
        """Position d_m of each element, wavelengths, gateway frame, [elements, 3]."""

    @property
    def _places(self) -> Float[np.ndarray, "elements 3"]:
        """Positions in any unit. They tell the shape of the array."""
        return self.positions

    @cached_property
    def _shape(self) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, "3 3"]]:
        """How far the elements reach along each principal axis, relative to the longest, and the axes (rows)."""
        centred = self._places - self._places.mean(axis=0)
        axes = np.linalg.svd(centred, full_matrices=len(centred) < 3)[2]
        reach = np.ptp(centred @ axes.T, axis=0)
        return reach / max(reach.max(), 1e-12), axes

    @cached_property
    def axis(self) -> Float[np.ndarray, " 3"] | None:
        """Unit vector along the array if its elements lie on a line, gateway frame; None: they do not."""
        if self.elements == 1 or np.sort(self._shape[0])[-2] > STRAIGHT:
            return None
        along = self._places[-1] - self._places[0]
        return along / np.linalg.norm(along)

    @cached_property
    def mirror(self) -> Float[np.ndarray, " 3"] | None:
        """Normal of the plane of the elements, a unit vector, gateway frame, if the array confuses the two sides of it.

        None: the elements do not lie in a plane, they lie on a line, or the plane is the gateway's x–y plane, of which
        the grid has one side only.
        """
        reach, axes = self._shape
        if self.elements < 3 or self.is_line or reach.min() > STRAIGHT:
            return None
        normal = axes[int(reach.argmin())]
        return None if np.hypot(normal[0], normal[1]) < STRAIGHT else normal

    @property
    @abstractmethod
    def in_words(self) -> str:
        """The array, for a sentence."""

    @property
    def is_line(self) -> bool:
        """Whether the elements lie on a line, so that the array tells only the angle to this line."""
        return self.axis is not None

    @property
    def cannot_tell(self) -> str | None:
        """A clause on the directions that the array cannot tell apart; None: it tells all of the grid apart."""
        if self.is_line:
            return "its elements lie on a line, so it tells only the angle to this line, and not on which side of it"
        if self.mirror is not None:
            return (
                "its elements lie in a plane that cuts the half-space in front, so it does not tell the two sides apart"
            )
        return None

    @abstractmethod
    def at(self, frequency: float | str) -> Array:
        """The same array at a carrier frequency, Hz. Lengths in wavelengths stay as they are, and so do metres."""

    @abstractmethod
    def stated(self) -> dict[str, Any]:
        """The array as metadata.json states it, which has the frequency on its own."""

    @abstractmethod
    def of_gateway(self) -> dict[str, Any]:
        """The arguments of ``Gateway`` that give it this array."""

    def manifold(
        self, azimuth: Float[np.ndarray, "*shape"], elevation: Float[np.ndarray, "*shape"]
    ) -> Complex[np.ndarray, "*shape elements"]:
        """Array manifold: the response of each element to a plane wave.

        Element m has the response a_m(φ, θ) = e^{+jk u·d_m} to a wave that arrives from the unit vector u(φ, θ)
        ([vantrees2002], chapter 2). The sign follows from the convention e^{−j2πfτ} for a delay τ: an element nearer
        the source has the larger phase.

        Args:
            azimuth: φ, radians, gateway frame; a number or an array.
            elevation: θ, radians, gateway frame; broadcast against ``azimuth``.

        Returns:
            Complex responses of magnitude 1, [..., elements].

        Raises:
            ParameterError: an angle is not a finite number, or the shapes cannot be broadcast.

        Example:
            A wave from the boresight reaches all elements at the same time:

            >>> import bisplat, numpy as np
            >>> y = bisplat.PlanarArray(rows=1, columns=2).manifold(np.array([0.0, 0.0]), np.radians([90.0, 0.0]))
            >>> np.degrees(np.angle(y)).round().tolist()
            [[-0.0, 0.0], [-90.0, 90.0]]
        """
        return np.exp(2j * np.pi * direction(azimuth, elevation) @ self.positions.T)

    def angle_between(
        self, u: Float[np.ndarray, "*batch 3"], v: Float[np.ndarray, "*batch 3"]
    ) -> Float[np.ndarray, "*batch"]:
        """The angle between directions, as far as the array can tell them apart.

        It is the great-circle angle ``arccos(u·v)``. A line of elements along an axis a tells only the angle to this
        axis, since its manifold is the same all along a cone. For a line it is ``|arccos(a·u) − arccos(a·v)|``. A plane
        of elements that is not the gateway's x–y plane does not tell a direction from its mirror image at the plane.
        For it, it is the smaller of both angles.

        Args:
            u: unit vectors [..., 3], gateway frame.
            v: unit vectors [..., 3], gateway frame.

        Returns:
            Degrees, [...].

        Example:
            Two directions at right angles to a line along x:

            >>> import bisplat, numpy as np
            >>> u, v = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
            >>> line = bisplat.PlanarArray(rows=1, columns=8)
            >>> float(line.angle_between(u, v)), float(bisplat.PlanarArray().angle_between(u, v))
            (0.0, 90.0)
        """
        u, v = (check_array(name, given, (..., 3), "unit vectors") for name, given in (("u", u), ("v", v)))
        if self.axis is not None:
            along_u, along_v = ((each * self.axis).sum(-1) for each in (u, v))
            return np.degrees(np.abs(np.arccos(np.clip(along_u, -1, 1)) - np.arccos(np.clip(along_v, -1, 1))))
        cosine = (u * v).sum(-1)
        if self.mirror is not None:
            mirrored = v - 2 * (v * self.mirror).sum(-1, keepdims=True) * self.mirror
            cosine = np.maximum(cosine, (u * mirrored).sum(-1))
        return np.degrees(np.arccos(np.clip(cosine, -1, 1)))


@dataclass(frozen=True)
class PlanarArray(Array):
    """Uniform planar array of M × N elements in the gateway's x-y plane, centred on the gateway's position.

    Element m = row · columns + column has the position d_m (``positions``). So x runs fastest, as in NeRF²'s list of
    antenna positions [zhao2023].

    Attributes:
        rows: number M of elements along y.
        columns: number N of elements along x.
        spacing: distance between neighbouring elements, wavelengths.

    Raises:
        ParameterError: a number of elements is not 1 to 64, there are more than 1024 in all, or the spacing is not
            above 0 and at most 100 wavelengths.

    Example:
        The responses to a plane wave from azimuth 200° and elevation 40°:

        >>> import bisplat, numpy as np
        >>> array = bisplat.PlanarArray()
        >>> y = array.manifold(np.radians(200.0), np.radians(40.0))
        >>> y.shape, np.abs(y).round(6).max().item()
        ((16,), 1.0)
    """

    rows: Annotated[int, Meta(ge=1, le=MOST_IN_A_ROW)] = 4
    columns: Annotated[int, Meta(ge=1, le=MOST_IN_A_ROW)] = 4
    spacing: Annotated[float, Meta(gt=0, le=WIDEST_SPACING)] = 0.5

    def __post_init__(self) -> None:
        check_kinds(self)
        require_whole(1, MOST_IN_A_ROW, rows=self.rows, columns=self.columns)
        if self.elements > MOST_ELEMENTS:
            found = f"{self.rows} × {self.columns}"
            raise ParameterError("rows", f"expected at most {MOST_ELEMENTS} elements in all, found {found}")
        require_positive(spacing=self.spacing)
        require_within(0, WIDEST_SPACING, "wavelengths", spacing=self.spacing)

    @classmethod
    def of(cls, gateway: Gateway) -> PlanarArray:
        """The array of a gateway.

        Args:
            gateway: the gateway of a scene.

        Returns:
            The array with the gateway's rows, columns and spacing.

        Raises:
            ParameterError: the gateway's array is given by the positions of its elements.
        """
        if gateway.elements is not None:
            found = f"one with the positions of {gateway.count} elements"
            raise ParameterError("gateway", f"expected a gateway with rows, columns and spacing, found {found}")
        return cls(gateway.rows, gateway.columns, gateway.spacing)

    @property
    def elements(self) -> int:
        return self.rows * self.columns

    @cached_property
    def positions(self) -> Float[np.ndarray, "elements 3"]:
        """Position d_m of each element, wavelengths, gateway frame, [elements, 3].

        Example:
            >>> import bisplat
            >>> bisplat.PlanarArray(rows=1, columns=2).positions.tolist()
            [[-0.25, 0.0, 0.0], [0.25, 0.0, 0.0]]
        """
        x = (np.arange(self.columns) - (self.columns - 1) / 2) * self.spacing
        y = (np.arange(self.rows) - (self.rows - 1) / 2) * self.spacing
        grid_y, grid_x = np.meshgrid(y, x, indexing="ij")
        return np.stack([grid_x.ravel(), grid_y.ravel(), np.zeros(self.elements)], axis=-1)

    @property
    def in_words(self) -> str:
        """The array, for a sentence.

        >>> PlanarArray(2, 8).in_words
        '2 × 8 elements 0.5 λ apart'
        """
        return f"{self.rows} × {self.columns} elements {self.spacing:g} λ apart"

    def at(self, frequency: float | str) -> PlanarArray:
        """The same array: its spacing is in wavelengths.

        Args:
            frequency: Hz, or a text with a unit such as "2.4 GHz".

        Raises:
            ParameterError: the frequency is not from 1 MHz to 1 THz.

        Example:
            >>> import bisplat
            >>> bisplat.PlanarArray().at("2.4 GHz")
            PlanarArray(rows=4, columns=4, spacing=0.5)
        """
        read_frequency(frequency)
        return self

    def stated(self) -> dict[str, Any]:
        return asdict(self)

    def of_gateway(self) -> dict[str, Any]:
        return asdict(self)


def too_few_elements(array: Array) -> str | None:
    """What is wrong with the spectra of one or two elements: constant, or a single cosine. None: there are more."""
    if array.elements >= LEAST_ELEMENTS:
        return None
    if array.elements == 1:
        return "the spectrum of a single element is the same at every position and in every direction"
    return "the spectra of two elements are single fringes, which all look alike"
