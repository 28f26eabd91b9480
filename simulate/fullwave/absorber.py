"""The absorbing boundary around the cells: a convolutional perfectly matched layer [roden2000].

In the layer the difference D of a field along the layer's normal, in the update of another field, becomes D + ψ with

    ψ ← e^{−σΔt/ε₀} ψ + (e^{−σΔt/ε₀} − 1) D,

where σ grows with the depth d in a layer of L cells like (d/L)³, up to 0.8·4/(η₀Δ).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float32

from simulate.fullwave.yee_grid import COURANT, YeeGrid

ABSORBER = 6
"""Cells of the absorbing boundary on every side. It reflects less than -55 dB (tests/simulate/fullwave)."""

GRADING, STRENGTH = 3, 3.2
"""Exponent of σ, and its largest value in units of 1/(η₀Δ)."""


class Absorber(NamedTuple):
    """State of the absorbing boundary, for several sources side by side.

    The fields of a kind are the electric (0) or the magnetic ones (1). Two of a kind's three components have
    differences along the normal of a layer: the component along the axis two after the normal's, cyclically (0), and
    the component along the next axis (1).

    Attributes:
        decay: e^{−σΔt/ε₀} by kind, axis of the normal, and point, of the grid's longest axis; 1 outside the layer.
        along_z: the same along z, once for every source.
        x: ψ in the layers across x: kind, component, point in the layers (those of the low end first), y, then z and
            source.
        y: the same across y: kind, component, x, point in the layer, then z and source.
        z: the same across z: kind, component, x, y, then point in the layer and source.
    """

    decay: Float32[np.ndarray, "2 3 points"]
    along_z: Float32[np.ndarray, "2 (nz+1)*sources"]
    x: Float32[np.ndarray, "2 2 2*ABSORBER ny+1 (nz+1)*sources"]
    y: Float32[np.ndarray, "2 2 nx+1 2*ABSORBER (nz+1)*sources"]
    z: Float32[np.ndarray, "2 2 nx+1 ny+1 2*ABSORBER*sources"]


def absorber(grid: YeeGrid, sources: int) -> Absorber:
    """The boundary at rest.

    Args:
        grid: the cells.
        sources: number of sources side by side.
    """
    nx, ny, nz = grid.shape
    decay = np.ones((2, 3, max(grid.shape) + 1), np.float32)
    for kind, offset in enumerate((0.0, 0.5)):
        for axis, size in enumerate(grid.shape):
            place = np.arange(size + 1) + offset
            depth = np.clip(np.maximum(ABSORBER - place, place - (size - ABSORBER)), 0, ABSORBER) / ABSORBER
            decay[kind, axis, : size + 1] = np.exp(-STRENGTH * COURANT * depth**GRADING)
    zeros = [(2 * ABSORBER, ny + 1, (nz + 1) * sources), (nx + 1, 2 * ABSORBER, (nz + 1) * sources)]
    zeros += [(nx + 1, ny + 1, 2 * ABSORBER * sources)]
    x, y, z = (np.zeros((2, 2, *shape), np.float32) for shape in zeros)
    return Absorber(decay, np.repeat(decay[:, 2, : nz + 1], sources, axis=1), x, y, z)
