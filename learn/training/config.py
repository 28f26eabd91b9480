"""The settings of a run, and config.json and split.json, which record them. Needs no torch."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

from learn.models.registry import DEFAULT_MODEL
from learn.splits import Split, SplitKind
from scenes.atomic import write_atomically
from scenes.errors import InputError
from simulate.array import PlanarArray


@dataclass(frozen=True, kw_only=True)
class Steps:
    """How a model is trained by gradient steps.

    Attributes:
        steps: optimiser steps, rounded to whole epochs.
        batch_size: spectra per step.
        learning_rate: of AdamW, after warm-up.
        init: folder of a finished run of the same model whose weights to begin with; None: random weights.
    """

    steps: int = 1500
    batch_size: int = 8
    learning_rate: float = 1e-3
    init: str | None = None


@dataclass(frozen=True, kw_only=True)
class Config:
    """Settings of a run; the same settings on the same data give the same weights.

    Attributes:
        dataset: folder trained on, absolute.
        model: name in ``learn.models.registry``.
        split: how the test part is chosen.
        seed: draws the initial weights and the order of the spectra.
        split_seed: draws the split.
        train_size: train on so many spectra of the training part, drawn at random; None: on all.
        options: arguments of the model that differ from its registry entry's.
        by_steps: for a model trained by steps; None for a model fitted in closed form.
    """

    dataset: str
    model: str = DEFAULT_MODEL
    split: SplitKind = "files"
    seed: int = 0
    split_seed: int = 0
    train_size: int | None = None
    options: dict[str, Any] = field(default_factory=dict)
    by_steps: Steps | None = None

    def __post_init__(self) -> None:
        # As JSON has them, so that settings read back equal those written.
        object.__setattr__(self, "options", json.loads(json.dumps(self.options)))

    def settings(self) -> dict[str, Any]:
        """Everything in one flat mapping, by the names a user knows."""
        content = asdict(self)
        return {**content.pop("options"), **(content.pop("by_steps") or {}), **content}


def write_config(folder: Path, config: Config, array: PlanarArray, split: Split, names: Sequence[str]) -> None:
    """Write config.json and split.json.

    Args:
        folder: the run's.
        config: its settings.
        array: the gateway's array.
        split: indices into ``names``.
        names: of the dataset's spectra.
    """
    content = {
        **asdict(config),
        "array": asdict(array),
        "normalisation": "pictures are min-max normalised per spectrum; positions are scaled inside the model",
        "versions": {name: version(name) for name in ("bisplat-wrf", "torch", "lightning", "numpy")},
    }
    write_atomically(folder / "config.json", (json.dumps(content, indent=2) + "\n").encode())
    parts = {part: [names[i] for i in getattr(split, part)] for part in ("train", "validation", "test")}
    write_atomically(folder / "split.json", (json.dumps(parts, indent=1) + "\n").encode())


def read_config(folder: Path) -> tuple[Config, PlanarArray]:
    """Read config.json.

    Raises:
        InputError: no such file, or not what ``write_config`` writes.
    """
    path = folder / "config.json"
    if not path.is_file():
        raise InputError(f"{folder}: expected a run folder made by bisplat train, found no config.json in it")
    try:
        content: dict[str, Any] = json.loads(path.read_text())
        fields = {name: content[name] for name in Config.__dataclass_fields__}
        if fields["by_steps"] is not None:
            fields["by_steps"] = Steps(**fields["by_steps"])
        return Config(**fields), PlanarArray(**content["array"])
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path}: expected the settings that bisplat train 0.2 writes, found {error!r}") from error
