"""Neighbours of positions: the nearest known value, and the weighted mean of four."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Num
from scipy.spatial import cKDTree

NEIGHBOURS = 4  # Number of known values that ``inverse_distance`` averages


def nearest(
    known_positions: Float[np.ndarray, "n 3"], known: Num[np.ndarray, "n ..."], positions: Float[np.ndarray, "K 3"]
) -> Num[np.ndarray, "K ..."]:
    """A copy of the value at the nearest known position."""
    return known[cKDTree(known_positions).query(positions)[1]]


def inverse_distance(
    known_positions: Float[np.ndarray, "n 3"],
    known: Num[np.ndarray, "n ..."],
    positions: Float[np.ndarray, "K 3"],
    leave_out: bool = False,
) -> Num[np.ndarray, "K ..."]:
    """The mean of the four nearest known values, weighted by 1 / distance; with ``leave_out``, without that itself."""
    count = min(NEIGHBOURS + leave_out, len(known))
    distance, index = cKDTree(known_positions).query(positions, k=range(1, count + 1))
    distance = np.maximum(distance, 1e-9)
    if leave_out:
        distance[index == np.arange(len(known))[:, None]] = np.inf
        distance[np.isinf(distance).all(axis=1)] = 1  # a single known position
    weight = 1 / distance
    weight /= weight.sum(axis=1, keepdims=True)
    return np.einsum("kn,kn...->k...", weight, known[index])
