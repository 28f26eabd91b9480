"""Short dipoles, which are the antennas of the full-wave engine: their field, and their currents on the lattice."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float, Int
from scipy.spatial.transform import Rotation

from scenes.scene.description import Scene
from simulate.fullwave.yee_grid import YeeGrid

GAIN = 1.5  # Gain of a short dipole


def element_direction(scene: Scene) -> Float[np.ndarray, " 3"]:
    """Direction of the gateway's dipoles, along its y axis ("V") or x axis ("H"); unit vector, world frame."""
    axis = [0.0, 1.0, 0.0] if scene.gateway.polarization == "V" else [1.0, 0.0, 0.0]
    return Rotation.from_quat(scene.gateway.orientation).apply(axis)


def transmitter_direction(scene: Scene) -> Float[np.ndarray, " 3"]:
    """Direction of the transmitter's dipole, along its z axis ("V") or y axis ("H"); unit vector, world frame."""
    axis = [0.0, 0.0, 1.0] if scene.transmitter.polarization == "V" else [0.0, 1.0, 0.0]
    return Rotation.from_quat(scene.transmitter.orientation).apply(axis)


RISE = 6
"""Periods over which the amplitude of the source rises, as half a raised cosine. The rise is slow, so that the source
hardly radiates at other frequencies."""

SNAPSHOTS = 4
"""Number of moments in a period at which the field is kept. Amplitude, phase and a constant are fitted to them. The
constant is needed, since the start of the oscillation leaves static charges at the ends of the dipole."""


@dataclass(frozen=True)
class Source:
    """A short dipole that oscillates at one frequency."""

    position: Float[np.ndarray, " 3"]  # metres, world frame
    direction: Float[np.ndarray, " 3"]  # unit vector, world frame
    frequency: float  # hertz

    def current(self, times: Float[np.ndarray, " n"] | float) -> Float[np.ndarray, " n"]:
        """The current at some times, seconds, relative to its final amplitude."""
        rise = 0.5 - 0.5 * np.cos(np.pi * np.clip(np.asarray(times) * self.frequency / RISE, 0, 1))
        return rise * np.cos(2 * np.pi * self.frequency * np.asarray(times))

    def edges(self, grid: YeeGrid) -> list[tuple[int, Int[np.ndarray, "n 3"], Float[np.ndarray, " n"]]]:
        """The edges of the cells that share the source: axis, places, and shares of the current."""
        place = (self.position - np.asarray(grid.origin)) / grid.cell
        shared = []
        for axis, share in enumerate(self.direction):
            if abs(share) > 1e-9:
                points, weights = source_weights(place - grid.edge_offset(axis))
                shared.append((axis, points, share * weights))
        return shared


def moments(end: int, frequency: float, time_step: float) -> list[int]:
    """Numbers of time steps, a quarter of a period apart, to which the phasor after ``end`` steps is fitted."""
    quarter = round(1 / (SNAPSHOTS * frequency * time_step))
    return [end - number * quarter for number in range(SNAPSHOTS)]


def phasor(
    fields: Float[np.ndarray, "moments ..."], steps: Sequence[int], frequency: float, time_step: float
) -> Complex[np.ndarray, "..."]:
    """The phasor E of a field Re(E e^{jωt}) + const, by least squares."""
    phase = 2 * np.pi * frequency * time_step * np.array(steps)
    design = np.stack([np.cos(phase), -np.sin(phase), np.ones_like(phase)], axis=1)
    real, imaginary, _ = np.tensordot(np.linalg.pinv(design), fields, axes=1)
    return real + 1j * imaginary


POINTS = 4  # Number of lattice points along each axis that share a source: cubic interpolation

SOURCE_REACH = POINTS // 2
"""Largest distance of these points from the source, in units of the lattice's spacing."""


def source_weights(
    position: Float[np.ndarray, " 3"],
) -> tuple[Int[np.ndarray, "n 3"], Float[np.ndarray, " n"]]:
    """Lattice points around a position, and their weights in cubic Lagrange interpolation.

    By reciprocity, sources with these weights at these points radiate like one source at the position.
    """
    first = np.floor(position).astype(int) - (POINTS // 2 - 1)
    nodes = np.arange(POINTS)
    along = []
    for offset in position - first:
        weight = np.ones(POINTS)
        for node in nodes:
            others = nodes[nodes != node]
            weight[node] = np.prod((offset - others) / (node - others))
        along.append(weight)
    weights = np.einsum("i,j,k->ijk", *along).ravel()
    points = first + np.stack(np.meshgrid(nodes, nodes, nodes, indexing="ij"), axis=-1).reshape(-1, 3)
    used = np.abs(weights) > 1e-9
    return points[used], weights[used]
