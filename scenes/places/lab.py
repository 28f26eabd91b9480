"""The built-in laboratory, a furnished room like the one in which NeRF² was measured."""

from __future__ import annotations

from scenes.places.room import GAP, Finish, Opening, build_place, build_room, panel, shelf, table
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.shapes import box

SIZE = (8.0, 6.0, 3.0)  # m


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
