"""Read the small files of a NeRF² dataset folder, with one function for each. The documentation describes every file.

The functions append a sentence for each fault to a list of problems, for ``inspect``.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from jaxtyping import Float
from msgspec import Meta, Struct

from scenes.files.errors import InputError, shown
from scenes.files.input_file import MEGABYTE, read_text
from scenes.files.schema import conform
from scenes.files.yaml_file import read_yaml
from scenes.scene.description import UNIT_TOLERANCE
from simulate.dataset.metadata import read_metadata_file
from simulate.dataset.picture_files import summary
from simulate.positions.given_positions import FARTHEST

GATEWAY = "gateway1 with position [x, y, z] and orientation [x, y, z, w]"

LARGEST_INDEX = 20 * MEGABYTE
"""Most bytes of an index file. A million names of six digits take 7 MB."""

Coordinate = Annotated[float, Meta(ge=-FARTHEST, le=FARTHEST)]


class Pose(Struct):
    """Position and orientation of a gateway in gateway_info.yml."""

    position: tuple[Coordinate, Coordinate, Coordinate]
    orientation: tuple[Coordinate, Coordinate, Coordinate, Coordinate]


class GatewayInfo(Struct):
    """Content of gateway_info.yml. Other programs write further keys."""

    gateway1: Pose


def read_names(path: Path, names: Sequence[str], problems: list[str]) -> list[int]:
    """Read an index file.

    Args:
        path: the file, with one picture name per line.
        names: names of the dataset's pictures.
        problems: a sentence for each kind of fault is appended.

    Returns:
        Indices into ``names``.
    """
    if not names:
        return []  # the pictures are the problem, not every row of this file
    try:
        listed = read_text(path, "one picture name per line", LARGEST_INDEX).split()
    except InputError as error:
        problems.append(str(error))
        return []
    index_of = {name: index for index, name in enumerate(names)}
    unknown = [(row, name) for row, name in enumerate(listed, start=1) if name not in index_of]
    if unknown:
        row, name = unknown[0]
        sentence = f"{path}, row {row}: expected the name of a picture, found {shown(name)}, which has no picture"
        numbers = {str(int(each)) for each in names}
        if len(unknown) == len(listed) and all(each in numbers | {"0"} for each in listed):
            sentence += "; the names lack leading zeros, as GSRF writes them: bisplat convert adds them"
        problems.append(summary([sentence] * len(unknown), "rows"))
    return [index_of[name] for name in listed if name in index_of]


def read_gateway(path: Path, problems: list[str]) -> tuple[Float[np.ndarray, 3], Float[np.ndarray, 4]]:
    """Read gateway_info.yml: position, metres, and unit quaternion (x, y, z, w); faults are added to the problems."""
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


def read_metadata(path: Path, problems: list[str]) -> dict[str, Any]:
    """Read metadata.json; empty if there is none. Faults are added to the problems."""
    if not os.path.lexists(path):
        return {}
    try:
        return read_metadata_file(path, "the settings of a dataset")
    except InputError as error:
        problems.append(str(error))
        return {}
