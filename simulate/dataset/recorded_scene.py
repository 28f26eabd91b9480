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

    >>> recorded_scene(Path("data"), {}) is None
    True
    """
    return load_scene(folder / metadata["scene_file"]) if metadata.get("scene_file") else None


def scene_of(dataset: Dataset) -> Scene | None:
    """Read the scene of a dataset, at the dataset's frequency. None: its metadata names none."""
    scene = recorded_scene(dataset.folder, dataset.metadata)
    return None if scene is None else at_its_frequency(scene, dataset)


def at_its_frequency(scene: Scene, dataset: Dataset) -> Scene:
    """A scene as a dataset was simulated in it: at another frequency, if one was asked for, with the same array."""
    return with_same_array(scene, dataset.frequency.hertz) if dataset.metadata.get("frequencies_hz") else scene
