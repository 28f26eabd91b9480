"""Runs of received powers, channels and responses over a band: a method that is fitted and kept in a run folder.

The folder has config.json and split.json, as that of a model of spectra. A method in closed form is fitted again when
it is loaded. Of one that is trained by steps, weights.safetensors keeps the network.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Num
from safetensors import SafetensorError
from safetensors.torch import load_file, save

from learn.comparison.compare import compare
from learn.comparison.comparison import Comparison
from learn.data.split_distances import SplitDistances, say_distances
from learn.data.splits import Split, distances_known
from learn.data.splits import split as split_of
from learn.fitted.fitted_method import Fitted, fit_method, make_method
from learn.quantities.known import Known, Method
from learn.quantities.quantity import Prediction
from learn.quantities.quantity_table import quantity_named
from learn.training.config import (
    Config,
    read_data,
    read_settings,
    require_same_spectra,
    require_same_split,
    write_config,
)
from learn.training.run_folder import Run, require_finished
from scenes.files.atomic import write_atomically
from scenes.files.errors import InputError, reason
from scenes.files.output_folder import own_folder
from scenes.files.plain_text import say
from simulate.dataset.dataset import Dataset


@dataclass(frozen=True, repr=False)
class MethodRun(Run):
    """A method that is fitted to received powers, channels or responses over a band.

    Attributes:
        fitted: the method, with the dataset and the rows that it knows.

    Example:
        >>> import bisplat
        >>> heard = {"powers": [[-48.0], [-60.0], [-57.0], [-52.0], [-55.0]], "gateways": {"door": (0, 0, 2)}}
        >>> places = [[1, 2, 1], [4, 2, 1], [3, 3, 1], [2, 2, 1], [3, 1, 1]]
        >>> hall = bisplat.write_dataset("court", places, **heard, frequency="2.4 GHz")
        >>> run = bisplat.train(hall, "runs/court", model="inverse-distance", split="random")
        >>> run.predict([[1, 2, 1]]).value.shape
        (1, 1)
    """

    fitted: Fitted = field(repr=False)

    def predict(
        self, positions: Float[np.ndarray, "K 3"] | None, given: Num[np.ndarray, "K ..."] | None = None
    ) -> Prediction:
        """Predict the quantity.

        Args:
            positions: [K, 3] transmitter positions, metres, world frame; None for channels without positions.
            given: of channels their uplinks [K, antennas, subcarriers]; of other quantities None.

        Returns:
            ``value`` [K, …]: powers [K, G] in dBm, responses [K, elements, subcarriers] or downlinks [K, antennas,
            subcarriers], and the ends ``low`` and ``high`` of the 90 % interval, or ``deviation``, where the method
            states them. A power below the dataset's ``floor_dbm`` predicts that nothing is received.

        Raises:
            ParameterError: the positions are not finite points, or ``given`` has another shape.
        """
        return self.fitted.predict(positions, given)


class Kept:
    """A fitted method as ``compare`` takes it. To fit it again changes nothing."""

    seconds = None  # of the fit, which was before

    def __init__(self, method: Method):
        self._method = method
        self.found = getattr(method, "found", None)

    def fit(self, known: Known) -> None:
        """Nothing: it is fitted to these rows."""

    def predict(self, *given: Any) -> Any:
        return self._method.predict(*given)


def evaluate_method(run: MethodRun) -> Comparison:
    """Score a run beside the baselines on the test part of its split."""
    config, label = run.config, run.config.model
    fitted = {label: Kept(run.fitted.method)}
    how: dict[str, Any] = {"split": config.split, "seed": config.split_seed, "guard": config.guard}
    return compare(run.fitted.dataset, fitted, quantity=config.quantity, **how)


def train_method(data: Dataset, folder: Path, config: Config, minutes: float | None) -> MethodRun:
    """Fit a method into a run folder, or load it if that has been done."""
    of = quantity_named(config.quantity)
    of.require(data)
    of.of(data, np.zeros(0, int))  # refuses data that lack it
    parts = split_of(data, config.split, config.split_seed, None, config.guard)
    scene: Any = config.options.get("scene")
    make_method(data, config.quantity, config.model, scene)  # refuses what cannot be fitted before there is a folder
    with own_folder(
        folder, "run", "config.json", config.settings(), lambda file: read_settings(file.parent).settings()
    ):
        if (folder / "config.json").exists():
            require_same_spectra(data, folder, read_data(folder).dataset_sha256)
            require_same_split(data, folder, config, parts)
        if (folder / "weights.safetensors").exists():
            return load_method(folder, data)
        write_config(folder, config, data, parts)
        if distances_known(data):
            known, tested = data.positions[parts.known], data.positions[parts.test]
            say_distances(SplitDistances.between(known, tested, data.wavelength), f"split {config.split}; ")
        fitted = _fitted(data, config, parts, config.options.get("steps"), minutes)
        if found := getattr(fitted.method, "found", None):
            say(f"{fitted.label}: {found}")
        network = getattr(fitted.method, "network", None)
        tensors = {} if network is None else {name: each.cpu() for name, each in network.state_dict().items()}
        write_atomically(folder / "weights.safetensors", save(tensors))
    return MethodRun(folder, config, data.fingerprint, data.frequency.hertz, fitted)


def load_method(folder: Path, data: Dataset | None = None) -> MethodRun:
    """Load a finished run: fit the method again to the rows that it knew, and give its network the kept weights."""
    config, path = read_settings(folder), require_finished(folder)
    recorded = read_data(folder)
    run = Run(folder, config, recorded.dataset_sha256, recorded.frequency_hz)
    data = run.dataset() if data is None else data
    fitted = _fitted(data, config, run.split(data), steps=0)
    network: Any = getattr(fitted.method, "network", None)
    try:
        weights = load_file(path)
        if network is not None:
            network.load_state_dict(weights)
    except (SafetensorError, RuntimeError, OSError) as error:
        raise InputError(f"{path}: expected the weights of {config.model}, found {reason(error)}") from error
    return MethodRun(folder, config, run.dataset_sha256, run.frequency, fitted)


def _fitted(data: Dataset, config: Config, parts: Split, steps: Any, minutes: float | None = None) -> Fitted:
    scene: Any = config.options.get("scene")
    return fit_method(
        data,
        config.quantity,
        config.model,
        known=quantity_named(config.quantity).drawn(parts.known, config.split_seed),
        seed=config.seed,
        scene=scene,
        steps=steps,
        minutes=minutes,
    )
