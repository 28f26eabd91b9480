"""A search by given responses, for the tests of searches and of their starting values."""

from learn.twin.gauss_newton import Search
from learn.twin.response_residual import ResponseResidual
from learn.twin.starting_values import is_far
from scenes.scene.shapes import bounding_box
from simulate.rays.tracer import Tracer


def search_by(scene, which, propagation, positions, measured, phases_known, ratios=(1.0,)) -> Search:
    """Of a described scene. Responses without known phases may be flipped."""
    stages = ResponseResidual.stages(measured, positions, scene.wavelength, phases_known, not phases_known)
    tracers = {"": Tracer(scene, propagation, bounding_box(positions))}
    return Search(tracers, list(which), positions, stages, lambda sentence: None, ratios, is_far(scene, which))
