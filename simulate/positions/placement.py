"""Transmitter positions, drawn at random, on a grid or along a smooth path, or given in a CSV; never inside objects."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from scenes.checks.occupancy import blocking_object, inside_object
from scenes.files.errors import InputError, ParameterError
from scenes.scene.description import Scene
from simulate.positions.positions import LEAST_POSITIONS, Places, check_points, read_points

PATH_STEP = 0.008
"""Metres between consecutive positions of a path. It is the median step of the measured RFID data."""


AT_IT = np.zeros((1, 3))  # A single antenna, at the position itself


def place(
    scene: Scene, kind: str, count: int, seed: int, offsets: Float[np.ndarray, "antennas 3"] = AT_IT
) -> Float[np.ndarray, "count 3"]:
    """Choose positions in the scene's region such that no antenna is inside an object or outside the region."""
    generator = np.random.default_rng(seed)
    region = scene.transmitter.region - np.stack([offsets.min(axis=0), offsets.max(axis=0)])
    if (region[0] > region[1]).any():
        size = np.ptp(offsets, axis=0).round(3).tolist()
        raise InputError(
            f"{scene.name}: expected a region with room for an array that extends over {size} m, found one of "
            f"{np.ptp(scene.transmitter.region, axis=0).round(3).tolist()} m"
        )
    if kind == "uniform":
        return free_positions(scene, region, count, generator, offsets)
    if kind == "grid":
        positions = _grid(region, count)
        positions = positions[_free(scene, positions, offsets)]
        if not len(positions):
            raise _no_free_place(scene)
        return positions
    return _smooth_path(scene, region, count, generator, offsets)


def chosen_positions(
    scene: Scene, places: Places, offsets: Float[np.ndarray, "antennas 3"] = AT_IT
) -> tuple[Float[np.ndarray, "K 3"], str]:
    """The positions that the options of a simulation ask for, and how they were chosen."""
    given = places.positions
    if given is None:
        points = place(scene, places.placement, places.n, places.seed, offsets)
        how = f"{places.placement}, seed {places.seed}"
        if len(points) < LEAST_POSITIONS:
            raise InputError(
                f"{scene.name}: expected at least {LEAST_POSITIONS} free places of a grid in the transmitter's region, "
                f"found {len(points)}; ask for more positions than {places.n}, or enlarge the region"
            )
    else:
        how = f"positions of {Path(given).name}" if isinstance(given, str | Path) else "given positions"
        points = given_positions(given, scene, offsets)
    return points.round(6), how


def free_positions(
    scene: Scene,
    region: Float[np.ndarray, "2 3"],
    count: int,
    generator: np.random.Generator,
    offsets: Float[np.ndarray, "antennas 3"] = AT_IT,
) -> Float[np.ndarray, "count 3"]:
    """Draw positions in a box uniformly, with all antennas outside every object."""
    low, high = region
    free = np.zeros((0, 3))
    for _ in range(100):
        tries = low + (high - low) * generator.random((count, 3))
        free = np.concatenate([free, tries[_free(scene, tries, offsets)]])
        if len(free) >= count:
            return free[:count]
    raise _no_free_place(scene)


def _free(
    scene: Scene, positions: Float[np.ndarray, "n 3"], offsets: Float[np.ndarray, "antennas 3"]
) -> Bool[np.ndarray, " n"]:
    """Whether all antennas around each position are outside every object."""
    antennas = (positions[:, None] + offsets).reshape(-1, 3)
    inside = inside_object(scene, antennas).reshape(len(positions), -1)
    return np.logical_not(inside.any(axis=1))


def _no_free_place(scene: Scene) -> InputError:
    return InputError(f"{scene.name}: expected room outside the objects in the transmitter region, found none")


def _grid(region: Float[np.ndarray, "2 3"], count: int) -> Float[np.ndarray, "n 3"]:
    """Cell centres of the finest grid with nearly cubic cells and at most ``count`` of them, but at least one."""
    size = region[1] - region[0]
    wide = size[size > 0]
    cubic = (wide.prod() / count) ** (1 / len(wide))
    finer = (np.maximum(1, size // (cubic * shrink)).astype(int) for shrink in np.linspace(1, 0.75, 100))
    cells = max((number for number in finer if number.prod() <= count), key=np.prod, default=np.ones(3, int))
    axes = [low + (np.arange(n) + 0.5) * extent / n for low, extent, n in zip(region[0], size, cells, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def _smooth_path(
    scene: Scene,
    region: Float[np.ndarray, "2 3"],
    count: int,
    generator: np.random.Generator,
    offsets: Float[np.ndarray, "antennas 3"],
) -> Float[np.ndarray, "count 3"]:
    """Points ``PATH_STEP`` apart on a cubic spline through random waypoints, without those inside objects."""
    low, high = region
    positions = np.zeros((0, 3))
    for _ in range(20):
        # Two waypoints add about the region's diagonal to the length of the curve. If the curve is too short, the next
        # pass of the loop adds another one.
        needed = (count - len(positions)) * PATH_STEP
        way_points = 4 + int(3 * needed / np.linalg.norm(high - low))
        spline = CubicSpline(np.arange(way_points), low + (high - low) * generator.random((way_points, 3)))
        fine = spline(np.linspace(0, way_points - 1, 400 * way_points)).clip(low, high)
        arc_length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(fine, axis=0), axis=1))])
        stops = np.arange(0, arc_length[-1], PATH_STEP)
        path = np.stack([np.interp(stops, arc_length, fine[:, axis]) for axis in range(3)], axis=-1)
        positions = np.concatenate([positions, path[_free(scene, path, offsets)]])
        if len(positions) >= count:
            return positions[:count]
    raise _no_free_place(scene)


def given_positions(
    given: Float[ArrayLike, "n 3"] | str | Path, scene: Scene, offsets: Float[np.ndarray, "antennas 3"] = AT_IT
) -> Float[np.ndarray, "n 3"]:
    """Positions from a CSV or from Python: finite, not too far away, outside every object, and not all alike."""
    found = free_places(given, scene, offsets)
    if all_the_same(found):
        wrong = f"expected at least two different positions, found {len(found)} alike"
        raise InputError(f"{given}: {wrong}") if isinstance(given, str | Path) else ParameterError("positions", wrong)
    return found


def all_the_same(places: Float[np.ndarray, "n coordinates"]) -> bool:
    """Whether places are equal to the micrometre, to which tx_pos.csv has them. A dataset needs two."""
    return bool((places.round(6) == places[0].round(6)).all())


def free_places(
    given: Float[ArrayLike, "n 3"] | str | Path,
    scene: Scene,
    offsets: Float[np.ndarray, "antennas 3"] = AT_IT,
    parameter: str = "positions",
) -> Float[np.ndarray, "n 3"]:
    """Positions from a user, of which none is inside an object."""
    path: Path | None = None
    if isinstance(given, str | Path):
        path = Path(given)
        points = read_points(path)
    else:
        points = check_points(given, parameter)
    for row, blocker in enumerate(_blockers(scene, points, offsets)):
        if blocker is None:
            continue
        if path is not None:
            raise InputError(f'{path}, line {row + 2}: expected a free place, found one inside "{blocker}"')
        raise ParameterError(parameter, f'expected a free place in row {row}, found one inside "{blocker}"')
    return points


def _blockers(
    scene: Scene, positions: Float[np.ndarray, "n 3"], offsets: Float[np.ndarray, "antennas 3"]
) -> list[str | None]:
    """For each position, an object that one of its antennas is in; None if all are free."""
    found = blocking_object(scene, (positions[:, None] + offsets).reshape(-1, 3))
    groups = (found[start : start + len(offsets)] for start in range(0, len(found), len(offsets)))
    return [next((each for each in group if each is not None), None) for group in groups]
