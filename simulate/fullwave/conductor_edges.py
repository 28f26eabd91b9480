"""Corrections at the edges of conductors, where the field is singular and differences between cells are wrong.

The electric field along an edge grows with the distance r from it, like r^½ for a sheet and like r^⅔ for a block.
Differences between cells assume a smooth field, so a conductor appears about a third of a cell too large. Consider the
edges of cells next to the conductor's edge. The difference form of Laplace's equation, Σ (E_neighbour − E)/μ_r = 0,
holds there for this static field if the difference towards the conductor's edge has the weight α = 1/μ_r [mur1981]:

    α = √2 + 2·2^¼ cos(π/8) − 3                  = 0.612 beside the edge of a sheet,
    α = (2^⅔ sin 60° + 2^⅓ (1 + ½)) / sin 60° − 3 = 0.770 beside the edge of a block.

The field across the edge, which grows like r^−½, is not corrected. Corners of staircases count as edges of blocks.
"""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Bool, UInt8

SHEET = 1 / (math.sqrt(2) + 2 * 2**0.25 * math.cos(math.pi / 8) - 3)
BLOCK = 1 / ((2 ** (2 / 3) * math.sqrt(0.75) + 1.5 * 2 ** (1 / 3)) / math.sqrt(0.75) - 3)
PERMEABILITY = (1.0, SHEET, BLOCK)
"""μ_r of a magnetic component that is not beside an edge, beside the edge of a sheet, and beside that of a block."""


def beside_edges(conducting: Bool[np.ndarray, "3 nx+1 ny+1 nz+1"]) -> UInt8[np.ndarray, "3 nx+1 ny+1 nz+1"]:
    """Find the magnetic components beside edges of conductors."""
    faces = np.stack([_faces(conducting, axis) for axis in range(3)])
    found = np.zeros(conducting.shape, np.uint8)
    for axis in range(3):
        b, c = (axis + 1) % 3, (axis + 2) % 3
        # The four faces around an edge: two across b, on either side along c; two across c, on either side along b.
        around = [(b, faces[b]), (b, _moved(faces[b], c, 1)), (c, faces[c]), (c, _moved(faces[c], b, 1))]
        across_b, across_c = around[0][1] ^ around[1][1], around[2][1] ^ around[3][1]
        number = sum(face.astype(np.uint8) for _, face in around)
        of_sheet, of_block = number == 1, (number == 2) & across_b & across_c
        code = of_sheet.astype(np.uint8) + 2 * of_block.astype(np.uint8)
        for normal, other, side in ((b, c, 0), (b, c, -1), (c, b, 0), (c, b, -1)):
            beside = _moved(code, other, side)
            found[normal] = np.where(faces[normal], 0, np.maximum(found[normal], beside))
    return found


def _faces(conducting: Bool[np.ndarray, "3 nx+1 ny+1 nz+1"], axis: int) -> Bool[np.ndarray, "nx+1 ny+1 nz+1"]:
    """Whether each face across an axis is conducting, because all its four edges are."""
    b, c = (axis + 1) % 3, (axis + 2) % 3
    return conducting[b] & _moved(conducting[b], c, -1) & conducting[c] & _moved(conducting[c], b, -1)


def _moved(values: np.ndarray, axis: int, by: int) -> np.ndarray:
    """Values moved along an axis to higher (1) or lower (-1) indices, with zeros at the end; 0 leaves them in place."""
    if by == 0:
        return values
    result = np.zeros_like(values)
    to, source = np.moveaxis(result, axis, 0), np.moveaxis(values, axis, 0)
    if by > 0:
        to[1:] = source[:-1]
    else:
        to[:-1] = source[1:]
    return result
