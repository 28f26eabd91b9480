"""The built-in open-plan office, large, with partitions, columns and metal cabinets."""

from __future__ import annotations

from scenes.places.room import GAP, Finish, Opening, build_place, build_room, panel, table
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.orientation import facing
from scenes.scene.shapes import box

SIZE = (16.0, 10.0, 2.8)  # m
DESK_ROWS = (2.6, 6.0, 9.4)  # x of the partitions between two rows of desks


def office() -> Scene:
    """A 16 x 10 x 2.8 m open-plan office at 915 MHz.

    It has six groups of desks with partitions, two columns, a row of cabinets, and a meeting corner behind glass. The
    gateway hangs on the east wall. The transmitter moves in the aisle between the desks, partly out of line of sight.
    """
    openings = [Opening(f"window {n + 1}", "south", 1 + 3.8 * n, 3.8 + 3.8 * n, 0.9, 2.4) for n in range(4)]
    openings.append(Opening("door", "north", 14.0, 15.0, 0.0, 2.1, "wood", 0.04))
    furniture = []
    for number, x in enumerate(DESK_ROWS, start=1):
        for side, y in (("south", 1.2), ("north", 6.2)):
            name = f"{number} {side}"
            furniture += [
                SceneObject(f"desk {name}", table(x - 0.8, y, 1.6, 2.4), "wood"),
                SceneObject(f"partition {name}", panel(x, y + 1.2, 2.4, 0.8, 1.5, degrees=90), "plasterboard"),
                SceneObject(f"screen {name}", panel(x - 0.35, y + 0.7, 0.6, 0.82, 1.2, degrees=90), "metal"),
            ]
    furniture += [
        SceneObject("column west", box((4.1, 4.9, GAP), (4.5, 5.3, 2.8 - GAP)), "concrete"),
        SceneObject("column east", box((11.0, 4.6, GAP), (11.4, 5.0, 2.8 - GAP)), "concrete"),
        SceneObject("cabinets", box((5.0, 9.5, GAP), (9.0, 9.95, 1.4)), "metal"),
        SceneObject("copier", box((12.2, 9.2, GAP), (13.0, 9.9, 1.1)), "metal"),
        SceneObject("glass front", panel(12.2, 1.6, 3.1, 0.01, 2.5, degrees=90), "glass", thickness=0.012),
        SceneObject("glass side", panel(14.0, 3.2, 3.4, 0.01, 2.5), "glass", thickness=0.012),
        SceneObject("meeting table", table(13.2, 1.0, 1.8, 1.0), "chipboard"),
        SceneObject("bookcase", box((0.05, 6.0, GAP), (0.4, 9.0, 2.0)), "wood"),
        SceneObject("duct", box((1.0, 4.6, 2.4), (10.5, 5.0, 2.65)), "metal"),
    ]
    room = build_room(
        SIZE,
        openings,
        floor=Finish("concrete"),
        ceiling=Finish("concrete"),
        south=Finish("brick"),
        north=Finish("plasterboard", 0.10),
        west=Finish("concrete"),
        east=Finish("concrete"),
    )
    return build_place(
        "office",
        (*room, *furniture),
        Gateway((15.7, 5.5, 2.2), facing((-1.0, 0.0, -0.12)), pattern="tr38901"),
        Transmitter(region_min=(5.0, 3.8, 0.8), region_max=(9.0, 6.0, 1.6)),
    )
