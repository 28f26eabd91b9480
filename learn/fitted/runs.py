"""Runs of any quantity: a model of spectra that is trained, or a method that is fitted, in a run folder."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any

from learn.data.splits import GUARD_MOST, SPLITS, SplitKind
from learn.fitted.method_run import load_method, train_method
from learn.models.model_settings import MINUTES_MOST, Steps
from learn.quantities.quantity_table import QuantityName, quantity_named
from learn.training.config import Config, read_settings
from learn.training.registry import DEFAULT_MODEL, PresetName
from learn.training.run_folder import Run, load_spectra
from learn.training.train import train_spectra
from scenes.files.errors import (
    ParameterError,
    require_instance,
    require_path,
    require_positive,
    require_seed,
    require_within,
    require_word,
)
from scenes.files.options import changed, optional, taken, takes
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import read_dataset
from simulate.dataset.dataset_kinds import quantity_of


@takes(optional(Steps))
def train(
    dataset: Dataset | Path | str,
    output: Path | str,
    *,
    model: str = DEFAULT_MODEL,
    quantity: QuantityName | None = None,
    split: SplitKind = "files",
    guard: float = 0.0,
    seed: int = 0,
    options: Mapping[str, Any] | None = None,
    budget: float | None = None,
    preset: PresetName | None = None,
    trainer: Mapping[str, Any] | None = None,
    **settings: Any,
) -> Run:
    """Train a model on a dataset.

    The arguments from ``steps`` on are settings of training by gradient steps; None stands for the model's own default.
    A model that is fitted in closed form, such as "helmholtz" or "twin", takes none of them.

    The same call again resumes an interrupted run, or loads a finished one. The same settings on the same dataset give
    the same weights.

    Args:
        dataset: the dataset, or its folder.
        output: the run folder.
        model: name of a model: "helmholtz", "twin", "mirror-images", "bisplat", "bisplat-plus", "bisplat-aperture",
            "mlp", "mlp-responses", "nerf2", "swiftwrf", "wrf-gs-plus" or "gsrf" (documentation, The models); or your
            own subclass of ``bisplat.SpectrumModel`` as "module:Class", in the current folder or on Python's path. Of
            other quantities, the name of a method, as for ``compare``.
        quantity: what is learned: "spectrum", "response" (over a band), "power" or "channel". None: what the dataset
            mainly holds.
        split: how the test part is chosen: "files" (the folder's index files), "random" (a random fifth), "blocked"
            (every fourth block of ten consecutive spectra) or "area" (connected areas with a fifth).
        guard: known positions nearer than this to a test position are left out, wavelengths.
        seed: seed of the split, the initial weights and the order of the spectra.
        options: options of the model that differ from its defaults, such as ``{"primitives": 250}``.
        budget: training time, minutes, instead of a number of steps. It is turned into a number of steps by timing a
            few of them, and includes the search for responses behind pictures. None: the number of steps is set.
        preset: a published model with its number of steps: "paper" (BiSplat-WRF) or "paper-plus" (BiSplat-WRF+). It
            replaces ``model``. Settings that are given differ from it.
        trainer: where a training by steps runs, as arguments of Lightning's ``Trainer``: "devices", "num_nodes",
            "accelerator" and "strategy", such as ``{"devices": 2}``. The processes share the batch.
        **settings: those of ``Steps``.

    Returns:
        The trained run.

    Raises:
        ParameterError: the model is unknown or cannot be imported, or lacks one of the options; no split or preset has
            this name; settings of training by steps are given for a model that is fitted in closed form; steps are
            given beside a budget; or a number is out of its range.
        InputError: the dataset is not valid, has too few spectra for the split, or lacks what the model needs, such as
            responses; or the output folder holds other files or a run with other settings, or another process writes
            to it.

    Example:
        >>> import bisplat
        >>> run = bisplat.train("data/lab", "runs/example", model="mlp-responses", steps=2)
        >>> run.predict([[2.5, 3.0, 1.2]]).responses.shape
        (1, 16)
    """
    require_instance(Dataset, str, PathLike, dataset=dataset)
    require_path(output=output)
    require_word(SPLITS, split=split)
    for name, mapping in (("options", options), ("trainer", trainer)):
        if mapping is not None:
            require_instance(Mapping, **{name: mapping})
    if quantity is not None:
        quantity_named(quantity)  # refuses other words
    require_seed(seed=seed)
    require_within(0, GUARD_MOST, "wavelengths", guard=guard)
    (given,) = taken(settings, optional(Steps))
    by_steps = {name: value for name, value in changed(given).items() if value is not None}
    if budget is not None:
        require_positive(budget=budget)
        require_within(0, MINUTES_MOST, "minutes", budget=budget)
        if "steps" in by_steps:
            raise ParameterError("budget", f"expected none beside steps, found {by_steps['steps']} steps")
    options = dict(options or {})
    if isinstance(scene := options.get("scene"), str) and Path(scene).is_file():
        options["scene"] = str(Path(scene).resolve())
    loaded = dataset if isinstance(dataset, Dataset) else None
    folder = dataset.folder if isinstance(dataset, Dataset) else Path(dataset)
    kind = quantity or (quantity_of(folder) if loaded is None else loaded.quantities[0]) or "spectrum"
    of_method = kind != "spectrum"
    if of_method:
        others = {"preset": preset, "trainer": trainer, **by_steps, **options}
        idle = next((name for name, value in others.items() if value and name not in ("steps", "scene")), None)
        if idle is not None:
            raise ParameterError(idle, f"expected none for {quantity_named(kind).in_words}, found one")
        if "steps" in by_steps:
            options["steps"] = by_steps["steps"]
    config = Config(
        dataset=str(folder.resolve()),
        quantity=kind,
        model=model,
        split=split,
        guard=guard,
        seed=seed,
        split_seed=seed,
        options=options,
    )
    if of_method:
        return train_method(loaded or read_dataset(folder), Path(output), config, budget)
    return train_spectra(config, loaded, Path(output), budget, preset, trainer or {}, by_steps)


def load_run(folder: Path | str) -> Run:
    """Load a finished run, onto the GPU if there is one.

    Args:
        folder: the run folder, as ``train`` made it.

    Returns:
        The run, which predicts at new positions.

    Raises:
        InputError: the folder is not a run folder, or its training is not finished; the model is unknown or cannot be
            imported; or the weights are damaged, not finite, or those of another model.

    Example:
        >>> import bisplat
        >>> run = bisplat.load_run("runs/lab")
        >>> run.beamformer.array
        PlanarArray(rows=4, columns=4, spacing=0.5)
        >>> run.predict([[2.5, 3.0, 1.2]]).spectra.shape
        (1, 90, 360)
    """
    require_path(folder=folder)
    of_spectra = read_settings(Path(folder)).quantity == "spectrum"
    return load_spectra(folder) if of_spectra else load_method(Path(folder))
