"""The built-in bedroom, small and mostly of wood."""

from __future__ import annotations

from scenes.places.room import GAP, Finish, Opening, build_place, build_room, panel, shelf, table
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.orientation import facing
from scenes.scene.shapes import box

SIZE = (4.4, 3.6, 2.5)  # m


def bedroom() -> Scene:
    """A 4.4 x 3.6 x 2.5 m bedroom at 915 MHz.

    The gateway hangs on the wall by the window. Everything is within a few metres of it, in the near field of its
    array. The transmitter moves above the bed.
    """
    openings = [
        Opening("window", "south", 1.4, 2.8, 0.9, 2.1),
        Opening("door", "north", 0.3, 1.15, 0.0, 2.05, "wood", 0.04),
    ]
    furniture = [
        SceneObject("bed", box((2.2, 1.0, 0.25), (4.35, 2.6, 0.5)), "wood"),
        SceneObject("headboard", panel(4.37, 1.8, 1.6, 0.2, 1.1, degrees=90), "wood"),
        SceneObject("wardrobe", box((1.5, 3.0, GAP), (3.3, 3.57, 2.1)), "chipboard"),
        SceneObject("chest of drawers", box((0.05, 1.2, GAP), (0.5, 2.2, 0.9)), "wood"),
        SceneObject("mirror", panel(0.04, 1.7, 0.8, 1.1, 1.9, degrees=90), "metal"),
        SceneObject("desk", table(0.2, 0.1, 1.1, 0.6), "wood"),
        SceneObject("bookshelf", shelf(3.5, 0.03, 0.8, 0.35, (0.9, 1.3, 1.7)), "wood"),
        SceneObject("radiator", panel(2.1, 0.08, 1.2, 0.15, 0.75), "metal"),
    ]
    room = build_room(
        SIZE,
        openings,
        floor=Finish("wood"),
        ceiling=Finish("concrete"),
        south=Finish("brick"),
        north=Finish("plasterboard", 0.10),
        west=Finish("plasterboard", 0.10),
        east=Finish("brick"),
    )
    return build_place(
        "bedroom",
        (*room, *furniture),
        Gateway((0.3, 0.6, 1.9), facing((1.0, 0.45, -0.3)), pattern="tr38901"),
        Transmitter(region_min=(2.3, 1.0, 0.6), region_max=(3.9, 2.6, 1.4)),
    )
