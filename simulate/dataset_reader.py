"""Read the small files of a NeRF² dataset folder, one function each. docs/format.md describes every file.

A function appends sentences to a list of problems, for ``inspect``.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from jaxtyping import Float

from scenes.errors import InputError, shown
from scenes.input_file import MEGABYTE, read_text
from simulate.beamformer import Beamformer
from simulate.identification import beamformer_of
from simulate.picture_files import summary

LARGEST_INDEX = 20 * MEGABYTE
"""Bytes of an index file; a million names of six digits have 7 MB."""

UNIT_TOLERANCE = 1e-3
"""How far a quaternion's length may be from 1."""


def read_names(path: Path, names: Sequence[str], problems: list[str]) -> list[int]:
    """Read an index file.

    Args:
        path: the file, with one picture's name per line.
        names: names of the dataset's pictures.
        problems: gets a sentence for each kind of fault.

    Returns:
        Indices into ``names``.
    """
    if not names:
        return []  # a problem of the pictures, not of every row here
    try:
        listed = read_text(path, "one picture name per line", LARGEST_INDEX).split()
    except InputError as error:
        problems.append(str(error))
        return []
    index_of = {name: index for index, name in enumerate(names)}
    unknown = [(row, name) for row, name in enumerate(listed, start=1) if name not in index_of]
    if unknown:
        row, name = unknown[0]
        sentence = f"{path}, row {row}: expected the name of a picture, found {shown(name)}, which is not there"
        numbers = {str(int(each)) for each in names}
        if len(unknown) == len(listed) and all(each in numbers | {"0"} for each in listed):
            sentence += "; the names are numbers without zeros in front, as GSRF writes them: bisplat convert pads them"
        problems.append(summary([sentence] * len(unknown), "rows"))
    return [index_of[name] for name in listed if name in index_of]


def read_gateway(path: Path, problems: list[str]) -> tuple[Float[np.ndarray, 3], Float[np.ndarray, 4]]:
    """Read gateway_info.yml: position, metres, and unit quaternion (x, y, z, w); problems get a sentence."""
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


def read_metadata(path: Path, problems: list[str]) -> tuple[dict[str, Any], Beamformer | None]:
    """Read metadata.json: its content, and the array and the grid that it states; problems get a sentence."""
    if not path.is_file():
        return {}, None
    try:
        metadata = json.loads(path.read_text())
        return metadata, beamformer_of(metadata)
    except (ValueError, TypeError, AttributeError) as error:
        problems.append(
            f"{path}: expected a JSON object whose array has rows, columns, spacing, and whose grid has "
            f"elevation_first_deg, elevation_step_deg, azimuth_step_deg, found {error}"
        )
        return {}, None
