"""A small scene that the tests change one thing of."""

import pytest

from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.materials import p2040_material
from scenes.scene.shapes import box, sheet

FREQUENCY = 915e6


@pytest.fixture
def scene() -> Scene:
    """A floor and a crate, the gateway at (4, 0, 1), the transmitter's region around the origin."""
    return Scene(
        name="outdoors",
        frequency=FREQUENCY,
        gateway=Gateway(position=(4.0, 0.0, 1.0), orientation=(0.5, -0.5, -0.5, 0.5)),
        transmitter=Transmitter(region_min=(-1.0, -1.0, 0.5), region_max=(1.0, 1.0, 1.5)),
        objects=(
            SceneObject("floor", sheet((-5, -5, 0), (10, 0, 0), (0, 10, 0)), "concrete", thickness=0.3),
            SceneObject("crate", box((0.1, 0.2, 0.1), (1.1, 1.3, 1 / 3)), "wood"),
        ),
        materials={name: p2040_material(name, FREQUENCY) for name in ("concrete", "wood")},
    )
