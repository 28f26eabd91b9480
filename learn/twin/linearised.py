"""Traced responses to first order in the errors of a scene's description."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Complex, Float

from scenes.scene.description import Scene
from scenes.scene.unknowns import OF_MATERIALS, OF_POSE, Unknown, vary
from simulate.rays.chain_solver import Found
from simulate.rays.derivatives import derivatives
from simulate.rays.tracer import Tracer

STEP = 0.02  # Step of the finite differences, in the logarithm of a material's property


CARRIER = (1.0,)  # The frequencies of responses at the carrier alone, in carrier frequencies


def over_band(tracer: Tracer, ratios: Sequence[float]) -> list[Tracer]:
    """Tracers of one scene at several frequencies; the array keeps its size in metres, materials their properties."""
    frequency = [Unknown("frequency", "", 0, 1.0)]

    def at(ratio: float) -> Tracer:
        return tracer.at_frequency(vary(tracer.scene, frequency, np.log([ratio])))

    return [tracer if ratio == 1 else at(ratio) for ratio in ratios]


def moved(tracer: Tracer, scene: Scene) -> Tracer:
    """A tracer of a scene that differs a little from another tracer's; it reuses the chains that are still valid."""
    edges, old = tracer.edges, tracer.ray_scene
    new = Tracer(scene, old.propagation, tracer.region, found=tracer.found)
    if not np.array_equal(new.ray_scene.planes.of_face, old.planes.of_face):  # objects that touched have come apart
        return Tracer(scene, old.propagation, tracer.region)
    if new.edges is None or edges is None or np.array_equal(new.edges.faces, edges.faces):
        return new
    return Tracer(scene, old.propagation, tracer.region, found=Found(tracer.found.reflected, None))


def linearised(
    tracer: Tracer, which: Sequence[Unknown], positions: Float[np.ndarray, "K 3"], gateway: str = ""
) -> tuple[Complex[np.ndarray, "K M"], Complex[np.ndarray, "K M n"]]:
    """Responses of a gateway, and their derivatives by its pose, by places of objects and by frequency.

    The columns of materials and of other gateways' poses are zero.
    """
    names = [item.name for item in tracer.scene.objects]
    moving = sorted({names.index(each.name) for each in which if each.kind == "object"})
    exact = derivatives(tracer, positions, moving)
    jacobian = np.zeros((*exact.responses.shape, len(which)), complex)
    for column, unknown in enumerate(which):
        if unknown.kind == "object":
            jacobian[..., column] = exact.objects[:, :, moving.index(names.index(unknown.name)), unknown.axis]
        elif unknown.kind == "frequency":
            jacobian[..., column] = exact.frequency
        elif unknown.kind in OF_POSE and unknown.name == gateway:
            jacobian[..., column] = getattr(exact, unknown.kind)[..., unknown.axis]
    return exact.responses, jacobian


def by_materials(
    tracer: Tracer,
    which: Sequence[Unknown],
    positions: Float[np.ndarray, "K 3"],
    responses: Complex[np.ndarray, "K M"],
) -> Complex[np.ndarray, "K M n"]:
    """Derivatives with respect to materials, by finite differences over the same paths. All other columns are zero."""
    jacobian = np.zeros((*responses.shape, len(which)), complex)
    columns = [column for column, unknown in enumerate(which) if unknown.kind in OF_MATERIALS]
    if not columns:
        return jacobian
    others = [vary(tracer.scene, [which[column]], np.array([STEP])) for column in columns]
    for column, traced in zip(columns, tracer.responses_with(others, positions), strict=True):
        jacobian[..., column] = (traced - responses) / STEP
    return jacobian
