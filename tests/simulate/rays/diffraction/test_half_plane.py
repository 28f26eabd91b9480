"""The field around the edge of a large metal sheet is the exact one."""

import numpy as np
import pytest

from benchmarks.ledger.exact_fields import half_plane_response
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.materials import RadioMaterial
from scenes.scene.orientation import facing
from scenes.scene.shapes import sheet
from simulate.rays.core.propagation import Propagation
from simulate.rays.tracer import Tracer


def around_edge(radius: float, degrees: np.ndarray | float, height: float = 0.0) -> np.ndarray:
    """Points around the z axis at angles from the half-plane x = 0, y < 0."""
    angle = np.radians(degrees)
    return np.stack([radius * np.sin(angle), -radius * np.cos(angle), np.full_like(angle, height)], axis=-1)


def half_plane(source: np.ndarray, positions: np.ndarray) -> Scene:
    """A sheet so large that its other edges play no role, and short dipoles along its edge."""
    return Scene(
        "half-plane",
        915e6,
        Gateway(tuple(source), facing((0, -1, 0)), rows=1, columns=1, pattern="dipole"),
        Transmitter(tuple(positions.min(axis=0) - 0.01), tuple(positions.max(axis=0) + 0.01), pattern="dipole"),
        (SceneObject("sheet", sheet((0, -60, -60), (0, 60, 0), (0, 0, 120)), "metal"),),
        {"metal": RadioMaterial("metal", 1.0, 1e7, 0.002)},
    )


@pytest.mark.parametrize(
    ("distances", "degrees", "height", "bound"),
    [((8, 5), 60, 0.0, 0.02), ((8, 5), 20, 0.0, 0.02), ((3, 2), 60, 2.0, 0.05), ((2, 1), 110, 0.5, 0.04)],
)
def test_field_around_a_sheet_is_the_exact_one(distances, degrees, height, bound):
    source = around_edge(distances[0], degrees)
    positions = around_edge(distances[1], np.linspace(3.1, 357.2, 100), height)
    exact = half_plane_response(source, positions, 915e6)
    scene = half_plane(source, positions)
    error = {}
    for diffraction in (False, True):
        followed = Propagation(max_depth=1, diffraction=diffraction, rays=100_000)
        found = Tracer(scene, followed).responses(positions)[:, 0]
        error[diffraction] = np.linalg.norm(found - exact) / np.linalg.norm(exact)
    assert error[True] < bound and error[False] > 3 * error[True]
