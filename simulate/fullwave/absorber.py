"""The absorbing boundary around the cells: a convolutional perfectly matched layer [roden2000].

The update of a field contains differences D of other fields. In the layer, a difference along the layer's normal is
replaced by D + ψ with

    ψ ← e^{−σΔt/ε₀} ψ + (e^{−σΔt/ε₀} − 1) D,

where σ grows like (d/L)³ with the depth d in a layer of L cells, up to 0.8·4/(η₀Δ).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float32

from simulate.fullwave.yee_grid import COURANT, YeeGrid

ABSORBER = 6
"""Cells of the absorbing boundary on every side. Its reflection is below -55 dB (tests/simulate/fullwave)."""

GRADING, STRENGTH = 3, 3.2
"""Exponent of σ, and its largest value in units of 1/(η₀Δ)."""


class Absorber(NamedTuple):
    """State of the absorbing boundary, for several sources side by side.

    Kind 0 are the electric fields, kind 1 the magnetic fields. Two of the three components of a kind have differences
    along the normal of a layer. In cyclic order, component 0 is along the second axis after the normal, component 1
    along the first.
    """

    # e^{−σΔt/ε₀}, indexed by kind, axis of the normal, and point along it; 1 outside the layer
    decay: Float32[np.ndarray, "2 3 points"]
    along_z: Float32[np.ndarray, "2 (nz+1)*sources"]  # the same along z, repeated for every source
    # ψ in the layers across x, indexed by kind, component, point in the layers (the low end first), y, then z and
    # source
    x: Float32[np.ndarray, "2 2 2*ABSORBER ny+1 (nz+1)*sources"]
    # ψ in the layers across y, indexed by kind, component, x, point in the layers, then z and source
    y: Float32[np.ndarray, "2 2 nx+1 2*ABSORBER (nz+1)*sources"]
    # ψ in the layers across z, indexed by kind, component, x, y, then point in the layers and source
    z: Float32[np.ndarray, "2 2 nx+1 ny+1 2*ABSORBER*sources"]


def absorber(grid: YeeGrid, sources: int) -> Absorber:
    """The boundary without any field."""
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
