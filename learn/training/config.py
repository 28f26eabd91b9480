"""Settings of a run, the files config.json and split.json that record them, and whether a dataset is the run's.

This module does not import torch.
"""

from __future__ import annotations

import json
import os
from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
from msgspec import Meta, Struct

from learn.data.same_receiver import (
    SAME_DIRECTION,
    SAME_PLACE,
    in_megahertz,
    other_array,
    other_frequency,
    pose_difference,
)
from learn.data.splits import PARTS, Split, SplitKind, read_split
from learn.models.model_settings import Steps
from learn.training.registry import DEFAULT_MODEL
from scenes.files.atomic import write_atomically
from scenes.files.errors import InputError, ParameterError, require_whole, shown
from scenes.files.json_yaml_xml import read_json
from scenes.files.options import check_kinds
from scenes.files.plain_text import say
from scenes.files.schema import Count, conform
from scenes.scene.description import SPEED_OF_LIGHT
from simulate.dataset.dataset_kinds import content_of
from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.array import Array, PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.element_array import ElementArray, array_kind

if TYPE_CHECKING:  # a slow import that the command line's help does not need
    from simulate.dataset.dataset import Dataset

PACKAGE = "bisplat-wrf"

LARGEST_OPTION = 10**6
"""Largest whole number among a model's options, such as its primitives; the memory grows in proportion to them."""


Option = bool | Annotated[int, Meta(ge=-LARGEST_OPTION, le=LARGEST_OPTION)] | float | str | list[Any] | None


class Data(Struct):
    """What config.json says of the dataset besides the settings."""

    dataset_sha256: str
    frequency_hz: Annotated[float, Meta(gt=0)]


class Receiver(Data, kw_only=True):
    """The same of a dataset of spectra, with its array and grid."""

    array: PlanarArray
    grid: AngularGrid


class ReceiverOfElements(Receiver, kw_only=True):
    """``Receiver`` of a dataset whose array is given by the positions of its elements."""

    array: ElementArray  # type: ignore[assignment]


@dataclass(frozen=True, kw_only=True)
class Config:
    """Settings of a run. The same settings on the same dataset give the same weights."""

    dataset: str  # absolute path of the dataset folder
    quantity: str = "spectrum"  # what is learned
    model: str = DEFAULT_MODEL  # name of the model, or ``module:Class``
    split: SplitKind = "files"  # how the test part is chosen
    seed: Count = 0  # seed of the initial weights and the order of the spectra
    split_seed: Count = 0  # seed of the split
    # number of training spectra, drawn at random from the training part. None: all of them
    train_size: Annotated[int, Meta(ge=1)] | None = None
    guard: float = 0.0  # known positions nearer than this to a test position are left out, wavelengths
    options: dict[str, Option] = field(default_factory=dict)  # options of the model that differ from its defaults
    by_steps: Steps | None = None  # settings of training by steps. None: the model is fitted in closed form

    def __post_init__(self) -> None:
        check_kinds(self)
        # Options are converted as JSON converts them (tuples to lists), so that settings equal those read back.
        object.__setattr__(self, "options", {name: _as_json(name, value) for name, value in self.options.items()})

    def settings(self) -> dict[str, Any]:
        """All settings in one flat dictionary; an option that has the name of a setting is called "option seed"."""
        content = asdict(self)
        options, by_steps = content.pop("options"), content.pop("by_steps")
        settings = {**content, **(by_steps or {})}
        return {
            **{f"option {name}" if name in settings else name: value for name, value in options.items()},
            **settings,
        }


def _as_json(option: str, value: Any) -> Any:
    wrong = ParameterError(option, f"expected a number, a text, a switch or a list, found {shown(value)}")
    try:
        found = json.loads(json.dumps(value.item() if isinstance(value, np.generic) else value))
    except (TypeError, ValueError):
        raise wrong from None
    if isinstance(found, dict):
        raise wrong
    if isinstance(found, int) and not isinstance(found, bool):
        require_whole(-LARGEST_OPTION, LARGEST_OPTION, **{option: found})
    return found


class RunRecord(NamedTuple):
    """The content of config.json: the settings, and what the dataset was."""

    config: Config
    beamformer: Beamformer
    dataset_sha256: str
    frequency: float  # Hz


def write_config(folder: Path, config: Config, dataset: Dataset, split: Split) -> None:
    """Write config.json and split.json."""
    content = {
        **asdict(config),
        "dataset_sha256": dataset.fingerprint,
        "frequency_hz": dataset.frequency.hertz,
        **(_receiver(dataset) if config.quantity == "spectrum" else {}),
        "versions": {name: version(name) for name in (PACKAGE, "torch", "lightning", "numpy")},
    }
    write_atomically(folder / "config.json", (json.dumps(content, indent=2) + "\n").encode())
    parts = {part: [dataset.names[i] for i in getattr(split, part)] for part in ("train", "validation", "test")}
    write_atomically(folder / "split.json", (json.dumps(parts, indent=1) + "\n").encode())


def _receiver(dataset: Dataset) -> dict[str, Any]:
    """What a run of spectra records of the receiver and its pictures."""
    scaled = "pictures are min-max normalised per spectrum; positions are scaled inside the model"
    return {"array": asdict(dataset.array), "grid": asdict(dataset.grid), "normalisation": scaled}


def read_data(folder: Path) -> Data:
    """Read what config.json says of the dataset."""
    return conform(_content(folder), Data, str(folder / "config.json"))


def read_settings(folder: Path) -> Config:
    """Read the settings in config.json."""
    content = _content(folder)
    if isinstance(content, dict):  # other keys are for readers only
        known = {key: content[key] for key in content if key in Config.__dataclass_fields__}
        content = {"quantity": "spectrum"} | known
    return conform(content, Config, str(folder / "config.json"), complete=True)


def learned_quantity(folder: Path) -> str | None:
    """What the run in a folder has learned; None if the folder is no run."""
    return read_settings(folder).quantity if (folder / "config.json").exists() else None


def _content(folder: Path) -> Any:
    path = folder / "config.json"
    if not os.path.lexists(path):
        found = content_of(folder) or "no config.json in it"
        raise InputError(f"{folder}: expected a run folder made by bisplat train, found {found}")
    return read_json(path, "the settings that bisplat train writes")


def read_config(folder: Path) -> RunRecord:
    """Read config.json of a run of spectra."""
    path, config, content = folder / "config.json", read_settings(folder), _content(folder)
    if config.quantity != "spectrum":
        raise InputError(f"{folder}: expected a run of spectra, found one of the quantity {config.quantity}")
    planar = array_kind(content.get("array")) is PlanarArray
    receiver = conform(content, Receiver if planar else ReceiverOfElements, str(path))
    try:
        beamformer = Beamformer(receiver.array, receiver.grid)
    except ParameterError as error:  # positions in metres without their frequency
        raise InputError(f"{path}: array.{error}") from None
    return RunRecord(config, beamformer, receiver.dataset_sha256, receiver.frequency_hz)


def require_same_spectra(dataset: Dataset, folder: Path, fingerprint: str) -> None:
    """Refuse a dataset that is not the one with which a run or an experiment was begun."""
    if dataset.fingerprint != fingerprint:
        raise InputError(
            f"{dataset.folder}: expected the dataset that {folder} was trained on, found other spectra, as if they had "
            "been simulated or measured again; put the former dataset there, or train on this one into another folder"
        )


def require_same_data(dataset: Dataset, folder: Path, record: RunRecord, parts: Split) -> None:
    """Refuse to go on with a run whose dataset, or what it states, has changed since the run was begun."""
    require_same_spectra(dataset, folder, record.dataset_sha256)
    again = "train on it into another folder"
    wavelength = SPEED_OF_LIGHT / record.frequency
    if other_frequency(wavelength, dataset.wavelength):
        expected, found = in_megahertz(wavelength), in_megahertz(dataset.wavelength)
        raise InputError(f"{dataset.folder}: expected {expected} as {folder} was begun with, found {found}; {again}")
    before, now = record.beamformer, dataset.beamformer
    if other_array(before.array, now.array) or before.grid != now.grid:
        raise InputError(
            f"{dataset.folder}: expected {before.array.in_words} on {before.grid} as {folder} was begun with, found "
            f"{now.array.in_words} on {now.grid}; {again}"
        )
    require_same_split(dataset, folder, record.config, parts)


def require_same_split(dataset: Dataset, folder: Path, config: Config, parts: Split) -> None:
    """Refuse to go on with a run whose split has changed since the run was begun."""
    path, from_files = folder / "split.json", config.split == "files"
    finished = (folder / "weights.safetensors").exists()
    # A kill may come before the split is written. A finished run needs its split no more, unless the user states it.
    if not path.exists() or (finished and not from_files):
        return
    begun = read_split(path, dataset.names, dataset.folder)
    if any(set(getattr(begun, part)) != set(getattr(parts, part)) for part in PARTS):
        why = ", as if the index files had been changed" if from_files else ""
        raise InputError(
            f"{dataset.folder}: expected the split that {folder} was begun with, found another one{why}; train on it "
            "into another folder"
        )


def require_untested(before_known: np.ndarray, before: Path, dataset: Dataset, parts: Split) -> None:
    """Refuse to start with the weights of a run that has learned test spectra of this training."""
    both = np.intersect1d(before_known, parts.test)
    if len(both):
        raise InputError(
            f"{before}: expected a run that has not learned the test spectra, found one that learned {len(both)} of "
            f"{len(parts.test)}, such as {dataset.names[both[0]]}; start from one with the same test part"
        )


def require_same_receiver(dataset: Dataset, folder: Path, beamformer: Beamformer, wavelength: float) -> None:
    """Refuse a run with whose weights a model of a dataset cannot start."""
    if other_frequency(dataset.wavelength, wavelength):
        expected, found = in_megahertz(dataset.wavelength), in_megahertz(wavelength)
        raise InputError(f"{folder}: expected a run at {expected}, found one at {found}")
    if other_array(dataset.array, beamformer.array) or dataset.grid != beamformer.grid:
        raise InputError(
            f"{folder}: expected a run of {dataset.array.in_words} on {dataset.grid}, found one of "
            f"{beamformer.array.in_words} on {beamformer.grid}"
        )


def require_same_link(folder: Path, array: Array, wavelength: float, known: Dataset, tested: Dataset) -> None:
    """Refuse another dataset whose spectra a run does not predict. Warn if the end that stands still is elsewhere."""
    if other_frequency(wavelength, tested.wavelength):
        assumed = "the assumed " if tested.frequency.source == "assumed" else ""
        raise InputError(
            f"{tested.folder}: expected spectra at {in_megahertz(wavelength)}, as {folder} predicts them, found "
            f"{assumed}{in_megahertz(tested.wavelength)}"
        )
    if other_array(array, tested.array):
        assumed = "the assumed " if tested.identification.source == "assumed" else ""
        raise InputError(
            f"{tested.folder}: expected spectra of {array.in_words}, as {folder} predicts them, found "
            f"{assumed}{tested.array.in_words}"
        )
    if known.moving != tested.moving:
        raise InputError(
            f"{tested.folder}: expected spectra for which the {known.moving} moves, as for {folder}, found some "
            f"for which the {tested.moving} does"
        )
    distance, angle = pose_difference(
        (known.gateway_position, known.gateway_orientation), (tested.gateway_position, tested.gateway_orientation)
    )
    if distance > SAME_PLACE * tested.wavelength or angle > SAME_DIRECTION:
        end, does = ("gateway", "receives") if tested.moving == "transmitter" else ("transmitter", "sends")
        say(
            f"warning: the {end} of {tested.folder} is {distance:.3g} m away from that of {folder} and turned by "
            f"{angle:.3g}°; the run predicts what the latter {does}"
        )


@dataclass(frozen=True)
class Origin:
    """Where a model comes from."""

    model: str  # the model's name, or ``module:Class``
    dataset: str  # name of the folder of the dataset it was trained on
    split: str  # kind, guard and seed of the split, in words
    seed: int  # seed of the training
    train: int  # number of training spectra
    validation: int  # number of validation spectra
    fingerprint: str = ""  # that of the dataset

    @classmethod
    def of(cls, config: Config, parts: Split, fingerprint: str) -> Origin:
        """The origin of the model of a run with these settings."""
        words = split_words(config.split, config.guard, config.split_seed)
        counts = (len(parts.train), len(parts.validation))
        return cls(config.model, Path(config.dataset).name, words, config.seed, *counts, fingerprint)


def split_words(kind: str, guard: float | None, seed: int) -> str:
    """A split in words."""
    return f"{kind}, guard {guard:g} wavelengths, seed {seed}" if guard else f"{kind}, seed {seed}"
