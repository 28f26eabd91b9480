"""Training of a model on a dataset into a run folder. The same call again resumes an interrupted training."""

from __future__ import annotations

import time
from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from jaxtyping import Float

from learn.data.expected_score import say_expectation
from learn.data.split_distances import SplitDistances, say_distances
from learn.data.splits import GUARD_MOST, Split
from learn.data.splits import split as split_of
from learn.models.base import SpectrumModel
from learn.models.kriging.retrieved_field import not_retrieved
from learn.models.model_settings import PATIENCE
from learn.models.quadrature import quadrature
from learn.training.config import (
    Config,
    read_config,
    require_same_data,
    require_same_receiver,
    require_untested,
    write_config,
)
from learn.training.registry import (
    DEFAULT_MODEL,
    PRESETS,
    PresetName,
    check_options,
    in_one_sentence,
    in_words,
    is_own,
    model_class,
    model_entry,
)
from learn.training.run_files import untrained_model, write_training
from learn.training.run_folder import SpectrumRun, load_spectra, load_weights, save_weights
from learn.training.validation_part import Learned, fit_in_closed_form, learned_responses
from scenes.files.atomic import require_writable
from scenes.files.errors import (
    InputError,
    ParameterError,
    require_path,
    require_seed,
    require_whole,
    require_within,
    require_word,
)
from scenes.files.output_folder import own_folder, require_own
from scenes.files.plain_text import say
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import given_dataset
from simulate.positions.positions import MOST_POSITIONS

if TYPE_CHECKING:
    from learn.training.budget import Timed


def train_spectra(
    config: Config,
    dataset: Dataset | None,
    output: Path,
    budget: float | None,
    preset: PresetName | None,
    trainer: Mapping[str, Any],
    by_steps: dict[str, Any],
) -> SpectrumRun:
    """Train a model of spectra, as ``bisplat.train`` explains it, with the settings of a run but those by steps."""
    model = config.model
    if preset is not None:
        require_word(tuple(PRESETS), preset=preset)
        if model not in (DEFAULT_MODEL, PRESETS[preset].model):
            raise ParameterError("model", f"expected none beside the preset {preset}, found {model}")
        model = PRESETS[preset].model
    entry = model_entry(model)
    if by_steps.get("init") is not None:
        require_path(init=by_steps["init"])
        by_steps["init"] = str(Path(by_steps["init"]).resolve())
    for name in (*by_steps, *(["budget"] if budget is not None else []), *(["trainer"] if trainer else [])):
        if entry.by_steps is None:
            raise ParameterError(name, f"expected a model trained by steps, found {model}")
    told = {**config.options, **by_steps}
    if preset is not None and budget is None:
        by_steps = {"steps": PRESETS[preset].steps} | by_steps
    if "steps" not in by_steps and budget is None:
        by_steps = {"patience": PATIENCE} | by_steps
    config = replace(config, model=model, by_steps=entry.by_steps and replace(entry.by_steps, **by_steps))
    learned, begun = None, (output / "config.json").exists()
    if budget is not None and begun:
        config = _with_steps_of(output, config)
    elif budget is not None or (preset is not None and not begun):
        processes = _check(config, trainer)
        dataset = given_dataset(dataset or config.dataset)
        chosen, learned, minutes = _timed(budget, config, output, dataset, processes)
        config = replace(config, by_steps=chosen)
        if preset is not None:
            say(in_words(preset, chosen.steps, told, minutes))
        else:
            say(f"{chosen.steps} steps fit into {budget:g} minutes")
    train_run(config, output, trainer, dataset, learned, say_split=True)
    return load_spectra(output)


def _with_steps_of(folder: Path, config: Config) -> Config:
    """Settings with the number of steps that the run in a folder began with, to continue it within its old budget."""
    assert config.by_steps is not None
    begun = read_config(folder).config.by_steps or config.by_steps
    say(f"{folder}: keeps the {begun.steps} steps that this run began with, whatever the budget")
    return replace(config, by_steps=replace(config.by_steps, steps=begun.steps))


def _timed(budget: float | None, config: Config, folder: Path, dataset: Dataset, processes: int) -> Timed:
    """The settings with as many steps as fit into the budget (minutes) if there is one, and the time that they take."""
    from learn.training.budget import timed  # imports Lightning, which a fit in closed form does not need

    assert config.by_steps is not None
    require_own(*_own(config, folder))
    parts = split_of(dataset, config.split, config.split_seed, config.train_size, config.guard)
    torch.manual_seed(config.seed)
    model = untrained_model(config, dataset, parts)
    return timed(budget, model, config.by_steps, dataset, parts, config.seed, processes)


def train_run(
    config: Config,
    folder: Path,
    trainer: Mapping[str, Any] = MappingProxyType({}),
    dataset: Dataset | None = None,
    learned: Learned | None = None,
    say_split: bool = False,
    minutes: float | None = None,
) -> None:
    """Train with the settings of a run. A finished run is left as it is.

    An interrupted run resumes from its last checkpoint, and ends with the weights of an uninterrupted run. A training
    by steps ends early when its minutes, if they are given, are over.
    """
    _check(config, trainer)
    require_own(*_own(config, folder))
    finished = (folder / "weights.safetensors").exists()
    if not finished:
        require_writable(folder / "config.json")
    dataset = given_dataset(dataset or config.dataset)
    why = model_class(config.model).unsuited(dataset)
    if why is not None:
        raise InputError(f"{dataset.folder}: the model {config.model}: {why}")
    parts = split_of(dataset, config.split, config.split_seed, config.train_size, config.guard)
    if (folder / "config.json").exists():
        require_same_data(dataset, folder, read_config(folder), parts)
    if finished:
        return
    if config.by_steps is not None and config.by_steps.init is not None:
        before = load_spectra(config.by_steps.init)
        require_same_receiver(dataset, before.folder, before.beamformer, float(before.model.wavelength))
        if before.is_trained_on(dataset):
            require_untested(before.split(dataset).known, before.folder, dataset, parts)
    if config.by_steps is not None:
        from learn.training.lightning_trainer import is_first_process

        if not is_first_process():  # only the first claims the folder and writes to it
            _train(config, folder, trainer, dataset, parts, learned, minutes)
            return
    with own_folder(*_own(config, folder)):
        if not (folder / "weights.safetensors").exists():  # another process may have finished the run just now
            write_config(folder, config, dataset, parts)
            if say_split:
                known, tested = dataset.positions[parts.known], dataset.positions[parts.test]
                sizes = f"{len(parts.train)} training, {len(parts.validation)} validation, {len(parts.test)} test"
                distances = SplitDistances.between(known, tested, dataset.wavelength)
                say_distances(distances, f"split {config.split}: {sizes} spectra; ")
                say_expectation(known, dataset.wavelength, dataset.array, "response" in dataset.values)
            unfound = not_retrieved(dataset)
            if unfound is not None:
                say(unfound)
            own = is_own(model_class(config.model))
            expected = "a model of spectra [B, 90, 360] of float32 that follow from its weights"
            with in_one_sentence(f"model {config.model}", expected) if own else nullcontext():
                _train(config, folder, trainer, dataset, parts, learned, minutes)


def _own(config: Config, folder: Path) -> Any:
    """The run folder with these settings, as ``own_folder`` and ``require_own`` take it."""
    return folder, "run", "config.json", config.settings(), lambda file: read_config(file.parent).config.settings()


def _train(
    config: Config,
    folder: Path,
    trainer: Mapping[str, Any],
    dataset: Dataset,
    parts: Split,
    learned: Learned | None,
    minutes: float | None,
) -> None:
    """Train an unfinished run in a folder that holds its settings."""
    torch.manual_seed(config.seed)
    model = untrained_model(config, dataset, parts)
    if config.by_steps is None:
        began = time.perf_counter()
        validation = fit_in_closed_form(model, dataset, parts)
        write_training(folder, 0, time.perf_counter() - began, *validation, dataset.positions[parts.known])
        save_weights(folder, model)
        return
    from learn.training.gradient_steps import Spectra, train_by_steps

    _check_forward(config.model, model, dataset.positions[parts.train[:2]])
    if config.by_steps.init is not None:
        load_weights(model, Path(config.by_steps.init))
    learned = learned or learned_responses(model, dataset, parts, config.by_steps)
    spectra = Spectra(dataset, parts, config.by_steps.batch_size, config.seed, learned.responses)
    pixels = quadrature(dataset.beamformer)
    train_by_steps(model, spectra, config.by_steps, pixels, folder, trainer, learned.seconds, minutes)


def _check_forward(name: str, model: SpectrumModel, positions: Float[np.ndarray, "B 3"]) -> None:
    """Refuse a model of the user's whose prediction cannot be trained, before any step."""
    if not is_own(type(model)):
        return
    found: Any = model(torch.from_numpy(positions).float())
    shape = (len(positions), 90, 360)
    if not isinstance(found, torch.Tensor):
        seen = type(found).__name__
    elif tuple(found.shape) != shape or found.dtype != torch.float32:
        seen = f"a tensor {list(found.shape)} of {str(found.dtype).removeprefix('torch.')}"
    elif not found.requires_grad:
        seen = "a tensor that follows from none of its weights"
    else:
        return
    expected = f"expected forward to return float32 spectra {list(shape)} that follow from its weights"
    raise InputError(f"model {name}: {expected}, found {seen}")


def _check(config: Config, trainer: Mapping[str, Any]) -> int:
    """Check numbers and the model's options before any folder is made. Return the number of processes."""
    check_options(config.model, config.options)
    for name in model_entry(config.model).needs:
        if not config.options.get(name):
            raise ParameterError(name, f"expected a value, which the model {config.model} needs, found none")
    require_seed(seed=config.seed, split_seed=config.split_seed)
    require_within(0, GUARD_MOST, "wavelengths", guard=config.guard)
    if config.train_size is not None:
        require_whole(1, MOST_POSITIONS, train_size=config.train_size)
    if config.by_steps is None or not trainer:
        return 1
    from learn.training.lightning_trainer import process_count  # imports Lightning

    return process_count(trainer, config.by_steps.batch_size)
