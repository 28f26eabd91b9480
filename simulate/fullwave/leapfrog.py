"""Time steps of Maxwell's equations on Yee's cells [yee1966], for several sources side by side.

With E divided by η₀, S = cΔt/Δ, ε̃ = σΔt/2ε₀ε_r, and axes a, b, c in cyclic order, a time step is

    E_a ← (1 − ε̃)/(1 + ε̃) E_a + S/ε_r/(1 + ε̃) (δ_b H_c − δ_c H_b),
    H_a ← H_a + S/μ_r (δ_c E_b − δ_b E_c).

δ_b F is the difference of F between neighbouring points along b: to the previous point for H, to the next one for E.
The fields of all sources lie side by side in memory, so one look-up of the coefficients serves all of them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float32, Int32

from scenes.scene.materials import VACUUM_PERMITTIVITY
from simulate.fullwave.cells import CONDUCTOR, PERMEABILITY, EdgeMaterials, beside_edges
from simulate.fullwave.yee_grid import COURANT, YeeGrid
from simulate.parallel.compiled import compiled

ABSORBER = 6
"""Cells of the absorbing boundary on every side. Its reflection is below -55 dB (tests/simulate/fullwave)."""

GRADING, STRENGTH = 3, 3.2  # Exponent of σ, and its largest value in units of 1/(η₀Δ)


class Absorber(NamedTuple):
    """State of the absorbing boundary, a convolutional perfectly matched layer [roden2000], for several sources.

    The update of a field contains differences D of other fields. In the layer, a difference along the layer's normal is
    replaced by D + ψ with

        ψ ← e^{−σΔt/ε₀} ψ + (e^{−σΔt/ε₀} − 1) D,

    where σ grows like (d/L)³ with the depth d in a layer of L cells, up to 0.8·4/(η₀Δ).

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


class Cells(NamedTuple):
    """The fields of several sources, and the coefficients of the cells."""

    # E_x, E_y, E_z, H_x, H_y, H_z; the second axis holds place (x, y, z) and source
    fields: Float32[np.ndarray, "6 points*sources"]
    row: Int32[np.ndarray, "6 nx+1 ny+1"]  # row of ``keep`` and ``drive``, for each component and (x, y)
    # factor of the old field along z, repeated for every source; equal rows are stored once
    keep: Float32[np.ndarray, "rows (nz+1)*sources"]
    drive: Float32[np.ndarray, "rows (nz+1)*sources"]  # factor of the differences, likewise
    absorber: Absorber  # the absorbing boundary


def cells_at_rest(materials: EdgeMaterials, grid: YeeGrid, sources: int) -> Cells:
    conducting = np.arange(len(materials.permittivity)) == CONDUCTOR
    conductivity = np.where(conducting, 0, materials.conductivity)
    loss = conductivity * grid.time_step / (2 * VACUUM_PERMITTIVITY * materials.permittivity)
    keep = np.where(conducting, 0, (1 - loss) / (1 + loss))
    drive = np.where(conducting, 0, COURANT / materials.permittivity / (1 + loss))
    magnetic = len(keep) + beside_edges(materials.index == CONDUCTOR).astype(np.uint16)
    keep = np.concatenate([keep, np.ones(len(PERMEABILITY))]).astype(np.float32)
    drive = np.concatenate([drive, COURANT / np.array(PERMEABILITY)]).astype(np.float32)
    code = np.concatenate([materials.index, magnetic])
    # Comparing bytes is much faster than np.unique(axis=0).
    each = np.ascontiguousarray(code).view(np.dtype((np.void, 2 * code.shape[-1])))[..., 0]
    _, first, row = np.unique(each, return_index=True, return_inverse=True)
    rows = code.reshape(-1, code.shape[-1])[first]
    return Cells(
        np.zeros((6, code[0].size * sources), np.float32),
        row.reshape(code.shape[:-1]).astype(np.int32),
        np.repeat(keep[rows], sources, axis=1),
        np.repeat(drive[rows], sources, axis=1),
        absorber(grid, sources),
    )


@compiled(nogil=True, fastmath={"contract"})
def _row(field, first, second, third, fourth, keep, drive):
    for n in range(field.size):
        field[n] = keep[n] * field[n] + drive[n] * ((first[n] - second[n]) - (third[n] - fourth[n]))


@compiled(nogil=True, fastmath={"contract"})
def _absorbed_row(field, memory, upper, lower, decay, drive):
    for n in range(field.size):
        memory[n] = decay * memory[n] + (decay - np.float32(1)) * (upper[n] - lower[n])
        field[n] += drive[n] * memory[n]


@compiled(nogil=True, fastmath={"contract"})
def _absorbed_rows(field, memory, upper, lower, decay, drive):
    for n in range(field.size):
        memory[n] = decay[n] * memory[n] + (decay[n] - np.float32(1)) * (upper[n] - lower[n])
        field[n] += drive[n] * memory[n]


@compiled(nogil=True)
def _slot(place, size):
    """Place in the memory of the absorbing layer, -1 outside the layer."""
    if place < ABSORBER:
        return place
    if place >= size - ABSORBER:
        return place - size + 2 * ABSORBER
    return -1


@compiled(nogil=True)
def advance(cells, kind):
    """Advance all components of one kind (0 electric, 1 magnetic) by a time step."""
    fields, layer = cells.fields, cells.absorber
    sources = layer.z.shape[-1] // (2 * ABSORBER)
    points_y, points_z = cells.row.shape[2], cells.keep.shape[1] // sources
    stride = (points_y * points_z * sources, points_z * sources, sources)
    size = (cells.row.shape[1] - 1, points_y - 1, points_z - 1)
    start = 1 - kind  # the electric field stays zero at the low ends, where the absorbing boundary ends
    width = (size[2] - start) * sources
    for i in range(start, size[0]):
        for j in range(start, size[1]):
            here = i * stride[0] + j * stride[1] + start * sources
            for axis in range(3):
                component, b, c = axis + 3 * kind, (axis + 1) % 3, (axis + 2) % 3
                # The two differences: of the other kind's component c along b, and of its component b along c.
                if kind == 0:
                    one, along_one, other, along_other = c + 3, b, b + 3, c
                    up_one, low_one, up_other, low_other = here, here - stride[b], here, here - stride[c]
                else:
                    one, along_one, other, along_other = b, c, c, b
                    up_one, low_one, up_other, low_other = here + stride[c], here, here + stride[b], here
                field = fields[component, here : here + width]
                first, second = fields[one, up_one : up_one + width], fields[one, low_one : low_one + width]
                third, fourth = fields[other, up_other : up_other + width], fields[other, low_other : low_other + width]
                row = cells.row[component, i, j]
                keep, drive = cells.keep[row, start * sources :], cells.drive[row, start * sources :]
                inside = (_slot(i, size[0]), _slot(j, size[1]))
                _row(field, first, second, third, fourth, keep, drive)
                for turn in range(2):
                    along = along_one if turn == 0 else along_other
                    upper, lower = (first, second) if turn == 0 else (fourth, third)
                    which = 0 if along == b else 1
                    if along == 2:
                        memory, decay = layer.z[kind, which, i, j], layer.along_z[kind]
                        low, high = (ABSORBER - start) * sources, (size[2] - ABSORBER - start) * sources
                        _absorbed_rows(
                            field[:low], memory[:low], upper[:low], lower[:low], decay[start * sources :], drive[:low]
                        )
                        _absorbed_rows(
                            field[high:], memory[ABSORBER * sources :], upper[high:], lower[high:],
                            decay[(size[2] - ABSORBER) * sources :], drive[high:],
                        )  # fmt: skip
                    elif inside[along] >= 0:
                        memory = (
                            layer.x[kind, which, inside[0], j] if along == 0 else layer.y[kind, which, i, inside[1]]
                        )
                        place = i if along == 0 else j
                        _absorbed_row(
                            field, memory[start * sources :], upper, lower, layer.decay[kind, along, place], drive
                        )
