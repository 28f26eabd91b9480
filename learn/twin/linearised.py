"""The responses of a scene, and their derivatives by what its description may have wrong."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Complex, Float

from scenes.scene.unknowns import OF_MATERIALS, Unknown, vary
from simulate.rays.derivatives import derivatives
from simulate.rays.tracer import Tracer

STEP = 0.02
"""Of the logarithm of a material's property, in finite differences."""


def linearised(
    tracer: Tracer, which: Sequence[Unknown], positions: Float[np.ndarray, "K 3"]
) -> tuple[Complex[np.ndarray, "K M"], Complex[np.ndarray, "K M n"]]:
    """Responses to transmitters, and their derivatives by the places and the frequency; zero by materials.

    Args:
        tracer: traces the scene.
        which: its n unknowns.
        positions: of the transmitters, metres, world frame.
    """
    names = [item.name for item in tracer.ray_scene.description.objects]
    moving = sorted({names.index(each.name) for each in which if each.kind == "object"})
    exact = derivatives(tracer, positions, moving)
    jacobian = np.zeros((*exact.responses.shape, len(which)), complex)
    for column, unknown in enumerate(which):
        if unknown.kind == "object":
            jacobian[..., column] = exact.objects[:, :, moving.index(names.index(unknown.name)), unknown.axis]
        elif unknown.kind == "frequency":
            jacobian[..., column] = exact.frequency
        elif unknown.kind not in OF_MATERIALS:
            jacobian[..., column] = getattr(exact, unknown.kind)[..., unknown.axis]
    return exact.responses, jacobian


def by_materials(
    tracer: Tracer,
    which: Sequence[Unknown],
    positions: Float[np.ndarray, "K 3"],
    responses: Complex[np.ndarray, "K M"],
) -> Complex[np.ndarray, "K M n"]:
    """Derivatives by the materials, zero by all else: finite differences over the same paths.

    Args:
        tracer: traces the scene.
        which: its n unknowns.
        positions: of the transmitters, metres, world frame.
        responses: to them.
    """
    scene, jacobian = tracer.ray_scene.description, np.zeros((*responses.shape, len(which)), complex)
    columns = [column for column, unknown in enumerate(which) if unknown.kind in OF_MATERIALS]
    if not columns:
        return jacobian
    others = [vary(scene, [which[column]], np.array([STEP])) for column in columns]
    for column, traced in zip(columns, tracer.responses_with(others, positions), strict=True):
        jacobian[..., column] = (traced - responses) / STEP
    return jacobian
