"""The built-in laboratory: a furnished room like the one NeRF² was measured in."""

from __future__ import annotations

from trimesh import Trimesh

from scenes.description import Gateway, Scene, SceneObject, Transmitter
from scenes.materials import p2040_material
from scenes.shapes import box, cylinder, sheet, turned, union

FREQUENCY = 915e6  # Hz, the RFID band of NeRF²'s measurements
LENGTH, WIDTH, HEIGHT = 8.0, 6.0, 3.0  # m, along x, y, z; the floor is z = 0
# Nothing touches: surfaces in one plane would be hit in an arbitrary order.
GAP = 0.002  # m


def table(x: float, y: float, length: float, width: float, height: float = 0.74) -> Trimesh:
    """A board on four legs, its lower left corner at (x, y)."""
    legs = [
        box((lx, ly, GAP), (lx + 0.05, ly + 0.05, height - 0.03 - GAP))
        for lx in (x + 0.03, x + length - 0.08)
        for ly in (y + 0.03, y + width - 0.08)
    ]
    return union(box((x, y, height - 0.03), (x + length, y + width, height)), *legs)


def chair(x: float, y: float, degrees: float) -> Trimesh:
    """Seat, back and a post, centred on (x, y); the back is at −x before it is turned."""
    seat = box((x - 0.22, y - 0.22, 0.44), (x + 0.22, y + 0.22, 0.48))
    back = box((x - 0.22, y - 0.20, 0.48 + GAP), (x - 0.19, y + 0.20, 0.95))
    post = box((x - 0.04, y - 0.04, GAP), (x + 0.04, y + 0.04, 0.44 - GAP))
    return turned(union(seat, back, post), degrees)


def shelf(x: float, y: float, width: float, depth: float, height: float, boards: int) -> Trimesh:
    """Boards between two sides, open to the front and the back; `width` runs along y, `depth` along x."""
    side = 0.02
    sides = [box((x, sy, GAP), (x + depth, sy + side, height)) for sy in (y, y + width - side)]
    levels = [height * (0.05 + 0.9 * k / (boards - 1)) for k in range(boards)]
    inner = (y + side + GAP, y + width - side - GAP)
    return union(*sides, *(box((x, inner[0], z), (x + depth, inner[1], z + 0.02)) for z in levels))


def monitor(x: float, y: float, on: float, degrees: float) -> Trimesh:
    """A 24-inch screen on a foot that stands on a table of height `on`."""
    screen = box((x - 0.02, y - 0.27, on + 0.12), (x + 0.02, y + 0.27, on + 0.45))
    foot = box((x - 0.10, y - 0.12, on + GAP), (x + 0.10, y + 0.12, on + 0.015))
    neck = box((x - 0.015, y - 0.03, on + 0.015 + GAP), (x + 0.015, y + 0.03, on + 0.12 - GAP))
    return turned(union(screen, foot, neck), degrees)


def stand(x: float, y: float, height: float) -> Trimesh:
    """A round foot and a pole."""
    foot = cylinder((x, y, GAP), radius=0.25, height=0.02)
    return union(foot, cylinder((x, y, 0.02 + 2 * GAP), radius=0.02, height=height - 0.02 - 2 * GAP))


# Openings of the walls: (from, to, bottom, top) in metres. Window panes and the door sit 5 cm behind them and
# are 5 cm larger, so that nothing lies in the wall's plane and no ray slips past.
DOOR = (0.8, 1.8, 0.0, 2.1)
WINDOWS = ((1.2, 2.9, 0.9, 2.4), (4.6, 6.3, 0.9, 2.4))


def pane(opening: tuple[float, float, float, float]) -> Trimesh:
    """The glass of a window in the wall y = 0."""
    x0, x1, z0, z1 = opening
    return sheet((x0 - 0.05, -0.05, z0 - 0.05), (x1 - x0 + 0.1, 0, 0), (0, 0, z1 - z0 + 0.1))


def lab() -> Scene:
    """An 8 x 6 x 3 m laboratory at 915 MHz.

    The gateway stands at one end and looks along −x with the orientation of NeRF²'s released gateway; the
    transmitter moves in 1.6 x 1.3 x 0.9 m about 4.5 m away. Most of the region is in line of sight; the
    instrument rack shadows the part at large y.
    """
    x, y, z = (LENGTH, 0, 0), (0, WIDTH, 0), (0, 0, HEIGHT)  # the edges at the corner (0, 0, 0)
    south = [(z0, z1, x0, x1) for x0, x1, z0, z1 in WINDOWS]
    door = sheet((-0.05, DOOR[0] - 0.05, GAP), (0, 1.1, 0), (0, 0, 2.15))
    shell = [
        SceneObject("floor", sheet((0, 0, 0), x, y), "concrete"),
        SceneObject("ceiling", sheet((0, 0, HEIGHT), y, x), "concrete"),
        SceneObject("wall south", sheet((0, 0, 0), z, x, south), "brick"),
        SceneObject("wall north", sheet((0, WIDTH, 0), x, z), "plasterboard", thickness=0.10),
        SceneObject("wall west", sheet((0, 0, 0), y, z, [DOOR]), "concrete"),
        SceneObject("wall east", sheet((LENGTH, 0, 0), z, y), "concrete"),
        SceneObject("window left", pane(WINDOWS[0]), "glass"),
        SceneObject("window right", pane(WINDOWS[1]), "glass"),
        SceneObject("door", door, "wood", thickness=0.04),
    ]
    furniture = [
        # Where the transmitter moves: two tables under the region, one monitor reaching into it.
        SceneObject("table west", table(1.5, 2.5, length=1.4, width=0.7), "wood"),
        SceneObject("table middle", table(3.0, 2.2, length=1.4, width=0.7), "wood"),
        SceneObject("monitor", monitor(3.2, 2.45, on=0.74, degrees=20), "metal"),
        SceneObject("chair west", chair(1.2, 2.9, degrees=10), "plywood"),
        SceneObject("chair middle", chair(3.9, 3.3, degrees=-100), "plywood"),
        # Between the transmitter and the gateway.
        SceneObject("instrument rack", box((4.9, 3.22, GAP), (5.5, 3.82, 1.5)), "metal"),
        SceneObject("trolley", table(5.2, 1.5, length=0.9, width=0.5, height=0.85), "metal"),
        SceneObject("instrument", box((5.4, 1.6, 0.85 + GAP), (5.85, 1.95, 1.10)), "metal"),
        # Along the south wall, under the windows.
        SceneObject("workbench", table(3.12, 0.12, length=2.6, width=0.7, height=0.9), "chipboard"),
        SceneObject("oscilloscope", box((3.3, 0.3, 0.9 + GAP), (3.7, 0.6, 1.15)), "metal"),
        SceneObject("radiator", box((1.3, 0.05, 0.12), (2.8, 0.13, 0.72)), "metal"),
        # Along the north wall.
        SceneObject("whiteboard", box((2.2, 5.95, 0.92), (4.6, 5.97, 2.12)), "metal"),
        SceneObject("desk", table(5.3, 5.1, length=1.6, width=0.8), "wood"),
        SceneObject("desk monitor", monitor(6.1, 5.6, on=0.74, degrees=90), "metal"),
        SceneObject("desk chair", chair(6.1, 4.7, degrees=85), "plywood"),
        # Along the west and east walls.
        SceneObject("bookshelf", shelf(0.04, 3.6, width=1.2, depth=0.3, height=2.03, boards=6), "wood"),
        SceneObject("filing cabinet", box((0.05, 2.3, GAP), (0.55, 3.1, 1.3)), "metal"),
        SceneObject("locker", box((7.45, 4.6, GAP), (7.95, 5.5, 1.9)), "metal"),
        SceneObject("steel shelf", shelf(7.55, 0.4, width=1.5, depth=0.4, height=1.8, boards=4), "metal"),
        SceneObject("gateway stand", stand(7.2, 3.0, height=1.1), "metal"),
        SceneObject("lamp west", box((2.0, 2.85, 2.75), (3.25, 3.15, 2.82)), "metal"),
        SceneObject("lamp east", box((5.0, 2.85, 2.75), (6.2, 3.15, 2.82)), "metal"),
    ]
    objects = (*shell, *furniture)
    return Scene(
        name="lab",
        frequency=FREQUENCY,
        gateway=Gateway(
            position=(7.2, 3.0, 1.4),
            orientation=(0.51291602, -0.48674136, -0.48674136, 0.51291602),
            # Patch-like elements: a plane array of isotropic ones would take the back of the room for the front.
            pattern="tr38901",
        ),
        transmitter=Transmitter(region_min=(1.9, 2.4, 0.8), region_max=(3.5, 3.7, 1.7)),
        objects=objects,
        materials={name: p2040_material(name, FREQUENCY) for name in sorted({o.material for o in objects})},
    )
