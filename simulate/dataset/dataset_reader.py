"""Read the small files of a NeRF² dataset folder, with one function for each. The documentation describes every file.

The functions append a sentence for each fault to a list of problems, for ``inspect``.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Generic, TypeVar

import numpy as np
from jaxtyping import Float
from msgspec import Meta, Struct

from scenes.files.errors import InputError
from scenes.files.json_yaml_xml import read_yaml
from scenes.files.schema import conform
from scenes.scene.orientation import UNIT_TOLERANCE
from simulate.dataset.dataset_kinds import Moving
from simulate.dataset.metadata import read_metadata_file
from simulate.positions.positions import FARTHEST, points_digest, read_points

GATEWAY = "gateway1 with position [x, y, z] and orientation [x, y, z, w]"

Coordinate = Annotated[float, Meta(ge=-FARTHEST, le=FARTHEST)]


class Pose(Struct):
    """Position and orientation of a gateway in gateway_info.yml."""

    position: tuple[Coordinate, Coordinate, Coordinate]
    orientation: tuple[Coordinate, Coordinate, Coordinate, Coordinate]


class GatewayInfo(Struct):
    """Content of gateway_info.yml. Other programs write further keys."""

    gateway1: Pose


Read = TypeVar("Read")  # What a file holds


def noting(problems: list[str], otherwise: Read, read: Callable[..., Read], *arguments: Any) -> Read:
    """What a function reads; if it raises an InputError, the other value, and the sentence joins the problems."""
    try:
        return read(*arguments)
    except InputError as error:
        problems.append(str(error))
        return otherwise


def read_gateway(path: Path, problems: list[str]) -> tuple[Float[np.ndarray, 3], Float[np.ndarray, 4]]:
    """Read gateway_info.yml: position, metres, and unit quaternion (x, y, z, w)."""
    return noting(problems, (np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])), _gateway, path)


def _gateway(path: Path) -> tuple[Float[np.ndarray, 3], Float[np.ndarray, 4]]:
    pose = conform(read_yaml(path, GATEWAY), GatewayInfo, str(path), numbers_as_text=True).gateway1
    length = math.hypot(*pose.orientation)
    if abs(length - 1) > UNIT_TOLERANCE:
        raise InputError(
            f"{path}: gateway1.orientation: expected a quaternion of unit length, found length {length:.4g}"
        )
    return np.array(pose.position), np.array(pose.orientation) / length


def read_metadata(path: Path, problems: list[str]) -> dict[str, Any]:
    """Read metadata.json; empty if there is none."""
    if not os.path.lexists(path):
        return {}
    return noting(problems, {}, read_metadata_file, path, "the settings of a dataset")


def read_receivers(
    path: Path, moving: Moving, count: int | None, problems: list[str]
) -> Float[np.ndarray, "K 3"] | None:
    """Read rx_pos.csv: where the middle of the array is for each row of tx_pos.csv, if both ends move."""
    if moving != "both":
        if os.path.lexists(path):
            problems.append(
                f'{path}: expected "moving": "both" in metadata.json beside it, found "{moving}"; bisplat convert '
                "--moving both states it"
            )
        return None
    found = noting(problems, None, read_points, path)
    if found is not None and count is not None and len(found) != count:
        problems.append(f"{path}: expected {count} rows, as in tx_pos.csv, found {len(found)}")
        return None
    return found


def changed_places(
    metadata: dict[str, Any], positions: Float[np.ndarray, "K 3"], receivers: Float[np.ndarray, "K 3"] | None
) -> list[str]:
    """A sentence if the rows of tx_pos.csv or rx_pos.csv are not those that a folder was simulated with."""
    made = {"tx_pos.csv": metadata.get("positions_sha256"), "rx_pos.csv": metadata.get("receivers_sha256")}
    frequencies = max(1, len(metadata.get("frequencies_hz", ())))
    found = {
        name: {points_digest(each) for each in np.array_split(rows, frequencies)}
        for name, rows in (("tx_pos.csv", positions), ("rx_pos.csv", receivers))
        if rows is not None and made[name]
    }
    changed = [name for name, digests in found.items() if digests != {made[name]}]
    if not changed:
        return []
    if len(changed) == 2 and found["tx_pos.csv"] == {made["rx_pos.csv"]}:
        return ["tx_pos.csv and rx_pos.csv are exchanged: metadata.json has the digest of each other's positions"]
    return [f"{' and '.join(changed)} changed since the simulation: metadata.json has the digest of other positions"]


Kind = TypeVar("Kind")  # The class of the dataset


@dataclass(frozen=True)
class Inspection(Generic[Kind]):
    """Result of the inspection of a folder."""

    problems: list[str]  # a sentence for each error that makes the folder unusable
    warnings: list[str]  # a sentence for each oddity that does not
    dataset: Kind | None  # the dataset; None if there are problems

    @property
    def valid(self) -> bool:
        """Whether there are no problems."""
        return not self.problems

    def usable(self) -> Kind:
        """The dataset."""
        if self.dataset is None:
            more = f" ({len(self.problems) - 1} more problems)" if len(self.problems) > 1 else ""
            raise InputError(self.problems[0] + more)
        return self.dataset
