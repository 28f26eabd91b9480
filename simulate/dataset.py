"""The NeRF² dataset folder: reader and checker. docs/format.md describes every file.

Rows of ``tx_pos.csv`` and pictures are numbered from 1; everything in memory is numbered from 0.
"""

from __future__ import annotations

import csv
import json
import tempfile
import zipfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from jaxtyping import Complex, Float, Int, UInt8
from PIL import Image

from scenes.description import SPEED_OF_LIGHT
from scenes.errors import InputError
from simulate.array import PlanarArray
from simulate.spectrum import spectrum_of

ROWS, COLUMNS = 90, 360
IN_MEMORY = 2 * 10**9
"""Bytes of pictures that are kept in memory; more are decoded into a temporary file and mapped."""

UNIT_TOLERANCE = 1e-3
"""How far a quaternion's length may be from 1."""

NERF2_FREQUENCY = 915e6
"""Hertz, of the RFID band that NeRF²'s folders were measured in; the folders themselves do not name it."""


@dataclass(frozen=True)
class Dataset:
    """A NeRF² dataset folder in memory; K spectra.

    Attributes:
        folder: the folder that it was read from.
        names: zero-padded names of the pictures, such as "00001".
        pictures: 8-bit pictures, min–max normalised magnitude, row 0 = 1° elevation.
        positions: transmitter positions, metres, world frame.
        gateway_position: metres, world frame.
        gateway_orientation: unit quaternion (x, y, z, w), gateway frame to world.
        train: indices of the folder's own training spectra.
        test: indices of the folder's own test spectra.
        responses: complex element responses; None where the folder has none (simulated folders have them).
        metadata: content of metadata.json; empty where the folder has none (simulated folders have it).
    """

    folder: Path
    names: list[str]
    pictures: UInt8[np.ndarray, "K 90 360"]
    positions: Float[np.ndarray, "K 3"]
    gateway_position: Float[np.ndarray, 3]
    gateway_orientation: Float[np.ndarray, 4]
    train: Int[np.ndarray, " K_train"]
    test: Int[np.ndarray, " K_test"]
    responses: Complex[np.ndarray, "K elements"] | None = None
    metadata: dict[str, Any] = field(default_factory=dict)

    @property
    def array(self) -> PlanarArray:
        """The array of metadata.json; the half-wavelength 4 × 4 of NeRF² for folders without any."""
        return PlanarArray(**self.metadata.get("array", {}))

    @property
    def wavelength(self) -> float:
        """At the frequency of metadata.json, metres; at NeRF²'s 915 MHz for folders without any."""
        return SPEED_OF_LIGHT / self.metadata.get("frequency_hz", NERF2_FREQUENCY)

    @property
    def spectra(self) -> Float[np.ndarray, "K 90 360"]:
        """Pictures as numbers in 0…1, the way every published loader reads them."""
        return spectrum_of(self.pictures)


@dataclass(frozen=True)
class Inspection:
    """Result of ``inspect``.

    Attributes:
        problems: sentences on errors that make the folder unusable.
        warnings: sentences on oddities that do not.
        dataset: the dataset, where there are no problems.
    """

    problems: list[str]
    warnings: list[str]
    dataset: Dataset | None


def read_dataset(folder: Path | str) -> Dataset:
    """Read and check a NeRF² dataset folder.

    Args:
        folder: the dataset folder.

    Returns:
        The dataset.

    Raises:
        InputError: the first problem that ``inspect`` finds.

    >>> import tempfile
    >>> from scenes.description import Gateway, Scene, SceneObject, Transmitter, facing
    >>> from scenes.materials import p2040_materials
    >>> from scenes.shapes import sheet
    >>> from simulate.propagation import Propagation
    >>> from simulate.simulation import simulate
    >>> floor = SceneObject("floor", sheet((-5, -5, 0), (10, 0, 0), (0, 10, 0)), "concrete")
    >>> gateway, region = Gateway((0, 0, 1.5), facing((-1, 0, 0))), Transmitter((-4, -1, 0.5), (-2, 1, 2))
    >>> yard = Scene("yard", 915e6, gateway, region, (floor,), p2040_materials(["concrete"], 915e6))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = simulate(yard, folder, n=3, propagation=Propagation(max_depth=0))
    ...     dataset = read_dataset(folder)
    >>> dataset.names, dataset.spectra.shape, dataset.array.elements
    (['00001', '00002', '00003'], (3, 90, 360), 16)
    """
    inspection = inspect(Path(folder))
    if inspection.dataset is None:
        more = f" ({len(inspection.problems) - 1} more problems)" if len(inspection.problems) > 1 else ""
        raise InputError(inspection.problems[0] + more)
    return inspection.dataset


def inspect(folder: Path) -> Inspection:
    """Read a folder, collecting every problem instead of stopping at the first.

    Args:
        folder: the dataset folder.

    Returns:
        The problems, the warnings, and the dataset where there are no problems.
    """
    problems: list[str] = []
    warnings: list[str] = []
    if not folder.is_dir():
        return Inspection([f"{folder}: expected a dataset folder, found {_kind(folder)}"], [], None)

    positions = _read_positions(folder / "tx_pos.csv", problems)
    names, pictures = _read_pictures(folder / "spectrum", problems)
    gateway_position, gateway_orientation = _read_gateway(folder / "gateway_info.yml", problems)
    train = _read_index(folder / "train_index.txt", names, problems)
    test = _read_index(folder / "test_index.txt", names, problems)
    metadata = _read_metadata(folder / "metadata.json", problems)

    numbers = np.array([int(name) for name in names], dtype=int)
    rows_known = None if positions is None else len(positions)
    if positions is not None and len(names):
        without_row = [name for name, number in zip(names, numbers, strict=True) if number > len(positions)]
        if without_row:
            rows_known = None  # a length of channels.npz can only be wrong for the same reason
            problems.append(
                f"{folder / 'tx_pos.csv'}: expected a row for each of the {len(names)} pictures, found "
                f"{len(positions)} rows; spectrum/{without_row[0]}.png has none"
            )
        if len(positions) > len(names):
            warnings.append(f"tx_pos.csv has {len(positions)} rows for {len(names)} pictures")
    both = sorted(set(train) & set(test))
    if both:
        problems.append(
            f"{folder / 'test_index.txt'}: expected names that are not in train_index.txt, found "
            f"{names[both[0]]} in both ({len(both)} in all)"
        )
    for label, index in (("train_index.txt", train), ("test_index.txt", test)):
        if len(set(index)) < len(index):
            warnings.append(f"{label} names {len(index) - len(set(index))} spectra more than once")
    unused = len(names) - len(set(train) | set(test))
    if unused and not problems:
        warnings.append(f"{unused} spectra are in neither train_index.txt nor test_index.txt")

    elements = PlanarArray(**metadata.get("array", {})).elements
    responses = _read_responses(folder / "channels.npz", rows_known, elements, problems)
    if problems or positions is None:
        return Inspection(problems, warnings, None)
    rows = numbers - 1
    dataset = Dataset(
        folder=folder,
        names=names,
        pictures=pictures,
        positions=positions[rows],
        gateway_position=gateway_position,
        gateway_orientation=gateway_orientation,
        train=np.array(train, dtype=int),
        test=np.array(test, dtype=int),
        responses=None if responses is None else responses[rows],
        metadata=metadata,
    )
    return Inspection(problems, warnings, dataset)


def _kind(path: Path) -> str:
    return "a file" if path.is_file() else "nothing there"


def _read_positions(path: Path, problems: list[str]) -> Float[np.ndarray, "K 3"] | None:
    try:
        return read_points(path)
    except InputError as error:
        problems.append(str(error))
        return None


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


def _read_pictures(folder: Path, problems: list[str]) -> tuple[list[str], UInt8[np.ndarray, "K 90 360"]]:
    nothing = np.zeros((0, ROWS, COLUMNS), np.uint8)
    if not folder.is_dir():
        problems.append(f"{folder}: expected a folder of pictures, found {_kind(folder)}")
        return [], nothing
    files = sorted(
        (path for path in folder.glob("*.png") if path.stem.isdecimal() and int(path.stem) > 0),
        key=lambda path: int(path.stem),
    )
    if not files:
        problems.append(f"{folder}: expected pictures 00001.png and on, found none")
    pictures = _zeros((len(files), ROWS, COLUMNS))
    for index, path in enumerate(files):
        try:
            pictures[index] = read_picture(path)
        except InputError as error:
            problems.append(str(error))
    return [path.stem for path in files], pictures


def read_picture(path: Path) -> UInt8[np.ndarray, "90 360"]:
    """Read one 8-bit grey spectrum picture.

    Args:
        path: the PNG file.

    Returns:
        Grey levels, row 0 at 1° elevation.

    Raises:
        InputError: not a readable PNG, or not 360 × 90 pixels of 8-bit grey.
    """
    try:
        with Image.open(path) as image:
            image.load()
            if image.size != (COLUMNS, ROWS) or image.mode != "L":
                raise InputError(
                    f"{path}: expected {COLUMNS} × {ROWS} pixels of 8-bit grey (mode L), found "
                    f"{image.size[0]} × {image.size[1]} of mode {image.mode}"
                )
            return np.asarray(image)
    except (OSError, SyntaxError) as error:
        raise InputError(f"{path}: expected a whole PNG picture, found a damaged one ({error})") from error


def _read_index(path: Path, names: list[str], problems: list[str]) -> list[int]:
    if not path.is_file():
        problems.append(f"{path}: expected one picture name per line, found no such file")
        return []
    if not names:
        return []  # a problem of the pictures, not of every row here
    index_of = {name: index for index, name in enumerate(names)}
    index = []
    try:
        listed = path.read_text(encoding="utf-8").split()
    except UnicodeDecodeError as error:
        problems.append(f"{path}: expected one picture name per line, found a file that is no text ({error})")
        return []
    for number, name in enumerate(listed, start=1):
        if name not in index_of:
            problems.append(f"{path}, row {number}: expected the name of a picture, found {name}, which is not there")
        else:
            index.append(index_of[name])
    return index


def read_index(path: Path, dataset: Dataset) -> Int[np.ndarray, " n"]:
    """Read an index file.

    Args:
        path: one picture name per line.
        dataset: the dataset that the names are of.

    Returns:
        Indices into the dataset.

    Raises:
        InputError: the file is missing, empty, or names a picture that is not there.
    """
    problems: list[str] = []
    index = _read_index(path, dataset.names, problems)
    if not index and not problems:
        problems.append(f"{path}: expected one picture name per line, found an empty file")
    if problems:
        raise InputError(problems[0])
    return np.array(index, dtype=int)


def _read_gateway(path: Path, problems: list[str]) -> tuple[Float[np.ndarray, 3], Float[np.ndarray, 4]]:
    default_pose = np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])
    if not path.is_file():
        problems.append(f"{path}: expected the gateway's position and orientation, found no such file")
        return default_pose
    try:
        gateway = yaml.safe_load(path.read_text())["gateway1"]
        position = np.array(gateway["position"], dtype=float)
        orientation = np.array(gateway["orientation"], dtype=float)
        if position.shape != (3,) or orientation.shape != (4,) or not np.isfinite([*position, *orientation]).all():
            raise ValueError
    except (yaml.YAMLError, KeyError, TypeError, ValueError):
        problems.append(
            f"{path}: expected gateway1 with position [x, y, z] and orientation [x, y, z, w], found something else"
        )
        return default_pose
    length = float(np.linalg.norm(orientation))
    if abs(length - 1) > UNIT_TOLERANCE:
        problems.append(
            f"{path}, gateway1: expected an orientation quaternion of unit length, found length {length:.4g}"
        )
        return default_pose
    return position, orientation / length


def _read_metadata(path: Path, problems: list[str]) -> dict[str, Any]:
    if not path.is_file():
        return {}
    try:
        metadata = json.loads(path.read_text())
        PlanarArray(**metadata.get("array", {}))
    except (ValueError, TypeError, AttributeError) as error:
        problems.append(f"{path}: expected a JSON object whose array has rows, columns, spacing, found {error}")
        return {}
    return metadata


def _read_responses(
    path: Path, rows: int | None, elements: int, problems: list[str]
) -> Complex[np.ndarray, "K elements"] | None:
    if not path.is_file():
        return None
    try:
        with np.load(path) as archive:
            responses = archive["channels"]
    except (OSError, ValueError, KeyError, EOFError, TypeError, AttributeError, zipfile.BadZipFile) as error:
        problems.append(f"{path}: expected an npz archive with the array channels, found {error}")
        return None
    if responses.ndim != 2 or responses.shape[1] != elements or rows not in (None, len(responses)):
        positions = "the" if rows is None else rows
        problems.append(
            f"{path}: expected responses of {positions} positions × {elements} elements, found shape {responses.shape}"
        )
        return None
    return responses
