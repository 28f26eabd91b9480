"""A folder of received powers (RSSI) in memory, and the check that it is valid. The documentation describes every file.

Positions are numbered from 0, in memory and in the files.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from jaxtyping import Float, Int
from msgspec import Meta, Struct

from scenes.files.errors import InputError, named, require_path
from scenes.files.input_file import what_is_at
from scenes.files.long_work import doing
from scenes.files.schema import conform
from scenes.scene.description import SPEED_OF_LIGHT
from scenes.scene.frequency import read_frequency
from simulate.dataset.dataset_frequency import Frequency
from simulate.dataset.dataset_kinds import POWERS, content_of, is_rssi, unfinished
from simulate.dataset.dataset_reader import Inspection, changed_places, noting, read_metadata
from simulate.dataset.index_files import numbered_split
from simulate.positions.positions import read_points
from simulate.rssi.power_receiver import NOT_RECEIVED, STRONGEST, fault_of_powers
from simulate.rssi.rssi_files import read_gateway_positions, read_powers

GATEWAYS = "gateway_position.yml"

USUAL_FREQUENCY = 2.4e9  # Hertz; if no frequency is stated


@dataclass(frozen=True)
class RssiDataset:
    """A folder of received powers (RSSI) in memory: K transmitter positions and G gateways of one element each.

    ``read_rssi`` reads one, ``simulate_rssi`` and ``write_rssi`` return one. The format is that of NeRF²'s BLE data
    [zhao2023], which GSRF reads, too.

    Attributes:
        folder: the folder that the dataset was read from.
        positions: transmitter positions, metres, world frame, [K, 3].
        gateway_names: names of the G gateways.
        gateway_positions: their positions, metres, world frame, [G, 3].
        rssi_dbm: received powers, dBm, [K, G]; NaN where nothing was received.
        floor_dbm: power below which a gateway receives nothing, dBm; −100, the mark of the format, if not stated.
        train: indices of the folder's own training positions; empty if it has no index files.
        test: indices of the folder's own test positions; empty if it has no index files.
        metadata: content of metadata.json; empty if the folder has none.

    Example:
        >>> import bisplat, numpy as np
        >>> places, powers = [[1, 2, 1], [4, 2, 1]], [[-48.0, -61.0], [-60.0, np.nan]]
        >>> gateways = {"door": (0, 0, 2), "window": (5, 0, 2)}
        >>> hall = bisplat.write_rssi("hall", positions=places, rssi_dbm=powers, gateways=gateways, frequency="2.4 GHz")
        >>> hall
        RssiDataset('hall': 2 positions, 2 gateways, 2400 MHz)
        >>> len(hall), hall.gateway_names, hall.rssi_dbm[1].tolist()
        (2, ['door', 'window'], [-60.0, nan])
        >>> hall.distances.round(1).tolist()
        [[2.4, 4.6], [4.6, 2.4]]
    """

    folder: Path
    positions: Float[np.ndarray, "K 3"]
    gateway_names: list[str]
    gateway_positions: Float[np.ndarray, "G 3"]
    rssi_dbm: Float[np.ndarray, "K G"]
    floor_dbm: float
    train: Int[np.ndarray, " K_train"]
    test: Int[np.ndarray, " K_test"]
    metadata: dict[str, Any] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.positions)

    def __repr__(self) -> str:
        known = "frequency not stated" if self.frequency is None else f"{self.frequency.hertz / 1e6:g} MHz"
        gateways = "1 gateway" if len(self.gateway_names) == 1 else f"{len(self.gateway_names)} gateways"
        return f"RssiDataset({str(self.folder)!r}: {len(self)} positions, {gateways}, {known})"

    @property
    def frequency(self) -> Frequency | None:
        """The carrier frequency (``hertz``), as metadata.json states it; None if it does not."""
        stated = self.metadata.get("frequency_hz")
        return None if stated is None else Frequency(read_frequency(stated), "metadata")

    @property
    def wavelength(self) -> float:
        """Wavelength, metres; at ``USUAL_FREQUENCY`` if no frequency is stated."""
        return SPEED_OF_LIGHT / (USUAL_FREQUENCY if self.frequency is None else self.frequency.hertz)

    @property
    def distances(self) -> Float[np.ndarray, "K G"]:
        """Distance of each position from each gateway, metres, [K, G]."""
        return np.linalg.norm(self.positions[:, None] - self.gateway_positions, axis=-1)


class StatedReceiver(Struct, frozen=True):
    """The entry receiver of metadata.json, whose other keys are not needed to read the powers."""

    tx_power_dbm: float | None = None
    floor_dbm: Annotated[float, Meta(ge=NOT_RECEIVED, le=STRONGEST)] = NOT_RECEIVED


class StatedPowers(Struct):
    """What metadata.json of received powers states besides what that of spectra does."""

    receiver: StatedReceiver = StatedReceiver()
    positions_sha256: str = ""


def read_rssi(folder: Path | str) -> RssiDataset:
    """Read and check a folder of received powers (RSSI): NeRF²'s BLE data, or what ``simulate_rssi`` wrote.

    The folder needs ``tx_pos.csv``, ``gateway_position.yml`` and ``gateway_rssi.csv``. Index files and metadata.json
    are read if they are there.

    Args:
        folder: the folder.

    Returns:
        The dataset.

    Raises:
        InputError: a file is missing, damaged or inconsistent with another one, or the powers cannot be in dBm. The
            message states the first problem and the number of further ones.

    Example:
        >>> import bisplat
        >>> bisplat.read_rssi("data/lab")
        Traceback (most recent call last):
        scenes.files.errors.InputError: data/lab: expected received powers (gateway_rssi.csv), found spectra
    """
    require_path(folder=folder)
    doing(f"{folder}: reading received powers")
    dataset = inspect_rssi(Path(folder)).usable()
    doing("")
    return dataset


def inspect_rssi(folder: Path) -> Inspection[RssiDataset]:
    """Read a folder and collect every problem, instead of stopping at the first."""
    if not folder.is_dir():
        return Inspection([f"{folder}: expected a folder of received powers, found {what_is_at(folder)}"], [], None)
    if sentence := unfinished(folder):
        return Inspection([sentence], [], None)
    if not is_rssi(folder):
        found = content_of(folder) or "no such file"
        return Inspection([f"{folder}: expected received powers ({POWERS}), found {found}"], [], None)
    problems: list[str] = []
    positions = noting(problems, np.zeros((0, 3)), read_points, folder / "tx_pos.csv")
    places = noting(problems, dict[str, np.ndarray](), read_gateway_positions, folder / GATEWAYS)
    names, powers = noting(problems, (list[str](), np.zeros((0, 0))), read_powers, folder / POWERS)
    metadata = read_metadata(folder / "metadata.json", problems)
    stated = noting(problems, StatedPowers(), conform, metadata, StatedPowers, str(folder / "metadata.json"))
    if names and places:
        _compare_names(folder, names, list(places), problems)
    if names and len(positions) and len(powers) != len(positions):
        problems.append(
            f"{folder / POWERS}: expected a row for each of the {len(positions)} positions of tx_pos.csv, found "
            f"{len(powers)} rows"
        )
    if names:
        powers[powers == NOT_RECEIVED] = np.nan
        fault = fault_of_powers(powers, stated=stated.receiver.tx_power_dbm is not None)
        if fault is not None:
            problems.append(f"{folder / POWERS}: {fault}")
    warnings: list[str] = []
    train, test = (
        numbered_split(folder, len(positions), problems, warnings) if len(positions) else (np.zeros(0, int),) * 2
    )
    if problems:
        return Inspection(problems, warnings, None)
    if list(places) != names:
        warnings.append(
            f"{GATEWAYS} has the gateways in another order than {POWERS}; bisplat and GSRF go by their names, "
            "but NeRF² goes by the order and would confuse them"
        )
    warnings.extend(changed_places({"positions_sha256": stated.positions_sha256}, positions, None))
    where = np.array([places[name] for name in names])
    return Inspection(
        problems,
        warnings,
        RssiDataset(folder, positions, names, where, powers, stated.receiver.floor_dbm, train, test, metadata),
    )


def require_valid_powers(folder: Path, called: Path) -> None:
    """Refuse a folder that has just been written and could not be read."""
    problems = inspect_rssi(folder).problems
    if problems:
        raise InputError(problems[0].replace(str(folder), str(called)))


def _compare_names(folder: Path, columns: Sequence[str], placed: Sequence[str], problems: list[str]) -> None:
    """Look for gateways that one of the two files lacks."""
    unplaced = [name for name in columns if name not in placed]
    without_column = [name for name in placed if name not in columns]
    if unplaced:
        expected = f"{folder / GATEWAYS}: expected the position of each gateway of {POWERS}"
        problems.append(f"{expected}, found none of {named(unplaced[0])}")
    elif without_column:
        expected = f"{folder / POWERS}: expected a column for each gateway of {GATEWAYS}"
        problems.append(f"{expected}, found none of {named(without_column[0])}")
