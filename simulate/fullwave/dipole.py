"""Short dipoles, which are the antennas of the full-wave engine: their field, and their currents on the lattice."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
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


@dataclass(frozen=True)
class Source:
    position: Float[np.ndarray, " 3"]  # metres, world frame
    direction: Float[np.ndarray, " 3"]  # unit vector, world frame
    frequency: float  # of its oscillation, or carrier of its pulse, hertz

    def edges(self, grid: YeeGrid) -> list[tuple[int, Int[np.ndarray, "n 3"], Float[np.ndarray, " n"]]]:
        """The edges of the cells that share the source: axis, places, and shares of the current."""
        place = (self.position - np.asarray(grid.origin)) / grid.cell
        shared = []
        for axis, share in enumerate(self.direction):
            if abs(share) > 1e-9:
                points, weights = source_weights(place - grid.edge_offset(axis))
                shared.append((axis, points, share * weights))
        return shared


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
