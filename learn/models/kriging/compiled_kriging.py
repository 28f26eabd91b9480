"""Kriging of responses by a compiled loop over positions. ``KrigedField.interpolated`` is its slow reference.

It is fast since the cosines and sines of the waves at known positions are computed once, and since the Cholesky factor
of a Hermitian matrix takes an eighth of the operations of elimination in the real one of twice the size.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from jaxtyping import Complex, Float

from learn.models.kriging.wave_covariance import LEGS, leg_shapes
from simulate.parallel.compiled import SUMS, compiled, in_threads

TASK = 8  # number of positions that a thread takes at a time

RARE = 1e-10
"""Probability, relative to that of the most probable leg, below which a leg does not change single precision."""


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
def _krige(positions, places, times, cosines, sines, legs, values, wavenumbers, shares, scales, neighbours, responses):
    """Write interpolated responses into ``responses`` [K, elements]."""
    length, drift, nugget = scales[0], scales[1], scales[2]
    waves, elements = len(shares), values.shape[1]
    distances, near = np.empty(neighbours), np.zeros(neighbours, np.int64)
    costs, chosen = np.empty(min(LEGS, len(legs))), np.zeros(min(LEGS, len(legs)), np.int64)
    cosine, sine = np.empty((neighbours, waves)), np.empty((neighbours, waves))
    here_c, here_s = np.empty(waves), np.empty(waves)
    root_r, root_i = np.empty((neighbours, neighbours)), np.empty((neighbours, neighbours))
    weight_r, weight_i, fading = np.empty(neighbours), np.empty(neighbours), np.empty(neighbours)
    for k in range(len(positions)):
        x, y, z = positions[k, 0], positions[k, 1], positions[k, 2]
        kept = 0
        for i in range(len(places)):
            dx, dy, dz = x - places[i, 0], y - places[i, 1], z - places[i, 2]
            kept = keep_smallest(dx * dx + dy * dy + dz * dz, i, distances, near, kept)

        # expected_fading: over the most probable legs of the path
        fading[:] = 0.0 if len(legs) else 1.0
        kept = 0
        for leg in range(len(legs)):
            dx, dy, dz = x - places[leg, 0], y - places[leg, 1], z - places[leg, 2]
            along = (dx * legs[leg, 0] + dy * legs[leg, 1] + dz * legs[leg, 2]) * legs[leg, 3]
            along = min(max(along, 0.0), 1.0)
            dx, dy, dz = dx - along * legs[leg, 0], dy - along * legs[leg, 1], dz - along * legs[leg, 2]
            cost = (dx * dx + dy * dy + dz * dz) * legs[leg, 5] - legs[leg, 6]
            kept = keep_smallest(cost, leg, costs, chosen, kept)
        whole = 0.0
        for i in range(kept):
            probability = math.exp(costs[0] - costs[i])
            whole += probability
            if probability < RARE:
                continue
            leg = chosen[i]
            dx, dy, dz = x - places[leg, 0], y - places[leg, 1], z - places[leg, 2]
            along = (dx * legs[leg, 0] + dy * legs[leg, 1] + dz * legs[leg, 2]) * legs[leg, 3]
            time = times[leg] + min(max(along, 0.0), 1.0) * legs[leg, 4]
            for a in range(neighbours):
                fading[a] += probability * math.exp(-abs(time - times[near[a]]) / drift)
        for a in range(neighbours):
            fading[a] /= whole if len(legs) else 1.0

        for j in range(waves):
            phase = x * wavenumbers[j, 0] + y * wavenumbers[j, 1] + z * wavenumbers[j, 2]
            here_c[j], here_s[j] = math.cos(phase), math.sin(phase)
        for a in range(neighbours):
            i = near[a]
            real = imaginary = 0.0
            for j in range(waves):
                c, s = shares[j] * cosines[i, j], shares[j] * sines[i, j]
                cosine[a, j], sine[a, j] = c, s
                real += c * here_c[j] + s * here_s[j]
                imaginary += s * here_c[j] - c * here_s[j]
            fade = fading[a] * math.exp(-math.sqrt(distances[a]) / length)
            weight_r[a], weight_i[a] = real * fade, imaginary * fade

        # the matrix, row by row, its Cholesky factor, and the solution of the first triangular system
        for a in range(neighbours):
            for b in range(a + 1):
                i, o = near[a], near[b]
                real = imaginary = 0.0
                for j in range(waves):
                    real += cosine[a, j] * cosines[o, j] + sine[a, j] * sines[o, j]
                    imaginary += sine[a, j] * cosines[o, j] - cosine[a, j] * sines[o, j]
                dx, dy, dz = places[i, 0] - places[o, 0], places[i, 1] - places[o, 1], places[i, 2] - places[o, 2]
                apart = math.sqrt(dx * dx + dy * dy + dz * dz)
                fade = math.exp(-apart / length - abs(times[i] - times[o]) / drift)
                real, imaginary = real * fade, imaginary * fade
                for c in range(b):
                    real -= root_r[a, c] * root_r[b, c] + root_i[a, c] * root_i[b, c]
                    imaginary -= root_i[a, c] * root_r[b, c] - root_r[a, c] * root_i[b, c]
                if a == b:
                    root_r[a, a], root_i[a, a] = math.sqrt(real + nugget), 0.0
                else:
                    root_r[a, b], root_i[a, b] = real / root_r[b, b], imaginary / root_r[b, b]
            real, imaginary = weight_r[a], weight_i[a]
            for c in range(a):
                real -= root_r[a, c] * weight_r[c] - root_i[a, c] * weight_i[c]
                imaginary -= root_r[a, c] * weight_i[c] + root_i[a, c] * weight_r[c]
            weight_r[a], weight_i[a] = real / root_r[a, a], imaginary / root_r[a, a]
        for a in range(neighbours - 1, -1, -1):
            real, imaginary = weight_r[a] / root_r[a, a], weight_i[a] / root_r[a, a]
            weight_r[a], weight_i[a] = real, imaginary
            for c in range(a):
                weight_r[c] -= root_r[a, c] * real + root_i[a, c] * imaginary
                weight_i[c] -= root_r[a, c] * imaginary - root_i[a, c] * real

        for m in range(elements):
            real = imaginary = 0.0
            for a in range(neighbours):
                real += weight_r[a] * values[near[a], m, 0] + weight_i[a] * values[near[a], m, 1]
                imaginary += weight_r[a] * values[near[a], m, 1] - weight_i[a] * values[near[a], m, 0]
            responses[k, m] = complex(real, imaginary)


class CompiledKriging:
    """Interpolates responses between the known ones of a ``KrigedField``."""

    def __init__(self, field: Any):
        # Of single precision, as a file of weights keeps them, so that a loaded model predicts the same.
        of_law = field.wavelength, field.shares, field.length, field.drift, field.nugget
        per_period, powers, *scales = (each.float().double().numpy() for each in of_law)
        known, at = field.places.double().numpy(), field.times.double().numpy()
        wavenumbers = 2 * np.pi / per_period * field.directions.double().numpy()
        phases = known @ wavenumbers.T
        numbers = (field.values.float() - field.mean).double().unflatten(1, (-1, 2)).numpy()
        waves, legs = (np.cos(phases), np.sin(phases)), leg_shapes(known, at)
        self._known = known, at, *waves, legs, numbers, wavenumbers, powers, np.array(scales)
        self._mean = field.mean.double().unflatten(0, (-1, 2)).numpy() @ [1, 1j]

    def responses(self, positions: Float[np.ndarray, "K 3"], neighbours: int) -> Complex[np.ndarray, "K elements"]:
        """Interpolated responses, in the units of the known ones."""
        places = np.ascontiguousarray(positions, np.float64)
        found = np.empty((len(places), len(self._mean)), np.complex128)
        nearest = min(neighbours, len(self._known[0]))

        def write_some(some: slice) -> None:
            _krige(places[some], *self._known, nearest, found[some])  # type: ignore[call-arg]

        in_threads(write_some, len(places), TASK)
        return (found + self._mean).astype(np.complex64)
