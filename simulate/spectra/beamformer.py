"""Beamforming: from the responses of an array's elements to a spatial spectrum on an angular grid.

Every dataset has one array and one grid. A ``Beamformer`` is this pair.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Complex, Float

from scenes.files.errors import check_array
from scenes.files.options import check_kinds
from simulate.spectra.angular_grid import COLUMNS, ROWS, AngularGrid
from simulate.spectra.array import Array, PlanarArray

LEAST_POWER_DB = -200.0
"""Lowest value of a power spectrum, used where the power is zero. It is far below any receiver's noise."""


@dataclass(frozen=True)
class Beamformer:
    """Conventional (Bartlett) beamformer: steers an array to each direction of a grid [vantrees2002].

    A spectrum is a magnitude. The element responses of several paths add up, but their spectra do not.

    Attributes:
        array: the gateway's array, a ``PlanarArray`` or an ``ElementArray`` with its frequency; by default 4 × 4
            elements half a wavelength apart.
        grid: the directions of the spectrum's pixels.

    Raises:
        ParameterError: the array or the grid is something else, or an ``ElementArray`` has no frequency.

    Example:
        The spectrum of a plane wave from azimuth 200° and elevation 40°:

        >>> import bisplat, numpy as np
        >>> beamformer = bisplat.Beamformer()
        >>> y = beamformer.array.manifold(np.radians(200.0), np.radians(40.0))
        >>> y.shape, beamformer.spectrum(y).shape
        ((16,), (90, 360))
    """

    array: Array = field(default_factory=PlanarArray)
    grid: AngularGrid = field(default_factory=AngularGrid)

    def __post_init__(self) -> None:
        check_kinds(self)
        self.array.positions  # noqa: B018  an array without a frequency has none, and refuses here

    @cached_property
    def steering(self) -> Complex[np.ndarray, "90 360 elements"]:
        """Steering vectors e^{−jk u·d_m} / √(MN) of all pixels, complex, [90, 360, elements].

        The spectrum of the responses y is ``abs(steering @ y)``.
        """
        azimuth, elevation = np.meshgrid(np.radians(self.grid.azimuths_deg), np.radians(self.grid.elevations_deg))
        return self.array.manifold(azimuth, elevation).conj() / np.sqrt(self.array.elements)

    def spectrum(self, responses: Complex[np.ndarray, "*batch elements"]) -> Float[np.ndarray, "*batch 90 360"]:
        """Spatial spectrum of element responses, a magnitude.

        It is ``S(φ, θ) = |Σ_m y_m e^{−jk u·d_m}| / √(MN)`` with the unit vector u(φ, θ) of each pixel, and S² is the
        power. The result is not normalised, whereas the pictures of a dataset are.

        Args:
            responses: complex element responses y, [elements] or a stack of them [..., elements].

        Returns:
            The spectrum on the grid, [..., 90, 360], in the unit of the responses.

        Raises:
            ParameterError: the array has another shape, or does not hold numbers.

        Example:
            >>> import bisplat, numpy as np
            >>> beamformer = bisplat.Beamformer()
            >>> y = beamformer.array.manifold(np.radians(200.0), np.radians(40.0))
            >>> beamformer.grid.dominant_angles(beamformer.spectrum(y)).tolist()
            [200.0, 40.0]
        """
        elements = self.array.elements
        what = f"responses of {elements} elements"
        responses = check_array("responses", responses, (..., elements), what, "c", finite=False)
        pixels = responses @ self.steering.reshape(-1, elements).T
        return np.abs(pixels).reshape(*responses.shape[:-1], ROWS, COLUMNS)

    def power_db(self, responses: Complex[np.ndarray, "*batch elements"]) -> Float[np.ndarray, "*batch 90 360"]:
        """Absolute power of the spatial spectrum, 10 log10 S², as a channel gain in dB.

        At 0 dB one isotropic element would receive all of the transmitter's power. A plane wave peaks 10 log10 MN
        above its level at a single element: this is the gain of the array. Noise that is independent from element to
        element keeps its level.

        Args:
            responses: complex element responses y, not normalised, [elements] or a stack of them [..., elements].

        Returns:
            The power, dB, [..., 90, 360]; never less than −200 dB.

        Raises:
            ParameterError: the array has another shape, or does not hold numbers.

        Example:
            A plane wave of −60 dB at every element of a 4 × 4 array, whose gain is 12.04 dB:

            >>> import bisplat, numpy as np
            >>> beamformer = bisplat.Beamformer()
            >>> y = 1e-3 * beamformer.array.manifold(np.radians(200.0), np.radians(40.0))
            >>> beamformer.power_db(y).max().round(2).item()
            -47.96
        """
        return 20 * np.log10(np.maximum(self.spectrum(responses), 10 ** (LEAST_POWER_DB / 20)))
