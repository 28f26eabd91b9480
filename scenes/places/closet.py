"""The built-in closet, small enough for a full-wave simulation in half an hour."""

from __future__ import annotations

from scenes.places.room import GAP, Finish, Opening, build_place, build_room, panel, shelf, table
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.orientation import facing
from scenes.scene.shapes import box

SIZE = (3.0, 2.5, 2.4)  # m


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
    room = build_room(
        SIZE,
        openings,
        floor=Finish("concrete"),
        ceiling=Finish("concrete"),
        south=Finish("brick"),
        north=Finish("brick"),
        west=Finish("brick"),
        east=Finish("brick"),
    )
    return build_place(
        "closet",
        (*room, *furniture),
        Gateway((2.7, 1.2, 1.3), facing((-1.0, 0.0, 0.0)), pattern="dipole"),
        Transmitter(region_min=(0.4, 0.8, 0.8), region_max=(1.4, 1.8, 1.5), pattern="dipole"),
    )
