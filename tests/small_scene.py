"""A small scene for tests: a gateway above a floor, transmitters two to three metres away, and what a test adds."""

from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.materials import p2040_materials
from scenes.scene.orientation import facing
from scenes.scene.shapes import box, sheet

CABINET = SceneObject("cabinet", box((1.0, 1.5, 0.001), (3.0, 2.0, 3.0)), "metal")


def small_scene(*objects: SceneObject) -> Scene:
    """The floor and these objects, of concrete or metal, at 915 MHz."""
    return Scene(
        name="small",
        frequency=915e6,
        gateway=Gateway((0, 0, 1.5), facing((1, 0.2, 0))),
        transmitter=Transmitter((2.0, -0.5, 1.0), (3.0, 0.5, 1.6)),
        objects=(SceneObject("floor", sheet((-9, -9, 0), (18, 0, 0), (0, 18, 0)), "concrete"), *objects),
        materials=p2040_materials(["concrete", "metal"], 915e6),
    )
