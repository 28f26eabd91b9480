"""Reading a NeRF² dataset folder, or a folder of rooms with one for each, and the check that it is valid."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, get_args

import numpy as np
from jaxtyping import Float

from scenes.files.errors import InputError, ParameterError, require_path, shown
from scenes.files.input_file import what_is_at
from scenes.files.json_yaml_xml import read_json
from scenes.files.long_work import doing
from scenes.files.plain_text import say
from scenes.scene.description import Scene, with_same_array
from scenes.scene.frequency import read_frequency
from scenes.storage.scene_yaml import load_scene
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_frequency import Frequency, frequency_of
from simulate.dataset.dataset_kinds import ROOMS, Moving, Setting, not_spectra, unfinished
from simulate.dataset.dataset_reader import (
    Inspection,
    changed_places,
    noting,
    read_gateway,
    read_metadata,
    read_receivers,
)
from simulate.dataset.index_files import read_split
from simulate.dataset.metadata import band_of
from simulate.dataset.picture_files import read_pictures
from simulate.dataset.responses_file import check_responses, read_responses
from simulate.positions.positions import read_points
from simulate.spectra.array import PlanarArray
from simulate.spectra.identification import identify, stated_array, stated_grid


def read_dataset(folder: Path | str, frequency: float | str | None = None) -> Dataset:
    """Read and check a NeRF² dataset folder, simulated or measured.

    The folder needs the pictures ``spectrum/00001.png`` and on, ``tx_pos.csv`` and ``gateway_info.yml``. Element
    responses, metadata and index files are read if they are there. If metadata.json does not state the array and the
    grid of the spectra, they are found by a fit to the pictures. What the folder does not state and the pictures do not
    show, such as the frequency, is assumed, and a line on stderr says so.

    Args:
        folder: the dataset folder.
        frequency: of a folder with pictures of several frequencies, the one to read: hertz, or a text with a unit such
            as "2.4 GHz". None: the folder has only one.

    Returns:
        The dataset.

    Raises:
        ParameterError: the frequency is none.
        InputError: a file is missing, damaged or inconsistent with another one. The message states the first problem
            and the number of further ones.

    Example:
        >>> import bisplat
        >>> dataset = bisplat.read_dataset("data/lab")
        >>> dataset.names[:3], dataset.spectra.shape, dataset.array.elements
        (['00001', '00002', '00003'], (40, 90, 360), 16)
        >>> bisplat.read_dataset("data/attic")
        Traceback (most recent call last):
        scenes.files.errors.InputError: data/attic: expected a dataset folder, found nothing there
    """
    require_path(folder=folder)
    dataset = inspect(Path(folder), None if frequency is None else read_frequency(frequency)).usable()
    doing("")
    place = Path(folder).resolve()
    for sentence in dataset.assumptions():
        if (place, sentence) not in _SAID:  # many programs read a dataset more than once
            _SAID.add((place, sentence))
            say(f"warning: {folder}: {sentence}")
    return dataset


SECONDS = 0.5e-3  # To read a spectrum, about

_SAID: set[tuple[Path, str]] = set()


def inspect(folder: Path, wanted: float | None = None) -> Inspection[Dataset]:
    """Read a folder and collect every problem, instead of stopping at the first."""
    problems: list[str] = []
    warnings: list[str] = []
    if not folder.is_dir():
        return Inspection([f"{folder}: expected a dataset folder, found {what_is_at(folder)}"], [], None)
    if other := not_spectra(folder) or unfinished(folder):
        return Inspection([other], [], None)

    positions = noting(problems, None, read_points, folder / "tx_pos.csv")
    count = 0 if positions is None else len(positions)
    doing(f"{folder}: reading {count:,} spectra", SECONDS * count)
    names, pictures = read_pictures(folder / "spectrum", problems)
    gateway_position, gateway_orientation = read_gateway(folder / "gateway_info.yml", problems)
    metadata = read_metadata(folder / "metadata.json", problems)
    rows_of_positions = None if positions is None else len(positions)
    moving: Moving = metadata.get("moving", "transmitter")
    receivers = read_receivers(folder / "rx_pos.csv", moving, rows_of_positions, problems)
    array, grid = stated_array(metadata), stated_grid(metadata)
    train, test = read_split(folder, names, metadata, problems, warnings)

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
            warnings.append(f"tx_pos.csv has {len(positions)} rows for {len(names)} pictures")

    rows = numbers - 1
    frequency = Frequency()
    if len(rows):
        frequency, chosen = frequency_of(folder, metadata, rows, problems, wanted)
        if len(chosen) < len(rows) and not problems:
            place = {old: new for new, old in enumerate(chosen.tolist())}
            train, test = ([place[each] for each in part if each in place] for part in (train, test))
            rows, names, pictures = rows[chosen], [names[each] for each in chosen], pictures[chosen]
        if isinstance(array, PlanarArray) and "frequencies_hz" in metadata:  # the array is that of metres
            ratio = frequency.hertz / read_frequency(metadata["frequency_hz"])
            array = replace(array, spacing=array.spacing * ratio)
    array = None if array is None else array.at(frequency.hertz)
    elements = (array or PlanarArray()).elements
    band = band_of(metadata)
    if band is not None:
        try:
            band.frequencies(frequency.hertz)
        except ParameterError as error:
            problems.append(f"{folder / 'metadata.json'}: band.{error}")
    found = read_responses(folder / "channels.npz", rows_known, elements, problems, band)
    responses, retrieved = found.channels, found.retrieved
    if problems or positions is None:
        return Inspection(problems, warnings, None)
    warnings.extend(changed_places(metadata, positions, receivers))
    of_pictures = over_band = None
    if responses is not None:
        of_pictures = responses[rows]
        check_responses(folder / "channels.npz", of_pictures, retrieved, problems)
        if found.over_band is not None and not problems:
            over_band = found.over_band[rows].astype(np.complex64)
            check_responses(folder / "channels.npz", over_band, retrieved, problems)
        if problems:
            return Inspection(problems, warnings, None)
        of_pictures = of_pictures.astype(np.complex64)
    dataset = Dataset(
        folder=folder,
        names=names,
        pictures=pictures,
        positions=positions[rows],
        gateway_position=gateway_position,
        gateway_orientation=gateway_orientation,
        train=np.array(train, dtype=int),
        test=np.array(test, dtype=int),
        responses=None if retrieved else of_pictures,
        retrieved=of_pictures if retrieved else None,
        band=None if over_band is None else band,
        band_responses=over_band,
        metadata=metadata,
        identification=identify(pictures, array, grid),
        frequency=frequency,
        moving_receivers=None if receivers is None else receivers[rows],
    )
    places = dataset.positions if receivers is None else np.hstack([dataset.positions, receivers[rows]])
    _look_for_shared_positions(places, folder / "tx_pos.csv", problems, warnings)
    if dataset.grid.elevation_step_deg < 0:
        problems.append(
            f"{folder / 'spectrum'}: expected row 0 at the horizon, found upside-down pictures with elevation "
            f"{dataset.grid.elevation_first_deg:.0f}° in row 0 (an array explains them in this way to "
            f"{dataset.identification.residual:.2f} grey levels); bisplat convert turns them over"
        )
    return Inspection(problems, warnings, None if problems else dataset)


def _look_for_shared_positions(
    positions: Float[np.ndarray, "K coordinates"], path: Path, problems: list[str], warnings: list[str]
) -> None:
    places, pictures_there = np.unique(positions, axis=0, return_counts=True)
    if len(positions) > 1 and len(places) == 1:
        problems.append(f"{path}: expected positions that differ, found {places[0].tolist()} for all {len(positions)}")
    elif sharing := int(pictures_there[pictures_there > 1].sum()):
        warnings.append(
            f"{sharing} of {len(positions)} pictures share their position with another picture; if the folder mixes "
            "frequencies or gateways, bisplat convert --one-per-position 1 keeps the first of each"
        )


def recorded_scene(folder: Path, metadata: dict[str, Any]) -> Scene | None:
    """The scene of a simulated folder; None if its metadata names none."""
    return load_scene(folder / metadata["scene_file"]) if metadata.get("scene_file") else None


def scene_of(dataset: Dataset) -> Scene | None:
    """The scene of a dataset, at the dataset's frequency; None if its metadata names none."""
    scene = recorded_scene(dataset.folder, dataset.metadata)
    return None if scene is None else at_its_frequency(scene, dataset)


def at_its_frequency(scene: Scene, dataset: Dataset) -> Scene:
    """A scene as a dataset was simulated in it: at another frequency, if one was asked for, with the same array."""
    return with_same_array(scene, dataset.frequency.hertz) if dataset.metadata.get("frequencies_hz") else scene


@dataclass(frozen=True)
class Rooms:
    """A folder of simulated rooms.

    Iteration reads the datasets of the rooms one by one. ``len(rooms)`` is their number.

    Attributes:
        folder: the folder.
        setting: what differs from room to room: "same", "furniture" or "layout".
        names: names of the dataset folders in it, in order.
        facts: the content of rooms.json.
    """

    folder: Path
    setting: Setting
    names: tuple[str, ...]
    facts: dict[str, Any]

    def __len__(self) -> int:
        return len(self.names)

    def __iter__(self) -> Iterator[Dataset]:
        return (read_dataset(self.folder / name) for name in self.names)


def read_rooms(folder: Path | str) -> Rooms:
    """Read what ``simulate_rooms`` wrote."""
    require_path(folder=folder)
    folder = Path(folder)
    facts = read_room_facts(folder / ROOMS)
    for name in facts["rooms"]:
        if not (folder / name).is_dir():
            raise InputError(f"{folder / name}: expected a room, found none: run the same bisplat rooms again")
    return Rooms(folder, facts["setting"], tuple(facts["rooms"]), facts)


def read_room_facts(path: Path) -> dict[str, Any]:
    """Read what rooms.json says of the rooms."""
    facts = read_json(path, "a description of rooms")
    names: Any = facts.get("rooms") if isinstance(facts, dict) else None
    if not (isinstance(names, list) and names and all(map(_is_name, names))):
        raise InputError(f"{path}: expected the names of rooms, found {shown(names)}")
    setting: Any = facts.get("setting")
    if setting not in get_args(Setting):
        raise InputError(f"{path}: expected the setting same, furniture or layout, found {shown(setting)}")
    return facts


def _is_name(value: object) -> bool:
    """Whether a value names a folder inside another one."""
    return isinstance(value, str) and Path(value).name == value and value != ".."
