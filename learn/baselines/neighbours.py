"""Baselines without training: the mean of the known spectra, the nearest, and a weighted mean of four."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.spatial import cKDTree

NEIGHBOURS = 4  # number of known spectra that ``inverse_distance`` averages


def mean_picture(
    known: Float[np.ndarray, "n 90 360"], positions: Float[np.ndarray, "K 3"]
) -> Float[np.ndarray, "K 90 360"]:
    """The baseline mean-picture: the mean of the known spectra, the same at every position."""
    return np.broadcast_to(known.mean(axis=0), (len(positions), *known.shape[1:]))


def nearest(
    known_positions: Float[np.ndarray, "n 3"], known: Float[np.ndarray, "n 90 360"], positions: Float[np.ndarray, "K 3"]
) -> Float[np.ndarray, "K 90 360"]:
    """The baseline nearest: a copy of the spectrum at the nearest known position."""
    return known[cKDTree(known_positions).query(positions)[1]]


def inverse_distance(
    known_positions: Float[np.ndarray, "n 3"], known: Float[np.ndarray, "n 90 360"], positions: Float[np.ndarray, "K 3"]
) -> Float[np.ndarray, "K 90 360"]:
    """The baseline inverse-distance: the mean of the four nearest known spectra, weighted by 1 / distance."""
    distance, index = cKDTree(known_positions).query(positions, k=min(NEIGHBOURS, len(known)))
    weight = 1 / np.maximum(distance.reshape(len(positions), -1), 1e-9)
    weight /= weight.sum(axis=1, keepdims=True)
    return np.einsum("kn,knij->kij", weight, known[index.reshape(weight.shape)])
