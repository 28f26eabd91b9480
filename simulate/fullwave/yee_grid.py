"""The cubic cells of a finite-difference run, and the waves on such a grid."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from scenes.scene.description import SPEED_OF_LIGHT

COURANT = 1 / math.sqrt(3)
"""Time step times the speed of light over the side of a cell. This is the largest stable value (Courant, Friedrichs and
Lewy)."""


@dataclass(frozen=True)
class YeeGrid:
    """A box of cubic cells [yee1966].

    Cell (i, j, k) begins at ``origin + (i, j, k) * cell``. The electric field along an axis is known at the middles of
    the cells' edges along this axis.
    """

    origin: tuple[float, float, float]  # lowest corner, metres, world frame
    cell: float  # side of a cell, metres
    shape: tuple[int, int, int]  # number of cells along x, y, z

    @property
    def cells(self) -> int:
        return math.prod(self.shape)

    @property
    def time_step(self) -> float:
        """Δ/(c√3), seconds."""
        return COURANT * self.cell / SPEED_OF_LIGHT

    def edge_offset(self, axis: int) -> Float[np.ndarray, " 3"]:
        """Middle of the first edge along an axis, in cells from the origin."""
        return 0.5 * np.eye(3)[axis]


def numerical_frequency(wavelength: float, cell: float) -> float:
    """The frequency at which waves on the grid have the given wavelength in air, on average over all directions.

    On the grid a plane wave of wave vector k has the frequency ω (Taflove, Computational Electrodynamics, chapter 4)
    with sin²(ωΔt/2)/(cΔt)² = Σ_i sin²(k_iΔ/2)/Δ², a little below c times the magnitude of k. A source of the true
    frequency would radiate waves that are a little too short.
    """
    return float(np.mean(frequencies_on_grid(2 * np.pi / wavelength * _directions(), cell)))


def numerical_permittivity(permittivity: float, wavelength: float, cell: float) -> float:
    """The permittivity with which waves on the grid have the right length in a medium, on average over all directions.

    Waves in a medium are shorter, so the cells are coarser for them than for waves in air.
    """
    wave_vectors = 2 * np.pi / wavelength * np.sqrt(permittivity) * _directions()
    squares = (np.sin(wave_vectors * cell / 2) ** 2).sum(axis=1).mean()
    angle = np.pi * numerical_frequency(wavelength, cell) * cell * COURANT / SPEED_OF_LIGHT
    return float(squares / (3 * np.sin(angle) ** 2))


def dispersion_residual(wavelength: float, cell: float) -> float:
    """Largest relative error of the wavelength over all directions, at ``numerical_frequency``.

    Waves are shortest along an axis, and longest along a diagonal, where they have the speed of light.
    """
    frequency = numerical_frequency(wavelength, cell)
    angle = np.pi * frequency * COURANT * cell / SPEED_OF_LIGHT
    along_axis = np.arcsin(np.sin(angle) / COURANT) * wavelength / (np.pi * cell)
    return float(max(abs(along_axis - 1), abs(frequency * wavelength / SPEED_OF_LIGHT - 1)))


def frequencies_on_grid(wave_vectors: Float[np.ndarray, "n 3"], cell: float) -> Float[np.ndarray, " n"]:
    """The frequencies of waves on the grid, Hz, by their wave vectors, 1/m."""
    sines = np.sqrt((np.sin(wave_vectors * cell / 2) ** 2).sum(axis=1))
    return np.arcsin(COURANT * sines) / (np.pi * COURANT * cell / SPEED_OF_LIGHT)


def _directions() -> Float[np.ndarray, "n 3"]:
    count = 500
    index = np.arange(count) + 0.5
    height, angle = 1 - 2 * index / count, np.pi * (1 + 5**0.5) * index
    radius = np.sqrt(1 - height**2)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=1)
