"""Weights that spread a source over the lattice points around it."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

POINTS = 4
"""Number of lattice points along each axis that share a source: cubic interpolation."""

SOURCE_REACH = POINTS // 2
"""Largest distance of these points from the source, in units of the lattice's spacing."""


def source_weights(
    position: Float[np.ndarray, " 3"],
) -> tuple[Int[np.ndarray, "n 3"], Float[np.ndarray, " n"]]:
    """Lattice points around a position, and their weights in cubic Lagrange interpolation.

    The weights interpolate the field. So, by reciprocity, sources with these weights at these points radiate like one
    source at the position. A position on a lattice point needs only this point.

    Example:
        >>> points, weights = source_weights(np.array([5.0, 7.0, 2.5]))
        >>> points.tolist(), weights.tolist()
        ([[5, 7, 1], [5, 7, 2], [5, 7, 3], [5, 7, 4]], [-0.0625, 0.5625, 0.5625, -0.0625])
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
