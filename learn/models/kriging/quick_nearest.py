"""Weighted means of the nearest known spectra by a compiled loop. ``by_distance`` is its slow reference."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from simulate.parallel.compiled import SUMS, compiled, in_threads

TASK = 8  # number of positions that a thread takes at a time


@compiled(inline="always")
def keep_smallest(cost, index, costs, indices, kept):
    """Insert a cost into the ascending ``costs`` [most], of which ``kept`` are in use. Return how many then are."""
    most = len(costs)
    if kept == most and not cost < costs[most - 1]:
        return kept
    place = min(kept, most - 1)
    while place > 0 and cost < costs[place - 1]:
        costs[place], indices[place] = costs[place - 1], indices[place - 1]
        place -= 1
    costs[place], indices[place] = cost, index
    return min(kept + 1, most)


@compiled(nogil=True, fastmath=SUMS, error_model="numpy")
def _add(positions, places, known, weight, least, neighbours, spectra):
    distances, near = np.empty(neighbours), np.zeros(neighbours, np.int64)
    for k in range(len(positions)):
        kept = 0
        for i in range(len(places)):
            dx, dy, dz = (
                positions[k, 0] - places[i, 0],
                positions[k, 1] - places[i, 1],
                positions[k, 2] - places[i, 2],
            )
            kept = keep_smallest(dx * dx + dy * dy + dz * dz, i, distances, near, kept)
        whole = 0.0
        for a in range(neighbours):
            distances[a] = 1 / max(math.sqrt(distances[a]), least)
            whole += distances[a]
        for a in range(neighbours):
            share, spectrum = np.float32(weight * distances[a] / whole), known[near[a]]
            for p in range(spectra.shape[1]):
                spectra[k, p] += share * spectrum[p]


def add_mean_of_nearest(
    spectra: Float[np.ndarray, "K 90 360"],
    positions: Float[np.ndarray, "K 3"],
    places: Float[np.ndarray, "n 3"],
    known: Float[np.ndarray, "n 90 360"],
    weight: float,
    neighbours: int,
    least: float,
) -> None:
    """Add weighted means of the nearest known spectra, with weights 1 / distance.

    >>> spectra = np.ones((1, 90, 360), np.float32)
    >>> known = np.stack([np.zeros((90, 360), np.float32), spectra[0]])
    >>> add_mean_of_nearest(spectra, np.array([[0.2, 0, 0]]), np.array([[0.0, 0, 0], [1, 0, 0]]), known, 0.5, 2, 1e-9)
    >>> round(float(spectra[0, 0, 0]), 3)
    1.1
    """
    into, of = spectra.reshape(len(spectra), -1), known.reshape(len(known), -1)
    at, to = (np.ascontiguousarray(each, np.float64) for each in (positions, places))

    def add_some(some: slice) -> None:
        _add(at[some], to, of, weight, least, neighbours, into[some])  # type: ignore[call-arg]

    in_threads(add_some, len(at), TASK)
