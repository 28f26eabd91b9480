"""The methods that predict received powers, by name."""

from __future__ import annotations

import copy
from collections.abc import Callable, Collection, Mapping
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any

from learn.powers.known_powers import PowerMethod
from learn.powers.mirror_powers import MirrorPowers
from learn.powers.nerf_powers import NerfPowers
from learn.powers.power_baselines import InverseDistance, Kriging, LogDistance, Mean, Mri, Nearest
from learn.powers.power_field import PowerField
from learn.powers.twin_powers import TwinPowers
from scenes.files.errors import ParameterError, require_instance
from scenes.scene.description import Scene
from scenes.storage.scene_yaml import load_scene
from simulate.rssi.rssi_dataset import RssiDataset

POWER_METHODS: dict[str, Callable[[], PowerMethod]] = {
    "mean": Mean,
    "nearest": Nearest,
    "inverse-distance": InverseDistance,
    "log-distance": LogDistance,
    "mri": Mri,
    "kriging": Kriging,
    "helmholtz": PowerField,
    "mirror-images": MirrorPowers,
    "nerf2": NerfPowers,
}
"""Functions that make new, unfitted methods. ``with_twin`` adds the one that also needs a described scene."""

TWIN = "twin"

BASELINES = ("mean", "nearest", "inverse-distance", "log-distance")
"""Methods that the report of another one shows beside it."""


def with_twin(
    dataset: RssiDataset, scene: Scene | Path | str | None, asked: Any
) -> Mapping[str, Callable[[], PowerMethod]]:
    """``POWER_METHODS``, and the twin if there is a scene that it can trace."""
    each = asked.values() if isinstance(asked, Mapping) else asked
    if isinstance(each, str) or not isinstance(each, Collection | None):
        return POWER_METHODS  # what is asked for is refused where the methods are chosen
    names = [] if each is None else [name for name in each if isinstance(name, str)]
    if scene is None:
        if TWIN in names:
            raise ParameterError("scene", f"expected the scene that the method {TWIN} traces, found none")
        return POWER_METHODS
    require_instance(Scene, str, PathLike, scene=scene)
    if each is not None and TWIN not in names:
        found = ", ".join(names) or "none"
        raise ParameterError("scene", f"expected the method {TWIN} with it, which alone traces it, found {found}")
    described = scene if isinstance(scene, Scene) else load_scene(scene)
    twin = TwinPowers(described, dataset)  # refuses what does not fit before anything is fitted
    return POWER_METHODS | {TWIN: partial(copy.copy, twin)}
