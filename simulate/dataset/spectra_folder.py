"""The folder of spectra, as NeRF² has it: pictures, and perhaps element responses. The documentation describes it."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from jaxtyping import Float, UInt8
from msgspec import Struct

from scenes.files.atomic import write_atomically
from scenes.files.errors import InputError
from scenes.files.json_yaml_xml import read_yaml
from scenes.files.long_work import doing
from scenes.files.schema import conform
from scenes.scene.antennas import Gateway
from scenes.scene.frequency import read_frequency
from scenes.scene.orientation import UNIT_TOLERANCE
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_frequency import Frequency, frequency_of
from simulate.dataset.dataset_kinds import Moving
from simulate.dataset.index_files import read_split
from simulate.dataset.inspection import Coordinate, Inspection
from simulate.dataset.metadata import write_metadata
from simulate.dataset.picture_files import encode_picture, picture_names, read_pictures
from simulate.dataset.receivers import ArrayReceiver
from simulate.dataset.responses_file import Recorded, read_responses
from simulate.positions.positions import read_points, write_positions
from simulate.spectra.array import PlanarArray
from simulate.spectra.identification import identify, stated_array, stated_grid

SECONDS = 0.5e-3  # To read a spectrum, about

GATEWAY = "gateway1 with position [x, y, z] and orientation [x, y, z, w]"


class Pose(Struct):
    """Position and orientation of a gateway in gateway_info.yml."""

    position: tuple[Coordinate, Coordinate, Coordinate]
    orientation: tuple[Coordinate, Coordinate, Coordinate, Coordinate]


class GatewayInfo(Struct):
    """Content of gateway_info.yml. Other programs write further keys."""

    gateway1: Pose


def read_spectra(found: Inspection, wanted: float | None) -> Dataset | None:
    """Read a folder of spectra, of one frequency if the folder has several, and note every problem and oddity."""
    folder, problems = found.folder, found.problems
    positions = found.positions()
    count = 0 if positions is None else len(positions)
    doing(f"{folder}: reading {count:,} spectra", SECONDS * count)
    names, pictures = read_pictures(folder / "spectrum", problems)
    nowhere = np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])
    gateway_position, gateway_orientation = found.noting(nowhere, read_gateway, folder / "gateway_info.yml")
    metadata = found.metadata()
    rows_of_positions = None if positions is None else len(positions)
    receivers = _receivers(found, metadata.get("moving", "transmitter"), rows_of_positions)
    array, grid = stated_array(metadata), stated_grid(metadata)
    simulated = "scene_file" in metadata  # if it has no index files, it is unfinished
    train, test = read_split(found, names, "spectra", needed=simulated)
    if not (simulated or len(train) or len(test)):
        found.warnings.append("there are no index files: use the split random (or blocked, from 21 spectra on)")

    numbers = np.array([int(name) for name in names], dtype=int)
    rows_known = rows_of_positions
    if positions is not None and len(names):
        without_row = [name for name, number in zip(names, numbers, strict=True) if number > len(positions)]
        if without_row:
            rows_known = None  # or a wrong length of channels.npz would be reported, too, for the same reason
            problems.append(
                f"{folder / 'tx_pos.csv'}: expected a row for each of the {len(names)} pictures, found "
                f"{len(positions)} rows; spectrum/{without_row[0]}.png has none"
            )
        if len(positions) > len(names):
            found.warnings.append(f"tx_pos.csv has {len(positions)} rows for {len(names)} pictures")

    rows = numbers - 1
    frequency = Frequency()
    if len(rows):
        of_folder = found.noting(None, frequency_of, folder, metadata, rows, wanted)
        if of_folder is None:
            return None
        frequency, chosen = of_folder
        if len(chosen) < len(rows) and not problems:
            place = {old: new for new, old in enumerate(chosen.tolist())}
            train, test = (np.array([place[each] for each in part if each in place], int) for part in (train, test))
            rows, names, pictures = rows[chosen], [names[each] for each in chosen], pictures[chosen]
        if isinstance(array, PlanarArray) and "frequencies_hz" in metadata:  # the array is that of metres
            ratio = frequency.hertz / read_frequency(metadata["frequency_hz"])
            array = replace(array, spacing=array.spacing * ratio)
    array = None if array is None else array.at(frequency.hertz)
    elements = (array or PlanarArray()).elements
    band = found.band(metadata, frequency.hertz)
    path = folder / "channels.npz"
    recorded = found.noting(Recorded(), read_responses, path, rows_known, elements, band)
    if problems or positions is None:
        return None
    found.note_changed_places(metadata, tx_pos=positions, rx_pos=receivers)
    of_rows = found.noting(dict[str, np.ndarray](), recorded.of_rows, path, rows)
    if problems:
        return None
    moving = None if receivers is None else receivers[rows]
    known = identify(pictures, array, grid)
    _look_for_shared_positions(found, positions[rows] if moving is None else np.hstack([positions[rows], moving]))
    if known.beamformer.grid.elevation_step_deg < 0:
        problems.append(
            f"{folder / 'spectrum'}: expected row 0 at the horizon, found upside-down pictures with elevation "
            f"{known.beamformer.grid.elevation_first_deg:.0f}° in row 0 (an array explains them in this way to "
            f"{known.residual:.2f} grey levels); bisplat dataset turns them over"
        )
    return Dataset(
        folder=folder,
        names=names,
        values={"spectrum": pictures, **of_rows},
        receiver=ArrayReceiver(gateway_position, gateway_orientation, known, moving),
        places=positions[rows],
        train=train,
        test=test,
        band=band if any(each.ndim == 3 for each in of_rows.values()) else None,
        metadata=metadata,
        frequency=frequency,
    )


def read_gateway(path: Path) -> tuple[Float[np.ndarray, 3], Float[np.ndarray, 4]]:
    """Read gateway_info.yml: position, metres, and unit quaternion (x, y, z, w)."""
    pose = conform(read_yaml(path, GATEWAY), GatewayInfo, str(path), numbers_as_text=True).gateway1
    length = math.hypot(*pose.orientation)
    if abs(length - 1) > UNIT_TOLERANCE:
        raise InputError(
            f"{path}: gateway1.orientation: expected a quaternion of unit length, found length {length:.4g}"
        )
    return np.array(pose.position), np.array(pose.orientation) / length


def write_spectra(
    folder: Path,
    called: Path,
    positions: Float[np.ndarray, "K 3"],
    pictures: Iterable[UInt8[np.ndarray, "n 90 360"]],
    gateway: Gateway,
    metadata: dict[str, Any],
    receivers: Float[np.ndarray, "K 3"] | None = None,
) -> None:
    """Write the files of spectra, but for index files, into an empty folder."""
    (folder / "spectrum").mkdir()
    names = iter(picture_names(len(positions)))
    with ThreadPoolExecutor() as pool:
        for some in pictures:
            for content, name in zip(pool.map(encode_picture, some), names, strict=False):
                write_atomically(folder / "spectrum" / f"{name}.png", content)
    write_positions(folder / "tx_pos.csv", positions)
    if receivers is not None:
        write_positions(folder / "rx_pos.csv", receivers)
    write_gateway(folder / "gateway_info.yml", called.name, gateway.position, gateway.orientation)
    write_metadata(folder / "metadata.json", metadata)


def write_gateway(path: Path, dataset_name: str, position: Sequence[float], orientation: Sequence[float]) -> None:
    """Write gateway_info.yml."""
    name = yaml.safe_dump({"dataset_name": dataset_name}, allow_unicode=True, width=math.inf)  # quoted where needed
    text = (
        f"{name}"
        "gateway1:\n"
        f"  position: [{', '.join(f'{value:.6f}' for value in position)}]\n"
        f"  orientation: [{', '.join(f'{value:.9f}' for value in orientation)}]  # x, y, z, w\n"
    )
    write_atomically(path, text.encode())


def _receivers(found: Inspection, moving: Moving, count: int | None) -> Float[np.ndarray, "K 3"] | None:
    """Where the middle of the array is for each row of tx_pos.csv, as rx_pos.csv states it, if both ends move."""
    path = found.folder / "rx_pos.csv"
    if moving != "both":
        if os.path.lexists(path):
            found.problems.append(
                f'{path}: expected "moving": "both" in metadata.json beside it, found "{moving}"; bisplat dataset '
                "--moving both states it"
            )
        return None
    return found.noting(None, read_receivers, path, count)


def read_receivers(path: Path, count: int | None) -> Float[np.ndarray, "K 3"]:
    """Read rx_pos.csv, which has as many rows as tx_pos.csv."""
    receivers = read_points(path)
    if count is not None and len(receivers) != count:
        raise InputError(f"{path}: expected {count} rows, as in tx_pos.csv, found {len(receivers)}")
    return receivers


def _look_for_shared_positions(found: Inspection, positions: Float[np.ndarray, "K coordinates"]) -> None:
    places, pictures_there = np.unique(positions, axis=0, return_counts=True)
    if len(positions) > 1 and len(places) == 1:
        at = places[0].tolist()
        path = found.folder / "tx_pos.csv"
        found.problems.append(f"{path}: expected positions that differ, found {at} for all {len(positions)}")
    elif sharing := int(pictures_there[pictures_there > 1].sum()):
        found.warnings.append(
            f"{sharing} of {len(positions)} pictures share their position with another picture; if the folder mixes "
            "frequencies or gateways, bisplat dataset --one-per-position 1 keeps the first of each"
        )


def assumptions_of_spectra(dataset: Dataset) -> list[str]:
    """A sentence for each physical quantity that the folder does not state and its pictures do not show."""
    found = []
    if dataset.frequency.source == "assumed":
        found.append(
            f"the frequency is assumed to be {dataset.frequency}, a wavelength of {dataset.wavelength * 100:.1f} cm; "
            'state it in metadata.json, such as {"frequency_hz": 2.4e9}'
        )
    array, rows = dataset.array, dataset.grid.elevations_deg
    if dataset.identification.source == "assumed":
        found.append(
            f"the array is assumed to have {array.in_words.replace('λ', 'wavelengths')}; state it as array in "
            "metadata.json (bisplat check says what the pictures show)"
        )
    if dataset.identification.grid_source == "assumed":
        found.append(
            f"the rows of the pictures are assumed to be elevations from {rows[0]:g}° to {rows[-1]:g}°; state them "
            "as grid in metadata.json"
        )
    return found
