"""The table of methods: which class predicts which quantity.

A new method is a file with ``fit`` and ``predict``, and a line here. Users name their own as ``module:Class``.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from functools import partial
from importlib import import_module
from typing import Any

from learn.training.registry import MODELS
from scenes.files.errors import ParameterError

INTERPOLATION = "learn.methods.interpolation:"

METHODS: dict[str, dict[str, str]] = {
    "mean": {"any": INTERPOLATION + "Mean", "spectrum": "", "channel": ""},
    "mean-picture": {"spectrum": INTERPOLATION + "Mean"},
    "nearest": {"any": INTERPOLATION + "Nearest", "channel": "learn.channels.channel_methods:Nearest"},
    "inverse-distance": {"any": INTERPOLATION + "InverseDistance", "channel": ""},
    "kriging": {"any": INTERPOLATION + "Kriging", "channel": "", "room": ""},
    "kriging-responses": {"spectrum": INTERPOLATION + "KrigingResponses"},
    "log-distance": {"power": "learn.powers.log_distance:LogDistance"},
    "mri": {"power": "learn.powers.log_distance:Mri"},
    "copy": {"channel": "learn.channels.channel_methods:Copy"},
    "ramp": {"channel": "learn.channels.channel_methods:Ramp"},
    "delays": {"channel": "learn.channels.linear_channels:Delays"},
    "helmholtz": {
        "response": "learn.band.band_methods:HelmholtzBand",
        "power": "learn.powers.helmholtz_powers:HelmholtzPowers",
        "channel": "learn.channels.linear_channels:HelmholtzChannels",
        "room": "learn.rooms.room_methods:HelmholtzInRoom",
    },
    "helmholtz-positions": {"channel": "learn.channels.linear_channels:HelmholtzPositions"},
    "helmholtz-pictures": {"room": "learn.rooms.room_methods:HelmholtzOfPictures"},
    "mirror-images": {
        "power": "learn.powers.mirror_powers:MirrorPowers",
        "room": "learn.rooms.room_methods:MirrorImagesInRoom",
    },
    "mlp-responses": {"response": "learn.band.band_methods:ResponseMLPBand"},
    "bisplat-aperture": {"response": "learn.band.band_methods:ApertureBand"},
    "nerf2": {
        "power": "learn.powers.nerf_powers:NerfPowers",
        "channel": "learn.channels.nerf_channels:NerfChannels",
    },
    "attention": {"room": "learn.rooms.room_methods:AttentionOverNeighbours"},
    "twin": {"power": "learn.powers.twin_powers:TwinPowers"},
}
"""The class of each method, by its name, for each quantity, and for "room": spectra of rooms never seen before.

What is under "any" is for all quantities but those with a class of their own, or with none.
"""

TWIN = "twin"  # The method that also needs a described scene

BASELINES: dict[str, tuple[str, ...]] = {
    "spectrum": ("mean-picture", "nearest", "inverse-distance"),
    "power": ("mean", "nearest", "inverse-distance", "log-distance"),
    "channel": ("copy", "ramp", "nearest"),
}
"""Methods that learn nothing, with which every table and report begins, where they are not ``USUAL_BASELINES``."""

USUAL_BASELINES = ("mean", "nearest", "inverse-distance")

SLOW_IN_ROOMS = ("helmholtz-pictures",)  # It takes minutes for each room and number of known spectra


def methods_of(kind: str, dataset: Any = None, scene: Any = None) -> dict[str, Callable[[], Any]]:
    """Functions that make new, unfitted methods for a quantity, or for rooms, by name."""
    found = {name: _class_at(METHODS[name].get(kind) or METHODS[name]["any"]) for name in _names(kind)}
    if kind == "spectrum":
        from learn.methods.trained_model import TrainedModel

        found |= {name: partial(TrainedModel.named, name) for name in MODELS}
    if kind == "power":
        of_scene = found.pop(TWIN)
        if scene is not None:
            found[TWIN] = of_scene.of_scene(scene, dataset)  # refuses what does not fit before anything is fitted
    return found


def named_for(kind: str) -> tuple[str, ...]:
    """Names of the methods for a quantity that need no scene, but for the models of spectra."""
    return tuple(name for name in _names(kind) if name != TWIN)


def _names(kind: str) -> list[str]:
    return [name for name, builds in METHODS.items() if builds.get(kind, builds.get("any"))]


def usual_names(kind: str, methods: Mapping[str, Callable[[], Any]]) -> list[str]:
    """The methods that are compared if none are named: those that need no options and, but for spectra, no training."""
    if kind == "spectrum":
        return [name for name in methods if name not in MODELS or not MODELS[name].needs]
    if kind == "room":
        return [name for name in methods if name not in SLOW_IN_ROOMS]
    return [name for name, make in methods.items() if not trained_by_steps(make)]


def trained_by_steps(make: Callable[[], Any]) -> bool:
    """Whether a method is trained by steps, for as many minutes as it is given."""
    if isinstance(make, partial) and make.args and make.args[0] in MODELS:
        return MODELS[make.args[0]].by_steps is not None
    return bool(getattr(make, "by_steps", False))


def require_scene(kind: str, asked: Any, scene: Any) -> None:
    """Refuse a scene that no method traces, and the twin of powers without one."""
    each = asked.values() if isinstance(asked, Mapping) else asked
    if isinstance(each, str) or not isinstance(each, Collection | None):
        return  # what is asked for is refused where the methods are chosen
    names = [] if each is None else [name for name in each if isinstance(name, str)]
    if scene is None and TWIN in names and kind == "power":
        raise ParameterError("scene", f"expected the scene that the method {TWIN} traces, found none")
    if scene is not None and (kind != "power" or (asked is not None and TWIN not in names)):
        found = ", ".join(names) or "none"
        raise ParameterError(
            "scene", f"expected the method {TWIN} of powers with it, which alone traces it, found {found}"
        )


def _class_at(place: str) -> Any:
    module, _, name = place.partition(":")
    return getattr(import_module(module), name)
