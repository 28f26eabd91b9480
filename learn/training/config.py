"""Settings of a run, and the files config.json and split.json that record them. This module does not import torch."""

from __future__ import annotations

import json
import os
from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
from msgspec import Meta, Struct

from learn.data.splits import Split, SplitKind
from learn.models.model_settings import Steps
from learn.training.registry import DEFAULT_MODEL
from scenes.files.atomic import write_atomically
from scenes.files.errors import InputError, ParameterError, cut, require_whole, shown
from scenes.files.json_yaml_xml import read_json
from scenes.files.options import check_kinds
from scenes.files.schema import LATER, Count, conform
from simulate.dataset.dataset_kinds import content_of
from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.element_array import ElementArray, array_kind

if TYPE_CHECKING:  # a slow import that the command line's help does not need
    from simulate.dataset.dataset import Dataset

PACKAGE = "bisplat-wrf"

LARGEST_OPTION = 10**6
"""Largest whole number among a model's options, such as its primitives; the memory grows in proportion to them."""


Option = bool | Annotated[int, Meta(ge=-LARGEST_OPTION, le=LARGEST_OPTION)] | float | str | list[Any] | None


class Origin(Struct):
    """What config.json says besides the settings: the dataset's array, grid and fingerprint, and versions."""

    array: PlanarArray
    grid: AngularGrid
    dataset_sha256: str | None = None
    frequency_hz: Annotated[float, Meta(gt=0)] | None = None
    versions: dict[str, str] = {}


class OriginOfElements(Origin, kw_only=True):
    """``Origin`` of a dataset whose array is given by the positions of its elements."""

    array: ElementArray  # type: ignore[assignment]


@dataclass(frozen=True, kw_only=True)
class Config:
    """Settings of a run. The same settings on the same dataset give the same weights.

    Attributes:
        dataset: absolute path of the dataset folder.
        model: name of the model, or ``module:Class``.
        split: how the test part is chosen.
        guard: known positions nearer than this to a test position are left out, wavelengths.
        seed: seed of the initial weights and the order of the spectra.
        split_seed: seed of the split.
        train_size: number of training spectra, drawn at random from the training part. None: all of them.
        options: options of the model that differ from its defaults.
        by_steps: settings of training by steps. None: the model is fitted in closed form.
    """

    dataset: str
    model: str = DEFAULT_MODEL
    split: SplitKind = "files"
    seed: Count = 0
    split_seed: Count = 0
    train_size: Annotated[int, Meta(ge=1)] | None = None
    guard: float = field(default=0.0, metadata=LATER)
    options: dict[str, Option] = field(default_factory=dict)
    by_steps: Steps | None = None

    def __post_init__(self) -> None:
        check_kinds(self)
        # Options are converted as JSON converts them (tuples to lists), so that settings equal those read back.
        object.__setattr__(self, "options", {name: _as_json(name, value) for name, value in self.options.items()})

    def settings(self) -> dict[str, Any]:
        """All settings in one flat dictionary, by the names of the parameters of ``train``.

        An option of one's own model that has the name of a parameter is called "option seed".
        """
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
    """The content of config.json.

    Attributes:
        config: the settings.
        beamformer: the dataset's array and grid.
        dataset_sha256: fingerprint of the dataset. None: an older version trained the run, which kept none.
        version: version of bisplat-wrf that trained the run; empty if it is not known.
        frequency: of the dataset, Hz. None: an older version trained the run, which did not record it.
    """

    config: Config
    beamformer: Beamformer
    dataset_sha256: str | None
    version: str
    frequency: float | None


def write_config(folder: Path, config: Config, dataset: Dataset, split: Split) -> None:
    """Write config.json and split.json."""
    content = {
        **asdict(config),
        "dataset_sha256": dataset.fingerprint,
        "frequency_hz": dataset.frequency.hertz,
        "array": asdict(dataset.array),
        "grid": asdict(dataset.grid),
        "normalisation": "pictures are min-max normalised per spectrum; positions are scaled inside the model",
        "versions": {name: version(name) for name in (PACKAGE, "torch", "lightning", "numpy")},
    }
    write_atomically(folder / "config.json", (json.dumps(content, indent=2) + "\n").encode())
    parts = {part: [dataset.names[i] for i in getattr(split, part)] for part in ("train", "validation", "test")}
    write_atomically(folder / "split.json", (json.dumps(parts, indent=1) + "\n").encode())


def read_config(folder: Path) -> RunRecord:
    """Read config.json."""
    path = folder / "config.json"
    if not os.path.lexists(path):
        found = content_of(folder) or "no config.json in it"
        raise InputError(f"{folder}: expected a run folder made by bisplat train, found {found}")
    content = read_json(path, "the settings that bisplat train 0.2 writes")
    known = Config.__dataclass_fields__  # other keys are for readers only
    settings = {key: content[key] for key in content if key in known} if isinstance(content, dict) else content
    try:
        config = conform(settings, Config, str(path), complete=True)
        planar = array_kind(content.get("array") if isinstance(content, dict) else None) is PlanarArray
        origin = conform(content, Origin if planar else OriginOfElements, str(path))
    except InputError as error:
        raise InputError(f"{error}{of_another_version(_version(content))}") from None
    try:
        beamformer = Beamformer(origin.array, origin.grid)
    except ParameterError as error:  # positions in metres without their frequency
        raise InputError(f"{path}: array.{error}") from None
    return RunRecord(config, beamformer, origin.dataset_sha256, _version(content), origin.frequency_hz)


def _version(content: Any) -> str:
    versions = content.get("versions") if isinstance(content, dict) else None
    return str(versions.get(PACKAGE, "")) if isinstance(versions, dict) else ""


def of_another_version(trained_by: str) -> str:
    """The end of a message about a run that cannot be read; empty if this version trained it."""
    if trained_by in ("", version(PACKAGE)):
        return ""
    return f"; bisplat-wrf {cut(trained_by)} trained this run, and this is {version(PACKAGE)}: train it again"
