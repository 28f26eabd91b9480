"""The gateways of received powers in a described scene, each alone; nothing here needs the ray tracer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from learn.data.same_receiver import require_same_frequency
from scenes.checks.validation import validate
from scenes.scene.antennas import Gateway
from scenes.scene.description import Scene
from simulate.dataset.dataset import Dataset
from simulate.generation.listening_gateways import gateways_of


def scenes_with_gateways(scene: Scene, dataset: Dataset) -> dict[str, Scene]:
    """The scene as described with each gateway of received powers alone, by the gateway's name."""
    require_same_wavelength(scene, dataset)
    scenes = alone(scene, described_gateways(dataset))
    for name, each in scenes.items():
        validate(each, f"{dataset.folder}: gateway {name}")
    return scenes


def described_gateways(dataset: Dataset) -> dict[str, Gateway]:
    """The gateways of received powers: their places from the folder, all else from its metadata.json if that has it."""
    places = {name: tuple(place) for name, place in zip(dataset.gateway_names, dataset.gateway_positions, strict=True)}
    stated = dataset.metadata.get("gateways", {})
    keys = ("orientation", "pattern", "polarization")
    return {
        name: replace(gateway, **{key: stated[name][key] for key in keys if key in stated.get(name, {})})
        for name, gateway in gateways_of(places).items()
    }


def alone(scene: Scene, gateways: Mapping[str, Gateway]) -> dict[str, Scene]:
    """The scene with each gateway alone, by its name."""
    return {name: replace(scene, gateway=each, further_gateways={}) for name, each in gateways.items()}


def require_same_wavelength(scene: Scene, dataset: Dataset) -> None:
    """Refuse a dataset that states another frequency than the scene's."""
    if dataset.frequency.source != "assumed":
        require_same_frequency(scene.name, dataset.folder, dataset.wavelength, scene.wavelength)
