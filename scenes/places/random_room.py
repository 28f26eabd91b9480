"""Random furnished rooms, for judging rays and models in rooms that nobody tuned them to.

A seed decides everything: size, materials, doors and windows, furniture, the gateway's place and direction, and the
transmitter region. The rooms are small, two to four metres, so that full wave solves them in minutes. All antennas are
short dipoles, which rays and full wave support both.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from scenes.checks.validation import validate
from scenes.files.errors import require_seed, require_whole
from scenes.places.furniture import KINDS, Kind, placed
from scenes.places.room import GAP, Finish, Opening, Side, build_place, build_room
from scenes.scene.description import Gateway, Scene, SceneObject, Transmitter, facing
from scenes.scene.shapes import bounding_box

LENGTH, WIDTH, HEIGHT = (2.8, 4.0), (2.4, 3.2), (2.3, 2.7)
"""Ranges of a room's extents, metres."""

WALLS = (Finish("concrete"), Finish("brick"), Finish("brick"), Finish("plasterboard", 0.10), Finish("wood", 0.06))
FLOORS = Finish("concrete"), Finish("wood", 0.04)
CEILINGS = Finish("concrete"), Finish("concrete"), Finish("plasterboard", 0.04)
"""Finishes to draw from. Bricks and concrete ceilings are more frequent."""

MOST_PIECES, TRIES = 12, 40
"""Largest number of pieces to ask for; places that are tried for a piece before it is left out."""

REGION = 1.0, 1.0, 0.8
"""Extents of the transmitter region, metres."""

RASTER = 0.025
"""Sizes of rooms are multiples of twice this length, and flat metal that is not turned has its corners at multiples, so
that full wave with cells of this size puts them where they are, metres."""

CLEARANCE, NEAR_GATEWAY = 0.06, 0.36
"""Distances that pieces keep from each other and from the region, and from the gateway, metres."""

TURNS: dict[Side, float] = {"north": 0, "west": 90, "south": 180, "east": 270}
"""Rotation of a piece whose back is at a wall, degrees."""


@dataclass
class _Room:
    """A room that is being furnished.

    Attributes:
        size: extents, metres.
        keep_free: boxes [2, 3] that no further piece may touch.
        generator: draws everything.
    """

    size: Float[np.ndarray, " 3"]
    keep_free: list[Float[np.ndarray, "2 3"]]
    generator: np.random.Generator

    def place(self, kind: Kind) -> SceneObject | None:
        """A piece at a free place. None: there was none in ``TRIES`` tries."""
        for _ in range(TRIES):
            mesh = kind.make(self.generator)
            degrees, foot = self._somewhere(kind)
            mesh = placed(mesh, degrees, foot)
            if kind.flat_metal:
                mesh.vertices = (RASTER * np.round(mesh.vertices / RASTER)).clip(GAP, self.size - GAP)
            bounds = bounding_box(mesh.vertices)
            if (bounds[0] >= GAP).all() and (bounds[1] <= self.size - GAP).all() and not self._taken(bounds):
                self.keep_free.append(bounds + np.array([[-CLEARANCE], [CLEARANCE]]))
                return SceneObject(kind.name, mesh, kind.material)
        return None

    def _somewhere(self, kind: Kind) -> tuple[float, Float[np.ndarray, " 3"]]:
        """A random rotation and foot of a piece."""
        low = self.generator.uniform(*kind.lowest)
        x, y = self.generator.uniform(0, self.size[:2])
        if kind.place == "ceiling":
            return float(self.generator.choice([0, 90])), np.array([x, y, self.size[2] - low])
        if kind.place == "free":
            degrees = self.generator.uniform(0, 360) if kind.turned else 90 * self.generator.integers(4)
            return float(degrees), np.array([x, y, low])
        side: Side = self.generator.choice(list(TURNS))
        behind = 0.01 if kind.place == "on the wall" else self.generator.uniform(0.01, 0.06)
        at = {"north": (x, self.size[1] - behind), "south": (x, behind), "west": (behind, y)}
        return TURNS[side], np.array([*at.get(side, (self.size[0] - behind, y)), low])

    def _taken(self, bounds: Float[np.ndarray, "2 3"]) -> bool:
        return any((bounds[0] < other[1]).all() and (other[0] < bounds[1]).all() for other in self.keep_free)


def random_room(seed: int, pieces: tuple[int, int] = (3, 9)) -> Scene:
    """Make a random furnished room.

    Args:
        seed: decides everything; rooms of the same version and seed are equal.
        pieces: least and largest number of pieces of furniture to draw, 0 to 12. A piece that finds no place is left
            out.

    Returns:
        A checked scene "room N" at 915 MHz.

    Raises:
        ParameterError: the seed or a number of pieces is not valid.

    Example:
        >>> room = random_room(1)
        >>> room.name, room.gateway == random_room(1).gateway, room.gateway == random_room(2).gateway
        ('room 1', True, False)
    """
    require_seed(seed=seed)
    for number in pieces:
        require_whole(0, MOST_PIECES, pieces=number)
    generator = np.random.default_rng(seed)
    size = 2 * RASTER * np.round([generator.uniform(*each) / (2 * RASTER) for each in (LENGTH, WIDTH, HEIGHT)])
    finishes = [WALLS[number] for number in generator.integers(len(WALLS), size=4)]
    floor, ceiling = FLOORS[generator.integers(len(FLOORS))], CEILINGS[generator.integers(len(CEILINGS))]
    openings = _openings(size, generator)
    gateway, transmitter = _antennas(size, generator)
    around = np.array([[-1.0], [1.0]])
    of_antennas = [
        transmitter.region + CLEARANCE * around,
        np.array(gateway.position) + NEAR_GATEWAY * around,
    ]
    room = _Room(size, [*of_antennas, *(_before(opening, size) for opening in openings)], generator)
    wanted = int(generator.integers(pieces[0], pieces[1] + 1))
    kinds = [KINDS[number] for number in generator.permutation(len(KINDS))[:wanted]]
    furniture = [piece for piece in map(room.place, kinds) if piece is not None]
    south, north, west, east = finishes
    walls = build_room(
        tuple(size.tolist()), openings, floor=floor, ceiling=ceiling, south=south, north=north, west=west, east=east
    )
    scene = build_place(f"room {seed}", (*walls, *furniture), gateway, transmitter)
    validate(scene, scene.name)
    return scene


def _openings(size: Float[np.ndarray, " 3"], generator: np.random.Generator) -> list[Opening]:
    """A door, and perhaps a window in another wall."""
    sides: list[Side] = generator.permutation(list(TURNS)).tolist()

    def along(side: Side, width: float) -> tuple[float, float]:
        length = size[0] if side in ("south", "north") else size[1]
        start = generator.uniform(0.15, length - width - 0.15)
        return round(float(start), 2), round(float(start + width), 2)

    door = Opening("door", sides[0], *along(sides[0], 0.85), 0.0, 2.0, str(generator.choice(["wood", "glass"])), 0.04)
    if generator.random() < 0.3:
        return [door]
    width = generator.uniform(0.8, 1.4)
    return [door, Opening("window", sides[1], *along(sides[1], width), 0.9, 2.0, "glass")]


def _antennas(size: Float[np.ndarray, " 3"], generator: np.random.Generator) -> tuple[Gateway, Transmitter]:
    """The gateway near a wall or in a corner, looking obliquely, and a region at least 0.6 m away from it."""
    while True:
        low = generator.uniform([0.3, 0.3, 0.4], size - np.array(REGION) - [0.3, 0.3, 0.4])
        region = np.array([low, low + REGION]).round(2)
        place = generator.uniform([0.36, 0.36, 0.8], size - 0.36).round(2)
        outside = np.maximum(region[0] - place, place - region[1]).clip(0)
        from_walls = np.minimum(place, size - place)[:2].min()
        if np.linalg.norm(outside) > 0.6 and from_walls < 0.6:
            break
    towards = region.mean(axis=0) - place
    azimuth = np.arctan2(towards[1], towards[0]) + np.radians(generator.uniform(-40, 40))
    elevation = np.radians(generator.uniform(-35, 15))
    look = (np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation))
    gateway = Gateway(tuple(place.tolist()), facing(look), pattern="dipole")
    return gateway, Transmitter(tuple(region[0].tolist()), tuple(region[1].tolist()), "dipole")


def _before(opening: Opening, size: Float[np.ndarray, " 3"]) -> Float[np.ndarray, "2 3"]:
    """The space of 12 cm before an opening, where nothing stands."""
    across = 1 if opening.side in ("south", "north") else 0
    low, high = np.zeros(3), size.copy()
    low[1 - across], high[1 - across] = opening.start, opening.end
    low[2], high[2] = opening.bottom, opening.top
    if opening.side in ("south", "west"):
        high[across] = 0.12
    else:
        low[across] = size[across] - 0.12
    return np.array([low, high])
