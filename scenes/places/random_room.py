"""Random furnished rooms, for judging rays and models in rooms that nobody tuned them to.

A seed decides everything: size, materials, doors and windows, furniture, the gateway's place and direction, and the
transmitter region. The rooms are small, two to four metres, so that full wave solves them in minutes; larger ones and
L-shaped ones are made on demand. All antennas are short dipoles, which rays and full wave support both.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import count
from typing import Literal, get_args

import numpy as np
from jaxtyping import Float

from scenes.checks.validation import validate
from scenes.files.errors import require_flag, require_seed, require_whole, require_word
from scenes.places.furniture import KINDS, Kind, placed
from scenes.places.room import BRICK, CONCRETE, GAP, PLASTERBOARD, Finish, Opening, Side, build_place, build_room
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.orientation import facing
from scenes.scene.shapes import bounding_box

Shape = Literal["rectangle", "l"]  # Outline of a room: a rectangle, or one that lacks a corner

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class _Sizes:
    extents: tuple[tuple[float, float], ...]  # ranges of length, width and height, metres
    region: Vector  # extents of the transmitter region, metres


SMALL = _Sizes(((2.8, 4.0), (2.4, 3.2), (2.3, 2.7)), (1.0, 1.0, 0.8))
MOST_DRAWS = 20_000
"""Largest number of places that are drawn for gateway and region, until both are in the room."""

LARGE = _Sizes(((4.5, 8.0), (4.0, 6.0), (2.4, 3.0)), (2.0, 2.0, 1.0))

INNER = 0.55, 0.75  # Range of the inner corner of an L-shaped room, as shares of its length and width

WALLS = CONCRETE, BRICK, BRICK, PLASTERBOARD, Finish("wood", 0.06)
FLOORS = CONCRETE, Finish("wood", 0.04)
CEILINGS = CONCRETE, CONCRETE, Finish("plasterboard", 0.04)
"""Finishes to draw from. Bricks and concrete ceilings are more frequent."""

MOST_PIECES, TRIES = 12, 40
"""Largest number of pieces to ask for; places that are tried for a piece before it is left out."""

RASTER = 0.025
"""Sizes of rooms are multiples of twice this length, and flat metal that is not turned has its corners at multiples, so
that full wave with cells of this size puts them where they are, metres."""

CLEARANCE, NEAR_GATEWAY = 0.06, 0.36
"""Distances that pieces keep from each other and from the region, and from the gateway, metres."""

TURNS: dict[Side, float] = {"north": 0, "west": 90, "south": 180, "east": 270}
"""Rotation of a piece whose back is at a wall, degrees."""


@dataclass(frozen=True)
class _Outline:
    size: Float[np.ndarray, " 3"]  # extents, metres
    # x and y of the inner corner, metres; the room lacks what is beyond both. In a rectangle, there is nothing
    # beyond.
    inner: Float[np.ndarray, " 2"]

    @property
    def outside(self) -> list[Float[np.ndarray, "2 3"]]:
        """The box that an L-shaped room lacks; none of a rectangle."""
        box = np.array([[*self.inner, 0.0], self.size])
        return [box] if (box[0] < box[1]).all() else []

    def touches_outside(self, bounds: Float[np.ndarray, "2 3"], margin: float) -> bool:
        """Whether a box is nearer to what an L-shaped room lacks than a margin, metres."""
        return bool(self.outside) and bool((bounds[1, :2] > self.inner - margin).all())

    def wall(self, side: Side) -> float:
        """Length of the wall that has the openings of a side, metres."""
        return float({"north": self.inner[0], "east": self.inner[1], "south": self.size[0], "west": self.size[1]}[side])


def _on_raster(lengths: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """Lengths rounded to multiples of twice ``RASTER``, metres."""
    return 2 * RASTER * np.round(lengths / (2 * RASTER))


@dataclass
class _Room:
    """A room that is being furnished."""

    size: Float[np.ndarray, " 3"]  # extents, metres
    keep_free: list[Float[np.ndarray, "2 3"]]  # boxes [2, 3] that no further piece may touch
    generator: np.random.Generator  # draws everything

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


def random_room(
    seed: int,
    pieces: tuple[int, int] = (3, 9),
    *,
    furniture: int | None = None,
    shape: Shape = "rectangle",
    large: bool = False,
) -> Scene:
    require_seed(seed=seed)
    if furniture is not None:
        require_seed(furniture=furniture)
    require_word(get_args(Shape), shape=shape)
    require_flag(large=large)
    for number in pieces:
        require_whole(0, MOST_PIECES, pieces=number)
    sizes = LARGE if large else SMALL
    for attempt in count():  # in a few L-shaped rooms there is no place for the region; then another room is drawn
        generator = np.random.default_rng([seed, 0, attempt] if attempt else seed)
        size = _on_raster(np.array([generator.uniform(*each) for each in sizes.extents]))
        outline = _Outline(size, _on_raster(size[:2] * generator.uniform(*INNER, size=2)) if shape == "l" else size[:2])
        finishes = [WALLS[number] for number in generator.integers(len(WALLS), size=4)]
        floor, ceiling = FLOORS[generator.integers(len(FLOORS))], CEILINGS[generator.integers(len(CEILINGS))]
        openings = _openings(outline, generator)
        if antennas := _antennas(outline, np.array(sizes.region), generator):
            gateway, transmitter = antennas
            break
    if furniture is not None:
        generator = np.random.default_rng([seed, furniture])
    around = np.array([[-1.0], [1.0]])
    of_antennas = [transmitter.region + CLEARANCE * around, np.array(gateway.position) + NEAR_GATEWAY * around]
    before = [_before(opening, size) for opening in openings]
    room = _Room(size, [*of_antennas, *before, *outline.outside], generator)
    wanted = int(generator.integers(pieces[0], pieces[1] + 1))
    kinds = [KINDS[number] for number in generator.permutation(len(KINDS))[:wanted]]
    placed_pieces = [piece for piece in map(room.place, kinds) if piece is not None]
    inner_corner = tuple(outline.inner.tolist()) if shape == "l" else None
    walls = build_room(tuple(size.tolist()), openings, floor, ceiling, finishes, inner_corner)
    scene = build_place(f"room {seed}", (*walls, *placed_pieces), gateway, transmitter)
    validate(scene, scene.name)
    return scene


def _openings(outline: _Outline, generator: np.random.Generator) -> list[Opening]:
    """A door, and perhaps a window in another wall."""
    sides: list[Side] = generator.permutation(list(TURNS)).tolist()

    def along(side: Side, width: float) -> tuple[float, float]:
        start = generator.uniform(0.15, outline.wall(side) - width - 0.15)
        return round(float(start), 2), round(float(start + width), 2)

    door = Opening("door", sides[0], *along(sides[0], 0.85), 0.0, 2.0, str(generator.choice(["wood", "glass"])), 0.04)
    if generator.random() < 0.3:
        return [door]
    width = min(generator.uniform(0.8, 1.4), outline.wall(sides[1]) - 0.4)
    return [door, Opening("window", sides[1], *along(sides[1], width), 0.9, 2.0, "glass")]


def _antennas(
    outline: _Outline, extents: Float[np.ndarray, " 3"], generator: np.random.Generator
) -> tuple[Gateway, Transmitter] | None:
    """The gateway near a wall or in a corner, looking obliquely, and a region at least 0.6 m away from it."""
    size = outline.size
    for _ in range(MOST_DRAWS):
        low = generator.uniform([0.3, 0.3, 0.4], size - extents - [0.3, 0.3, 0.4])
        region = np.array([low, low + extents]).round(2)
        place = generator.uniform([0.36, 0.36, 0.8], size - 0.36).round(2)
        outside = np.maximum(region[0] - place, place - region[1]).clip(0)
        from_walls = np.minimum(place, size - place)[:2].min()
        if outline.touches_outside(region, 0.3) or outline.touches_outside(np.array([place, place]), 0.36):
            continue
        if np.linalg.norm(outside) > 0.6 and from_walls < 0.6:
            break
    else:
        return None
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
