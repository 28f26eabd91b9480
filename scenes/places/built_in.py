"""The built-in places: rooms at 915 MHz. To add one, write its function and list it in ``BUILT_IN``."""

from __future__ import annotations

from collections.abc import Callable

from scenes.places.room import (
    BRICK,
    CONCRETE,
    GAP,
    PLASTERBOARD,
    WOOD,
    Opening,
    build_place,
    build_room,
    panel,
    shelf,
    table,
)
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.orientation import facing
from scenes.scene.shapes import box, sheet


def lab() -> Scene:
    """An 8 x 6 x 3 m laboratory at 915 MHz.

    The gateway hangs at one end and looks along −x. Its orientation is that of the gateway in NeRF²'s published data.
    The transmitter moves in a region of 1.6 x 1.3 x 0.9 m about 4.5 m away. Most of the region is in line of sight. The
    instrument rack shadows the part at large y.
    """
    openings = [
        Opening("window left", "south", 1.2, 2.9, 0.9, 2.4),
        Opening("window right", "south", 4.6, 6.3, 0.9, 2.4),
        Opening("door", "west", 0.8, 1.8, 0.0, 2.1, "wood", 0.04),
    ]
    furniture = [
        # Where the transmitter moves: two tables under the region, one monitor in it.
        SceneObject("table west", table(1.5, 2.5, 1.4, 0.7), "wood"),
        SceneObject("table middle", table(3.0, 2.2, 1.4, 0.7), "wood"),
        SceneObject("monitor", panel(3.2, 2.45, 0.6, 0.82, 1.17, degrees=110), "metal"),
        # Between the transmitter and the gateway.
        SceneObject("instrument rack", box((4.9, 3.22, GAP), (5.5, 3.82, 1.5)), "metal"),
        SceneObject("tool cabinet", box((5.2, 1.5, GAP), (6.1, 2.0, 0.85)), "metal"),
        # Along the south wall, under the windows.
        SceneObject("workbench", table(3.12, 0.12, 2.6, 0.7, 0.9), "chipboard"),
        SceneObject("radiator", panel(2.05, 0.1, 1.5, 0.12, 0.72), "metal"),
        # Along the north wall.
        SceneObject("whiteboard", panel(3.4, 5.96, 2.4, 0.92, 2.12), "metal"),
        SceneObject("desk", table(5.3, 5.1, 1.6, 0.8), "wood"),
        SceneObject("desk monitor", panel(6.1, 5.6, 0.6, 0.82, 1.17), "metal"),
        # Along the west and east walls.
        SceneObject("bookshelf", box((0.04, 3.6, GAP), (0.34, 4.8, 2.03)), "wood"),
        SceneObject("filing cabinet", box((0.05, 2.3, GAP), (0.55, 3.1, 1.3)), "metal"),
        SceneObject("locker", box((7.45, 4.6, GAP), (7.95, 5.5, 1.9)), "metal"),
        SceneObject("steel shelf", shelf(7.55, 0.4, 0.4, 1.5, (0.2, 0.75, 1.3, 1.85)), "metal"),
        # Above.
        SceneObject("lamp west", table(2.0, 2.8, 1.25, 0.4, 2.75), "metal"),
        SceneObject("lamp east", table(5.0, 2.8, 1.2, 0.4, 2.75), "metal"),
    ]
    room = build_room((8.0, 6.0, 3.0), openings, CONCRETE, CONCRETE, (BRICK, PLASTERBOARD, CONCRETE, CONCRETE))
    return build_place(
        "lab",
        (*room, *furniture),
        Gateway(
            position=(7.2, 3.0, 1.4),
            orientation=(0.51291602, -0.48674136, -0.48674136, 0.51291602),
            # Patch-like elements: a planar array of isotropic ones cannot tell the front from the back.
            pattern="tr38901",
        ),
        Transmitter(region_min=(1.9, 2.4, 0.8), region_max=(3.5, 3.7, 1.7)),
    )


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
    room = build_room((10.0, 6.0, 2.8), openings, WOOD, CONCRETE, (PLASTERBOARD, CONCRETE, PLASTERBOARD, BRICK))
    return build_place(
        "conference",
        (*room, *furniture),
        Gateway((9.7, 3.0, 2.3), facing((-1.0, 0.0, -0.2)), pattern="tr38901"),
        Transmitter(region_min=(2.2, 1.6, 0.8), region_max=(5.2, 4.4, 1.5)),
    )


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
    room = build_room((4.4, 3.6, 2.5), openings, WOOD, CONCRETE, (BRICK, PLASTERBOARD, PLASTERBOARD, BRICK))
    return build_place(
        "bedroom",
        (*room, *furniture),
        Gateway((0.3, 0.6, 1.9), facing((1.0, 0.45, -0.3)), pattern="tr38901"),
        Transmitter(region_min=(2.3, 1.0, 0.6), region_max=(3.9, 2.6, 1.4)),
    )


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
    room = build_room((16.0, 10.0, 2.8), openings, CONCRETE, CONCRETE, (BRICK, PLASTERBOARD, CONCRETE, CONCRETE))
    return build_place(
        "office",
        (*room, *furniture),
        Gateway((15.7, 5.5, 2.2), facing((-1.0, 0.0, -0.12)), pattern="tr38901"),
        Transmitter(region_min=(5.0, 3.8, 0.8), region_max=(9.0, 6.0, 1.6)),
    )


def closet() -> Scene:
    """A 3 x 2.5 x 2.4 m store room at 915 MHz, with furniture of one to three wavelengths.

    All antennas are short dipoles, which both the ray tracer and the full-wave solver support. Metal faces are at whole
    decimetres, so that they fit cells of 2 and 2.5 cm.
    """
    openings = [Opening("door", "west", 0.8, 1.7, 0.0, 2.0, "wood", 0.04)]
    furniture = [
        SceneObject("cabinet", box((1.6, 1.9, GAP), (2.2, 2.4, 1.6)), "metal"),
        SceneObject("panel", panel(1.7, 0.1, 1.0, 0.6, 1.4), "metal"),
        SceneObject("table", table(0.3, 0.2, 1.1, 0.6, 0.7), "wood"),
        SceneObject("shelf", shelf(0.2, 2.1, 1.2, 0.3, (0.5, 1.0, 1.8)), "wood"),
    ]
    room = build_room((3.0, 2.5, 2.4), openings, CONCRETE, CONCRETE, (BRICK, BRICK, BRICK, BRICK))
    return build_place(
        "closet",
        (*room, *furniture),
        Gateway((2.7, 1.2, 1.3), facing((-1.0, 0.0, 0.0)), pattern="dipole"),
        Transmitter(region_min=(0.4, 0.8, 0.8), region_max=(1.4, 1.8, 1.5), pattern="dipole"),
    )


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
    room = build_room((3.4, 2.8, 2.4), openings, CONCRETE, CONCRETE, (BRICK, BRICK, PLASTERBOARD, CONCRETE))
    return build_place(
        "workshop",
        (*room, *furniture),
        Gateway((3.1, 1.4, 1.5), facing((-1.0, 0.0, 0.0)), pattern="dipole"),
        Transmitter(region_min=(0.5, 0.9, 0.9), region_max=(1.5, 1.9, 1.6), pattern="dipole"),
    )


BUILT_IN: dict[str, Callable[[], Scene]] = {
    place.__name__: place for place in (lab, conference, bedroom, office, closet, workshop)
}
