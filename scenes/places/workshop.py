"""The built-in workshop, as small as the closet and full of metal."""

from __future__ import annotations

from scenes.places.room import GAP, Finish, Opening, build_place, build_room, panel, shelf, table
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.orientation import facing
from scenes.scene.shapes import box, sheet

SIZE = (3.4, 2.8, 2.4)  # m


def workshop() -> Scene:
    """A 3.4 x 2.8 x 2.4 m workshop at 915 MHz: steel lockers and shelves, and a trolley in the line of sight.

    As in the closet, all antennas are short dipoles, and metal faces are at whole decimetres, so that they fit cells of
    2 and 2.5 cm.
    """
    openings = [
        Opening("door", "west", 0.3, 1.2, 0.0, 2.0, "wood", 0.04),
        Opening("window", "north", 0.4, 1.6, 0.9, 2.0),
    ]
    furniture = [
        SceneObject("locker", box((2.0, 2.2, GAP), (2.5, 2.7, 1.8)), "metal"),
        SceneObject("tool cabinet", box((1.9, 0.2, GAP), (2.5, 0.6, 0.9)), "metal"),
        SceneObject("trolley", box((1.8, 1.1, 0.3), (2.2, 1.6, 0.7)), "metal"),
        SceneObject("steel shelf", shelf(0.3, 2.3, 1.2, 0.4, (0.4, 0.9, 1.4, 1.9)), "metal"),
        SceneObject("tool board", panel(1.2, 0.1, 1.0, 1.1, 1.7), "metal"),
        SceneObject("lamp", sheet((0.8, 1.2, 2.2), (1.2, 0, 0), (0, 0.3, 0)), "metal"),
        SceneObject("workbench", table(0.7, 0.1, 1.0, 0.6, 0.8), "chipboard"),
        SceneObject("crate", box((0.1, 1.4, GAP), (0.4, 2.0, 0.6)), "wood"),
    ]
    room = build_room(
        SIZE,
        openings,
        floor=Finish("concrete"),
        ceiling=Finish("concrete"),
        south=Finish("brick"),
        north=Finish("brick"),
        west=Finish("plasterboard", 0.10),
        east=Finish("concrete"),
    )
    return build_place(
        "workshop",
        (*room, *furniture),
        Gateway((3.1, 1.4, 1.5), facing((-1.0, 0.0, 0.0)), pattern="dipole"),
        Transmitter(region_min=(0.5, 0.9, 0.9), region_max=(1.5, 1.9, 1.6), pattern="dipole"),
    )
