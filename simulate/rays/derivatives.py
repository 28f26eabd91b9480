"""Derivatives of the responses with respect to the gateway's pose, the frequency, and the positions of objects.

With the derivatives of the paths' lengths L (``simulate.rays.core.multipath``), ∂y/∂θ = Σ −jk ∂L/∂θ a e^{−jkL}. So the
paths need to be solved only once for the derivatives with respect to everything that moves.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Int

from simulate.rays.tracer import Tracer


class Derivatives(NamedTuple):
    """Responses y of M elements to K transmitters, and their derivatives."""

    responses: Complex[np.ndarray, "K M"]  # y as ``Tracer.responses`` returns it, without diffuse reflection
    # derivative with respect to the gateway's position, 1/m, along the axes of the world frame
    position: Complex[np.ndarray, "K M 3"]
    # derivative with respect to a rotation of the gateway about its position, 1/rad, about the axes of the world
    # frame
    rotation: Complex[np.ndarray, "K M 3"]
    # derivative with respect to the logarithm of the frequency, for an array of fixed size in metres
    frequency: Complex[np.ndarray, "K M"]
    # derivative with respect to the position of each of the given objects, 1/m
    objects: Complex[np.ndarray, "K M objects 3"]


def derivatives(tracer: Tracer, positions: Float[np.ndarray, "K 3"], objects: Sequence[int]) -> Derivatives:
    """Compute the responses to transmitters, and their derivatives."""
    shape = len(positions), len(tracer.elements)
    result = Derivatives(
        np.zeros(shape, complex),
        np.zeros((*shape, 3), complex),
        np.zeros((*shape, 3), complex),
        np.zeros(shape, complex),
        np.zeros((*shape, len(objects), 3), complex),
    )
    wavenumber = 2 * np.pi / tracer.ray_scene.description.wavelength
    for batch in tracer.multipath(positions):
        place = batch.targets * shape[1] + batch.sources
        np.add.at(result.responses.reshape(-1), place, batch.responses)
        by_length = -1j * wavenumber * batch.responses
        by_element, by_interaction = batch.length_derivatives()
        _add(result.position, place, by_length, by_element)
        _add(result.rotation, place, by_length, by_rotation(tracer, batch.sources, by_element))
        _add(result.frequency, place, by_length, batch.lengths())
        for column, number in enumerate(objects):
            touches = (batch.objects == number).any(axis=1)
            by_object = (by_interaction * (batch.objects == number)[..., None]).sum(axis=1)
            _add(result.objects[:, :, column], place[touches], by_length[touches], by_object[touches])
    return result


def by_rotation(
    tracer: Tracer, sources: Int[np.ndarray, " paths"], by_element: Float[np.ndarray, "paths 3"]
) -> Float[np.ndarray, "paths 3"]:
    """Derivatives of paths' lengths by a rotation of the gateway about the axes of the world frame, m/rad."""
    about = tracer.ray_scene.description.gateway.position + tracer.ray_scene.origin
    return np.cross((tracer.elements.positions - about)[sources], by_element)


def _add(total: np.ndarray, place: np.ndarray, by_length: np.ndarray, by_what: np.ndarray) -> None:
    """Add each path's derivative to those of its transmitter and element."""
    count = total.shape[0] * total.shape[1]
    columns = np.atleast_2d(by_what.T) * by_length
    summed = [np.bincount(place, c.real, count) + 1j * np.bincount(place, c.imag, count) for c in columns]
    total += np.stack(summed, axis=-1).reshape(total.shape)
