"""Folders of rooms, each of which is a dataset folder, and the scene that a dataset was simulated in."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

from scenes.files.errors import InputError, require_path, shown
from scenes.files.json_yaml_xml import read_json
from scenes.scene.description import Scene, with_same_array
from scenes.storage.scene_yaml import load_scene
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import read_dataset
from simulate.dataset.dataset_kinds import ROOMS, Setting


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
    """A folder of simulated rooms. Iteration reads their datasets one by one."""

    folder: Path
    setting: Setting  # what differs from room to room
    names: tuple[str, ...]  # of the dataset folders in it, in order
    facts: dict[str, Any]  # the content of rooms.json

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
            raise InputError(f"{folder / name}: expected a room, found none: run the same bisplat simulate again")
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
