"""The built-in conference room: a long table, a wall display, and a glass front."""

from __future__ import annotations

from scenes.places.room import GAP, Finish, Opening, build_place, build_room, panel, table
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.orientation import facing
from scenes.scene.shapes import box

SIZE = (10.0, 6.0, 2.8)  # m


def conference() -> Scene:
    """A 10 x 6 x 2.8 m conference room at 915 MHz.

    The gateway hangs under the ceiling above the display and looks along the table. The transmitter moves above the far
    half of the table and the seats around it. The wall to the corridor is of glass.
    """
    openings = [
        Opening("glass front", "south", 0.5, 7.5, 0.1, 2.5, "glass", 0.012),
        Opening("door", "south", 8.2, 9.2, 0.0, 2.1, "wood", 0.04),
        Opening("window left", "north", 1.0, 4.0, 0.9, 2.4),
        Opening("window right", "north", 5.5, 8.5, 0.9, 2.4),
    ]
    furniture = [
        SceneObject("conference table", table(2.6, 2.3, 5.0, 1.4), "chipboard"),
        SceneObject("display", panel(9.9, 3.0, 2.0, 0.9, 2.0, degrees=90), "metal"),
        SceneObject("whiteboard", panel(0.06, 3.0, 2.4, 0.9, 2.1, degrees=90), "metal"),
        SceneObject("credenza", box((4.0, 5.5, GAP), (6.0, 5.95, 0.8)), "wood"),
        SceneObject("refreshments", box((0.1, 4.9, GAP), (0.8, 5.9, 1.1)), "wood"),
        SceneObject("flip chart", panel(8.9, 5.2, 0.7, 0.8, 1.8, degrees=40), "metal"),
        SceneObject("radiator left", panel(2.5, 5.9, 2.0, 0.12, 0.72), "metal"),
        SceneObject("radiator right", panel(7.0, 5.9, 2.0, 0.12, 0.72), "metal"),
        SceneObject("lamp west", table(2.8, 2.8, 2.0, 0.4, 2.4), "metal"),
        SceneObject("lamp east", table(5.4, 2.8, 2.0, 0.4, 2.4), "metal"),
    ]
    room = build_room(
        SIZE,
        openings,
        floor=Finish("wood"),
        ceiling=Finish("concrete"),
        south=Finish("plasterboard", 0.10),
        north=Finish("concrete"),
        west=Finish("plasterboard", 0.10),
        east=Finish("brick"),
    )
    return build_place(
        "conference",
        (*room, *furniture),
        Gateway((9.7, 3.0, 2.3), facing((-1.0, 0.0, -0.2)), pattern="tr38901"),
        Transmitter(region_min=(2.2, 1.6, 0.8), region_max=(5.2, 4.4, 1.5)),
    )
