"""Read the pictures of another program: of any size, depth and order, as magnitudes, powers or decibels."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from scipy.ndimage import map_coordinates

from scenes.files.errors import InputError, ParameterError, shown
from scenes.scene.frequency import read_frequency
from simulate.dataset.dataset_frequency import SAME, Frequency, named, read_frequencies
from simulate.dataset.picture_files import read_any_picture
from simulate.exchange.reading_options import Conversion
from simulate.spectra.angular_grid import COLUMNS, ROWS, AngularGrid
from simulate.spectra.spectrum import LARGEST_GREY

DARK = 128
"""Pictures of 8 bits whose largest level is below this use less than half of the levels, and are scaled."""

FULL_TURN = 360 - 1e-6  # Degrees, less a rounding error


@dataclass(frozen=True)
class Survey:
    """What the picture files of a folder hold."""

    shapes: tuple[tuple[int, int], ...]  # height and width of the pictures, each once
    modes: tuple[str, ...]  # Pillow's names for their modes, each once
    # the level that becomes the largest grey level: 255 for pictures of 8 bits that use them, otherwise the folder's
    # largest level, since programs often write 8, 10 or 12 bits into files of 16
    white: int


def survey(files: Sequence[Path]) -> Survey:
    """Read all pictures once, and note their sizes, modes and the largest level."""
    shapes, modes, largest = dict[tuple[int, int], Path](), dict[str, Path](), 0
    for path in files:
        levels, mode = read_any_picture(path)
        shapes.setdefault((levels.shape[0], levels.shape[1]), path)
        modes.setdefault(mode, path)
        largest = max(largest, int(levels.max(initial=0)))
    deep = [mode for mode in modes if mode.startswith("I")]
    if deep and len(deep) < len(modes):
        other = next(mode for mode in modes if mode not in deep)
        raise InputError(
            f"{modes[deep[0]]}: expected pictures of one depth, found 16 bits here and 8 bits in {modes[other].name}"
        )
    full = not deep and largest >= DARK
    return Survey(tuple(shapes), tuple(modes), LARGEST_GREY if full or not largest else largest)


def grid_of(survey: Survey, conversion: Conversion) -> AngularGrid | None:
    """The grid of the converted pictures; None if no option states the elevations of their rows.

    The rows stay as they are if there are 90. Others are sampled at 0° to 89° if they reach so far, and otherwise at 90
    elevations from the lowest to the highest.
    """
    if conversion.elevations is None:
        return None
    low, high = sorted(conversion.elevations)
    kept = all(_upright(shape)[0] == ROWS for shape in survey.shapes)
    default = AngularGrid()
    if not kept and low <= default.elevations_deg[0] and high >= default.elevations_deg[-1]:
        return default
    return AngularGrid(low, (high - low) / (ROWS - 1))


def read_in_size(path: Path, survey: Survey, conversion: Conversion, grid: AngularGrid) -> Float[np.ndarray, "90 360"]:
    """One picture at the directions of a grid, as numbers from 0 to 1."""
    levels, _ = read_any_picture(path)
    height, width = levels.shape
    values = (levels.T if (height, width) == (COLUMNS, ROWS) else levels) / survey.white
    height, width = values.shape
    if min(height, width) < 2:
        raise InputError(f"{path}: expected at least 2 × 2 pixels, found {width} × {height}")
    missing = ["--elevations"] if height != ROWS and conversion.elevations is None else []
    missing += ["--azimuths"] if width != COLUMNS and conversion.azimuths is None else []
    if missing:
        raise InputError(
            f"{path}: expected {COLUMNS} × {ROWS} pixels, found {width} × {height}; give the angles of the first and "
            f"last row and column by {' and '.join(missing)}, in degrees"
        )
    row, column = np.arange(float(ROWS)), np.arange(float(COLUMNS))
    if conversion.elevations is not None:
        first, last = conversion.elevations
        row = (grid.elevations_deg - first) / (last - first) * (height - 1)
    if conversion.azimuths is not None:
        column = _columns(AngularGrid().azimuths_deg, conversion.azimuths, width)
        if abs(conversion.azimuths[1] - conversion.azimuths[0]) * width / (width - 1) >= FULL_TURN:
            values = np.concatenate([values, values[:, :1]], axis=1)  # one step leads from the last to the first column
    where = np.meshgrid(row.round(9), column.round(9), indexing="ij")
    return map_coordinates(values, where, order=1, mode="constant", cval=0.0)


def _upright(shape: tuple[int, int]) -> tuple[int, int]:
    return (ROWS, COLUMNS) if shape == (COLUMNS, ROWS) else shape


def _columns(angles: Float[np.ndarray, " n"], ends: tuple[float, float], width: int) -> Float[np.ndarray, " n"]:
    """Fractional columns of azimuths. Those in the gap between the last column and the first are above width − 1."""
    first, last = ends
    beyond = ((angles - first) * np.sign(last - first)).round(9) % 360
    return beyond / abs(last - first) * (width - 1)


@dataclass(frozen=True)
class Kept:
    indices: Int[np.ndarray, " n"]  # their indices, ascending
    frequency: Frequency | None  # their frequency; None if nothing states it
    said: list[str]  # sentences on what was left out, and on where the frequency was read


def kept_pictures(
    folder: Path,
    positions: Float[np.ndarray, "K 3"],
    rows: Int[np.ndarray, " K"],
    conversion: Conversion,
    metadata: dict[str, Any],
) -> Kept:
    path, kept, said = folder / "freq.txt", np.arange(len(positions)), list[str]()
    given = conversion.frequency if conversion.frequency is not None else metadata.get("frequency_hz")
    frequency = None if given is None else Frequency(read_frequency(given), "metadata")
    hertz = read_frequencies(path, rows) if os.path.lexists(path) else None
    if hertz is not None and frequency is not None:
        kept = np.flatnonzero(np.abs(hertz / frequency.hertz - 1) <= SAME)
        listed = named(hertz)
        if not len(kept) and conversion.frequency is None:
            raise InputError(f"{path}: expected the {frequency} of metadata.json, found {listed}")
        if not len(kept):
            raise ParameterError("frequency", f"expected one that freq.txt lists, {listed}, found {frequency}")
        if len(kept) < len(hertz):
            said.append(f"kept the pictures of {frequency}: {len(kept)} of {len(hertz)} (freq.txt lists {listed})")
    if conversion.one_per_position is not None:
        before = len(kept)
        kept = kept[_one_of_each(positions[kept], conversion.one_per_position)]
        said.append(f"kept picture {conversion.one_per_position} of each position: {len(kept)} of {before}")
    if hertz is not None and frequency is None:
        frequency = Frequency(float(hertz[kept[0]]), "freq.txt")
        if np.ptp(hertz[kept]) > SAME * frequency.hertz:
            raise InputError(
                f"{path}: expected one frequency for all pictures, found {named(hertz[kept])}; one dataset has one: "
                f'--frequency "{frequency}" keeps its pictures'
            )
        said.append(f"read the frequency from freq.txt: {frequency}")
    return Kept(kept, frequency, said)


def _one_of_each(positions: Float[np.ndarray, "K 3"], number: int) -> Int[np.ndarray, " n"]:
    """Indices of the N-th picture of each position, ascending."""
    _, places, counts = np.unique(positions, axis=0, return_inverse=True, return_counts=True)
    groups = np.split(np.argsort(places.ravel(), kind="stable"), np.cumsum(counts)[:-1])
    fewest = min(len(group) for group in groups)
    if not 1 <= number <= fewest:
        raise ParameterError("one_per_position", f"expected a number from 1 to {fewest}, found {shown(number)}")
    return np.sort([group[number - 1] for group in groups])
