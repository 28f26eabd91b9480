"""What the search for chains leaves out."""

import numpy as np
import pytest

from scenes.places.built_in import lab
from scenes.places.random_room import random_room
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.materials import p2040_materials
from scenes.scene.orientation import facing
from scenes.scene.shapes import box, sheet
from simulate.positions.placement import free_positions
from simulate.rays.core.propagation import Propagation
from simulate.rays.diffraction import arm_search, search
from simulate.rays.tracer import Tracer

pytestmark = pytest.mark.slow


def street() -> Scene:
    """Twelve houses with metal roofs along a road."""
    objects = [SceneObject("ground", sheet((-60, -40, 0), (120, 0, 0), (0, 80, 0)), "concrete")]
    generator = np.random.default_rng(0)
    for number in range(12):
        low = np.array([-50 + 18 * (number // 2), 8 if number % 2 else -18, 0.0])
        high = low + generator.uniform((8, 8, 6), (12, 12, 15))
        roof = np.diag(high - low)
        objects.append(SceneObject(f"house {number}", box((*low[:2], 0.01), (*high[:2], high[2] - 0.2)), "brick"))
        objects.append(SceneObject(f"roof {number}", sheet((*low[:2], high[2]), roof[0], roof[1]), "metal"))
    gateway = Gateway((0, 0, 12), facing((1, 0, -0.3)), pattern="iso")
    region = Transmitter((15, -5, 1), (30, 25, 2))
    materials = p2040_materials(["concrete", "brick", "metal"], 3.5e9)
    return Scene("street", 3.5e9, gateway, region, tuple(objects), materials)


@pytest.mark.parametrize(
    "scene", [lab(), *(random_room(seed) for seed in (1, 3, 5)), street()], ids=lambda scene: scene.name
)
def test_chains_that_are_never_solved_carry_next_to_nothing(scene, monkeypatch):
    """Against a search that tries every sequence at every edge, with the same rays and positions."""
    positions = free_positions(scene, scene.transmitter.region, 40, np.random.default_rng(7))
    followed = Propagation(rays=200_000)
    found = Tracer(scene, followed).responses(positions)
    for name, value in (("STRONGER", 1e30), ("MOST", 10**9), ("MOST_LINKED", 10**9), ("TURNED", 1e30)):
        monkeypatch.setattr(search, name, value)
    for name, value in (("MOST_ARMS", 10**9), ("LEAST", 200), ("MOST", 10**9)):
        monkeypatch.setattr(arm_search, name, value)
    everything = Tracer(scene, followed).responses(positions)
    error = (np.abs(found - everything) ** 2).sum() / (np.abs(everything) ** 2).sum()
    assert error < 10**-3.5
