"""Read the files of a NeRF² dataset folder, one function each. docs/format.md describes every file.

A function either raises ``InputError`` or, for what ``inspect`` collects, appends sentences to a list of problems.
"""

from __future__ import annotations

import csv
import math
import os
import tempfile
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from jaxtyping import Complex, Float, UInt8
from msgspec import Meta, Struct
from PIL import Image

from scenes.description import UNIT_TOLERANCE
from scenes.errors import InputError
from scenes.schema import conform
from scenes.yaml_file import read_yaml
from simulate.angular_grid import COLUMNS, ROWS
from simulate.beamformer import Beamformer
from simulate.identification import beamformer_of
from simulate.metadata import read_metadata_file

GATEWAY = "gateway1 with position [x, y, z] and orientation [x, y, z, w]"

LARGEST = 1e9
"""Metres; positions may be of a map, such as UTM's northing, but no farther."""

IN_MEMORY = 2 * 10**9
"""Bytes of pictures that are kept in memory; more are decoded into a temporary file and mapped."""

Coordinate = Annotated[float, Meta(ge=-LARGEST, le=LARGEST)]


class Pose(Struct):
    """Position and orientation of a gateway in gateway_info.yml."""

    position: tuple[Coordinate, Coordinate, Coordinate]
    orientation: tuple[Coordinate, Coordinate, Coordinate, Coordinate]


class GatewayInfo(Struct):
    """gateway_info.yml; other programs write further keys."""

    gateway1: Pose


def what_is_at(path: Path) -> str:
    """What is found at a path that should be a folder, for a message."""
    return "a file" if path.is_file() else "nothing there"


def read_points(path: Path) -> Float[np.ndarray, "n 3"]:
    """Read a CSV of positions with the header x,y,z.

    Args:
        path: the CSV.

    Returns:
        The positions, metres, world frame.

    Raises:
        InputError: no such file, another header, a row that is not three finite numbers, or no rows.
    """
    if not path.is_file():
        raise InputError(f"{path}: expected a CSV of positions, found no such file")
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            rows = list(csv.reader(file))
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: expected a CSV of positions, found a file that is none ({error})") from error
    if not rows or [name.strip() for name in rows[0]] != ["x", "y", "z"]:
        found = ",".join(rows[0]) if rows else "an empty file"
        raise InputError(f"{path}, line 1: expected the header x,y,z, found {found}")
    points = []
    for number, row in enumerate(rows[1:], start=1):
        try:
            point = [float(value) for value in row]
        except ValueError:
            point = []
        if len(point) != 3 or not np.isfinite(point).all():
            raise InputError(
                f"{path}, position {number} (line {number + 1}): expected three finite numbers in metres, "
                f"found {','.join(row) or 'an empty line'}"
            )
        points.append(point)
    if not points:
        raise InputError(f"{path}: expected at least one position after the header, found none")
    return np.array(points, dtype=float)


def _zeros(shape: tuple[int, ...]) -> UInt8[np.ndarray, "*shape"]:
    """Zeros, in memory or in a mapped temporary file that is removed when the process ends."""
    size = int(np.prod(shape))
    if size <= IN_MEMORY:
        return np.zeros(shape, np.uint8)
    with tempfile.TemporaryFile() as file:
        file.truncate(size)
        return np.memmap(file, np.uint8, "r+", shape=shape)


def picture_files(folder: Path) -> list[Path]:
    """The pictures of a dataset's folder ``spectrum``, by number; other programs number them from 0.

    Raises:
        InputError: there is no such folder, or no picture whose name is a number in it.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: expected a folder of pictures, found {what_is_at(folder)}")
    files = [path for path in folder.glob("*.png") if path.stem.isdecimal()]
    if not files:
        raise InputError(f"{folder}: expected pictures 00001.png and on, found none")
    return sorted(files, key=lambda path: int(path.stem))


def read_pictures(folder: Path, problems: list[str]) -> tuple[list[str], UInt8[np.ndarray, "K 90 360"]]:
    """Read all pictures of a dataset.

    Args:
        folder: the dataset's folder ``spectrum``.
        problems: gets one sentence for each kind of unreadable pictures, with their number.

    Returns:
        Names of the pictures, and their grey levels.
    """
    try:
        files = picture_files(folder)
        if int(files[0].stem) == 0:
            found = f"found {files[0].name}; bisplat convert numbers them from 1"
            raise InputError(f"{folder}: expected pictures 00001.png and on, {found}")
    except InputError as error:
        problems.append(str(error))
        return [], np.zeros((0, ROWS, COLUMNS), np.uint8)
    pictures = _zeros((len(files), ROWS, COLUMNS))
    sentences: dict[str, list[str]] = {}  # of each kind of fault
    for index, path in enumerate(files):
        try:
            pictures[index] = read_picture(path)
        except InputError as error:
            kind = str(error).removeprefix(str(path)).split("damaged")[0]
            sentences.setdefault(kind, []).append(str(error))
    problems += [summary(alike, "pictures") for alike in sentences.values()]
    return [path.stem for path in files], pictures


def summary(alike: Sequence[str], things: str) -> str:
    """The first of some sentences on the same fault, and the number of the others.

    >>> summary(["a.png: damaged", "b.png: damaged", "c.png: damaged"], "pictures")
    'a.png: damaged; 2 more pictures have the same fault'
    """
    more = len(alike) - 1
    verb = "have" if more > 1 else "has"
    thing = things if more > 1 else things.removesuffix("s")
    return alike[0] + (f"; {more} more {thing} {verb} the same fault" if more else "")


def read_picture(path: Path) -> UInt8[np.ndarray, "90 360"]:
    """Read one 8-bit grey spectrum picture.

    Args:
        path: the PNG file.

    Returns:
        Grey levels; the dataset's grid says which directions its rows and columns are.

    Raises:
        InputError: not a readable PNG, or not 360 × 90 pixels of 8-bit grey.
    """
    picture, mode = read_any_picture(path)
    if picture.shape != (ROWS, COLUMNS) or mode != "L":
        height, width = picture.shape[:2]
        raise InputError(
            f"{path}: expected {COLUMNS} × {ROWS} pixels of 8-bit grey (mode L), found "
            f"{width} × {height} of mode {mode}{_mended_by(height, width)}"
        )
    return picture


def _mended_by(height: int, width: int) -> str:
    if (height, width) == (COLUMNS, ROWS):
        return ", as a transposed spectrum has; bisplat convert turns it"
    if (height, width) != (ROWS, COLUMNS):
        return "; bisplat convert samples it at the directions of this format"
    return "; bisplat convert makes 8-bit grey of it"


def read_any_picture(path: Path) -> tuple[np.ndarray, str]:
    """Read a PNG of any size and mode: its pixels, and Pillow's name of its mode.

    Raises:
        InputError: not a readable PNG.
    """
    try:
        with Image.open(path) as image:
            image.load()
            return np.asarray(image), image.mode
    except (OSError, SyntaxError) as error:
        raise InputError(f"{path}: expected a whole PNG picture, found a damaged one ({error})") from error


def read_names(path: Path, names: Sequence[str], problems: list[str]) -> list[int]:
    """Read an index file.

    Args:
        path: the file, with one picture's name per line.
        names: names of the dataset's pictures.
        problems: gets a sentence for each kind of fault.

    Returns:
        Indices into ``names``.
    """
    if not path.is_file():
        problems.append(f"{path}: expected one picture name per line, found no such file")
        return []
    if not names:
        return []  # a problem of the pictures, not of every row here
    try:
        listed = path.read_text(encoding="utf-8").split()
    except UnicodeDecodeError as error:
        problems.append(f"{path}: expected one picture name per line, found a file that is no text ({error})")
        return []
    index_of = {name: index for index, name in enumerate(names)}
    unknown = [(row, name) for row, name in enumerate(listed, start=1) if name not in index_of]
    if unknown:
        row, name = unknown[0]
        sentence = f"{path}, row {row}: expected the name of a picture, found {name}, which is not there"
        numbers = {str(int(each)) for each in names}
        if len(unknown) == len(listed) and all(each in numbers | {"0"} for each in listed):
            sentence += "; the names are numbers without zeros in front, as GSRF writes them: bisplat convert pads them"
        problems.append(summary([sentence] * len(unknown), "rows"))
    return [index_of[name] for name in listed if name in index_of]


def read_gateway(path: Path, problems: list[str]) -> tuple[Float[np.ndarray, 3], Float[np.ndarray, 4]]:
    """Read gateway_info.yml: position, metres, and unit quaternion (x, y, z, w); problems get a sentence."""
    try:
        pose = conform(read_yaml(path, GATEWAY), GatewayInfo, str(path), numbers_as_text=True).gateway1
        length = math.hypot(*pose.orientation)
        if abs(length - 1) > UNIT_TOLERANCE:
            raise InputError(
                f"{path}: gateway1.orientation: expected a quaternion of unit length, found length {length:.4g}"
            )
    except InputError as error:
        problems.append(str(error))
        return np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])
    return np.array(pose.position), np.array(pose.orientation) / length


def read_metadata(path: Path, problems: list[str]) -> tuple[dict[str, Any], Beamformer | None]:
    """Read metadata.json: its content, and the array and the grid that it states; problems get a sentence."""
    if not os.path.lexists(path):
        return {}, None
    try:
        metadata = read_metadata_file(path, "the settings of a dataset")
        return metadata, beamformer_of(metadata)
    except InputError as error:
        problems.append(str(error))
        return {}, None


def read_responses(
    path: Path, rows: int | None, elements: int, problems: list[str]
) -> tuple[Complex[np.ndarray, "K elements"] | None, bool]:
    """Read channels.npz, and whether its responses were retrieved from the pictures instead of recorded.

    The responses are None if there is no such file, or problems got a sentence.

    Args:
        path: the file.
        rows: number of positions; None: any number.
        elements: number of the array's elements.
        problems: gets a sentence on a fault.
    """
    if not path.is_file():
        return None, False
    try:
        with np.load(path) as archive:
            responses, retrieved = archive["channels"], "retrieved" in archive and bool(archive["retrieved"])
    except (OSError, ValueError, KeyError, EOFError, TypeError, AttributeError, zipfile.BadZipFile) as error:
        problems.append(f"{path}: expected an npz archive with the array channels, found {error}")
        return None, False
    if responses.ndim != 2 or responses.shape[1] != elements or rows not in (None, len(responses)):
        positions = "the" if rows is None else rows
        problems.append(
            f"{path}: expected responses of {positions} positions × {elements} elements, found shape {responses.shape}"
        )
        return None, False
    return responses, retrieved
