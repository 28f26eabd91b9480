"""The scene that a dataset folder of any kind was simulated in."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from scenes.scene.description import Scene
from scenes.scene.same_array import with_same_array
from scenes.storage.scene_yaml import load_scene
from simulate.dataset.dataset import Dataset


def recorded_scene(folder: Path, metadata: dict[str, Any]) -> Scene | None:
    """Read the scene of a simulated folder.

    Args:
        folder: the folder.
        metadata: content of its metadata.json.

    Returns:
        The scene; None if metadata.json names none, as that of measurements.

    Raises:
        InputError: the scene cannot be read.
        OSError: its file cannot be read.

    >>> recorded_scene(Path("data"), {}) is None
    True
    """
    return load_scene(folder / metadata["scene_file"]) if metadata.get("scene_file") else None


def scene_of(dataset: Dataset) -> Scene | None:
    """Read the scene of a dataset, at the dataset's frequency. None: its metadata names none.

    Args:
        dataset: the dataset.

    Raises:
        InputError: the scene cannot be read.
        OSError: its file cannot be read.
    """
    scene = recorded_scene(dataset.folder, dataset.metadata)
    return None if scene is None else at_its_frequency(scene, dataset)


def at_its_frequency(scene: Scene, dataset: Dataset) -> Scene:
    """A scene as a dataset was simulated in it: at another frequency, if one was asked for, with the same array.

    Args:
        scene: the scene of the dataset, or a changed one.
        dataset: the dataset.
    """
    return with_same_array(scene, dataset.frequency.hertz) if dataset.metadata.get("frequencies_hz") else scene
