"""The scene that a dataset folder of any kind was simulated in."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from scenes.scene.description import Scene
from scenes.storage.scene_yaml import load_scene


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
